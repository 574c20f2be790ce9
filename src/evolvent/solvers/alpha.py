"""Generalized-alpha for constrained systems of index 3, its time loop compiled whole.

Unknowns of a step are the increments dq of the coordinates (of a free body's attitude a rotation vector in body axes,
so that the update stays on the rotations) and the multipliers at its end.

Notes
-----
Arnold & Bruls (2007), eqs. 5 and 8, with Chung & Hulbert's (1993) parameters of the spectral radius rho at infinity:
alpha_m = (2 rho - 1)/(rho + 1), alpha_f = rho/(rho + 1), beta = 1/(1 + rho)^2, gamma = 2/(1 + rho) - 1/2 (Yi et al.
2017 print + 1/2), and

    (1 - alpha_m) a1 + alpha_m a0 = (1 - alpha_f) v1' + alpha_f v0'
    dq = h v0 + h^2 ((1/2 - beta) a0 + beta a1),   v1 = v0 + h ((1 - gamma) a0 + gamma a1)
    M v1' + F(t1, q1, v1) + G^T la1 = 0,           g(t1, q1) = 0

Contact forces f that are means over the step (the law CONSERVATIVE) add h^2 w/2 to dq and h w to v1, M w = f. With a1
and v1' replaced by those that the same dq has without w, they stand in the equations with the share
(1 - alpha_m)/(2 beta (1 - alpha_f)), and v1, a1 and v1' are set right after Newton's method. Of a part whose stiffness
the step does not resolve, f = M w + g: it takes the jump of velocity as a whole, and what would drive its ends against
each other, g, stands in the equations as a force of the step's end, with the share 1: so energy is kept at fixed steps
as long as the contact, too (see `_borne`; adaptive steps resolve it, g = 0). Multipliers bear M w as a mean, too.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import types, void

from evolvent.flow import powers as eq
from evolvent.flow.implicit import energies, keep_momentum, residual, tangent
from evolvent.jit import REAL, VECTOR, entry, indirect, inlined
from evolvent.kernels import contact, couplings, rigid, sparse_lu, touch
from evolvent.kernels.flexible import NODE_VECTORS, is_finite
from evolvent.kernels.rotations import cross
from evolvent.kernels.sparse import SPARSE
from evolvent.model import MODEL
from evolvent.pointer import Struct, array

# status codes of the loop
BUDGET, DONE, AT_STOP, NO_CONVERGENCE, NOT_FINITE, SINGULAR, GAINED, REDUNDANT = 0, 1, 2, -1, -2, -3, -4, -5
# places in March.tally; OVER: looks in a row at which the account has gained too much; MET: whether
# anything touched in an iteration of the last step
STEPS, ITERATIONS, REJECTED, FACTORED, SAMPLE, STOP, FRESH, SET, OVER, MET, N_TALLY = range(11)
# places in March.clock; FACTOR: step of the matrix; QUALITY: its worst pivot so far; NET: what the account has gained
# since the start, LARGEST: since its lowest; LAST: step that the algorithmic accelerations belong to; EVENT: the next
# step's limit, where a latch lies
TIME, STEP, FACTOR, QUALITY, LARGEST, NET, LAST, EVENT, N_CLOCK = range(9)
# places in March.ledger: what causes have taken, what came in, energy now and at the start
BY_MASS, BY_STIFFNESS, BY_CONTACT, BY_FRICTION, BY_JOINTS, BY_SPRINGS, LOADS, DRIVES = range(8)
KINETIC, ELASTIC, BENDING, CONTACT, COUPLED, START, PEAK, SPOOLS, N_LEDGER = 8, 9, 10, 11, 12, 13, 14, 15, 16
# places in the options; SHARE: of contact forces that are means over a step
ALPHA_M, ALPHA_F, BETA, GAMMA, SHARE, NEWTON, TOLERANCE, SMALLEST, LONGEST, GAIN, MASS, SPAN, FLOOR, N_OPTIONS = range(
    14
)
#: Where Newton's method starts a step: from constant accelerations, from constant velocities, from what March holds.
ACCELERATED, COASTING, AS_IT_IS = 0, 1, 2
#: Iterations of Newton's method before a step is given up.
MOST_ITERATIONS = 25
#: Convergence slower than this has the matrix factored anew.
SLOW = 0.15
#: A correction below this that Newton's method with a new tangent does not halve is round-off (constraints near a place
#: where they depend on one another).
ROUND_OFF = 1e-8
#: Part of mean contact forces that stiffness bears for which a step is solved once more; their change by that at which
#: it is not.
BORNE, FOLLOWS = 1e-2, 0.25
#: Change of that part, beside the forces, below which a step is not solved once more.
KEPT = 1e-9
#: Steps between two looks at the energies, where nothing touches; they take half of an iteration's time.
EACH = 8
#: What a cylinder leaves at a sample: force, torque (inertial axes, at its body's origin), normal force, impulse of it,
#: points that touch.
N_CYLINDER = 9


class March(Struct):
    """What the loop carries.

    Attributes
    ----------
    y, y0, spare : (ny,) float, state at the end and the start of a step, and scratch
    v1 : (5, nv) float, algorithmic accelerations a, accelerations v', loads, accelerations w by forces that are means
        over the step, the part g of those that stiffness bears; those of its start in `v0`
    la, la0 : (nj,) float; dq : (nv,) float, increments; r, x : (nv + nj,) float
    weight : (nu,) float, size of each unknown that counts as 1
    kept : (12,) float, angular momentum that an isolated system keeps (see `keep_momentum`)
    powers : (2, N_POWERS) float, at the end and the start; gaps : (nj,) float, what feeds change in the joints' gaps
    samples : (nt,) float; stops : (ns,) float, times on which the loop lands and starts anew
    out_* : what is kept at the samples
    """

    y: np.ndarray = array(1)
    y0: np.ndarray = array(1)
    spare: np.ndarray = array(1)
    v1: np.ndarray = array(2)
    v0: np.ndarray = array(2)
    la: np.ndarray = array(1)
    la0: np.ndarray = array(1)
    dq: np.ndarray = array(1)
    r: np.ndarray = array(1)
    x: np.ndarray = array(1)
    weight: np.ndarray = array(1)
    powers: np.ndarray = array(2)
    gaps: np.ndarray = array(1)
    clock: np.ndarray = array(1)
    tally: np.ndarray = array(1, np.int64)
    ledger: np.ndarray = array(1)
    impulse: np.ndarray = array(1)
    kept: np.ndarray = array(1)
    samples: np.ndarray = array(1)
    stops: np.ndarray = array(1)
    out_y: np.ndarray = array(2)
    out_a: np.ndarray = array(2)
    out_la: np.ndarray = array(2)
    out_ledger: np.ndarray = array(2)
    out_cylinders: np.ndarray = array(3)
    out_bodies: np.ndarray = array(3)


_MARCH = March._numba_type_
_I, _B = types.int64, types.boolean


def functions(model: Any) -> list[Any]:
    """Functions of this module that a model needs."""
    found = [
        advance, begin, start_accelerations, accelerations_at, factor_at, displace, step_of, _solve_step, book, gain,
        paths, fill_energies, keep, anew, _back,
    ]  # fmt: skip
    if model.flexible.cylinders.size:
        found += [_add_mean_forces, _bear, _borne, _mean_forces, _whole_wrenches]
    if model.threads.size:
        found += [settle]
    return found


@indirect(void(VECTOR, VECTOR, MODEL, VECTOR))
def displace(y0, dq, model, y):
    """Coordinates of y = those of y0 moved by dq; velocities are left."""
    bodies, points, beams = model.bodies, model.points, model.flexible.beams
    n_q = model.info.nq
    for k in range(beams.size):
        q, at, size = beams[k].iq, beams[k].iv - n_q, beams[k].nodes * 3 * NODE_VECTORS[beams[k].kind]
        for i in range(size):
            y[q + i] = y0[q + i] + dq[at + i]
    for k in range(model.threads.size):
        q, at = model.threads[k].iq, model.threads[k].iv - n_q
        for i in range(3 * model.threads[k].n):
            y[q + i] = y0[q + i] + dq[at + i]
    for k in range(points.size):
        q, at = points[k].iq, points[k].iv - n_q
        for c in range(3):
            y[q + c] = y0[q + c] + dq[at + c]
    for k in range(bodies.size):
        if bodies[k].motion == rigid.SPIN:
            y[bodies[k].iq] = y0[bodies[k].iq] + dq[bodies[k].iv - n_q]
        elif bodies[k].motion == rigid.FREE:
            q, at = bodies[k].iq, bodies[k].iv - n_q
            for c in range(3):
                y[q + c] = y0[q + c] + dq[at + c]
            turned(y0, q + 3, dq[at + 3], dq[at + 4], dq[at + 5], y)


@inlined
def turned(y0, q, px, py, pz, y):
    """Quaternion at y[q : q + 4] = the one of y0 times exp of the rotation vector p (body axes), of length 1."""
    angle = math.sqrt(px * px + py * py + pz * pz)
    s = math.sin(0.5 * angle) / angle if angle > 1e-8 else 0.5 - angle * angle / 48.0
    c = math.cos(0.5 * angle)
    bx, by, bz = s * px, s * py, s * pz
    w, x, yy, z = y0[q], y0[q + 1], y0[q + 2], y0[q + 3]
    a = w * c - x * bx - yy * by - z * bz
    b = w * bx + x * c + yy * bz - z * by
    d = w * by - x * bz + yy * c + z * bx
    e = w * bz + x * by - yy * bx + z * c
    n = 1.0 / math.sqrt(a * a + b * b + d * d + e * e)
    y[q], y[q + 1], y[q + 2], y[q + 3] = n * a, n * b, n * d, n * e


@indirect(_I(REAL, VECTOR, VECTOR, REAL, REAL, REAL, MODEL, SPARSE, _MARCH))
def factor_at(t, y, la, c_mass, c_rate, scale, model, matrix, march):
    """Assemble and factor the matrix; returns what `sparse_lu.factor` returns."""
    tangent(t, y, la, c_mass, c_rate, scale, model, matrix)
    found = sparse_lu.factor(matrix)
    march.tally[FACTORED] += 1
    march.clock[QUALITY] = min(march.clock[QUALITY], matrix.quality[0])
    return found


@indirect(void(REAL, VECTOR, MODEL, SPARSE, VECTOR, _MARCH, VECTOR, VECTOR))
def accelerations_at(t, state, model, matrix, options, march, A, la):
    """Accelerations A and multipliers la that fit a state: M v' + F + G^T la = 0 and g'' = 0, with a factored matrix.

    Notes
    -----
    g'' is the central difference of g' along the motion. The matrix is that of a step too short to feel stiffness.
    """
    n_q, n_v, y0 = model.info.nq, model.info.nv, march.y0
    joints, n_j = model.flexible.joints, model.flexible.joints.size
    first = n_v
    c_mass = _short(options)
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
                couplings.joint_geometry(t + d, y0, k, model)
                march.x[first + k] = (march.x[first + k] if side == 1 else 0.0) + joints[k].rate / (2.0 * d)
            d = -d
        for k in range(n_j):
            if joints[k].stiffness > 0.0 or not couplings.holds(t, joints, k):
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


@inlined
def _short(options):
    """c_mass of a step too short to feel stiffness."""
    return 1e16 / (options[SPAN] * options[SPAN])


@indirect(_I(MODEL, SPARSE, VECTOR, _MARCH))
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
    c_mass = _short(options)
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
        settle(model, matrix, options, march)
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
        return _add_mean_forces(t, h, model, matrix, options, march)
    return DONE


@indirect(_I(REAL, REAL, MODEL, SPARSE, VECTOR, _MARCH))
def _add_mean_forces(t, h, model, matrix, options, march):
    """Add the contact forces f that are means over a step to the start, where nothing of them stands; returns a status.

    Notes
    -----
    Steps go on with accelerations that hold the part g of f which stiffness bears, and nothing of the rest, M w. A
    start without g would not stay at rest where it is in equilibrium. Multipliers and wrenches are those of all of f.
    """
    n_v, f, g, cylinders = march.dq.size, march.v1[3], march.v1[4], model.flexible.cylinders
    first = march.x.size - march.la.size
    if not touch.step_forces(model, f):
        return DONE
    rubs = False
    for k in range(cylinders.size):
        rubs = rubs or cylinders[k].friction > 0.0
    for i in range(n_v):
        g[i] = 0.0
    if options[TOLERANCE] == 0.0 and not rubs and _borne(t, h, model, matrix, options, march) < 0:
        return SINGULAR
    c_mass = _short(options)
    march.tally[FRESH] = 1
    for part in range(2):
        if factor_at(t, march.y, march.la, c_mass, 0.0, c_mass * options[MASS], model, matrix, march) != 0:
            return SINGULAR
        for i in range(march.x.size):
            march.x[i] = 0.0
        for i in range(n_v):
            march.x[i] = g[i] if part == 0 else f[i]
        sparse_lu.solve(matrix, march.x)
        for i in range(n_v):
            if part == 0:
                march.spare[i] = c_mass * march.x[i]
                march.v1[0, i] += march.spare[i]
                march.v1[1, i] += march.spare[i]
            else:
                f[i] = c_mass * march.x[i] - march.spare[i]  # w
        if part == 1:
            for k in range(march.la.size):
                march.la[k] += c_mass * options[MASS] * march.x[first + k]
    residual(t, march.y, march.v1[1], march.la, 0.0, 1.0, model, march.r, march.powers[0])
    for k in range(cylinders.size):
        if cylinders[k].law == contact.CONSERVATIVE:
            for i in range(6):
                model.bodies[cylinders[k].body].F[i] += cylinders[k].F[i]
    return DONE


@indirect(void(MODEL, SPARSE, VECTOR, _MARCH))
def settle(model, matrix, options, march):
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


@indirect(_I(REAL, REAL, MODEL, SPARSE, VECTOR, _MARCH))
def _solve_step(t1, h, model, matrix, options, march):
    """Solve one step of length h that ends at t1; returns as `step_of` does.

    Notes
    -----
    Newton's method starts from the accelerations of the step's start. Contact forces that have not built up yet (a taut
    cable that begins to touch a cylinder) are not among them: such a start may lie so far inside the cylinder that the
    method finds no solution. A fixed step is then solved from constant velocities, and with all of the mean forces
    taken by masses; an adaptive one is cut.
    """
    adaptive, coasts = options[TOLERANCE] > 0.0, False
    for k in range(model.flexible.cylinders.size):
        row = model.flexible.cylinders[k]
        coasts = coasts or (row.law == contact.CONSERVATIVE and row.friction > 0.0 and row.touching > 0.0)
    begins = COASTING if coasts and not adaptive else ACCELERATED
    found = step_of(t1, h, begins, model, matrix, options, march)
    if adaptive or model.flexible.cylinders.size == 0:
        return found
    for trial in range(3):
        if found > 0:
            return found
        if trial == 1:
            for i in range(march.dq.size):
                march.v1[4, i] = 0.0
        for i in range(march.la.size):
            march.la[i] = march.la0[i]
        march.tally[FRESH] = 1
        found = step_of(t1, h, begins if trial == 1 else COASTING, model, matrix, options, march)
    return found


@indirect(_I(REAL, REAL, _I, MODEL, SPARSE, VECTOR, _MARCH))
def step_of(t1, h, start, model, matrix, options, march):
    """Solve one step of length h that ends at t1; returns the number of iterations, or a status below zero.

    `start`: ACCELERATED, COASTING or AS_IT_IS.
    """
    n_q, n_v = model.info.nq, model.info.nv
    y, y0, la, dq, r, x = march.y, march.y0, march.la, march.dq, march.r, march.x
    weight, n_j, first = march.weight, march.la.size, n_v
    am, af, beta, gamma = options[ALPHA_M], options[ALPHA_F], options[BETA], options[GAMMA]
    c_mass = (1.0 - am) / (beta * h * h * (1.0 - af))
    c_rate = gamma / (beta * h)
    scale = c_mass * options[MASS]
    a0, A0, a, A = march.v0[0], march.v0[1], march.v1[0], march.v1[1]
    if start != AS_IT_IS:
        for i in range(n_v):
            if start == ACCELERATED:
                A[i] = A0[i]
                a[i] = ((1.0 - af) * A[i] + af * A0[i] - am * a0[i]) / (1.0 - am)
            else:
                a[i] = (beta - 0.5) / beta * a0[i]
                A[i] = ((1.0 - am) * a[i] + am * a0[i] - af * A0[i]) / (1.0 - af)
            dq[i] = h * y0[n_q + i] + h * h * ((0.5 - beta) * a0[i] + beta * a[i])
            y[n_q + i] = y0[n_q + i] + h * ((1.0 - gamma) * a0[i] + gamma * a[i])
        displace(y0, dq, model, y)
        march.tally[MET] = 0
    if abs(march.clock[FACTOR] - h) > 1e-6 * h:
        march.tally[FRESH] = 1
    last, ratio = math.inf, 0.0
    for iteration in range(MOST_ITERATIONS):
        residual(t1, y, A, la, h, 1.0, model, r, march.powers[0])
        if model.flexible.cylinders.size > 0:
            for i in range(n_v):
                r[i] += (options[SHARE] - 1.0) * march.v1[4, i]
        if not is_finite(r):
            return NOT_FINITE
        touching = touch.count_touching(model) if model.flexible.cylinders.size > 0 else 0
        if touching != 0:
            march.tally[MET] = 1
        if touching != march.tally[SET]:
            march.tally[SET] = touching
            march.tally[FRESH] = 1
        # a thread's directions must be fresh
        renewed = march.tally[FRESH] == 1 or ratio > SLOW or model.threads.size > 0
        if renewed:
            found = factor_at(t1, y, la, c_mass, c_rate, scale, model, matrix, march)
            if found < 0:
                march.tally[FRESH] = 1
                return SINGULAR
            if found > 0:
                march.tally[FRESH] = 1
                return REDUNDANT
            march.tally[FRESH] = 0
            march.clock[FACTOR] = h
        for i in range(first):
            x[i] = -r[i]
        for k in range(n_j):
            x[first + k] = -scale * r[first + k]
        sparse_lu.solve(matrix, x)
        norm = 0.0
        for i in range(n_v):
            d = x[i]
            norm = max(norm, abs(d) / weight[i])
            dq[i] += d
            y[n_q + i] += c_rate * d
            A[i] += c_mass * d
            a[i] += d / (beta * h * h)
        for k in range(n_j):
            la[k] += scale * x[first + k]
        displace(y0, dq, model, y)
        if not math.isfinite(norm):
            return NOT_FINITE
        march.tally[ITERATIONS] += 1
        if iteration > 0:
            ratio = norm / last if last > 0.0 else 0.0
        if norm <= options[NEWTON] or (ratio > 0.0 and ratio < 0.9 and norm * ratio / (1.0 - ratio) <= options[NEWTON]):
            return iteration + 1
        if renewed and ratio > 0.5 and norm <= ROUND_OFF and model.threads.size == 0:
            return iteration + 1
        last = norm
    march.tally[FRESH] = 1
    return NO_CONVERGENCE


@indirect(void(REAL, REAL, MODEL, _MARCH))
def book(t, h, model, march):
    """Book a step's work and losses into the ledger.

    Notes
    -----
    Work of loads and drives is the mean of the forces of both ends times the displacement; losses by mass, stiffness,
    springs and joints are the mean power times h; friction is booked as in `touch.settle_contacts`.
    """
    ledger, f = march.ledger, model.flexible
    n_v = model.info.nv
    P, P0, p, p0 = march.v1[2], march.v0[2], march.powers[0], march.powers[1]
    work = 0.5 * h * (p[eq.MARKER_LOADS] + p0[eq.MARKER_LOADS])
    for i in range(n_v):
        work += 0.5 * (P[i] + P0[i]) * march.dq[i]
    ledger[LOADS] += work
    for pair in range(4):
        cause = (BY_MASS, BY_STIFFNESS, BY_SPRINGS, BY_JOINTS)[pair]
        which = (eq.MASS_DAMPING, eq.STIFFNESS_DAMPING, eq.SPRINGS, eq.JOINTS)[pair]
        ledger[cause] += 0.5 * h * (p[which] + p0[which])
    ledger[DRIVES] += _drives(t, h, model, march) + 0.5 * h * (p[eq.DRIVEN] + p0[eq.DRIVEN])
    ledger[SPOOLS] += 0.5 * h * (p[eq.SPOOLS] + p0[eq.SPOOLS])
    for k in range(f.cylinders.size):
        if f.cylinders[k].law == contact.CONSERVATIVE and model.bodies[f.cylinders[k].body].motion == rigid.DRIVEN:
            ledger[DRIVES] += h * _driven(f.cylinders, model.bodies, k)
    if f.cylinders.size > 0:
        slip, damped = touch.settle_contacts(march.y, model)
        ledger[BY_FRICTION] += slip
        ledger[BY_CONTACT] += damped
    for k in range(f.cylinders.size):
        march.impulse[k] += h * f.cylinders[k].normal


@indirect(REAL(REAL, MODEL, _MARCH))
def gain(t, model, march):
    """Fill in the energies; returns what the account has gained from nothing since the start, J."""
    ledger = march.ledger
    fill_energies(t, model, march)
    energy = ledger[KINETIC] + ledger[ELASTIC] + ledger[COUPLED]
    ledger[PEAK] = max(ledger[PEAK], energy)
    gained = energy - ledger[START] - ledger[LOADS] - ledger[DRIVES] - ledger[SPOOLS]
    for cause in range(BY_MASS, BY_SPRINGS + 1):
        gained += ledger[cause]
    return gained


@entry(VECTOR, VECTOR)
@inlined
def gain_scale(ledger, options):
    """Energy beside which a gain counts: the largest there was, or the work, J."""
    return max(ledger[PEAK], abs(ledger[LOADS]) + abs(ledger[DRIVES]) + abs(ledger[SPOOLS])) + options[FLOOR]


@inlined
def _drives(t, h, model, march):
    """Work of driven joints over a step, la dg/dt of each, mean la."""
    work = 0.0
    joints = model.flexible.joints
    for k in range(joints.size):
        if joints[k].path != 0 and couplings.holds(t, joints, k):
            work += 0.5 * (march.la[k] + march.la0[k]) * march.gaps[k]
    return work


@indirect(void(REAL, REAL, MODEL, _MARCH))
def paths(t, h, model, march):
    """Change of each driven joint's gap by its feed alone over a step that starts at t."""
    joints = model.flexible.joints
    for k in range(joints.size):
        march.gaps[k] = 0.0
        if joints[k].path != 0:
            couplings.joint_geometry(t, march.y, k, model)
            now = joints[k].gap
            couplings.joint_geometry(t + h, march.y, k, model)
            march.gaps[k] = joints[k].gap - now


@indirect(void(REAL, MODEL, _MARCH))
def fill_energies(t, model, march):
    """Energies of the state into the ledger; contacts and hinges are those of the last residual."""
    ledger, f = march.ledger, model.flexible
    energies(t, march.y, model, ledger[KINETIC : KINETIC + 3])
    ledger[CONTACT] = 0.0
    for k in range(f.cylinders.size):
        ledger[CONTACT] += f.cylinders[k].energy
    ledger[COUPLED] = march.powers[0, eq.COUPLED_ENERGY]


@indirect(void(_I, MODEL, _MARCH))
def keep(n, model, march):
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


@indirect(_I(MODEL, SPARSE, VECTOR, _MARCH))
def begin(model, matrix, options, march):
    """Start the loop from march.y at its time: accelerations, energies, sample 0; returns a status."""
    status = start_accelerations(model, matrix, options, march)
    if status != DONE:
        return status
    t = march.clock[TIME]
    if model.flexible.cylinders.size > 0:
        touch.settle_contacts(march.y, model)
    for i in range(march.dq.size):
        march.v1[2, i] = model.flexible.P[i]
    keep_momentum(t, 0.0, march.y, model.flexible.P, model, march.spare, march.kept)
    fill_energies(t, model, march)
    march.ledger[START] = march.ledger[KINETIC] + march.ledger[ELASTIC] + march.ledger[COUPLED]
    march.ledger[PEAK] = march.ledger[START]
    for k in range(model.flexible.hinges.size):
        model.flexible.hinges[k].before = model.flexible.hinges[k].angle
    if march.samples[0] <= t:
        keep(0, model, march)
        march.tally[SAMPLE] = 1
    return DONE


@indirect(_I(MODEL, SPARSE, VECTOR, _MARCH, _I))
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
        paths(t, h, model, march)
        t1 = target if lands else t + h
        # what begins or ends at a stop has not done so yet
        t_end = t1 - max(1e-9 * h, 2.0 * near) if lands and stops else t1
        found = _solve_step(t_end, h, model, matrix, options, march)
        error = 0.0
        if found > 0:
            if model.flexible.cylinders.size > 0 or model.threads.size > 0 or lands:
                # contacts, tensions and reactions of the state that the last correction led to
                residual(t_end, march.y, march.v1[1], march.la, h, 1.0, model, march.r, march.powers[0])
                if not adaptive and model.flexible.cylinders.size > 0:
                    found = _bear(t_end, h, found, model, matrix, options, march)
                touches = model.flexible.cylinders.size > 0
                if found > 0 and touches and not _mean_forces(t_end, h, model, matrix, options, march):
                    found = SINGULAR
            if adaptive:
                c = abs(options[BETA] - 1.0 / 6.0) * h * h
                for i in range(n_v):
                    d = abs(march.v1[0, i] - march.v0[0, i]) + abs(march.v1[3, i] - march.v0[3, i])
                    error = max(error, c * d / march.weight[i])
                error /= options[TOLERANCE]
        if found <= 0 or error > 1.0:
            if not adaptive or h <= options[SMALLEST]:
                _back(model, march)
                return found if found <= 0 else NO_CONVERGENCE
            _back(model, march)
            tally[REJECTED] += 1
            clock[STEP] = h * (0.35 if found <= 0 else max(0.2, 0.85 * error ** (-1.0 / 3.0)))
            continue
        part = _until_latch(model) if error <= 1.0 else 1.0
        if part < 1.0 and h * part > options[SMALLEST]:
            _back(model, march)
            clock[EVENT] = h * part
            continue
        keep_momentum(t_end, h, march.y, model.flexible.P, model, march.spare, march.kept)
        for i in range(n_v):
            march.v1[2, i] = model.flexible.P[i]
        book(t_end, h, model, march)
        clock[LAST], clock[EVENT] = h, math.inf
        clock[TIME] = t1
        tally[STEPS] += 1
        touching = model.flexible.cylinders.size + model.flexible.hinges.size > 0
        if lands or touching or tally[STEPS] % EACH == 0:
            net = gain(t_end, model, march)
            clock[LARGEST] = max(clock[LARGEST] + net - clock[NET], 0.0)
            clock[NET] = net
            scale = gain_scale(ledger, options)
            passed = 1 if touching else EACH
            tally[OVER] = tally[OVER] + passed if clock[LARGEST] > options[GAIN] * scale else 0
        # a few steps from rest gain as much as there is, and then less and less beside it
        ends = t1 >= march.samples[n_t - 1] - near
        if tally[OVER] >= 20 or (ends and tally[OVER] >= (1 if tally[STEPS] > 5 else 2)):
            if lands and t1 >= march.samples[tally[SAMPLE]] - near:
                keep(tally[SAMPLE], model, march)
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
            keep(tally[SAMPLE], model, march)
            tally[SAMPLE] += 1
        if stops and lands:
            tally[STOP] += 1
            if model.threads.size > 0:
                return AT_STOP
            latched = True
            if adaptive:
                clock[STEP] = min(clock[STEP], max(options[SMALLEST] * 10.0, 1e-3 * clock[STEP]))
        if latched:
            status = anew(t1, h, model, matrix, options, march)
            if status != DONE:
                return status
    return BUDGET


@indirect(_I(REAL, REAL, _I, MODEL, SPARSE, VECTOR, _MARCH))
def _bear(t, h, found, model, matrix, options, march):
    """Solve a fixed step once more with what stiffness bears of mean contact forces; returns as `step_of` does.

    Where the forces follow that (a contact that is stiffer than what it pushes), the step stays as it was, and so it
    does with friction, whose forces go on as those of rest do.
    """
    f, before, g, n_v = march.v1[3], march.v0[4], march.v1[4], march.dq.size
    for k in range(model.flexible.cylinders.size):
        if model.flexible.cylinders[k].friction > 0.0:
            return found
    last = march.spare[n_v : 2 * n_v]
    for i in range(n_v):
        last[i] = g[i]
    borne = _borne(t, h, model, matrix, options, march)
    if borne < 0:
        return SINGULAR
    change = largest = 0.0
    for i in range(n_v):
        change, largest = max(change, abs(g[i] - last[i])), max(largest, abs(f[i]), abs(last[i]))
        before[i] = f[i]
    if change <= KEPT * largest:
        return found
    if borne > 0:
        again = step_of(t, h, AS_IT_IS, model, matrix, options, march)
        if again > 0:
            residual(t, march.y, march.v1[1], march.la, h, 1.0, model, march.r, march.powers[0])
            touch.step_forces(model, f)
            change = largest = 0.0
            for i in range(n_v):
                change, largest = max(change, abs(f[i] - before[i])), max(largest, abs(before[i]))
            if change <= FOLLOWS * largest:
                return found + again
    for i in range(n_v):
        g[i] = 0.0
    for i in range(march.la.size):
        march.la[i] = march.la0[i]
    march.tally[FRESH] = 1
    again = _solve_step(t, h, model, matrix, options, march)
    if again > 0:
        residual(t, march.y, march.v1[1], march.la, h, 1.0, model, march.r, march.powers[0])
    return again


@indirect(_I(REAL, REAL, MODEL, SPARSE, VECTOR, _MARCH))
def _borne(t, h, model, matrix, options, march):
    """Find the part g of contact forces f, means over the step, that stiffness and joints bear at once.

    Returns whether it counts (0 or 1), -1 without a solution. f stays in the place of w.

    Notes
    -----
    g = f - c M x with (c M + K) x + G^T mu = f, G x = 0, the contact's own stiffness left out. Any g will do; with this
    one little is left of what `_mean_forces` would set right in motions that the step does not resolve.
    """
    n_v, f, g, A = model.info.nv, march.v1[3], march.v1[4], march.v1[1]
    cylinders = model.flexible.cylinders
    if not touch.step_forces(model, f):
        for i in range(n_v):
            g[i] = 0.0
        return 0
    for i in range(march.x.size):
        march.x[i] = 0.0
    for i in range(n_v):
        march.x[i] = f[i]
    c_mass = (1.0 - options[ALPHA_M]) / (options[BETA] * h * h * (1.0 - options[ALPHA_F]))
    march.tally[FRESH] = 1
    for k in range(cylinders.size):
        cylinders[k].share = 0.0
    found = factor_at(t, march.y, march.la, c_mass, 0.0, c_mass * options[MASS], model, matrix, march)
    for k in range(cylinders.size):
        cylinders[k].share = options[SHARE] if cylinders[k].law == contact.CONSERVATIVE else 1.0
    if found != 0:
        return -1
    sparse_lu.solve(matrix, march.x)
    for i in range(n_v):
        march.spare[i] = A[i]
        A[i] += c_mass * march.x[i]
    residual(t, march.y, A, march.la, h, 1.0, model, march.x, march.powers[0])
    for i in range(n_v):
        A[i] = march.spare[i]
    residual(t, march.y, A, march.la, h, 1.0, model, march.r, march.powers[0])
    most = largest = 0.0
    for i in range(n_v):
        g[i] = f[i] - (march.x[i] - march.r[i])
        most, largest = max(most, abs(g[i])), max(largest, abs(f[i]))
    if most > BORNE * largest:
        return 1
    for i in range(n_v):
        g[i] = 0.0
    return 0


@indirect(_B(REAL, REAL, MODEL, SPARSE, VECTOR, _MARCH))
def _mean_forces(t, h, model, matrix, options, march):
    """Set right the velocities, accelerations and wrenches of a step with contact forces that are means over it."""
    n_q, n_v, w, g = model.info.nq, model.info.nv, march.v1[3], march.v1[4]
    some = touch.step_forces(model, w)
    for i in range(march.x.size):
        march.x[i] = 0.0
    for i in range(n_v):
        some = some or g[i] != 0.0
        march.x[i] = w[i] - g[i]
        w[i] = 0.0
    if not some:
        _whole_wrenches(model, march)
        return True
    c_mass = _short(options)
    march.tally[FRESH] = 1
    if factor_at(t, march.y, march.la, c_mass, 0.0, c_mass * options[MASS], model, matrix, march) != 0:
        return False
    sparse_lu.solve(matrix, march.x)
    beta, gamma = options[BETA], options[GAMMA]
    for i in range(n_v):
        w[i] = c_mass * march.x[i]
        march.y[n_q + i] += h * w[i] * (1.0 - gamma / (2.0 * beta))
        march.v1[0, i] -= w[i] / (2.0 * beta)
        march.v1[1, i] -= options[SHARE] * w[i]
    for k in range(march.la.size):
        march.la[k] -= (options[SHARE] - 1.0) * c_mass * options[MASS] * march.x[n_v + k]
    # powers and wrenches of the velocities as they are now
    residual(t, march.y, march.v1[1], march.la, h, 1.0, model, march.r, march.powers[0])
    _whole_wrenches(model, march)
    return True


@indirect(void(MODEL, _MARCH))
def _whole_wrenches(model, march):
    """Wrenches of bodies, and the power that turns driven ones, with all of the forces that are means."""
    cylinders, bodies = model.flexible.cylinders, model.bodies
    for k in range(cylinders.size):
        if cylinders[k].law == contact.CONSERVATIVE:
            G, b = cylinders[k].F, cylinders[k].body
            if bodies[b].motion == rigid.DRIVEN:
                march.powers[0, eq.DRIVEN] -= cylinders[k].share * _driven(cylinders, bodies, k)
            for i in range(6):
                bodies[b].F[i] += (1.0 - cylinders[k].share) * G[i]


@inlined
def _driven(cylinders, bodies, k):
    """Power that turns a driven body against the contacts of cylinder k, W."""
    w, G = bodies[cylinders[k].body].w, cylinders[k].F
    return -(w[0] * G[3] + w[1] * G[4] + w[2] * G[5])


@indirect(_I(REAL, REAL, MODEL, SPARSE, VECTOR, _MARCH))
def anew(t, h, model, matrix, options, march):
    """Start anew just after time t, where loads or joints change at once; what a joint lets go is lost in it."""
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


@indirect(void(MODEL, _MARCH))
def _back(model, march):
    """Back to the start of a step that is given up."""
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
