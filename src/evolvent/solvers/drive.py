"""Explicit runs: choose a step, run the compiled loop, check the energy balance, report how it ended."""

from __future__ import annotations

import dataclasses
import math
import time as clock
from collections.abc import Callable
from typing import Any

import numpy as np

from evolvent import model as mdl
from evolvent.assembly import families, needs
from evolvent.assembly.assembled import Assembly
from evolvent.base.errors import InputError, nearest
from evolvent.compiled import codecache
from evolvent.compiled.pointer import zeros_record
from evolvent.flow.rhs import rhs
from evolvent.kernels import thread
from evolvent.parts.checks import positive
from evolvent.solvers import balance as eb
from evolvent.solvers import explicit as ex
from evolvent.solvers.implicit_setup import strain_round_off
from evolvent.solvers.laws import (
    broken_law,
    large_law,
    law_failure,
    refusing_laws,
    states_energy,
    try_laws,
    what_may_jump,
)
from evolvent.solvers.observations import sums_of
from evolvent.solvers.pace import Pace, Stall
from evolvent.solvers.releases import reason_of_outrun
from evolvent.solvers.sampled import balances
from evolvent.solvers.solution import Solution
from evolvent.solvers.stability import Mode, fastest_mode, stability_limit

METHODS = {"heun": ex.HEUN, "rk4": ex.RK4, "dopri5": ex.DOPRI5}
#: Share of the stability limit taken by an automatic step. RK4 damps the ringing that every release leaves in a
#: thread: at 0.42 that costs the heliogyro 0.92e-6 of its energy, at 0.8 1.5e-6.
SAFETY = {"heun": 0.5, "rk4": 0.42}
#: Share of RK4's stability limit taken by an automatic step where beams touch something. Dissipation stiffens a contact
#: onto which a beam whips: 0.42 loses the energy balance of a wrapped rib there, 0.2 keeps it within 0.6 % of the
#: energy, 0.1 within 0.1 %.
CONTACT_SAFETY = 0.1
#: Share of its energy that the fastest mode may lose (or gain) over a run with an automatic step, where that mode is
#: not a thread's; and (k, f) of each method's share omega T (omega h)^k / f.
FASTEST_MODE_LOSS = 1e-4
ENERGY_LOSS = {"heun": (3, 4.0), "rk4": (5, 72.0)}
#: Stable steps beyond which an explicit run is refused: at a microsecond each they take hours.
MOST_STEPS = 1e10
#: Defect, in parts of the energy moved, at which a run is ended early. Smaller ones are judged at the end: at the start
#: of a motion from rest hardly any energy was moved.
DIVERGED = 10.0
#: Number of samples whose balance is evaluated where it closes; all where it does not.
LOOKED_AT = 100
#: Share of a run in which a whole log of events is not plausible: the same ones fire again and again.
CHATTER = 1e-6
#: What a step may be, in messages.
STEP_ALLOWED = "a finite time above 0, or None"
_SLICE = 0.15  # s of wall time between two reports of a running loop
#: Number of energy checks over a run with fixed steps; steps between two of them in a run with adaptive ones.
CHECKS, CHECK_EVERY = 50, 2000


def cache_name(assembly: Assembly, method: str) -> str:
    """Name by which `codecache` knows whether the functions of a run are compiled; beams need more of them."""
    f = assembly.model.flexible
    if method not in METHODS or not (f.beams.size or f.rods.size):
        return method
    return f"{method} with beams" if f.beams.size else f"{method} with rods"


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
        raise InputError(
            f"{method} is stable with steps up to {limit:.2g} s here, {duration / limit:.2g} steps in all (highest "
            f"frequency {mode.frequency:.3g} rad/s, highest damping rate {mode.largest_damping_rate:.3g} 1/s, in "
            f"{mode.where!r}); use less damping or stiffness, or an implicit method"
        )
    return mode, limit


def choose_step(assembly: Assembly, method: str, step: float | None, duration: float) -> tuple[float, float, Mode]:
    """A stable step for a fixed-step method: (step, limit, fastest mode).

    Raises
    ------
    InputError
        If `step` is above the stability limit, or none is given and the model has no frequency to choose by.
    """
    mode, limit = stable_step(assembly, method, duration)
    if step is None:
        if not math.isfinite(limit):
            raise InputError("step is None, but nothing in the model sets a frequency; give a step in seconds")
        f = assembly.model.flexible
        beams = f.beams.size > 0 or f.rods.size > 0 or assembly.model.info.penalties > 0
        if assembly.names.get(mode.where, ("",))[0] == "threads" or beams:
            # the motion lies far below the waves along a thread or beam: stability is enough, unless links are rigid
            rigid_links = bool(np.any(assembly.model.threads["kind"] == thread.INEXTENSIBLE))
            safe = limit * (0.25 if rigid_links else SAFETY[method])
            if assembly.model.flexible.cylinders.size:
                safe = min(safe, CONTACT_SAFETY * stability_limit(METHODS["rk4"], mode, duration))
            return safe, limit, mode
        order, factor = ENERGY_LOSS[method]
        if mode.frequency == 0.0:  # nothing but dampers
            return limit * SAFETY[method], limit, mode
        accurate = (FASTEST_MODE_LOSS * factor / (mode.frequency * duration)) ** (1.0 / order) / mode.frequency
        return min(limit * SAFETY[method], accurate), limit, mode
    step = positive("step", step, allowed=STEP_ALLOWED)
    if step > limit:
        raise InputError(
            f"step is {step:.6g} s, above the stability limit {limit:.6g} s of {method} "
            f"(highest frequency {mode.frequency:.6g} rad/s, in {mode.where!r}); use a smaller one, or None"
        )
    return float(step), limit, mode


@dataclasses.dataclass(frozen=True)
class Plan:
    """An explicit run, checked and prepared.

    Attributes
    ----------
    assembly : Assembly, with a model of the run's own
    times : (nt,) float, s, of the samples
    method : {"rk4", "heun", "dopri5"}
    step, limit : float, s, step of a fixed-step method (None of dopri5), and the largest stable one
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

    def run(self, progress: Callable[[float], None] | None = None) -> Solution:
        """Integrate; `progress` is called with the time reached, a few times a second.

        A run that fails keeps the samples that it reached. Ctrl-C ends it with the status "interrupted".
        """
        return _Run(self).solution(progress)

    def going_on(self, times: np.ndarray, y: np.ndarray, s: np.ndarray) -> Plan:
        """The same run over other times, from another state."""
        return dataclasses.replace(self, assembly=dataclasses.replace(self.assembly, y=y, s=s), times=times)


def plan(
    assembly: Assembly,
    *,
    samples: Any,
    method: str = "rk4",
    step: float | None = None,
    rtol: float = 1e-8,
    atol: float = 1e-10,
    unsafe_step: bool = False,
) -> Plan:
    """Check and prepare an explicit run.

    Parameters
    ----------
    assembly : Assembly, which is left as it is
    samples : (nt,) float, s, increasing; the first is the start, the last the end; they cut no step
    method : {"rk4", "heun", "dopri5"}
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
    families.check(assembly, families.EXPLICIT)
    own = dataclasses.replace(assembly, model=assembly.model.copy())
    try_laws(own, times[0], times[-1])
    began, duration, limit, mode = clock.perf_counter(), float(times[-1] - times[0]), math.inf, None
    if step is None:  # which needs compiled functions: all that the run needs are compiled at once
        _load(own.model, METHODS[method], rtol=rtol, atol=atol)
    compile_time = clock.perf_counter() - began
    if method != "dopri5":
        if unsafe_step and step is not None:
            step = positive("step", step, allowed=STEP_ALLOWED)
            step, (mode, limit) = float(step), stable_step(own, method, duration)
        else:
            step, limit, mode = choose_step(own, method, step, duration)
    else:
        step, rtol, atol = None, positive("rtol", rtol), positive("atol", atol)
        if not needs.is_flexible(own.model):  # of beams the fastest mode takes longer to find than a run may take
            stable_step(own, method, duration)
    return Plan(own, times, method, step, limit, mode, rtol, atol, compile_time)


def solve(
    assembly: Assembly,
    *,
    samples: Any,
    method: str = "rk4",
    step: float | None = None,
    rtol: float = 1e-8,
    atol: float = 1e-10,
    unsafe_step: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Solution:
    """Integrate an assembled model over time by an explicit method: `plan` and run.

    Parameters
    ----------
    assembly, samples, method, step, rtol, atol, unsafe_step : as of `plan`
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
    return plan(assembly, samples=samples, method=method, step=step, rtol=rtol, atol=atol, unsafe_step=unsafe_step).run(
        progress
    )


class _Run:
    """A plan that runs: its loop, and the balances evaluated so far."""

    def __init__(self, of: Plan) -> None:
        self.plan, self.assembly, self.model = of, of.assembly, of.assembly.model
        self.tableau = METHODS[of.method]
        self.span = float(of.times[-1] - of.times[0])
        began = clock.perf_counter()
        self.advance = _load(self.model, self.tableau, rtol=of.rtol, atol=of.atol)
        self.compile_time = of.compile_time + clock.perf_counter() - began
        self.work = _workspace(self.assembly, of.times, self.tableau, of.step)
        self.unresolved = strain_round_off(self.model)
        self.seen = [self._look(np.array([of.times[0]]), self.work.y[None], self.work.s[None])]
        self.found = eb.Closure(0.0, 0.0, 0.0, 0.0, self.unresolved, damps=False)

    @property
    def reached(self) -> float:
        """Time reached, s."""
        return float(self.work.loop.time)

    def _look(self, t: np.ndarray, y: np.ndarray, s: np.ndarray) -> tuple[np.ndarray, Any]:
        return t, balances(self.model, y, sums_of(self.model, t, y, s))

    def closure(self, samples: int) -> eb.Closure:
        """How well the balance closes by now, and where it was checked before; and at so many of the samples kept."""
        work, kept = self.work, int(self.work.loop.sample)
        if len(self.seen) > 2 * LOOKED_AT:
            del self.seen[1::2]
        self.seen.append(self._look(np.array([self.reached]), work.y[None], work.s[None]))
        looks = list(self.seen)
        if samples and kept:
            chosen = np.unique(np.linspace(0, kept - 1, min(kept, samples)).astype(int))
            looks.append(self._look(work.samples[chosen], work.out_y[chosen], work.out_s[chosen]))
        order = np.argsort(np.concatenate([t for t, _ in looks]), kind="stable")
        whole = np.concatenate([one for _, one in looks])[order].view(np.recarray)
        found = eb.closure(whole, unresolved=self.unresolved, damps=False)
        self.found = found
        return found

    def is_lost(self) -> bool:
        """Whether the balance is off by far more than the energy moved, or is not finite."""
        return self.closure(0).share > DIVERGED and self.closure(int(self.work.loop.sample)).share > DIVERGED

    def has_failed(self) -> bool:
        """Whether the balance is off by more than the rule allows."""
        return self.closure(LOOKED_AT).fails and self.closure(int(self.work.loop.sample)).fails

    def solution(self, progress: Callable[[float], None] | None) -> Solution:
        """Run to the end, or as far as the run comes."""
        status, message = "success", "the run reached its end"
        began = clock.perf_counter()
        try:
            code = self._loop(progress)
            if isinstance(code, Stall):
                law = large_law(self.assembly, _moments(self.work, self.tableau))
                other = (
                    "check the law" if law else "use an implicit method, a greater `tolerance`, or a shorter `until`"
                )
                status, message = "failed", f"{code}{law}; {other}"
            elif code < 0 or code == ex.LOG_FULL:
                status, message = "failed", _reason(code, self.reached, self.work, self.plan)
                if code in (ex.NOT_FINITE, ex.TOO_SMALL):
                    moments = _moments(self.work, self.tableau)
                    later = self.reached + 1e-6 * float(self.work.samples[-1])  # past a step that shrank to nothing
                    message += broken_law(self.assembly, [*moments, (later, self.work.y, self.work.s)])
            elif self.has_failed():
                status, message = "failed", _unbalanced(self.plan, self.found, self.reached, self.work)
            elif code == ex.STOPPED:
                status, message = "stopped by event", f"an event stopped the run at t = {self.reached:.9g} s"
        except KeyboardInterrupt:
            status, message = "interrupted", f"interrupted at t = {self.reached:.6g} s; what was computed is kept"
        except Exception as error:  # noqa: BLE001  (whatever a user's law may raise)
            failure = law_failure(self.assembly, error, _moments(self.work, self.tableau))
            status, message = "failed", f"{failure}; what was computed is kept"
        wall_time = clock.perf_counter() - began
        codecache.mark_warm(cache_name(self.assembly, self.plan.method))
        work, kept, n_events = self.work, int(self.work.loop.sample), int(self.work.loop.events)
        return Solution(
            assembly=self.assembly,
            method=self.plan.method,
            t=work.samples[:kept].copy(),
            y=work.out_y[:kept],
            s=work.out_s[:kept],
            status=status,
            message=message,
            statistics={
                "steps": int(work.loop.steps),
                "rejected_steps": int(work.loop.rejected),
                "rhs_evaluations": int(work.loop.rhs_evaluations),
                "events": n_events,
                "step": math.nan if self.plan.step is None else self.plan.step,
                "mean_step": (self.reached - float(self.plan.times[0])) / max(int(work.loop.steps), 1),
                "stability_limit": self.plan.limit,
                "energy_moved": self.found.moved,
                "energy_defect": self.found.share,
            },
            event_times=work.log_t[:n_events].copy(),
            event_kinds=work.log_k[:n_events].copy(),
            wall_time=wall_time,
            compile_time=self.compile_time,
        )

    def _loop(self, progress: Callable[[float], None] | None) -> int | Stall:
        """Call the compiled loop until it ends or the energy does not balance; returns its status, or why it stalls.

        The balance is checked after numbers of steps that do not depend on the machine's speed, so that a run ends the
        same way every time.
        """
        budget, filled, adaptive = 500, -math.inf, self.plan.step is None
        every = CHECK_EVERY if self.plan.step is None else max(100, math.ceil(self.span / self.plan.step / CHECKS))
        check, pace = every, Pace(self.reached)
        while True:
            slice_began = clock.perf_counter()
            length = max(1, min(budget, check - int(self.work.loop.steps)))
            try:
                code = self.advance(self.work, length)
            except Exception:  # of a user's law: up to where it raises, the samples are kept
                if adaptive and _shorter(self.model, self.work, 1e-6 * self.span):
                    continue
                raise
            spent = clock.perf_counter() - slice_began
            if code == ex.LOG_FULL and self.reached - filled > CHATTER * self.span:
                self.work, filled = _grow_log(self.work), self.reached
            elif code != ex.BUDGET:
                return code
            if length > budget // 2:
                budget = max(100, min(int(length * min(_SLICE / max(spent, 1e-6), 4.0)), 10_000_000))
            if adaptive:
                stall = pace.stall(self.reached, int(self.work.loop.steps), float(self.plan.times[-1]))
                if stall is not None:
                    return stall
            if progress is not None:
                progress(self.reached)
            if self.work.loop.steps >= check:
                check += every
                if self.is_lost():
                    return code


def _workspace(assembly: Assembly, times: np.ndarray, tableau: ex.Method, step: float | None) -> ex.ExplicitWorkspace:
    """The loop's workspace at the start of a run."""
    n, n_s, n_e = assembly.y.size, assembly.s.size, int(assembly.model.info.ne)
    n_p = assembly.model.threads.size
    log = 1000 + 2 * ex.rounds(n_p) * (n_p + 1)
    first = step if step is not None else 1e-6 * (times[-1] - times[0])
    return ex.ExplicitWorkspace(
        y=assembly.y.copy(),
        s=assembly.s.copy(),
        loop=zeros_record(ex.LOOP, time=times[0], step=first, origin=times[0], last_error=1e-4, starts=1),
        samples=times.copy(),
        out_y=np.zeros((times.size, n)),
        out_s=np.zeros((times.size, n_s), dtype=np.int64),
        log_t=np.zeros(log),
        log_k=np.zeros(log, dtype=np.int64),
        K=np.zeros((tableau.b.size, n)),
        w=np.zeros(n),
        y1=np.zeros(n),
        g=np.zeros(n_e),
        g0=np.zeros(n_e),
        **{name: np.zeros((assembly.model.bodies.size, 3, 3)) for name in ("R0", "R1")},
        **{name: np.zeros((assembly.model.bodies.size, 3)) for name in ("x0", "x1")},
    )


def sample_times(samples: Any) -> np.ndarray:
    """`samples` as an array of times, s; refused unless two or more that increase."""
    try:
        times = np.array(samples, dtype=float)
    except (TypeError, ValueError):
        times = np.zeros(0)
    if times.ndim != 1 or times.size < 2 or not np.all(np.isfinite(times)) or not np.all(np.diff(times) > 0.0):
        raise InputError(f"samples is {_short(samples)}; it must be two or more finite times that increase, s")
    return times


def _short(value: Any) -> str:
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else f"{text[:50]} ... {text[-6:]}"


def _unbalanced(of: Plan, found: eb.Closure, reached: float, work: ex.ExplicitWorkspace) -> str:
    """What is known of a run whose energy does not balance, and what to try."""
    smaller = "use a smaller `rtol`"
    if of.step is not None:
        f = of.assembly.model.flexible
        other = "energy-momentum" if f.beams.size or f.rods.size else "dopri5"
        smaller = f"use a smaller `step` than {float(work.loop.step):.3g} s, or `method` {other}"
    return (
        f"the energy balance is off by {found.defect:.3g} J at t = {reached:.6g} s, {found.share:.2g} of the "
        f"{found.moved:.3g} J that were moved, more than {eb.GAINED:g}: the steps do not resolve the motion"
        f"{what_may_jump(of.assembly)}{states_energy(of.assembly)}; {smaller}"
    )


def _shorter(model: mdl.Model, work: ex.ExplicitWorkspace, least: float) -> bool:
    """Try the step of the adaptive method again with a fifth of its length, unless that is below `least`."""
    if not 0.2 * work.loop.step > least:
        return False
    work.loop.step *= 0.2
    rhs(float(work.loop.time), work.y, work.s, model, work.K[0])
    return True


def _moments(work: ex.ExplicitWorkspace, tableau: ex.Method) -> list[tuple[float, np.ndarray, np.ndarray]]:
    """Times and states at which the last step may have called a user's law."""
    t, h = float(work.loop.time), float(work.loop.step)
    lengths = [h, min(h, float(work.samples[-1]) - t)]
    found = [(t, work.y, work.s)]
    for length in lengths:
        found += [(t + float(c) * length, work.w, work.s) for c in np.unique(tableau.c)]
        found.append((t + length, work.y1, work.s))
    return found


def _grow_log(work: ex.ExplicitWorkspace) -> ex.ExplicitWorkspace:
    """The workspace with room for twice as many events."""
    return work._replace(
        log_t=np.concatenate([work.log_t, np.zeros_like(work.log_t)]),
        log_k=np.concatenate([work.log_k, np.zeros_like(work.log_k)]),
    )


def _load(
    model: mdl.Model, tableau: ex.Method, *, rtol: float, atol: float
) -> Callable[[ex.ExplicitWorkspace, int], int]:
    """The time loop, loaded with all that it calls, as a function of what it carries and its budget."""
    steps: Any = ex.fixed_step if tableau is not ex.DOPRI5 else ex.adaptive
    options: tuple[Any, ...] = (tableau.A, tableau.b, tableau.c)
    if steps is ex.adaptive:
        options += (ex.DOPRI5_ERROR, ex.DOPRI5_DENSE, rtol, atol)
    needs.load(model, ex.start_up, ex.fire, steps)

    def advance(work: ex.ExplicitWorkspace, budget: int) -> int:
        return int(steps(*options, model, work, budget))

    return advance


def _reason(code: int, reached: float, work: ex.ExplicitWorkspace, of: Plan) -> str:
    method = of.method
    if code == ex.NOT_FINITE:
        worst = int(np.argmax(~np.isfinite(work.y1)))
        return (
            f"the state stopped being finite at t = {reached:.6g} s (component {worst}) with {method}; "
            "use a smaller `step`, or check loads, laws and constraints there"
        )
    if code == ex.TOO_SMALL:
        return (
            f"the step became too small at t = {reached:.6g} s with {method}: the motion is singular there "
            "or a law jumps; check the last samples, or loosen the tolerance"
        )
    if code == ex.NO_THREAD:
        return reason_of_outrun(reached)
    return f"{work.loop.events} events by t = {reached:.6g} s: one of them fires repeatedly"
