"""The equations of motion as implicit solvers need them: M a + F(t, y, la) = 0 with constraints, and their tangent.

Unknowns are the velocities in the order of the state, then one multiplier for each row of constraint. A penalty
is a constraint with a compliance, gap + (damping rate - la)/stiffness = 0.
"""

import math

from numba import types, void

from evolvent.algebra import sparse
from evolvent.algebra.sparse import SPARSE
from evolvent.compiled.jit import MATRIX, REAL, VECTOR, indirect, inlined, kernel
from evolvent.kernels import ancf_beams, constraints, points, rigid
from evolvent.kernels.blocks import POSITION, ROTATION, SLOPE
from evolvent.kernels.calls import energy_at, force_at, momentum_at, tangent_at, ties_at
from evolvent.kernels.rotations import cross, turn_back
from evolvent.model import MODEL
from evolvent.model.interval import state_interval
from evolvent.model.powers import N_POWERS


@indirect(void(REAL, VECTOR, VECTOR, VECTOR, REAL, REAL, MODEL, VECTOR, VECTOR))
def residual(t, y, a, la, step, factor, model, r, powers):
    """r = M a + F and the constraints' gaps, in the order of the unknowns.

    Parameters
    ----------
    y : (ny,) float, state; a : (nv,) float, accelerations; la : (nj,) float, multipliers
    step : float, s, of the step that ends here, 0 for none
    factor : float, of all loads on beams and of gravity
    r : (nu,) float, output; the multipliers' are the last
    powers : (N_POWERS,) float, output
    """
    F, P, weight = model.F, model.P, model.G
    for i in range(model.info.nv):
        F[i] = 0.0
        P[i] = factor * weight[i]
    for i in range(N_POWERS):
        powers[i] = 0.0
    rigid.kinematics(t, y, model)
    points.clear_forces(model.points)
    at = model.interval
    at.t, at.tm, at.h, at.rub, at.factor, at.over, at.inertia = t, t, 0.0, step, factor, 1.0, 1.0
    at.span, at.chi, at.chi_v, at.ratio, at.soft = 0.0, 0.0, 0.0, 0.0, 1.0
    interval, calls = state_interval(at, y, a, la, r, powers, model.switches, r), model.force_calls
    for k in range(calls.size):
        force_at(model, calls[k])(interval, model)
    calls = model.inertia_force_calls
    for k in range(calls.size):
        force_at(model, calls[k])(interval, model)
    for i in range(model.info.nv):
        r[i] = F[i] - P[i]


@indirect(void(REAL, VECTOR, MATRIX, MATRIX, MODEL, MATRIX, VECTOR))
def residuals(t, y, a, la, model, r, powers):
    """`residual` of one state without loads and gravity, by several accelerations and multipliers: a row of r each."""
    for k in range(r.shape[0]):
        residual(t, y, a[k], la[k], 0.0, 0.0, model, r[k], powers)


@indirect(void(REAL, VECTOR, MODEL))
def measure_constraints(t, y, model):
    """Gap and rate of every constraint that holds at time t and is no penalty."""
    rigid.kinematics(t, y, model)
    for k in range(model.constraints.size):
        if model.constraints[k].stiffness <= 0.0 and constraints.holds(t, model.constraints, k):
            constraints.measure(constraints.STATE, t, y, k, model)


@indirect(void(VECTOR, types.int64, MODEL, VECTOR))
def add_weight(gravity, n_q, model, P):
    """Weight of everything that moves into the loads P."""
    if model.elements.size > 0:
        ancf_beams.add_gravity(gravity, model, P)
    points.add_point_weight(gravity, n_q, model.points, P)
    rigid.add_body_weight(gravity, n_q, model.bodies, P)


@indirect(void(REAL, VECTOR, VECTOR, REAL, REAL, REAL, MODEL, SPARSE))
def tangent(t, y, la, c_mass, c_rate, scale, model, matrix):
    """matrix = c_mass M + c_rate dF/dv + dF/dq, and `scale` times the constraints; after `residual` only.

    It is the exact derivative along the increments of the state (`blocks.displace`). Left out is what only slows
    Newton's method: how the direction of friction of beams follows that of the normal (beside the bristle's stiffness:
    slip by radius); how the rate at which a cord winds onto a drum changes, where a penalty has a damper; what the rate
    of a free spool changes in fields on wound thread that depend on velocity; and in a step, that turns within it do
    not commute (half the angle turned in it).
    """
    sparse.clear(matrix)
    at = model.interval
    at.t, at.tm, at.h, at.c_mass, at.c_rate, at.scale = t, t, 0.0, c_mass, c_rate, scale
    at.span, at.chi, at.chi_v, at.ratio, at.soft = 0.0, 0.0, 0.0, 0.0, 1.0
    interval, calls = state_interval(at, y, y, la, la, la, model.switches, y), model.tangent_calls
    for k in range(calls.size):
        tangent_at(model, calls[k])(interval, model, matrix)
    calls = model.inertia_tangent_calls
    for k in range(calls.size):
        tangent_at(model, calls[k])(interval, model, matrix)


@indirect(void(REAL, VECTOR, MODEL, VECTOR))
def energies(t, y, model, out):
    """out : (3,) = kinetic and elastic energy of everything, and the part of bending in beams and rods, J.

    Contacts, joint coordinates and penalties are those of the last `residual`.
    """
    for i in range(3):
        out[i] = 0.0
    at = model.interval
    at.t, at.tm, at.h, at.span = t, t, 0.0, 0.0
    interval, calls = state_interval(at, y, y, y, y, y, model.switches, y), model.energy_calls
    for k in range(calls.size):
        energy_at(model, calls[k])(interval, model, out)


@indirect(void(VECTOR, MODEL, VECTOR))
def momenta(y, model, out):
    """out : (6,) = linear momentum (kg m/s) and angular momentum about the inertial origin (kg m2/s)."""
    for i in range(6):
        out[i] = 0.0
    calls = model.momentum_calls
    for k in range(calls.size):
        momentum_at(model, calls[k])(y, model, out)


@kernel
def is_isolated(t, model):
    """Whether nothing but gravity and loads on beams acts from outside, whose torque is known (`assembly.ends`)."""
    calls, tied = model.coupling_ties_calls, model.info.outside != 0 or model.info.open != 0
    for k in range(calls.size):
        tied = tied or ties_at(model, calls[k])(t, model) != 0
    return not tied


@kernel
def load_torque(y, P, model):
    """Torque of the loads P about the inertial origin, N m: (x, y, z)."""
    blocks, n_q = model.blocks, model.info.nq
    tx = ty = tz = 0.0
    for k in range(blocks.size):
        if blocks[k].kind == POSITION or blocks[k].kind == SLOPE:
            q, p = blocks[k].iq, blocks[k].iv - n_q
            x, yy, z = cross(y[q], y[q + 1], y[q + 2], P[p], P[p + 1], P[p + 2])
            tx, ty, tz = tx + x, ty + yy, tz + z
    return tx, ty, tz


@indirect(void(VECTOR, REAL, REAL, REAL, REAL, REAL, REAL, MODEL, VECTOR))
def add_rigid_motion(y, wx, wy, wz, cx, cy, cz, model, out):
    """Add to the velocities in `out` those of a turn at (wx, wy, wz) about the point (cx, cy, cz), rad/s and m."""
    blocks = model.blocks
    for k in range(blocks.size):
        kind, q, p = blocks[k].kind, blocks[k].iq, blocks[k].iv
        if kind == POSITION:
            x, yy, z = cross(wx, wy, wz, y[q] - cx, y[q + 1] - cy, y[q + 2] - cz)
        elif kind == SLOPE:
            x, yy, z = cross(wx, wy, wz, y[q], y[q + 1], y[q + 2])
        elif kind == ROTATION:
            x, yy, z = turn_back(model.bodies[blocks[k].owner].R, wx, wy, wz)
        else:
            continue
        out[p] += x
        out[p + 1] += yy
        out[p + 2] += z


@indirect(void(REAL, REAL, VECTOR, VECTOR, MODEL, VECTOR, VECTOR))
def keep_momentum(t, h, y, P, model, spare, kept):
    """Give an isolated system at the end of a step the angular momentum that its loads have left it.

    Parameters
    ----------
    h : float, s, length of the step; 0 only notes the momentum of the state
    spare : (ny,) float, scratch
    kept : (12,) float, angular momentum and torque of the loads of the step's start, then of its end

    Notes
    -----
    Generalized-alpha keeps linear momentum to round-off, but angular momentum only to the second order of the step. The
    rest is taken back by a turn of the whole about its centre of mass, I w = H0 + h (T0 + T1)/2 - H1, which no joint or
    contact between its parts feels, and which is of third order in a step. Not where something is held from outside.
    """
    n_q, n_v = model.info.nq, model.info.nv
    if not is_isolated(t, model):
        kept[0] = math.nan
        return
    m = kept[6:12]
    momenta(y, model, m)
    T = load_torque(y, P, model)
    if h > 0.0 and math.isfinite(kept[0]):
        ex = kept[0] + 0.5 * h * (kept[3] + T[0]) - m[3]
        ey = kept[1] + 0.5 * h * (kept[4] + T[1]) - m[4]
        ez = kept[2] + 0.5 * h * (kept[5] + T[2]) - m[5]
        for i in range(y.size):
            spare[i] = y[i]
        c = (0.0, 0.0, 0.0)
        I = model.scratch  # noqa: E741
        for k in range(6):
            wx, wy, wz = 1.0 * (k % 3 == 0), 1.0 * (k % 3 == 1), 1.0 * (k % 3 == 2)
            for i in range(n_v):
                spare[n_q + i] = 0.0
            add_rigid_motion(y, wx, wy, wz, c[0], c[1], c[2], model, spare)
            momenta(spare, model, m)
            if k < 3:  # m[:3] = mass (w x centre)
                I[k, 0], I[k, 1], I[k, 2] = m[0], m[1], m[2]
                if k == 2:
                    mass = total_mass(model)
                    c = (I[2, 1] / mass, I[0, 2] / mass, I[1, 0] / mass)
            else:
                I[0, k - 3], I[1, k - 3], I[2, k - 3] = m[3], m[4], m[5]
        trace, far = I[0, 0] + I[1, 1] + I[2, 2], mass * (c[0] * c[0] + c[1] * c[1] + c[2] * c[2])
        if determinant(I) < 3e-4 * trace * trace * trace:  # a slender thing is not to spin about its own axis
            for i in range(3):
                I[i, i] += 0.02 * trace
        ax, ay, az = cross(I[0, 1], I[1, 1], I[2, 1], I[0, 2], I[1, 2], I[2, 2])
        bx, by, bz = cross(I[0, 2], I[1, 2], I[2, 2], I[0, 0], I[1, 0], I[2, 0])
        gx, gy, gz = cross(I[0, 0], I[1, 0], I[2, 0], I[0, 1], I[1, 1], I[2, 1])
        det = I[0, 0] * ax + I[1, 0] * ay + I[2, 0] * az
        if det > 0.0 and trace > 1e-13 * far:  # below that, of a single point, I is round-off
            wx = (ax * ex + ay * ey + az * ez) / det
            wy = (bx * ex + by * ey + bz * ez) / det
            wz = (gx * ex + gy * ey + gz * ez) / det
            add_rigid_motion(y, wx, wy, wz, c[0], c[1], c[2], model, y)
            momenta(y, model, m)
    for i in range(3):
        kept[i], kept[3 + i] = m[3 + i], T[i]


@inlined
def determinant(I):  # noqa: E741
    """Of a (3, 3) matrix."""
    x, y, z = cross(I[0, 1], I[1, 1], I[2, 1], I[0, 2], I[1, 2], I[2, 2])
    return I[0, 0] * x + I[1, 0] * y + I[2, 0] * z


@inlined
def total_mass(model):
    """Mass of all that moves freely, kg."""
    total = 0.0
    for k in range(model.elements.size):
        half = ancf_beams.NODE_VECTORS[model.beams[model.elements[k].beam].kind]
        M = model.M[model.elements[k].mass]
        total += M[0, 0] + 2.0 * M[0, half] + M[half, half]
    for i in range(model.points.size):
        total += model.points[i].mass
    for b in range(model.bodies.size):
        if model.bodies[b].motion == rigid.FREE:
            total += model.bodies[b].mass
    return total
