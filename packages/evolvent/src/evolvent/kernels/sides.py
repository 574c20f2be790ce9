"""Sides: vectors of coordinates, or fixed to a body, that joints, joint coordinates and contacts couple.

A side is a vector u: a point or a direction, of coordinates, fixed to a body, or a combination of the slopes of a node
of 24-coordinate elements. Its columns J : (3, n) are du over the side's unknowns: 3 coordinates; 6 of a free body
(displacement, inertial axes, and rotation, body axes); 1 of a spinning body; none of a driven one; 9 of slopes.
"""

from numba import types, void

from evolvent.algebra.sparse import SPARSE, add_entry, first_entry
from evolvent.compiled.jit import MATRIX, REAL, VECTOR, indirect, inlined
from evolvent.kernels import rigid
from evolvent.kernels.rotations import cross, dot, turn, turn_back
from evolvent.model import MODEL

_I = types.int64
ON_BODY, ON_COORDINATES, ON_NODE, ON_NOTHING = 0, 1, 2, -1


@inlined
def side_vector(y, bodies, on, index, iq, iv, local, is_place):
    """Vector of a side and its rate, inertial axes: (x, y, z, vx, vy, vz)."""
    if on == ON_COORDINATES:
        return y[iq], y[iq + 1], y[iq + 2], y[iv], y[iv + 1], y[iv + 2]
    dx, dy, dz = turn(bodies[index].R, local[0], local[1], local[2])
    w = bodies[index].w
    vx, vy, vz = cross(w[0], w[1], w[2], dx, dy, dz)
    if not is_place:
        return dx, dy, dz, vx, vy, vz
    x, v = bodies[index].x, bodies[index].v
    return x[0] + dx, x[1] + dy, x[2] + dz, v[0] + vx, v[1] + vy, v[2] + vz


@inlined
def node_vector(y, iq, iv, local):
    """Combination of the slopes of a node, at iq and iv, with the factors `local`, and its rate, as `side_vector`."""
    a, b, c = local[0], local[1], local[2]
    return (
        a * y[iq] + b * y[iq + 3] + c * y[iq + 6],
        a * y[iq + 1] + b * y[iq + 4] + c * y[iq + 7],
        a * y[iq + 2] + b * y[iq + 5] + c * y[iq + 8],
        a * y[iv] + b * y[iv + 3] + c * y[iv + 6],
        a * y[iv + 1] + b * y[iv + 4] + c * y[iv + 7],
        a * y[iv + 2] + b * y[iv + 5] + c * y[iv + 8],
    )


@indirect(types.UniTuple(types.int64, 2)(MODEL, types.int64, types.int64, types.int64, VECTOR, types.boolean, MATRIX))
def side_columns(model, on, index, iv, local, is_place, J):
    """Write the columns J of a side; returns its first unknown and their number."""
    bodies, n_q = model.bodies, model.info.nq
    if on == ON_NODE:
        for r in range(3):
            for c in range(9):
                J[r, c] = local[c // 3] if r == c % 3 else 0.0
        return iv - n_q, 9
    for r in range(3):
        for c in range(6):
            J[r, c] = 0.0
    if on == ON_COORDINATES:
        for c in range(3):
            J[c, c] = 1.0
        return iv - n_q, 3
    if bodies[index].motion == rigid.DRIVEN:
        return 0, 0
    R = bodies[index].R
    at = bodies[index].iv - n_q
    if bodies[index].motion == rigid.SPIN:
        n = bodies[index].axis
        sx, sy, sz = cross(n[0], n[1], n[2], local[0], local[1], local[2])
        J[0, 0], J[1, 0], J[2, 0] = turn(R, sx, sy, sz)
        return at, 1
    if is_place:
        for c in range(3):
            J[c, c] = 1.0
    for c in range(3):  # R (e_c x local)
        ex, ey, ez = 1.0 * (c == 0), 1.0 * (c == 1), 1.0 * (c == 2)
        sx, sy, sz = cross(ex, ey, ez, local[0], local[1], local[2])
        J[0, 3 + c], J[1, 3 + c], J[2, 3 + c] = turn(R, sx, sy, sz)
    return at, 6


@inlined
def pull(F, bodies, n_q, on, index, iv, u, is_place, fx, fy, fz):
    """Add the generalised forces f . du of a side to the left of the equations."""
    if on == ON_COORDINATES:
        at = iv - n_q
        F[at] += fx
        F[at + 1] += fy
        F[at + 2] += fz
        return
    G = bodies[index].F
    if is_place:
        x = bodies[index].x
        rigid.add_wrench(G, u[0] - x[0], u[1] - x[1], u[2] - x[2], -fx, -fy, -fz)
    else:
        tx, ty, tz = cross(u[0], u[1], u[2], fx, fy, fz)
        G[3] -= tx
        G[4] -= ty
        G[5] -= tz


@inlined
def write_axial(K, one, along, n):
    """K[:3, :3] = one I + along n n^T."""
    for i in range(3):
        for j in range(3):
            K[i, j] = (one if i == j else 0.0) + along * n[i] * n[j]


@indirect(void(SPARSE, _I, _I, MATRIX, MATRIX, _I, _I, _I, _I, MATRIX, REAL))
def add_product(matrix, at, n, J, K, row, column, bt, m, L, scale):
    """Add scale J^T K[row : row + 3, column : column + 3] L; rows of unknowns at, at + 1 ..., columns bt, bt + 1 ..."""
    if n == 0 or m == 0:
        return
    to, right, down = first_entry(matrix, at, bt)
    if to < 0:
        return
    values = matrix.values
    for c in range(m):
        x, y, z = scale * L[0, c], scale * L[1, c], scale * L[2, c]
        kx = K[row, column] * x + K[row, column + 1] * y + K[row, column + 2] * z
        ky = K[row + 1, column] * x + K[row + 1, column + 1] * y + K[row + 1, column + 2] * z
        kz = K[row + 2, column] * x + K[row + 2, column + 1] * y + K[row + 2, column + 2] * z
        for r in range(n):
            values[to + r * down + c * right] += J[0, r] * kx + J[1, r] * ky + J[2, r] * kz


@indirect(void(SPARSE, MODEL, _I, VECTOR, REAL, REAL, REAL))
def add_turning(matrix, model, index, local, fx, fy, fz):
    """Add what a turn of a body changes in the generalised force of f . du, f fixed in inertial axes.

    Notes
    -----
    Of a free body d(local x R^T f) = local x (R^T f x dtheta).
    """
    bodies, n_q = model.bodies, model.info.nq
    motion = bodies[index].motion
    if motion == rigid.DRIVEN:
        return
    R = bodies[index].R
    gx, gy, gz = turn_back(R, fx, fy, fz)
    at = bodies[index].iv - n_q
    if motion == rigid.SPIN:
        n = bodies[index].axis
        sx, sy, sz = cross(n[0], n[1], n[2], local[0], local[1], local[2])
        sx, sy, sz = cross(n[0], n[1], n[2], sx, sy, sz)
        add_entry(matrix, at, at, gx * sx + gy * sy + gz * sz)
        return
    to, right, down = first_entry(matrix, at + 3, at + 3)
    values = matrix.values
    for c in range(3):
        ex, ey, ez = 1.0 * (c == 0), 1.0 * (c == 1), 1.0 * (c == 2)
        hx, hy, hz = cross(gx, gy, gz, ex, ey, ez)
        tx, ty, tz = cross(local[0], local[1], local[2], hx, hy, hz)
        values[to + c * right] += tx
        values[to + down + c * right] += ty
        values[to + 2 * down + c * right] += tz


@inlined
def body_columns(model, index, local, is_place, J):
    """`side_columns` of a body."""
    return side_columns(model, ON_BODY, index, -1, local, is_place, J)


@inlined
def turn_axis(bodies, index, motion, c):
    """Axis (body axes) about which column c of a body turns it; zero where it moves it."""
    n = bodies[index].axis
    if motion == rigid.SPIN:
        return n[0], n[1], n[2]
    return 1.0 * (c == 3), 1.0 * (c == 4), 1.0 * (c == 5)


@inlined
def turn_columns(model, index, J):
    """Write the inertial axes about which unknowns turn a body as columns J : (3, 3); their first and number."""
    body = model.bodies[index]
    count = 0 if body.motion == rigid.DRIVEN else 1 if body.motion == rigid.SPIN else 3
    for c in range(count):
        x, y, z = turn_axis(model.bodies, index, body.motion, c + 3)
        J[0, c], J[1, c], J[2, c] = turn(body.R, x, y, z)
    return body.iv - model.info.nq + (3 if count == 3 else 0), count


@inlined
def add_torque_tangent(matrix, model, a, b, n, torque, slope, turned):
    """Derivatives of a torque T about the axis n of body a, T n on a and -T n on b, by the turns of both.

    Parameters
    ----------
    n : axis, inertial; torque : T, N m
    slope, turned : with turns t_a and t_b, T changes by (t_b - t_a) . (slope n - turned)
    """
    J, K = model.J[0], model.J[1]
    for side in range(2):
        at, rows = turn_columns(model, b if side else a, J)
        for other in range(2):
            to, columns = turn_columns(model, b if other else a, K)
            for r in range(rows):
                p, own = (J[0, r], J[1, r], J[2, r]), 1.0 if side else -1.0
                for c in range(columns):
                    e, sign = (K[0, c], K[1, c], K[2, c]), 1.0 if other else -1.0
                    value = own * (slope * dot(e, n) - dot(e, turned)) * dot(p, n)
                    if side:
                        value -= torque * dot(p, cross(e[0], e[1], e[2], n[0], n[1], n[2]))
                    add_entry(matrix, at + r, to + c, sign * value)


@indirect(void(SPARSE, MODEL, _I, MATRIX, MATRIX, types.UniTuple(REAL, 3), _I, REAL))
def add_relative(matrix, model, index, J, K, f, row, share):
    """Couple a vector of coordinates at `row` with a body on whose axes alone the force f on its vector depends.

    Parameters
    ----------
    J : columns of the vector u, fixed to the body for the moment (`body_columns`)
    K : (3, 3) float, derivative of f, the force on the left of the equations, by u, inertial axes
    f : 3 floats, inertial axes
    share : float, of u in the vector of coordinates

    Notes
    -----
    A turn t of the body changes f by t x f - K (t x u). -f acts on the body at u: -(local x R^T f), which
    a displacement du changes by R^T f x R^T du - local x R^T K du; local is u as seen from the body.
    """
    bodies, n_q = model.bodies, model.info.nq
    motion, R = bodies[index].motion, bodies[index].R
    at = bodies[index].iv - n_q
    size = 1 if motion == rigid.SPIN else 6
    fx, fy, fz = turn_back(R, f[0], f[1], f[2])
    values = matrix.values
    to, right, down = first_entry(matrix, row, at)
    of, along, below = first_entry(matrix, at, row)
    if to < 0 or of < 0:
        return
    for c in range(size):
        nx, ny, nz = turn_axis(bodies, index, motion, c)
        tx, ty, tz = turn(R, nx, ny, nz)
        cx, cy, cz = cross(tx, ty, tz, f[0], f[1], f[2])
        x = (cx, cy, cz)
        for i in range(3):
            value = x[i]
            for j in range(3):
                value -= K[i, j] * J[j, c]
            values[to + i * down + c * right] += share * value
        gx, gy, gz = cross(nx, ny, nz, fx, fy, fz)
        gx, gy, gz = turn(R, gx, gy, gz)
        g = (gx, gy, gz)
        for j in range(3):
            value = g[j]
            for i in range(3):
                value -= J[i, c] * K[i, j]
            values[of + c * below + j * along] += share * value


@indirect(void(SPARSE, MODEL, _I, types.boolean, MATRIX, MATRIX, types.UniTuple(REAL, 3)))
def add_relative_body(matrix, model, index, is_place, J, K, f):
    """The body's own part of `add_relative`."""
    bodies, n_q = model.bodies, model.info.nq
    motion, R = bodies[index].motion, bodies[index].R
    at = bodies[index].iv - n_q
    size = 1 if motion == rigid.SPIN else 6
    fx, fy, fz = turn_back(R, f[0], f[1], f[2])
    values = matrix.values
    to, right, down = first_entry(matrix, at, at)
    for c in range(size):
        nx, ny, nz = turn_axis(bodies, index, motion, c)
        tx, ty, tz = turn(R, nx, ny, nz)
        cx, cy, cz = cross(tx, ty, tz, f[0], f[1], f[2])
        dx, dy, dz = turn_back(R, -J[0, c], -J[1, c], -J[2, c])
        gx, gy, gz = cross(fx, fy, fz, dx, dy, dz)
        for r in range(size):
            value = 0.0
            for i in range(3):
                for j in range(3):
                    value += J[i, r] * K[i, j] * J[j, c]
            ax, ay, az = turn_axis(bodies, index, motion, r)
            value += ax * gx + ay * gy + az * gz
            if is_place and motion == rigid.FREE and r < 3:
                value -= cx if r == 0 else (cy if r == 1 else cz)
            values[to + r * down + c * right] += value
