"""Newton's method of an implicit step: unknowns are the increments of the coordinates and the multipliers."""

from __future__ import annotations

import math

from numba import types

from evolvent.algebra import sparse_lu
from evolvent.algebra.sparse import SPARSE
from evolvent.compiled.jit import REAL, indirect, inlined
from evolvent.kernels import contact, thread
from evolvent.kernels.ancf_beams import is_finite
from evolvent.kernels.calls import contact_set_at, friction_change_at
from evolvent.kernels.passing import note_places
from evolvent.model import MODEL
from evolvent.solvers.time.implicit import energy_step, methods as method
from evolvent.solvers.time.implicit.least_norm import add_compliance
from evolvent.solvers.time.implicit.step_error import newton_limit
from evolvent.solvers.time.implicit.workspace import NO_CONVERGENCE, NOT_FINITE, REDUNDANT, SINGULAR, WORKSPACE

_I, _B = types.int64, types.boolean
#: Convergence slower than this takes a new tangent.
SLOW = 0.15
#: A correction below this that a new tangent does not reduce is round-off: elements may be stiff, and joints near a
#: position where they depend on one another.
ROUND_OFF = 1e-8
#: Share of `newton` that the corrections for momenta which are kept reach, and most corrections for them.
SHARPER, MOST_SHARPENED = 1e-2, 4
#: Change of the friction of bearings in an iteration, beside its limit, that has converged, and how often it may be
#: larger where the increments have.
CALM, MOST_REPEATED = 1e-10, 6
#: Most iterations of methods with the forces of ends; of energy-momentum with the contacts as they are, of the softest
#: stage, and of one of those after it.
MOST, PLAIN, FIRST, STAGED = 25, 20, 40, 20
#: Power of ten of the contacts' stiffness in the softest stage, and its least rise from one stage to the next.
SOFTEST, LEAST_RISE = -6.0, 0.5


@inlined
def count_touching(model):
    """A number that encodes which contact points touch, and which frictions slip."""
    calls, found = model.implicit_contact_set_calls, 0
    for k in range(calls.size):
        found = contact_set_at(model, calls[k])(found, model)
    return found


@inlined
def change_of_friction(model):
    """Largest change of a friction by multipliers since the last call, beside its limit."""
    calls, found = model.friction_change_calls, 0.0
    for k in range(calls.size):
        found = max(found, friction_change_at(model, calls[k])(model))
    return found


@inlined
def correction(scale, model, matrix, work):
    """Solve for the correction work.x; returns its size beside `weight`, or inf where it is not finite."""
    rows, n_v, r, x = model.constraints, model.info.nv, work.r, work.x
    twice = method.tangent_factor(work.options)
    if model.info.redundant != 0:
        add_compliance(scale, twice, model, matrix, work.la, x, r)
    for i in range(n_v):
        x[i] = -twice * r[i]
    for k in range(rows.size):
        x[n_v + k] = -scale * r[n_v + k] * (1.0 if rows[k].stiffness <= 0.0 else twice)
    sparse_lu.solve(matrix, x)
    if not is_finite(x):  # the largest of sizes leaves out what is no number
        return math.inf
    weight, sizes = work.weight, matrix.x
    for i in range(n_v):  # in a loop of its own, which is vectorized
        sizes[i] = abs(x[i]) / weight[i]
    return largest(sizes, n_v)


@inlined
def largest(sizes, n):
    """Largest of the first n numbers, which are not negative; by four independent maxima, so that they overlap."""
    a = b = c = d = 0.0
    last = n - n % 4
    for i in range(0, last, 4):
        a, b, c, d = max(a, sizes[i]), max(b, sizes[i + 1]), max(c, sizes[i + 2]), max(d, sizes[i + 3])
    for i in range(last, n):
        a = max(a, sizes[i])
    return max(max(a, b), max(c, d))


@indirect(_I(REAL, REAL, _I, _B, MODEL, SPARSE, WORKSPACE))
def iterate(t1, h, most, searches, model, matrix, work):
    """Newton's method from the present increments: the number of iterations, or a status below zero.

    It leaves the residual of the increments that it found.

    Parameters
    ----------
    t1, h : float, s, end and length of the step
    most : int, of iterations; searches : bool, whether along each correction the best part is looked for
    """
    loop, options, info, conserves = work.loop, work.options, model.info, work.options.conserves != 0
    scale = method.scale_of(h, options)
    info.compliance = 1.0 / scale
    method.evaluate(t1, h, model, work)
    rubs, changed, repeated = model.info.reactive > 0, 0.0, 0
    if rubs:
        change_of_friction(model)
    soft = work.step.step.soft != 1.0
    # what keeps momenta or energy takes its own tangent, and one correction more: both converge to round-off
    keeps = conserves and work.step.step.held == 0.0 and not soft
    limit = newton_limit(options.newton, options.sharp, options.rates, loop.fastest, h)
    rounding = 0.0 if thread.has_springs(model) else ROUND_OFF
    if conserves:
        inexact = model.info.slender + work.la.size
        rounding = min(ROUND_OFF, 1e4 * options.newton) if inexact > 0 else 0.0
    if soft:
        limit = options.newton
    # directions of threads must be fresh, and those in which multipliers of redundant constraints are free
    always, factored = info.releases > 0 or info.redundant != 0, loop.factored
    stale = soft or keeps or always or (factored != h if conserves else abs(factored - h) > 1e-6 * h)
    last, ratio, touching, kept, sharpened = math.inf, 0.0, loop.contact_set, conserves and not stale, 0
    first = 0  # iteration from the prediction
    loop.factored = 0.0
    for iteration in range(most):
        if not is_finite(work.r):
            return NOT_FINITE
        now = count_touching(model)
        fresh = stale or always or (ratio > SLOW and sharpened == 0) or now != touching
        touching = now
        if fresh:
            found = method.factor_tangent(t1, h, scale, model, matrix, work)
            if found != 0:
                return SINGULAR if found < 0 else REDUNDANT
            factored, stale = h, False
        norm = correction(scale, model, matrix, work)
        if not math.isfinite(norm):
            return NOT_FINITE
        loop.iterations += 1
        if sharpened > 0 and norm >= last:  # it cannot be sharpened further
            return _converged(iteration - 1, last, touching, 0.0 if soft else factored, work)
        if kept and iteration == 1 and norm > SLOW * last:  # the tangent of a step before does not serve here
            # and its corrections say nothing of those from here on
            kept, stale, ratio, touching, last, first = False, True, 0.0, -1, math.inf, iteration + 1
            method.predict(h, False, model, work)
            method.evaluate(t1, h, model, work)
            continue
        for k in range(work.la.size):
            work.la[k] += scale / method.tangent_factor(options) * work.x[info.nv + k]
        s = method.correct(t1, h, searches and (work.la.size == 0 or iteration > first), model, work)
        if rubs:  # by multipliers, which do not count in the size of a correction
            changed = change_of_friction(model)
        if iteration > first:
            ratio = norm / last if last > 0.0 else 0.0
        left = norm * ratio / (1.0 - ratio) if 0.0 < ratio < 0.9 else norm
        rounded = fresh and ratio > 0.5 and norm <= rounding  # a new tangent does not reduce it any more
        # of redundant constraints a second iteration corrects what the compliance leaves
        settled = s == 1.0 and (iteration > first or info.redundant == 0)
        if settled and (min(norm, left) <= limit or rounded):
            if changed > CALM and repeated < MOST_REPEATED:
                repeated, last = repeated + 1, norm
                continue
            sharp = sharpened > 0 and (left <= SHARPER * limit or ratio > 0.5)
            if not conserves or count_touching(model) == touching:
                if not keeps or sharp or rounded or sharpened == MOST_SHARPENED:
                    return _converged(iteration, min(norm, left), touching, 0.0 if soft else factored, work)
                sharpened += 1
        last = norm
    loop.contact_set = touching
    return NO_CONVERGENCE


@inlined
def _converged(iteration, left, touching, factored, work):
    """Note what Newton's method has left, and for which step its matrix serves; returns the iterations."""
    work.loop.left, work.loop.contact_set, work.loop.factored = left, touching, factored
    return iteration + 1


@indirect(_I(REAL, REAL, MODEL, SPARSE, WORKSPACE))
def solve_end(t1, h, model, matrix, work):
    """Solve a step of length h that ends at t1, with the forces there; returns as `iterate` does.

    From the accelerations of the step's start; of a fixed step that this does not solve, from constant velocities.
    """
    method.predict(h, False, model, work)
    found = iterate(t1, h, MOST, False, model, matrix, work)
    if found <= 0 and work.options.tolerance <= 0.0:
        for i in range(work.la.size):
            work.la[i] = work.la0[i]
        work.loop.factored = 0.0
        method.predict(h, True, model, work)
        found = iterate(t1, h, MOST, False, model, matrix, work)
    if found > 0:
        note_places(model.bodies, work.R1, work.x1)
    return found


@indirect(_I(MODEL, SPARSE, WORKSPACE))
def solve_energy(model, matrix, work):
    """Solve a step of energy-momentum that has started; returns as `iterate` does.

    First from the velocities' last change, then from constant velocities, then with contacts that are stiffened.
    """
    step = work.step.step
    step.soft, t1 = 1.0, step.t + step.h
    energy_step.predict(True, model, work)
    contacts = contact.any_contact(model)
    found = iterate(t1, step.h, PLAIN if contacts else STAGED, False, model, matrix, work)
    if found > 0:
        return found
    energy_step.predict(False, model, work)
    found = iterate(t1, step.h, PLAIN, True, model, matrix, work)
    if found > 0:
        return found + PLAIN
    if not contacts:
        return found
    energy_step.predict(False, model, work)
    work.loop.stages += 1
    power, rise, total = SOFTEST, -0.5 * SOFTEST, 0
    while True:
        step.soft = 10.0**power
        found = iterate(t1, step.h, FIRST if power == SOFTEST else STAGED, True, model, matrix, work)
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
