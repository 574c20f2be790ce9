"""Consistent mass matrices and load vectors, one entry for each nodal vector (the kernels spread them over x, y, z)."""

from __future__ import annotations

import math

import numpy as np

from evolvent.elements.forms import Array, gauss
from evolvent.elements.materials import Material
from evolvent.elements.sections import SectionStiffness
from evolvent.elements.shape_functions import axis_shape
from evolvent.elements.shapes import CrossSection
from evolvent_base import units
from evolvent_base.errors import InputError
from evolvent_base.schema import Section

#: What a polar moment may be beyond its limits by rounding.
ROUNDED = 1e-6


class SectionInertia(Section):
    """Inertia of a beam per length, independent of its stiffness; keys left out follow from material and section.

    Parameters
    ----------
    mass_per_length : float, kg/m, optional
        Density times area if left out.
    inertia_x : float, kg m, optional
        Polar moment of inertia per length, about an axis through the mass centre along x; the sum of `inertia_y` and
        `inertia_z` if left out, as of every plane section. Of a `Rod` alone.
    inertia_y, inertia_z : float, kg m, optional
        Moments of inertia per length about axes through the mass centre along y and z of the section, int z^2 dm and
        int y^2 dm of a plane section; density times second moments if left out.
    inertia_yz : float, kg m, optional
        Product int y z dm; 0 if left out beside one of the moments.
    offset : (2,) float, m
        Position (y, z) of the mass centre relative to the centroid, in the section.
    """

    mass_per_length: units.LineDensity | None = None
    inertia_x: units.LineInertia | None = None
    inertia_y: units.LineInertia | None = None
    inertia_z: units.LineInertia | None = None
    inertia_yz: units.LineProduct | None = None
    offset: units.Pair = (0.0, 0.0)

    def values(self, section: CrossSection, material: Material | None) -> tuple[float, float, float, float]:
        """Mass per length, and moments int z^2 dm, int y^2 dm and int y z dm about the mass centre."""
        mass, about_y, about_z, product = _of_material(section, material)
        if self.inertia_yz is not None or self.inertia_y is not None or self.inertia_z is not None:
            product = self.inertia_yz or 0.0
        mass = mass if self.mass_per_length is None else self.mass_per_length
        about_y = about_y if self.inertia_y is None else self.inertia_y
        about_z = about_z if self.inertia_z is None else self.inertia_z
        for key, value in (("mass_per_length", mass), ("inertia_y", about_y), ("inertia_z", about_z)):
            if value != value:  # not a number
                raise InputError(f"{key} is missing; a section that is given by its stiffness matrix has no mass")
        if not product**2 < about_y * about_z:
            raise InputError(
                f"inertia_yz is {product:.6g} kg m; its square must be below that of inertia_y times inertia_z, "
                f"{about_y:.6g} and {about_z:.6g} kg m"
            )
        if self.inertia_x is not None:
            least, most = math.hypot(about_y - about_z, 2.0 * product), about_y + about_z
            if not least * (1.0 - ROUNDED) <= self.inertia_x <= most * (1.0 + ROUNDED):
                raise InputError(
                    f"inertia_x is {self.inertia_x:.6g} kg m; mass that has inertia_y and inertia_z, {about_y:.6g} and "
                    f"{about_z:.6g} kg m, has from {least:.6g} to {most:.6g} kg m, their difference (of the principal "
                    f"ones) and their sum"
                )
        return mass, about_y, about_z, product

    def polar(self, section: CrossSection, material: Material | None) -> float:
        """Moment of inertia per length about the axis through the mass centre along x."""
        _, about_y, about_z, _ = self.values(section, material)
        return about_y + about_z if self.inertia_x is None else self.inertia_x


def _of_material(section: CrossSection, material: Material | None) -> tuple[float, float, float, float]:
    """Mass per length, moments and product of a section's material; not a number of a section without a material."""
    if material is None or isinstance(section, SectionStiffness):
        return math.nan, math.nan, math.nan, math.nan
    s, rho = section.properties(material.nu), material.density
    return rho * s.area, rho * s.Iy, rho * s.Iz, rho * s.Iyz


#: That of the section's own material.
OWN_INERTIA = SectionInertia()


def beam_mass(length: float, section: CrossSection, material: Material, inertia: SectionInertia = OWN_INERTIA) -> Array:
    """M : (8, 8), kg and kg m2: int rho S^T S dV of the beam; section about its centroid.

    Notes
    -----
    A section with the mass m per length, moments J about its mass centre and the mass centre at (b, c) moves with the
    velocity r' + y b' + z c' of its points (primes are rates): m (r' + ..)^2/2 there, and J_zz b'^2 + J_yy c'^2 + ..
    """
    M = np.zeros((8, 8))
    for xi, weight in gauss(7):
        mass, about_y, about_z, product = inertia.values(section.at(xi), material)
        p, px, q, qx = axis_shape(length, xi)
        y = np.array([0, 0, 1 - xi, 0, 0, 0, xi, 0])
        z = np.array([0, 0, 0, 1 - xi, 0, 0, 0, xi])
        centre = np.array([p, px, 0, 0, q, qx, 0, 0]) + inertia.offset[0] * y + inertia.offset[1] * z
        here = mass * np.outer(centre, centre) + about_z * np.outer(y, y) + about_y * np.outer(z, z)
        M += weight * length * (here + product * (np.outer(y, z) + np.outer(z, y)))
    return M


def cable_mass(
    length: float, section: CrossSection, material: Material, inertia: SectionInertia = OWN_INERTIA
) -> Array:
    """M : (4, 4), kg and kg m2: int rho A S^T S dx of the cable."""
    M = np.zeros((4, 4))
    for xi, weight in gauss(6):
        S = np.array(axis_shape(length, xi))
        M += weight * length * inertia.values(section.at(xi), material)[0] * np.outer(S, S)
    return M
