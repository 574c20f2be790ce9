"""solve(): choose a step, run a compiled loop, watch it, and say how it ended."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable
from typing import Any

import numpy as np

from evolvent import codecache, families, jit
from evolvent import model as mdl
from evolvent.builder import Assembly
from evolvent.errors import InputError, nearest
from evolvent.flow import needs
from evolvent.flow.inventory import inventory
from evolvent.flow.rhs import rhs
from evolvent.kernels import thread
from evolvent.parts.checks import positive
from evolvent.solvers import explicit as ex
from evolvent.solvers.laws import law_failure, refusing_laws, try_laws, what_may_jump
from evolvent.solvers.releases import reason_of_outrun
from evolvent.solvers.solution import Solution
from evolvent.solvers.stability import Mode, fastest_mode, stability_limit

METHODS = {"heun": ex.HEUN, "rk4": ex.RK4, "dopri5": ex.DOPRI5}
#: Share of the stability limit taken by an automatic step. RK4 damps the ringing that every release leaves in a
#: thread: at 0.42 that costs the heliogyro 0.92e-6 of its energy, at 0.8 1.5e-6.
SAFETY = {"heun": 0.5, "rk4": 0.42}
#: Share of its energy that the fastest mode may lose (or gain) over a run with an automatic step, where that mode is
#: not a thread's; and (k, f) of each method's share omega T (omega h)^k / f.
FASTEST_MODE_LOSS = 1e-4
ENERGY_LOSS = {"heun": (3, 4.0), "rk4": (5, 72.0)}
#: Stable steps beyond which an explicit run is refused: at a microsecond each they take hours.
MOST_STEPS = 1e10
#: Relative defect of the energy account at which a run has failed.
ENERGY_LIMIT = 1e-2
#: Share of a run in which a whole log of events is not plausible: the same ones fire again and again.
CHATTER = 1e-6
#: What a step may be, in messages.
STEP_ALLOWED = "a finite time above 0, or None"
_SLICE = 0.15  # s of wall time between two looks at a running loop


def energy_defect(model: mdl.Model, t: float, y: np.ndarray, s: np.ndarray, start: float) -> tuple[float, float, float]:
    """Energy now, and what the account lacks: E - E0 - (spool + load + drive - dissipated + release), J; its scale.

    The functions that explicit methods need are loaded.
    """
    out = np.empty(mdl.N_INVENTORY)
    inventory(t, y, s, model, out)
    energy = out[mdl.KINETIC] + out[mdl.ELASTIC]
    a = y[model.info.nq + model.info.nv :]
    booked = a[mdl.SPOOL] + a[mdl.LOAD] + a[mdl.DRIVE] + a[mdl.RELEASE] - a[mdl.DISSIPATED]
    scale = max(start, energy, *(abs(a[k]) for k in (mdl.SPOOL, mdl.LOAD, mdl.DRIVE, mdl.DISSIPATED)))
    return float(energy), float(energy - start - booked), float(scale)


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
            f"{mode.where!r}); take less damping or stiffness, or generalized-alpha"
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
        if assembly.names.get(mode.where, ("",))[0] == "threads" or needs.is_flexible(assembly.model):
            # the motion lies far below the waves along a thread or beam: stability is enough, unless links are rigid
            rigid_links = bool(np.any(assembly.model.threads["kind"] == thread.INEXTENSIBLE))
            return limit * (0.25 if rigid_links else SAFETY[method]), limit, mode
        order, factor = ENERGY_LOSS[method]
        if mode.frequency == 0.0:  # nothing but dampers
            return limit * SAFETY[method], limit, mode
        accurate = (FASTEST_MODE_LOSS * factor / (mode.frequency * duration)) ** (1.0 / order) / mode.frequency
        return min(limit * SAFETY[method], accurate), limit, mode
    step = positive("step", step, allowed=STEP_ALLOWED)
    if step > limit:
        raise InputError(
            f"step is {step:.6g} s, above the stability limit {limit:.6g} s of {method} "
            f"(highest frequency {mode.frequency:.6g} rad/s, in {mode.where!r}); take a smaller one, or None"
        )
    return float(step), limit, mode


def solve(
    assembly: Assembly,
    *,
    samples: Any,
    method: str = "rk4",
    step: float | None = None,
    rtol: float = 1e-8,
    atol: float = 1e-10,
    progress: Callable[[float], None] | None = None,
    unsafe_step: bool = False,
) -> Solution:
    """Integrate an assembled model over time.

    Parameters
    ----------
    assembly : Assembly; its initial state is left as it is
    samples : (nt,) float, s, increasing; the first is the start, the last the end
    method : {"rk4", "heun", "dopri5"}
    step : float, s, of a fixed-step method; None chooses one from the model's highest frequency
    rtol, atol : float, of the adaptive method
    progress : called with the time reached, a few times a second
    unsafe_step : bool, take a step above the stability limit all the same (the energy account still watches)

    Returns
    -------
    Solution
        A run that fails keeps the samples that it reached. Ctrl-C ends it with the status "interrupted".

    Raises
    ------
    InputError
        For an unknown method, an unstable step, samples out of order, or a law that fails at the start.
    """
    if method not in METHODS:
        raise InputError(f"method is {method!r}; {nearest(str(method), METHODS)}")
    times = sample_times(samples)
    families.check(assembly, families.EXPLICIT)
    assembly.model.flexible.cylinders["share"] = 1.0  # an implicit run may have left another one
    try_laws(assembly, times[0], times[-1])
    tableau = METHODS[method]
    began = clock.perf_counter()
    advance = _load(assembly.model, tableau, rtol=rtol, atol=atol)
    compile_time = clock.perf_counter() - began
    fixed = method != "dopri5"
    model = assembly.model
    limit = math.inf
    if fixed:
        if unsafe_step and step is not None:
            step, limit = float(step), stable_step(assembly, method, times[-1] - times[0])[1]
        else:
            step, limit, _ = choose_step(assembly, method, step, times[-1] - times[0])
    else:
        rtol, atol = positive("rtol", rtol), positive("atol", atol)
        if not needs.is_flexible(model):  # of beams the fastest mode takes longer to find than a run may take
            stable_step(assembly, method, times[-1] - times[0])
    loop = _make_loop(assembly, times, tableau, step)
    start, _, _ = energy_defect(model, times[0], loop.y, loop.s, 0.0)
    status, message = "success", "the run reached its end"
    began = clock.perf_counter()
    budget, reached, worst = 500, times[0], 0.0
    filled = -math.inf
    try:
        while True:
            slice_began = clock.perf_counter()
            try:
                code = advance(loop, budget)
            except Exception:  # of a user's law: up to where it raises, the samples are kept
                if fixed or not _shorter(model, loop, 1e-6 * (times[-1] - times[0])):
                    raise
                continue
            spent = clock.perf_counter() - slice_began
            reached = float(loop.clock[ex.TIME])
            if code == ex.LOG_FULL and reached - filled > CHATTER * (times[-1] - times[0]):
                loop, filled = _grow_log(loop), reached
            elif code != ex.BUDGET:
                break
            budget = max(100, min(int(budget * min(_SLICE / max(spent, 1e-6), 4.0)), 10_000_000))
            if progress is not None:
                progress(reached)
            _, defect, scale = energy_defect(model, reached, loop.y, loop.s, start)
            worst = max(worst, abs(defect) / max(scale, 1e-300))
            if not worst <= ENERGY_LIMIT:
                break
        wall_time = clock.perf_counter() - began
        if code < 0 or code == ex.LOG_FULL:
            status, message = "failed", _reason(code, reached, loop, method, fixed)
        else:
            _, defect, scale = energy_defect(model, reached, loop.y, loop.s, start)
            worst = max(worst, abs(defect) / max(scale, 1e-300))
            if not worst <= ENERGY_LIMIT:
                status, message = "failed", _unbalanced(assembly, worst, reached, float(loop.clock[ex.STEP]), fixed)
            elif code == ex.STOPPED:
                status, message = "stopped by event", f"an event stopped the run at t = {reached:.9g} s"
    except KeyboardInterrupt:
        wall_time = clock.perf_counter() - began
        reached = float(loop.clock[ex.TIME])
        status, message = "interrupted", f"interrupted at t = {reached:.6g} s; what was computed is kept"
    except Exception as error:  # noqa: BLE001  (whatever a user's law may raise)
        wall_time = clock.perf_counter() - began
        failure = law_failure(assembly, error, _moments(loop, tableau))
        status, message = "failed", f"{failure}; what was computed is kept"
    kept = int(loop.tally[ex.SAMPLE])
    n_events = int(loop.tally[ex.EVENTS])
    statistics = {
        "steps": int(loop.tally[ex.STEPS]),
        "rejected_steps": int(loop.tally[ex.REJECTED]),
        "rhs_evaluations": int(loop.tally[ex.RHS]),
        "events": n_events,
        "step": float(step) if fixed and step is not None else float("nan"),
        "stability_limit": limit,
        "energy_defect": worst,
    }
    codecache.mark_warm(method)
    return Solution(
        t=loop.samples[:kept].copy(),
        y=loop.out_y[:kept],
        s=loop.out_s[:kept],
        status=status,
        message=message,
        statistics=statistics,
        event_times=loop.log_t[:n_events].copy(),
        event_kinds=loop.log_k[:n_events].copy(),
        wall_time=wall_time,
        compile_time=compile_time,
    )


def _make_loop(assembly: Assembly, times: np.ndarray, tableau: ex.Method, step: float | None) -> ex.Loop:
    n, n_s, n_e = assembly.y.size, assembly.s.size, int(assembly.model.info.ne)
    n_p = assembly.model.threads.size
    log = 1000 + 2 * ex.rounds(n_p) * (n_p + 1)
    span = times[-1] - times[0]
    tally = np.zeros(8, dtype=np.int64)
    tally[ex.FRESH] = 1
    first = step if step is not None else span * 1e-6
    return ex.Loop(
        y=assembly.y.copy(),
        s=assembly.s.copy(),
        clock=np.array([times[0], first, times[0], 1e-4]),
        tally=tally,
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


def _unbalanced(assembly: Assembly, worst: float, reached: float, step: float, fixed: bool) -> str:
    """What is known of a run whose energy does not balance, and what to try."""
    smaller = f"take a smaller `step` than {step:.3g} s, or `method` dopri5" if fixed else "take a smaller `rtol`"
    return (
        f"the energy account is off by {worst:.2g} of the energy at t = {reached:.6g} s, more than {ENERGY_LIMIT:g}: "
        f"the steps do not resolve the motion{what_may_jump(assembly)}; {smaller}"
    )


def _shorter(model: mdl.Model, loop: ex.Loop, least: float) -> bool:
    """Try the step of the adaptive method again with a fifth of its length, unless that is below `least`."""
    if not 0.2 * loop.clock[ex.STEP] > least:
        return False
    loop.clock[ex.STEP] *= 0.2
    rhs(float(loop.clock[ex.TIME]), loop.y, loop.s, model, loop.K[0])
    return True


def _moments(loop: ex.Loop, tableau: ex.Method) -> list[tuple[float, np.ndarray, np.ndarray]]:
    """Times and states at which the last step may have called a user's law."""
    t, h = float(loop.clock[ex.TIME]), float(loop.clock[ex.STEP])
    later = loop.samples[loop.samples > t]
    lengths = [h] if not later.size else [h, min(h, float(later[0]) - t)]
    found = [(t, loop.y, loop.s)]
    for length in lengths:
        found += [(t + float(c) * length, loop.w, loop.s) for c in np.unique(tableau.c)]
        found.append((t + length, loop.y1, loop.s))
    return found


def _grow_log(loop: ex.Loop) -> ex.Loop:
    """The loop with room for twice as many events."""
    return loop._replace(
        log_t=np.concatenate([loop.log_t, np.zeros_like(loop.log_t)]),
        log_k=np.concatenate([loop.log_k, np.zeros_like(loop.log_k)]),
    )


def _load(model: mdl.Model, tableau: ex.Method, *, rtol: float, atol: float) -> Callable[[ex.Loop, int], int]:
    """The time loop, loaded with all that it calls, as a function of what it carries and its budget."""
    steps: Any = ex.fixed_step if tableau is not ex.DOPRI5 else ex.adaptive
    options: tuple[Any, ...] = (tableau.A, tableau.b, tableau.c)
    if steps is ex.adaptive:
        options += (ex.DOPRI5_ERROR, ex.DOPRI5_DENSE, rtol, atol)
    jit.load((*needs.explicit(model), ex.start_up, ex.fire, steps))

    def advance(loop: ex.Loop, budget: int) -> int:
        return int(steps(*options, model, loop, budget))

    return advance


def _reason(code: int, reached: float, loop: ex.Loop, method: str, fixed: bool) -> str:
    if code == ex.NOT_FINITE:
        worst = int(np.argmax(~np.isfinite(loop.y1)))
        return (
            f"the state stopped being finite at t = {reached:.6g} s (component {worst}) with {method}; "
            "take a smaller `step`, or check loads, laws and constraints there"
        )
    if code == ex.TOO_SMALL:
        return (
            f"the step shrank to nothing at t = {reached:.6g} s with {method}: the motion is singular there "
            "or a law jumps; look at the last samples, or loosen the tolerance"
        )
    if code == ex.NO_THREAD:
        return reason_of_outrun(reached)
    return f"{loop.tally[ex.EVENTS]} events by t = {reached:.6g} s: there one fires again and again"
