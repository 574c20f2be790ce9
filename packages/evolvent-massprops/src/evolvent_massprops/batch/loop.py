"""Compiled loops over the steps of a block of bodies (see `evolvent_massprops.batch.rates`)."""

import math

from numba import types

from evolvent.compiled.jit import MATRIX, REAL, VECTOR, entry, inlined, kernel
from evolvent_massprops.batch import rates
from evolvent_massprops.batch.rates import DISSIPATED, N_STATE, WIDTH, Q, V, W, X

_CUBE = types.float64[:, :, ::1]


@inlined
def turn_state(y, tx, ty, tz):
    """Turn every body by its rotation vector (tx, ty, tz) : (WIDTH,) each, inertial axes."""
    for c in range(WIDTH):
        x, z, e = tx[c], ty[c], tz[c]
        angle = math.sqrt(x * x + z * z + e * e)
        k = 0.5 if angle < 1e-12 else math.sin(0.5 * angle) / angle
        w = math.cos(0.5 * angle)
        x, z, e = k * x, k * z, k * e
        a, b, d, f = y[Q, c], y[Q + 1, c], y[Q + 2, c], y[Q + 3, c]
        y[Q, c] = w * a - x * b - z * d - e * f
        y[Q + 1, c] = w * b + x * a + z * f - e * d
        y[Q + 2, c] = w * d + z * a + e * b - x * f
        y[Q + 3, c] = w * f + e * a + x * d - z * b


@inlined
def combine(y, start, weights, n, h, K):
    """Y = start + h sum of weights[j] K[j], j < n."""
    for r in range(N_STATE):
        for c in range(WIDTH):
            y[r, c] = start[r, c]
    for j in range(n):
        factor = h * weights[j]
        if factor != 0.0:
            for r in range(N_STATE):
                for c in range(WIDTH):
                    y[r, c] += factor * K[j, r, c]


@kernel
def hold_yaw(bodies):
    """Take off what a step has left of the yaw of guided bodies."""
    y, guided = bodies.y, bodies.guided
    for c in range(WIDTH):
        if guided[0, c] == 0.0:
            continue
        a, b, d, e = y[Q, c], y[Q + 1, c], y[Q + 2, c], y[Q + 3, c]
        scale = 1.0 / math.sqrt(a * a + b * b + d * d + e * e)
        a, b, d, e = a * scale, b * scale, d * scale, e * scale
        Xx, Xy, Xz = 1.0 - 2.0 * (d * d + e * e), 2.0 * (b * d + a * e), 2.0 * (b * e - a * d)
        half = 0.5 * Xz / Xx  # turn about y by twice this
        y[Q, c], y[Q + 1, c] = a - half * d, b + half * e
        y[Q + 2, c], y[Q + 3, c] = d + half * a, e - half * b
        rate = (Xy * y[W, c] - Xx * y[W + 1, c]) / (Xx * Xx + Xy * Xy)
        y[W, c] -= rate * Xy
        y[W + 1, c] += rate * Xx


@kernel
def modified_euler(bodies, springs, h, steps, K):
    """Take `steps` steps of the stand's scheme from the state bodies.y and its derivative bodies.dy.

    Notes
    -----
    With the accelerations a and eps at the start: half a step x + v h/2 + a (h/2)^2/2, turned by w h/2 + eps (h/2)^2/2;
    the accelerations there, a_h and eps_h, carry the whole step x + v h + a_h h^2/2, v + a_h h, and the same for the
    rotation, whose second part is what the first has left; then the accelerations again. Belyakov
    (2002), steps 1 to 10.
    """
    y, dy = bodies.y, bodies.dy
    start, turned = K[0], K[1]
    for _ in range(steps):
        for r in range(N_STATE):
            for c in range(WIDTH):
                start[r, c] = y[r, c]
        for k in range(3):
            for c in range(WIDTH):
                turned[k, c] = 0.5 * h * start[W + k, c] + 0.125 * h * h * dy[W + k, c]
                y[X + k, c] = start[X + k, c] + 0.5 * h * start[V + k, c] + 0.125 * h * h * dy[V + k, c]
                y[V + k, c] = start[V + k, c] + 0.5 * h * dy[V + k, c]
                y[W + k, c] = start[W + k, c] + 0.5 * h * dy[W + k, c]
        turn_state(y, turned[0], turned[1], turned[2])
        rates.rates(bodies, springs)
        for k in range(3):
            for c in range(WIDTH):
                turned[k, c] = h * start[W + k, c] + 0.5 * h * h * dy[W + k, c] - turned[k, c]
                y[X + k, c] = start[X + k, c] + h * start[V + k, c] + 0.5 * h * h * dy[V + k, c]
                y[V + k, c] = start[V + k, c] + h * dy[V + k, c]
                y[W + k, c] = start[W + k, c] + h * dy[W + k, c]
        for c in range(WIDTH):
            y[DISSIPATED, c] = start[DISSIPATED, c] + h * dy[DISSIPATED, c]
        turn_state(y, turned[0], turned[1], turned[2])
        hold_yaw(bodies)
        rates.rates(bodies, springs)


@kernel
def runge_kutta(bodies, springs, A, b, h, steps, K):
    """Take `steps` explicit Runge-Kutta steps from the state bodies.y; K : (s + 1, N_STATE, WIDTH) is scratch."""
    y, dy = bodies.y, bodies.dy
    stages = b.size
    start = K[stages]
    for _ in range(steps):
        for r in range(N_STATE):
            for c in range(WIDTH):
                start[r, c] = y[r, c]
        for i in range(stages):
            if i > 0:
                combine(y, start, A[i], i, h, K)
            rates.rates(bodies, springs)
            for r in range(N_STATE):
                for c in range(WIDTH):
                    K[i, r, c] = dy[r, c]
        combine(y, start, b, stages, h, K)
        hold_yaw(bodies)


@entry(rates.BODIES_TYPE, _CUBE, MATRIX, VECTOR, REAL, types.int64, _CUBE, _CUBE)
@kernel
def advance_block(bodies, springs, A, b, h, steps, K, out):
    """Fill out : (nt, N_STATE, WIDTH) with the states after every `steps` steps of `h` s."""
    block = bodies[0]
    if b.size == 0:
        rates.rates(block, springs)
    for i in range(out.shape[0]):
        if b.size == 0:
            modified_euler(block, springs, h, steps, K)
        else:
            runge_kutta(block, springs, A, b, h, steps, K)
        for r in range(N_STATE):
            for c in range(WIDTH):
                out[i, r, c] = block.y[r, c]
