"""Newton's method for equilibria, along load steps or an arc, compiled whole.

A structure may turn steadily with all that carries it: coordinates then stand in axes that turn, and the accelerations
of the turn, a = W x (W x (r - c)), load it.

Notes
-----
Solved is r(y, la) = factor M a + F(y) + G^T la - factor P(y) = (1 - share) r0, g(y) = 0, where `share` fades out what
the start left unbalanced, r0.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types, void

from evolvent.algebra import sparse_lu
from evolvent.algebra.sparse import SPARSE, diagonal
from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.compiled.pointer import Struct, array, record
from evolvent.equations import step_end
from evolvent.equations.between_steps import take_step
from evolvent.equations.implicit import energies, residual, tangent
from evolvent.kernels import contact, rigid
from evolvent.kernels.ancf_beams import is_finite
from evolvent.kernels.blocks import POSITION, SLOPE, displace, is_idle
from evolvent.kernels.calls import scale_at, turning_at, turning_tangent_at
from evolvent.kernels.rotations import cross
from evolvent.model import MODEL
from evolvent.model.powers import COUPLED_ENERGY

# status codes
NO_CONVERGENCE, NOT_FINITE, SINGULAR, UNBALANCED = -1, -2, -3, -4
#: Largest part of its size that an unknown moves in one iteration.
LARGEST_MOVE = 0.5
#: Below this a correction that has not shrunk `STALLS` times may be round-off of a stiff structure.
ROUGH, STALLS = 1e-5, 2
#: Columns of the workspace's history.
FORCE, MOMENT, CORRECTION, N_HISTORY = range(4)
#: Part of the forces that may stay unbalanced where the tangent is singular, and of the largest stiffness times size.
CONSISTENT, ROUND_OFF = 1e-7, 1e-14
#: What the iterations count. loose: unknowns without pivot; factor: of the load; first_unbalance, unbalance: J, at the
#: first and the last iteration; correction: the last; quality: worst pivot; stiffest: largest stiffness, J, of an
#: unknown that moves by its size; noted: rows of the history.
LOOP = np.dtype(
    [(name, np.int64) for name in ("loose", "iterations", "factorizations", "noted")]
    + [(name, np.float64) for name in ("factor", "first_unbalance", "unbalance", "correction", "quality", "stiffest")],
    align=True,
)


class StaticWorkspace(Struct):
    """What the iterations work on.

    Attributes
    ----------
    y : (ny,) float, state; a : (nv,) float, accelerations of the turn; la : (nj,) float
    r, p : (nu,) float, unbalance, and its derivative by the factor; x, z : (nu,) float, corrections by both
    start : (nu,) float, what the start left unbalanced
    d, total, before : (nv,) float, an iteration's move, and those of this and of the last step
    weight : (nv,) float, size of each velocity's coordinate
    is_moment : (nv,) int, 1 of turns and slopes, whose unbalance is a moment
    history : (iterations + 1, N_HISTORY) float
        Of Newton's method at the last load factor: largest unbalanced force (N) and moment (N m) before each iteration
        and after the last, and the largest correction beside its size, not a number after the last.
    powers, booked : (N_POWERS,) float
    spin : (6,) float, rad/s and m, rate and centre of the turn
    parameters, gravity : (k,) and (3,) float, the model's own, which are scaled by the factor
    loop : record (see `LOOP`)
    """

    y: np.ndarray = array(1)
    a: np.ndarray = array(1)
    la: np.ndarray = array(1)
    r: np.ndarray = array(1)
    p: np.ndarray = array(1)
    x: np.ndarray = array(1)
    z: np.ndarray = array(1)
    start: np.ndarray = array(1)
    d: np.ndarray = array(1)
    total: np.ndarray = array(1)
    before: np.ndarray = array(1)
    weight: np.ndarray = array(1)
    is_moment: np.ndarray = array(1, np.int64)
    history: np.ndarray = array(2)
    powers: np.ndarray = array(1)
    booked: np.ndarray = array(1)
    spin: np.ndarray = array(1)
    parameters: np.ndarray = array(1)
    gravity: np.ndarray = array(1)
    loop: np.record = record(LOOP)


_WORKSPACE = StaticWorkspace._numba_type_
_I = types.int64


# ---------------------------------------------------------------------------------------------- the steady turn


@inlined
def _twice(spin, x, y, z):
    """W x (W x r)."""
    ux, uy, uz = cross(spin[0], spin[1], spin[2], x, y, z)
    return cross(spin[0], spin[1], spin[2], ux, uy, uz)


@indirect(void(REAL, VECTOR, VECTOR, MODEL, VECTOR))
def turning(factor, spin, y, model, a):
    """Accelerations, times `factor`, of everything that turns with the frame: (nv,)."""
    for i in range(a.size):
        a[i] = 0.0
    if spin[0] == 0.0 and spin[1] == 0.0 and spin[2] == 0.0:
        return
    n_q, blocks, calls = model.info.nq, model.blocks, model.inertia_turning_calls
    for k in range(blocks.size):
        kind, q, at = blocks[k].kind, blocks[k].iq, blocks[k].iv - n_q
        if kind <= SLOPE and not is_idle(k, model.switches, model):
            held = 1.0 if kind == POSITION else 0.0
            x, yy, z = y[q] - held * spin[3], y[q + 1] - held * spin[4], y[q + 2] - held * spin[5]
            ax, ay, az = _twice(spin, x, yy, z)
            a[at], a[at + 1], a[at + 2] = factor * ax, factor * ay, factor * az
    for k in range(calls.size):
        turning_at(model, calls[k])(factor, spin, y, model, a)


@indirect(void(REAL, VECTOR, VECTOR, MODEL, SPARSE))
def add_turning_tangent(factor, spin, y, model, matrix):
    """Add factor d(M a)/dq of the turn's accelerations to a matrix."""
    if spin[0] == 0.0 and spin[1] == 0.0 and spin[2] == 0.0:
        return
    calls = model.inertia_turning_tangent_calls
    for k in range(calls.size):
        turning_tangent_at(model, calls[k])(factor, spin, y, model, matrix)


# ---------------------------------------------------------------------------------------------- iterations


@indirect(void(REAL, REAL, REAL, REAL, MODEL, _WORKSPACE, VECTOR))
def unbalance(t, step, factor, share, model, b, r):
    """Unbalance of the state b.y at a load factor into r : (nu,).

    Parameters
    ----------
    step : float, 1 where friction is at work, else -1
    """
    info = model.info
    for c in range(3):
        info.gravity[c] = factor * b.gravity[c]
    calls = model.statics_scale_calls
    for k in range(calls.size):
        scale_at(model, calls[k])(factor, b.parameters, model)
    rigid.kinematics(t, b.y, model)
    turning(factor, b.spin, b.y, model, b.a)
    residual(t, b.y, b.a, b.la, step, factor, model, r, b.powers)
    if share != 1.0:
        for i in range(r.size):
            r[i] -= (1.0 - share) * b.start[i]


@inlined
def _work_of(r, b):
    """Largest unbalanced force times the size of its coordinate, J."""
    largest = 0.0
    for i in range(b.weight.size):
        largest = max(largest, abs(r[i]) * b.weight[i])
    return largest


@inlined
def _note(iteration, r, b):
    """Write the largest unbalanced force and moment into row `iteration` of the history."""
    force = moment = 0.0
    for i in range(b.weight.size):
        if b.is_moment[i] != 0:
            moment = max(moment, abs(r[i]))
        else:
            force = max(force, abs(r[i]))
    b.history[iteration, FORCE], b.history[iteration, MOMENT] = force, moment
    b.history[iteration, CORRECTION] = math.nan
    b.loop.noted = iteration + 1


@indirect(_I(REAL, REAL, REAL, MODEL, SPARSE, _WORKSPACE))
def _factor(t, shift, factor, model, matrix, b):
    """Tangent of the state and its factors, `shift` (1/s2) times the mass added; returns as `sparse_lu.factor` does."""
    tangent(t, b.y, b.la, shift, 0.0, 1.0, model, matrix)
    add_turning_tangent(factor, b.spin, b.y, model, matrix)
    b.loop.stiffest = 0.0
    for i in range(b.weight.size):
        b.loop.stiffest = max(b.loop.stiffest, abs(diagonal(matrix, i)) * b.weight[i] * b.weight[i])
    found = sparse_lu.factor(matrix)
    b.loop.factorizations += 1
    b.loop.loose = max(found, 0)
    b.loop.quality = matrix.quality[0]
    return found


@indirect(REAL(REAL, MODEL, _WORKSPACE))
def move(cut, model, b):
    """Move the state and the multipliers by `cut` times (b.d, b.x); returns the largest part of its size moved."""
    norm = 0.0
    for i in range(b.d.size):
        norm = max(norm, abs(b.d[i]) / b.weight[i])
    if norm * cut > LARGEST_MOVE:
        cut = LARGEST_MOVE / norm
    for i in range(b.d.size):
        b.d[i] *= cut
        b.total[i] += b.d[i]
    for k in range(b.la.size):
        b.la[k] += cut * b.x[b.d.size + k]
    displace(b.y, b.d, False, model, b.y)
    take_step(model.switches, model)  # whose angles are those before the move
    return norm


@indirect(_I(REAL, REAL, REAL, REAL, REAL, _I, MODEL, SPARSE, _WORKSPACE))
def balance(t, step, factor, share, tolerance, most, model, matrix, b):
    """Newton's method at one load factor; returns the number of iterations, or a status below zero."""
    best, stalls, largest = math.inf, 0, 0.0
    for i in range(b.total.size):
        b.total[i] = 0.0
    for iteration in range(most):
        unbalance(t, step, factor, share, model, b, b.r)
        if not is_finite(b.r):
            return NOT_FINITE
        work = _work_of(b.r, b)
        _note(iteration, b.r, b)
        largest = max(largest, work)
        b.loop.unbalance = work
        if iteration == 0:
            b.loop.first_unbalance = work
        if _factor(t, 0.0, factor, model, matrix, b) < 0:
            return SINGULAR
        for i in range(b.r.size):
            b.x[i] = -b.r[i]
        sparse_lu.solve(matrix, b.x)
        for i in range(b.d.size):
            b.d[i] = b.x[i]
        norm = move(1.0, model, b)
        if not math.isfinite(norm):
            return NOT_FINITE
        b.loop.correction = b.history[iteration, CORRECTION] = norm
        b.loop.iterations += 1
        stalls += 1 if best <= norm < ROUGH else 0
        best = min(best, norm)
        if norm <= tolerance or (stalls >= STALLS and norm < ROUGH and work <= ROUND_OFF * b.loop.stiffest):
            unbalance(t, step, factor, share, model, b, b.r)
            b.loop.unbalance = _work_of(b.r, b)
            _note(iteration + 1, b.r, b)
            if b.loop.loose > 0 and b.loop.unbalance > _allowed(largest, model, b):
                return UNBALANCED
            b.loop.factor = factor
            return iteration + 1
    return NO_CONVERGENCE


@inlined
def _allowed(largest, model, b):
    """Unbalance that round-off explains, of the largest one before, of the loads and of the stiffness, J."""
    P = model.P
    for i in range(b.weight.size):
        largest = max(largest, abs(P[i]) * b.weight[i])
    return CONSISTENT * largest + ROUND_OFF * b.loop.stiffest


@indirect(_I(REAL, REAL, REAL, REAL, REAL, _I, MODEL, SPARSE, _WORKSPACE))
def relax(t, step, factor, shift, goal, most, model, matrix, b):
    """Slide down the energy towards an equilibrium; returns the number of iterations, or a status below zero.

    Notes
    -----
    Implicit steps of M y' = -r, whose length 1/shift grows as the unbalance falls, until it is `goal` of what it was.
    """
    last = math.inf
    for iteration in range(most):
        unbalance(t, step, factor, 1.0, model, b, b.r)
        if not is_finite(b.r):
            return NOT_FINITE
        work = _work_of(b.r, b)
        if iteration == 0:
            b.loop.first_unbalance = work
        b.loop.unbalance = work
        if iteration > 0:
            if work <= goal * b.loop.first_unbalance:
                return iteration
            shift *= min(max(work / last, 0.2), 1.5)
        last = work
        for _ in range(40):
            if _factor(t, shift, factor, model, matrix, b) < 0:
                shift *= 4.0
                continue
            for i in range(b.r.size):
                b.x[i] = -b.r[i]
            sparse_lu.solve(matrix, b.x)
            norm = 0.0
            for i in range(b.d.size):
                b.d[i] = b.x[i]
                norm = max(norm, abs(b.d[i]) / b.weight[i])
            if norm <= 0.2:
                break
            shift *= 4.0
        if not math.isfinite(move(1.0, model, b)):
            return NOT_FINITE
        b.loop.iterations += 1
    return NO_CONVERGENCE


@indirect(_I(REAL, REAL, REAL, REAL, _I, MODEL, SPARSE, _WORKSPACE))
def follow(t, step, length, tolerance, most, model, matrix, b):
    """One step of the given length along the path of equilibria; returns the number of iterations, or a status.

    Notes
    -----
    Crisfield (1981): |total|^2 = length^2 with sizes as weights; of the two roots the one nearer to the last iterate.
    The predictor goes on in the direction of the last step, `before`, or up where there is none.
    """
    n_v, best, stalls, largest = b.d.size, math.inf, 0, 0.0
    factor = b.loop.factor
    for i in range(n_v):
        b.total[i] = 0.0
    for iteration in range(most):
        unbalance(t, step, factor + 1.0, 1.0, model, b, b.p)
        unbalance(t, step, factor, 1.0, model, b, b.r)
        if not is_finite(b.r):
            return NOT_FINITE
        b.loop.unbalance = _work_of(b.r, b)
        _note(iteration, b.r, b)
        largest = max(largest, b.loop.unbalance)
        if iteration == 0:
            b.loop.first_unbalance = b.loop.unbalance
        if _factor(t, 0.0, factor, model, matrix, b) < 0:
            return SINGULAR
        for i in range(b.r.size):
            b.z[i] = b.r[i] - b.p[i]
            b.x[i] = -b.r[i]
        sparse_lu.solve(matrix, b.z)
        sparse_lu.solve(matrix, b.x)
        zz = zt = xz = tt = 0.0
        for i in range(n_v):
            w = 1.0 / (b.weight[i] * b.weight[i] * n_v)
            z = b.z[i]
            t1 = b.before[i] if iteration == 0 else b.total[i]
            s = b.x[i] + (0.0 if iteration == 0 else b.total[i])
            zz += w * z * z
            zt += w * z * t1
            xz += w * z * s
            tt += w * s * s
        if not zz > 0.0:
            return SINGULAR
        if iteration == 0:
            change = math.copysign(length / math.sqrt(zz), zt if zt != 0.0 else 1.0)
        else:
            inside = xz * xz - zz * (tt - length * length)
            if not inside >= 0.0:
                return NO_CONVERGENCE
            root = math.sqrt(inside)
            change = (-xz + math.copysign(root, zt)) / zz
        for i in range(b.x.size):
            b.x[i] += change * b.z[i]
        for i in range(n_v):
            b.d[i] = b.x[i]
        norm = move(1.0, model, b)
        if not math.isfinite(norm):
            return NOT_FINITE
        factor += change if norm <= LARGEST_MOVE else change * LARGEST_MOVE / norm
        b.loop.iterations += 1
        b.loop.correction = b.history[iteration, CORRECTION] = norm
        stalls += 1 if best <= norm < ROUGH else 0
        best = min(best, norm)
        rough = stalls >= STALLS and norm < ROUGH and b.loop.unbalance <= ROUND_OFF * b.loop.stiffest
        if iteration > 0 and (norm <= tolerance or rough):
            unbalance(t, step, factor, 1.0, model, b, b.r)
            b.loop.unbalance = _work_of(b.r, b)
            _note(iteration + 1, b.r, b)
            if b.loop.loose > 0 and b.loop.unbalance > _allowed(largest, model, b):
                return UNBALANCED
            b.loop.factor = factor
            return iteration + 1
    return NO_CONVERGENCE


@indirect(_I(REAL, REAL, REAL, REAL, MODEL, SPARSE, _WORKSPACE))
def probe(t, step, factor, shift, model, matrix, b):
    """Unbalance at a factor into b.r, and the factors of the tangent; returns what `sparse_lu.factor` does."""
    unbalance(t, step, factor, 1.0, model, b, b.r)
    b.loop.unbalance = _work_of(b.r, b)
    return _factor(t, shift, factor, model, matrix, b)


@indirect(void(REAL, MODEL, _WORKSPACE, VECTOR))
def accept(t, model, b, out):
    """Make the state the start of what follows; out : (5,) energies (3), of contacts, of coordinates and penalties."""
    step_end.end_step(t, 0.0, 1.0, 0.0, b.y, b.total, model, b.booked)
    take_step(model.switches, model)
    energies(t, b.y, model, out[:3])
    out[3], out[4] = contact.energy_of(model), b.powers[COUPLED_ENERGY]
