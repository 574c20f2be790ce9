"""Moments of inertia from pendulums: torsion, bifilar, trifilar, compound.

All functions take numbers or arrays, broadcast. `frequency` is undamped, rad/s (2 pi over the period); `amplitude` is
that of the swing, rad. With `budget` each of them gives the uncertainty of its result.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import scipy

from evolvent_base.errors import InputError
from evolvent_massprops.inertia.stand import G0
from evolvent_massprops.inertia.uncertainty import Budget, propagate

NODES, WEIGHTS = np.polynomial.legendre.leggauss(24)
PHI = 0.25 * np.pi * (NODES + 1.0)


def positive(**values: Any) -> list[np.ndarray]:
    """Arrays of values that are finite and above zero."""
    result = []
    for name, value in values.items():
        x = np.asarray(value, dtype=float)
        if not np.all(np.isfinite(x)) or np.any(x <= 0.0):
            raise InputError(f"{name} is {' '.join(str(value).split())[:200]}; it must be a finite number above 0")
        result.append(x)
    return result


def swing(amplitude: Any) -> np.ndarray:
    """Amplitude of a swing, rad, from 0 to below pi."""
    x = np.asarray(amplitude, dtype=float)
    if not np.all((x >= 0.0) & (x < np.pi)):
        raise InputError(f"amplitude is {amplitude!r}; it must lie from 0 to below pi")
    return x


def torsion(frequency: Any, *, stiffness: Any) -> np.ndarray:
    """I = kappa / omega^2, kg m2, of a body on a wire of torsional stiffness kappa, N m/rad; at any amplitude."""
    w, stiffness = positive(frequency=frequency, stiffness=stiffness)
    return stiffness / w**2


def compound(frequency: Any, *, mass: Any, distance: Any, amplitude: Any = 0.0, gravity: Any = G0) -> np.ndarray:
    """Moment about the centre of mass, kg m2, of a body that swings about a pivot.

    Parameters
    ----------
    frequency : float, rad/s
    mass, distance : float, kg, and m from the pivot to the centre of mass
    amplitude : float, rad
    gravity : float, m/s2

    Notes
    -----
    I = M g r / omega_0^2 - M r^2 with omega_0 = omega 2 K(sin^2(A/2)) / pi the frequency of a small swing.
    """
    w, mass, r, gravity = positive(frequency=frequency, mass=mass, distance=distance, gravity=gravity)
    small = w * scipy.special.ellipk(np.sin(0.5 * swing(amplitude)) ** 2) * 2.0 / np.pi
    result = mass * gravity * r / small**2 - mass * r**2
    if np.any(result <= 0.0):
        raise InputError("frequency is above that of a point mass at this distance; check frequency and distance")
    return result


def multifilar(
    frequency: Any,
    *,
    mass: Any,
    length: Any,
    radius: Any,
    radius_above: Any = None,
    amplitude: Any = 0.0,
    wire_stiffness: Any = 0.0,
    gravity: Any = G0,
) -> np.ndarray:
    """Moment about the vertical axis, kg m2, of a body that turns on equal wires around its centre of mass.

    Parameters
    ----------
    frequency : float, rad/s
    mass : float, kg, of all that hangs
    length : float, m, of the wires
    radius, radius_above : float, m
        From the axis to the wires on the body and on the ceiling; equal if the second is left out.
    amplitude : float, rad
    wire_stiffness : float, N m/rad, torsional, of all wires together
    gravity : float, m/s2

    Notes
    -----
    The body hangs at the depth H(theta) = sqrt(L^2 - R^2 - r^2 + 2 R r cos theta), so that small swings give
    I = (M g R r / H + kappa) / omega^2. For an amplitude A the period of the exact motion, which lifts the body,

        T = 4 int_0^A sqrt((I + M H'^2) / (2 M g (H - H(A)) + kappa (A^2 - theta^2))) d theta,

    is solved for I, with Gauss' quadrature in theta = A sin phi.
    """
    w, mass, length, r, gravity = positive(
        frequency=frequency, mass=mass, length=length, radius=radius, gravity=gravity
    )
    (R,) = (r,) if radius_above is None else positive(radius_above=radius_above)
    A, kappa = swing(amplitude), np.asarray(wire_stiffness, dtype=float)
    if np.any(kappa < 0.0):
        raise InputError(f"wire_stiffness is {wire_stiffness!r}; it must be 0 or above")
    square = length**2 - R**2 - r**2
    if np.any(square + 2.0 * R * r * np.cos(A) <= 0.0):
        raise InputError("length is too short: wires do not reach from radius_above to radius at this amplitude")
    inertia = (mass * gravity * R * r / np.sqrt(square + 2.0 * R * r) + kappa) / w**2
    if not np.any(A > 0.0):
        return inertia
    A, mass, gravity, kappa, w, product, square, inertia = (
        x[..., None] for x in np.broadcast_arrays(A, mass, gravity, kappa, w, R * r, square, inertia)
    )
    A = np.maximum(A, 1e-6)
    theta = A * np.sin(PHI)
    H, end = np.sqrt(square + 2.0 * product * np.cos(theta)), np.sqrt(square + 2.0 * product * np.cos(A))
    slope = product * np.sin(theta) / H
    # H - H(A) without cancellation
    fall = 4.0 * product * np.sin(0.5 * (A + theta)) * np.sin(0.5 * (A - theta)) / (H + end)
    pace = 1.0 / (2.0 * mass * gravity * fall + kappa * (A**2 - theta**2))
    for _ in range(30):
        speed = np.sqrt((inertia + mass * slope**2) * pace) * A * np.cos(PHI) * WEIGHTS
        period = np.pi * speed.sum(axis=-1, keepdims=True)  # 4 times pi/4 of the interval
        change = (2.0 * np.pi / w / period) ** 2
        inertia = inertia * change
        if np.all(np.abs(change - 1.0) < 1e-14):
            break
    return inertia[..., 0]


def bifilar(frequency: Any, *, mass: Any, length: Any, spacing: Any, **rest: Any) -> np.ndarray:
    """Moment, kg m2, of a body on two wires: `multifilar` with half the `spacing`, m, of the wires as radius."""
    (spacing,) = positive(spacing=spacing)
    return multifilar(frequency, mass=mass, length=length, radius=0.5 * spacing, **rest)


def trifilar(frequency: Any, *, mass: Any, length: Any, radius: Any, **rest: Any) -> np.ndarray:
    """Moment, kg m2, of a body on three wires at one radius, m: `multifilar`."""
    return multifilar(frequency, mass=mass, length=length, radius=radius, **rest)


def budget(pendulum: Callable[..., np.ndarray], values: Mapping[str, float], std: Mapping[str, float]) -> Budget:
    """The moment that a pendulum gives, with the uncertainty that each measured number adds.

    Parameters
    ----------
    pendulum : function of this module
    values : mapping of str to float, its arguments by name
    std : mapping of str to float, their standard deviations; one left out is exact
    """
    names = tuple(values)

    def function(x: np.ndarray) -> np.ndarray:
        given = dict(zip(names, np.moveaxis(x, -1, 0), strict=True))
        return pendulum(given.pop("frequency"), **given)[..., None]

    if "frequency" not in names:
        raise InputError("values hold no frequency; a pendulum's moment comes from it")
    return propagate(function, values, std, outputs=("I",))[0]
