"""Whether a run whose steps follow from a tolerance will end: its pace, checked from time to time."""

from __future__ import annotations

import time as clock
from typing import NamedTuple

#: Wall time between two looks at the steps, s, and the number of steps left to take beyond which a run is ended.
LOOK, MOST_STEPS = 5.0, 1e8


class Stall(NamedTuple):
    """A run that would need too many steps.

    Attributes
    ----------
    reached : float, s; steps : int, taken since the look before, over `time` (s)
    left, rest : float, s, and the steps that they need at this pace
    """

    reached: float
    steps: int
    time: float
    left: float
    rest: float

    def __str__(self) -> str:
        """A sentence without its advice."""
        if not self.time > 0.0:
            return f"the run stands still at t = {self.reached:.6g} s: its last {self.steps} steps have no length"
        return (
            f"by t = {self.reached:.6g} s the steps have become so small, {self.time / max(self.steps, 1):.2g} s on "
            f"average, that the remaining {self.left:.3g} s would need {self.rest:.1e} steps"
        )


class Pace:
    """Looks every `LOOK` seconds at how far the steps since the look before have come."""

    def __init__(self, start: float) -> None:
        self.looked, self.time, self.steps = clock.perf_counter(), start, 0

    def stall(self, reached: float, steps: int, end: float, *, fixed: float | None = None) -> Stall | None:
        """What is wrong with the pace, if a look is due and too many steps are left.

        Parameters
        ----------
        reached, end : float, s; steps : int, taken so far
        fixed : float, s, length of fixed steps, which are not judged unless they were divided again and again
        """
        now = clock.perf_counter()
        if now - self.looked <= LOOK:
            return None
        taken, passed = steps - self.steps, reached - self.time
        rest = (end - reached) / max(passed, 1e-300) * taken
        self.looked, self.time, self.steps = now, reached, steps
        if rest > MOST_STEPS and not (fixed is not None and passed > 1e-3 * taken * fixed):
            return Stall(reached, taken, passed, end - reached, rest)
        return None
