"""Error of an adaptive implicit step in rates, and what Newton's method may leave: one rule for both methods.

The error of a step in the coordinates, e ~ h^3 v''/12, is compared with a tolerance beside the system's size. Motion
that is small beside the system, such as a vibration, would have large errors in its rates: those are e/h ~ h^2 v''/12,
in proportion to the error of phase that builds up over a radian. So e/h is compared with the fastest motion of the run
so far as well, both as root mean squares weighted by the inertias: modes of small energy, such as the shear of a thin
rod, need not be resolved. Of motion of the system's size at w both are one:
(w h)^3/12 = tol where (w h)^2/12 ~ tol^(2/3).
"""

from __future__ import annotations

import math

from evolvent.compiled.jit import inlined

#: Share of the error of rates that Newton's method may leave in every step, for what it leaves has one sign for long.
LEFT_SHARE = 1e-5
#: Least correction at which an iteration has converged, beside the size of each unknown.
LEAST_NEWTON = 1e-12
#: Most that the error of rates counts beside that of coordinates: steps become ten times shorter for it at most.
MOST_SHARE = 1e3
#: What Newton's method has left is no part of an error that is so many times larger.
ABOVE_LEFT = 10.0
#: Steps after the last contact in which the estimate does not see rates: they jump there.
SETTLING = 3


def rate_tolerance(tolerance: float) -> float:
    """Error of rates beside the fastest one that a step may have, of the tolerance of coordinates."""
    return float(tolerance) ** (2.0 / 3.0)


@inlined
def fastest_rate(before, h, dq, shares):
    """Largest mean rate of a run, 1/s: that `before`, or that of a step's increments dq."""
    found = 0.0
    for i in range(dq.size):
        found += shares[i] * dq[i] * dq[i]
    return max(before, math.sqrt(found) / h)


@inlined
def note_step(loop, fastest):
    """Note for the estimates of the next steps what an accepted one has left, and whether something touched in it."""
    loop.fastest, loop.left0 = fastest, max(loop.left, 0.1 * loop.left0)
    loop.settling = SETTLING if loop.contact_set != 0 else max(loop.settling - 1, 0)


@inlined
def newton_limit(newton, sharp, rates, fastest, h):
    """Correction at which Newton's method has converged in a step of length h, beside the size of each unknown."""
    if sharp > 0.0 and fastest > 0.0:
        return min(newton, max(sharp * rates * fastest * h, LEAST_NEWTON))
    return newton


@inlined
def beside_tolerance(error, rates, h, dq, shares, loop, options):
    """Error of a step beside the tolerance, with that of its rates while nothing touches or slips, which would ring.

    Parameters
    ----------
    error, rates : float, of coordinates beside their sizes; sum of squares of the errors of coordinates times `shares`
    h, dq : s, length and increments of the step
    loop, options : records with `contact_set`, `settling`, `fastest`, `left` and `left0`; `tolerance` and `rates`
    """
    found, left = error / options.tolerance, max(loop.left, loop.left0)
    if loop.settling > 0 or loop.contact_set != 0 or error <= ABOVE_LEFT * left or options.rates <= 0.0:
        return found
    fastest = fastest_rate(loop.fastest, h, dq, shares)
    if fastest <= 0.0:
        return found
    beside = math.sqrt(rates) / (h * options.rates * fastest)
    return max(found, min(beside * beside**0.5, MOST_SHARE * found))
