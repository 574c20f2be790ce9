"""What steps and solvers leave out of threads: captures within a step, weights at rest, mass on free bodies."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent.kernels import rigid, thread
from evolvent.kernels.markers import ON_BODY

#: Share of the weights on threads, lifted by the longest, beside which a gain of energy counts.
_LIFTED = 1e-2


def lifted(model: Any) -> float:
    """Energy whose round-off steps do not resolve, J (`Energies.round_off`).

    A weight at rest on a stiff thread has no energy but that of the thread, whose elongation is below the tolerance of
    a step: there a gain counts beside weights lifted by `_LIFTED` of the thread.
    """
    if not model.threads.size:
        return 0.0
    free = model.bodies["mass"][model.bodies["motion"] == rigid.FREE]
    total = model.nodes["mass"].sum() + model.points["mass"].sum() + free.sum()
    length = float(np.max(model.threads["n"] * model.threads["segment"]))
    return _LIFTED * float(total) * float(np.linalg.norm(model.info["gravity"])) * length


def captures(solution: Any) -> Iterator[tuple[int, float, float, str]]:
    """Nodes that came back to their spools, with a quarter of the period by which the last segment swings then.

    The tension is that of the sample before (`NodeEvents.captures`).
    """
    model = solution.assembly.model
    for time, kind in zip(solution.event_times.tolist(), solution.event_kinds.tolist(), strict=True):
        p, back = divmod(int(kind), 2)
        at = int(np.searchsorted(solution.t, time)) - 1
        if not back or p >= model.threads.size or at < 0 or solution.s[at, p] < 1:
            continue
        row = model.threads[p]
        node = int(row["node"] + solution.s[at, p]) - 1
        tension, mass = float(solution.observations.tension[at, node]), float(model.nodes["mass"][node])
        if tension > 0.0:
            swing = math.sqrt(float(row["capture"] * row["segment"]) * mass / tension)
            yield p, time, 0.5 * math.pi * swing, "takes up a node"


def unsteady(model: Any, orbits: bool) -> Iterator[tuple[int, str]]:
    """Threads with mass on a free body, or that flow to a take-up reel (`Statics.unsteady`)."""
    free = model.bodies["motion"] == rigid.FREE
    turn, orbit = "centrifugal forces equilibria in a steady turn", "gyroscopic forces in an orbital frame modes"
    mass = (
        f"the thread {{name}} has mass on a free body, by wound_mass 'carried' or by its `end`, whose "
        f"{orbit if orbits else turn} leave out; use wound_mass 'ignored', or end it at a point mass"
    )
    for p, row in enumerate(model.threads):
        marker = model.markers[row["end"]] if row["end"] >= 0 else None
        ends_there = marker is not None and bool(marker["kind"] == ON_BODY and free[marker["index"]])
        if ends_there or (row["carried"] != 0 and free[row["body"]]):
            yield p, mass
    flows = "rotating does not support the thread {name}, which flows to a take-up reel"
    for p in np.flatnonzero(model.threads["take_drive"] >= 0).tolist() if not orbits else ():
        yield p, f"{flows}; leave out rotating, or its `take_up`"


def tensions(solution: Any) -> Iterator[tuple[int, np.ndarray, float, bool]]:
    """Tensions of threads (`Notes.tensions`); those of nodes on their spools are zero."""
    for index, row in enumerate(solution.assembly.model.threads):
        first = int(row["node"])
        tension = solution.observations.tension[:, first : first + int(row["n"])]
        yield index, tension.min(axis=1), float(tension.max()), row["kind"] in (thread.SPRINGS, thread.MOVING)
