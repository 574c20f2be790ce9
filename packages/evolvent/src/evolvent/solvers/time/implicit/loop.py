"""The loop of implicit steps: targets, step control, latches, events, samples and restarts, of both methods.

A method has functions that start a step, predict its increments, evaluate the residual, factor the tangent, correct the
increments, estimate the error, end the step, and start again where loads or joints change at once
(`evolvent.solvers.time.implicit.methods`). What else differs are flags of `options`. The functions of a method are
compiled and loaded with the first of its runs (`needs.load`).
"""

from __future__ import annotations

import math

from numba import types

from evolvent.algebra.sparse import SPARSE
from evolvent.compiled.jit import REAL, indirect, inlined
from evolvent.equations.between_steps import longest_turn, note_extremes, note_stage, note_state, take_step
from evolvent.equations.step_end import start_run
from evolvent.kernels import contact, rigid, turning, watches
from evolvent.kernels.calls import change_at, is_due_at, momentum_at, reached_at, until_change_at, until_event_at
from evolvent.kernels.grazing import until_deepest, until_touch
from evolvent.kernels.passing import note_places, passing
from evolvent.model import MODEL
from evolvent.solvers.common.balance import begin_extremes, energy_of, potential_of
from evolvent.solvers.time.implicit import (
    alpha_start,
    energy_step,
    events as implicit_events,
    methods as method,
    newton,
)
from evolvent.solvers.time.implicit.balance import add_step_to_balance, fill_energies, has_gained, note_drives
from evolvent.solvers.time.implicit.samples import (
    begin_next,
    fill_forces,
    keep_sample,
    keep_samples,
    restore_wrenches,
    start_next,
)
from evolvent.solvers.time.implicit.step_error import ABOVE_LEFT, fastest_rate, note_step
from evolvent.solvers.time.implicit.workspace import (
    AT_RESTART,
    AT_STOP,
    BUDGET,
    DONE,
    GAINED,
    NO_CONVERGENCE,
    STOPPED,
    WORKSPACE,
)

_I = types.int64
#: Part of a fixed step down to which generalized-alpha divides it where a thread goes slack or taut, bodies may pass
#: each other, or Newton's method finds no solution although nothing touches: a force that jumps at a touch has none.
SMALLEST_PART = 1e-4
#: Steps of one length after which an adaptive step of generalized-alpha may grow, and by how much at most: a change of
#: length leaves an error in the algorithmic accelerations that decays by (1 - 2 rho)/(2 - rho) a step, 0.7 for the
#: radius 0.9, and that the estimate of the next steps takes for theirs.
STEADY, GROWTH = 6, 1.5


@indirect(_I(MODEL, SPARSE, WORKSPACE))
def begin(model, matrix, work):
    """Start the loop from work.y at its time: forces, energies, sample 0; returns a status."""
    loop, n_q = work.loop, model.info.nq
    start_run(loop.time, 0.5 if work.options.midpoint != 0 else 1.0, 0.0, work.y, model, work.booked)
    if work.options.midpoint != 0:
        energy_step.begin(model, work)
    else:
        status = alpha_start.begin(model, matrix, work)
        if status != DONE:
            return status
    fill_energies(loop.time, model, work)
    note_stage(loop.time, 1, model)
    if turning.has_friction(model):
        turning.measure_rates(work.y, model)
        turning.keep_rates(model)
    loop.fastest = fastest_rate(0.0, 1.0, work.y[n_q : n_q + work.dq.size], work.shares)
    loop.start_energy = energy_of(work.balance)
    begin_extremes(loop, work.balance.kinetic, potential_of(work.balance))
    take_step(model.switches, model)
    watches.start_events(loop.time, work.y, model)
    if work.options.midpoint == 0:  # else those at the start are those of the first step
        fill_forces(model, work)
        note_extremes(model.switches, model)
    start_next(work)
    keep_sample(0, 1.0, loop.time, 0.0, model, work)
    loop.sample = 1
    return DONE


@indirect(_I(MODEL, SPARSE, WORKSPACE, _I))
def advance(model, matrix, work, budget):
    """Go on for `budget` steps or to the last sample; returns a status."""
    loop, options, midpoint = work.loop, work.options, work.options.midpoint != 0
    adaptive, near = options.tolerance > 0.0, 10.0 * options.smallest  # times closer than this are one
    end = work.samples[work.samples.size - 1]
    passes = contact.any_contact(model)
    if passes and not midpoint:
        rigid.kinematics(loop.time, work.y, model)
        note_places(model.bodies, work.R0, work.x0)
    for _ in range(budget):
        if loop.sample == work.samples.size:
            return DONE
        t = loop.time
        stops = loop.stop < work.stops.size and work.stops[loop.stop] < end - near
        target = work.stops[loop.stop] if stops else end
        h, lands = step_length(target - t, model, work)
        ahead = h + loop.behind
        t1 = target if lands else t + ahead
        before = max(1e-9 * h, 2.0 * near) if lands and stops else 0.0  # what begins or ends there has not done so yet
        if midpoint:
            h -= min(0.5 * h, before)
        t_end = t + h if midpoint else t1 - before
        iterations, error = try_step(t, t_end, h, passes, model, matrix, work)
        if iterations <= 0 or error > 1.0:
            restore_start(model, work)
            if not is_tried_again(h, iterations, error, passes, model, work):
                return iterations if iterations <= 0 else NO_CONVERGENCE
            continue
        part = until_event(t_end, h, model, work)
        if part != 1.0 and h * part > options.smallest:
            restore_start(model, work)
            loop.event_step, loop.extended = h * part, loop.extended + (part > 1.0)
            continue
        turn = until_turn(t_end, h, model, work) if turning.has_friction(model) else turning.NO_TURN
        if turn < turning.NO_TURN and h * turn > options.smallest:
            restore_start(model, work)
            loop.whole = loop.whole if loop.whole > 0.0 else h
            loop.turn_step, loop.rejected = h * turn, loop.rejected + 1
            continue
        turned, rest = loop.turn_step < math.inf, loop.whole - h
        cut = midpoint and not passes and loop.event_step < math.inf  # by an event, which says nothing of the next step
        accept_step(t1, t_end, h, model, work)
        loop.behind = 0.0 if lands else ahead - (t1 - t)
        if not adaptive and rest > options.smallest:
            loop.turn_step = rest
        gained = has_gained(t1 >= end - near, model, work)
        keep_samples(t, h if midpoint else t1 - t, model, work)
        stopped = watches.is_stopped(model)
        if stopped and loop.sample < work.samples.size and t1 > work.samples[loop.sample - 1]:  # the last sample
            keep_sample(loop.sample, 1.0, t, h if midpoint else t1 - t, model, work)
            work.samples[loop.sample] = t1
            loop.sample += 1
        start_next(work)
        if gained:
            return GAINED
        restarts = _latch(t1, model, work)
        if model.watches.size > 0:
            restarts = watches.fire_events(t1, model, work) or restarts
            if stopped:
                return STOPPED
        if adaptive:
            loop.step = next_step(h, error, iterations, lands or turned or cut, work)
        elif options.divides != 0 and not lands and not turned:
            loop.step = min(2.0 * h, loop.wanted)
        if lands and stops:
            loop.stop += 1
            restarts = True
        if model.info.releases > 0 and ((lands and stops) or has_release(model, work)):
            return AT_STOP
        if restarts:
            starts = method.restart(model, work)
            if starts:
                book_release(energy_of(work.balance), loop.time + 20.0 * options.smallest, model, work)
            if adaptive and (starts or (lands and stops)):
                shortest = options.first if starts else max(options.smallest * 10.0, 1e-3 * loop.step)
                loop.step = min(loop.step, shortest)
            return AT_RESTART
    return BUDGET


@inlined
def step_length(left, model, work):
    """Length of the next step, at most the time `left` to the target, and whether it lands there."""
    loop, midpoint = work.loop, work.options.midpoint != 0
    h = min(loop.step, loop.event_step, loop.turn_step)
    h = min(h, longest_turn(model), method.longest_step(model, work))
    if h >= left * (1.0 - (1e-9 if midpoint else 1e-6)):  # which adds up round-off
        return left, True
    if work.options.tolerance > 0.0 and not midpoint and 2.0 * h > left:
        h = 0.5 * left
    return h, False


@inlined
def try_step(t, t_end, h, passes, model, matrix, work):
    """Take a step of length h from t to t_end: (iterations, or a status below zero; error beside the tolerance)."""
    error = 0.0
    work.loop.tried = h
    for i in range(work.y.size):
        work.y0[i] = work.y[i]
    method.start_step(t, h, model, work)
    note_drives(t, h, model, work)
    if work.options.midpoint != 0:
        iterations = newton.solve_energy(model, matrix, work)
    else:
        iterations = newton.solve_end(t_end, h, model, matrix, work)
    if work.options.tolerance > 0.0 and iterations > 0:
        error = method.local_error(h, model, work)
    if passes and iterations > 0:
        far = passing(work.y0, work.R0, work.x0, work.y, work.R1, work.x1, model)
        if model.body_contacts.size > 0:
            part = until_deepest(h, work.y0, work.R0, work.x0, work.y, work.R1, work.x1, model)
            far = max(far, 1.0 / part if part < 1.0 else 0.0)
        error = max(error, far * far * far)
    if work.options.laws != 0 and iterations > 0 and error <= 1.0:
        error = max(error, energy_step.law_error(model, work))
    return iterations, error


@inlined
def is_tried_again(h, iterations, error, passes, model, work):
    """Whether a step without a solution, or with too large an error, is tried again; sets its length.

    Both methods divide fixed steps without a solution: of beams that are a million times stiffer along than across it
    depends on round-off whether Newton's method finds it. Generalized-alpha goes on with the whole step after it.
    """
    loop, options, divides = work.loop, work.options, work.options.divides != 0
    adaptive, solved = options.tolerance > 0.0, iterations > 0
    if (
        not divides
        and not adaptive
        and (model.info.abrupt > 0 or (passes if solved else loop.contact_set == 0))
        and h > SMALLEST_PART * loop.step
    ):
        loop.rejected += 1
        loop.event_step = 0.35 * h
        return True
    if h <= options.smallest or not (adaptive or divides):
        return False
    if divides and not (adaptive and solved):
        loop.divided += 1
        loop.step = 0.5 * h
        return True
    loop.rejected += 1
    loop.step = h * (max(0.2, 0.85 * error ** (-1.0 / 3.0)) if solved else 0.35)
    return True


@inlined
def next_step(h, error, iterations, lands, work):
    """Length of the next adaptive step after one of length h; it `lands` where its end was given."""
    before, conserves = work.loop.step, work.options.conserves != 0
    grow = 2.0 if error == 0.0 else min(2.0, 0.85 * error ** (-1.0 / 3.0))
    if not conserves and grow > 1.0:
        grow = 1.0 if work.loop.steady < STEADY else min(grow, GROWTH)
    if iterations > (newton.PLAIN if conserves else 10):
        grow = min(grow, 0.6 if conserves else 0.7)
    if grow > 1.2 or grow < 1.0:
        return min(max(h, before if lands else h) * grow, work.options.longest)
    return before if lands or conserves else h


@inlined
def until_event(t, h, model, work):
    """Length of the step that ends on the first latch, release or event, as a part of the step of length h to t; or 1.

    It may be longer, to end behind an event.
    """
    part = until_coordinate(h, model, work)
    if work.options.tolerance > 0.0 and (1.0 - part) * h * work.loop.fastest <= ABOVE_LEFT * work.loop.left:
        part = 1.0  # as near as the increments are known
    if work.options.midpoint != 0 and work.options.tolerance > 0.0 and model.body_contacts.size > 0:
        part = min(part, until_touch(h, work.y0, work.R0, work.x0, work.y, work.R1, work.x1, model))
    calls = model.node_events_until_calls
    for k in range(calls.size):
        part = min(part, until_change_at(model, calls[k])(h, work.y0, work.y, model.switches, model))
    if model.watches.size > 0:
        least = max(4.0 * work.options.smallest, watches.SURE * work.loop.step)
        limit, extended = work.loop.event_step, work.loop.extended
        implicit_events.note_middle(t, h, model, work)
        due = watches.until_event(t, h, least, limit, extended, work.y, model)
        if h > 2.0 * least:
            due = implicit_events.rise_in_step(t, h, due, model, work)
        part = due if part == 1.0 else min(part, due)
    return part


@indirect(REAL(REAL, REAL, MODEL, WORKSPACE), used_for=turning.USED_FOR)
def until_turn(t, h, model, work):
    """Part of the step of length h to t at which the first friction turns back, as of `turning.until_turn`."""
    measure_rates(t, model, work)
    return turning.until_turn(work.y0, work.y, h, model)


@inlined
def measure_rates(t, model, work):
    """Rates of frictions at the end of a step, at t, after its last residual."""
    if work.options.midpoint != 0:
        fill_forces(model, work)
        rigid.kinematics(t, work.y, model)
        restore_wrenches(model, work)
    turning.measure_rates(work.y, model)


@inlined
def until_coordinate(h, model, work):
    """Part of a step of length h at which the first event falls that its family finds itself; 1 for none."""
    calls, part = model.switching_until_calls, 1.0
    for k in range(calls.size):
        part = min(part, until_event_at(model, calls[k])(h, work.loop.last, work.options.midpoint, model))
    return part


@inlined
def has_release(model, work):
    """Whether an event that changes the number of moving nodes is due."""
    calls, found = model.node_events_is_due_calls, False
    for k in range(calls.size):
        found = found or is_due_at(model, calls[k])(work.y, model.switches, model)
    return found


@inlined
def restore_start(model, work):
    """Restore the start of a step that is rejected."""
    for i in range(work.y.size):
        work.y[i] = work.y0[i]
    method.restore_start(model, work)


@inlined
def accept_step(t1, t_end, h, model, work):
    """Accept a step: its work and losses, forces and energies at its end."""
    loop = work.loop
    method.end_step(t_end, h, model, work)
    add_step_to_balance(t_end, h, model, work)
    calls = model.step_rates_calls
    for k in range(calls.size):
        momentum_at(model, calls[k])(work.y, model, work.rate)
    fill_forces(model, work)
    note_extremes(model.switches, model)
    fill_energies(t_end, model, work)
    note_stage(t1, 0, model)
    note_step(loop, fastest_rate(loop.fastest, h, work.dq, work.shares))
    loop.steady = loop.steady + 1 if abs(h - loop.last) <= 1e-9 * h else 0
    loop.last, loop.event_step, loop.turn_step, loop.whole, loop.extended = h, math.inf, math.inf, 0.0, 0
    loop.found = 0
    if turning.has_friction(model):
        turning.keep_rates(model)
    loop.time = t1
    loop.steps += 1


@inlined
def _latch(t, model, work):
    """Carry out events that a step has reached and its families find themselves, as latches; returns whether any.

    Laws that have ended change over to others.
    """
    calls, s, found = model.switching_reached_calls, model.switches, False
    for i in range(calls.size):
        k = reached_at(model, calls[i])(0, model)
        while k >= 0:
            if work.options.midpoint != 0 and not found:
                note_state(t, work.y, s, model)  # rates at the end; those of the step are means
            lock(t, k, model, work)
            found = True
            k = reached_at(model, calls[i])(k + 1, model)
    calls = model.switching_change_calls
    for i in range(calls.size):
        lost = change_at(model, calls[i])(t, work.y, s, model)
        if not math.isnan(lost):
            work.balance.by_friction += lost
            work.balance.coupled -= lost
            found = True
    take_step(s, model)
    return found


@inlined
def lock(t, k, model, work):
    """Carry out event k of those that a family finds itself, at the end of a step: the latch of coordinate k locks."""
    loop = work.loop
    watches.fire_event(t, model.event_firsts[0] + model.watches.size + k, 1, work.y, model.switches, model)
    work.log_t[loop.latches], work.log_k[loop.latches] = t, k
    loop.latches += 1


@inlined
def book_release(before, t, model, work):
    """Count the energy that a penalty or joint coordinate loses where it is released as a loss of the joints.

    Parameters
    ----------
    before : float, J, energy before the release
    """
    fill_energies(t, model, work)
    work.balance.by_joints += before - energy_of(work.balance)
    for i in range(work.row.size):
        work.row0[i] = work.row[i]


@indirect(_I(REAL, MODEL, SPARSE, WORKSPACE))
def restart(after, model, matrix, work):
    """Start generalized-alpha again with the loads and joints just `after` the time reached; returns a status."""
    before = energy_of(work.balance)
    status = alpha_start.restart(after, model, matrix, work)
    if status == DONE:
        book_release(before, work.loop.time, model, work)
        begin_next(model, work)
    return status
