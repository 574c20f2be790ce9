"""Distances that a step passes through zero and back: what its ends do not show of a latch, a stop, the end of a curve.

A distance lies on the cubic that has its values and rates at both ends of the step.
"""

import math

from evolvent.compiled.jit import inlined

#: Halvings by which the place is found.
_HALVINGS = 50


@inlined
def first_passage(a, b, p, q, least):
    """Part of a step at which a distance first falls through zero where it comes below -least in between; 1 for none.

    Parameters
    ----------
    a, b : float, the distance at both ends; p, q : its rates there, times the length of the step
    """
    if not (a > least and b > -least and p < 0.0 and q > 0.0):
        return 1.0
    second, third = 3.0 * (b - a) - 2.0 * p - q, 2.0 * (a - b) + p + q
    square = second * second - 3.0 * third * p
    if square < 0.0 or not second + math.sqrt(square) > 0.0:
        return 1.0
    high = -p / (second + math.sqrt(square))  # where it is least
    if high >= 1.0 or not a + high * (p + high * (second + high * third)) < -least:
        return 1.0
    low = 0.0
    for _ in range(_HALVINGS):
        at = 0.5 * (low + high)
        if a + at * (p + at * (second + at * third)) < 0.0:
            high = at
        else:
            low = at
    return high
