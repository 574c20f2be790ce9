"""One swing: a motion of one coordinate about an equilibrium, with its resistances, at given times.

m(x) x'' + m'(x) x'^2 / 2 + w0^2 G(x) = -2 d x' - mu sgn(x') - q x' |x'|

G is `sine` sin(x) H(0) / H(x) + `line` x + `cube` x^3 with H = sqrt(S + 2 P cos x), the depth at which a body hangs on
wires; m = 1 + w0^2 e H'^2 is the inertia of the lift. A pendulum has P = 0, S = 1, sine = 1; a linear spring line = 1.
An imaginary x, whose square is negative, has the frequency rise with its size as that of a real one falls: so an
estimate of the square about zero is not biased.

Runge-Kutta's method of fourth order with steps that end where the velocity changes its sign, since dry friction and the
drag of air change there; between steps x is the quintic that has the places, velocities and accelerations of their
ends. Where friction holds the body it rests.
"""

import math

from evolvent_base import packages

if "evolvent" in packages.folders():
    from numba import types

    from evolvent.compiled.jit import MATRIX, VECTOR, indirect, inlined

    MOTION, ENVELOPE = types.void(VECTOR, VECTOR, MATRIX), types.void(VECTOR, VECTOR, VECTOR)
else:  # the same digits, 30 times slower
    from evolvent_massprops.plain import indirect, inlined

    MOTION = ENVELOPE = None

#: Places in `p`: frequency w0, rad/s; d, 1/s; mu; q; x(0); x'(0) / w0; sine, line, cube; P, S, e; 1 for an imaginary
#: amplitude, else 0.
W, VISCOUS, DRY, DRAG, START, RATE, SINE, LINE, CUBE, PRODUCT, SQUARE, LIFT, IMAGINARY, SIZE = range(14)
#: Steps in a period: frequencies are then 3e-9 too low.
STEPS = 256
#: Newton steps by which the end of a step is found where the velocity is zero.
_NEWTON = 12


@inlined
def _circular(p, x):
    """sin x and cos x; sinh x and cosh x where the amplitude is imaginary."""
    if p[IMAGINARY] != 0.0:
        return math.sinh(x), math.cosh(x)
    return math.sin(x), math.cos(x)


@inlined
def _restoring(p, x):
    """G(x)."""
    G = p[LINE] * x + p[CUBE] * x * x * x
    if p[SINE] != 0.0:
        sine, cosine = _circular(p, x)
        H0, H = math.sqrt(p[SQUARE] + 2.0 * p[PRODUCT]), math.sqrt(p[SQUARE] + 2.0 * p[PRODUCT] * cosine)
        G += p[SINE] * sine * H0 / H
    return G


@inlined
def _acceleration(p, x, v, s):
    """x'' at x and x' = v, with resistances of the sign s."""
    w2 = p[W] * p[W]
    a = -w2 * _restoring(p, x) - 2.0 * p[VISCOUS] * v - s * (p[DRY] + p[DRAG] * v * v)
    if p[LIFT] != 0.0:
        sine, cosine = _circular(p, x)
        sign = 1.0 if p[IMAGINARY] != 0.0 else -1.0
        H = math.sqrt(p[SQUARE] + 2.0 * p[PRODUCT] * cosine)
        slope = sign * p[PRODUCT] * sine / H
        bend = sign * p[PRODUCT] * cosine / H - slope * slope / H
        lift = -sign * w2 * p[LIFT]
        a = (a - lift * slope * bend * v * v) / (1.0 + lift * slope * slope)
    return a


@inlined
def _step(p, x, v, s, h):
    """(x, x') after a step h with resistances of the sign s."""
    a1 = _acceleration(p, x, v, s)
    v2 = v + 0.5 * h * a1
    a2 = _acceleration(p, x + 0.5 * h * v, v2, s)
    v3 = v + 0.5 * h * a2
    a3 = _acceleration(p, x + 0.5 * h * v2, v3, s)
    v4 = v + h * a3
    a4 = _acceleration(p, x + h * v3, v4, s)
    return x + h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4), v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)


@inlined
def _between(p, x, v, a, y, u, b, h, r):
    """(x, x') at the share r of a step h: the quintic through places, velocities and accelerations at its ends."""
    c3 = 10.0 * (y - x) - h * (6.0 * v + 4.0 * u) - 0.5 * h * h * (3.0 * a - b)
    c4 = -15.0 * (y - x) + h * (8.0 * v + 7.0 * u) + 0.5 * h * h * (3.0 * a - 2.0 * b)
    c5 = 6.0 * (y - x) - 3.0 * h * (v + u) - 0.5 * h * h * (a - b)
    place = x + r * (h * v + r * (0.5 * h * h * a + r * (c3 + r * (c4 + r * c5))))
    rate = v + r * (h * a + r * (3.0 * c3 + r * (4.0 * c4 + r * 5.0 * c5)) / h)
    return place, rate


@inlined
def _keep(p, out, k, x, v, a):
    out[k, 0] = x
    out[k, 1] = v / p[W]
    out[k, 2] = a / (p[W] * p[W])


@indirect(MOTION)
def motion(p, time, out):
    """x, x' / w0 and x'' / w0^2 of a swing at rising times, s.

    Parameters
    ----------
    p : (SIZE,) see the names of places above
    time : (n,) s, from the start on
    out : (n, 3), written
    """
    n, k = len(time), 0
    x, v, t, h = p[START], p[RATE] * p[W], 0.0, 2.0 * math.pi / (STEPS * p[W])
    turns = p[DRY] != 0.0 or p[DRAG] != 0.0
    s = 1.0 if v > 0.0 or (v == 0.0 and x < 0.0) else -1.0
    rests = turns and v == 0.0 and abs(_restoring(p, x)) * p[W] * p[W] <= p[DRY]
    while k < n and not rests:
        y, u = _step(p, x, v, s, h)
        taken = h
        if turns and u * s < 0.0:
            taken = h * v / (v - u)
            for _ in range(_NEWTON):
                y, u = _step(p, x, v, s, taken)
                change = u / _acceleration(p, y, u, s)
                taken = min(max(taken - change, 0.0), h)
                if abs(change) < 1e-13 * h:
                    break
            y, u = _step(p, x, v, s, taken)
            u = 0.0
        a, b = _acceleration(p, x, v, s), _acceleration(p, y, u, s)
        while k < n and (time[k] < t + taken):
            r = (time[k] - t) / taken
            place, rate = _between(p, x, v, a, y, u, b, taken, r)
            _keep(p, out, k, place, rate, _acceleration(p, place, rate, s))
            k += 1
        t += taken
        x, v = y, u
        if not (abs(x) < 1e6 and abs(v) < 1e6 * p[W]):
            rests, x = True, math.nan
        elif v == 0.0 and turns:
            s = -s
            rests = abs(_restoring(p, x)) * p[W] * p[W] <= p[DRY]
    while k < n:
        _keep(p, out, k, x, 0.0 * x, 0.0 * x)
        k += 1


@indirect(ENVELOPE)
def envelope(rates, time, out):
    """b of b' = -(d b + D + Q b^2), b(0) = 1, at rising times, s; 0 from where it has come to 0.

    Parameters
    ----------
    rates : (3,) d, D, Q, 1/s
    time : (n,) s
    out : (n,), written
    """
    n, k, b, t = len(time), 0, 1.0, 0.0
    d, D, Q = rates[0], rates[1], rates[2]
    h = 0.02 / (abs(d) + abs(D) + abs(Q) + 1.0 / max(time[n - 1], 1e-300))
    while k < n:
        m1 = -(d * b + D + Q * b * b)
        c = b + 0.5 * h * m1
        m2 = -(d * c + D + Q * c * c)
        c = b + 0.5 * h * m2
        m3 = -(d * c + D + Q * c * c)
        c = b + h * m3
        m4 = -(d * c + D + Q * c * c)
        c = b + h / 6.0 * (m1 + 2.0 * m2 + 2.0 * m3 + m4)
        end = -(d * c + D + Q * c * c)
        while k < n and time[k] <= t + h:
            r = (time[k] - t) / h
            q = 1.0 - r
            found = (1.0 + 2.0 * r) * q * q * b + r * q * q * h * m1 + r * r * (3.0 - 2.0 * r) * c - r * r * q * h * end
            out[k] = max(found, 0.0)
            k += 1
        b, t = c, t + h
        if b <= 0.0 or not b < 1e6:
            while k < n:
                out[k] = 0.0
                k += 1
