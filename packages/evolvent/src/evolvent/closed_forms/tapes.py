"""Bending of rods whose section flattens, a tape spring or a lenticular rod; see `evolvent.closed_forms`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from evolvent.elements.materials import Material
from evolvent.elements.sections import Lenticular, TapeSection
from evolvent_base.errors import InputError

Array = np.ndarray
#: L of `flattened_bending` below which 1 - F is the first term of its series, with an error below 1e-6 of it.
_SMALL = 0.05


def flattened_bending(section: TapeSection, material: Material, curvature: Array | float) -> tuple[Array, Array]:
    """Moment and energy per length of uniform bending about z, where the flattening is that of least energy.

    Parameters
    ----------
    section : TapeSection or Lenticular
    material : Material
    curvature : float or array, 1/m, above 0 in opposite sense of a tape spring

    Returns
    -------
    moment, energy : array, N m and J/m

    Notes
    -----
    Wuest (1954), Mansfield (1973). With the radius R, s = R angle, D = E t^3/(12 (1 - nu^2)) and
    L^4 = 3 (1 - nu^2) s^4 x^2/t^2 the energy at the curvature x is::

        tape spring:  s D/2 ((1 - nu^2) x^2 + (1/R + nu x)^2 (1 - F)),  F = 2/L (cosh L - cos L)/(sinh L + sin L)
        lenticular:   s D (x^2 + (1 - F)/R^2),                          F = 1/L (sinh L + sin L)/(cosh L + cos L)

    and the moment is its slope.
    """
    if not isinstance(section, TapeSection):
        raise InputError(f"section is {type(section).__name__}; it must be TapeSection or Lenticular")
    x, nu = np.asarray(curvature, dtype=float), material.nu
    s, t, k0 = section.radius * section.angle, section.thickness, 1.0 / section.radius
    stiffness, closed = s * material.E * t**3 / (12.0 * (1.0 - nu * nu)), isinstance(section, Lenticular)
    u = 3.0 * (1.0 - nu * nu) * (s * s * x / t) ** 2
    L = np.maximum(np.sqrt(np.sqrt(u)), _SMALL)
    e = np.exp(-L)  # all terms are divided by the growing exponential
    sh, ch, sin, cos = 0.5 * (1.0 - e * e), 0.5 * (1.0 + e * e), e * np.sin(L), e * np.cos(L)
    if closed:
        F, turned = (sh + sin) / (L * (ch + cos)), 1.0 - (sh**2 - sin**2) / (ch + cos) ** 2
        first = u / 30.0
    else:
        F, turned = 2.0 * (ch - cos) / (L * (sh + sin)), 2.0 - 2.0 * (ch**2 - cos**2) / (sh + sin) ** 2
        first = u / 180.0
    series, at = np.square(np.square(_SMALL)) > u, np.where(x == 0.0, 1.0, x)
    lost = np.where(series, first, 1.0 - F)
    # 1 - F changes with x at 2 u/x of its rate by u, and L at L/(2 x)
    slope = np.where(series, 2.0 * first, 0.5 * (F - turned)) / at
    if closed:
        return 2.0 * stiffness * x + stiffness * k0**2 * slope, stiffness * (x * x + k0**2 * lost)
    own = k0 + nu * x
    moment = (1.0 - nu * nu) * x + nu * own * lost + 0.5 * own**2 * slope
    return stiffness * moment, 0.5 * stiffness * ((1.0 - nu * nu) * x * x + own**2 * lost)


class Snap(NamedTuple):
    """Moments at which a rod folds, and its fold.

    Attributes
    ----------
    peak_moment, peak_curvature : float, N m and 1/m, of the largest moment before the section flattens
    propagation_moment, fold_radius : float, N m and m, of a fold that grows slowly, without a drum
    """

    peak_moment: float
    peak_curvature: float
    propagation_moment: float
    fold_radius: float


def snap(section: TapeSection, material: Material, sense: int = 1) -> Snap:
    """When a rod with a section that flattens snaps, and the fold that it then has.

    Parameters
    ----------
    section : TapeSection or Lenticular
    material : Material
    sense : {1, -1}, 1 for bending of a tape spring in opposite sense

    Returns
    -------
    Snap
        The peak of the moment, and the fold.

    Notes
    -----
    Beyond the peak of the moment uniform bending is unstable. A fold grows at the least energy per angle, W/x, and has
    the radius 1/x of it (Maxwell's line; Seffen and Pellegrino 1999). On a drum of another radius a radian has more
    energy.
    """
    if sense not in (1, -1):
        raise InputError(f"sense is {sense!r}; it must be 1 or -1")
    x = np.geomspace(1e-4, 10.0, 20001) / section.radius
    moment, energy = flattened_bending(section, material, sense * x)
    falls = np.diff(np.abs(moment)) < 0.0
    if not falls.any():
        raise InputError(
            "section does not snap: its moment grows with the curvature; give a smaller radius or thickness"
        )
    peak = int(np.argmax(falls))
    least = peak + int(np.argmin(energy[peak:] / x[peak:]))
    return Snap(abs(float(moment[peak])), float(x[peak]), float(energy[least] / x[least]), float(1.0 / x[least]))
