"""Unknowns in colours: no two of one colour have an equation in common, so that one change serves all of them."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence

import numpy as np

from evolvent.assembly.assembled import Assembly
from evolvent.solvers.common.graph import pattern_of

Array = np.ndarray


def equations_of(assembly: Assembly) -> list[Array]:
    """Equations in which each unknown of a model may be; variants of a system share them.

    Those of the blocks that it couples to, and of all that act on one another by the same constraints.
    """
    shared = None if assembly.model.info.releases else assembly.shared
    if shared is not None and "equations" in shared:
        found: list[Array] = shared["equations"]
        return found
    pattern = pattern_of(assembly.model)
    beside = [{b} for b in range(len(pattern.blocks))]
    for a, b in pattern.pairs.tolist():
        beside[a].add(b)
        beside[b].add(a)
    for b in np.flatnonzero(pattern.multipliers).tolist():
        for a, c in itertools.permutations(sorted(beside[b]), 2):
            beside[a].add(c)
    found = [np.zeros(0, dtype=np.int64)] * sum(len(own) for own in pattern.blocks)
    for own, others in zip(pattern.blocks, beside, strict=True):
        equations = np.sort(np.concatenate([pattern.blocks[k] for k in sorted(others)]))
        for j in own.tolist():
            found[j] = equations
    if shared is not None:
        shared["equations"] = found
    return found


def coloured(equations: Sequence[Array], unknowns: Iterable[int]) -> list[list[int]]:
    """Unknowns of each colour, by their equations."""
    taken: list[Array] = []
    found: list[list[int]] = []
    for j in unknowns:
        own = equations[j]
        k = next((k for k, used in enumerate(taken) if not used[own].any()), len(taken))
        if k == len(taken):
            taken.append(np.zeros(len(equations), dtype=bool))
            found.append([])
        taken[k][own] = True
        found[k].append(j)
    return found


def joined(parts: Sequence[Sequence[int] | Array]) -> tuple[Array, Array]:
    """Where each of several lists starts in all of them, (n + 1,) int, and all of them behind one another."""
    starts = np.cumsum([0, *(len(one) for one in parts)])
    return starts, np.concatenate([*parts, np.zeros(0, dtype=np.int64)]).astype(np.int64)
