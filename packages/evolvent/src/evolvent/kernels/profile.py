"""Functions of time by which loads act: piecewise polynomials, sines, expressions, and the window of a load.

A profile stands among the model's parameters: its kind, then what the kind needs.
"""

import math

from numba import types

from evolvent.compiled.jit import REAL, indirect, inlined
from evolvent.compiled.views import local_vector
from evolvent.kernels.expression import evaluate
from evolvent.model import MODEL

PIECES, SINE, EXPRESSION = 0, 1, 2
#: Coefficients of one piece, of the powers 5 to 0 of the time since its start.
COEFFICIENTS = 6


@inlined
def window(t, start, end, ramp):
    """Factor of a load that acts from `start` to `end` (excluded) and grows smoothly over `ramp`."""
    if t < start or t >= end:
        return 0.0
    if ramp > 0.0 and t < start + ramp:
        s = (t - start) / ramp
        return s * s * (3.0 - 2.0 * s)
    return 1.0


@inlined
def row_before(p, first, n, x):
    """The row at or before x of n rising numbers from p[first] on, the last but one at most; by bisection."""
    low, high = 0, n - 1
    while high - low > 1:
        middle = (low + high) // 2
        if p[first + middle] <= x:
            low = middle
        else:
            high = middle
    return low


@inlined
def pieces(p, at, t):
    """Value of a piecewise polynomial.

    Parameters
    ----------
    p, at : parameters, and the index of its own: n, value before the first time, value from the last time on, the n
        times (s), then the coefficients of each of the n - 1 pieces
    """
    n = int(p[at])
    first = at + 3
    if t < p[first]:
        return p[at + 1]
    if t >= p[first + n - 1]:
        return p[at + 2]
    low = row_before(p, first, n, t)
    s = t - p[first + low]
    c = first + n + COEFFICIENTS * low
    return ((((p[c] * s + p[c + 1]) * s + p[c + 2]) * s + p[c + 3]) * s + p[c + 4]) * s + p[c + 5]


@indirect(REAL(REAL, types.int64, MODEL))
def profile(t, at, model):
    """Value at time t of the profile at index `at` of the model's parameters.

    Notes
    -----
    SINE: offset + amplitude sin(w (t - start) + phase) from start to end (excluded), else 0.
    """
    p = model.parameters
    if p[at] == PIECES:
        return pieces(p, at + 1, t)
    if p[at] == SINE:
        start = p[at + 5]
        if t < start or t >= p[at + 6]:
            return 0.0
        return p[at + 4] + p[at + 1] * math.sin(p[at + 2] * (t - start) + p[at + 3])
    variables = local_vector()
    variables[0] = t
    return evaluate(p, at + 1, variables)


@inlined
def factor_at(t, start, end, ramp, at, model):
    """`window`, times the profile at index `at` of the parameters, -1 for none."""
    value = window(t, start, end, ramp)
    return value * profile(t, at, model) if value != 0.0 and at >= 0 else value
