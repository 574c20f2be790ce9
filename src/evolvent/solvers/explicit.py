"""Explicit Runge-Kutta methods, their time loops compiled whole: fixed step, and adaptive Dormand-Prince 5(4).

A loop lands exactly on events (nodes leave or reach a spool, a user's events), on breaks (corners of drives, loads
that start or end) and on its end; what is due at its end, but for round-off, still happens. Samples cut no step. It
returns to Python only when its budget of steps is used up, so that progress can be shown and the run interrupted, when
its log of events is full, or when it ends.

With a fixed step, the direction of an inextensible thread's new link converges with the third order only after a
release (its equation is singular where the link has no length); the adaptive method's error control covers that.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import types

from evolvent.compiled.jit import MATRIX, REAL, VECTOR, entry, indirect, inlined
from evolvent.compiled.pointer import Struct, array, record
from evolvent.flow.events import DUE, apply_event, event_values, is_release
from evolvent.flow.projection import is_corrected, project
from evolvent.flow.rhs import rhs
from evolvent.kernels import hinge, rigid, thread
from evolvent.kernels.flexible import is_finite
from evolvent.kernels.passing import note_places, passing
from evolvent.model import MODEL
from evolvent.solvers.dense import cubic

# status codes of a loop
BUDGET, DONE, STOPPED, LOG_FULL, NOT_FINITE, TOO_SMALL, NO_THREAD = 0, 1, 2, 3, -1, -2, -3
#: Part of a step without an event.
NO_EVENT = 2.0
#: A loop's counters and clock. sample, grid, next_break: numbers of the next sample, step of the grid and break;
#: starts: 1 before the first step; origin: s, of the grid of steps; last_error: of the last step accepted.
LOOP = np.dtype(
    [(name, np.int64) for name in ("steps", "rhs_evaluations", "rejected", "events", "sample", "grid", "next_break",
                                   "starts")]
    + [(name, np.float64) for name in ("time", "step", "origin", "last_error")],
    align=True,
)  # fmt: skip


class Method(NamedTuple):
    """A Runge-Kutta method as data: tableau, order, and the largest |R(z)| <= 1 on the imaginary and real axis."""

    name: str
    A: np.ndarray
    b: np.ndarray
    c: np.ndarray
    order: int


def _method(name: str, order: int, rows: list[list[float]], b: list[float]) -> Method:
    A = np.zeros((len(b), len(b)))
    for i, row in enumerate(rows):
        A[i + 1, : len(row)] = row
    return Method(name, A, np.array(b), A.sum(axis=1), order)


#: Heun's method, the explicit trapezoid (Hairer, Norsett, Wanner, Solving ODEs I, II.1).
HEUN = _method("heun", 2, [[1.0]], [0.5, 0.5])
#: The classical fourth-order method (ibid., table 1.2).
RK4 = _method("rk4", 4, [[0.5], [0.0, 0.5], [0.0, 0.0, 1.0]], [1 / 6, 1 / 3, 1 / 3, 1 / 6])
#: Dormand and Prince (1980), fifth order with an embedded fourth (ibid., table 5.2).
DOPRI5 = _method(
    "dopri5",
    5,
    [
        [1 / 5],
        [3 / 40, 9 / 40],
        [44 / 45, -56 / 15, 32 / 9],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656],
        [35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ],
    [35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84, 0.0],
)
#: b - b_hat of the Dormand-Prince pair.
DOPRI5_ERROR = np.array([71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])
#: Continuous extension of order 4 (ibid., II.6, eq. 6.12): y(t + th h) = y + h sum_i P_i(th) k_i, th^1 .. th^4.
DOPRI5_DENSE = np.array(
    [
        [1.0, -8048581381 / 2820520608, 8663915743 / 2820520608, -12715105075 / 11282082432],
        [0.0, 0.0, 0.0, 0.0],
        [0.0, 131558114200 / 32700410799, -68118460800 / 10900136933, 87487479700 / 32700410799],
        [0.0, -1754552775 / 470086768, 14199869525 / 1410260304, -10690763975 / 1880347072],
        [0.0, 127303824393 / 49829197408, -318862633887 / 49829197408, 701980252875 / 199316789632],
        [0.0, -282668133 / 205662961, 2019193451 / 616988883, -1453857185 / 822651844],
        [0.0, 40617522 / 29380423, -110615467 / 29380423, 69997945 / 29380423],
    ]
)


class ExplicitWorkspace(Struct):
    """What a time loop carries from call to call.

    Attributes
    ----------
    y, s : state, overwritten
    loop : record (see `LOOP`)
    samples : (nt,) float, times to keep the state at
    out_y, out_s : (nt, ny) float, (nt, ns) int, states kept
    log_t, log_k : (nlog,) float and int, time and number of every event; a loop returns where they run short
    K : (stages, ny) float, stages; w, y1 : (ny,) and g, g0 : (ne,) float, scratch
    R0, x0, R1, x1 : (nb, 3, 3) and (nb, 3) float, rotations and positions of the bodies at both ends of a step
    """

    y: np.ndarray = array(1)
    s: np.ndarray = array(1, np.int64)
    loop: np.record = record(LOOP)
    samples: np.ndarray = array(1)
    out_y: np.ndarray = array(2)
    out_s: np.ndarray = array(2, np.int64)
    log_t: np.ndarray = array(1)
    log_k: np.ndarray = array(1, np.int64)
    K: np.ndarray = array(2)
    w: np.ndarray = array(1)
    y1: np.ndarray = array(1)
    g: np.ndarray = array(1)
    g0: np.ndarray = array(1)
    R0: np.ndarray = array(3)
    R1: np.ndarray = array(3)
    x0: np.ndarray = array(2)
    x1: np.ndarray = array(2)


_WORKSPACE = ExplicitWorkspace._numba_type_
_I = types.int64


@inlined
def _next_weight(b, i, count):
    """The first of the stages i, i + 1, ... with a weight; `count` or more for none."""
    while i < count and b[i] == 0.0:
        i += 1
    return i


@inlined
def add_stages(b, count, y, h, K, out):
    """Out = y + h sum of b_i K_i over the first `count` stages."""
    i = _next_weight(b, 0, count)
    j = _next_weight(b, i + 1, count)
    first, second = h * b[i], h * b[j] if j < count else 0.0
    if j < count:
        for n in range(y.size):
            out[n] = (y[n] + first * K[i, n]) + second * K[j, n]
    else:
        for n in range(y.size):
            out[n] = y[n] + first * K[i, n]
    while j < count:  # two stages in a pass over memory
        i = _next_weight(b, j + 1, count)
        j = _next_weight(b, i + 1, count)
        if j < count:
            first, second = h * b[i], h * b[j]
            for n in range(y.size):
                out[n] = (out[n] + first * K[i, n]) + second * K[j, n]
        elif i < count:
            first = h * b[i]
            for n in range(y.size):
                out[n] += first * K[i, n]


@inlined
def stages(A, c, model, t, y, s, h, first, until, work):
    """Stages `first` and later of one step into work.K.

    A stage at the next break `until` sees the time just before it: what jumps there jumps in the step that follows.
    """
    latest = np.nextafter(until, -math.inf)
    K, w = work.K, work.w
    for i in range(first, c.size):
        add_stages(A[i], i, y, h, K, w)
        rhs(min(t + c[i] * h, latest), w, s, model, K[i])
    work.loop.rhs_evaluations += c.size - first


@inlined
def highest(model, t, y, s, work):
    """The largest value of the events that can fire (thread events always, a user's only once it was negative)."""
    event_values(t, y, s, model, work.g)
    value = -1.0
    threads, brakes = 2 * model.threads.size, work.g.size - model.info.brakes
    for k in range(work.g.size):
        if (k < threads or k >= brakes or work.g0[k] < 0.0) and work.g[k] > value:
            value = work.g[k]
    return value


@entry(types.int64)
@inlined
def rounds(threads):
    """How often `fire` looks for events at one time; each round carries out one, or one of every thread."""
    return 2 * threads + 64


@inlined
def log_is_short(model, work):
    """Whether the log may not hold all that `fire` could write into it."""
    n = model.threads.size
    return work.log_t.size - work.loop.events < rounds(n) * (n + 1)


@indirect(_I(MODEL, REAL, _WORKSPACE))
def fire(model, t, work):
    """Carry out every event that is due at time t; the releases among them together.

    Returns 1 to stop the run, a negative status where it has failed.
    """
    y, s, g = work.y, work.s, work.g
    threads = model.threads
    stop = 0
    for _ in range(rounds(threads.size)):
        event_values(t, y, s, model, g)
        due = -1
        for k in range(g.size):
            of_reels = k < 2 * threads.size or k >= g.size - model.info.brakes
            if (of_reels and g[k] >= DUE) or (not of_reels and work.g0[k] < 0.0 and g[k] >= 0.0):
                due = k
                break
        if due < 0:
            break
        if due >= 2 * threads.size:
            work.g0[due] = g[due]
        for k in range(due, g.size):
            if k > due and not (is_release(s, threads, g, due) and is_release(s, threads, g, k)):
                continue
            n = work.loop.events
            work.log_t[n] = t
            work.log_k[n] = k
            work.loop.events = n + 1
        answer = apply_event(t, y, s, model, due, g)
        if answer < 0:
            return NO_THREAD
        stop = max(stop, answer)
    event_values(t, y, s, model, g)
    for k in range(g.size):
        work.g0[k] = g[k]
    return stop


@inlined
def keep_sample(work, y):
    """Keep the state `y` as the next sample."""
    i = work.loop.sample
    for n in range(y.size):
        work.out_y[i, n] = y[n]
    for n in range(work.s.size):
        work.out_s[i, n] = work.s[n]
    work.loop.sample = i + 1


@inlined
def keep_samples_by_cubics(t, h, time, until, model, work):
    """Keep the samples before a time in a step of length h from t, by the cubics of its ends' states and rates."""
    loop, f1 = work.loop, work.w
    if not (loop.sample < work.samples.size and work.samples[loop.sample] < time):
        return
    rhs(min(t + h, np.nextafter(until, -math.inf)), work.y1, work.s, model, f1)
    loop.rhs_evaluations += 1
    while loop.sample < work.samples.size and work.samples[loop.sample] < time:
        theta, y = (work.samples[loop.sample] - t) / h, work.out_y[loop.sample]
        for n in range(y.size):
            y[n], _ = cubic(theta, h, work.y[n], work.y1[n], work.K[0, n], f1[n])
        for k in range(model.bodies.size):
            if model.bodies[k].motion == rigid.FREE:
                rigid.normalise_quaternion(y, model.bodies[k].iq + 3)
        for n in range(work.s.size):
            work.out_s[loop.sample, n] = work.s[n]
        loop.sample += 1


@inlined
def next_break(model, work, t):
    """Time of the next break after t, or infinity."""
    i = work.loop.next_break
    while i < model.breaks.size and model.breaks[i] <= t:
        i += 1
    work.loop.next_break = i
    if i < model.breaks.size:
        return model.breaks[i]
    return math.inf


@inlined
def bracket(low, f_low, high, f_high, bias):
    """A point inside a bracket of a sign change: false position (Illinois), or the middle where that stalls."""
    if bias or f_high == f_low:
        return 0.5 * (low + high)
    return min(max(low - f_low * (high - low) / (f_high - f_low), low), high)


@indirect(_I(MODEL, _WORKSPACE))
def start_up(model, work):
    """Events due at the start, first projection and first sample; returns a status or BUDGET."""
    if work.loop.starts == 0:
        return BUDGET
    work.loop.starts = 0
    t = work.loop.time
    if is_corrected(model):
        project(t, work.y, work.s, model)
    if model.flexible.hinges.size > 0:
        hinge.note_turns(t, work.y, work.s, model)
    for k in range(work.g0.size):
        work.g0[k] = 0.0
    stop = fire(model, t, work) if work.g.size > 0 else 0
    if stop < 0:
        return stop
    while work.loop.sample < work.samples.size and work.samples[work.loop.sample] <= t:
        keep_sample(work, work.y)
    return STOPPED if stop > 0 else BUDGET


@indirect(_I(MATRIX, VECTOR, VECTOR, MODEL, _WORKSPACE, _I))
def fixed_step(A, b, c, model, work, budget):
    """Advance with a fixed step until the last sample, an event that stops, a failure or the end of the budget."""
    y, s, loop, y1 = work.y, work.s, work.loop, work.y1
    status = start_up(model, work)
    if status != BUDGET:
        return status
    watch, turns = work.g.size > 0, model.flexible.hinges.size > 0
    corrected = is_corrected(model)
    end, near = work.samples[work.samples.size - 1], 1e-9 * loop.step
    until = next_break(model, work, loop.time)
    for _ in range(budget):
        if loop.sample == work.samples.size:
            return DONE
        if watch and log_is_short(model, work):
            return LOG_FULL
        t = loop.time
        target = loop.origin + (loop.grid + 1) * loop.step
        on_grid = True
        if end <= target + 1e-6 * loop.step:
            on_grid = target <= end + 1e-6 * loop.step
            target = end
        if until < target:
            on_grid = False
            target = until
        h = target - t
        rhs(t, y, s, model, work.K[0])
        loop.rhs_evaluations += 1
        if h > model.info.step:  # a link that has just been released is stiff while it is short
            on_grid = False
            h = model.info.step
            target = t + h
        stages(A, c, model, t, y, s, h, 1, until, work)
        add_stages(b, b.size, y, h, work.K, y1)
        loop.steps += 1
        if not is_finite(y1):
            return NOT_FINITE
        at_event = False
        if watch:
            f_high = highest(model, target, y1, s, work)
            if f_high >= 0.0 or (target == end and f_high >= DUE):
                at_event = True
                low, high = 0.0, h
                f_low = highest(model, t, y, s, work)
                for trial in range(80):
                    if f_low >= 0.0 or f_high < 0.0 or high - low <= 4e-16 * max(abs(target), h):
                        break
                    middle = bracket(low, f_low, high, f_high, trial % 3 == 2)
                    if middle <= low or middle >= high:
                        middle = 0.5 * (low + high)
                    stages(A, c, model, t, y, s, middle, 1, until, work)
                    add_stages(b, b.size, y, middle, work.K, y1)
                    f = highest(model, t + middle, y1, s, work)
                    if f >= 0.0:
                        high, f_high = middle, f
                        if f < 1e-13:
                            break
                    else:
                        low, f_low = middle, f
                stages(A, c, model, t, y, s, high, 1, until, work)
                add_stages(b, b.size, y, high, work.K, y1)
                if high < h:
                    on_grid = False
                    target, h = t + high, high
        keep_samples_by_cubics(t, h, target - near, until, model, work)
        for n in range(y.size):
            y[n] = y1[n]
        loop.time = target
        if corrected:
            project(target, y, s, model)
        if turns:
            hinge.note_turns(target, y, s, model)
        if on_grid:
            loop.grid += 1
        if watch:
            if at_event:
                stop = fire(model, target, work)
                if stop < 0:
                    return stop
                if stop > 0:
                    keep_rest(work, target)
                    return STOPPED
            else:
                for k in range(work.g.size):
                    work.g0[k] = work.g[k]
        while loop.sample < work.samples.size and work.samples[loop.sample] <= target + near:
            keep_sample(work, y)
        if target == until:
            until = next_break(model, work, target)
            if model.info.brakes > 0:  # a motor's torque may jump
                fire(model, target, work)
    return BUDGET


@inlined
def way(t, model, work):
    """Way of contacts over a step to the state work.y1 at time t, of `passing`; its start is work.y at `loop.time`."""
    rigid.kinematics(work.loop.time, work.y, model)
    note_places(model.bodies, work.R0, work.x0)
    rigid.kinematics(t, work.y1, model)
    note_places(model.bodies, work.R1, work.x1)
    return passing(work.y, work.R0, work.x0, work.y1, work.R1, work.x1, model)


@inlined
def keep_rest(work, t):
    """On a stop, the state there becomes the last sample (its time replaces the next one's)."""
    i = work.loop.sample
    if i < work.samples.size:
        work.samples[i] = t
        keep_sample(work, work.y)


@inlined
def error_norm(y, y1, K, E, h, n, rtol, atol, w):
    """Root mean square of the error estimate over atol + rtol max(|y|, |y1|), on the first n components.

    w : (ny,) scratch. Accounts are integrals that nothing depends on: they come after the n components.
    """
    for i in range(n):
        w[i] = 0.0
    for j in range(E.size):
        if E[j] != 0.0:
            a = h * E[j]
            for i in range(n):
                w[i] += a * K[j, i]
    for i in range(n):
        w[i] /= atol + rtol * max(abs(y[i]), abs(y1[i]))
    even = odd = 0.0
    for i in range(0, n - 1, 2):
        even += w[i] * w[i]
        odd += w[i + 1] * w[i + 1]
    if n % 2 == 1:
        even += w[n - 1] * w[n - 1]
    active = 0  # coordinates of thread that is still wound do not move and must not count
    for i in range(n):
        active += w[i] != 0.0
    return math.sqrt((even + odd) / max(active, 1))


@inlined
def interpolate(P, y, K, h, theta, out):
    """Continuous extension at t + theta h."""
    for n in range(y.size):
        out[n] = y[n]
    for i in range(P.shape[0]):
        a = h * theta * (P[i, 0] + theta * (P[i, 1] + theta * (P[i, 2] + theta * P[i, 3])))
        if a != 0.0:
            for n in range(y.size):
                out[n] += a * K[i, n]


@inlined
def event_in_step(P, t, h, target, end, model, work):
    """Part of a step at which its first event falls, by the continuous extension; NO_EVENT where it has none."""
    f_high = highest(model, target, work.y1, work.s, work)
    if not (f_high >= 0.0 or (target == end and f_high >= DUE)):
        return NO_EVENT
    f_low = highest(model, t, work.y, work.s, work)
    low, high = 0.0, 1.0
    for trial in range(80):
        if f_low >= 0.0 or f_high < 0.0 or (high - low) * h <= 2e-16 * max(abs(target), h):
            break
        middle = bracket(low, f_low, high, f_high, trial % 3 == 2)
        if middle <= low or middle >= high:
            middle = 0.5 * (low + high)
        interpolate(P, work.y, work.K, h, middle, work.w)
        f = highest(model, t + middle * h, work.w, work.s, work)
        if f >= 0.0:
            high, f_high = middle, f
            if f < 1e-13:
                break
        else:
            low, f_low = middle, f
    return high


@inlined
def keep_samples_before(P, t, h, time, work):
    """Keep the samples before a time in a step, by the step's continuous extension."""
    loop = work.loop
    while loop.sample < work.samples.size and work.samples[loop.sample] < time:
        interpolate(P, work.y, work.K, h, (work.samples[loop.sample] - t) / h, work.w)
        keep_sample(work, work.w)


@indirect(_I(MATRIX, VECTOR, VECTOR, VECTOR, MATRIX, REAL, REAL, MODEL, _WORKSPACE, _I))
def adaptive(A, b, c, E, P, rtol, atol, model, work, budget):
    """Dormand-Prince 5(4) with proportional-integral step control, dense output and events.

    Notes
    -----
    Step factor 0.9 err^-0.17 err_old^0.04 within [0.2, 5] (Hairer, Norsett, Wanner, Solving ODEs I, II.4; Gustafsson's
    controller). The last stage serves as the first of the next step unless an event or a projection changed the state.
    """
    y, s, loop, y1, K = work.y, work.s, work.loop, work.y1, work.K
    fresh = loop.starts != 0
    status = start_up(model, work)
    if status != BUDGET:
        return status
    n = model.info.nq + model.info.nv
    watch, turns = work.g.size > 0, model.flexible.hinges.size > 0
    corrected = is_corrected(model)
    passes = model.flexible.body_contacts.size > 0 or model.flexible.cylinders.size > 0
    end = work.samples[work.samples.size - 1]
    until = min(next_break(model, work, loop.time), end)
    if fresh:
        rhs(loop.time, y, s, model, K[0])
        loop.rhs_evaluations += 1
    rejected = False
    for _ in range(budget):
        if loop.sample == work.samples.size:
            return DONE
        if watch and log_is_short(model, work):
            return LOG_FULL
        t, h = loop.time, loop.step
        if turns:
            h = min(h, hinge.longest_step(model.flexible.hinges))
        if model.threads.size > 0:
            h = min(h, thread.longest_step(y, s, model))
        landing = t + h * 1.01 >= until
        if landing:
            h = until - t
        if not h > 1e-14 * max(abs(t), 1e-3):
            if not landing:
                return TOO_SMALL
            loop.time = until  # an event fell on it, but for round-off
            while loop.sample < work.samples.size and work.samples[loop.sample] <= until:
                keep_sample(work, y)
            until = min(next_break(model, work, until), end)
            rhs(loop.time, y, s, model, K[0])
            loop.rhs_evaluations += 1
            continue
        stages(A, c, model, t, y, s, h, 1, until, work)
        add_stages(b, b.size, y, h, K, y1)
        loop.steps += 1
        error = error_norm(y, y1, K, E, h, n, rtol, atol, work.w)
        if passes and error < 1.0:
            error = max(error, way(t + h, model, work) ** 5)
        if not error < 1.0:
            loop.rejected += 1
            rejected = True
            loop.step = h * max(0.2, 0.9 * error**-0.2) if math.isfinite(error) else 0.1 * h
            continue
        error = max(error, 1e-10)
        factor = min(1.0 if rejected else 5.0, max(0.2, 0.9 * error**-0.17 * loop.last_error**0.04))
        rejected = False
        loop.last_error = max(error, 1e-4)
        target = until if landing else t + h
        following = max(h * factor, loop.step) if landing else h * factor
        part = event_in_step(P, t, h, target, end, model, work) if watch else NO_EVENT
        if 0.0 < part < 1.0:
            keep_samples_before(P, t, h, t + part * h, work)
            target = t + part * h
            h = target - t
            stages(A, c, model, t, y, s, h, 1, until, work)
            add_stages(b, b.size, y, h, K, y1)
            landing = False
        else:
            keep_samples_before(P, t, h, target, work)
        for i in range(y.size):
            y[i] = y1[i]
        loop.time = target
        changed = corrected and project(target, y, s, model) != 0
        if turns:
            hinge.note_turns(target, y, s, model)
        stop = 0
        if part != NO_EVENT:
            stop = fire(model, target, work)
            if stop < 0:
                return stop
            changed = True
            following = min(following, max(loop.step, h)) * 0.1
        elif watch:
            for k in range(work.g.size):
                work.g0[k] = work.g[k]
        loop.step = following
        if stop > 0:
            keep_rest(work, target)
            return STOPPED
        while loop.sample < work.samples.size and work.samples[loop.sample] <= target:
            keep_sample(work, y)
        if landing or target >= until:
            until = min(next_break(model, work, target), end)
            changed = True
            if model.info.brakes > 0:  # a motor's torque may jump
                fire(model, target, work)
        if changed:
            rhs(target, y, s, model, K[0])
            loop.rhs_evaluations += 1
        else:
            for i in range(y.size):
                K[0, i] = K[6, i]
    return BUDGET
