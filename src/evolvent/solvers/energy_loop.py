"""Time loop of the energy-momentum method: Newton's method, divided steps, error estimate, samples between steps."""

from __future__ import annotations

import math

import numpy as np
from numba import types, void

from evolvent.compiled.jit import REAL, indirect, inlined
from evolvent.compiled.pointer import Struct, array, record, struct
from evolvent.flow.energy_momentum import EnergyStep, measure, residual, tangent
from evolvent.flow.implicit import energies
from evolvent.flow.powers import DRIVEN, JOINTS, MARKER_LOADS, MASS_DAMPING, SPRINGS, STIFFNESS_DAMPING
from evolvent.kernels import (
    attitude,
    contact,
    coordinate,
    hinge,
    joint,
    rigid,
    sparse_lu,
    user_events,
)
from evolvent.kernels.flexible import is_finite
from evolvent.kernels.passing import passing
from evolvent.kernels.sparse import SPARSE
from evolvent.model import MODEL
from evolvent.solvers.balance import (
    BALANCE,
    EXTREMES,
    LOSSES,
    WORK,
    begin_extremes,
    extend_extremes,
    largest_of,
    moved_of,
)
from evolvent.solvers.dense import interpolate, momenta_between
from evolvent.solvers.least_norm import add_compliance
from evolvent.solvers.sampled import TOUCHED, write_contacts
from evolvent.solvers.step_error import beside_tolerance, fastest_rate, newton_limit, note_step

_I = types.int64
# status codes
BUDGET, DONE, AT_RESTART, NO_CONVERGENCE, NOT_FINITE, SINGULAR, GAINED, REDUNDANT = 0, 1, 2, -1, -2, -3, -4, -5
#: Counters and clock. sample, stop: the next ones; stages: solutions that needed softened contacts; divided: steps that
#: were divided; wanted, length: of the next step, s, before and after it was divided; last: length of the step before,
#: s, 0 at a start; start: J, defect of the balance at the start; factored: length of the step whose matrix is factored,
#: s, 0 of none; contact_set: points that pressed in it (`_count_touching`); settling: steps until rates are smooth
#: again after that; fastest: largest mean rate so far, 1/s; left, left0: what Newton's method has left in this step and
#: in those before, beside `weight`; extended: whether the step was made longer to end behind an event; and the extremes
#: of `evolvent.solvers.balance`.
LOOP = np.dtype(
    [(name, np.int64) for name in ("steps", "iterations", "rejected", "factorizations", "sample", "stop", "stages",
                                   "divided", "latches", "contact_set", "settling", "extended")]
    + [(name, np.float64) for name in ("time", "wanted", "length", "event_step", "last", "quality", "start",
                                       "factored", "fastest", "left", "left0")]
    + list(EXTREMES),
    align=True,
)  # fmt: skip
#: tolerance: 0 of fixed steps; rates: of rates beside the fastest, likewise; newton: correction at which an iteration
#: has converged; sharp: share of `rates` that it may leave, 0 without a limit; mass: a typical one, kg; all beside
#: `weight`; gain: part of the energy moved that the balance may gain; floor: energy beside which a gain is round-off,
#: J; first: step at a start, s.
OPTIONS = np.dtype(
    [(name, np.float64) for name in ("chi", "tolerance", "rates", "newton", "sharp", "smallest", "longest", "mass",
                                     "gain", "floor", "first")]
)  # fmt: skip
#: Part of the energy moved that the balance may gain by round-off and by what Newton's method leaves.
LARGEST_GAIN = 1e-3
#: Indices of the balance's fields in a row.
ROW = {name: k for k, name in enumerate(BALANCE.names or ())}
KINETIC, ELASTIC, BENDING, CONTACT, COUPLED = (ROW[n] for n in ("kinetic", "elastic", "bending", "contact", "coupled"))
LOADS, DRIVES, BY_MASS, BY_STIFFNESS = (ROW[n] for n in ("loads", "drives", "by_mass", "by_stiffness"))
BY_CONTACT, BY_FRICTION, BY_JOINTS, BY_SPRINGS = (
    ROW[n] for n in ("by_contact", "by_friction", "by_joints", "by_springs")
)
#: Signs of the fields of a row in the defect: what there is and what was lost, less what came in.
SIGNS = np.array([-1.0 if name in WORK else 1.0 for name in ROW])
SIGNS[[BENDING, CONTACT]] = 0.0  # which the elastic energy contains
#: Whether a field of a row is a loss.
IS_LOSS = np.array([name in LOSSES for name in ROW])
#: Convergence slower than this takes a new tangent.
SLOW = 0.15
#: A correction below this that a new tangent does not reduce is round-off: elements may be stiff, and joints near a
#: position where they depend on one another.
ROUND_OFF = 1e-8
#: Share of `newton` that the corrections for momenta which are kept reach, and most corrections for them.
SHARPER, MOST_SHARPENED = 1e-2, 4
#: Most iterations with the contacts as they are, of the softest stage, and of one of those after it.
PLAIN, FIRST, STAGED = 20, 40, 20
#: Power of ten of the contacts' stiffness in the softest stage, and its least rise from one stage to the next.
SOFTEST, LEAST_RISE = -6.0, 0.5


class EnergyLoop(Struct):
    """What the loop carries from step to step.

    Attributes
    ----------
    step : EnergyStep; options, loop : records
    weight : (nv,) float, size of each unknown that counts as 1; shares : (nv,) float, see
        `implicit_setup.shares`
    x : (nv + nj,) float, correction
    dq0, la1 : (nv,) and (nj,) float, increments and multipliers of the last stage that has converged
    rate, acceleration : (nv,) float, mean of the step before, and by it and the one before that
    la0, paths : (nj,) float, multipliers of the step before; what drives change in the joints' gaps
    balance0, balance : (number of fields,) float, J, at the start and the end of the step; energies : (3,) float
    impulse0, impulse : (nc,) float, N s, of the normal forces of each cylinder; touched0, touched : (nbc,) float,
        likewise of each contact between bodies
    wrenches : (nb, 6) float, of the step on the bodies; momenta : (6,) float, scratch
    samples, stops : float, s; out_* : what is kept at the samples
    log_t, log_k : (nh + ne,) float and int, s, times of latches and events; their hinges, and -1 - k of event k
    """

    step: EnergyStep = struct(EnergyStep)
    options: np.record = record(OPTIONS)
    loop: np.record = record(LOOP)
    weight: np.ndarray = array(1)
    shares: np.ndarray = array(1)
    x: np.ndarray = array(1)
    la0: np.ndarray = array(1)
    dq0: np.ndarray = array(1)
    la1: np.ndarray = array(1)
    rate: np.ndarray = array(1)
    acceleration: np.ndarray = array(1)
    paths: np.ndarray = array(1)
    balance0: np.ndarray = array(1)
    balance: np.ndarray = array(1)
    energies: np.ndarray = array(1)
    impulse0: np.ndarray = array(1)
    impulse: np.ndarray = array(1)
    touched0: np.ndarray = array(1)
    touched: np.ndarray = array(1)
    wrenches: np.ndarray = array(2)
    samples: np.ndarray = array(1)
    stops: np.ndarray = array(1)
    momenta: np.ndarray = array(1)
    log_t: np.ndarray = array(1)
    log_k: np.ndarray = array(1, np.int64)
    out_s: np.ndarray = array(2, np.int64)
    out_y: np.ndarray = array(2)
    out_a: np.ndarray = array(2)
    out_la: np.ndarray = array(2)
    out_balance: np.ndarray = array(2)
    out_momenta: np.ndarray = array(2)
    out_cylinders: np.ndarray = array(3)
    out_touches: np.ndarray = array(3)
    out_friction: np.ndarray = array(3)
    out_points: np.ndarray = array(2)
    out_bodies: np.ndarray = array(3)


ENERGY_LOOP = EnergyLoop._numba_type_


@inlined
def _count_touching(model):
    """A number that encodes which contact points press, and which coordinates of joints slip."""
    return contact.pressed(model) + coordinate.count_slipping(model)


@inlined
def _along(work):
    """The residual along the correction: dq . r."""
    found = 0.0
    for i in range(work.step.dq.size):
        found += work.x[i] * work.step.r[i]
    return found


@inlined
def _shift(s, model, work):
    """Move the increments by s times the correction, and evaluate."""
    for i in range(work.step.dq.size):
        work.step.dq[i] += s * work.x[i]
    residual(model, work.step)


@indirect(REAL(REAL, MODEL, ENERGY_LOOP))
def search(before, model, work):
    """Where along the correction the residual along it vanishes, the increments being there; from 0 to 1.

    Parameters
    ----------
    before : float, dq . r at the start, below 0
    """
    _shift(1.0, model, work)
    low, high, f_low, f_high = 0.0, 1.0, before, _along(work)
    if not math.isfinite(f_high):
        f_high = -1e3 * before
    if f_high <= 0.0 or f_high < -0.5 * before:
        return 1.0
    at = 1.0
    for _ in range(8):
        s = low + (high - low) * min(max(f_low / (f_low - f_high), 0.1), 0.9)
        _shift(s - at, model, work)
        at = s
        f = _along(work)
        if abs(f) < -0.3 * before:
            break
        if f < 0.0:
            low, f_low = s, f
        else:
            high, f_high = s, f
    return at


@inlined
def _predict(accelerated, model, work):
    """Increments and multipliers from which Newton's method starts: the velocity changes as before, or stays."""
    step = work.step
    n_q, h = model.info.nq, step.step.h
    part = 0.5 * h / work.loop.last if accelerated and work.loop.last > 0.0 else 0.0
    for i in range(step.dq.size):
        step.dq[i] = h * (step.y0[n_q + i] + min(part, 1.0) * step.before[i])
    for k in range(step.la.size):
        step.la[k] = work.la0[k]


@indirect(_I(_I, _I, MODEL, SPARSE, ENERGY_LOOP))
def iterate(most, searches, model, matrix, work):
    """Newton's method from the present increments: the number of iterations, or a status below zero."""
    step, loop, options = work.step, work.loop, work.options
    n_v, n_j = model.info.nv, step.la.size
    scale = 4.0 * options.mass / (step.step.h * step.step.h)
    info = model.info
    info.compliance = 1.0 / scale
    inexact = model.flexible.elements.size + model.flexible.rods.size + n_j
    rounding = min(ROUND_OFF, 1e4 * options.newton) if inexact > 0 else 0.0
    residual(model, step)
    soft, last, ratio, touching = step.step.soft != 1.0, math.inf, 0.0, loop.contact_set
    limit = options.newton if soft else newton_limit(
        options.newton, options.sharp, options.rates, loop.fastest, step.step.h
    )  # fmt: skip
    # what keeps momenta or energy takes its own tangent, and one correction more: both converge to round-off
    keeps = step.step.chi_v == 0.0 and not soft
    stale = soft or keeps or loop.factored != step.step.h or info.redundant != 0
    kept, sharpened = not stale, 0
    loop.factored = 0.0
    for iteration in range(most):
        if not is_finite(step.r):
            return NOT_FINITE
        now = _count_touching(model)
        fresh = stale or (ratio > SLOW and sharpened == 0) or now != touching or model.info.redundant != 0
        if fresh:
            tangent(scale, model, step, matrix)
            found = sparse_lu.factor(matrix)
            loop.factorizations += 1
            loop.quality = min(loop.quality, matrix.quality[0])
            if found != 0:
                return SINGULAR if found < 0 else REDUNDANT
            stale = False
        touching = now
        if info.redundant != 0:
            add_compliance(scale, 2.0, model, matrix, step.la, work.x, step.r)
        for i in range(n_v):
            work.x[i] = -2.0 * step.r[i]
        for k in range(n_j):
            held = model.flexible.joints[k].stiffness <= 0.0
            work.x[n_v + k] = -scale * step.r[n_v + k] * (1.0 if held else 2.0)
        sparse_lu.solve(matrix, work.x)
        norm = 0.0
        for i in range(n_v):
            norm = max(norm, abs(work.x[i]) / work.weight[i])
        if not math.isfinite(norm):
            return NOT_FINITE
        loop.iterations += 1
        if sharpened > 0 and norm >= last:  # it cannot be sharpened further
            return _converged(iteration - 1, last, touching, work)
        if kept and iteration == 1 and norm > SLOW * last:  # the tangent of a step before does not serve here
            kept, stale, ratio, touching = False, True, 0.0, -1
            _predict(True, model, work)
            residual(model, step)
            continue
        for k in range(n_j):
            step.la[k] += 0.5 * scale * work.x[n_v + k]
        s = 1.0
        if searches != 0 and (n_j == 0 or iteration > 0):
            before = _along(work)
            if before < 0.0:
                s = search(before, model, work)
            else:
                _shift(1.0, model, work)
        else:
            _shift(1.0, model, work)
        if iteration > 0:
            ratio = norm / last if last > 0.0 else 0.0
        left = norm * ratio / (1.0 - ratio) if 0.0 < ratio < 0.9 else norm
        rounded = fresh and ratio > 0.5 and norm <= rounding  # a new tangent does not reduce it any more
        # of redundant constraints a second iteration corrects what the compliance leaves
        settled = s == 1.0 and (iteration > 0 or info.redundant == 0)
        if settled and (min(norm, left) <= limit or rounded) and _count_touching(model) == touching:
            sharp = sharpened > 0 and (left <= SHARPER * limit or ratio > 0.5)
            if not keeps or sharp or rounded or sharpened == MOST_SHARPENED:
                return _converged(iteration, min(norm, left), touching, work)
            sharpened += 1
        last = norm
    return NO_CONVERGENCE


@inlined
def _converged(iteration, left, touching, work):
    """Note what Newton's method has left, and for which step its matrix serves; returns the iterations."""
    loop, step = work.loop, work.step.step
    loop.left, loop.contact_set = left, touching
    loop.factored = step.h if step.soft == 1.0 else 0.0
    return iteration + 1


@indirect(_I(MODEL, SPARSE, ENERGY_LOOP))
def solve_step(model, matrix, work):
    """Solve a step; returns the iterations of Newton's method, or a status below zero.

    First from the velocities' last change, then from constant velocities, then with contacts that are stiffened.
    """
    step = work.step.step
    step.soft = 1.0
    _predict(True, model, work)
    contacts = contact.any_contact(model)
    found = iterate(PLAIN if contacts else STAGED, 0, model, matrix, work)
    if found > 0:
        return found
    _predict(False, model, work)
    found = iterate(PLAIN, 1, model, matrix, work)
    if found > 0:
        return found + PLAIN
    if not contacts:
        return found
    _predict(False, model, work)
    work.loop.stages += 1
    power, rise, total = SOFTEST, -0.5 * SOFTEST, 0
    while True:
        step.soft = 10.0**power
        found = iterate(FIRST if power == SOFTEST else STAGED, 1, model, matrix, work)
        if found > 0:
            total += found
            if power == 0.0:
                return total
            for i in range(work.step.dq.size):
                work.dq0[i] = work.step.dq[i]
            for k in range(work.step.la.size):
                work.la1[k] = work.step.la[k]
        else:
            if power == SOFTEST or rise < LEAST_RISE:
                step.soft = 1.0
                return found
            for i in range(work.step.dq.size):
                work.step.dq[i] = work.dq0[i]
            for k in range(work.step.la.size):
                work.step.la[k] = work.la1[k]
            power -= rise
            rise *= 0.5
        power = min(power + rise, 0.0)


@indirect(void(MODEL, ENERGY_LOOP))
def fill_energies(model, work):
    """Energies of the step's end into the balance."""
    t = work.step.step.t + work.step.step.h
    joints, coupled = model.flexible.joints, 0.0
    rigid.kinematics(t, work.step.y1, model)
    energies(t, work.step.y1, model, work.energies)
    for k in range(joints.size):
        if joints[k].stiffness > 0.0 and joint.holds(t, joints, k):
            coupled += 0.5 * joints[k].stiffness * joints[k].gap1 * joints[k].gap1
    if model.flexible.hinges.size > 0:
        coupled += hinge.hinge_energy(model.flexible.switches, model)
    row = work.balance
    row[KINETIC], row[ELASTIC], row[BENDING] = work.energies[0], work.energies[1], work.energies[2]
    row[CONTACT], row[COUPLED] = contact.energy_of(model), coupled


@inlined
def _has_gained(work):
    """Whether the energy balance has gained more than round-off, which no step does by its construction."""
    loop, options, row, defect, given, lost = work.loop, work.options, work.balance, 0.0, 0.0, 0.0
    for i in range(row.size):
        defect += SIGNS[i] * row[i]
        if SIGNS[i] < 0.0:
            given += abs(row[i])
        if IS_LOSS[i]:
            lost += abs(row[i])
    stored = row[ELASTIC] + row[COUPLED]
    if loop.steps == 0:
        loop.start = defect
        begin_extremes(loop, row[KINETIC], stored)
    extend_extremes(loop, row[KINETIC], stored, given, lost)
    scale = max(moved_of(loop), largest_of(loop))  # at the start hardly any energy was moved
    return defect - loop.start > options.gain * scale + options.floor


@indirect(void(MODEL, ENERGY_LOOP))
def accept(model, work):
    """Add a step's work and losses to the balance; its end becomes the start of the next after `keep_samples`."""
    step, row, f = work.step, work.balance, model.flexible
    h, powers = step.step.h, step.powers
    given = h * powers[MARKER_LOADS]
    for i in range(step.dq.size):
        given += f.P[i] * step.dq[i]
    row[LOADS] += given
    row[DRIVES] += h * powers[DRIVEN]
    for k in range(f.joints.size):
        if f.joints[k].path != 0 and joint.holds(step.step.t + h, f.joints, k):
            row[DRIVES] += step.la[k] * work.paths[k]
    row[BY_MASS] += h * powers[MASS_DAMPING]
    row[BY_STIFFNESS] += h * powers[STIFFNESS_DAMPING]
    row[BY_SPRINGS] += h * powers[SPRINGS]
    row[BY_JOINTS] += h * powers[JOINTS]
    row[BY_CONTACT] += step.contact[0]
    row[BY_FRICTION] += step.contact[1]
    lost, driven = attitude.end_actuator_step(h, 1.0, step.dq, step.y1, model)
    row[BY_SPRINGS] += lost
    row[DRIVES] += driven
    contact.end_contacts(step.y1, model)
    if f.hinges.size > 0:
        row[BY_FRICTION] += coordinate.end_coordinate_step(h, 0.5, step.y1, f.switches, model)
    for k in range(f.cylinders.size):
        work.impulse[k] += h * f.cylinders[k].normal
    for k in range(f.body_contacts.size):
        work.touched[k] += h * f.body_contacts[k].force
    for b in range(model.bodies.size):
        for i in range(6):
            work.wrenches[b, i] = model.bodies[b].F[i]


@indirect(void(MODEL, ENERGY_LOOP))
def keep_samples(model, work):
    """Keep the samples in the step: the state between its ends, balances on straight lines, forces of the step."""
    step, loop, f = work.step, work.loop, model.flexible
    t, h = step.step.t, step.step.h
    near = 10.0 * work.options.smallest
    while loop.sample < work.samples.size and work.samples[loop.sample] <= t + h + near:
        n = loop.sample
        theta = min(max((work.samples[n] - t) / h, 0.0), 1.0)
        if theta > 1.0 - 1e-9:
            theta = 1.0
        interpolate(theta, h, step.y0, step.y1, model, work.out_y[n])
        for i in range(f.switches.size):
            work.out_s[n, i] = f.switches[i]
        for i in range(step.dq.size):
            work.out_a[n, i] = step.dv[i] / h
        for k in range(step.la.size):
            work.out_la[n, k] = step.la[k]
        for i in range(work.balance.size):
            work.out_balance[n, i] = work.balance0[i] + theta * (work.balance[i] - work.balance0[i])
        momenta_between(theta, t, h, step.y0, step.y1, model, work.momenta, work.out_momenta[n])
        _keep_wrenches(n, model, work)
        for k in range(f.cylinders.size):
            work.out_cylinders[n, k, 7] = work.impulse0[k] + theta * (work.impulse[k] - work.impulse0[k])
        for k in range(work.touched.size):
            work.out_touches[n, k, TOUCHED] = work.touched0[k] + theta * (work.touched[k] - work.touched0[k])
        loop.sample += 1


@inlined
def _keep_wrenches(n, model, work):
    """Keep the forces of the step on cylinders, contact points and bodies as those of sample n."""
    f = model.flexible
    if contact.any_contact(model):
        write_contacts(model, work.out_cylinders[n], work.out_friction[n], work.out_touches[n])
    for i in range(f.contact_points.size):
        work.out_points[n, i] = f.contact_points[i].force
    for b in range(model.bodies.size):
        for i in range(6):
            work.out_bodies[n, b, i] = work.wrenches[b, i]


@inlined
def _keep_first(model, work):
    """Keep accelerations and forces of the first step as those of the start."""
    step = work.step
    for i in range(step.dq.size):
        work.out_a[0, i] = step.dv[i] / step.step.h
    for k in range(step.la.size):
        work.out_la[0, k] = step.la[k]
    _keep_wrenches(0, model, work)


@inlined
def _acceleration(i, work):
    """Acceleration of coordinate i between the middles of the step before and this one; of the first step's half."""
    h = work.step.step.h
    return 2.0 * (work.step.dq[i] / h - work.rate[i]) / (h + work.loop.last)


@inlined
def _turning_error(model, step):
    """Error of the angles of bodies over a step, rad: they turn by 2 atan(h w/2)."""
    bodies, n_q, largest = model.bodies, model.info.nq, 0.0
    for b in range(bodies.size):
        at = bodies[b].iv - n_q
        if bodies[b].motion == rigid.FREE:
            x, y, z = step.dq[at + 3], step.dq[at + 4], step.dq[at + 5]
            largest = max(largest, x * x + y * y + z * z)
        elif bodies[b].motion == rigid.SPIN:
            largest = max(largest, step.dq[at] * step.dq[at])
    return largest * math.sqrt(largest) / 12.0


@inlined
def _longest_turn(bodies):
    """Time in which the driven bodies turn by 1 rad at most, s: a longer step would not see how they move."""
    fastest = 0.0
    for b in range(bodies.size):
        if bodies[b].motion == rigid.DRIVEN:
            fastest = max(fastest, abs(bodies[b].rate))
    return 1.0 / fastest if fastest > 0.0 else math.inf


@inlined
def _error(model, work):
    """Estimated error of the step beside the tolerance, (1/12 + chi/4) h^3 v'', by accelerations of the mean rates.

    The velocities at the ends may alternate about the mean rates where damping or a constraint is stiff.
    """
    step, error, rates = work.step, 0.0, 0.0
    if work.loop.last == 0.0:
        return 0.0
    h = step.step.h
    c = h * h * (1.0 / 12.0 + 0.25 * work.options.chi)
    for i in range(step.dq.size):
        change = c * (_acceleration(i, work) - work.acceleration[i])
        error = max(error, abs(change) / work.weight[i])
        rates += work.shares[i] * change * change
    error = max(error, _turning_error(model, step))
    return beside_tolerance(error, rates, h, step.dq, work.shares, work.loop, work.options)


@indirect(_I(MODEL, SPARSE, ENERGY_LOOP))
def begin(model, matrix, work):
    """Energies and the first sample."""
    step = work.step
    step.step.t, step.step.h = work.loop.time, 0.0
    for i in range(step.y0.size):
        step.y1[i] = step.y0[i]
    measure(0, model, step)
    measure(1, model, step)
    for i in range(step.y0.size):
        work.out_y[0, i] = step.y0[i]
    for i in range(step.dq.size):
        work.rate[i] = step.y0[model.info.nq + i]
    work.loop.fastest = fastest_rate(0.0, 1.0, work.rate, work.shares)
    for k in range(model.flexible.hinges.size):
        model.flexible.hinges[k].rate = 0.0
    fill_energies(model, work)
    hinge.end_hinge_step(model.flexible.switches, model.flexible.hinges)
    user_events.start_events(work.loop.time, step.y0, model)
    for i in range(model.flexible.switches.size):
        work.out_s[0, i] = model.flexible.switches[i]
    for i in range(work.balance.size):
        work.balance0[i] = work.balance[i]
        work.out_balance[0, i] = work.balance[i]
    work.loop.sample = 1
    momenta_between(1.0, work.loop.time, 0.0, step.y0, step.y1, model, work.momenta, work.out_momenta[0])
    _has_gained(work)
    return DONE


@inlined
def _next_start(model, work):
    """Make the end of the step the start of the next."""
    step, loop = work.step, work.loop
    step.step.t = loop.time
    note_step(loop, fastest_rate(loop.fastest, step.step.h, step.dq, work.shares))
    for i in range(step.y0.size):
        step.y0[i] = step.y1[i]
    for i in range(step.dq.size):
        step.before[i] = step.dv[i]
        work.acceleration[i] = _acceleration(i, work)
        work.rate[i] = step.dq[i] / step.step.h
    for k in range(model.thrusters.size):  # whose impulses have no rate of their own
        work.rate[model.thrusters[k].iv - model.info.nq] = step.y0[model.thrusters[k].iv]
    for k in range(step.strains.shape[0]):
        for i in range(step.strains.shape[1]):
            step.strains_before[k, i] = step.strains[k, i]
    for k in range(step.rods.shape[0]):
        for i in range(6):
            step.rods_before[k, i] = step.rods[k, i]
    for k in range(step.la.size):
        work.la0[k] = step.la[k]
    for i in range(work.balance.size):
        work.balance0[i] = work.balance[i]
    for k in range(work.impulse.size):
        work.impulse0[k] = work.impulse[k]
    for k in range(work.touched.size):
        work.touched0[k] = work.touched[k]


@inlined
def _latch(t, model, work):
    """Latch the hinges that have reached their latches at the end of a step; returns whether any has."""
    hinges, s, found = model.flexible.hinges, model.flexible.switches, False
    for k in range(hinges.size):
        if hinge.latch_reached(s, hinges, k):
            if not found:
                hinge.note_turns(t, work.step.y1, s, model)  # rates at the end; those of the step are means
            coordinate.lock(s, hinges, k)
            work.log_t[work.loop.latches], work.log_k[work.loop.latches] = t, k
            work.loop.latches += 1
            found = True
            user_events.release(t, -2 - k, model)
    hinge.end_hinge_step(s, hinges)
    return found


@inlined
def _book_released(model, work):
    """Count the energy that a penalty or hinge loses where it is released as a loss of the joints."""
    step, row = work.step.step, work.balance
    before = row[KINETIC] + row[ELASTIC] + row[COUPLED]
    step.h = 20.0 * work.options.smallest  # just after the stop
    fill_energies(model, work)
    row[BY_JOINTS] += before - (row[KINETIC] + row[ELASTIC] + row[COUPLED])
    for i in range(row.size):
        work.balance0[i] = row[i]


@indirect(_I(MODEL, SPARSE, ENERGY_LOOP, _I))
def advance(model, matrix, work, budget):
    """Go on for `budget` steps or to the last sample; returns a status."""
    step, loop, options = work.step, work.loop, work.options
    adaptive, near, end = options.tolerance > 0.0, 10.0 * options.smallest, work.samples[work.samples.size - 1]
    passes = contact.any_contact(model)
    for _ in range(budget):
        if loop.sample == work.samples.size:
            return DONE
        target, stops = end, False
        if loop.stop < work.stops.size and work.stops[loop.stop] < end - near:
            target, stops = work.stops[loop.stop], True
        h, lands = min(loop.length, loop.event_step, hinge.longest_step(model.flexible.hinges)), False
        h = min(h, _longest_turn(model.bodies))
        if h >= (target - loop.time) * (1.0 - 1e-9):
            h, lands = target - loop.time, True
            if stops:  # what begins or ends there has not done so yet
                h -= min(0.5 * h, max(1e-9 * h, 2.0 * near))
        step.step.t, step.step.h = loop.time, h
        step.step.ratio = min(1.0, h / loop.last) if loop.last > 0.0 else 0.0
        measure(0, model, step)
        for k in range(work.paths.size):
            if model.flexible.joints[k].path != 0:
                joint.joint_geometry(loop.time + h, step.y0, k, model)
                work.paths[k] = model.flexible.joints[k].gap - model.flexible.joints[k].gap0
        iterations = solve_step(model, matrix, work)
        error = _error(model, work) if adaptive and iterations > 0 else 0.0
        if iterations > 0 and passes:
            far = passing(step.y0, step.R0, step.x0, step.y1, step.R1, step.x1, model)
            error = max(error, far * far * far)
        if iterations <= 0 or error > 1.0:
            if h <= options.smallest:
                return iterations if iterations <= 0 else NO_CONVERGENCE
            if iterations <= 0 or not adaptive:
                loop.divided += 1
                loop.length = 0.5 * h
            else:
                loop.rejected += 1
                loop.length = h * max(0.2, 0.85 * error ** (-1.0 / 3.0))
            continue
        part = hinge.until_latch(model.flexible.switches, model.flexible.hinges)
        if model.events.size > 0:
            least = max(4.0 * options.smallest, user_events.SURE * loop.length)
            limit, extended = loop.event_step, loop.extended
            due = user_events.until_event(loop.time + h, h, least, limit, extended, step.y1, model)
            part = due if part == 1.0 else min(part, due)
        if part != 1.0 and h * part > options.smallest:
            loop.event_step, loop.extended = h * part, loop.extended + (part > 1.0)
            continue
        loop.event_step, loop.extended = math.inf, 0
        accept(model, work)
        fill_energies(model, work)
        t1 = target if lands else loop.time + h
        if loop.steps == 0:
            _keep_first(model, work)
        keep_samples(model, work)
        loop.time = t1
        loop.steps += 1
        if _has_gained(work):
            return GAINED
        _next_start(model, work)
        loop.last = h
        latched = _latch(t1, model, work)
        if model.events.size > 0 and user_events.fire_events(t1, model, work):
            latched = True
        if adaptive:
            grow = 2.0 if error == 0.0 else min(2.0, 0.85 * error ** (-1.0 / 3.0))
            if iterations > PLAIN:
                grow = min(grow, 0.6)
            if grow > 1.2 or grow < 1.0:
                loop.length = min((max(h, loop.length) if lands else h) * grow, options.longest)
        elif not lands:
            loop.length = min(2.0 * h, loop.wanted)
        if lands and stops:
            loop.stop += 1
        if latched or (lands and stops):
            _book_released(model, work)
            loop.last = loop.factored = 0.0
            if adaptive:
                loop.length = min(loop.length, options.first)
            for i in range(step.before.size):
                step.before[i] = 0.0
                work.rate[i] = step.y0[model.info.nq + i]
            for k in range(step.strains_before.shape[0]):
                for i in range(step.strains_before.shape[1]):
                    step.strains_before[k, i] = 0.0
            for k in range(step.rods_before.shape[0]):
                for i in range(6):
                    step.rods_before[k, i] = 0.0
            return AT_RESTART
    return BUDGET
