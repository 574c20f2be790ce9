"""Explicit runs: choose a step, check the options, then run."""

from __future__ import annotations

import dataclasses
import math
import time as clock
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np

from evolvent.assembly import families, needs
from evolvent.assembly.assembled import Assembly
from evolvent.model import family
from evolvent.model.registry import asked, families as table, is_by_rates
from evolvent.parts.checks import positive
from evolvent.solvers.common.laws import refusing_laws, try_laws
from evolvent.solvers.common.solution import Solution
from evolvent.solvers.common.start import STEP_ALLOWED, check_redundancy, check_start, sample_times
from evolvent.solvers.time.explicit.methods import METHODS, Method
from evolvent.solvers.time.explicit.run import ExplicitRun, cache_name, load, loop_record
from evolvent.solvers.time.explicit.stability import Mode, energy_change, fastest_mode, stability_limit
from evolvent_base.errors import InputError, nearest

__all__ = ["METHODS", "ExplicitPlan", "cache_name", "choose_step", "plan", "sample_times", "solve", "stable_step"]

#: Share of RK4's stability limit taken by an automatic step where beams touch something. Dissipation stiffens a contact
#: onto which a beam whips: 0.42 loses the energy balance of a wrapped rib there, 0.2 keeps it within 0.6 % of the
#: energy, 0.1 within 0.1 %.
CONTACT_SAFETY = 0.1
#: Share of its energy that the fastest mode may lose (or gain) over a run with an automatic step, where that mode is
#: not a thread's.
FASTEST_MODE_LOSS = 1e-4
#: Steps beyond which a run is refused before it starts: at a microsecond each they take a quarter of an hour, of a
#: larger model days.
MOST_STEPS = 1e9
#: Tolerances of dopri5 where none are given.
RTOL, ATOL = 1e-8, 1e-10


def stable_step(assembly: Assembly, method: str, duration: float) -> tuple[Mode, float]:
    """The fastest mode of a model, and the stability limit of a method on it, s.

    Raises
    ------
    InputError
        If a run of `duration` s would take more than `MOST_STEPS` stable steps.
    """
    with refusing_laws(assembly):
        mode = fastest_mode(assembly)
    limit = stability_limit(METHODS[method], mode, duration)
    if duration > MOST_STEPS * limit:
        raise InputError(f"{method} is stable with steps up to {limit:.2g} s here, {_endless(duration, limit, mode)}")
    return mode, limit


def _endless(duration: float, step: float, mode: Mode) -> str:
    """The end of a sentence on a run with too many steps."""
    return (
        f"{duration / step:.2g} steps in all, more than {MOST_STEPS:.0e} (highest frequency {mode.frequency:.3g} "
        f"rad/s, highest damping rate {mode.largest_damping_rate:.3g} 1/s, in {mode.where!r}); use less damping or "
        f"stiffness, or an implicit method"
    )


def choose_step(assembly: Assembly, method: str, step: float | None, duration: float) -> tuple[float, float, Mode]:
    """A stable step for a fixed-step method: (step, limit, fastest mode).

    Raises
    ------
    InputError
        If `step` is above the stability limit, or none is given and the model has no frequency to choose by, or the
        run would take more than `MOST_STEPS` of it.
    """
    mode, limit = stable_step(assembly, method, duration)
    if step is None:
        found = _automatic_step(assembly, METHODS[method], duration, limit, mode)
        if duration > MOST_STEPS * found:
            why = f"{method} takes steps of {found:.2g} s here, by which its fastest mode keeps its energy"
            raise InputError(f"{why}, {_endless(duration, found, mode)}")
        return found, limit, mode
    step = positive("step", step, allowed=STEP_ALLOWED)
    if step > limit:
        raise InputError(
            f"step is {step:.6g} s, above the stability limit {limit:.6g} s of {method} "
            f"(highest frequency {mode.frequency:.6g} rad/s, in {mode.where!r}); use a smaller one, or None"
        )
    return float(step), limit, mode


def _automatic_step(assembly: Assembly, method: Method, duration: float, limit: float, mode: Mode) -> float:
    """The step that is taken where none is given, s."""
    if not math.isfinite(limit):
        raise InputError("step is None, but nothing in the model sets a frequency; give a step in seconds")
    model = assembly.model
    fastest, every = assembly.names.get(mode.where, ("",))[0], table()
    waves = {name: part(own) for name, part in asked("stability.waves").items() if (own := getattr(model, name)).size}
    if any(name == fastest or every[name].is_by_rates(model) for name in waves) or model.info.penalties > 0:
        # the motion lies far below the waves along what is long: stability is enough
        safe = limit * min([method.safety, *waves.values()])
        if assembly.model.contact_surfaces.size:
            safe = min(safe, CONTACT_SAFETY * stability_limit(METHODS["rk4"], mode, duration))
        return safe
    if mode.frequency == 0.0:  # nothing but dampers
        return limit * method.safety
    order, change = energy_change(method)
    accurate = (FASTEST_MODE_LOSS / (change * mode.frequency * duration)) ** (1.0 / order) / mode.frequency
    return min(limit * method.safety, accurate)


@dataclasses.dataclass(frozen=True)
class ExplicitPlan:
    """An explicit run, checked and prepared.

    Attributes
    ----------
    assembly : Assembly, with a model of the run's own
    times : (nt,) float, s, of the samples
    method : a name of `METHODS`
    step, limit : float, s, step of a fixed-step method (None of an adaptive one), and the largest stable one
    asked : float, s, the step that was asked for; None where it was to be chosen
    mode : Mode, the fastest one; None where it was not looked for
    rtol, atol : float, of the adaptive method
    compile_time : float, s, taken so far
    """

    assembly: Assembly
    times: np.ndarray
    method: str
    step: float | None
    limit: float
    mode: Mode | None
    rtol: float
    atol: float
    compile_time: float
    asked: float | None = None
    #: Fields of the workspace that a plan has made.
    made: ClassVar[tuple[str, ...]] = ("loop",)

    def again(self, assembly: Assembly) -> dict[str, Any]:
        """The fields `made` of the plan that another model of the same structure would have.

        Parameters
        ----------
        assembly : with a model of its own, that of the plan with other numbers

        Raises
        ------
        InputError
            As of `choose_step`.
        """
        if self.step is None:
            return {}
        duration = float(self.times[-1] - self.times[0])
        return {"loop": loop_record(self.times, choose_step(assembly, self.method, self.asked, duration)[0])}

    def run(self, progress: Callable[[float], None] | None = None) -> Solution:
        """Integrate; `progress` is called with the time reached, a few times a second.

        A run that fails keeps the samples that it reached. Ctrl-C ends it with the status "interrupted".
        """
        return ExplicitRun(self).solution(progress)

    def going_on(self, times: np.ndarray, y: np.ndarray, s: np.ndarray) -> ExplicitPlan:
        """The same run over other times, from another state."""
        return dataclasses.replace(self, assembly=dataclasses.replace(self.assembly, y=y, s=s), times=times)


def plan(
    assembly: Assembly,
    *,
    samples: Any,
    method: str = "rk4",
    step: float | None = None,
    rtol: float = RTOL,
    atol: float = ATOL,
    unsafe_step: bool = False,
) -> ExplicitPlan:
    """Check and prepare an explicit run.

    Parameters
    ----------
    assembly : Assembly, which is left as it is
    samples : (nt,) float, s, increasing; the first is the start, the last the end; they cut no step
    method : a name of `METHODS`
    step : float, s, of a fixed-step method; None chooses one from the model's highest frequency
    rtol, atol : float, of the adaptive method
    unsafe_step : bool, take a step above the stability limit all the same (the energy balance is still checked)

    Raises
    ------
    InputError
        For an unknown method, an unstable step, samples out of order, or a law that fails at the start.
    """
    if method not in METHODS:
        raise InputError(f"method is {method!r}; {nearest(str(method), METHODS)}")
    times = sample_times(samples)
    families.check(assembly, family.EXPLICIT)
    own = dataclasses.replace(assembly, model=assembly.model.copy())
    needs.note_alike(assembly.model, own.model)
    try_laws(own, times[0], times[-1])
    check_start(own, float(times[0]))
    check_redundancy(own, float(times[0]))
    asked = step
    began, duration, limit, mode = clock.perf_counter(), float(times[-1] - times[0]), math.inf, None
    if step is None:  # which needs compiled functions: all that the run needs are compiled at once
        load(own.model, METHODS[method], rtol=rtol, atol=atol)
    compile_time = clock.perf_counter() - began
    if not METHODS[method].is_adaptive:
        if unsafe_step and step is not None:
            step = positive("step", step, allowed=STEP_ALLOWED)
            step, (mode, limit) = float(step), stable_step(own, method, duration)
        else:
            step, limit, mode = choose_step(own, method, step, duration)
    else:
        step, rtol, atol = None, positive("rtol", rtol), positive("atol", atol)
        # of beams the fastest mode takes longer to find than a run may take
        if not is_by_rates(own.model):
            stable_step(own, method, duration)
    return ExplicitPlan(own, times, method, step, limit, mode, rtol, atol, compile_time, asked)


def solve(assembly: Assembly, *, progress: Callable[[float], None] | None = None, **options: Any) -> Solution:
    """Integrate an assembled model over time by an explicit method: `plan`, whose options these are, and run.

    Parameters
    ----------
    progress : called with the time reached (s), a few times a second

    Returns
    -------
    Solution
        A run that fails keeps the samples that it reached. Ctrl-C ends it with the status "interrupted".

    Raises
    ------
    InputError
        As of `plan`.
    """
    return plan(assembly, **options).run(progress)
