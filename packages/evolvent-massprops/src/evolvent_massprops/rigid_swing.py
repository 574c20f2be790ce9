"""A rigid body that swings on springs with full geometry, over equal steps by Runge-Kutta's method of fourth order."""

import math

from evolvent_base import packages

if "evolvent" in packages.folders():
    from numba import types

    from evolvent.compiled.jit import MATRIX, VECTOR, indirect, inlined

    MOTION = types.void(VECTOR, VECTOR, VECTOR, VECTOR, MATRIX)
else:
    from evolvent_massprops.plain import indirect, inlined

    MOTION = None

#: Places in `p`: step, s; weight, N; 1 for guides, else 0; pose of rest: place of the centre of mass (3), rotation
#: (3, 3); moments of inertia (3, 3) and the inverse of the whole matrix of inertia (6, 6), both in body axes; damping
#: (6, 6), level axes; from the pose of rest: translation and rotation vector (6), their rates (6).
STEP, WEIGHT, GUIDED, PLACE, ROTATION, INERTIA, INVERSE, DAMPING, START, SIZE = 0, 1, 2, 3, 6, 15, 24, 60, 96, 108
#: Numbers of each spring: point from the centre of mass (3), body axes; ground point (3); x and z from the ground point
#: to the point where it does not pull aside; stiffness, natural length, lateral stiffness.
SPRING = 11
#: Numbers of each sensor: point from the centre of mass (3) and direction (3), level axes at rest.
SENSOR = 6
#: Places in `work`: rotation by the rotation vector (3, 3), that of the body (3, 3); force and moment (6); the same in
#: body axes (6); acceleration (6); state (12), that of a stage (12), sum of rates (12), rates (12); accelerations by
#: unit forces of the guides (3, 6).
_TURN, _BODY, _FORCE, _OWN, _RATE, _STATE, _STAGE, _SUM, _RATES, _GUIDES, WORK = (
    0,
    9,
    18,
    24,
    30,
    36,
    48,
    60,
    72,
    84,
    102,
)
#: Motion, m or rad, from which on it is taken for one that grows without bound.
_FAR = 1e3


@inlined
def _turn(x, y, z, work):
    """Rotation matrix of a rotation vector by its quaternion."""
    square = x * x + y * y + z * z
    angle = math.sqrt(square)
    scale = 0.5 - square / 48.0 + square * square / 3840.0
    if angle > 1e-3:
        scale = math.sin(angle / 2.0) / angle
    x, y, z, w = scale * x, scale * y, scale * z, math.cos(angle / 2.0)
    work[_TURN], work[_TURN + 1], work[_TURN + 2] = (
        w * w + x * x - y * y - z * z,
        2 * (x * y - z * w),
        2 * (x * z + y * w),
    )
    work[_TURN + 3], work[_TURN + 4] = 2 * (x * y + z * w), w * w - x * x + y * y - z * z
    work[_TURN + 5], work[_TURN + 6] = 2 * (y * z - x * w), 2 * (x * z - y * w)
    work[_TURN + 7], work[_TURN + 8] = 2 * (y * z + x * w), w * w - x * x - y * y + z * z


@inlined
def _accelerate(p, work, to):
    """Acceleration at `to` of `work` by the force and moment in it, without guides."""
    for i in range(3):
        for half in (0, 3):
            own = 0.0
            for j in range(3):
                own += work[_BODY + 3 * j + i] * work[_FORCE + half + j]
            work[_OWN + half + i] = own
    for i in range(6):
        one = 0.0
        for j in range(6):
            one += p[INVERSE + 6 * i + j] * work[_OWN + j]
        work[_RATE + i] = one
    for i in range(3):
        for half in (0, 3):
            level = 0.0
            for j in range(3):
                level += work[_BODY + 3 * i + j] * work[_RATE + half + j]
            work[to + half + i] = level


@inlined
def _sum_forces(p, springs, work, at):
    """Force and moment of springs, weight, damping and of the turning body, by the state at `at`."""
    for k in range(6):
        work[_FORCE + k] = 0.0
        for j in range(6):
            work[_FORCE + k] -= work[at + 6 + j] * p[DAMPING + 6 * j + k]
    work[_FORCE + 1] -= p[WEIGHT]
    for n in range(0, len(springs), SPRING):
        a, b, c = springs[n], springs[n + 1], springs[n + 2]
        rx = work[_BODY] * a + work[_BODY + 1] * b + work[_BODY + 2] * c
        ry = work[_BODY + 3] * a + work[_BODY + 4] * b + work[_BODY + 5] * c
        rz = work[_BODY + 6] * a + work[_BODY + 7] * b + work[_BODY + 8] * c
        x = p[PLACE] + work[at] + rx - springs[n + 3]
        y = p[PLACE + 1] + work[at + 1] + ry - springs[n + 4]
        z = p[PLACE + 2] + work[at + 2] + rz - springs[n + 5]
        length = math.sqrt(x * x + y * y + z * z)
        pull, aside = -springs[n + 8] * (length - springs[n + 9]) / length, springs[n + 10]
        fx, fy, fz = pull * x - aside * (x - springs[n + 6]), pull * y, pull * z - aside * (z - springs[n + 7])
        work[_FORCE] += fx
        work[_FORCE + 1] += fy
        work[_FORCE + 2] += fz
        work[_FORCE + 3] += ry * fz - rz * fy
        work[_FORCE + 4] += rz * fx - rx * fz
        work[_FORCE + 5] += rx * fy - ry * fx
    u, v, w = work[at + 9], work[at + 10], work[at + 11]
    for i in range(3):  # rates of rotation and momentum in body axes
        work[_OWN + i] = work[_BODY + i] * u + work[_BODY + 3 + i] * v + work[_BODY + 6 + i] * w
    for i in range(3):
        work[_OWN + 3 + i] = 0.0
        for j in range(3):
            work[_OWN + 3 + i] += p[INERTIA + 3 * i + j] * work[_OWN + j]
    a, b, c = work[_OWN + 3], work[_OWN + 4], work[_OWN + 5]
    x = work[_BODY] * a + work[_BODY + 1] * b + work[_BODY + 2] * c
    y = work[_BODY + 3] * a + work[_BODY + 4] * b + work[_BODY + 5] * c
    z = work[_BODY + 6] * a + work[_BODY + 7] * b + work[_BODY + 8] * c
    work[_FORCE + 3] -= v * z - w * y
    work[_FORCE + 4] -= w * x - u * z
    work[_FORCE + 5] -= u * y - v * x


@inlined
def _guide(p, work, at):
    """Forces of the guides added to the acceleration: none of the centre of mass along x and z, none of yaw."""
    ex, ey, ez = work[_BODY], work[_BODY + 3], work[_BODY + 6]
    u, v, w = work[at + 9], work[at + 10], work[at + 11]
    free = (work[_RATES + 6], work[_RATES + 8], ey * work[_RATES + 9] - ex * work[_RATES + 10])
    bend = (w * ex - u * ez) * u - (v * ez - w * ey) * v
    for k in range(3):
        for i in range(6):
            work[_FORCE + i] = 0.0
        if k < 2:
            work[_FORCE + 2 * k] = 1.0
        else:
            work[_FORCE + 3], work[_FORCE + 4] = ey, -ex
        _accelerate(p, work, _GUIDES + 6 * k)
    one, two, three = _GUIDES, _GUIDES + 6, _GUIDES + 12
    a, b, c = work[one], work[two], work[three]
    d, e, f = work[one + 2], work[two + 2], work[three + 2]
    g = ey * work[one + 3] - ex * work[one + 4]
    h = ey * work[two + 3] - ex * work[two + 4]
    i = ey * work[three + 3] - ex * work[three + 4]
    r, s, t = -free[0], -free[1], -bend - free[2]
    whole = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    first = (r * (e * i - f * h) - b * (s * i - f * t) + c * (s * h - e * t)) / whole
    second = (a * (s * i - f * t) - r * (d * i - f * g) + c * (d * t - s * g)) / whole
    third = (a * (e * t - s * h) - b * (d * t - s * g) + r * (d * h - e * g)) / whole
    for k in range(6):
        work[_RATES + 6 + k] += first * work[one + k] + second * work[two + k] + third * work[three + k]


@inlined
def _find_rates(p, springs, work, at):
    """Rates of the state at `at`; that of the rotation vector to the second order (Bortz 1971, rates in level axes)."""
    x, y, z = work[at + 3], work[at + 4], work[at + 5]
    _turn(x, y, z, work)
    for i in range(3):
        for j in range(3):
            work[_BODY + 3 * i + j] = 0.0
            for k in range(3):
                work[_BODY + 3 * i + j] += work[_TURN + 3 * i + k] * p[ROTATION + 3 * k + j]
    _sum_forces(p, springs, work, at)
    _accelerate(p, work, _RATES + 6)
    if p[GUIDED] != 0.0:
        _guide(p, work, at)
    for k in range(3):
        work[_RATES + k] = work[at + 6 + k]
    u, v, w = work[at + 9], work[at + 10], work[at + 11]
    a, b, c = y * w - z * v, z * u - x * w, x * v - y * u
    work[_RATES + 3] = u - 0.5 * a + (y * c - z * b) / 12.0
    work[_RATES + 4] = v - 0.5 * b + (z * a - x * c) / 12.0
    work[_RATES + 5] = w - 0.5 * c + (x * b - y * a) / 12.0


@indirect(MOTION)
def motion(p, springs, sensors, work, out):
    """Displacements along the sensors at equal times from the start on.

    Parameters
    ----------
    p : (SIZE,) see the names of places above
    springs : (SPRING n,)
    sensors : (SENSOR c,)
    work : (WORK,), changed
    out : (N, c) m, written; nan in all rows from where the motion has grown without bound
    """
    h = p[STEP]
    for k in range(12):
        work[_STATE + k] = p[START + k]
    for n in range(len(out)):
        _turn(work[_STATE + 3], work[_STATE + 4], work[_STATE + 5], work)
        for c in range(len(sensors) // SENSOR):
            at, moved = SENSOR * c, 0.0
            for i in range(3):
                far = work[_STATE + i] - sensors[at + i]
                for j in range(3):
                    far += work[_TURN + 3 * i + j] * sensors[at + j]
                moved += far * sensors[at + 3 + i]
            out[n, c] = moved
        for k in range(12):
            work[_STAGE + k] = work[_STATE + k]
            work[_SUM + k] = 0.0
        for stage in range(4):
            _find_rates(p, springs, work, _STAGE)
            share, weight = 1.0 if stage == 2 else 0.5, 1.0 if stage in (0, 3) else 2.0
            for k in range(12):
                work[_STAGE + k] = work[_STATE + k] + share * h * work[_RATES + k]
                work[_SUM + k] += weight * work[_RATES + k]
        for k in range(12):
            work[_STATE + k] += h / 6.0 * work[_SUM + k]
        for k in range(6):
            if not abs(work[_STATE + k]) < _FAR:
                work[_STATE + k] = math.nan
