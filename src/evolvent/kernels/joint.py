"""Joints: scalar constraints and penalties between two sides (`evolvent.kernels.sides`)."""

import math

import numpy as np
from numba import types, void

from evolvent.compiled.jit import REAL, VECTOR, entry, indirect, inlined, kernel
from evolvent.kernels import rigid
from evolvent.kernels.cord import drum_cord, mean_direction
from evolvent.kernels.drive import drive
from evolvent.kernels.gear import add_gear, add_gear_force, gear_geometry, measure_gear
from evolvent.kernels.rotations import cross, turn, turn_back
from evolvent.kernels.sides import (
    ON_BODY,
    ON_NODE,
    add_product,
    add_turning,
    node_vector,
    pull,
    side_columns,
    side_vector,
)
from evolvent.kernels.sparse import SPARSE, add_entry, first_entry
from evolvent.model import MODEL, family_type

_I = types.int64
# kinds of joints: points coincide along a direction; directions keep their product; points keep their distance;
# a spinning body keeps to an angle; a cord winds onto a drum of side a; points coincide along a direction that turns
# two angles or travels stay in a ratio (`evolvent.kernels.gear`)
POINT, DIRECTION, DISTANCE, ANGLE, CORD, ALONG, GEAR = 0, 1, 2, 3, 4, 5, 6
# how a drive moves a joint: not; along its direction; round an involute
STILL, LINEAR, INVOLUTE = 0, 1, 2


@entry(REAL, family_type("joints"), types.int64)
@inlined
def holds(t, joints, k):
    """Whether joint k holds at time t."""
    return t <= joints[k].until


@entry(_I)
@inlined
def side_count(kind):
    """Number of the sides of a joint."""
    return 3 if kind == ALONG else 2


@inlined
def _vector(y, joints, bodies, k, side, is_place):
    """Vector of a side of joint k and its rate."""
    iq, iv, local = joints[k].iq[side], joints[k].iv[side], joints[k].local[side]
    if joints[k].on[side] == ON_NODE:
        return node_vector(y, iq, iv, local)
    return side_vector(y, bodies, joints[k].on[side], joints[k].index[side], iq, iv, local, is_place)


@indirect(void(REAL, VECTOR, types.int64, MODEL))
def joint_geometry(t, y, k, model):
    """Fill the vectors u, gradients g, what is measured, gap and rate of joint k at time t.

    Notes
    -----
    POINT: along . (u_b - u_a) - value - path; ALONG: u_d . (u_b - u_a) - value; DIRECTION: u_a . u_b - value;
    DISTANCE: |u_b - u_a| - value; ANGLE: the body's angle less value and path. The path is radius phi of a drive, or
    for an INVOLUTE the point of the end of a taut thread of length `value` that has been wound by phi onto a circle,
    from the direction `zero` on.
    """
    joints, bodies, parameters = model.flexible.joints, model.bodies, model.parameters
    kind = joints[k].kind
    u, g = joints[k].u, joints[k].g
    phi, phi_rate = 0.0, 0.0
    if joints[k].path != STILL:
        p = parameters[joints[k].first : joints[k].last]
        phi, phi_rate, _ = drive(joints[k].drive, p, joints[k].law, t)
    if kind == ANGLE:
        iq, iv = joints[k].iq[1], joints[k].iv[1]
        joints[k].measured, joints[k].gap = y[iq], y[iq] - joints[k].value - phi
        joints[k].rate = y[iv] - phi_rate
        return
    if kind == CORD:
        _cord_geometry(y, k, model)
        return
    if kind == GEAR:
        gear_geometry(k, 0.0, y, model)
        return
    is_place = kind != DIRECTION
    a = _vector(y, joints, bodies, k, 0, is_place)
    b = _vector(y, joints, bodies, k, 1, is_place)
    for c in range(3):
        u[0, c], u[1, c] = a[c], b[c]
    if kind == DIRECTION:
        joints[k].measured = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
        joints[k].gap = joints[k].measured - joints[k].value
        joints[k].rate = a[0] * b[3] + a[1] * b[4] + a[2] * b[5] + a[3] * b[0] + a[4] * b[1] + a[5] * b[2]
        for c in range(3):
            g[0, c], g[1, c] = b[c], a[c]
        return
    dx, dy, dz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = b[3] - a[3], b[4] - a[4], b[5] - a[5]
    if kind == ALONG:
        d = _vector(y, joints, bodies, k, 2, False)
        nx, ny, nz = d[0], d[1], d[2]
        joints[k].measured = nx * dx + ny * dy + nz * dz
        joints[k].gap = joints[k].measured - joints[k].value
        joints[k].rate = nx * vx + ny * vy + nz * vz + d[3] * dx + d[4] * dy + d[5] * dz
        u[2, 0], u[2, 1], u[2, 2] = nx, ny, nz
        g[2, 0], g[2, 1], g[2, 2] = dx, dy, dz
    elif kind == DISTANCE:
        distance = math.sqrt(dx * dx + dy * dy + dz * dz)
        nx, ny, nz = dx / distance, dy / distance, dz / distance
        joints[k].measured, joints[k].gap = distance, distance - joints[k].value
        joints[k].rate = nx * vx + ny * vy + nz * vz
    else:
        nx, ny, nz = joints[k].along[0], joints[k].along[1], joints[k].along[2]
        gap, rate = nx * dx + ny * dy + nz * dz, nx * vx + ny * vy + nz * vz
        joints[k].measured = gap
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
    The force on the drum acts where the cord leaves it, which is entered as the point of side a.
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
    joints[k].measured, joints[k].gap, joints[k].rate = length, length - joints[k].value, rate
    lx, ly, lz = turn_back(R, radius * rx, radius * ry, radius * rz)
    local = joints[k].local[0]
    local[0], local[1], local[2] = centre[0] + lx, centre[1] + ly, centre[2] + lz
    u[0, 0], u[0, 1], u[0, 2] = a[0] + radius * rx, a[1] + radius * ry, a[2] + radius * rz
    u[1, 0], u[1, 1], u[1, 2] = b[0], b[1], b[2]
    g[0, 0], g[0, 1], g[0, 2] = -ex, -ey, -ez
    g[1, 0], g[1, 1], g[1, 2] = ex, ey, ez


@inlined
def measure_joints(end, t, y, model):
    """Gaps of all joints at the start (end 0) or the end (1) of an interval, t and y the time and state there."""
    joints = model.flexible.joints
    for k in range(joints.size):
        joint_geometry(t, y, k, model)
        if joints[k].kind == GEAR:
            measure_gear(k, end, y, model)
        if end == 0:
            joints[k].gap0 = joints[k].gap
        else:
            joints[k].gap1 = joints[k].gap


@inlined
def _secant(y, h, k, model):
    """Make gradients of the mean state y those along which a multiplier does the work of the change of the gap."""
    joints = model.flexible.joints
    if joints[k].kind == GEAR:
        gear_geometry(k, h, y, model)
    elif joints[k].kind == DISTANCE:
        scale = 2.0 * (joints[k].gap + joints[k].value) / (joints[k].gap0 + joints[k].gap1 + 2.0 * joints[k].value)
        for i in range(2):
            for c in range(3):
                joints[k].g[i, c] *= scale


@indirect(void(VECTOR, REAL, _I, REAL, MODEL, VECTOR))
def _add_cord_force(y, h, k, la, model, F):
    """Generalised forces of the cord of joint k with tension -la over an interval of length h."""
    joints, bodies, n_q = model.flexible.joints, model.bodies, model.info.nq
    on, index, iv, g = joints[k].on, joints[k].index, joints[k].iv, joints[k].g
    a = side_vector(y, bodies, ON_BODY, index[0], -1, -1, joints[k].centre, True)
    b = side_vector(y, bodies, on[1], index[1], joints[k].iq[1], iv[1], joints[k].local[1], True)
    d, v, w = (b[0] - a[0], b[1] - a[1], b[2] - a[2]), (b[3] - a[3], b[4] - a[4], b[5] - a[5]), bodies[index[0]].w
    m = mean_direction((g[1, 0], g[1, 1], g[1, 2]), d, v, w, joints[k].gap1 - joints[k].gap0, h)
    fx, fy, fz = la * m[0], la * m[1], la * m[2]
    pull(F, bodies, n_q, ON_BODY, index[0], iv[0], b, True, -fx, -fy, -fz)
    pull(F, bodies, n_q, on[1], index[1], iv[1], b, True, fx, fy, fz)


@indirect(void(VECTOR, REAL, _I, REAL, MODEL, VECTOR))
def add_joint_force(y, h, k, la, model, F):
    """Generalised forces of joint k with the multiplier la over an interval; its geometry is that of the last call.

    Parameters
    ----------
    y, h : mean state, and length of the interval, s; 0: the state alone
    """
    joints, bodies, n_q = model.flexible.joints, model.bodies, model.info.nq
    kind = joints[k].kind
    if kind == ANGLE:  # its increment is 2 tan(angle/2)
        at, p = joints[k].iv[1], 0.5 * h * y[joints[k].iv[1]]
        F[at - n_q] += la * (math.atan(p) / p if abs(p) > 1e-4 else 1.0 - p * p / 3.0)
        return
    if kind == GEAR:
        add_gear_force(k, la, model, F)
        return
    if kind == CORD and h > 0.0:
        _add_cord_force(y, h, k, la, model, F)
        return
    for side in range(side_count(joints[k].kind)):
        g, is_place = joints[k].g[side], joints[k].kind != DIRECTION and side != 2
        if joints[k].on[side] == ON_NODE:
            at, local = joints[k].iv[side] - n_q, joints[k].local[side]
            for i in range(3):
                for c in range(3):
                    F[at + 3 * i + c] += la * local[i] * g[c]
            continue
        pull(
            F, bodies, n_q, joints[k].on[side], joints[k].index[side], joints[k].iv[side], joints[k].u[side], is_place,
            la * g[0], la * g[1], la * g[2],
        )  # fmt: skip


@inlined
def note_reaction(k, la, model):
    """Force and moment of joint k with the multiplier la on its second side, inertial axes, into its record."""
    joints, bodies, kind = model.flexible.joints, model.bodies, model.flexible.joints[k].kind
    u, g, force, moment = joints[k].u, joints[k].g, joints[k].force, joints[k].moment
    for c in range(3):
        force[c] = moment[c] = 0.0
    joints[k].stored = penalty_energy(joints, k)
    if kind == ANGLE:
        n, b = bodies[joints[k].index[1]].axis, joints[k].index[1]
        nx, ny, nz = turn(bodies[b].R, n[0], n[1], n[2])
        moment[0], moment[1], moment[2] = -la * nx, -la * ny, -la * nz
        for c in range(3):
            u[1, c] = bodies[b].x[c]
    elif kind == DIRECTION or (kind == ALONG and joints[k].on[0] == ON_NODE):  # of directions
        if not (joints[k].on[0] == ON_NODE and joints[k].iq[0] == joints[k].iq[1]):  # a section keeps its shape
            x, y, z = cross(u[1, 0], u[1, 1], u[1, 2], g[1, 0], g[1, 1], g[1, 2])
            moment[0], moment[1], moment[2] = -la * x, -la * y, -la * z
    elif kind != GEAR:
        for c in range(3):
            force[c] = -la * g[1, c]


@inlined
def is_penalty(t, s, joints, k):
    """Whether joint k is a penalty that acts under explicit methods, s : (ns,) int, switches.

    A step that starts when it is released does without it.
    """
    if joints[k].switch >= 0 and s[joints[k].switch] != 0:
        return False
    return joints[k].stiffness > 0.0 and t < joints[k].until


@inlined
def penalty_energy(joints, k):
    """stiffness gap^2 / 2, J, of the last `joint_geometry`; the force is its derivative, stiffness gap."""
    gap = joints[k].gap
    return 0.5 * joints[k].stiffness * gap * gap


@inlined
def penalty_loss(joints, k):
    """damping rate^2, W, the power that the penalty takes."""
    rate = joints[k].rate
    return joints[k].damping * rate * rate


@inlined
def add_penalty(t, y, k, model, F):
    """Add penalty k to the generalised forces of an explicit method; returns the power that it dissipates, W."""
    joints = model.flexible.joints
    joint_geometry(t, y, k, model)
    force = joints[k].stiffness * joints[k].gap + joints[k].damping * joints[k].rate
    add_joint_force(y, 0.0, k, force, model, F)
    return penalty_loss(joints, k)


def penalty_values(t, s, joints):
    """Multipliers (not a number of constraints) and the energy (J) of all penalties at a state, after `rhs`.

    Not compiled.
    """
    penalty = joints["stiffness"] > 0.0
    held = penalty & (t < joints["until"])
    switched = joints["switch"] >= 0
    held[switched] &= s[joints["switch"][switched]] == 0
    gap, rate = np.where(held, joints["gap"], 0.0), np.where(held, joints["rate"], 0.0)
    la = np.where(penalty, joints["stiffness"] * gap + joints["damping"] * rate, np.nan)
    return la, float(0.5 * joints["stiffness"] @ gap**2)


@inlined
def add_joint_residual(t, h, y, la, k, row, model, F, r):
    """Add joint k with the multiplier la to the forces F over an interval, and its constraint at the end as r[row].

    A penalty is a constraint with a compliance, gap + (damping rate - la)/stiffness = 0, by the mean gap.

    Parameters
    ----------
    t, h : float, s, start and length of the interval, after `measure_joints` of both ends; h = 0: y is a state
    y : (ny,) float, mean state

    Returns
    -------
    energy, dissipated : float, of a penalty, J and W
    """
    joints = model.flexible.joints
    joint_geometry(t + 0.5 * h, y, k, model)
    if not holds(t + h, joints, k):
        r[row] = la
        return 0.0, 0.0
    if h > 0.0:
        _secant(y, h, k, model)
    else:
        joints[k].gap0 = joints[k].gap1 = joints[k].gap
    add_joint_force(y, h, k, la, model, F)
    gap0, gap1, stiffness, damping = joints[k].gap0, joints[k].gap1, joints[k].stiffness, joints[k].damping
    r[row] = gap1
    if h == 0.0 and model.info.exact == 0:
        r[row] -= joints[k].slack * model.info.compliance * la
    if stiffness <= 0.0:
        return 0.0, 0.0
    rate = (gap1 - gap0) / h if h > 0.0 else joints[k].rate
    r[row] = 0.5 * (gap0 + gap1) + (damping * rate - la) / stiffness
    return 0.5 * stiffness * gap1 * gap1, damping * rate * rate


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
def add_held_joint(k, la, row, scale, damped, model, matrix):
    """Add joint k: gradient as row and column `row`, times `scale`, the row times `damped` as well, and la g'."""
    flexible, n_q = model.flexible, model.info.nq
    joints = flexible.joints
    kind = joints[k].kind
    if kind == ANGLE:
        at = joints[k].iv[1] - n_q
        add_entry(matrix, row, at, scale * damped)
        add_entry(matrix, at, row, scale)
        return
    if kind == GEAR:
        add_gear(k, row, scale, damped, model, matrix)
        return
    is_place = kind != DIRECTION
    Ja, Jb, Jd = flexible.J[0], flexible.J[1], flexible.J[2]
    a, n = side_columns(model, joints[k].on[0], joints[k].index[0], joints[k].iv[0], joints[k].local[0], is_place, Ja)
    b, m = side_columns(model, joints[k].on[1], joints[k].index[1], joints[k].iv[1], joints[k].local[1], is_place, Jb)
    ga, gb = joints[k].g[0], joints[k].g[1]
    _add_gradient(matrix, row, a, n, ga, Ja, scale, damped)
    _add_gradient(matrix, row, b, m, gb, Jb, scale, damped)
    d, n_d = 0, 0
    if kind == ALONG:
        d, n_d = side_columns(
            model, joints[k].on[2], joints[k].index[2], joints[k].iv[2], joints[k].local[2], False, Jd
        )
        _add_gradient(matrix, row, d, n_d, joints[k].g[2], Jd, scale, damped)
    if la == 0.0:
        return
    for side in range(side_count(kind)):
        if joints[k].on[side] == ON_BODY:
            g = joints[k].g[side]
            add_turning(
                matrix, model, joints[k].index[side], joints[k].local[side],
                la * g[0], la * g[1], la * g[2],
            )  # fmt: skip
    if kind == DIRECTION:
        add_product(matrix, a, n, Ja, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0, b, m, Jb, la)
        add_product(matrix, b, m, Jb, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0, a, n, Ja, la)
    elif kind == ALONG:
        add_product(matrix, d, n_d, Jd, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0, b, m, Jb, la)
        add_product(matrix, b, m, Jb, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0, d, n_d, Jd, la)
        add_product(matrix, d, n_d, Jd, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0, a, n, Ja, -la)
        add_product(matrix, a, n, Ja, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0, d, n_d, Jd, -la)
    elif kind in (DISTANCE, CORD):
        x, y, z = gb[0], gb[1], gb[2]
        u = joints[k].u
        s = la / math.sqrt((u[1, 0] - u[0, 0]) ** 2 + (u[1, 1] - u[0, 1]) ** 2 + (u[1, 2] - u[0, 2]) ** 2)
        p = 1.0 - x * x, -x * y, -x * z, 1.0 - y * y, -y * z, 1.0 - z * z
        add_product(matrix, a, n, Ja, p[0], p[1], p[2], p[3], p[4], p[5], a, n, Ja, s)
        add_product(matrix, b, m, Jb, p[0], p[1], p[2], p[3], p[4], p[5], b, m, Jb, s)
        add_product(matrix, a, n, Ja, p[0], p[1], p[2], p[3], p[4], p[5], b, m, Jb, -s)
        add_product(matrix, b, m, Jb, p[0], p[1], p[2], p[3], p[4], p[5], a, n, Ja, -s)


@inlined
def _damper_factor(k, c_rate, joints):
    """Factor of the constraint of joint k: the damper of a penalty adds to its gap."""
    return 1.0 + c_rate * joints[k].damping / joints[k].stiffness if joints[k].stiffness > 0.0 else 1.0


@inlined
def add_joint_tangent(t, la, k, row, scale, c_rate, with_row, model, matrix):
    """Add joint k with the multiplier la to a tangent; its constraint, in row and column `row`, times `scale`.

    The row is `with_row` times that of the column: 1, or 0 where `add_end_row` adds it.
    """
    joints = model.flexible.joints
    if not holds(t, joints, k):
        add_entry(matrix, row, row, scale * scale)
        return
    if joints[k].stiffness > 0.0:
        add_entry(matrix, row, row, -scale * scale / joints[k].stiffness)
    elif joints[k].slack > 0.0:
        add_entry(matrix, row, row, -scale * scale * joints[k].slack * model.info.compliance)
    add_held_joint(k, la, row, scale, with_row * _damper_factor(k, c_rate, joints), model, matrix)


@inlined
def add_end_row(t, y, dq, k, row, scale, c_rate, model, matrix):
    """Add the derivative of the gap at the end of a step by its increments dq as row `row`, times `scale`.

    Parameters
    ----------
    t, y, dq : s, state at the end, where the bodies are, and increments; that of a rotation is 2 p = 2 tan(angle/2)
        about its axis, and a change of it turns the end by (1 - p x)/(1 + p.p) of the change, body axes of the end
    """
    joints, bodies, n_q = model.flexible.joints, model.bodies, model.info.nq
    joint_geometry(t, y, k, model)
    factor, kind = scale * _damper_factor(k, c_rate, joints), joints[k].kind
    if kind == ANGLE:
        at = joints[k].iv[1] - n_q
        add_entry(matrix, row, at, factor / (1.0 + 0.25 * dq[at] * dq[at]))
        return
    J = model.flexible.J[0]
    for side in range(side_count(kind)):
        on, index, g = joints[k].on[side], joints[k].index[side], joints[k].g[side]
        is_place = kind != DIRECTION and side < 2
        at, n = side_columns(model, on, index, joints[k].iv[side], joints[k].local[side], is_place, J)
        to, right = 0, 0
        if n > 0:
            to, right, _ = first_entry(matrix, row, at)
        if n == 0 or to < 0:
            continue
        for c in range(n):
            J[0, c] = factor * (g[0] * J[0, c] + g[1] * J[1, c] + g[2] * J[2, c])
        if on == ON_BODY:
            first = n - 3 if bodies[index].motion == rigid.FREE else 0
            x, y_, z = 0.5 * dq[at + first], 0.0, 0.0
            if bodies[index].motion == rigid.FREE:
                y_, z = 0.5 * dq[at + 4], 0.5 * dq[at + 5]
                a, b, c = cross(x, y_, z, J[0, 3], J[0, 4], J[0, 5])
                J[0, 3], J[0, 4], J[0, 5] = J[0, 3] + a, J[0, 4] + b, J[0, 5] + c
            s = 1.0 / (1.0 + x * x + y_ * y_ + z * z)
            for c in range(first, n):
                J[0, c] *= s
        for c in range(n):
            matrix.values[to + c * right] += J[0, c]
