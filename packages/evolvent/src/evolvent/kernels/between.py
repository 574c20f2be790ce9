"""What lies on straight lines between the ends of a step."""

from __future__ import annotations

import math

from evolvent.compiled.jit import inlined


@inlined
def vector_at(y, q):
    """Vector at q."""
    return y[q], y[q + 1], y[q + 2]


@inlined
def _to(y, a, b):
    """Vector from the one at a to the one at b."""
    return y[b] - y[a], y[b + 1] - y[a + 1], y[b + 2] - y[a + 2]


@inlined
def scale_between(theta, a, b, p):
    """What brings the vector p, between a and b, to the length on the straight line between theirs."""
    first = math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])
    last = math.sqrt(b[0] * b[0] + b[1] * b[1] + b[2] * b[2])
    size = math.sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2])
    if not size > 0.1 * (first + last):  # half a turn in a step
        return 1.0
    return (first + theta * (last - first)) / size


@inlined
def _shorter(p, rest):
    """Whether the vector p is shorter than a length."""
    return p[0] * p[0] + p[1] * p[1] + p[2] * p[2] < rest * rest


@inlined
def keep_lengths(theta, y0, y1, q, size, count, rest, y):
    """Move the nodes of a line, `count` from q on and `size` apart, to where the lengths between them are on lines.

    Segments that are shorter than `rest` at an end of the step are slack there, and stay on the cubics.
    """
    ox = oy = oz = 0.0  # what the nodes so far have been moved by
    before = vector_at(y, q)
    for i in range(1, count):
        at = q + size * i
        now = vector_at(y, at)
        p = (now[0] - before[0], now[1] - before[1], now[2] - before[2])
        first, last = _to(y0, at - size, at), _to(y1, at - size, at)
        more = scale_between(theta, first, last, p) - 1.0
        if rest > 0.0 and (_shorter(first, rest) or _shorter(last, rest)):
            more = 0.0
        ox, oy, oz = ox + more * p[0], oy + more * p[1], oz + more * p[2]
        y[at], y[at + 1], y[at + 2] = now[0] + ox, now[1] + oy, now[2] + oz
        before = now
