"""A cord that winds onto a drum: the shortest way over the drum from where the cord is fixed to its free end."""

import math

from evolvent.compiled.jit import inlined
from evolvent.kernels.rotations import cross

#: Displacement, of the distance from the drum, below which e . u differs from the change of the length by round-off.
_SMALL = 1e-5


@inlined
def _wound(radius, sense, plane, x, y, z, n, zero):
    """Part of a cord that lies on its drum, as seen along the axis.

    Parameters
    ----------
    radius, sense : see `drum_cord`
    plane : float, m, its whole length as seen along the axis
    x, y, z : float, m, from the drum's centre to the free end, across the axis
    n, zero : 3 floats, the drum's axis, and the direction in which the cord is fixed to it

    Returns
    -------
    s : float, m, the free part as seen along the axis
    angle : float, rad, wound; of all that differ by whole turns, the one that brings the length nearest to `plane`
    r, e : 3 floats, direction to the point where it leaves the drum, and of the free part

    Notes
    -----
    s^2 = d^2 - R^2; R r + s e = d with e = sense n x r.
    """
    d2 = x * x + y * y + z * z
    s = math.sqrt(max(d2 - radius * radius, 1e-300))
    kx, ky, kz = cross(n[0], n[1], n[2], x, y, z)
    rx = (radius * x - sense * s * kx) / d2
    ry = (radius * y - sense * s * ky) / d2
    rz = (radius * z - sense * s * kz) / d2
    tx, ty, tz = cross(n[0], n[1], n[2], rx, ry, rz)
    qx, qy, qz = cross(n[0], n[1], n[2], zero[0], zero[1], zero[2])
    angle = sense * math.atan2(rx * qx + ry * qy + rz * qz, rx * zero[0] + ry * zero[1] + rz * zero[2])
    angle += 2.0 * math.pi * round((plane - s - radius * angle) / (2.0 * math.pi * radius))
    return s, angle, (rx, ry, rz), (sense * tx, sense * ty, sense * tz)


@inlined
def drum_cord(radius, sense, whole, d, n, zero):
    """Where a cord leaves its drum, and how long it is.

    Parameters
    ----------
    radius : float, m
    sense : {1, -1}, the cord winds on in the positive or negative sense about the axis
    whole : float, m, the cord's whole length
    d : 3 floats, from the drum's centre to the cord's free end, m, inertial axes
    n, zero : 3 floats, the drum's axis, and the direction in which the cord is fixed to it

    Returns
    -------
    length, free : float, m, of wound and free part together, and of the free part
    p : 3 floats, m, from the centre to the point where the cord leaves the drum
    e : 3 floats, direction of the free part, which is the gradient of the length by d
    q : 3 floats, direction across e in the tangent plane of the drum
    bend : float, 1/m

    Notes
    -----
    The cord is taut and lies on the drum without friction along the axis: a helix that goes over into the straight
    free part with one slope. Unrolled into a plane it is a straight line: length^2 = (s + R angle)^2 + z^2, with s and
    the angle as seen along the axis and z the distance of the free end from the plane across the axis through the
    centre. Its second derivative by d is (I - e e^T)/free + bend q q^T.

    A cord that has unwound swings about the point where it is fixed, and winds on in the other sense after that. Of
    these ways the one is taken whose length is nearest to the whole length.
    """
    height = n[0] * d[0] + n[1] * d[1] + n[2] * d[2]
    x, y, z = d[0] - height * n[0], d[1] - height * n[1], d[2] - height * n[2]
    plane = math.sqrt(max(whole * whole - height * height, 0.0))
    s, angle, r, e = _wound(radius, sense, plane, x, y, z, n, zero)
    other = _wound(radius, -sense, plane, x, y, z, n, zero)
    is_wound, off = angle >= 0.0, abs(s + radius * angle - plane)
    if other[1] >= 0.0 and (not is_wound or abs(other[0] + radius * other[1] - plane) < off):
        s, angle, r, e = other
        is_wound, off = True, abs(s + radius * angle - plane)
    ax, ay, az = radius * zero[0], radius * zero[1], radius * zero[2]
    fx, fy, fz = d[0] - ax, d[1] - ay, d[2] - az
    straight = math.sqrt(fx * fx + fy * fy + fz * fz)
    is_seen = x * zero[0] + y * zero[1] + z * zero[2] >= radius
    if not is_wound or (is_seen and abs(math.sqrt(max(straight * straight - height * height, 0.0)) - plane) < off):
        e = fx / straight, fy / straight, fz / straight
        return straight, straight, (ax, ay, az), e, (0.0, 0.0, 0.0), 0.0
    whole_plane = s + radius * angle
    length = math.sqrt(whole_plane * whole_plane + height * height)
    c, b = whole_plane / length, height / length
    free, rise = s / c, radius * angle * height / whole_plane
    p = radius * r[0] + rise * n[0], radius * r[1] + rise * n[1], radius * r[2] + rise * n[2]
    q = c * n[0] - b * e[0], c * n[1] - b * e[1], c * n[2] - b * e[2]
    e = c * e[0] + b * n[0], c * e[1] + b * n[1], c * e[2] + b * n[2]
    return length, free, p, e, q, 1.0 / length - 1.0 / free


@inlined
def mean_direction(e, d, v, w, change, h):
    """Direction of the tension of a cord over an interval along which its work is that of the change of the length.

    Parameters
    ----------
    e : 3 floats, direction of the free part at the mean position
    d, v : 3 floats, from the drum's centre to the cord's free end, m, and its increment over h, inertial axes
    w : 3 floats, rad/s, increment of the drum's rotation over h
    change, h : float, of the length, m, and length of the interval, s

    Notes
    -----
    The length depends on the position of the free end as seen from the drum alone. With the displacement u of the end
    against the drum, tensions along m = e + u (change - e . u)/u.u on the end and, at the same point, against it on the
    drum do the work of the tension times the change of the length exactly, and both momenta are kept.
    """
    tx, ty, tz = cross(w[0], w[1], w[2], d[0], d[1], d[2])
    ux, uy, uz = h * (v[0] - tx), h * (v[1] - ty), h * (v[2] - tz)
    least = _SMALL * _SMALL * (d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    part = (change - e[0] * ux - e[1] * uy - e[2] * uz) / max(ux * ux + uy * uy + uz * uz, least)
    return e[0] + part * ux, e[1] + part * uy, e[2] + part * uz
