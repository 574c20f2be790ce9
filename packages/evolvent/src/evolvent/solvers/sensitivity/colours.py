"""Unknowns of a matrix in colours: no two of one colour have an equation in common, so that one change serves all."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from evolvent.algebra import sparse

Array = np.ndarray


def equations_of(matrix: Any, n: int) -> list[Array]:
    """Equations in which each of n unknowns may be, by the blocks of a matrix."""
    table, later, unknown = matrix.table, matrix.later, matrix.unknown
    own = [unknown[row[sparse.START] : row[sparse.START] + row[sparse.SIZE]] for row in table]
    beside = [{b} for b in range(len(own))]
    for b, row in enumerate(table):
        for other in later[row[sparse.FIRST] : row[sparse.FIRST] + row[sparse.COUNT], sparse.BLOCK]:
            beside[b].add(int(other))
            beside[int(other)].add(b)
    found = [np.zeros(0, dtype=np.int64)] * n
    for b, others in enumerate(beside):
        for j in own[b]:
            found[j] = np.sort(np.concatenate([own[k] for k in sorted(others)]))
    return found


def coloured(equations: Sequence[Array], unknowns: Iterable[int], n: int) -> list[list[int]]:
    """Unknowns of each colour, by their equations of n."""
    taken: list[Array] = []
    found: list[list[int]] = []
    for j in unknowns:
        k = next((k for k, used in enumerate(taken) if not np.any(used[equations[j]])), len(taken))
        if k == len(taken):
            taken.append(np.zeros(n, dtype=bool))
            found.append([])
        taken[k][equations[j]] = True
        found[k].append(j)
    return found


def joined(parts: Sequence[Sequence[int] | Array]) -> tuple[Array, Array]:
    """Where each of several lists starts in all of them, (n + 1,) int, and all of them behind one another."""
    starts = np.cumsum([0, *(len(one) for one in parts)])
    return starts, np.concatenate([*parts, np.zeros(0, dtype=np.int64)]).astype(np.int64)
