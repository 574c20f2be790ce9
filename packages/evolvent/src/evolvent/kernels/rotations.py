"""Rotations: quaternions (scalar first), rotation about an axis."""

import math

from evolvent.compiled.jit import MATRIX, REAL, VECTOR, entry, inlined


@entry(VECTOR, REAL, MATRIX, MATRIX)
@inlined
def rotation_about_axis(axis, angle, R0, R):
    """R = R0 rot(axis, angle): Rodrigues' formula.

    Parameters
    ----------
    axis : (3,) float, unit vector in the turned frame
    angle : float, rad
    R0 : (3, 3) float, orientation at angle zero
    R : (3, 3) float, output, columns are the body axes in the inertial frame
    """
    c, s = math.cos(angle), math.sin(angle)
    k = 1.0 - c
    x, y, z = axis[0], axis[1], axis[2]
    for i in range(3):
        a, b, d = R0[i, 0], R0[i, 1], R0[i, 2]
        R[i, 0] = a * (c + k * x * x) + b * (k * x * y + s * z) + d * (k * x * z - s * y)
        R[i, 1] = a * (k * x * y - s * z) + b * (c + k * y * y) + d * (k * y * z + s * x)
        R[i, 2] = a * (k * x * z + s * y) + b * (k * y * z - s * x) + d * (c + k * z * z)


@entry(REAL, REAL, REAL, REAL, MATRIX)
@inlined
def rotation_from_quaternion(w, x, y, z, R):
    """Rotation matrix of a quaternion of any length, body to inertial frame.

    Parameters
    ----------
    w, x, y, z : float, scalar part first
    R : (3, 3) float, output
    """
    s = 2.0 / (w * w + x * x + y * y + z * z)
    R[0, 0] = 1.0 - s * (y * y + z * z)
    R[0, 1] = s * (x * y - w * z)
    R[0, 2] = s * (x * z + w * y)
    R[1, 0] = s * (x * y + w * z)
    R[1, 1] = 1.0 - s * (x * x + z * z)
    R[1, 2] = s * (y * z - w * x)
    R[2, 0] = s * (x * z - w * y)
    R[2, 1] = s * (y * z + w * x)
    R[2, 2] = 1.0 - s * (x * x + y * y)


@inlined
def quaternion_rate(w, x, y, z, wx, wy, wz):
    """q' = q o (0, omega) / 2 for omega in the body frame, rad/s."""
    return (
        0.5 * (-x * wx - y * wy - z * wz),
        0.5 * (w * wx + y * wz - z * wy),
        0.5 * (w * wy + z * wx - x * wz),
        0.5 * (w * wz + x * wy - y * wx),
    )


@inlined
def turn(R, x, y, z):
    """R (x, y, z): body to inertial components."""
    return (
        R[0, 0] * x + R[0, 1] * y + R[0, 2] * z,
        R[1, 0] * x + R[1, 1] * y + R[1, 2] * z,
        R[2, 0] * x + R[2, 1] * y + R[2, 2] * z,
    )


@inlined
def turn_back(R, x, y, z):
    """R^T (x, y, z): inertial to body components."""
    return (
        R[0, 0] * x + R[1, 0] * y + R[2, 0] * z,
        R[0, 1] * x + R[1, 1] * y + R[2, 1] * z,
        R[0, 2] * x + R[1, 2] * y + R[2, 2] * z,
    )


@inlined
def dot(a, b):
    """a . b of two vectors of three."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def cross(ax, ay, az, bx, by, bz):
    """a x b."""
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
