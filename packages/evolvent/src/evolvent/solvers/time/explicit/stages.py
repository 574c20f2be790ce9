"""Stages of a step of an explicit Runge-Kutta method, and the states between its ends."""

from __future__ import annotations

import math

import numpy as np

from evolvent.compiled.jit import inlined
from evolvent.equations.rhs import rhs


@inlined
def _next_weight(b, i, count):
    """The first of the stages i, i + 1, ... with a weight; `count` or more for none."""
    while i < count and b[i] == 0.0:
        i += 1
    return i


@inlined
def add_stages(b, count, y, h, K, out):
    """Out = y + h sum of b_i K_i over the first `count` stages."""
    i = _next_weight(b, 0, count)
    j = _next_weight(b, i + 1, count)
    first, second = h * b[i], h * b[j] if j < count else 0.0
    if j < count:
        for n in range(y.size):
            out[n] = (y[n] + first * K[i, n]) + second * K[j, n]
    else:
        for n in range(y.size):
            out[n] = y[n] + first * K[i, n]
    while j < count:  # two stages in a pass over memory
        i = _next_weight(b, j + 1, count)
        j = _next_weight(b, i + 1, count)
        if j < count:
            first, second = h * b[i], h * b[j]
            for n in range(y.size):
                out[n] = (out[n] + first * K[i, n]) + second * K[j, n]
        elif i < count:
            first = h * b[i]
            for n in range(y.size):
                out[n] += first * K[i, n]


@inlined
def stages(A, c, model, t, y, s, h, first, until, work):
    """Stages `first` and later of one step into work.K.

    A stage at the next break `until` sees the time just before it: what jumps there jumps in the step that follows.
    """
    latest = np.nextafter(until, -math.inf)
    K, w = work.K, work.w
    for i in range(first, c.size):
        add_stages(A[i], i, y, h, K, w)
        rhs(min(t + c[i] * h, latest), w, s, model, K[i])
    work.loop.rhs_evaluations += c.size - first


@inlined
def interpolate(P, y, K, h, theta, out):
    """Continuous extension at t + theta h."""
    for n in range(y.size):
        out[n] = y[n]
    for i in range(P.shape[0]):
        a = h * theta * (P[i, 0] + theta * (P[i, 1] + theta * (P[i, 2] + theta * P[i, 3])))
        if a != 0.0:
            for n in range(y.size):
                out[n] += a * K[i, n]


@inlined
def find_state(A, b, c, P, t, h, theta, until, model, work):
    """Put the state at t + theta h into work.w, by the continuous extension or, without one, by a step."""
    if P.size > 0:
        interpolate(P, work.y, work.K, h, theta, work.w)
    else:
        stages(A, c, model, t, work.y, work.s, theta * h, 1, until, work)
        add_stages(b, b.size, work.y, theta * h, work.K, work.w)
