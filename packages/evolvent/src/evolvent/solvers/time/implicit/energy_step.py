"""Steps of the energy-momentum method: start, increments, error estimate, end."""

from __future__ import annotations

import math

from numba import types, void

from evolvent.algebra.sparse import SPARSE
from evolvent.compiled.jit import REAL, indirect, inlined
from evolvent.equations.energy_momentum import measure, residual, tangent
from evolvent.kernels import rigid
from evolvent.kernels.blocks import largest_turn
from evolvent.kernels.calls import note_at, stored_at
from evolvent.model import MODEL, powers as eq
from evolvent.solvers.common.balance import moved_of
from evolvent.solvers.time.implicit.step_error import beside_tolerance
from evolvent.solvers.time.implicit.workspace import WORKSPACE, factor

_I = types.int64
#: Part of the tolerance that an extrapolation of the filter by less than h/h_p may be off by.
FILTER_SHARE = 0.1
#: Part of the energy moved that the work of laws in a step may be off their line integrals.
LAW_SHARE = 1e-6


@indirect(void(MODEL, WORKSPACE))
def begin(model, work):
    """Start from the state work.y at the loop's time."""
    step, coordinates, n_q = work.step, model.coordinates, model.info.nq
    step.step.t, step.step.h = work.loop.time, 0.0
    for i in range(work.y.size):
        work.y0[i] = work.y[i]
    measure(0, model, step)
    measure(1, model, step)
    for i in range(work.dq.size):
        work.rate[i] = work.y[n_q + i]
    for k in range(coordinates.size):
        coordinates[k].rate = 0.0
    step.step.chi_p = 0.0


@indirect(void(REAL, REAL, MODEL, WORKSPACE))
def start_step(t, h, model, work):
    """Start a step of length h at t from work.y0."""
    step, last = work.step.step, work.loop.last
    step.t, step.h, step.ratio = t, h, 0.0
    step.chi = filter_of(h, step, work.loop, work.options)
    step.chi_v = step.chi if step.held != 0.0 else 0.0
    if last > 0.0 and step.chi > 0.0:
        step.ratio = min(h / last, math.sqrt(step.chi_p / step.chi))
    measure(0, model, work.step)


@inlined
def filter_of(h, step, loop, options):
    """Filter chi of a step of length h: that of fixed steps, or the largest that is accurate enough at adaptive ones.

    Notes
    -----
    Where r < h/h_p the filter of constant accelerations a does not vanish: mean rates are off by
    chi/2 (1 - r h_p/h) h a. With r = sqrt(chi_p/chi) and k = chi_p (h_p/h)^2 that is f where
    chi - sqrt(k chi) = 2 f/(h a). The allowed f is a share of what `step_error.beside_tolerance` allows.
    """
    if options.tolerance <= 0.0 or options.chi == 0.0:
        return options.chi
    if loop.last == 0.0:
        return 0.0
    k, most = step.chi_p * (loop.last / h) ** 2, math.inf
    if step.largest > 0.0:
        most = FILTER_SHARE * options.tolerance / (h * step.largest)
    if step.rms > 0.0 and options.rates > 0.0 and loop.settling == 0:
        most = min(most, FILTER_SHARE * options.rates * loop.fastest / step.rms)
    root = 0.5 * (math.sqrt(k) + math.sqrt(k + 8.0 * most / h))
    return min(root * root, options.chi)


@indirect(void(types.boolean, MODEL, WORKSPACE))
def predict(accelerated, model, work):
    """Increments and multipliers from which Newton's method starts: the velocity changes as before, or stays."""
    step = work.step
    n_q, h = model.info.nq, step.step.h
    part = 0.5 * h / work.loop.last if accelerated and work.loop.last > 0.0 else 0.0
    for i in range(step.dq.size):
        step.dq[i] = h * (step.y0[n_q + i] + min(part, 1.0) * step.before[i])
    for k in range(step.la.size):
        step.la[k] = work.la0[k]


@indirect(void(MODEL, WORKSPACE))
def evaluate(model, work):
    """Residual of the increments."""
    residual(model, work.step)


@indirect(_I(REAL, MODEL, SPARSE, WORKSPACE))
def factor_tangent(scale, model, matrix, work):
    """Assemble and factor the tangent, twice the derivatives; returns what `sparse_lu.factor` returns."""
    model.info.compliance = 1.0 / scale
    tangent(scale, model, work.step, matrix)
    return factor(matrix, work)


@inlined
def along(work):
    """The residual along the correction: dq . r."""
    found = 0.0
    for i in range(work.step.dq.size):
        found += work.x[i] * work.step.r[i]
    return found


@indirect(void(REAL, MODEL, WORKSPACE))
def shift(s, model, work):
    """Move the increments by s times the correction, and evaluate."""
    for i in range(work.step.dq.size):
        work.step.dq[i] += s * work.x[i]
    residual(model, work.step)


@indirect(REAL(REAL, MODEL, WORKSPACE))
def search(before, model, work):
    """Where along the correction the residual along it vanishes, the increments being there; from 0 to 1.

    Parameters
    ----------
    before : float, dq . r at the start, below 0
    """
    shift(1.0, model, work)
    low, high, f_low, f_high = 0.0, 1.0, before, along(work)
    if not math.isfinite(f_high):
        f_high = -1e3 * before
    if f_high <= 0.0 or f_high < -0.5 * before:
        return 1.0
    at = 1.0
    for _ in range(8):
        s = low + (high - low) * min(max(f_low / (f_low - f_high), 0.1), 0.9)
        shift(s - at, model, work)
        at = s
        f = along(work)
        if abs(f) < -0.3 * before:
            break
        if f < 0.0:
            low, f_low = s, f
        else:
            high, f_high = s, f
    return at


@inlined
def _given(work, P):
    """Energy that a step is given by loads and drives, less what springs take, J."""
    powers, found = work.step.powers, 0.0
    found += powers[eq.MARKER_LOADS] + powers[eq.DRIVEN] + powers[eq.SPOOLS] - powers[eq.SPRINGS]
    found *= work.step.step.h
    for i in range(work.step.dq.size):
        found += P[i] * work.step.dq[i]
    return found


@indirect(REAL(MODEL, WORKSPACE))
def law_error(model, work):
    """Above 1 where the forces of laws over a step do not do the work that is their line integral, else 0.

    The integrals by another rule (`kernels.law_means`) are those that the step leaves: what the balance takes.
    """
    given = _given(work, model.P)
    model.info.checks = 1
    residual(model, work.step)
    model.info.checks = 0
    found = _given(work, model.P)
    return 2.0 if abs(found - given) > LAW_SHARE * max(moved_of(work.loop), abs(given), abs(found)) else 0.0


@indirect(void(MODEL, WORKSPACE))
def end_step(model, work):
    """What the next step needs of this one; its means stand for the values at both of its ends."""
    step, h, n_q, largest, squares = work.step, work.step.step.h, model.info.nq, 0.0, 0.0
    for i in range(step.dq.size):
        work.loads0[i] = work.loads1[i] = model.P[i]
        work.dv0[i] = work.dv1[i] = step.dv[i] / h
        step.before[i] = step.dv[i]
        new, old = _acceleration(i, work), work.acceleration[i]
        filtered = step.step.held * abs(new) + (abs(new - old) if work.loop.last > 0.0 else 0.0)
        largest = max(largest, filtered / work.error_weight[i])
        squares += work.shares[i] * filtered * filtered
        work.acceleration[i] = new
        work.rate[i] = step.dq[i] / h
    step.step.chi_p, step.step.largest, step.step.rms = step.step.chi, largest, math.sqrt(squares)
    for b in range(model.bodies.size):  # whose increments are those of the centre that it has with its thread
        if model.bodies[b].motion == rigid.FREE and model.bodies[b].carried != 0.0:
            for i in range(model.bodies[b].iv, model.bodies[b].iv + 3):
                work.dv0[i - n_q] = work.dv1[i - n_q] = (step.y1[i] - step.y0[i]) / h
    for i in range(work.powers.shape[1]):
        work.powers[1, i] = work.powers[0, i]
    for k in range(step.la.size):
        work.la0[k] = step.la[k]
    calls = model.step_note_calls
    for k in range(calls.size):
        note_at(model, calls[k])(model)


@indirect(void(MODEL, WORKSPACE))
def restart(model, work):
    """Forget the step before, where loads or joints change at once."""
    step = work.step
    work.loop.last = work.loop.factored = step.step.chi_p = 0.0
    for i in range(step.before.size):
        step.before[i] = 0.0
        work.rate[i] = work.y[model.info.nq + i]


@indirect(REAL(REAL, MODEL, WORKSPACE))
def coupled_energy(t, model, work):
    """Energy of penalties and joint coordinates at the end of the step, J."""
    calls, coupled = model.step_energy_calls, 0.0
    for k in range(calls.size):
        coupled += stored_at(model, calls[k])(t, model)
    return coupled


@inlined
def _acceleration(i, work):
    """Acceleration of coordinate i between the middles of the step before and this one; of the first step's half."""
    h = work.step.step.h
    return 2.0 * (work.step.dq[i] / h - work.rate[i]) / (h + work.loop.last)


@inlined
def longest_turn(bodies):
    """Time in which the driven bodies turn by 1 rad at most, s: a longer step would not see how they move."""
    fastest = 0.0
    for b in range(bodies.size):
        if bodies[b].motion == rigid.DRIVEN:
            fastest = max(fastest, abs(bodies[b].rate))
    return 1.0 / fastest if fastest > 0.0 else math.inf


@inlined
def local_error(model, work):
    """Estimated error of the step beside the tolerance, (1/12 + chi/4) h^3 v'', by accelerations of the mean rates.

    The velocities at the ends may alternate about the mean rates where damping or a constraint is stiff.
    """
    step, error, rates = work.step, 0.0, 0.0
    if work.loop.last == 0.0:
        return 0.0
    h = step.step.h
    c = h * h * (1.0 / 12.0 + 0.25 * step.step.chi)
    for i in range(step.dq.size):
        change = c * (_acceleration(i, work) - work.acceleration[i])
        error = max(error, abs(change) / work.error_weight[i])
        rates += work.shares[i] * change * change
    turn = largest_turn(step.dq, True, model.info.nq, model.blocks)  # h w of bodies, which turn by 2 atan(h w/2)
    error = max(error, turn**3 / 12.0)
    return beside_tolerance(error, rates, h, step.dq, work.shares, work.loop, work.options)
