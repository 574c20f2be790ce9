"""A cord that winds onto a drum without slipping, in the plane across the drum's axis."""

import math

from evolvent.compiled.jit import inlined
from evolvent.kernels.rotations import cross

#: Displacement, of the distance from the drum, below which e . u differs from the change of the length by round-off.
_SMALL = 1e-5


@inlined
def drum_cord(radius, sense, wound_length, d, v, n, z, omega):
    """Where a cord leaves its drum, and how long it is.

    Parameters
    ----------
    radius : float, m
    sense : {1, -1}, the cord winds on in the positive or negative sense about the axis
    wound_length : float, m, the cord's whole length
    d, v : 3 floats, from the drum's centre to the cord's free end, m, and its rate, inertial axes
    n, z : 3 floats, the drum's axis, and the direction in which the cord is fixed to it
    omega : float, rad/s, rate of the drum about its axis

    Returns
    -------
    length, rate : float, m and m/s, of wound and free part together
    free : float, m, the free part
    ex, ey, ez : float, its direction
    rx, ry, rz : float, direction from the centre to the point where it leaves
    radial : float, m/s, rate of the free end along that direction

    Notes
    -----
    The length is s + R (angle wrapped), s^2 = d^2 - R^2. The wrapped angle is the one, of all that differ by whole
    turns, that brings the length nearest to its set value.
    """
    d2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
    s = math.sqrt(max(d2 - radius * radius, 1e-300))
    # radial direction to the tangent point: R r + s e = d, e = sense n x r
    kx, ky, kz = cross(n[0], n[1], n[2], d[0], d[1], d[2])
    rx = (radius * d[0] - sense * s * kx) / d2
    ry = (radius * d[1] - sense * s * ky) / d2
    rz = (radius * d[2] - sense * s * kz) / d2
    tx, ty, tz = cross(n[0], n[1], n[2], rx, ry, rz)
    ex, ey, ez = sense * tx, sense * ty, sense * tz
    qx, qy, qz = cross(n[0], n[1], n[2], z[0], z[1], z[2])
    angle = math.atan2(rx * qx + ry * qy + rz * qz, rx * z[0] + ry * z[1] + rz * z[2])
    wrapped = sense * angle  # from the anchor, growing as the cord winds on
    turns = round((wound_length - s - radius * wrapped) / (2.0 * math.pi * radius))
    length = s + radius * (wrapped + 2.0 * math.pi * turns)
    rate = ex * v[0] + ey * v[1] + ez * v[2] - sense * radius * omega
    return length, rate, s, ex, ey, ez, rx, ry, rz, rx * v[0] + ry * v[1] + rz * v[2]


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
