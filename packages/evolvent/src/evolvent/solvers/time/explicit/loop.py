"""Explicit Runge-Kutta methods, of fixed steps and of steps that adapt, in one time loop compiled whole.

The loop lands exactly on events (nodes leave or reach a spool, a user's events), on breaks (corners of drives, loads
that start or end) and on its end; what is due at its end, but for round-off, still happens. Samples cut no step. It
returns to Python only when its budget of steps is used up, so that progress can be shown and the run interrupted, when
its log of events is full, or when it ends.

With a fixed step, the direction of an inextensible thread's new link converges with the third order only after a
release (its equation is singular where the link has no length); the adaptive method's error control covers that.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from evolvent.compiled.jit import MATRIX, REAL, VECTOR, indirect, inlined
from evolvent.equations.between_steps import (
    end_frictions,
    excess,
    longest_turn,
    measure_frictions,
    note_extremes,
    note_stage,
    note_state,
)
from evolvent.equations.projection import is_corrected, project
from evolvent.equations.rhs import rhs
from evolvent.kernels import contact, rigid
from evolvent.kernels.ancf_beams import is_finite
from evolvent.kernels.blocks import normalise
from evolvent.kernels.calls import longest_step_at
from evolvent.kernels.grazing import until_deepest
from evolvent.kernels.passing import note_places, passing
from evolvent.kernels.turning import NO_TURN, friction_power
from evolvent.model import DISSIPATED, MODEL
from evolvent.solvers.time.dense import cubic
from evolvent.solvers.time.event_search import START
from evolvent.solvers.time.explicit.events import (
    BUDGET,
    DONE,
    LOG_FULL,
    NO_EVENT,
    NOT_FINITE,
    STOPPED,
    TOO_SMALL,
    WORKSPACE,
    fire,
    log_is_short,
    next_break,
)
from evolvent.solvers.time.explicit.search import event_in_step
from evolvent.solvers.time.explicit.stages import add_stages, interpolate, stages

_I = types.int64


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
        normalise(model.blocks, y)
        for n in range(work.s.size):
            work.out_s[loop.sample, n] = work.s[n]
        loop.sample += 1


@indirect(_I(MODEL, WORKSPACE))
def start_up(model, work):
    """Events due at the start, first projection and first sample; returns a status or BUDGET."""
    if work.loop.starts == 0:
        return BUDGET
    work.loop.starts, work.loop.stale = 0, 1
    t = work.loop.time
    note_stage(t, 1, model)  # by the state at the start, whose balance has been checked
    if is_corrected(model):
        project(t, work.y, work.s, model)
    note_state(t, work.y, work.s, model)
    if model.info.rubbed >= 0:
        measure_frictions(t, work.y, work.y, work.s, 0.0, -1.0, model)
        end_frictions(work.y, -1.0, model)
    for k in range(work.g0.size):
        work.g0[k] = 0.0
    stop = fire(model, t, work) if work.g.size > 0 else 0
    if stop < 0:
        return stop
    keep_samples_until(t, work)
    return STOPPED if stop > 0 else BUDGET


@inlined
def end_step(target, corrected, model, work):
    """Make the end of a step at `target` the state; returns whether that is brought back onto its constraints.

    Parameters
    ----------
    corrected : of `is_corrected`
    """
    for n in range(work.y.size):
        work.y[n] = work.y1[n]
    work.loop.time = target
    note_stage(target, 0, model)  # by the last stage, which is the end of the step, or close to it
    changed = corrected and project(target, work.y, work.s, model) != 0
    note_state(target, work.y, work.s, model)
    return changed


@inlined
def end_rubbing(model, work):
    """Frictions at the end work.y1 of a step, measured there, with what they add to its accounts in work.jump."""
    if model.info.rubbed < 0:
        return
    y1, jump = work.y1, work.jump
    for n in range(y1.size):
        jump[n] = -y1[n]
    end_frictions(y1, math.inf, model)
    for n in range(y1.size):
        jump[n] += y1[n]
    work.loop.rubs1 = friction_power(model)


@inlined
def note_before_jump(target, until, model, work):
    """Take what acts just before a break or an event at the end of a step, where it may jump, into the extremes."""
    if model.samples_note_extremes_calls.size > 0:
        rhs(min(target, np.nextafter(until, -math.inf)), work.y, work.s, model, work.w)
        work.loop.rhs_evaluations += 1
        note_extremes(work.s, model)


@inlined
def end_events(at_event, target, model, work):
    """Carry out the events at the end of a step, or note their values; returns what `fire` returns."""
    if at_event:
        return fire(model, target, work)
    for k in range(work.g.size):
        work.g0[k] = work.g[k]
    return 0


@inlined
def forget_event(part, work):
    """Values of the events at the start of a step that is taken again, shorter."""
    if part != NO_EVENT:
        for k in range(work.g0.size):
            work.g0[k] = work.search.values[START, k]


@inlined
def keep_samples_until(t, work):
    """Keep the state as the samples up to a time."""
    while work.loop.sample < work.samples.size and work.samples[work.loop.sample] <= t:
        keep_sample(work, work.y)


@inlined
def way(t, model, work):
    """How much too long a step to the state work.y1 at time t is for contacts, by `passing` and `until_deepest`."""
    rigid.kinematics(work.loop.time, work.y, model)
    note_places(model.bodies, work.R0, work.x0)
    rigid.kinematics(t, work.y1, model)
    note_places(model.bodies, work.R1, work.x1)
    far = passing(work.y, work.R0, work.x0, work.y1, work.R1, work.x1, model)
    if model.body_contacts.size > 0:
        part = until_deepest(t - work.loop.time, work.y, work.R0, work.x0, work.y1, work.R1, work.x1, model)
        far = max(far, 1.0 / part if part < 1.0 else 0.0)
    return far


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
def keep_samples_before(P, t, h, time, model, work):
    """Keep the samples before a time in a step, by the step's continuous extension."""
    loop = work.loop
    while loop.sample < work.samples.size and work.samples[loop.sample] < time:
        theta = (work.samples[loop.sample] - t) / h
        interpolate(P, work.y, work.K, h, theta, work.w)
        if model.info.rubbed >= 0:
            part = rubbed_until(theta, h, model, work)
            for n in range(work.jump.size):
                work.w[n] += part * work.jump[n]
        keep_sample(work, work.w)


@inlined
def rubbed_until(theta, h, model, work):
    """Part of what frictions take in a step of length h that they have taken at the part theta of it.

    By the cubic with their powers at both ends, which is exact for a constant friction and acceleration; it does not
    fall.
    """
    loop, taken = work.loop, work.jump[model.info.nq + model.info.nv + DISSIPATED]
    if not taken > 0.0:
        return theta
    first, last = min(max(h * loop.rubs0 / taken, 0.0), 3.0), min(max(h * loop.rubs1 / taken, 0.0), 3.0)
    rest = 1.0 - theta
    return theta * (rest * (first * rest + (3.0 - last) * theta) + theta * theta)


@inlined
def next_stop(adapts, t, end, model, work):
    """Time after t on which a step lands: a break, of steps that adapt the end of the run as well."""
    found = next_break(model, work, t)
    return min(found, end) if adapts else found


@inlined
def grid_step(end, until, model, loop):
    """End and length of the next step on the grid of fixed steps, which breaks, the end and short links cut."""
    target = loop.origin + (loop.grid + 1) * loop.step
    if end <= target + 1e-6 * loop.step:
        target = end
    target = min(target, until)
    h = target - loop.time
    if h > model.info.step:  # a link that has just been released is stiff while it is short
        return loop.time + model.info.step, model.info.step
    return target, h


@inlined
def adapted_step(until, model, work):
    """End and length of the next step of those that adapt."""
    t, h = work.loop.time, work.loop.step
    h = min(h, longest_turn(model))
    calls = model.node_events_longest_step_calls
    for k in range(calls.size):
        h = min(h, longest_step_at(model, calls[k])(work.y, work.s, model))
    return (until, until - t) if t + h * 1.01 >= until else (t + h, h)


@inlined
def following_step(error, h, rejected, lands, loop):
    """Length of the step after an accepted one of length h."""
    error = max(error, 1e-10)
    h *= min(1.0 if rejected else 5.0, max(0.2, 0.9 * error**-0.17 * loop.last_error**0.04))
    loop.last_error = max(error, 1e-4)
    return max(h, loop.step) if lands else h


@indirect(_I(MATRIX, VECTOR, VECTOR, VECTOR, MATRIX, MATRIX, REAL, REAL, MODEL, WORKSPACE, _I))
def advance(A, b, c, E, P, Q, rtol, atol, model, work, budget):
    """Advance until the last sample, an event that stops, a failure or the end of the budget.

    Parameters
    ----------
    E, P : error estimate and continuous extension of a method whose steps adapt; of size 0 of one with fixed steps
    Q : continuous extension in which events are looked for

    Notes
    -----
    Steps adapt by a proportional-integral controller, with the factor 0.9 err^-0.17 err_old^0.04 within [0.2, 5]
    (Hairer, Norsett, Wanner, Solving ODEs I, II.4; Gustafsson's controller). The last stage serves as the first of the
    next step unless an event or a projection changed the state.
    """
    y, s, loop, y1, K = work.y, work.s, work.loop, work.y1, work.K
    status = start_up(model, work)
    if status != BUDGET:
        return status
    n, adapts = model.info.nq + model.info.nv, E.size > 0
    watch, corrected = work.g.size > 0, is_corrected(model)
    passes = contact.any_contact(model)
    end, near = work.samples[work.samples.size - 1], 0.0 if adapts else 1e-9 * loop.step
    until = next_stop(adapts, loop.time, end, model, work)
    rejected, error = False, 0.0
    for _ in range(budget):
        if loop.sample == work.samples.size:
            return DONE
        if watch and log_is_short(model, work):
            return LOG_FULL
        if loop.stale != 0:
            rhs(loop.time, y, s, model, K[0])
            loop.rhs_evaluations += 1
            loop.stale = 0
            note_extremes(s, model)
        t = loop.time
        target, h = adapted_step(until, model, work) if adapts else grid_step(end, until, model, loop)
        if loop.turn < h:
            target, h = t + loop.turn, loop.turn
        if adapts and not h > 1e-14 * max(abs(t), 1e-3):
            if target < until:
                return TOO_SMALL
            loop.time, loop.stale = until, 1  # an event fell on it, but for round-off
            keep_samples_until(until, work)
            until = next_stop(adapts, until, end, model, work)
            continue
        stages(A, c, model, t, y, s, h, 1, until, work)
        add_stages(b, b.size, y, h, K, y1)
        loop.steps += 1
        if not adapts and not is_finite(y1):
            return NOT_FINITE
        following = loop.step
        if adapts:
            error = error_norm(y, y1, K, E, h, n, rtol, atol, work.w)
            if passes and error < 1.0:
                error = max(error, way(t + h, model, work) ** 5)
            if error < 1.0:
                error = max(error, excess(t + h, h, y1, s, model) ** 5)
            if not error < 1.0:
                loop.rejected += 1
                rejected = True
                loop.step = h * max(0.2, 0.9 * error**-0.2) if math.isfinite(error) else 0.1 * h
                continue
            following = following_step(error, h, rejected, target >= until, loop)
            rejected = False
        part = event_in_step(A, b, c, P, Q, t, h, target, end, until, model, work) if watch else NO_EVENT
        if part != NO_EVENT:
            if part < 1.0:
                target = t + part * h
                h = target - t if adapts else part * h  # of fixed steps the very one that was tried
            stages(A, c, model, t, y, s, h, 1, until, work)
            add_stages(b, b.size, y, h, K, y1)
        if model.info.rubbed >= 0:
            turn = measure_frictions(target, y, y1, s, h, math.inf, model)
            if turn < NO_TURN and turn * h > 1e-14 * max(abs(t), 1e-3):
                loop.turn, loop.rejected, rejected = turn * h, loop.rejected + 1, True
                forget_event(part, work)
                continue
        loop.turn = math.inf
        end_rubbing(model, work)
        if adapts:
            keep_samples_before(P, t, h, target, model, work)
        else:
            keep_samples_by_cubics(t, h, target - near, until, model, work)
        loop.rubs0 = loop.rubs1
        stale = end_step(target, corrected, model, work) or part != NO_EVENT or not adapts
        if target >= loop.origin + (loop.grid + 1) * loop.step:
            loop.grid += 1
        if part != NO_EVENT or target >= until:
            note_before_jump(target, until, model, work)
        stop = end_events(part != NO_EVENT, target, model, work)
        if stop < 0:
            return stop
        if adapts:
            loop.step = min(following, max(loop.step, h)) * 0.1 if part != NO_EVENT else following
        if stop > 0:
            keep_rest(work, target)
            return STOPPED
        keep_samples_until(target + near, work)
        if target >= until:
            until, stale = next_stop(adapts, target, end, model, work), True
            if model.info.brakes > 0:  # a motor's torque may jump
                fire(model, target, work)
        loop.stale = 1 if stale else 0
        if not stale:
            note_extremes(s, model)
            for i in range(y.size):
                K[0, i] = K[K.shape[0] - 1, i]
    return BUDGET
