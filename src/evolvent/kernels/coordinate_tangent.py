"""Tangents of the torques of joints' coordinates: of angles, of travels, and of cables between coordinates."""

from numba import types, void

from evolvent.compiled.jit import MATRIX, REAL, VECTOR, indirect, inlined
from evolvent.kernels import rigid
from evolvent.kernels.axial import TRAVEL, angle_of, gradients, place_on_body, second_derivative, second_side
from evolvent.kernels.coordinate_laws import measure_motor_slopes
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
from evolvent.kernels.sparse import SPARSE, add_block, first_entry
from evolvent.model import MODEL

_I = types.int64


@indirect(void(VECTOR, REAL, MODEL, SPARSE))
def add_coordinate_tangents(y, c_rate, model, matrix):
    """Tangents of all joint coordinates, at the angles of the last forces.

    Notes
    -----
    With f = torque g: df = (stiffness + c_rate damping) g g^T + damping g (H r)^T + torque H, H = d2(angle)/du2, and r
    is the rate of u as seen from the body.
    """
    bodies, n_q = model.bodies, model.info.nq
    coordinates = model.coordinates
    K = model.K12
    if model.motors.size > 0:
        measure_motor_slopes(model)
    if model.synchronizations.size > 0:
        add_synchronization_tangents(c_rate, model, matrix)
    for k in range(coordinates.size):
        torque, damping = (
            coordinates[k].torque + coordinates[k].applied,
            coordinates[k].damper + coordinates[k].motor_damper,
        )
        slope = coordinates[k].slope + coordinates[k].motor_slope + c_rate * damping
        if coordinates[k].kind == TRAVEL:
            add_travel_tangent(k, slope, model, matrix)
            continue
        u = second_side(y, coordinates, bodies, k)
        a, b, p, q, g = angle_of(coordinates, bodies, k, u)
        for j in range(3):
            for i in range(3):
                K[3 + i, 3 + j] = second_derivative(a, b, p, q, i, j)
        if coordinates[k].on == ON_BODY:
            _add_between_bodies(model, k, (u[0], u[1], u[2]), g, torque, slope, damping, K, matrix)
            continue
        w = bodies[coordinates[k].body].w
        rx, ry, rz = cross(w[0], w[1], w[2], u[0], u[1], u[2])
        r = (u[3] - rx, u[4] - ry, u[5] - rz)
        for j in range(3):
            turned = 0.0
            for i in range(3):
                turned += K[3 + i, 3 + j] * r[i]
            for i in range(3):
                K[i, j] = slope * g[i] * g[j] + torque * K[3 + i, 3 + j] + damping * g[i] * turned
        at = coordinates[k].iv - n_q
        add_block(matrix, at, at, K, 0, 0, 3, 3, 1.0)
        body = coordinates[k].body
        if bodies[body].motion != rigid.DRIVEN:
            local = model.e[2]
            local[0], local[1], local[2] = turn_back(bodies[body].R, u[0], u[1], u[2])
            body_columns(model, body, local, False, model.J[1])
            f = (torque * g[0], torque * g[1], torque * g[2])
            add_relative(matrix, model, body, model.J[1], K, f, at, 1.0)
            add_relative_body(matrix, model, body, False, model.J[1], K, f)


@inlined
def _add_between_bodies(model, k, u, g, torque, slope, damping, K, matrix):
    """Tangent of joint coordinate k between two bodies; K[3:6, 3:6] = H.

    Notes
    -----
    A turn z of the second body as seen from the first (inertial axes) changes u by z x u, and t = u x g by T z beside
    what turns with the first body; the torque by s . z, s = slope t + damping (T^T r + w_b x t), r = w_b - w_a. The
    torques on the axes of the bodies then change by A z of the first, A = t s^T + torque T, and by
    (A + torque [t]x) z of the second one, with opposite signs.
    """
    bodies, coordinates = model.bodies, model.coordinates
    a, b = coordinates[k].body, coordinates[k].other
    t = cross(u[0], u[1], u[2], g[0], g[1], g[2])
    wb = bodies[b].w
    r = (wb[0] - bodies[a].w[0], wb[1] - bodies[a].w[1], wb[2] - bodies[a].w[2])
    c = cross(wb[0], wb[1], wb[2], t[0], t[1], t[2])
    for j in range(3):
        e = (1.0 * (j == 0), 1.0 * (j == 1), 1.0 * (j == 2))
        dx, dy, dz = cross(e[0], e[1], e[2], u[0], u[1], u[2])
        hx = K[3, 3] * dx + K[3, 4] * dy + K[3, 5] * dz
        hy = K[4, 3] * dx + K[4, 4] * dy + K[4, 5] * dz
        hz = K[5, 3] * dx + K[5, 4] * dy + K[5, 5] * dz
        one, two = cross(dx, dy, dz, g[0], g[1], g[2]), cross(u[0], u[1], u[2], hx, hy, hz)
        T = (one[0] + two[0], one[1] + two[1], one[2] + two[2])
        s = slope * t[j] + damping * (T[0] * r[0] + T[1] * r[1] + T[2] * r[2] + c[j])
        turned = cross(t[0], t[1], t[2], e[0], e[1], e[2])
        for i in range(3):
            K[i, j] = t[i] * s + torque * T[i]
            K[6 + i, j] = K[i, j] + torque * turned[i]
    _add_turns(matrix, model, a, a, K, 0, 1.0)
    _add_turns(matrix, model, a, b, K, 0, -1.0)
    _add_turns(matrix, model, b, a, K, 6, -1.0)
    _add_turns(matrix, model, b, b, K, 6, 1.0)


@indirect(void(SPARSE, MODEL, _I, _I, MATRIX, _I, REAL))
def _add_turns(matrix, model, i, j, K, first, scale):
    """Add scale K[first : first + 3, :3], torques on body i by turns of body j in inertial axes, to their unknowns."""
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
            values[to + m * down + c * right] += scale * value


@indirect(void(REAL, MODEL, SPARSE))
def add_synchronization_tangents(c_rate, model, matrix):
    """What cables couple between different coordinates; the rest is among the slopes of each."""
    coordinates, rows, J = model.coordinates, model.synchronizations, model.J
    for k in range(rows.size):
        factor = -rows[k].ratio_a * rows[k].ratio_b * (rows[k].stiffness + c_rate * rows[k].damping)
        a = gradients(model, coordinates, rows[k].a, J[0])
        b = gradients(model, coordinates, rows[k].b, J[1])
        for i in range(2):
            for j in range(2):
                _add_outer(matrix, a[2 * i], a[2 * i + 1], J[0], i, b[2 * j], b[2 * j + 1], J[1], j, factor)
                _add_outer(matrix, b[2 * j], b[2 * j + 1], J[1], j, a[2 * i], a[2 * i + 1], J[0], i, factor)


@indirect(void(SPARSE, _I, _I, MATRIX, _I, _I, _I, MATRIX, _I, REAL))
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


# ------------------------------------------------------------------------------------------------ travels


@indirect(void(_I, REAL, MODEL, SPARSE))
def add_travel_tangent(k, slope, model, matrix):
    """Tangent of travel k, whose force has the derivative `slope` by the travel; after the last forces.

    Notes
    -----
    As seen from the body, the force f on u depends on u alone. With columns Jb of u, and Ja of a point fixed to the
    body there, u moves by s = Jb db - Ja da as seen from it, and f by slope d d.s + w x f, w the turn of the body. On
    the body acts -(f, u x f): its axes turn with it, its arm by s.
    """
    coordinates = model.coordinates
    a, on, other, g = coordinates[k].body, coordinates[k].on, coordinates[k].other, coordinates[k].g
    d = (g[0], g[1], g[2])
    along = coordinates[k].torque + coordinates[k].applied
    force = (along * d[0], along * d[1], along * d[2])
    Ja, Jb, local = model.J[0], model.J[1], model.e[2]
    place_on_body(coordinates, model.bodies, k, local)
    at, na = side_columns(model, ON_BODY, a, -1, local, True, Ja)
    bt, nb = side_columns(model, on, other, coordinates[k].iv, coordinates[k].local, True, Jb)
    K = model.K12
    write_axial(K, 0.0, 1.0, d)
    add_product(matrix, bt, nb, Jb, K, 0, 0, bt, nb, Jb, slope)
    add_product(matrix, at, na, Ja, K, 0, 0, at, na, Ja, slope)
    add_product(matrix, bt, nb, Jb, K, 0, 0, at, na, Ja, -slope)
    add_product(matrix, at, na, Ja, K, 0, 0, bt, nb, Jb, -slope)
    if on == ON_BODY and nb > 0:
        add_turning(matrix, model, other, coordinates[k].local, force[0], force[1], force[2])
    if na > 0:
        _add_turns_of_body(matrix, model, a, at, na, Ja, bt, nb, Jb, force)


@inlined
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
