"""Accelerations and multipliers with which generalized-alpha starts."""

from __future__ import annotations

from numba import types, void

from evolvent.flow.implicit import residual
from evolvent.jit import REAL, VECTOR, indirect
from evolvent.kernels import joint, rigid, sparse_lu
from evolvent.kernels.flexible import is_finite
from evolvent.kernels.rotations import cross
from evolvent.kernels.sparse import SPARSE
from evolvent.model import MODEL
from evolvent.solvers.alpha import step_of
from evolvent.solvers.alpha_contact import add_mean_forces
from evolvent.solvers.alpha_state import (
    ACCELERATED,
    ALPHA_F,
    ALPHA_M,
    BETA,
    DONE,
    FRESH,
    GAMMA,
    LAST,
    MARCH,
    MASS,
    NOT_FINITE,
    REDUNDANT,
    SINGULAR,
    SPAN,
    STEP,
    TIME,
    displace,
    factor_at,
    short_c_mass,
)

_I = types.int64


@indirect(void(REAL, VECTOR, MODEL, SPARSE, VECTOR, MARCH, VECTOR, VECTOR))
def accelerations_at(t, state, model, matrix, options, march, A, la):
    """Accelerations A and multipliers la that fit a state: M v' + F + G^T la = 0 and g'' = 0, with a factored matrix.

    Notes
    -----
    g'' is the central difference of g' along the motion. The matrix is that of a step too short to feel stiffness.
    """
    n_q, n_v, y0 = model.info.nq, model.info.nv, march.y0
    joints, n_j = model.flexible.joints, model.flexible.joints.size
    first = n_v
    c_mass = short_c_mass(options)
    scale = c_mass * options[MASS]
    d = 1e-3 * options[SPAN]
    for _ in range(3):
        residual(t, state, A, la, 0.0, 1.0, model, march.r, march.powers[0])
        for side in range(2):
            for i in range(n_v):
                march.dq[i] = d * state[n_q + i] + 0.5 * d * d * A[i]
            for i in range(state.size):
                y0[i] = state[i]
            displace(state, march.dq, model, y0)
            for i in range(n_v):
                y0[n_q + i] = state[n_q + i] + d * A[i]
            rigid.kinematics(t + d, y0, model)
            for k in range(n_j):
                joint.joint_geometry(t + d, y0, k, model)
                march.x[first + k] = (march.x[first + k] if side == 1 else 0.0) + joints[k].rate / (2.0 * d)
            d = -d
        for k in range(n_j):
            if joints[k].stiffness > 0.0 or not joint.holds(t, joints, k):
                march.x[first + k] = -scale * march.r[first + k]
            else:
                march.x[first + k] *= -scale / c_mass
        for i in range(first):
            march.x[i] = -march.r[i]
        sparse_lu.solve(matrix, march.x)
        for i in range(n_v):
            A[i] += c_mass * march.x[i]
        for k in range(n_j):
            la[k] += scale * march.x[first + k]


@indirect(_I(MODEL, SPARSE, VECTOR, MARCH))
def start_accelerations(model, matrix, options, march):
    """Accelerations and multipliers at march.y; returns a status.

    Notes
    -----
    Multipliers are of second order from the first step on where the method starts as it goes on (Arnold, Bruls &
    Cardona, 2015): with a0 = v'(t0 + (alpha_m - alpha_f) h), and velocities that part from the constraints by what a
    step's position error asks for, h^2 ((1/6 - (alpha_m - alpha_f)/2 - beta) v'' + w x w'/12), the last for the
    rotation vector of a free body. Where a step does not resolve v'', both are left out.
    """
    n_q, n_v, t, h = model.info.nq, model.info.nv, march.clock[TIME], march.clock[STEP]
    y, la, A, bodies = march.y, march.la, march.v1[1], model.bodies
    for i in range(n_v):
        A[i] = 0.0
    for i in range(la.size):
        la[i] = 0.0
    residual(t, y, A, la, 0.0, 1.0, model, march.r, march.powers[0])
    c_mass = short_c_mass(options)
    found = factor_at(t, y, la, c_mass, 0.0, c_mass * options[MASS], model, matrix, march)
    march.tally[FRESH] = 1
    if found != 0:
        return SINGULAR if found < 0 else REDUNDANT
    accelerations_at(t, y, model, matrix, options, march, A, la)
    if not is_finite(A):
        return NOT_FINITE
    for i in range(n_v):
        march.v1[0, i] = A[i]
    if model.threads.size > 0:
        thread_accelerations(model, matrix, options, march)
        march.clock[LAST] = h
        return DONE
    J, B, state, la1 = march.v0[0], march.v0[1], march.spare, march.la0
    for i in range(n_v):
        J[i] = 0.0
    d = 1e-2 * options[SPAN]
    for _ in range(2):
        for i in range(n_v):
            march.dq[i] = d * y[n_q + i] + 0.5 * d * d * A[i]
            B[i] = A[i]
        for k in range(la.size):
            la1[k] = la[k]
        for i in range(y.size):
            state[i] = y[i]
        displace(y, march.dq, model, state)
        for i in range(n_v):
            state[n_q + i] += d * A[i]
        accelerations_at(t + d, state, model, matrix, options, march, B, la1)
        for i in range(n_v):
            J[i] += B[i] / (2.0 * d)
        d = -d
    jerk = rest = 0.0
    for i in range(n_v):
        jerk = max(jerk, h * h * h * abs(J[i]) / march.weight[i])
        rest = max(rest, (h * abs(y[n_q + i]) + h * h * abs(A[i])) / march.weight[i])
    shift = options[ALPHA_M] - options[ALPHA_F]
    for i in range(n_v):
        march.v1[0, i] = A[i]
    if jerk < 0.1 * rest:
        c = 1.0 / 6.0 - 0.5 * shift - options[BETA]
        for i in range(n_v):
            march.v1[0, i] += shift * h * J[i]
            J[i] *= c
        for b in range(bodies.size):
            if bodies[b].motion == rigid.FREE:
                q, at = bodies[b].iv + 3, bodies[b].iv + 3 - n_q
                x, yy, z = cross(y[q], y[q + 1], y[q + 2], A[at], A[at + 1], A[at + 2])
                J[at] += x / 12.0
                J[at + 1] += yy / 12.0
                J[at + 2] += z / 12.0
        for i in range(n_v):
            B[i] = A[i] + J[i]
        residual(t, y, A, la, 0.0, 1.0, model, march.x, march.powers[0])
        residual(t, y, B, la, 0.0, 1.0, model, march.r, march.powers[0])
        for i in range(march.x.size):  # M J, of which the solution is the part that keeps the constraints
            march.x[i] = march.r[i] - march.x[i] if i < n_v else 0.0
        sparse_lu.solve(matrix, march.x)
        for i in range(n_v):
            y[n_q + i] += h * h * (J[i] - c_mass * march.x[i])
    residual(t, y, A, la, 0.0, 1.0, model, march.r, march.powers[0])
    march.clock[LAST] = h
    if model.flexible.cylinders.size > 0:
        return add_mean_forces(t, h, model, matrix, options, march)
    return DONE


@indirect(void(MODEL, SPARSE, VECTOR, MARCH))
def thread_accelerations(model, matrix, options, march):
    """Give a model with threads at march.y the accelerations that its steps go on with; without a solution none.

    Notes
    -----
    A thread's springs are not resolved by a step: to it they are links. What pulls them on without stretch is not seen
    in the accelerations of the state, but in those v' of a step d of spectral radius 0, which has the increments
    d v + d^2 v'/2 and so v' + d v''/3 in place of v'. Steps of h/2 and h tell v' from v'', and with them
    a0 = v'(t0 + (alpha_m - alpha_f) h), as the method goes on (Arnold, Bruls & Cardona, 2015).
    """
    n_v, h, t = march.dq.size, march.clock[STEP], march.clock[TIME]
    am, af, beta, gamma = options[ALPHA_M], options[ALPHA_F], options[BETA], options[GAMMA]
    options[ALPHA_M], options[ALPHA_F], options[BETA], options[GAMMA] = -1.0, 0.0, 1.0, 1.5
    A, half, found = march.v0[2], march.v0[3], 1
    for i in range(march.y.size):
        march.y0[i] = march.y[i]
    for i in range(march.la.size):
        march.la0[i] = march.la[i]
    for i in range(n_v):
        A[i] = march.v1[1, i]
        march.v0[0, i] = A[i]
        march.v0[1, i] = A[i]
    for side in range(2):
        if found > 0:
            d = (0.5 + 0.5 * side) * h
            found = step_of(t + d, d, ACCELERATED, model, matrix, options, march)
            for i in range(march.y.size):
                march.y[i] = march.y0[i]
            for i in range(march.la.size):
                march.la[i] = march.la0[i]
            for i in range(n_v):
                if side == 0:
                    half[i] = march.v1[1, i]
            for i in range(march.powers.shape[1]):
                march.powers[1, i] = 2.0 * march.powers[1, i] - march.powers[0, i] if side == 1 else march.powers[0, i]
    options[ALPHA_M], options[ALPHA_F], options[BETA], options[GAMMA] = am, af, beta, gamma
    for i in range(n_v):
        first = 2.0 * half[i] - march.v1[1, i] if found > 0 else A[i]
        jerk = 6.0 * (march.v1[1, i] - half[i]) if found > 0 else 0.0  # times h
        march.v1[0, i], march.v1[1, i] = first + (am - af) * jerk, first
    residual(t, march.y, march.v1[1], march.la, 0.0, 1.0, model, march.r, march.powers[0])
    if found > 0:
        for i in range(march.powers.shape[1]):
            march.powers[0, i] = march.powers[1, i]
    march.tally[FRESH] = 1
