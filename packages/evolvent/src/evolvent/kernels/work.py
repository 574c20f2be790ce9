"""Powers of loads and fields at the samples of a finished run, and their works since the first one.

The pass over the samples (`evolvent.equations.sampling`) calls these in order: records hold the sample before until
then.
"""

import math

from numba import types

from evolvent.compiled.jit import REAL, indirect, inlined
from evolvent.kernels.profile import factor_at
from evolvent.model import MODEL

USED_FOR = ("loads", "beam_loads")
#: Points and weights of Gauss's rule on [0, 1].
_OUTER, _INNER = (0.5 * math.sqrt((3.0 + sign * 2.0 * math.sqrt(1.2)) / 7.0) for sign in (1.0, -1.0))
_LOW, _HIGH = ((18.0 + sign * math.sqrt(30.0)) / 72.0 for sign in (-1.0, 1.0))
_GAUSS = ((0.5 - _OUTER, _LOW), (0.5 - _INNER, _HIGH), (0.5 + _INNER, _HIGH), (0.5 + _OUTER, _LOW))


@inlined
def note_power(row, n, times, power):
    """Power at sample n into a record, and its work, by the trapezoidal rule."""
    row.work = 0.0 if n == 0 else row.work + 0.5 * (power + row.power) * (times[n] - times[n - 1])
    row.power = power


@indirect(REAL(REAL, REAL, REAL, REAL, REAL, REAL, REAL, REAL, types.int64, MODEL))
def work_between(t0, t1, rate0, rate1, mean, start, end, ramp, at, model):
    """Work from t0 to t1 of a load with the powers rate0 and rate1 at both ends and the mean `mean`, at the factor 1.

    Parameters
    ----------
    start, end, ramp, at : times and profile on which the factor depends (`profile.factor_at`)

    Notes
    -----
    The power at the factor 1 is quadratic; times the factor it is integrated by Gauss's rule of four points on the
    pieces between the breaks of the factor.
    """
    total, first = 0.0, t0
    while first < t1:
        last = t1
        for edge in (start, start + ramp, end):
            if first < edge < last:
                last = edge
        for i in range(model.breaks.size):
            if first < model.breaks[i] < last:
                last = model.breaks[i]
        for place, weight in _GAUSS:
            t = first + place * (last - first)
            s = (t - t0) / (t1 - t0)
            rate = (1.0 - s) * rate0 + s * rate1 + 6.0 * s * (1.0 - s) * (mean - 0.5 * (rate0 + rate1))
            total += weight * (last - first) * factor_at(t, start, end, ramp, at, model) * rate
        first = last
    return total


@inlined
def note_load(row, n, times, factor, rate, along, start, end, ramp, at, model):
    """Power of a load just after sample n into its record, times the load factor, and its work; returns its factor.

    Parameters
    ----------
    rate : float, W, power at the factor 1; along : float, J, integral of it, or NaN where that is not known
    start, end, ramp, at : as of `work_between`
    """
    if n == 0:
        row.work = 0.0
    else:
        t0, t1 = times[n - 1], times[n]
        mean = (along - row.along) / (t1 - t0) if along == along and t1 > t0 else 0.5 * (row.rate + rate)
        row.work += work_between(t0, t1, row.rate, rate, mean, start, end, ramp, at, model)
    row.rate, row.along = rate, along
    t, near = times[n], 1e-9 * (times[times.size - 1] - times[0])
    if abs(t - start) < near:
        t = start
    if abs(t - end) < near:
        t = end
    value = factor * factor_at(t, start, end, ramp, at, model)
    row.power = value * rate
    return value
