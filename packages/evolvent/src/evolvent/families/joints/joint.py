"""Joints: scalar constraints and penalties between two sides (`evolvent.kernels.sides`)."""

import math

from numba import types, void

from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.families.joints.cord import drum_cord, mean_direction
from evolvent.families.joints.gear import add_gear_force, gear_geometry, measure_gear, note_gear_reaction
from evolvent.kernels import reduced
from evolvent.kernels.calls import row_bend, row_force, row_measure, row_note
from evolvent.kernels.constraints import STATE, penalty_energy
from evolvent.kernels.drive import drive
from evolvent.kernels.gaps import (
    ALONG,
    ANGLE,
    CORD,
    DIRECTION,
    DISTANCE,
    GEAR,
    LENGTHS,
    POINT,
    SEGMENT,
    copies_at,
    is_place,
    measure_gap,
    secant_gap,
    side_count,
)
from evolvent.kernels.rigid import centripetal
from evolvent.kernels.rotations import cross, turn, turn_back
from evolvent.kernels.sides import (
    ON_BODY,
    ON_NODE,
    node_vector,
    pull,
    side_vector,
)
from evolvent.kernels.thread.joined import length_at_spool
from evolvent.model import MODEL, having

__all__ = [
    "ALONG", "ANGLE", "CORD", "DIRECTION", "DISTANCE", "GEAR", "INVOLUTE", "LENGTHS", "LINEAR", "POINT", "SEGMENT",
    "STILL", "add_joint_force", "add_row_force", "bend_row", "is_place", "joint_geometry", "measure_row",
    "note_reaction", "side_count",
]  # fmt: skip

USED_FOR, _CORDS = "joints", having("joints", kind=CORD)
_I = types.int64
# how a drive moves a joint: not; along its direction; round an involute
STILL, LINEAR, INVOLUTE = 0, 1, 2


@inlined
def side_rates(y, joints, bodies, k, side, is_place):
    """Vector of a side of joint k and its rate: six floats."""
    iq, iv, local = joints[k].iq[side], joints[k].iv[side], joints[k].local[side]
    if joints[k].on[side] == ON_NODE:
        return node_vector(y, iq, iv, local)
    return side_vector(y, bodies, joints[k].on[side], joints[k].index[side], iq, iv, local, is_place)


@indirect(void(REAL, VECTOR, types.int64, MODEL))
def joint_geometry(t, y, k, model):
    """Fill the vectors u, gradients g and what is measured of joint k at time t, and gap and rate of its row.

    `driven` is the part of the rate that its drive makes, `bends` the part of the second derivative of the gap that
    rates make, but for what turns sides with their bodies. Rows of joints are the first of `Model.constraints`, in the
    order of the joints.

    Notes
    -----
    POINT: along . (u_b - u_a) - value - path; ALONG: u_d . (u_b - u_a) - value; DIRECTION: u_a . u_b - value; both
    less phi . q of an interface node of a reduced body (`evolvent.kernels.reduced`);
    DISTANCE, SEGMENT: |u_b - u_a| - value; ANGLE: the body's angle less value and path. The path is radius phi of a
    drive, or for an INVOLUTE the point of the end of a taut thread of length `value` that has been wound by phi onto a
    circle, from the direction `zero` on.
    """
    joints, rows, bodies, parameters = model.joints, model.constraints, model.bodies, model.parameters
    kind = joints[k].kind
    u, g = joints[k].u, joints[k].g
    phi = phi_rate = phi_second = 0.0
    rows[k].driven = joints[k].bends = 0.0
    if joints[k].path != STILL:
        p = parameters[joints[k].first : joints[k].last]
        phi, phi_rate, phi_second = drive(joints[k].drive, p, joints[k].law, t)
    if kind == ANGLE:
        iq, iv = joints[k].iq[1], joints[k].iv[1]
        joints[k].measured, rows[k].gap = y[iq], y[iq] - joints[k].value - phi
        rows[k].rate, rows[k].driven, joints[k].bends = y[iv] - phi_rate, -phi_rate, -phi_second
        return
    if kind == CORD:
        _cord_geometry(y, k, model)
        return
    if kind == GEAR:
        gear_geometry(k, 0.0, y, model)
        return
    points, paid = is_place(kind, 0), 0.0
    if kind == SEGMENT and joints[k].on[0] == ON_BODY:
        joints[k].value, paid = length_at_spool(t, y, model, joints[k].first, joints[k].last)
    a = side_rates(y, joints, bodies, k, 0, points)
    b = side_rates(y, joints, bodies, k, 1, points)
    for c in range(3):
        u[0, c], u[1, c] = a[c], b[c]
    if kind != POINT:
        d = side_rates(y, joints, bodies, k, 2, is_place(kind, 2)) if side_count(kind) == 3 else a
        measure_gap(joints, rows, k, a, b, d)
        rows[k].rate -= paid
        if joints[k].reduced > 0:
            reduced.take_shape(y, k, model)
        return
    dx, dy, dz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = b[3] - a[3], b[4] - a[4], b[5] - a[5]
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
        along_n = nx * (o * e[0] + s * fx) + ny * (o * e[1] + s * fy) + nz * (o * e[2] + s * fz)
        across_n = nx * (o * fx - s * e[0]) + ny * (o * fy - s * e[1]) + nz * (o * fz - s * e[2])
        rows[k].driven = tail * phi_rate * along_n
        joints[k].bends = (tail * phi_second - r * phi_rate * phi_rate) * along_n
        joints[k].bends += tail * phi_rate * phi_rate * across_n
    else:
        gap -= joints[k].value + joints[k].radius * phi
        rows[k].driven, joints[k].bends = -joints[k].radius * phi_rate, -joints[k].radius * phi_second
    rate += rows[k].driven
    rows[k].gap = gap
    rows[k].rate = rate
    g[0, 0], g[0, 1], g[0, 2] = -nx, -ny, -nz
    g[1, 0], g[1, 1], g[1, 2] = nx, ny, nz


@indirect(void(VECTOR, _I, MODEL), used_for=_CORDS)
def _cord_geometry(y, k, model):
    """As `joint_geometry`, of a CORD: the whole length less `value`, gradients along the free part.

    Notes
    -----
    The force on the drum acts where the cord leaves it, which is entered as the point of side a. Instead of a third
    side, g[2] and u[2, 0] are the direction q and `bend` of `drum_cord`.
    """
    joints, rows, bodies = model.joints, model.constraints, model.bodies
    body, centre, n0, z0 = joints[k].index[0], joints[k].centre, joints[k].axis, joints[k].zero
    a = side_vector(y, bodies, ON_BODY, body, -1, -1, centre, True)
    b = side_vector(
        y, bodies, joints[k].on[1], joints[k].index[1], joints[k].iq[1], joints[k].iv[1], joints[k].local[1], True
    )
    R, w, u, g = bodies[body].R, bodies[body].w, joints[k].u, joints[k].g
    d = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    length, free, p, e, q, bend = drum_cord(
        joints[k].radius, joints[k].along[0], joints[k].value, d,
        turn(R, n0[0], n0[1], n0[2]), turn(R, z0[0], z0[1], z0[2]),
    )  # fmt: skip
    # velocity of the end against the drum, and against the drum's point where the cord leaves it
    rx, ry, rz = cross(w[0], w[1], w[2], d[0], d[1], d[2])
    px, py, pz = cross(w[0], w[1], w[2], p[0], p[1], p[2])
    vx, vy, vz = b[3] - a[3] - px, b[4] - a[4] - py, b[5] - a[5] - pz
    rate = e[0] * vx + e[1] * vy + e[2] * vz
    across = q[0] * (b[3] - a[3] - rx) + q[1] * (b[4] - a[4] - ry) + q[2] * (b[5] - a[5] - rz)
    joints[k].measured, rows[k].gap, rows[k].rate = length, length - joints[k].value, rate
    joints[k].bends = (vx * vx + vy * vy + vz * vz - rate * rate) / free + bend * across * across
    lx, ly, lz = turn_back(R, p[0], p[1], p[2])
    local = joints[k].local[0]
    local[0], local[1], local[2] = centre[0] + lx, centre[1] + ly, centre[2] + lz
    u[2, 0] = bend
    for c in range(3):
        u[0, c], u[1, c] = a[c] + p[c], b[c]
        g[0, c], g[1, c], g[2, c] = -e[c], e[c], q[c]


@row_measure
def measure_row(end, t, y, k, model):
    """`joint_geometry`, and what is kept of both ends of an interval."""
    joints = model.joints
    joint_geometry(t, y, k, model)
    if end == STATE:
        return
    if joints[k].kind == GEAR:
        measure_gear(k, end, y, model)
    u, kept = joints[k].u, joints[k].u0 if end == 0 else joints[k].u1
    for side in range(3):
        for c in range(3):
            kept[side, c] = u[side, c]


@row_bend
def bend_row(k, model):
    """Second derivative of the gap of joint k without accelerations, after `joint_geometry`."""
    joints, bodies, value = model.joints, model.bodies, model.joints[k].bends
    for side in range(side_count(joints[k].kind)):
        if joints[k].on[side] != ON_BODY:
            continue
        b, g, local = joints[k].index[side], joints[k].g[side], joints[k].local[side]
        dx, dy, dz = turn(bodies[b].R, local[0], local[1], local[2])
        cx, cy, cz = centripetal(bodies, b, dx, dy, dz)
        value += g[0] * cx + g[1] * cy + g[2] * cz
    return value


@row_force
def add_row_force(t, h, y, k, la, model, F):
    """`add_joint_force`, with the gradients of the mean state over an interval."""
    if h > 0.0:
        if model.joints[k].kind != GEAR:  # whose records keep the angles of the end
            joint_geometry(t + 0.5 * h, y, k, model)
        _secant(y, h, k, model)
    add_joint_force(y, h, k, la, model, F)


@inlined
def _secant(y, h, k, model):
    """Make gradients of the mean state y those along which a multiplier does the work of the change of the gap."""
    joints = model.joints
    if joints[k].kind == GEAR:
        gear_geometry(k, h, y, model)
    else:
        secant_gap(joints, k, h)


@indirect(void(VECTOR, REAL, _I, REAL, MODEL, VECTOR), used_for=_CORDS)
def _add_cord_force(y, h, k, la, model, F):
    """Generalised forces of the cord of joint k with tension -la over an interval of length h."""
    joints, rows, bodies, n_q = model.joints, model.constraints, model.bodies, model.info.nq
    on, index, iv, g = joints[k].on, joints[k].index, joints[k].iv, joints[k].g
    a = side_vector(y, bodies, ON_BODY, index[0], -1, -1, joints[k].centre, True)
    b = side_vector(y, bodies, on[1], index[1], joints[k].iq[1], iv[1], joints[k].local[1], True)
    d, v, w = (b[0] - a[0], b[1] - a[1], b[2] - a[2]), (b[3] - a[3], b[4] - a[4], b[5] - a[5]), bodies[index[0]].w
    m = mean_direction((g[1, 0], g[1, 1], g[1, 2]), d, v, w, rows[k].gap1 - rows[k].gap0, h)
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
    joints, bodies, n_q = model.joints, model.bodies, model.info.nq
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
    if kind == SEGMENT:
        model.nodes[model.threads[joints[k].first].node + joints[k].last].tension = la
    if joints[k].reduced > 0:
        reduced.pull_modes(k, la, model, F)
    for side in range(side_count(kind)):
        g, force = joints[k].g[side], la * copies_at(k, side, model)
        if joints[k].on[side] == ON_NODE:
            at, local = joints[k].iv[side] - n_q, joints[k].local[side]
            for i in range(3):
                for c in range(3):
                    F[at + 3 * i + c] += la * local[i] * g[c]
            continue
        pull(
            F, bodies, n_q, joints[k].on[side], joints[k].index[side], joints[k].iv[side], joints[k].u[side],
            is_place(kind, side),
            force * g[0], force * g[1], force * g[2],
        )  # fmt: skip


@row_note
def note_reaction(k, la, model):
    """Force and moment of joint k with the multiplier la on its second side, inertial axes, into its record."""
    joints, bodies, kind = model.joints, model.bodies, model.joints[k].kind
    u, g, force, moment = joints[k].u, joints[k].g, joints[k].force, joints[k].moment
    for c in range(3):
        force[c] = moment[c] = 0.0
    joints[k].stored, joints[k].gap = penalty_energy(k, model.constraints[k].gap, model), model.constraints[k].gap
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
    elif kind == GEAR:
        note_gear_reaction(k, la, model)
    else:
        for c in range(3):
            force[c] = -la * g[1, c]
