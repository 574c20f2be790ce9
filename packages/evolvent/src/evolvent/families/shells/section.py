"""Sections of shells: of one material, of plies, or a stiffness matrix."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from evolvent.elements.materials import Material
from evolvent.elements.sections import MaterialOrName
from evolvent_base import units
from evolvent_base.schema import Section

Array = np.ndarray
#: Shear correction factor of a homogeneous section.
SHEAR_FACTOR = 5.0 / 6.0


class Ply(Section):
    """A ply of a laminate.

    Parameters
    ----------
    thickness : float, m
    material : Material, or the name of a known one
        Young's modulus, along the fibres, Poisson's ratio and shear modulus in the plane.
    across : float, Pa, optional
        Young's modulus across the fibres; that along them if left out.
    transverse_shear : float, Pa, optional
        Shear modulus across the ply; that in the plane if left out.
    angle : float, rad
        Of the fibres from axis 1 of the shell towards axis 2.
    """

    thickness: units.Length
    material: MaterialOrName
    across: units.Modulus | None = None
    transverse_shear: units.Modulus | None = None
    angle: units.Angle = 0.0


class Laminate(NamedTuple):
    """Stiffness of a section and its mass.

    Attributes
    ----------
    C : (8, 8) float, by membrane strains 11, 22 and twice 12 (N/m), changes of curvature alike (N m) and transverse
        shear strains 13 and 23 (N/m)
    mass : float, kg/m2
    """

    C: Array
    mass: float

    @property
    def thickness(self) -> float:
        """Of a homogeneous section with its ratio of bending to membrane stiffness, m."""
        return float(np.sqrt(12.0 * (self.C[3, 3] + self.C[4, 4]) / (self.C[0, 0] + self.C[1, 1])))


def homogeneous(material: Material, thickness: float) -> Laminate:
    """A section of one material."""
    return laminated([Ply(thickness=thickness, material=material)])


def laminated(plies: list[Ply]) -> Laminate:
    """A section of plies, from that on the side against the normal on; the reference surface is in the middle.

    Notes
    -----
    Classical lamination; the shear stiffness is 5/6 of the sum of the plies', exact of a homogeneous section alone.
    """
    C, mass = np.zeros((8, 8)), 0.0
    z = -0.5 * sum(ply.thickness for ply in plies)
    for ply in plies:
        top = z + ply.thickness
        Q, G = plane_stiffness(ply)
        for power, rows, columns in ((1, 0, 0), (2, 0, 3), (2, 3, 0), (3, 3, 3)):
            C[rows : rows + 3, columns : columns + 3] += (top**power - z**power) / power * Q
        C[6:, 6:] += SHEAR_FACTOR * ply.thickness * G
        mass += ply.material.density * ply.thickness
        z = top
    C[:3, 3:6][np.abs(C[:3, 3:6]) < 1e-12 * C[0, 0] * abs(z)] = 0.0  # of symmetric laminates
    C[3:6, :3] = C[:3, 3:6].T
    return Laminate(C, mass)


def plane_stiffness(ply: Ply) -> tuple[Array, Array]:
    """Stiffness of plane stress (3, 3) and of transverse shear (2, 2) of a ply in the axes of the shell, Pa."""
    one, G12 = ply.material.E, ply.material.shear_modulus
    two, nu = one if ply.across is None else ply.across, ply.material.nu
    across = G12 if ply.transverse_shear is None else ply.transverse_shear
    size = 1.0 - nu * nu * two / one
    Q = np.array([[one, nu * two, 0.0], [nu * two, two, 0.0], [0.0, 0.0, G12 * size]]) / size
    c, s = np.cos(ply.angle), np.sin(ply.angle)
    T = np.array([[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2.0 * c * s, 2.0 * c * s, c * c - s * s]])
    return T.T @ Q @ T, across * np.eye(2)
