"""A membrane strip that spins about an axis through its root; see `evolvent.closed_forms`.

The strip of length l has the mass m per length and turns at W about the axis z; x runs outwards from the axis. It has
no bending stiffness and no torsional stiffness but that of its tension N = m W^2 (l^2 - x^2)/2, and its root turns
freely about both axes across x. With x over l the operator of all small motions is Legendre's, L u = ((1 - x^2) u')'/2,
whose regular solutions are the functions P_v(x), L P_v = -v (v + 1)/2 P_v (Abramowitz & Stegun 1964, 8.1.1).
"""

from __future__ import annotations

import numpy as np

Array = np.ndarray
_TERMS = 200


def spinning_strip_modes(count: int) -> tuple[Array, Array, Array]:
    """Squares of the frequencies of flap, lag and twist over the square of the rate, (count,) each.

    Parameters
    ----------
    count : int, number of modes of each kind

    Returns
    -------
    flap, lag, twist : (count,) float, (w/W)^2

    Notes
    -----
    Out of the plane of the spin w'' = W^2 L w with w(0) = 0: odd Legendre polynomials, n (n + 1)/2 = 1, 6, 15. In the
    plane the centrifugal force has a component along the deflection, which takes 1: 0, 5, 14. Twist has the torque
    N r^2 u' of the tension, r the radius of gyration of the chord, and the moment -m r^2 W^2 u that turns the chord
    into the plane of the spin, which adds 1: 2, 7, 16 (MacNeal 1967, heliogyro).
    """
    n = 2.0 * np.arange(count) + 1.0
    flap = 0.5 * n * (n + 1.0)
    return flap, flap - 1.0, flap + 1.0


def _legendre(square: float, x: Array) -> Array:
    """P_v(x), -1 < x <= 1, by v (v + 1) = square, a real number of any sign.

    Notes
    -----
    The hypergeometric series F(-v, v + 1; 1; (1 - x)/2), whose terms depend on v (v + 1) alone.
    """
    z = 0.5 * (1.0 - np.asarray(x, dtype=float))
    term = total = np.ones_like(z)
    for k in range(_TERMS):
        term = term * z * (k * (k + 1.0) - square) / (k + 1.0) ** 2
        total = total + term
    return np.asarray(total)


def driven_twist(ratio: float, place: Array) -> Array:
    """Pitch along a strip over that of its root, which is driven harmonically, in phase or in antiphase.

    Parameters
    ----------
    ratio : float, frequency of the drive over the rate of the spin; 0 for a constant pitch
    place : (...,) float, x/l, from 0 to 1

    Returns
    -------
    (...,) float, pitch over that of the root

    Notes
    -----
    L u = (1 - ratio^2) u with the pitch given at the root and a regular tip: P_v(x)/P_v(0) with v (v + 1)/2 =
    ratio^2 - 1. At the rate of the spin all pitches are equal; at twice the rate u = 1 - 3 x^2.
    """
    square = 2.0 * (ratio**2 - 1.0)
    return np.asarray(_legendre(square, place) / _legendre(square, np.zeros(1))[0])


def sunlight_coning(place: Array) -> Array:
    """Deflection w over p of a strip under a uniform force across it, p = f/(m W^2) with the force f per length.

    Parameters
    ----------
    place : (...,) float, x/l, from 0 to 1

    Returns
    -------
    (...,) float, w/p

    Notes
    -----
    The tension carries f (l - x) at x: N w' = f (l - x), w' = 2 p/(l + x), w = 2 p ln(1 + x/l). The slope at the root
    is 2 p/l. Small deflections; for light along z f is (1 + reflectivity) times pressure times chord.
    """
    return 2.0 * np.log1p(np.asarray(place, dtype=float))
