"""Time loop of generalized-alpha: steps, step control, samples, latches and restarts."""

from __future__ import annotations

import math
from typing import Any

from numba import types, void

from evolvent.flow.implicit import keep_momentum, residual
from evolvent.jit import REAL, VECTOR, indirect, inlined
from evolvent.kernels import contact, rigid
from evolvent.kernels.sparse import SPARSE
from evolvent.model import MODEL
from evolvent.solvers.alpha import solve_step, step_of
from evolvent.solvers.alpha_contact import (
    add_mean_forces,
    add_rest_of_wrenches,
    correct_velocities,
    find_stiff_part,
    solve_with_stiff_part,
)
from evolvent.solvers.alpha_energy import add_step_to_balance, energy_gained, fill_energies, gain_scale, note_drives
from evolvent.solvers.alpha_start import accelerations_at, start_accelerations, thread_accelerations
from evolvent.solvers.alpha_state import (
    AT_STOP,
    BETA,
    BUDGET,
    BY_JOINTS,
    COUPLED,
    DONE,
    ELASTIC,
    EVENT,
    FRESH,
    GAIN,
    GAINED,
    KINETIC,
    LARGEST,
    LAST,
    LONGEST,
    MARCH,
    N_LEDGER,
    NET,
    NO_CONVERGENCE,
    OVER,
    PEAK,
    REJECTED,
    SAMPLE,
    SINGULAR,
    SMALLEST,
    START,
    STEP,
    STEPS,
    STOP,
    TIME,
    TOLERANCE,
    displace,
    factor_at,
)

_I = types.int64

#: Steps between two looks at the energies, where nothing touches; they take half of an iteration's time.
EACH = 8


def functions(model: Any) -> list[Any]:
    """Functions of the time loop that a model needs."""
    found = [
        advance, begin, start_accelerations, accelerations_at, factor_at, displace, step_of, solve_step,
        add_step_to_balance, energy_gained, note_drives, fill_energies, keep_sample, restart, restore_start,
    ]  # fmt: skip
    if model.flexible.cylinders.size:
        found += [add_mean_forces, solve_with_stiff_part, find_stiff_part, correct_velocities, add_rest_of_wrenches]
    if model.threads.size:
        found += [thread_accelerations]
    return found


@indirect(void(_I, MODEL, MARCH))
def keep_sample(n, model, march):
    """Keep the state as sample n."""
    f = model.flexible
    for i in range(march.y.size):
        march.out_y[n, i] = march.y[i]
    for i in range(march.dq.size):
        march.out_a[n, i] = march.v1[1, i]
    for i in range(march.la.size):
        march.out_la[n, i] = march.la[i]
    for i in range(N_LEDGER):
        march.out_ledger[n, i] = march.ledger[i]
    for k in range(f.cylinders.size):
        row = march.out_cylinders[n, k]
        for i in range(6):
            row[i] = f.cylinders[k].F[i]
        row[6] = f.cylinders[k].normal
        row[7] = march.impulse[k]
        row[8] = f.cylinders[k].touching
    for b in range(model.bodies.size):
        for i in range(6):
            march.out_bodies[n, b, i] = model.bodies[b].F[i]


@indirect(_I(MODEL, SPARSE, VECTOR, MARCH))
def begin(model, matrix, options, march):
    """Start the loop from march.y at its time: accelerations, energies, sample 0; returns a status."""
    status = start_accelerations(model, matrix, options, march)
    if status != DONE:
        return status
    t = march.clock[TIME]
    if model.flexible.cylinders.size > 0:
        contact.end_contact_step(march.y, model)
    for i in range(march.dq.size):
        march.v1[2, i] = model.flexible.P[i]
    keep_momentum(t, 0.0, march.y, model.flexible.P, model, march.spare, march.kept)
    fill_energies(t, model, march)
    march.ledger[START] = march.ledger[KINETIC] + march.ledger[ELASTIC] + march.ledger[COUPLED]
    march.ledger[PEAK] = march.ledger[START]
    for k in range(model.flexible.hinges.size):
        model.flexible.hinges[k].before = model.flexible.hinges[k].angle
    if march.samples[0] <= t:
        keep_sample(0, model, march)
        march.tally[SAMPLE] = 1
    return DONE


@indirect(_I(MODEL, SPARSE, VECTOR, MARCH, _I))
def advance(model, matrix, options, march, budget):
    """Go on for `budget` steps or to the last sample; returns a status."""
    clock, tally, ledger = march.clock, march.tally, march.ledger
    n_v, n_j, n_t = march.dq.size, march.la.size, march.samples.size
    adaptive = options[TOLERANCE] > 0.0
    near = 10.0 * options[SMALLEST]  # times closer than this are one
    for _ in range(budget):
        t = clock[TIME]
        if tally[SAMPLE] == n_t:
            return DONE
        target = march.samples[tally[SAMPLE]]
        stops = tally[STOP] < march.stops.size and march.stops[tally[STOP]] <= target + near
        if stops:
            target = min(target, march.stops[tally[STOP]])
        h = min(clock[STEP], clock[EVENT])
        left = target - t
        lands = h >= left * (1.0 - 1e-9)
        if lands:
            h = left
        elif adaptive and 2.0 * h > left:
            h = 0.5 * left
        for i in range(march.y.size):
            march.y0[i] = march.y[i]
        for j in range(4):
            for i in range(n_v):
                march.v0[j, i] = march.v1[j, i]
        if model.threads.size == 0:  # algorithmic accelerations lie off the true ones in proportion to the step
            for i in range(n_v):
                march.v0[0, i] = march.v1[1, i] + (march.v1[0, i] - march.v1[1, i]) * min(h / clock[LAST], 1.0)
        for i in range(n_j):
            march.la0[i] = march.la[i]
        for i in range(march.powers.shape[1]):
            march.powers[1, i] = march.powers[0, i]
        note_drives(t, h, model, march)
        t1 = target if lands else t + h
        # what begins or ends at a stop has not done so yet
        t_end = t1 - max(1e-9 * h, 2.0 * near) if lands and stops else t1
        found = solve_step(t_end, h, model, matrix, options, march)
        error = 0.0
        if found > 0:
            if model.flexible.cylinders.size > 0 or model.threads.size > 0 or lands:
                # contacts, tensions and reactions of the state that the last correction led to
                residual(t_end, march.y, march.v1[1], march.la, h, 1.0, model, march.r, march.powers[0])
                if not adaptive and model.flexible.cylinders.size > 0:
                    found = solve_with_stiff_part(t_end, h, found, model, matrix, options, march)
                touches = model.flexible.cylinders.size > 0
                if found > 0 and touches and not correct_velocities(t_end, h, model, matrix, options, march):
                    found = SINGULAR
            if adaptive:
                c = abs(options[BETA] - 1.0 / 6.0) * h * h
                for i in range(n_v):
                    d = abs(march.v1[0, i] - march.v0[0, i]) + abs(march.v1[3, i] - march.v0[3, i])
                    error = max(error, c * d / march.weight[i])
                error /= options[TOLERANCE]
        if found <= 0 or error > 1.0:
            if not adaptive or h <= options[SMALLEST]:
                restore_start(model, march)
                return found if found <= 0 else NO_CONVERGENCE
            restore_start(model, march)
            tally[REJECTED] += 1
            clock[STEP] = h * (0.35 if found <= 0 else max(0.2, 0.85 * error ** (-1.0 / 3.0)))
            continue
        part = _until_latch(model) if error <= 1.0 else 1.0
        if part < 1.0 and h * part > options[SMALLEST]:
            restore_start(model, march)
            clock[EVENT] = h * part
            continue
        keep_momentum(t_end, h, march.y, model.flexible.P, model, march.spare, march.kept)
        for i in range(n_v):
            march.v1[2, i] = model.flexible.P[i]
        add_step_to_balance(t_end, h, model, march)
        clock[LAST], clock[EVENT] = h, math.inf
        clock[TIME] = t1
        tally[STEPS] += 1
        touching = model.flexible.cylinders.size + model.flexible.hinges.size > 0
        if lands or touching or tally[STEPS] % EACH == 0:
            net = energy_gained(t_end, model, march)
            clock[LARGEST] = max(clock[LARGEST] + net - clock[NET], 0.0)
            clock[NET] = net
            scale = gain_scale(ledger, options)
            passed = 1 if touching else EACH
            tally[OVER] = tally[OVER] + passed if clock[LARGEST] > options[GAIN] * scale else 0
        # a few steps from rest gain as much as there is, and then less and less beside it
        ends = t1 >= march.samples[n_t - 1] - near
        if tally[OVER] >= 20 or (ends and tally[OVER] >= (1 if tally[STEPS] > 5 else 2)):
            if lands and t1 >= march.samples[tally[SAMPLE]] - near:
                keep_sample(tally[SAMPLE], model, march)
                tally[SAMPLE] += 1
            return GAINED
        if adaptive:
            grow = 2.0 if error == 0.0 else min(2.0, 0.85 * error ** (-1.0 / 3.0))
            if found > 10:
                grow = min(grow, 0.7)
            if grow > 1.2 or grow < 1.0:
                clock[STEP] = min(max(h, clock[STEP] if lands else h) * grow, options[LONGEST])
            elif not lands:
                clock[STEP] = h
        latched = _latch(model)
        if tally[SAMPLE] < n_t and t1 >= march.samples[tally[SAMPLE]] - near:
            keep_sample(tally[SAMPLE], model, march)
            tally[SAMPLE] += 1
        if stops and lands:
            tally[STOP] += 1
            if model.threads.size > 0:
                return AT_STOP
            latched = True
            if adaptive:
                clock[STEP] = min(clock[STEP], max(options[SMALLEST] * 10.0, 1e-3 * clock[STEP]))
        if latched:
            status = restart(t1, h, model, matrix, options, march)
            if status != DONE:
                return status
    return BUDGET


@indirect(_I(REAL, REAL, MODEL, SPARSE, VECTOR, MARCH))
def restart(t, h, model, matrix, options, march):
    """Start again just after time t, where loads or joints change at once; the energy of a released joint is lost."""
    ledger = march.ledger
    before = ledger[KINETIC] + ledger[ELASTIC] + ledger[COUPLED]
    after = t + max(1e-9 * h, 20.0 * options[SMALLEST])
    march.clock[TIME] = after
    status = start_accelerations(model, matrix, options, march)
    march.clock[TIME] = t
    for i in range(march.dq.size):
        march.v1[2, i] = model.flexible.P[i]
    keep_momentum(after, 0.0, march.y, model.flexible.P, model, march.spare, march.kept)
    fill_energies(t, model, march)
    ledger[BY_JOINTS] += before - ledger[KINETIC] - ledger[ELASTIC] - ledger[COUPLED]
    return status


@inlined
def _until_latch(model):
    """Part of the step at which the first latch is passed, by a secant; 1 where none is, or the step ends on it."""
    hinges, part = model.flexible.hinges, 1.0
    for k in range(hinges.size):
        if hinges[k].latched == 0.0 and math.isfinite(hinges[k].latch):
            off, before = hinges[k].angle - hinges[k].latch, hinges[k].before - hinges[k].latch
            if hinges[k].side * off < -1e-10 and hinges[k].side * before > 0.0:
                part = min(part, before / (before - off))
    return part


@indirect(void(MODEL, MARCH))
def restore_start(model, march):
    """Restore the start of a step that is rejected."""
    for i in range(march.y.size):
        march.y[i] = march.y0[i]
    for j in range(4):
        for i in range(march.dq.size):
            march.v1[j, i] = march.v0[j, i]
    for i in range(march.la.size):
        march.la[i] = march.la0[i]
    for i in range(march.powers.shape[1]):
        march.powers[0, i] = march.powers[1, i]
    march.tally[FRESH] = 1
    rigid.kinematics(march.clock[TIME], march.y, model)


@inlined
def _latch(model):
    """Latch the hinges that have passed their latch's angle, as seen by the sign of what they are off it."""
    hinges, found = model.flexible.hinges, False
    for k in range(hinges.size):
        hinges[k].before = hinges[k].angle
        off = hinges[k].angle - hinges[k].latch
        if hinges[k].latched == 0.0 and math.isfinite(hinges[k].latch) and hinges[k].side * off <= 0.0:
            hinges[k].latched = 1.0
            found = True
    return found
