"""Tangents of what acts along a coordinate (`axial`): of its value, and of its rate."""

from numba import types, void

from evolvent.algebra.sparse import SPARSE, add_block, first_entry
from evolvent.compiled.jit import MATRIX, REAL, indirect, inlined
from evolvent.kernels import rigid
from evolvent.kernels.axial import TRAVEL, angle_of, gradients, place_on_body, rate_gradients, second_derivative
from evolvent.kernels.rotations import cross, turn, turn_back
from evolvent.kernels.sides import (
    ON_BODY,
    add_product,
    add_relative,
    add_relative_body,
    add_turning,
    body_columns,
    side_columns,
    turn_axis,
    write_axial,
)
from evolvent.model import MODEL, having

USED_FOR = ("coordinates", "gear_coordinates")
_TRAVELS = (having("coordinates", kind=TRAVEL), having("gear_coordinates", kind=TRAVEL))
#: Part of a torque, or of its derivative by the angle, below which an entry of their tangent is round-off.
ROUND_OFF = 1e-14

_I = types.int64
_U = types.UniTuple(types.float64, 3)


@inlined
def add_angle_tangent(model, rows, k, torque, slope, matrix):
    """Tangent of a torque about angle k whose derivative by the angle is `slope`, at the u of its last forces.

    Notes
    -----
    With the force f = torque g on u: df = slope g g^T + torque H, H = d2(angle)/du2.
    """
    bodies, K, u = model.bodies, model.K12, (rows[k].u[0], rows[k].u[1], rows[k].u[2])
    a, b, p, q, g = angle_of(rows, bodies, k, u)
    for j in range(3):
        for i in range(3):
            K[3 + i, 3 + j] = second_derivative(a, b, p, q, i, j)
    if rows[k].on == ON_BODY:
        _add_between_bodies(model, rows[k].body, rows[k].other, u, g, torque, slope, matrix)
        return
    for j in range(3):
        for i in range(3):
            K[i, j] = slope * g[i] * g[j] + torque * K[3 + i, 3 + j]
    at, body = rows[k].iv - model.info.nq, rows[k].body
    add_block(matrix, at, at, K, 0, 0, 3, 3, 1.0)
    if bodies[body].motion != rigid.DRIVEN:
        local = model.e[2]
        local[0], local[1], local[2] = turn_back(bodies[body].R, u[0], u[1], u[2])
        body_columns(model, body, local, False, model.J[1])
        f = (torque * g[0], torque * g[1], torque * g[2])
        add_relative(matrix, model, body, model.J[1], K, f, at, 1.0)
        add_relative_body(matrix, model, body, False, model.J[1], K, f)


@indirect(void(MODEL, _I, _I, _U, _U, REAL, REAL, SPARSE))
def _add_between_bodies(model, a, b, u, g, torque, slope, matrix):
    """Tangent of a torque about an angle of body b in the axes of body a; K12[3:6, 3:6] = H.

    Notes
    -----
    A turn z of b as seen from a (inertial axes) changes u by z x u, and t = u x g by T z beside what turns with a. The
    torques on the axes of the bodies then change by A z of a, A = slope t t^T + torque T, and by (A + torque [t]x) z of
    b, with opposite signs.
    """
    K = model.K12
    t = cross(u[0], u[1], u[2], g[0], g[1], g[2])
    for j in range(3):
        e = (1.0 * (j == 0), 1.0 * (j == 1), 1.0 * (j == 2))
        dx, dy, dz = cross(e[0], e[1], e[2], u[0], u[1], u[2])
        hx = K[3, 3] * dx + K[3, 4] * dy + K[3, 5] * dz
        hy = K[4, 3] * dx + K[4, 4] * dy + K[4, 5] * dz
        hz = K[5, 3] * dx + K[5, 4] * dy + K[5, 5] * dz
        one, two = cross(dx, dy, dz, g[0], g[1], g[2]), cross(u[0], u[1], u[2], hx, hy, hz)
        turned = cross(t[0], t[1], t[2], e[0], e[1], e[2])
        for i in range(3):
            K[i, j] = slope * t[i] * t[j] + torque * (one[i] + two[i])
            K[6 + i, j] = K[i, j] + torque * turned[i]
    least = ROUND_OFF * (abs(torque) + abs(slope))
    _add_turns(matrix, model, a, a, K, 0, 1.0, least)
    _add_turns(matrix, model, a, b, K, 0, -1.0, least)
    _add_turns(matrix, model, b, a, K, 6, -1.0, least)
    _add_turns(matrix, model, b, b, K, 6, 1.0, least)


@indirect(void(SPARSE, MODEL, _I, _I, MATRIX, _I, REAL, REAL))
def _add_turns(matrix, model, i, j, K, first, scale, least):
    """Add scale K[first : first + 3, :3], torques on body i by turns of body j in inertial axes, to their unknowns.

    Entries below `least` are round-off, and left out: of a body that nothing else holds they would be its pivot.
    """
    bodies, n_q = model.bodies, model.info.nq
    if bodies[i].motion == rigid.DRIVEN or bodies[j].motion == rigid.DRIVEN:
        return
    row = 3 if bodies[i].motion == rigid.FREE else 0
    column = 3 if bodies[j].motion == rigid.FREE else 0
    to, right, down = first_entry(matrix, bodies[i].iv - n_q + row, bodies[j].iv - n_q + column)
    if to < 0:
        return
    values = matrix.values
    for c in range(3 if column == 3 else 1):
        nx, ny, nz = turn_axis(bodies, j, bodies[j].motion, 3 + c)
        z = turn(bodies[j].R, nx, ny, nz)
        for m in range(3 if row == 3 else 1):
            nx, ny, nz = turn_axis(bodies, i, bodies[i].motion, 3 + m)
            x = turn(bodies[i].R, nx, ny, nz)
            value = 0.0
            for d in range(3):
                value += x[d] * (K[first + d, 0] * z[0] + K[first + d, 1] * z[1] + K[first + d, 2] * z[2])
            if abs(value) > least:
                values[to + m * down + c * right] += scale * value


@inlined
def add_travel_tangent(model, rows, k, along, slope, matrix):
    """Tangent of a force along travel k whose derivative by the travel is `slope`, at the u of its last forces.

    Notes
    -----
    As seen from the body, the force f on u depends on u alone. With columns Jb of u, and Ja of a point fixed to the
    body there, u moves by s = Jb db - Ja da as seen from it, and f by slope d d.s + w x f, w the turn of the body. On
    the body acts -(f, u x f): its axes turn with it, its arm by s.
    """
    a, on, other, d = rows[k].body, rows[k].on, rows[k].other, (rows[k].g[0], rows[k].g[1], rows[k].g[2])
    force = (along * d[0], along * d[1], along * d[2])
    Ja, Jb, local = model.J[0], model.J[1], model.e[2]
    place_on_body(rows, model.bodies, k, local)
    at, na = side_columns(model, ON_BODY, a, -1, local, True, Ja)
    bt, nb = side_columns(model, on, other, rows[k].iv, rows[k].local, True, Jb)
    K = model.K12
    write_axial(K, 0.0, 1.0, d)
    add_product(matrix, bt, nb, Jb, K, 0, 0, bt, nb, Jb, slope)
    add_product(matrix, at, na, Ja, K, 0, 0, at, na, Ja, slope)
    add_product(matrix, bt, nb, Jb, K, 0, 0, at, na, Ja, -slope)
    add_product(matrix, at, na, Ja, K, 0, 0, bt, nb, Jb, -slope)
    if on == ON_BODY and nb > 0:
        add_turning(matrix, model, other, rows[k].local, force[0], force[1], force[2])
    if na > 0:
        _add_turns_of_body(matrix, model, a, at, na, Ja, bt, nb, Jb, force)


@indirect(void(SPARSE, MODEL, _I, _I, _I, MATRIX, _I, _I, MATRIX, _U), used_for=_TRAVELS)
def _add_turns_of_body(matrix, model, a, at, na, Ja, bt, nb, Jb, force):
    """What a turn of the body changes in the force, and a move of the point as seen from it in the torque on it."""
    bodies, values, motion = model.bodies, matrix.values, model.bodies[a].motion
    R = bodies[a].R
    to, right, down = first_entry(matrix, bt, at)
    own, along, below = first_entry(matrix, at, at)
    of, beside, under = first_entry(matrix, at, bt)
    for c in range(na):
        nx, ny, nz = turn_axis(bodies, a, motion, c)
        tx, ty, tz = turn(R, nx, ny, nz)
        x, y, z = cross(tx, ty, tz, force[0], force[1], force[2])
        for r in range(nb if to >= 0 else 0):
            values[to + r * down + c * right] += Jb[0, r] * x + Jb[1, r] * y + Jb[2, r] * z
        if motion == rigid.FREE:
            values[own + c * along] -= x
            values[own + below + c * along] -= y
            values[own + 2 * below + c * along] -= z
        x, y, z = cross(Ja[0, c], Ja[1, c], Ja[2, c], force[0], force[1], force[2])
        for r in range(na):
            nx, ny, nz = turn_axis(bodies, a, motion, r)
            tx, ty, tz = turn(R, nx, ny, nz)
            values[own + r * below + c * along] += tx * x + ty * y + tz * z
    for c in range(nb if of >= 0 else 0):
        x, y, z = cross(Jb[0, c], Jb[1, c], Jb[2, c], force[0], force[1], force[2])
        for r in range(na):
            nx, ny, nz = turn_axis(bodies, a, motion, r)
            tx, ty, tz = turn(R, nx, ny, nz)
            values[of + r * under + c * beside] -= tx * x + ty * y + tz * z


# ------------------------------------------------------------------------------------------------ products of gradients


@inlined
def add_damping(y, model, rows, k, factor, matrix):
    """Add what a change of place alone changes in a torque about coordinate k: `factor` times its rate."""
    J, L = model.J[0], model.J[1]
    a = gradients(model, rows, k, J)
    b = rate_gradients(y, model, rows, k, L)
    add_outer(matrix, a, J, b, L, factor)


@inlined
def add_outer(matrix, a, J, b, L, factor):
    """Add factor J^T L of the gradients J and L of two coordinates, on the unknowns a and b (`axial.gradients`)."""
    for i in range(2):
        for j in range(2):
            _add_outer(matrix, a[2 * i], a[2 * i + 1], J, i, b[2 * j], b[2 * j + 1], L, j, factor)


@indirect(void(SPARSE, _I, _I, MATRIX, _I, _I, _I, MATRIX, _I, REAL), used_for="coordinates")
def _add_outer(matrix, at, n, J, i, bt, m, L, j, factor):
    """Add factor J[i]^T L[j]; rows of unknowns at, at + 1 ..., columns bt, bt + 1 ..."""
    if n == 0 or m == 0:
        return
    to, right, down = first_entry(matrix, at, bt)
    if to < 0:
        return
    for c in range(m):
        for r in range(n):
            matrix.values[to + r * down + c * right] += factor * J[i, r] * L[j, c]
