"""Captures that are over within a step: latches of joint coordinates, and others.

A latch that has locked brings its coordinate x to rest: J x'' + c x' + k x = 0 from the rate x'(0) with which it was
reached, k and c of the latch. J follows from the first step after it, whatever its length: over the step the latch
changes the momentum by h (k x/2 + c x/h), x being reached at its end.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from evolvent.model.registry import asked, motions
from evolvent.solvers.common.solution import Capture, Solution
from evolvent.solvers.time.implicit.workspace import Workspace

#: Steps in a capture that resolve it.
STEPS = 10


class Captures:
    """Captures by latches in a run of fixed steps.

    Attributes
    ----------
    found : list of Capture
    """

    def __init__(self) -> None:
        self.found: list[Capture] = []
        self._locked: list[tuple[int, float]] = []
        self._seen = self._steps = 0

    @property
    def is_due(self) -> bool:
        """Whether the next step is the first after a latch."""
        return bool(self._locked)

    def look(self, coordinates: np.ndarray, work: Workspace) -> None:
        """Look at the last step: at what has locked at its end, and at what the latches before have done in it."""
        loop, options = work.loop, work.options
        if self._locked and int(loop.steps) > self._steps:
            for k, time in self._locked:
                row, h = coordinates[k], float(loop.tried)  # `last` is 0 where this step ends on a latch, too
                moved, start = float(row["angle"] - row["latch"]), float(row["caught"])
                end = 2.0 * moved / h - start if options.midpoint else float(row["rate"])
                self.found.append(Capture(motions(), k, time, capture_time(row, h, moved, start, end)))
            self._locked = []
        now = int(loop.latches)
        own = zip(work.log_k[self._seen : now].tolist(), work.log_t[self._seen : now].tolist(), strict=True)
        self._locked += [(int(k), float(t)) for k, t in own if k >= 0]
        self._seen, self._steps = now, int(loop.steps)


def capture_time(row: Any, h: float, moved: float, start: float, end: float) -> float:
    """Time (s) in which a latch brings its coordinate to rest, from the first step; infinity where that shows none.

    Parameters
    ----------
    row : record of the coordinate
    h : float, s, length of the step; moved : float, rad or m, over it; start, end : float, rad/s or m/s, rates
    """
    stiffness, damping = float(row["latch_stiffness"]), float(row["latch_damping"])
    impulse = h * (0.5 * stiffness * moved + damping * moved / h)
    if not impulse * (start - end) > 0.0:
        return math.inf
    inertia = impulse / (start - end)
    return 1.0 / (2.0 / math.pi * math.sqrt(stiffness / inertia) + damping / inertia)


def captures_of(solution: Solution) -> list[Capture]:
    """Captures in a run: by latches, and what families state (`NodeEvents.captures`)."""
    own = asked("node_events.captures").items()
    return [*solution.captures, *(Capture(name, *found) for name, captures in own for found in captures(solution))]
