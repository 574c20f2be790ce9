"""Clearances by name, among what is kept of a run: ``clearance``, of all pairs, and ``panel 1 - bus.clearance``.

They are the smallest distances of `run.ev.clearance` at the samples, below 0 where bodies are inside one another.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from evolvent import analysis
from evolvent.analysis import trees
from evolvent.results.kept import split
from evolvent_base.errors import InputError, nearest

if TYPE_CHECKING:
    from evolvent.solvers.common.solution import Solution

#: The variable, and what stands between the names of a pair.
CLEARANCE, BETWEEN = "clearance", " - "
UNIT = "m"


def is_clearance(wanted: str) -> bool:
    """Whether a name of what is kept is that of a clearance."""
    pair, _, variable = split(wanted)[0].rpartition(".")
    return variable == CLEARANCE and (not pair or BETWEEN in pair)


def check(parts: Mapping[str, Any], names: Sequence[str]) -> None:
    """Refuse clearances that runs of some parts will not have.

    Raises
    ------
    InputError
    """
    if names:
        analysis.clearance.check_package()
    for wanted in names:
        _pairs(parts, wanted)


def values(solution: Solution, names: Sequence[str]) -> dict[str, xr.Variable]:
    """The clearances by name."""
    if not names:
        return {}
    parts = solution.assembly.parts
    pairs = {wanted: _pairs(parts, wanted) for wanted in names}
    run = trees.tree(solution, case="", why="", keep_states=True)
    asked = dict.fromkeys(pair for found in pairs.values() for pair in found)
    found = analysis.clearance.clearances(run, list(asked)).dataset["smallest"]
    seen = dict(zip(asked, found.values, strict=True))
    return {
        wanted: xr.Variable(
            (), np.min([seen[pair] for pair in found]), {"units": UNIT, "long_name": f"{wanted}: smallest clearance"}
        )
        for wanted, found in pairs.items()
    }


def _pairs(parts: Mapping[str, Any], wanted: str) -> list[tuple[str, str]]:
    """Pairs of bodies that a name is of."""
    name, reduction = split(wanted)
    if reduction:
        raise InputError(f"keep holds {wanted!r}, but {name!r} is the smallest over the run; write {name!r}")
    found = analysis.clearance.checked_pairs(parts)
    pair = name.rpartition(".")[0]
    if not pair:
        return found
    words = pair.split(BETWEEN)
    ways = [(BETWEEN.join(words[:k]), BETWEEN.join(words[k:])) for k in range(1, len(words))]
    known = [(a, b) for a, b in ways if a in parts and b in parts]
    if not known:
        shown = nearest(pair, [BETWEEN.join(one) for one in found])
        raise InputError(f"{wanted!r} is of no pair of bodies; {shown}")
    return analysis.clearance.checked_pairs(parts, known[:1])
