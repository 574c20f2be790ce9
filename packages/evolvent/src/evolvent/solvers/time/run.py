"""What runs of all methods share: slices of the compiled loop, progress, stalls, interruption, laws that fail."""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from typing import Any

import numpy as np

from evolvent.compiled import codecache
from evolvent.solvers.common.hints import passages
from evolvent.solvers.common.laws import law_failure
from evolvent.solvers.common.solution import Solution
from evolvent.solvers.time.pace import Pace
from evolvent_base.errors import InputError

_SLICE = 0.15  # s of wall time between two looks at a running loop

#: Status and message of a run.
Ending = tuple[str, str]
FINISHED: Ending = ("success", "the run reached its end")


class MotionRun:
    """A plan that runs.

    Attributes
    ----------
    plan : with `assembly`, `times` and `step`
    work : workspace of the compiled loop, with the records `loop`
    budget, least, most : int, steps of the first slice, and bounds of those of the others
    compile_time : float, s
    """

    budget, least, most = 20, 10, 1_000_000
    work: Any
    compile_time: float

    def __init__(self, of: Any) -> None:
        self.plan, self.assembly, self.model = of, of.assembly, of.assembly.model

    @property
    def reached(self) -> float:
        """Time reached, s."""
        return float(self.work.loop.time)

    @property
    def name(self) -> str:
        """Name by which `codecache` knows whether the functions of the run are compiled."""
        return str(self.plan.method)

    def start(self) -> Ending | None:
        """Start the loop; returns how that failed, None where it did not."""
        return None

    def slice(self, budget: int) -> Ending | None:
        """Go on for `budget` steps; returns how the run has ended, None where it goes on."""
        raise NotImplementedError

    def moments(self) -> list[tuple[float, np.ndarray, np.ndarray]]:
        """Times and states at which the last step may have called a user's law."""
        raise NotImplementedError

    def stopped(self) -> Ending:
        """How a run ends that an event has stopped."""
        return "stopped by event", f"an event stopped the run at t = {self.reached:.9g} s"

    def stall_message(self, stall: Any) -> str:
        """Why a run of ever smaller steps is ended."""
        raise NotImplementedError

    def result(self, status: str, message: str, wall_time: float) -> Solution:
        """What the run has reached."""
        raise NotImplementedError

    def solution(self, progress: Callable[[float], None] | None) -> Solution:
        """Run to the end, or as far as the run comes; `progress` is called with the time reached."""
        began = clock.perf_counter()
        try:
            status, message = self.start() or self._loop(progress)
        except KeyboardInterrupt:
            status, message = "interrupted", f"interrupted at t = {self.reached:.6g} s; what was computed is kept"
        except InputError:
            raise
        except Exception as error:  # noqa: BLE001  (whatever a user's law may raise)
            failure = law_failure(self.assembly, error, self.moments())
            status, message = "failed", f"{failure}; what was computed is kept"
        wall_time = clock.perf_counter() - began
        codecache.mark_warm(self.name)
        found = self.result(status, message, wall_time)
        found.passages = passages(self.assembly)
        return found

    def _loop(self, progress: Callable[[float], None] | None) -> Ending:
        """Call the compiled loop until it ends; returns how."""
        budget, pace = self.budget, Pace(self.reached)
        while True:
            slice_began, before = clock.perf_counter(), int(self.work.loop.steps)
            ended = self.slice(budget)
            if ended is not None:
                return ended
            spent, taken = clock.perf_counter() - slice_began, int(self.work.loop.steps) - before
            if taken > budget // 2:
                budget = max(self.least, min(int(taken * min(_SLICE / max(spent, 1e-6), 4.0)), self.most))
            stall = pace.stall(
                self.reached, int(self.work.loop.steps), float(self.plan.times[-1]), fixed=self.plan.step
            )
            if stall is not None:
                return "failed", self.stall_message(stall)
            if progress is not None:
                progress(self.reached)
