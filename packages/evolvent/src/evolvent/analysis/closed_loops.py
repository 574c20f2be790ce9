"""Runs with loops of feedback."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from evolvent.analysis.feedback import with_tables
from evolvent.analysis.stepping import SteppedAssembly
from evolvent.assembly.assembled import Assembly
from evolvent.solvers.common.solution import Solution
from evolvent.solvers.common.start import sample_times
from evolvent.solvers.time.explicit import plan as explicit_plan
from evolvent_base.errors import RunFailed


class ClosedPlan:
    """A run with loops of feedback: they are followed first, then the motion is solved with what they commanded.

    Attributes
    ----------
    plan : ExplicitPlan, of the run with the tables
    stepper : SteppedAssembly, that follows the loops
    """

    def __init__(self, plan: explicit_plan.ExplicitPlan, stepper: SteppedAssembly) -> None:
        self.plan, self.stepper = plan, stepper

    @property
    def step(self) -> float | None:
        """Step of the method, s; None of an adaptive one."""
        return self.plan.step

    def run(self, progress: Callable[[float], None] | None = None) -> Solution:
        """Follow the loops, then integrate; `progress` is called with times from the start to the end."""
        times = self.plan.times
        start, end = float(times[0]), float(times[-1])
        stop, status, message = end, "", ""
        try:
            for stop in self.stepper.stops(end):
                self.stepper.go_to(stop)
                if progress is not None:
                    progress(0.5 * (start + stop))
        except KeyboardInterrupt:
            status = "interrupted"
            message = f"interrupted at t = {self.stepper.time:.6g} s; what was computed is kept"
        except RunFailed as error:
            status, message = "failed", f"{error}; what was computed is kept"
        own = self.plan
        own.assembly.model.parameters[:] = self.stepper.assembly.model.parameters
        if status:  # up to where the tables are written
            own = own.going_on(np.append(times[times < stop], stop), own.assembly.y, own.assembly.s)
        solution = own.run(None if progress is None else lambda t: progress(0.5 * (t + end)))
        solution.measured = self.stepper.measured
        if status and solution.status == "success":
            solution = solution.chosen(solution.t <= self.stepper.time)
            solution.status, solution.message = status, message
        return solution


def prepared(assembly: Assembly, samples: np.ndarray, **options: Any) -> explicit_plan.ExplicitPlan | ClosedPlan:
    """A prepared explicit run, whose loops of feedback are closed where there are any.

    Parameters
    ----------
    options : of `evolvent.solvers.time.explicit.plan.plan`
    """
    times = sample_times(samples)
    whole, loops = with_tables(assembly, float(times[0]), float(times[-1]))
    plan = explicit_plan.plan(whole, samples=times, **options)
    if not loops:
        return plan
    stepper = SteppedAssembly(
        assembly, method=plan.method, start=float(times[0]), until=float(times[-1]), step=plan.step,
        tolerance=plan.rtol, absolute_tolerance=plan.atol,
    )  # fmt: skip
    return ClosedPlan(plan, stepper)
