"""What couples vectors of coordinates and of bodies: joints (constraints and penalties), hinges with spring and latch.

A side of a coupling is a vector u: a place or a direction, of coordinates or fixed to a body. Its columns J : (3, n)
are du over the side's unknowns: 3 coordinates; 6 of a free body (displacement, inertial axes, and rotation, body axes);
1 of a spinning body; none of a driven one.
"""

import math

from numba import types, void

from evolvent.jit import MATRIX, REAL, VECTOR, entry, indirect, inlined, kernel
from evolvent.kernels import rigid
from evolvent.kernels.cord import drum_cord
from evolvent.kernels.feed import feed
from evolvent.kernels.rotations import cross, turn, turn_back
from evolvent.kernels.sparse import SPARSE, add_block, add_entry, first_entry
from evolvent.model import MODEL, family_type

_I = types.int64
# kinds of joints: places coincide along a direction; directions keep their product; places keep their distance;
# a spinning body keeps to an angle; a cord winds onto a drum of side a
PLACE, DIRECTION, DISTANCE, ANGLE, CORD = 0, 1, 2, 3, 4
ON_BODY, ON_COORDINATES = 0, 1
# how a feed moves a joint: not; along its direction; round an involute
STILL, LINEAR, INVOLUTE = 0, 1, 2


# ---------------------------------------------------------------------------------------------- sides


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


@indirect(types.UniTuple(types.int64, 2)(MODEL, types.int64, types.int64, types.int64, VECTOR, types.boolean, MATRIX))
def side_columns(model, on, index, iv, local, is_place, J):
    """Write the columns J of a side; returns its first unknown and their number."""
    bodies, n_q = model.bodies, model.info.nq
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


# ---------------------------------------------------------------------------------------------- entries


@indirect(void(SPARSE, _I, _I, MATRIX, REAL, REAL, REAL, REAL, REAL, REAL, _I, _I, MATRIX, REAL))
def add_product(matrix, at, n, J, Kxx, Kxy, Kxz, Kyy, Kyz, Kzz, bt, m, L, scale):
    """Add scale J^T K L, K symmetric; rows of unknowns at, at + 1 ..., columns of unknowns bt, bt + 1 ..."""
    if n == 0 or m == 0:
        return
    to, right, down = first_entry(matrix, at, bt)
    if to < 0:
        return
    values = matrix.values
    for c in range(m):
        x, y, z = scale * L[0, c], scale * L[1, c], scale * L[2, c]
        kx, ky, kz = Kxx * x + Kxy * y + Kxz * z, Kxy * x + Kyy * y + Kyz * z, Kxz * x + Kyz * y + Kzz * z
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


# ---------------------------------------------------------------------------------------------- joints


@entry(REAL, family_type("joints"), types.int64)
@inlined
def holds(t, joints, k):
    """Whether joint k holds at time t."""
    return t <= joints[k].until


@indirect(void(REAL, VECTOR, types.int64, MODEL))
def joint_geometry(t, y, k, model):
    """Fill the vectors u, gradients g, gap and rate of joint k at time t.

    Notes
    -----
    PLACE: along . (u_b - u_a) - value - path; DIRECTION: u_a . u_b - value; DISTANCE: |u_b - u_a| - value; ANGLE: the
    body's angle less value and path. The path is radius phi of a feed, or for an INVOLUTE the place of the end of a
    taut thread of length `value` that has been wound by phi onto a circle, from the direction `zero` on.
    """
    joints, bodies, parameters = model.flexible.joints, model.bodies, model.parameters
    kind = joints[k].kind
    u, g = joints[k].u, joints[k].g
    phi, phi_rate = 0.0, 0.0
    if joints[k].path != STILL:
        p = parameters[joints[k].first : joints[k].last]
        phi, phi_rate, _ = feed(joints[k].feed, p, joints[k].law, t)
    if kind == ANGLE:
        iq, iv = joints[k].iq[1], joints[k].iv[1]
        joints[k].gap = y[iq] - joints[k].value - phi
        joints[k].rate = y[iv] - phi_rate
        return
    if kind == CORD:
        _cord_geometry(y, k, model)
        return
    is_place = kind != DIRECTION
    a = side_vector(
        y, bodies, joints[k].on[0], joints[k].index[0], joints[k].iq[0], joints[k].iv[0], joints[k].local[0], is_place
    )
    b = side_vector(
        y, bodies, joints[k].on[1], joints[k].index[1], joints[k].iq[1], joints[k].iv[1], joints[k].local[1], is_place
    )
    for c in range(3):
        u[0, c], u[1, c] = a[c], b[c]
    if kind == DIRECTION:
        joints[k].gap = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] - joints[k].value
        joints[k].rate = a[0] * b[3] + a[1] * b[4] + a[2] * b[5] + a[3] * b[0] + a[4] * b[1] + a[5] * b[2]
        for c in range(3):
            g[0, c], g[1, c] = b[c], a[c]
        return
    dx, dy, dz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = b[3] - a[3], b[4] - a[4], b[5] - a[5]
    if kind == DISTANCE:
        distance = math.sqrt(dx * dx + dy * dy + dz * dz)
        nx, ny, nz = dx / distance, dy / distance, dz / distance
        joints[k].gap = distance - joints[k].value
        joints[k].rate = nx * vx + ny * vy + nz * vz
    else:
        nx, ny, nz = joints[k].along[0], joints[k].along[1], joints[k].along[2]
        gap, rate = nx * dx + ny * dy + nz * dz, nx * vx + ny * vy + nz * vz
        if joints[k].path == INVOLUTE:
            z, e, c, r = joints[k].axis, joints[k].zero, joints[k].centre, joints[k].radius
            fx, fy, fz = cross(z[0], z[1], z[2], e[0], e[1], e[2])
            s, o = math.sin(phi), math.cos(phi)
            tail = joints[k].value - r * phi
            along_e, along_f = r * o - tail * s, r * s + tail * o  # r n + tail n', n = (cos, sin)
            gap -= nx * (c[0] + along_e * e[0] + along_f * fx)
            gap -= ny * (c[1] + along_e * e[1] + along_f * fy)
            gap -= nz * (c[2] + along_e * e[2] + along_f * fz)
            # d/dphi (r n + tail n') = -tail n
            rate += tail * phi_rate * (nx * (o * e[0] + s * fx) + ny * (o * e[1] + s * fy) + nz * (o * e[2] + s * fz))
        else:
            gap -= joints[k].value + joints[k].radius * phi
            rate -= joints[k].radius * phi_rate
        joints[k].gap = gap
        joints[k].rate = rate
    g[0, 0], g[0, 1], g[0, 2] = -nx, -ny, -nz
    g[1, 0], g[1, 1], g[1, 2] = nx, ny, nz


@indirect(void(VECTOR, _I, MODEL))
def _cord_geometry(y, k, model):
    """As `joint_geometry`, of a CORD: the whole length less `value`, gradients along the free part.

    Notes
    -----
    The force on the drum acts where the cord leaves it, which is entered as the place of side a.
    """
    joints, bodies = model.flexible.joints, model.bodies
    body, radius, centre, n0, z0 = (
        joints[k].index[0],
        joints[k].radius,
        joints[k].centre,
        joints[k].axis,
        joints[k].zero,
    )
    a = side_vector(y, bodies, ON_BODY, body, -1, -1, centre, True)
    b = side_vector(
        y, bodies, joints[k].on[1], joints[k].index[1], joints[k].iq[1], joints[k].iv[1], joints[k].local[1], True
    )
    R, w, u, g = bodies[body].R, bodies[body].w, joints[k].u, joints[k].g
    n, z = turn(R, n0[0], n0[1], n0[2]), turn(R, z0[0], z0[1], z0[2])
    d, v = (b[0] - a[0], b[1] - a[1], b[2] - a[2]), (b[3] - a[3], b[4] - a[4], b[5] - a[5])
    omega = w[0] * n[0] + w[1] * n[1] + w[2] * n[2]
    length, rate, _, ex, ey, ez, rx, ry, rz, _ = drum_cord(
        radius, joints[k].along[0], joints[k].value, d, v, n, z, omega
    )
    joints[k].gap = length - joints[k].value
    joints[k].rate = rate
    lx, ly, lz = turn_back(R, radius * rx, radius * ry, radius * rz)
    local = joints[k].local[0]
    local[0], local[1], local[2] = centre[0] + lx, centre[1] + ly, centre[2] + lz
    u[0, 0], u[0, 1], u[0, 2] = a[0] + radius * rx, a[1] + radius * ry, a[2] + radius * rz
    u[1, 0], u[1, 1], u[1, 2] = b[0], b[1], b[2]
    g[0, 0], g[0, 1], g[0, 2] = -ex, -ey, -ez
    g[1, 0], g[1, 1], g[1, 2] = ex, ey, ez


@indirect(REAL(types.int64, REAL, MODEL, VECTOR))
def add_joint_force(k, la, model, F):
    """Generalised forces la g of joint k; its geometry is that of the last `joint_geometry`."""
    joints, bodies, n_q = model.flexible.joints, model.bodies, model.info.nq
    if joints[k].kind == ANGLE:
        F[joints[k].iv[1] - n_q] += la
        index = joints[k].index[1]
        n = bodies[index].axis
        nx, ny, nz = turn(bodies[index].R, n[0], n[1], n[2])
        return nx * la  # the body itself bears it; what drives it is outside
    is_place = joints[k].kind != DIRECTION
    for side in range(2):
        g = joints[k].g[side]
        pull(
            F, bodies, n_q, joints[k].on[side], joints[k].index[side], joints[k].iv[side], joints[k].u[side], is_place,
            la * g[0], la * g[1], la * g[2],
        )  # fmt: skip
    return 0.0


@kernel
def _add_gradient(matrix, row, at, n, g, J, scale, damped):
    """Add scale J^T g as column `row`, and as row `row` times `damped`; of n unknowns from `at` on."""
    if n == 0:
        return
    values = matrix.values
    to, right, _ = first_entry(matrix, row, at)
    of, _, down = first_entry(matrix, at, row)
    if to < 0 or of < 0:
        return
    for c in range(n):
        value = scale * (g[0] * J[0, c] + g[1] * J[1, c] + g[2] * J[2, c])
        values[to + c * right] += value * damped
        values[of + c * down] += value


@indirect(void(types.int64, REAL, types.int64, REAL, REAL, MODEL, SPARSE))
def add_joint_tangent(k, la, row, scale, damped, model, matrix):
    """Add joint k: gradient as row and column `row`, times `scale`, the row times `damped` as well, and la g'."""
    flexible, n_q = model.flexible, model.info.nq
    joints = flexible.joints
    kind = joints[k].kind
    if kind == ANGLE:
        at = joints[k].iv[1] - n_q
        add_entry(matrix, row, at, scale * damped)
        add_entry(matrix, at, row, scale)
        return
    is_place = kind != DIRECTION
    Ja, Jb = flexible.J[0], flexible.J[1]
    a, n = side_columns(model, joints[k].on[0], joints[k].index[0], joints[k].iv[0], joints[k].local[0], is_place, Ja)
    b, m = side_columns(model, joints[k].on[1], joints[k].index[1], joints[k].iv[1], joints[k].local[1], is_place, Jb)
    ga, gb = joints[k].g[0], joints[k].g[1]
    _add_gradient(matrix, row, a, n, ga, Ja, scale, damped)
    _add_gradient(matrix, row, b, m, gb, Jb, scale, damped)
    if la == 0.0:
        return
    for side in range(2):
        if joints[k].on[side] == ON_BODY:
            g = joints[k].g[side]
            add_turning(
                matrix, model, joints[k].index[side], joints[k].local[side],
                la * g[0], la * g[1], la * g[2],
            )  # fmt: skip
    if kind == DIRECTION:
        add_product(matrix, a, n, Ja, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0, b, m, Jb, la)
        add_product(matrix, b, m, Jb, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0, a, n, Ja, la)
    elif kind in (DISTANCE, CORD):
        x, y, z = gb[0], gb[1], gb[2]
        u = joints[k].u
        s = la / math.sqrt((u[1, 0] - u[0, 0]) ** 2 + (u[1, 1] - u[0, 1]) ** 2 + (u[1, 2] - u[0, 2]) ** 2)
        p = 1.0 - x * x, -x * y, -x * z, 1.0 - y * y, -y * z, 1.0 - z * z
        add_product(matrix, a, n, Ja, p[0], p[1], p[2], p[3], p[4], p[5], a, n, Ja, s)
        add_product(matrix, b, m, Jb, p[0], p[1], p[2], p[3], p[4], p[5], b, m, Jb, s)
        add_product(matrix, a, n, Ja, p[0], p[1], p[2], p[3], p[4], p[5], b, m, Jb, -s)
        add_product(matrix, b, m, Jb, p[0], p[1], p[2], p[3], p[4], p[5], a, n, Ja, -s)


# ---------------------------------------------------------------------------------------------- hinges


@inlined
def _hinge_geometry(y, hinges, bodies, k):
    """Zero direction a and the one across it b, parts p and q of the slope along them, and g = d(angle)/d(slope).

    Notes
    -----
    angle = atan2(q, p), g = (p b - q a)/(p^2 + q^2).
    """
    R, iq = bodies[hinges[k].body].R, hinges[k].iq
    z, n = hinges[k].zero, hinges[k].axis
    ax, ay, az = turn(R, z[0], z[1], z[2])
    nx, ny, nz = turn(R, n[0], n[1], n[2])
    bx, by, bz = cross(nx, ny, nz, ax, ay, az)
    ux, uy, uz = y[iq], y[iq + 1], y[iq + 2]
    p, q = ux * ax + uy * ay + uz * az, ux * bx + uy * by + uz * bz
    rr = p * p + q * q
    g = ((p * bx - q * ax) / rr, (p * by - q * ay) / rr, (p * bz - q * az) / rr)
    return (ax, ay, az), (bx, by, bz), p, q, g


@inlined
def hinge_law(hinges, k, angle, rate):
    """Torque that resists, its derivatives with respect to angle and rate, energy and dissipated power."""
    torque, stiffness, damping = 0.0, hinges[k].stiffness, hinges[k].damping
    turned = angle - hinges[k].rest
    torque += stiffness * turned
    energy = 0.5 * stiffness * turned * turned
    over = max(angle - hinges[k].high, 0.0) + min(angle - hinges[k].low, 0.0)
    if over != 0.0:
        stiffness += hinges[k].stop
        torque += hinges[k].stop * over
        energy += 0.5 * hinges[k].stop * over * over
    if hinges[k].latched != 0.0:
        off = angle - hinges[k].latch
        stiffness += hinges[k].latch_stiffness
        damping += hinges[k].latch_damping
        torque += hinges[k].latch_stiffness * off
        energy += 0.5 * hinges[k].latch_stiffness * off * off
    return torque + damping * rate, stiffness, damping, energy, damping * rate * rate


@indirect(types.UniTuple(REAL, 2)(VECTOR, MODEL, VECTOR))
def add_hinges(y, model, F):
    """Torques of all hinges; returns (energy, power dissipated).

    Notes
    -----
    With g = d(angle)/du of the slope u, a turn w of the body changes the angle by -(u x g) . w.
    """
    hinges, bodies, n_q = model.flexible.hinges, model.bodies, model.info.nq
    energy = power = 0.0
    for k in range(hinges.size):
        _, _, p, q, (gx, gy, gz) = _hinge_geometry(y, hinges, bodies, k)
        iq, iv, body = hinges[k].iq, hinges[k].iv, hinges[k].body
        tx, ty, tz = cross(y[iq], y[iq + 1], y[iq + 2], gx, gy, gz)
        w = bodies[body].w
        rate = gx * y[iv] + gy * y[iv + 1] + gz * y[iv + 2] - tx * w[0] - ty * w[1] - tz * w[2]
        angle = math.atan2(q, p)
        torque, _, _, u, lost = hinge_law(hinges, k, angle, rate)
        hinges[k].angle, hinges[k].rate, hinges[k].torque = angle, rate, torque
        energy += u
        power += lost
        at, G = iv - n_q, bodies[body].F
        F[at] += torque * gx
        F[at + 1] += torque * gy
        F[at + 2] += torque * gz
        G[3] += torque * tx
        G[4] += torque * ty
        G[5] += torque * tz
    return energy, power


@indirect(void(VECTOR, REAL, MODEL, SPARSE))
def add_hinge_tangents(y, c_rate, model, matrix):
    """Tangents of all hinges.

    Notes
    -----
    With f = torque g: df = (stiffness + c_rate damping) g g^T + damping g (H r)^T + torque H, H = d2(angle)/du2, and r
    is the slope's rate as seen from the body.
    """
    flexible, bodies, n_q = model.flexible, model.bodies, model.info.nq
    hinges = flexible.hinges
    K = flexible.K12
    for k in range(hinges.size):
        a, b, p, q, g = _hinge_geometry(y, hinges, bodies, k)
        iq, iv, body = hinges[k].iq, hinges[k].iv, hinges[k].body
        ux, uy, uz = y[iq], y[iq + 1], y[iq + 2]
        rr = p * p + q * q
        torque, stiffness, damping, _, _ = hinge_law(hinges, k, hinges[k].angle, hinges[k].rate)
        slope = stiffness + c_rate * damping
        w = bodies[body].w
        rx, ry, rz = cross(w[0], w[1], w[2], ux, uy, uz)
        r = (y[iv] - rx, y[iv + 1] - ry, y[iv + 2] - rz)
        s, d = 2.0 * p * q / (rr * rr), (q * q - p * p) / (rr * rr)
        for j in range(3):
            turned = 0.0
            for i in range(3):
                turned += (s * (a[i] * a[j] - b[i] * b[j]) + d * (a[i] * b[j] + b[i] * a[j])) * r[i]
            for i in range(3):
                second = s * (a[i] * a[j] - b[i] * b[j]) + d * (a[i] * b[j] + b[i] * a[j])
                K[i, j] = slope * g[i] * g[j] + torque * second + damping * g[i] * turned
        at = iv - n_q
        add_block(matrix, at, at, K, 0, 0, 3, 3, 1.0)
        if bodies[body].motion != rigid.DRIVEN:
            local = flexible.e[2]
            local[0], local[1], local[2] = turn_back(bodies[body].R, ux, uy, uz)
            body_columns(model, body, local, False, flexible.J[1])
            f = (torque * g[0], torque * g[1], torque * g[2])
            add_relative(matrix, model, body, flexible.J[1], K, f, at, 1.0)
            add_relative_body(matrix, model, body, False, flexible.J[1], K, f)


# ---------------------------------------------------------------------------------------------- forces seen from a body


@inlined
def body_columns(model, index, local, is_place, J):
    """`side_columns` of a body."""
    return side_columns(model, ON_BODY, index, -1, local, is_place, J)


@inlined
def _turn_axis(bodies, index, motion, c):
    """Axis (body axes) about which column c of a body turns it; zero where it moves it."""
    n = bodies[index].axis
    if motion == rigid.SPIN:
        return n[0], n[1], n[2]
    return 1.0 * (c == 3), 1.0 * (c == 4), 1.0 * (c == 5)


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
    A turn t of the body changes f by t x f - K (t x u). The body bears -f at u: -(local x R^T f), which a displacement
    du changes by R^T f x R^T du - local x R^T K du; local is u as seen from the body.
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
        nx, ny, nz = _turn_axis(bodies, index, motion, c)
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
        nx, ny, nz = _turn_axis(bodies, index, motion, c)
        tx, ty, tz = turn(R, nx, ny, nz)
        cx, cy, cz = cross(tx, ty, tz, f[0], f[1], f[2])
        dx, dy, dz = turn_back(R, -J[0, c], -J[1, c], -J[2, c])
        gx, gy, gz = cross(fx, fy, fz, dx, dy, dz)
        for r in range(size):
            value = 0.0
            for i in range(3):
                for j in range(3):
                    value += J[i, r] * K[i, j] * J[j, c]
            ax, ay, az = _turn_axis(bodies, index, motion, r)
            value += ax * gx + ay * gy + az * gz
            if is_place and motion == rigid.FREE and r < 3:
                value -= cx if r == 0 else (cy if r == 1 else cz)
            values[to + r * down + c * right] += value
