"""Gaps of joints that are functions of the vectors of their sides: value, gradient and second derivative.

A kind has up to three sides: points a and b, and a direction d, or of PULLEY a point; of DIRECTION a and b are
directions. A new kind is its number here, its branches in the functions below, and a part that writes it.
"""

import math

from numba import types, void

from evolvent.algebra.sparse import SPARSE
from evolvent.compiled.jit import MATRIX, REAL, entry, indirect, inlined
from evolvent.kernels.sides import ON_BODY, add_product, write_axial
from evolvent.model import MODEL

_I = types.int64
# kinds of joints: points coincide along a direction; directions keep their product; points keep their distance;
# a spinning body keeps to an angle; a cord winds onto a drum of side a; points coincide along a direction that turns
# two angles or travels stay in a ratio (`families.joints.gear`); a segment of a thread keeps its length; a cord from
# a over the point d to b, of which `radius` parts run from d to b, keeps its length
POINT, DIRECTION, DISTANCE, ANGLE, CORD, ALONG, GEAR, SEGMENT, PULLEY = 0, 1, 2, 3, 4, 5, 6, 7, 8
#: Kinds of joints that keep a length, so that their multiplier is a tension: the sides along it, and what it is.
LENGTHS = {DISTANCE: ((0, 1), "distance of the two ends"), PULLEY: ((0, 2, 1), "length of all parts of the cord")}
#: Length of a segment (m) below which its direction is that in which the thread leaves its spool.
TINY = 1e-9


@entry(_I)
@inlined
def side_count(kind):
    """Number of the sides of a joint."""
    return 3 if kind in (ALONG, PULLEY) else 2


@inlined
def copies_at(k, side, model):
    """How many times joint k acts on a side: the segment at a spool on its body for each of identical threads."""
    joints = model.joints
    if joints[k].kind == SEGMENT and joints[k].on[side] == ON_BODY:
        return float(model.threads[joints[k].first].copies)
    return 1.0


@inlined
def is_place(kind, side):
    """Whether a side of a joint is a point; else it is a direction."""
    return kind != DIRECTION and (side < 2 or kind == PULLEY)


@inlined
def measure_gap(joints, rows, k, a, b, d):
    """Gap, rate and gradients of joint k, but of the kinds of `joint`; `bends`: second derivative by rates.

    Parameters
    ----------
    a, b, d : 6 floats, vectors of the sides and their rates; d is used where there are three
    """
    kind, u, g = joints[k].kind, joints[k].u, joints[k].g
    if kind == PULLEY:
        _measure_pulley(joints, rows, k, a, b, d)
        return
    if kind == DIRECTION:
        joints[k].measured = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
        rows[k].gap = joints[k].measured - joints[k].value
        rows[k].rate = a[0] * b[3] + a[1] * b[4] + a[2] * b[5] + a[3] * b[0] + a[4] * b[1] + a[5] * b[2]
        joints[k].bends = 2.0 * (a[3] * b[3] + a[4] * b[4] + a[5] * b[5])
        for c in range(3):
            g[0, c], g[1, c] = b[c], a[c]
        return
    dx, dy, dz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = b[3] - a[3], b[4] - a[4], b[5] - a[5]
    if kind == ALONG:
        nx, ny, nz = d[0], d[1], d[2]
        joints[k].measured = nx * dx + ny * dy + nz * dz
        rows[k].gap = joints[k].measured - joints[k].value
        rows[k].rate = nx * vx + ny * vy + nz * vz + d[3] * dx + d[4] * dy + d[5] * dz
        joints[k].bends = 2.0 * (d[3] * vx + d[4] * vy + d[5] * vz)
        u[2, 0], u[2, 1], u[2, 2] = nx, ny, nz
        g[2, 0], g[2, 1], g[2, 2] = dx, dy, dz
    else:
        distance = math.sqrt(dx * dx + dy * dy + dz * dz)
        if kind == SEGMENT and distance <= TINY:
            nx, ny, nz = joints[k].along[0], joints[k].along[1], joints[k].along[2]
        else:
            nx, ny, nz = dx / distance, dy / distance, dz / distance
        joints[k].measured, rows[k].gap = distance, distance - joints[k].value
        rows[k].rate = rate = nx * vx + ny * vy + nz * vz
        joints[k].bends = 0.0
        if kind == DISTANCE or distance > TINY:
            joints[k].bends = (vx * vx + vy * vy + vz * vz - rate * rate) / distance
    g[0, 0], g[0, 1], g[0, 2] = -nx, -ny, -nz
    g[1, 0], g[1, 1], g[1, 2] = nx, ny, nz


@inlined
def _measure_pulley(joints, rows, k, a, b, d):
    """Gap |a - d| + ratio |b - d| - value of joint k, as `measure_gap`."""
    u, g = joints[k].u, joints[k].g
    joints[k].measured = rows[k].rate = joints[k].bends = 0.0
    for c in range(3):
        u[2, c], g[2, c] = d[c], 0.0
    for side in range(2):
        end, ratio = (b, joints[k].radius) if side == 1 else (a, 1.0)
        x, y, z = end[0] - d[0], end[1] - d[1], end[2] - d[2]
        vx, vy, vz = end[3] - d[3], end[4] - d[4], end[5] - d[5]
        length = math.sqrt(x * x + y * y + z * z)
        rate = (x * vx + y * vy + z * vz) / length
        joints[k].measured += ratio * length
        rows[k].rate += ratio * rate
        joints[k].bends += ratio * (vx * vx + vy * vy + vz * vz - rate * rate) / length
        g[side, 0], g[side, 1], g[side, 2] = ratio * x / length, ratio * y / length, ratio * z / length
        for c in range(3):
            g[2, c] -= g[side, c]
    rows[k].gap = joints[k].measured - joints[k].value


@inlined
def secant_gap(joints, k, h):
    """Make gradients of the mean state of an interval of length h those whose work is the change of the gap.

    Those of a product of two vectors are so already.
    """
    if joints[k].kind in (DISTANCE, SEGMENT):
        both = _apart(joints[k].u0, 0, 1) + _apart(joints[k].u1, 0, 1)
        if both > TINY:
            scale = 2.0 * joints[k].measured / both
            for i in range(2):
                for c in range(3):
                    joints[k].g[i, c] *= scale
    elif joints[k].kind == PULLEY:
        u, u0, u1, g = joints[k].u, joints[k].u0, joints[k].u1, joints[k].g
        for i in range(2):
            scale = 2.0 * _apart(u, i, 2) / (_apart(u0, i, 2) + _apart(u1, i, 2))
            for c in range(3):
                g[i, c] *= scale
        for c in range(3):
            g[2, c] = -g[0, c] - g[1, c]


@inlined
def _apart(u, i, j):
    """Distance of two of the vectors u."""
    x, y, z = u[j, 0] - u[i, 0], u[j, 1] - u[i, 1], u[j, 2] - u[i, 2]
    return math.sqrt(x * x + y * y + z * z)


@inlined
def gap_rate_slopes(joints, rows, k, side, a, b, d):
    """Second derivative of the gap of joint k by the vector of a side and by all, times their rates: three floats.

    Parameters
    ----------
    a, b, d : as of `measure_gap`
    """
    kind, vx, vy, vz = joints[k].kind, b[3] - a[3], b[4] - a[4], b[5] - a[5]
    sign = 1.0 if side == 1 else -1.0
    if kind == DIRECTION:
        return (b[3], b[4], b[5]) if side == 0 else (a[3], a[4], a[5])
    if kind == ALONG:
        return (vx, vy, vz) if side == 2 else (sign * d[3], sign * d[4], sign * d[5])
    if kind == DISTANCE:
        n, rate, s = joints[k].g[1], rows[k].rate, sign / joints[k].measured
        return s * (vx - rate * n[0]), s * (vy - rate * n[1]), s * (vz - rate * n[2])
    if kind == PULLEY:
        first, second = _part_slopes(joints, k, 0, a, d), _part_slopes(joints, k, 1, b, d)
        if side < 2:
            return first if side == 0 else second
        return -first[0] - second[0], -first[1] - second[1], -first[2] - second[2]
    return 0.0, 0.0, 0.0


@inlined
def _part_slopes(joints, k, side, end, d):
    """Second derivative of the length from d to a side of the pulley k by the side and by all, times the rates."""
    ratio, g, length = joints[k].radius if side == 1 else 1.0, joints[k].g[side], _apart(joints[k].u, side, 2)
    vx, vy, vz = end[3] - d[3], end[4] - d[4], end[5] - d[5]
    rate, s = (g[0] * vx + g[1] * vy + g[2] * vz) / (ratio * ratio), ratio / length
    return s * (vx - rate * g[0]), s * (vy - rate * g[1]), s * (vz - rate * g[2])


@indirect(void(_I, REAL, MODEL, SPARSE, _I, _I, MATRIX, _I, _I, MATRIX, _I, _I, MATRIX))
def add_gap_tangent(k, la, model, matrix, a, n, Ja, b, m, Jb, d, n_d, Jd):
    """Add la times the second derivative of the gap of joint k by the vectors of its sides.

    Parameters
    ----------
    a, n, Ja and so on : first unknown of a side, their number, and its columns (`sides.side_columns`); d of a CORD
        are those of the drum's body at the free end
    """
    joints, K = model.joints, model.K12
    kind, g, u = joints[k].kind, joints[k].g, joints[k].u
    if kind == PULLEY:
        write_axial(K, 1.0, -1.0, g[0])
        _add_stretch(matrix, a, n, Ja, d, n_d, Jd, K, la / _apart(u, 0, 2))
        ratio = joints[k].radius
        write_axial(K, 1.0, -1.0 / (ratio * ratio), g[1])
        _add_stretch(matrix, b, m, Jb, d, n_d, Jd, K, la * ratio / _apart(u, 1, 2))
        return
    write_axial(K, 1.0, -1.0 if kind in (DISTANCE, CORD, SEGMENT) else 0.0, g[1])
    if kind == DIRECTION:
        add_product(matrix, a, n, Ja, K, 0, 0, b, m, Jb, la)
        add_product(matrix, b, m, Jb, K, 0, 0, a, n, Ja, la)
    elif kind == ALONG:
        add_product(matrix, d, n_d, Jd, K, 0, 0, b, m, Jb, la)
        add_product(matrix, b, m, Jb, K, 0, 0, d, n_d, Jd, la)
        add_product(matrix, d, n_d, Jd, K, 0, 0, a, n, Ja, -la)
        add_product(matrix, a, n, Ja, K, 0, 0, d, n_d, Jd, -la)
    elif kind in (DISTANCE, CORD, SEGMENT):
        length = math.sqrt((u[1, 0] - u[0, 0]) ** 2 + (u[1, 1] - u[0, 1]) ** 2 + (u[1, 2] - u[0, 2]) ** 2)
        if kind == SEGMENT and length <= TINY:
            return
        s, times = la / length, copies_at(k, 0, model)
        add_product(matrix, a, n, Ja, K, 0, 0, a, n, Ja, times * s)
        add_product(matrix, b, m, Jb, K, 0, 0, b, m, Jb, s)
        add_product(matrix, a, n, Ja, K, 0, 0, b, m, Jb, -times * s)
        add_product(matrix, b, m, Jb, K, 0, 0, a, n, Ja, -s)
        if kind == CORD:  # the wound part turns in the tangent plane as well; d is the drum's body at the free end
            write_axial(K, 0.0, 1.0, g[2])
            _add_stretch(matrix, b, m, Jb, d, n_d, Jd, K, la * u[2, 0])


@inlined
def _add_stretch(matrix, a, n, Ja, b, m, Jb, K, s):
    """Add s (Ja - Jb)^T K (Ja - Jb) of two sides."""
    add_product(matrix, a, n, Ja, K, 0, 0, a, n, Ja, s)
    add_product(matrix, b, m, Jb, K, 0, 0, b, m, Jb, s)
    add_product(matrix, a, n, Ja, K, 0, 0, b, m, Jb, -s)
    add_product(matrix, b, m, Jb, K, 0, 0, a, n, Ja, -s)
