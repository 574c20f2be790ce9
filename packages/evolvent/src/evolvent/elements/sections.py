"""Sections of beams and rods: those that flatten, by numbers or a matrix, tapered; and the names of all."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple, Self

import numpy as np
from pydantic import model_validator
from pydantic_core import PydanticCustomError

from evolvent.elements.materials import MATERIALS, Material
from evolvent.elements.shapes import Angle, Arc, Circle, CrossSection, IBeam, Properties, Rectangle, Strip, Tube
from evolvent_base import units
from evolvent_base.dense import product
from evolvent_base.named import Named
from evolvent_base.schema import OneOf

#: Largest angle of a section that flattens, whose theory is that of a shallow arc.
DEEPEST = 0.75 * math.pi


class FlatteningConstants(NamedTuple):
    """Constants of `families.rods.tape`: N m2, 1, 1/m, m2, m2, 1, 1 if closed; mass of a coordinate, kg m3."""

    bending: float
    poisson: float
    transverse: float
    slenderness: float
    twisting: float
    stretching: float
    closed: int
    mass: float


class TapeSection(Arc):
    """Section of a tape spring, of a `Rod`: a shallow arc that flattens where the rod is bent about z.

    Parameters
    ----------
    radius : float, m
        Radius of the middle line without stress.
    angle : float, rad
        Angle of the arc, from 0.1 rad to 135 degrees; the apex of the arc points along y.
    thickness : float, m
        Thickness of the strip, below the radius.

    Notes
    -----
    Bending about z follows the shallow shell of Wuest and Mansfield, and each node has the
    transverse curvature of its section as a coordinate. A positive curvature bends the rod in opposite sense, with the
    edges on the inner side. All else is linear, with the properties of the `Arc`, whose second moment about z is not
    used: that of the shallow arc is s^5 t/(720 R^2), s = R angle.
    """

    deepest = DEEPEST

    def flattening(self, material: Material) -> FlatteningConstants:
        """Constants of the section's flattening."""
        nu, s, t = material.nu, self.radius * self.angle, self.thickness
        plate = material.E * t**3 / (12.0 * (1.0 - nu * nu))
        return FlatteningConstants(
            s * plate, nu, 1.0 / self.radius, 3.0 * (1.0 - nu * nu) * s**4 / (t * t), (1.0 - nu) * s * s / 6.0,
            1.0 / 180.0, 0, material.density * t * s**5 / 720.0,
        )  # fmt: skip


class Lenticular(TapeSection):
    """Section of a lenticular rod, of a `Rod`: two shallow arcs, joined at their edges, that flatten when it is wound.

    Parameters
    ----------
    radius : float, m
        Radius of the middle lines without stress.
    angle : float, rad
        Angle of each arc, from 0.1 rad to 135 degrees; the chord is along z.
    thickness : float, m
        Thickness of each wall, below the radius.

    Notes
    -----
    Bending about z is that of two shallow shells whose edges stay in one plane and turn freely there,
    alike in both senses. All else is linear, with the properties of the closed thin wall.
    """

    @property
    def sides(self) -> tuple[float, float]:
        """Extents along y and z, m."""
        half = 0.5 * self.angle
        return 2.0 * self.radius * (1.0 - math.cos(half)) + self.thickness, 2.0 * self.radius * math.sin(half)

    def properties(self, nu: float) -> Properties:
        """Area, moments and factors of thin walls.

        Notes
        -----
        With the half angle p, s = sin p, c = cos p and the enclosed area A_m = 2 R^2 (p - s c): J = 4 A_m^2 t/(4 p R)
        (Bredt); shear factors by the flow of Jourawski, 0 at the apexes or at the edges.
        """
        R, t, p = self.radius, self.thickness, 0.5 * self.angle
        s, c = math.sin(p), math.cos(p)
        area, enclosed = 4.0 * p * R * t, 2.0 * R * R * (p - s * c)
        Iz = 2.0 * R**3 * t * (p - 3.0 * s * c + 2.0 * p * c * c)
        Iy = 2.0 * R**3 * t * (p - s * c)
        along_y = 0.5 * (p - s * c) - 2.0 * c * (s - p * c) + c * c * p**3 / 3.0
        along_z = 0.5 * (p + s * c) - 2.0 * s * c + p * c * c
        shear_y, shear_z = (m * m / (4.0 * area * R**5 * t * own) for m, own in ((Iz, along_y), (Iy, along_z)))
        return Properties(area, Iy, Iz, enclosed * enclosed * t / (p * R), shear_y, shear_z)

    def flattening(self, material: Material) -> FlatteningConstants:
        """Constants of the section's flattening."""
        own = super().flattening(material)
        return own._replace(
            bending=2.0 * own.bending, poisson=0.0, stretching=1.0 / 30.0, closed=1, mass=12.0 * own.mass
        )


class General(CrossSection):
    """Any section, by its properties about axes y and z through its centroid.

    Parameters
    ----------
    area : float, m^2
        Area of the section.
    Iy, Iz : float, m^4
        Second moments int z^2 dA (bending about y) and int y^2 dA (bending about z).
    J : float, m^4
        Torsion constant.
    shear_y, shear_z : float
        Shear correction factors.
    Iyz : float, m^4
        Product int y z dA; 0 about principal axes.
    shear_centre : (2,) float, m
        Position (y, z) of the shear centre relative to the centroid.
    """

    area: units.Area
    Iy: units.SecondMoment
    Iz: units.SecondMoment
    J: units.SecondMoment
    shear_y: units.PositiveNumber = 5.0 / 6.0
    shear_z: units.PositiveNumber = 5.0 / 6.0
    Iyz: units.ProductOfArea = 0.0
    shear_centre: units.Pair = (0.0, 0.0)

    @model_validator(mode="after")
    def _check(self) -> Self:
        if not self.Iyz**2 < self.Iy * self.Iz:
            raise PydanticCustomError("section", "Iyz^2 must be below Iy Iz: no section has such moments")
        return self

    def properties(self, nu: float) -> Properties:
        """The given properties, independent of nu."""
        own = Properties(self.area, self.Iy, self.Iz, self.J, self.shear_y, self.shear_z, self.Iyz)
        return own._replace(centre_y=self.shear_centre[0], centre_z=self.shear_centre[1])


#: Of a stiffness matrix, beside the square roots of the products of its diagonal: how far it may be from its transpose,
#: and its least eigenvalue.
SYMMETRIC = 1e-6


def check_stiffness(C: np.ndarray, what: str) -> None:
    """Refuse a stiffness matrix that nothing elastic has.

    Parameters
    ----------
    C : (n, n) float; what : str, what messages call that which it belongs to

    Raises
    ------
    PydanticCustomError
    """
    reason, k = "", int(np.diag(C).argmin())
    if not C[k, k] > 0.0:
        k = next(k for k in range(len(C)) if not C[k, k] > 0.0)
        reason = f"its entry ({k + 1}, {k + 1}) is {C[k, k]:.6g}; it must be above 0"
    else:
        scale = np.sqrt(np.diag(C))
        unit = C / np.outer(scale, scale)
        apart = np.abs(unit - unit.T)
        least = float(np.linalg.eigvalsh(0.5 * (unit + unit.T))[0])
        if apart.max() > SYMMETRIC:
            i, k = sorted(map(int, np.unravel_index(apart.argmax(), apart.shape)))
            reason = (
                f"its entries ({i + 1}, {k + 1}) and ({k + 1}, {i + 1}) are {C[i, k]:.6g} and {C[k, i]:.6g}; it must "
                f"be symmetric"
            )
        elif not least > SYMMETRIC:
            reason = (
                f"beside its diagonal its least eigenvalue is {least:.3g}; it must be above {SYMMETRIC:g}: no {what} "
                f"gives energy when it is strained"
            )
    if reason:
        raise PydanticCustomError("section", "{message}", {"message": f"the matrix is no stiffness; {reason}"})


class SectionStiffness(CrossSection):
    """A section of a `Rod` by its stiffness matrix, with couplings such as those of laminates.

    Parameters
    ----------
    matrix : (6, 6) float, N, N m and N m2
        Forces (N, Q_y, Q_z), N, and moments (M_x, M_y, M_z), N m, by the strains in the same order: extension, shear
        along y, shear along z, twist per length, curvatures about y and z, 1 and 1/m. Symmetric and positive definite;
        of a diagonal matrix the six values on the diagonal are enough.

    Notes
    -----
    The strains are those of the rod's axis, which need be neither that of the centroids nor that of the shear centres:
    the strain along x is extension + z K_y - y K_z.
    """

    matrix: units.SectionStiffness

    @model_validator(mode="after")
    def _check(self) -> Self:
        check_stiffness(np.array(self.matrix), "section")
        return self

    def turned(self, angle: float) -> SectionStiffness:
        """The section turned about the rod's axis, its matrix in the axes y and z as before.

        Parameters
        ----------
        angle : float, rad, from y towards z
        """
        c, s = math.cos(angle), math.sin(angle)
        T = np.kron(np.eye(2), np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]))
        C = product(T, np.array(self.matrix), T.T)
        return SectionStiffness(matrix=0.5 * (C + C.T))


UNIFORM: dict[str, type[CrossSection]] = {
    "rectangle": Rectangle,
    "tube": Tube,
    "circle": Circle,
    "angle": Angle,
    "i-beam": IBeam,
    "arc": Arc,
    "general": General,
}
UniformSection = Annotated[CrossSection, OneOf(UNIFORM)]


class Taper(CrossSection):
    """A section whose dimensions (for `General`, its properties) vary linearly along the beam.

    Parameters
    ----------
    root, tip : section
        Sections at the ends of the beam, of the same kind.
    """

    root: UniformSection
    tip: UniformSection

    @model_validator(mode="after")
    def _check(self) -> Self:
        if type(self.root) is not type(self.tip):
            kinds = f"{type(self.root).__name__} and {type(self.tip).__name__}"
            raise PydanticCustomError(
                "section", "root and tip are {kinds}; they must be of the same kind", {"kinds": kinds}
            )
        return self

    def at(self, xi: float) -> CrossSection:
        """The section at x = xi length."""
        return self.root.towards(self.tip, xi)

    def between(self, first: float, last: float) -> Taper:
        """The piece of a tapered beam from x = first to last, in parts of its length: one element of it."""
        return Taper(root=self.at(first), tip=self.at(last))


AnySection = Annotated[CrossSection, OneOf({**UNIFORM, "taper": Taper})]
#: Sections of a rod: those of a beam, a thin strip, one by its stiffness matrix, and those that flatten.
RodSection = Annotated[
    CrossSection,
    OneOf(
        {
            **UNIFORM,
            "strip": Strip,
            "taper": Taper,
            "stiffness": SectionStiffness,
            "tape": TapeSection,
            "lenticular": Lenticular,
        }
    ),
]


# ---------------------------------------------------------------------------------------------- materials


MaterialOrName = Annotated[Material, Named(what="a material", known=MATERIALS)]
