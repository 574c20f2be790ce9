"""Time loop of generalized-alpha: steps, step control, latches and restarts."""

from __future__ import annotations

import math

from numba import types, void

from evolvent.compiled.jit import REAL, indirect, inlined
from evolvent.flow.implicit import keep_momentum, residual
from evolvent.kernels import attitude, contact, coordinate, hinge, rigid, thread, user_events
from evolvent.kernels.drive import FREE as FREE_SPOOL
from evolvent.kernels.passing import note_places, passing
from evolvent.kernels.sparse import SPARSE
from evolvent.model import MODEL
from evolvent.solvers.alpha import solve_step
from evolvent.solvers.alpha_energy import add_step_to_balance, fill_energies, has_gained, note_drives
from evolvent.solvers.alpha_samples import (
    keep_sample,
    keep_samples,
    next_start,
)
from evolvent.solvers.alpha_start import start_accelerations
from evolvent.solvers.alpha_state import (
    AT_RESTART,
    AT_STOP,
    BUDGET,
    DONE,
    GAINED,
    NO_CONVERGENCE,
    WORKSPACE,
)
from evolvent.solvers.balance import begin_extremes, energy_of, potential_of
from evolvent.solvers.step_error import beside_tolerance, fastest_rate, note_step

_I = types.int64
#: Largest angle of a free body over an adaptive step, rad: a steady turn has no error by itself, but samples between
#: the ends of a step do not show more.
LARGEST_TURN = 0.5
#: Part of a fixed step down to which it is divided where a thread goes slack or taut, or bodies may pass each other.
SMALLEST_PART = 1e-4


@indirect(_I(MODEL, SPARSE, WORKSPACE))
def begin(model, matrix, work):
    """Start the loop from work.y at its time: accelerations, energies, sample 0; returns a status."""
    for k in range(model.flexible.hinges.size):
        model.flexible.hinges[k].relax = coordinate.RELAX
    status = start_accelerations(model, matrix, work)
    if status != DONE:
        return status
    t = work.loop.time
    contact.end_contacts(work.y, model)
    for i in range(work.dq.size):
        work.loads1[i] = model.flexible.P[i]
    keep_momentum(t, 0.0, work.y, model.flexible.P, model, work.spare, work.kept)
    attitude.end_actuator_step(0.0, 0.5, work.dq, work.y, model)
    fill_energies(t, model, work)
    work.loop.fastest = fastest_rate(0.0, 1.0, work.y[model.info.nq : model.info.nq + work.dq.size], work.shares)
    work.loop.start_energy = energy_of(work.balance)
    begin_extremes(work.loop, work.balance.kinetic, potential_of(work.balance))
    if model.flexible.hinges.size > 0:
        coordinate.end_coordinate_step(0.0, 1.0, work.y, model.flexible.switches, model)
    hinge.end_hinge_step(model.flexible.switches, model.flexible.hinges)
    user_events.start_events(t, work.y, model)
    next_start(model, work)
    if work.samples[0] <= t:
        keep_sample(0, 1.0, t, 0.0, model, work)
        work.loop.sample = 1
    return DONE


@indirect(_I(MODEL, SPARSE, WORKSPACE, _I))
def advance(model, matrix, work, budget):
    """Go on for `budget` steps or to the last sample; returns a status."""
    loop, options = work.loop, work.options
    adaptive = options.tolerance > 0.0
    near = 10.0 * options.smallest  # times closer than this are one
    passes = contact.any_contact(model)
    if passes:
        rigid.kinematics(loop.time, work.y, model)
        note_places(model.bodies, work.R0, work.x0)
    for _ in range(budget):
        if loop.sample == work.samples.size:
            return DONE
        t = loop.time
        target, stops = next_target(work, near)
        h, lands = step_length(model, work, target - t, adaptive)
        t1 = target if lands else t + h
        # what begins or ends at a stop has not done so yet
        t_end = t1 - max(1e-9 * h, 2.0 * near) if lands and stops else t1
        save_start(h, model, work)
        iterations = solve_step(t_end, h, model, matrix, work)
        if iterations > 0:  # forces of the state that the last correction led to
            residual(t_end, work.y, work.dv1, work.la, h, 1.0, model, work.r, work.powers[0])
        error = local_error(h, model, work) if adaptive and iterations > 0 else 0.0
        if passes and iterations > 0:
            note_places(model.bodies, work.R1, work.x1)
            far = passing(work.y0, work.R0, work.x0, work.y, work.R1, work.x1, model)
            error = max(error, far * far * far)
        if iterations <= 0 or error > 1.0:
            restore_start(model, work)
            divides = _goes_slack(model) or (passes and iterations > 0)
            if not adaptive and divides and h > SMALLEST_PART * loop.step:
                loop.rejected += 1
                loop.event_step = 0.35 * h
                continue
            if not adaptive or h <= options.smallest:
                return iterations if iterations <= 0 else NO_CONVERGENCE
            loop.rejected += 1
            loop.step = h * (0.35 if iterations <= 0 else max(0.2, 0.85 * error ** (-1.0 / 3.0)))
            continue
        part = hinge.until_latch(model.flexible.switches, model.flexible.hinges)
        if _has_free_spool(model):
            part = min(part, thread.until_release(h, work.y0, work.y, model.flexible.switches, model))
        if model.events.size > 0:
            least = max(4.0 * options.smallest, user_events.SURE * loop.step)
            limit, extended = loop.event_step, loop.extended
            due = user_events.until_event(t_end, h, least, limit, extended, work.y, model)
            part = due if part == 1.0 else min(part, due)
        if part != 1.0 and h * part > options.smallest:
            restore_start(model, work)
            loop.event_step, loop.extended = h * part, loop.extended + (part > 1.0)
            continue
        accept_step(t1, t_end, h, model, work)
        if passes:
            _keep_places(work)
        gained = has_gained(t_end, t1 >= work.samples[work.samples.size - 1] - near, model, work)
        keep_samples(t, t1 - t, model, work)
        next_start(model, work)
        if gained:
            return GAINED
        restarts = _latch(t1, model, work)
        if model.events.size > 0 and user_events.fire_events(t1, model, work):
            restarts = True
        if adaptive:
            loop.step = next_step(h, error, iterations, lands, work)
        if stops and lands:
            loop.stop += 1
            if model.threads.size > 0:
                return AT_STOP
            restarts = True
            if adaptive:
                loop.step = min(loop.step, max(options.smallest * 10.0, 1e-3 * loop.step))
        if _has_free_spool(model) and thread.has_release(work.y, model.flexible.switches, model):
            return AT_STOP
        if restarts:
            return AT_RESTART
    return BUDGET


@inlined
def _keep_places(work):
    """Make the bodies' places at the end of a step those at the start of the next."""
    for b in range(work.x0.shape[0]):
        for i in range(3):
            work.x0[b, i] = work.x1[b, i]
            for j in range(3):
                work.R0[b, i, j] = work.R1[b, i, j]


@inlined
def _has_free_spool(model):
    """Whether a thread is on a free spool."""
    found = False
    for p in range(model.threads.size):
        found = found or model.threads[p].drive == FREE_SPOOL
    return found


@inlined
def _goes_slack(model):
    """Whether a thread can go slack, or stick on its spool: forces that Newton's method may not resolve in one step."""
    found = False
    for p in range(model.threads.size):
        found = found or model.threads[p].slack != 0 or model.threads[p].drive == FREE_SPOOL
    return found


@inlined
def next_target(work, near):
    """Time of the next stop, or of the end, and whether it is a stop."""
    loop, target = work.loop, work.samples[work.samples.size - 1]
    stops = loop.stop < work.stops.size and work.stops[loop.stop] <= target + near
    if stops:
        target = min(target, work.stops[loop.stop])
    return target, stops


@inlined
def step_length(model, work, left, adaptive):
    """Length of the next step, at most the time `left` to the target, and whether it lands there."""
    h = min(work.loop.step, work.loop.event_step, hinge.longest_step(model.flexible.hinges))
    if adaptive and model.threads.size > 0:
        h = min(h, thread.longest_step(work.y, model.flexible.switches, model))
    if h >= left * (1.0 - 1e-6):  # which adds up round-off
        return left, True
    if adaptive and 2.0 * h > left:
        h = 0.5 * left
    return h, False


@inlined
def save_start(h, model, work):
    """Save the start of a step of length h, and what drives will change over it."""
    for i in range(work.y.size):
        work.y0[i] = work.y[i]
    for i in range(work.dq.size):
        work.a0[i], work.dv0[i] = work.a1[i], work.dv1[i]
        work.loads0[i] = work.loads1[i]
    if model.threads.size == 0:  # algorithmic accelerations lie off the true ones in proportion to the step
        for i in range(work.dq.size):
            work.a0[i] = work.dv1[i] + (work.a1[i] - work.dv1[i]) * min(h / work.loop.last_step, 1.0)
    for i in range(work.la.size):
        work.la0[i] = work.la[i]
    for i in range(work.powers.shape[1]):
        work.powers[1, i] = work.powers[0, i]
    note_drives(work.loop.time, h, model, work)


@inlined
def local_error(h, model, work):
    """Estimated error of a step beside the tolerance: c h^2 (a1 - a0); above 1 where a body turns too far."""
    c, error, rates = abs(work.options.beta - 1.0 / 6.0) * h * h, 0.0, 0.0
    for i in range(work.dq.size):
        change = c * (work.a1[i] - work.a0[i])
        error = max(error, abs(change) / work.weight[i])
        rates += work.shares[i] * change * change
    turn = largest_turn(model, work.dq) / LARGEST_TURN
    error = beside_tolerance(error, rates, h, work.dq, work.shares, work.loop, work.options)
    return max(error, turn * turn * turn)


@inlined
def largest_turn(model, dq):
    """Largest angle by which a free body turns over a step, rad."""
    bodies, n_q, square = model.bodies, model.info.nq, 0.0
    for b in range(bodies.size):
        if bodies[b].motion == rigid.FREE:
            at = bodies[b].iv - n_q + 3
            square = max(square, dq[at] * dq[at] + dq[at + 1] * dq[at + 1] + dq[at + 2] * dq[at + 2])
    return math.sqrt(square)


@inlined
def next_step(h, error, iterations, lands, work):
    """Length of the next adaptive step after one of length h."""
    before = work.loop.step
    grow = 2.0 if error == 0.0 else min(2.0, 0.85 * error ** (-1.0 / 3.0))
    if iterations > 10:
        grow = min(grow, 0.7)
    if grow > 1.2 or grow < 1.0:
        return min(max(h, before if lands else h) * grow, work.options.longest)
    return before if lands else h


@inlined
def accept_step(t1, t_end, h, model, work):
    """Accept a step: momentum that is kept, and its work and losses."""
    loop = work.loop
    keep_momentum(t_end, h, work.y, model.flexible.P, model, work.spare, work.kept)
    for i in range(work.dq.size):
        work.loads1[i] = model.flexible.P[i]
    add_step_to_balance(t_end, h, model, work)
    note_step(loop, fastest_rate(loop.fastest, h, work.dq, work.shares))
    loop.last_step, loop.event_step, loop.extended = h, math.inf, 0
    loop.time = t1
    loop.steps += 1


@indirect(_I(REAL, REAL, MODEL, SPARSE, WORKSPACE))
def restart(t, h, model, matrix, work):
    """Start again just after time t, where loads or joints change at once; the energy of a released joint is lost.

    Parameters
    ----------
    h : float, s, length of the step before
    """
    before = energy_of(work.balance)
    after = t + max(1e-9 * h, 20.0 * work.options.smallest)
    work.loop.time = after
    status = start_accelerations(model, matrix, work)
    work.loop.time = t
    if status != DONE:
        return status
    for i in range(work.dq.size):
        work.loads1[i] = model.flexible.P[i]
    keep_momentum(after, 0.0, work.y, model.flexible.P, model, work.spare, work.kept)
    if model.flexible.hinges.size > 0:
        coordinate.end_coordinate_step(0.0, 1.0, work.y, model.flexible.switches, model)
    attitude.end_actuator_step(0.0, 0.5, work.dq, work.y, model)
    fill_energies(t, model, work)
    work.balance.by_joints += before - energy_of(work.balance)
    next_start(model, work)
    return status


@indirect(void(MODEL, WORKSPACE))
def restore_start(model, work):
    """Restore the start of a step that is rejected."""
    for i in range(work.y.size):
        work.y[i] = work.y0[i]
    for i in range(work.dq.size):
        work.a1[i], work.dv1[i] = work.a0[i], work.dv0[i]
        work.loads1[i] = work.loads0[i]
    for i in range(work.la.size):
        work.la[i] = work.la0[i]
    for i in range(work.powers.shape[1]):
        work.powers[0, i] = work.powers[1, i]
    work.loop.stale = 1
    rigid.kinematics(work.loop.time, work.y, model)


@inlined
def _latch(t, model, work):
    """Latch the hinges that have reached their latches at the end of a step; returns whether any has."""
    hinges, s, loop = model.flexible.hinges, model.flexible.switches, work.loop
    found = False
    for k in range(hinges.size):
        if hinge.latch_reached(s, hinges, k):
            coordinate.lock(s, hinges, k)
            work.log_t[loop.latches], work.log_k[loop.latches] = t, k
            loop.latches += 1
            found = True
            user_events.release(t, -2 - k, model)
    hinge.end_hinge_step(s, hinges)
    return found
