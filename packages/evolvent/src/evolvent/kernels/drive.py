"""Angle, rate and acceleration of a spool as functions of time."""

import numpy as np
from numba import types

from evolvent.compiled.jit import REAL, VECTOR, entry, inlined, kernel
from evolvent.compiled.lookups import drive_law_at
from evolvent.kernels.profile import row_before

RAMPS, TABLE, LAW, FREE = 0, 1, 2, 3
#: Part of the whole length of a thread or rod on a moving mesh that must be out.
LEAST_OUT = 1e-3
#: Share of a length by which a drive may run past its ends.
ROUND_OFF = 1e-9
#: In place of a law: a table that a loop of feedback writes while it runs (`evolvent.analysis.feedback`).
OPEN = -1


@inlined
def drive_ramps(p, t):
    """Rates that follow one another, each reached over its own time by a quintic smooth step.

    Parameters
    ----------
    p : (3 + 3 k,) float
        angle at t = 0 (rad), first rate (rad/s), k, then k times (start s, duration s, rate rad/s)
    t : float, s

    Notes
    -----
    S(s) = 10 s^3 - 15 s^4 + 6 s^5, its integral 2.5 s^4 - 3 s^5 + s^6, on 0 <= s <= 1.
    """
    angle = p[0] + p[1] * t
    rate = p[1]
    acceleration = 0.0
    before = p[1]
    for k in range(int(p[2])):
        start, duration, after = p[3 + 3 * k], p[4 + 3 * k], p[5 + 3 * k]
        jump = after - before
        before = after
        if t < start:
            continue
        if t >= start + duration:
            angle += jump * (t - start - 0.5 * duration)
            rate += jump
        else:
            s = (t - start) / duration
            s3 = s * s * s
            angle += jump * duration * s3 * s * (2.5 - 3.0 * s + s * s)
            rate += jump * s3 * (10.0 - 15.0 * s + 6.0 * s * s)
            acceleration += jump / duration * 30.0 * s * s * (1.0 - s) * (1.0 - s)
    return angle, rate, acceleration


@kernel
def drive_table(p, t):
    """Piecewise polynomial (up to quartic), extended by its end rates outside.

    Parameters
    ----------
    p : (1 + n + 5 (n - 1),) float
        n, the n breakpoints (s), then for each piece the coefficients of (t - t_i)^4 .. (t - t_i)^0, rad
    t : float, s
    """
    n = int(p[0])
    first, last = p[1], p[n]
    inside = min(max(t, first), last)
    low = row_before(p, 1, n, inside)
    c = 1 + n + 5 * low
    s = inside - p[1 + low]
    angle = (((p[c] * s + p[c + 1]) * s + p[c + 2]) * s + p[c + 3]) * s + p[c + 4]
    rate = ((4.0 * p[c] * s + 3.0 * p[c + 1]) * s + 2.0 * p[c + 2]) * s + p[c + 3]
    acceleration = (12.0 * p[c] * s + 6.0 * p[c + 1]) * s + 2.0 * p[c + 2]
    if inside != t:
        return angle + rate * (t - inside), rate, 0.0
    return angle, rate, acceleration


@entry(types.int64, VECTOR, types.int64, REAL)
@inlined
def drive(kind, p, address, t):
    """(angle rad, rate rad/s, acceleration rad/s2) of a prescribed spool at time t."""
    if kind == RAMPS:
        return drive_ramps(p, t)
    if kind == TABLE:
        return drive_table(p, t)
    return drive_law_at(address)(t, p)


@entry(types.int64, VECTOR, types.int64, VECTOR, VECTOR)
@kernel
def drive_angles(kind, p, address, times, angles):
    """Angles of a prescribed spool at many times, rad; times, angles : (nt,) float."""
    for k in range(times.size):
        angles[k] = drive(kind, p, address, times[k])[0]


# ------------------------------------------------------------------------------------------------ not compiled


def angles_of(row, model, times, prefix=""):
    """Values of the drive of a row, rad or m, or of another one whose fields have a prefix: (nt,)."""
    angles = np.empty(times.size)
    first, last, law = (int(row[prefix + key]) for key in ("first", "last", "law"))
    drive_angles(int(row[prefix + "drive"]), model.parameters[first:last], law, times, angles)
    return angles


def set_ramp(model, row, prefix, value, rate):
    """The model in which the drive of a row, a view of one record, has a value at t = 0 and rises by a rate."""
    first = model.parameters.size
    row[prefix + "drive"], row[prefix + "law"] = RAMPS, 0
    row[prefix + "first"], row[prefix + "last"] = first, first + 3
    return model._replace(parameters=np.append(model.parameters, [value, rate, 0.0]))
