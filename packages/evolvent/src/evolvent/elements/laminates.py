"""Sections of shells: stiffness 8 x 8 of a wall of plies, and masses per area.

With the strains of the reference surface, 11, 22 and twice 12, its changes of curvature alike and the transverse shear
strains 13 and 23, the forces per length are N = A e + B k, the moments per length M = B e + D k and Q = S g, by the
theory of laminates of Kirchhoff in the plane (Jones 1999): plies are in plane stress, and strains linear through the
thickness. The reference surface is in the middle of the thickness.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import model_validator
from pydantic_core import PydanticCustomError

from evolvent.elements.materials import Material
from evolvent.elements.sections import MaterialOrName, check_stiffness
from evolvent.elements.viscoelastic import Viscoelastic
from evolvent_base import units
from evolvent_base.schema import OneOf, Section

__all__ = ["Laminate", "MatrixWall", "Ply"]

Array = np.ndarray
#: Shear correction factor of a homogeneous wall.
SHEAR_FACTOR = 5.0 / 6.0


class WallProperties(NamedTuple):
    """Properties of a wall.

    Attributes
    ----------
    stiffness : (8, 8) float, N/m, N and N m, of an instant
    mass : float, kg/m^2, per area; inertia : float, kg, rotary inertia per area about its axes
    thickness : float, m; 0 of a wall by its stiffness matrix: it is not known
    expansion : (8, 2) float, strains and changes of curvature that a wall takes without forces by a temperature, 1/K,
        and by its gradient along the normal, m/K; None of a wall of which the expansion is not known
    relaxing : laws by which the wall relaxes, each with its part (8, 8) of the stiffness
    """

    stiffness: Array
    mass: float
    inertia: float
    thickness: float = 0.0
    expansion: Array | None = None
    relaxing: tuple[tuple[Viscoelastic, Array], ...] = ()


class Ply(Section):
    """A ply of a laminate.

    Parameters
    ----------
    material : Material, or the name of a known one
        With young_modulus_2, shear, shear_13 and shear_23 of a material that is not isotropic.
    thickness : float, m
        Of the ply.
    angle : float, rad
        From axis 1 of the shell to the fibres, about the normal.
    """

    material: MaterialOrName
    thickness: units.Length
    angle: units.Angle = 0.0


class Wall(Section):
    """Section of a shell."""

    def properties(self) -> WallProperties:
        """Stiffness and inertia of the wall."""
        raise NotImplementedError


class Laminate(Wall):
    """A wall of plies.

    Parameters
    ----------
    plies : list of Ply
        From the bottom to the top, where the normal points to.
    shear_factor : float
        Of the stiffness against transverse shear, beside the sum over the plies; 5/6 is exact of one homogeneous ply.
    """

    plies: tuple[Ply, ...]
    shear_factor: units.PositiveNumber = SHEAR_FACTOR

    @model_validator(mode="before")
    @classmethod
    def _of_plies(cls, value: Any) -> Any:
        """A list stands for the plies."""
        return {"plies": value} if isinstance(value, (list, tuple)) else value

    @model_validator(mode="after")
    def _check(self) -> Laminate:
        if not self.plies:
            raise PydanticCustomError("section", "the laminate has no plies; it must have one or more")
        return self

    def properties(self) -> WallProperties:
        """Sums over the plies."""
        C, mass, inertia, heated = np.zeros((8, 8)), 0.0, 0.0, np.zeros((8, 2))
        relaxing = list[tuple[Viscoelastic, Array]]()
        z = -0.5 * math.fsum(ply.thickness for ply in self.plies)
        for ply in self.plies:
            h, middle, law = ply.thickness, z + 0.5 * ply.thickness, ply.material.viscoelastic
            second = h * middle * middle + h**3 / 12.0
            if law is not None and all(law != one for one, _ in relaxing):
                relaxing.append((law, np.zeros((8, 8))))
            plane, shear = _turned_stiffness(ply.material, ply.angle)
            for total in (C, *(part for one, part in relaxing if one == law)):
                total[:3, :3] += h * plane
                total[:3, 3:6] += h * middle * plane
                total[3:6, 3:6] += second * plane
                total[6:, 6:] += self.shear_factor * h * shear
            held = plane @ turned_expansion(ply.material, ply.angle)
            heated[:3] += np.outer(held, [h, h * middle])
            heated[3:6] += np.outer(held, [h * middle, second])
            mass, inertia = mass + h * ply.material.density, inertia + second * ply.material.density
            z += h
        for total in (C, *(part for _, part in relaxing)):
            total[:3, 3:6][np.abs(total[:3, 3:6]) < 1e-12 * C[0, 0] * abs(z)] = 0.0  # of symmetric laminates
            total[3:6, :3] = total[:3, 3:6].T
        for own, scale in ((heated[3:6, 0], abs(z)), (heated[:3, 1], abs(z))):
            own[np.abs(own) < 1e-12 * scale * np.abs(heated[:3, 0]).max()] = 0.0
        known = all(ply.material.thermal_expansion is not None for ply in self.plies)
        expansion = np.linalg.solve(C, heated) if known else None
        return WallProperties(C, mass, inertia, 2.0 * z, expansion, tuple(relaxing))


class MatrixWall(Wall):
    """A wall by its stiffness matrix.

    Parameters
    ----------
    matrix : (8, 8) float, N/m, N and N m
        Membrane forces 11, 22 and 12, N/m, moments 11, 22 and 12, N, and transverse shear forces 13 and 23, N/m, by the
        membrane strains 11, 22 and twice 12, the changes of curvature 11, 22 and twice 12, 1/m, and the transverse
        shear strains 13 and 23. Symmetric and positive definite.
    mass_per_area : float, kg/m^2
        The rotary inertia is that of a homogeneous wall of this stiffness.
    viscoelastic : mapping, optional
        Relaxation of the whole matrix by a Prony series; the matrix is that of an instant.
    """

    matrix: units.ShellStiffness
    mass_per_area: units.AreaDensity
    viscoelastic: Viscoelastic | None = None

    @model_validator(mode="after")
    def _check(self) -> MatrixWall:
        check_stiffness(np.array(self.matrix), "wall")
        return self

    def properties(self) -> WallProperties:
        """The matrix, made symmetric."""
        C = np.array(self.matrix)
        gyration = (C[3, 3] + C[4, 4]) / (C[0, 0] + C[1, 1])
        C = 0.5 * (C + C.T)
        relaxing = () if self.viscoelastic is None else ((self.viscoelastic, C),)
        return WallProperties(C, self.mass_per_area, self.mass_per_area * gyration, relaxing=relaxing)


WallSection = Annotated[Wall, OneOf({"laminate": Laminate, "stiffness": MatrixWall})]


def plane_stiffness(material: Material) -> Array:
    """Stiffness (3, 3) of a ply in plane stress along and across its fibres, Pa."""
    E1, G = material.E, material.shear_modulus
    E2 = E1 if material.young_modulus_2 is None else material.young_modulus_2
    nu = material.nu
    Q = np.array([[E1, nu * E2, 0.0], [nu * E2, E2, 0.0], [0.0, 0.0, 0.0]]) / (1.0 - nu * nu * E2 / E1)
    Q[2, 2] = G
    return Q


def turned_strains(angle: float) -> Array:
    """Strains (3, 3) along and across fibres at an angle, rad, by those along axes 1 and 2, with twice 12."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2.0 * c * s, 2.0 * c * s, c * c - s * s]])


def _turned_stiffness(material: Material, angle: float) -> tuple[Array, Array]:
    """Stiffness (3, 3) in plane stress and (2, 2) in transverse shear, Pa, of a ply whose fibres are at an angle."""
    G, T = material.shear_modulus, turned_strains(angle)
    along, across = (G if own is None else own for own in (material.shear_13, material.shear_23))
    c, s = math.cos(angle), math.sin(angle)
    R = np.array([[c, s], [-s, c]])
    return T.T @ plane_stiffness(material) @ T, R.T @ np.diag([along, across]) @ R


def turned_expansion(material: Material, angle: float) -> Array:
    """Free strains 11, 22 and twice 12 by temperature, 1/K, of a ply whose fibres are at an angle; 0 if not known."""
    along = material.thermal_expansion or 0.0
    across = along if material.thermal_expansion_2 is None else material.thermal_expansion_2
    c, s = math.cos(angle), math.sin(angle)
    return np.array([along * c * c + across * s * s, along * s * s + across * c * c, 2.0 * c * s * (along - across)])
