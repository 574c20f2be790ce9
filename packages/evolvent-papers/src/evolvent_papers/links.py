"""Runs of a heliogyro's blades as links of fixed length, many times, for searches."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent import cases
from evolvent_papers.heliogyro.case import WAYS

if TYPE_CHECKING:
    from evolvent.solvers import Solution

#: Links of fixed length, whose lag is that of springs of 1e4 N/m to 0.0015 degrees, with tolerances for a search.
LINKS: dict[str, Any] = {
    "blade.segments": "inextensible", "solver.method": "dopri5", "solver.rtol": 1e-6, "solver.atol": 1e-8,
    "solver.step": "auto", "output.fine": False,
    "blade.boundary_segment": "constant", "blade.shortest_fraction": 0.1,
    "blade.mesh": "material",
}  # fmt: skip


def spool_keys(**motion: Any) -> dict[str, Any]:
    """Keys of the case with which its spools turn as `motion` says alone; other keys of their motion are left out.

    Parameters
    ----------
    motion : keys of `spool` that say how it turns: rate, ramp, changes, table, free, feedback
    """
    still: dict[str, Any] = {"rate": None, "ramp": 0.0, "changes": []} | dict.fromkeys(WAYS)
    return {f"spool.{key}": value for key, value in (still | motion).items()}


def solve(case: Any, given: Mapping[str, Any], times: np.ndarray | None = None) -> Solution:
    """A run of a checked case with other values of its keys, without results of the system.

    Parameters
    ----------
    times : (nt,) float, s, of the samples; those of the case if left out
    """
    made = cases.load(case.model_dump(mode="json"), LINKS | dict(given))
    system = cases.system(made.system)
    assembly, own, settings = system.assembled(made, {})
    settings.pop("fine", None)
    samples = own if times is None else times
    _, prepare, _ = system.prepare_run(made, assembly, samples, settings)
    solution: Solution = prepare()[0].run(None).or_start(float(samples[0]))
    return solution
