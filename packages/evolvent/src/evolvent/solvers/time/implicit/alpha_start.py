"""Accelerations and multipliers with which generalized-alpha starts."""

from __future__ import annotations

from numba import types, void

from evolvent.algebra import sparse_lu
from evolvent.algebra.sparse import SPARSE
from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.equations import step_end
from evolvent.equations.implicit import residual
from evolvent.kernels import constraints, rigid, thread
from evolvent.kernels.ancf_beams import is_finite
from evolvent.kernels.blocks import ROTATION, displace
from evolvent.kernels.rotations import cross
from evolvent.model import MODEL
from evolvent.solvers.time.implicit.alpha import end_step
from evolvent.solvers.time.implicit.alpha_tangent import factor_at, short_c_mass
from evolvent.solvers.time.implicit.newton import solve_end
from evolvent.solvers.time.implicit.workspace import ALPHA, DONE, NOT_FINITE, REDUNDANT, SINGULAR, WORKSPACE

_I = types.int64
#: Iterations to the accelerations, and more where friction depends on reactions, which the matrix does not have there.
MOST, RUBBING = 3, 20
#: Correction beside the accelerations with which the iterations for samples end: it shrinks as much again by each.
SMALL = 1e-6
#: Steps along the motion for the differences g'' and v'', relative to the span of the run.
ALONG, JERK = 1e-3, 1e-2


def _has_releases(model):
    return model.info.releases


@inlined
def find_second_rates(t, state, A, model, work, moved, out):
    """Write g'' of all constraints, central differences of g' along the motion, to the last nj entries of `out`.

    Parameters
    ----------
    A : (nv,) float, accelerations
    moved : (ny,) float, scratch, as is work.dq
    out : (nv + nj,) float, output
    """
    n_q, n_v, rows, d = model.info.nq, model.info.nv, model.constraints, ALONG * work.options.span
    for k in range(rows.size):
        out[n_v + k] = 0.0
    for _ in range(2):
        for i in range(n_v):
            work.dq[i] = d * state[n_q + i] + 0.5 * d * d * A[i]
        for i in range(state.size):
            moved[i] = state[i]
        displace(state, work.dq, False, model, moved)
        for i in range(n_v):
            moved[n_q + i] = state[n_q + i] + d * A[i]
        rigid.kinematics(t + d, moved, model)
        for k in range(rows.size):
            constraints.measure(constraints.STATE, t + d, moved, k, model)
            out[n_v + k] += rows[k].rate / (2.0 * d)
        d = -d


@indirect(void(REAL, VECTOR, REAL, types.boolean, MODEL, SPARSE, WORKSPACE, VECTOR, VECTOR))
def accelerations_at(t, state, small, known, model, matrix, work, A, la):
    """Accelerations A and multipliers la that fit a state: M v' + F + G^T la = 0 and g'' = 0, with a factored matrix.

    Parameters
    ----------
    small : float, largest correction beside the accelerations after which there is none
    known : bool, whether work.r is the residual with A and la

    Notes
    -----
    The matrix is that of a step too short to feel stiffness.
    """
    n_v, options = model.info.nv, work.options
    rows, n_j = model.constraints, model.constraints.size
    first = n_v
    c_mass = short_c_mass(options)
    scale = c_mass * options.mass
    for n in range(MOST if model.info.reactive == 0 else RUBBING):
        if n > 0 or not known:
            residual(t, state, A, la, 0.0, 1.0, model, work.r, work.powers[0])
        find_second_rates(t, state, A, model, work, work.y0, work.x)
        for k in range(n_j):
            if rows[k].stiffness > 0.0 or not constraints.holds(t, rows, k):
                work.x[first + k] = -scale * work.r[first + k]
            else:
                work.x[first + k] *= -scale / c_mass
        for i in range(first):
            work.x[i] = -work.r[i]
        sparse_lu.solve(matrix, work.x)
        moved = largest = 0.0
        for i in range(n_v):
            A[i] += c_mass * work.x[i]
            moved, largest = max(moved, abs(c_mass * work.x[i])), max(largest, abs(A[i]))
        for k in range(n_j):
            la[k] += scale * work.x[first + k]
        if n > 0 and moved <= small * largest and model.info.reactive == 0:
            return


@indirect(_I(REAL, VECTOR, MODEL, SPARSE, WORKSPACE, VECTOR, VECTOR))
def forces_at(t, state, model, matrix, work, A, la):
    """Write accelerations and multipliers that fit a state, and its forces; returns a status."""
    c_mass = short_c_mass(work.options)
    for i in range(A.size):
        A[i] = 0.0
    for k in range(la.size):
        la[k] = 0.0
    residual(t, state, A, la, 0.0, 1.0, model, work.r, work.powers[0])
    if factor_at(t, state, la, c_mass, 0.0, c_mass * work.options.mass, model, matrix, work) != 0:
        return SINGULAR
    accelerations_at(t, state, SMALL, True, model, matrix, work, A, la)
    if not (is_finite(A) and is_finite(la)):
        return NOT_FINITE
    residual(t, state, A, la, 0.0, 1.0, model, work.r, work.powers[0])
    return DONE


@indirect(_I(MODEL, SPARSE, WORKSPACE))
def begin(model, matrix, work):
    """Start from the state work.y at the loop's time; returns a status."""
    status = start_accelerations(model, matrix, work)
    if status != DONE:
        return status
    _begin_step(work.loop.time, 0.0, model, work)
    return DONE


@indirect(_I(REAL, MODEL, SPARSE, WORKSPACE))
def restart(after, model, matrix, work):
    """Start again from the state work.y, with the loads and joints just `after` it; returns a status."""
    t = work.loop.time
    work.loop.time = after
    step_end.start_run(after, 1.0, 1.0, work.y, model, work.booked)
    status = start_accelerations(model, matrix, work)
    work.loop.time = t
    if status == DONE:
        _begin_step(after, 1.0, model, work)
    return status


@indirect(void(REAL, REAL, MODEL, WORKSPACE))
def _begin_step(t, again, model, work):
    """What the first step needs of a start at t; again: of `equations.step_end.end_step`."""
    end_step(t, 0.0, model, work)
    step_end.end_step(t, 0.0, 1.0, again, work.y, work.dq, model, work.booked)


@indirect(_I(MODEL, SPARSE, WORKSPACE))
def start_accelerations(model, matrix, work):
    """Accelerations and multipliers at work.y; returns a status.

    Notes
    -----
    Multipliers are of second order from the first step on where the method starts as it goes on (Arnold, Bruls &
    Cardona, 2015): with a0 = v'(t0 + (alpha_m - alpha_f) h), and velocities that part from the constraints by what a
    step's position error asks for, h^2 ((1/6 - (alpha_m - alpha_f)/2 - beta) v'' + w x w'/12), the last for the
    rotation vector of a free body. Where a step does not resolve v'', both are left out; of a neighbour where the run
    leaves them out (`LOOP.follows`).
    """
    n_q, n_v, t, h, options = model.info.nq, model.info.nv, work.loop.time, work.loop.step, work.options
    y, la, A, blocks = work.y, work.la, work.dv1, model.blocks
    for i in range(la.size):
        la[i] = 0.0
    residual(t, y, A, la, 0.0, 1.0, model, work.r, work.powers[0])
    begins = thread.leaves_spool(model)  # where the directions of the step before the start are not known
    for i in range(n_v):
        A[i] = A[i] if begins else 0.0
    residual(t, y, A, la, 0.0, 1.0, model, work.r, work.powers[0])
    c_mass = short_c_mass(options)
    found = factor_at(t, y, la, c_mass, 0.0, c_mass * options.mass, model, matrix, work)
    work.loop.factored = 0.0
    if found != 0:
        return SINGULAR if found < 0 else REDUNDANT
    if not begins:
        accelerations_at(t, y, -1.0, False, model, matrix, work, A, la)
    if not is_finite(A):
        return NOT_FINITE
    for i in range(n_v):
        work.a1[i] = A[i]
    if thread.has_springs(model) or begins:
        thread_accelerations(model, matrix, work)
        work.loop.last = h
        return DONE
    J, B, state, la1 = work.a0, work.dv0, work.spare, work.la0
    for i in range(n_v):
        J[i] = 0.0
    d = JERK * options.span
    for _ in range(2):
        for i in range(n_v):
            work.dq[i] = d * y[n_q + i] + 0.5 * d * d * A[i]
            B[i] = A[i]
        for k in range(la.size):
            la1[k] = la[k]
        for i in range(y.size):
            state[i] = y[i]
        displace(y, work.dq, False, model, state)
        for i in range(n_v):
            state[n_q + i] += d * A[i]
        accelerations_at(t + d, state, -1.0, False, model, matrix, work, B, la1)
        for i in range(n_v):
            J[i] += B[i] / (2.0 * d)
        d = -d
    jerk = rest = 0.0
    for i in range(n_v):
        jerk = max(jerk, h * h * h * abs(J[i]) / work.weight[i])
        rest = max(rest, (h * abs(y[n_q + i]) + h * h * abs(A[i])) / work.weight[i])
    shift, loop = options.alpha_m - options.alpha_f, work.loop
    for i in range(n_v):
        work.a1[i] = A[i]
    loop.resolves = loop.follows if loop.follows != 0 else (1 if jerk < 0.1 * rest else -1)
    if loop.resolves > 0:
        c = 1.0 / 6.0 - 0.5 * shift - options.beta
        for i in range(n_v):
            work.a1[i] += shift * h * J[i]
            J[i] *= c
        for k in range(blocks.size):
            if blocks[k].kind == ROTATION:
                q, at = blocks[k].iv, blocks[k].iv - n_q
                x, yy, z = cross(y[q], y[q + 1], y[q + 2], A[at], A[at + 1], A[at + 2])
                J[at] += x / 12.0
                J[at + 1] += yy / 12.0
                J[at + 2] += z / 12.0
        for i in range(n_v):
            B[i] = A[i] + J[i]
        residual(t, y, A, la, 0.0, 1.0, model, work.x, work.powers[0])
        residual(t, y, B, la, 0.0, 1.0, model, work.r, work.powers[0])
        for i in range(work.x.size):  # M J, of which the solution is the part that keeps the constraints
            work.x[i] = work.r[i] - work.x[i] if i < n_v else 0.0
        sparse_lu.solve(matrix, work.x)
        for i in range(n_v):
            y[n_q + i] += h * h * (J[i] - c_mass * work.x[i])
    residual(t, y, A, la, 0.0, 1.0, model, work.r, work.powers[0])
    work.loop.last = h
    return DONE


@indirect(void(MODEL, SPARSE, WORKSPACE), used_for=_has_releases)
def thread_accelerations(model, matrix, work):
    """Give a model with threads at work.y the accelerations that its steps go on with; without a solution none.

    Notes
    -----
    A thread's springs are not resolved by a step: to it they are links. What pulls them on without stretch is not seen
    in the accelerations of the state, but in those v' of a step d of spectral radius 0, which has the increments
    d v + d^2 v'/2 and so v' + d v''/3 in place of v'. Steps of h/2 and h separate v' from v'', and with them
    a0 = v'(t0 + (alpha_m - alpha_f) h), as the method goes on (Arnold, Bruls & Cardona, 2015).
    """
    n_v, h, t, options = work.dq.size, work.loop.step, work.loop.time, work.options
    am, af, beta, gamma = options.alpha_m, options.alpha_f, options.beta, options.gamma
    options.alpha_m, options.alpha_f, options.beta, options.gamma = -1.0, 0.0, 1.0, 1.5
    own, options.method = options.method, ALPHA
    A, half, found, springs = work.loads0, work.spare, 1, thread.has_springs(model)
    for i in range(work.y.size):
        work.y0[i] = work.y[i]
    for i in range(work.la.size):
        work.la0[i] = work.la[i]
    for i in range(n_v):
        A[i] = work.dv1[i]
        work.a0[i] = A[i]
        work.dv0[i] = A[i]
    for side in range(2):
        if found > 0:
            d = (0.5 + 0.5 * side) * h
            found = solve_end(t + d, d, model, matrix, work)
            for i in range(work.y.size):
                work.y[i] = work.y0[i]
            for i in range(work.la.size):
                if side == 0:
                    work.la1[i] = work.la[i]
                work.la0[i] = 2.0 * work.la1[i] - work.la[i] if side == 1 and not springs else work.la0[i]
                work.la[i] = work.la0[i]
            for i in range(n_v):
                if side == 0:
                    half[i] = work.dv1[i]
            for i in range(work.powers.shape[1]):
                work.powers[1, i] = 2.0 * work.powers[1, i] - work.powers[0, i] if side == 1 else work.powers[0, i]
    options.alpha_m, options.alpha_f, options.beta, options.gamma, options.method = am, af, beta, gamma, own
    for i in range(n_v):
        first = 2.0 * half[i] - work.dv1[i] if found > 0 else A[i]
        jerk = 6.0 * (work.dv1[i] - half[i]) if found > 0 else 0.0  # times h
        work.a1[i], work.dv1[i] = first + (am - af) * jerk, first
    residual(t, work.y, work.dv1, work.la, 0.0, 1.0, model, work.r, work.powers[0])
    if found > 0:
        for i in range(work.powers.shape[1]):
            work.powers[0, i] = work.powers[1, i]
    work.loop.factored = 0.0
