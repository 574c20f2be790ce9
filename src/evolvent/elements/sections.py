"""Material and cross-sections of beams: y across the thickness of a rib, z across its width."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar, NamedTuple, Self

import numpy as np
from pydantic import BeforeValidator, GetJsonSchemaHandler, model_validator
from pydantic_core import PydanticCustomError

from evolvent.base import units
from evolvent.base.errors import nearest
from evolvent.base.schema import OneOf, Section
from evolvent.elements.dense import product
from evolvent.elements.materials import MATERIALS, Material


class Properties(NamedTuple):
    """Properties of a section about its centroid; m2, m4 and m.

    Iy = int z^2 dA (bending about y), Iz = int y^2 dA (bending about z), J of torsion, shear correction factors,
    Iyz = int y z dA, and the position (y, z) of the shear centre.
    """

    area: float
    Iy: float
    Iz: float
    J: float
    shear_y: float
    shear_z: float
    Iyz: float = 0.0
    centre_y: float = 0.0
    centre_z: float = 0.0

    def principal(self) -> tuple[float, float, float]:
        """Principal second moments, m4, the larger one first, and the angle of the principal axes, rad.

        The angle turns y and z about the beam's axis x, y towards z; the larger moment is that of bending about the
        turned z.
        """
        mean, half = 0.5 * (self.Iz + self.Iy), 0.5 * (self.Iz - self.Iy)
        size = math.hypot(half, self.Iyz)
        return mean + size, mean - size, 0.5 * math.atan2(2.0 * self.Iyz, 2.0 * half) if size > 0.0 else 0.0


class CrossSection(Section):
    """A cross-section, constant or varying along an element."""

    def at(self, xi: float) -> CrossSection:
        """The section at x = xi length; itself, where it is the same all along."""
        return self

    def between(self, first: float, last: float) -> CrossSection:
        """The piece of a beam's section from x = first to last, in parts of its length: one element of it."""
        return self

    @property
    def sides(self) -> tuple[float, float] | None:
        """Largest extents along y and z, m, by which a beam is drawn; None where they are not known."""
        return None

    def properties(self, nu: float) -> Properties:
        """Area, moments and shear factors, which depend on Poisson's ratio."""
        raise NotImplementedError(f"{type(self).__name__} has no properties()")

    def fibre_means(self) -> tuple[float, float] | None:
        """Means of rho^2 and rho^4 over the area, m2 and m4, with the distance rho from the axis of twist, if known."""
        return None

    def towards(self, other: Self, xi: float) -> Self:
        """Between itself (xi = 0) and another one of its kind (xi = 1)."""

        def mean(one: Any, last: Any) -> Any:
            if isinstance(one, tuple):
                return tuple(map(mean, one, last))
            return (1.0 - xi) * one + xi * last

        return type(self)(**{key: mean(getattr(self, key), getattr(other, key)) for key in type(self).model_fields})


class Rectangle(CrossSection):
    """Solid rectangle.

    Parameters
    ----------
    thickness : float, m
        Side along y, the beam's normal.
    width : float, m
        Side along z.
    """

    thickness: units.Length
    width: units.Length

    @property
    def sides(self) -> tuple[float, float]:
        """Extents along y and z, m."""
        return self.thickness, self.width

    def properties(self, nu: float) -> Properties:
        """Area, moments and factors.

        Notes
        -----
        J = w t^3 (1/3 - 64/pi^5 t/w sum_{n odd} tanh(n pi w/(2 t))/n^5), t the shorter side (St Venant); shear
        10 (1 + nu)/(12 + 11 nu) (Cowper 1966).
        """
        y, z = self.thickness, self.width
        t, w = min(y, z), max(y, z)
        series = sum(math.tanh(n * math.pi * w / (2.0 * t)) / n**5 for n in range(1, 200, 2))
        J = w * t**3 * (1.0 / 3.0 - 64.0 / math.pi**5 * t / w * series)
        shear = 10.0 * (1.0 + nu) / (12.0 + 11.0 * nu)
        return Properties(y * z, y * z**3 / 12.0, z * y**3 / 12.0, J, shear, shear)

    def fibre_means(self) -> tuple[float, float]:
        """(t^2 + w^2)/12 and (t^4 + w^4)/80 + t^2 w^2/72."""
        y, z = self.thickness**2, self.width**2
        return (y + z) / 12.0, (y * y + z * z) / 80.0 + y * z / 72.0


class Strip(Rectangle):
    """Thin rectangle, such as a strip of film: twist strains its outer fibres, so that tension resists twist.

    Parameters
    ----------
    thickness : float, m
        Side along y, the strip's normal.
    width : float, m
        Side along z.
    """


class Tube(CrossSection):
    """Circular tube.

    Parameters
    ----------
    radius : float, m
        Outer radius.
    thickness : float, m
        Of the wall, at most the radius.
    """

    radius: units.Length
    thickness: units.Length

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.thickness > self.radius:
            raise PydanticCustomError("section", "the wall's thickness must not exceed the outer radius")
        return self

    def properties(self, nu: float) -> Properties:
        """Area, moments and factors.

        Notes
        -----
        With a and b the outer and inner radius, m = b/a: A = pi (a^2 - b^2), I = pi (a^4 - b^4)/4, J = 2 I; shear
        6 (1 + nu) (1 + m^2)^2/((7 + 6 nu) (1 + m^2)^2 + (20 + 12 nu) m^2) (Cowper 1966, hollow circle), of a thin wall
        2 (1 + nu)/(4 + 3 nu).
        """
        a, b = self.radius, self.radius - self.thickness
        area, I = math.pi * (a - b) * (a + b), 0.25 * math.pi * (a - b) * (a + b) * (a * a + b * b)  # noqa: E741
        m2 = (b / a) ** 2
        whole = (1.0 + m2) ** 2
        shear = 6.0 * (1.0 + nu) * whole / ((7.0 + 6.0 * nu) * whole + (20.0 + 12.0 * nu) * m2)
        return Properties(area, I, I, 2.0 * I, shear, shear)

    def fibre_means(self) -> tuple[float, float]:
        """(a^2 + b^2)/2 and (a^4 + a^2 b^2 + b^4)/3, a and b the outer and inner radius."""
        a, b = self.radius**2, (self.radius - self.thickness) ** 2
        return 0.5 * (a + b), (a * a + a * b + b * b) / 3.0


class Circle(CrossSection):
    """Solid circle.

    Parameters
    ----------
    radius : float, m
        Of the circle.
    """

    radius: units.Length

    def properties(self, nu: float) -> Properties:
        """Area, moments and factors; shear 6 (1 + nu)/(7 + 6 nu) (Cowper 1966)."""
        I = 0.25 * math.pi * self.radius**4  # noqa: E741
        shear = 6.0 * (1.0 + nu) / (7.0 + 6.0 * nu)
        return Properties(math.pi * self.radius**2, I, I, 2.0 * I, shear, shear)

    def fibre_means(self) -> tuple[float, float]:
        """a^2/2 and a^4/3."""
        return 0.5 * self.radius**2, self.radius**4 / 3.0


class Angle(CrossSection):
    """Angle section with two legs of equal thickness, along y and z from the outer corner.

    Parameters
    ----------
    height : float, m
        Of the leg along y, from the outer corner.
    width : float, m
        Of the leg along z, from the outer corner.
    thickness : float, m
        Of both legs.
    """

    height: units.Length
    width: units.Length
    thickness: units.Length

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.thickness >= min(self.height, self.width):
            raise PydanticCustomError("section", "the legs' thickness must be below height and width")
        return self

    @property
    def sides(self) -> tuple[float, float]:
        """Extents along y and z, m."""
        return self.height, self.width

    def properties(self, nu: float) -> Properties:
        """Area, moments and factors about the centroid, in axes along the legs: Iyz is below 0.

        Notes
        -----
        Moments of two rectangles. J = sum b t^3/3 of the legs' centre lines (St Venant's, of thin walls); shear centre
        where the centre lines cross; shear factor of a direction 5/6 of the area of the leg along it.
        """
        h, w, t = self.height, self.width, self.thickness
        legs = ((h, t, 0.5 * h, 0.5 * t), (t, w - t, 0.5 * t, 0.5 * (w + t)))  # sizes along y and z, centre
        area = sum(a * b for a, b, _, _ in legs)
        y, z = (sum(leg[0] * leg[1] * leg[i] for leg in legs) / area for i in (2, 3))
        Iz = sum(a * b * (a * a / 12.0 + (p - y) ** 2) for a, b, p, _ in legs)
        Iy = sum(a * b * (b * b / 12.0 + (q - z) ** 2) for a, b, _, q in legs)
        Iyz = sum(a * b * (p - y) * (q - z) for a, b, p, q in legs)
        shear_y, shear_z = (5.0 / 6.0 * b * t / area for b in (h, w))
        return Properties(area, Iy, Iz, area * t * t / 3.0, shear_y, shear_z, Iyz, 0.5 * t - y, 0.5 * t - z)


class IBeam(CrossSection):
    """I-section with a web along y and two flanges along z.

    Parameters
    ----------
    height : float, m
        Total height along y, including both flanges.
    width : float, m
        Width of the flanges along z.
    web, flange : float, m
        Thickness of the web, and of each flange.
    """

    height: units.Length
    width: units.Length
    web: units.Length
    flange: units.Length

    @model_validator(mode="after")
    def _check(self) -> Self:
        if 2.0 * self.flange >= self.height:
            raise PydanticCustomError("section", "both flanges together must be thinner than the height")
        if self.web > self.width:
            raise PydanticCustomError("section", "the web must not be thicker than the flanges are wide")
        return self

    @property
    def sides(self) -> tuple[float, float]:
        """Extents along y and z, m."""
        return self.height, self.width

    def properties(self, nu: float) -> Properties:
        """Area, moments and factors.

        Notes
        -----
        J = (2 b t_f^3 + d t_w^3)/3, d between the flanges' centre lines (St Venant's, of thin walls). Shear along y
        (Cowper 1966, thin-walled I-section), with d in place of the height, m = 2 b t_f/(d t_w) and n = b/d; along z
        5/6 of the flanges' area.
        """
        h, b, web, flange = self.height, self.width, self.web, self.flange
        inner, d = h - 2.0 * flange, h - flange
        area = 2.0 * b * flange + inner * web
        Iz = (b * h**3 - (b - web) * inner**3) / 12.0
        Iy = (2.0 * flange * b**3 + inner * web**3) / 12.0
        m, n = 2.0 * b * flange / (d * web), b / d
        below = 12.0 + 72.0 * m + 150.0 * m**2 + 90.0 * m**3 + nu * (11.0 + 66.0 * m + 135.0 * m**2 + 90.0 * m**3)
        below += 30.0 * n**2 * (m + m**2) + 5.0 * nu * n**2 * (8.0 * m + 9.0 * m**2)
        shear_y = 10.0 * (1.0 + nu) * (1.0 + 3.0 * m) ** 2 / below
        J = (2.0 * b * flange**3 + d * web**3) / 3.0
        return Properties(area, Iy, Iz, J, shear_y, 5.0 / 6.0 * 2.0 * b * flange / area)


#: Least angle, rad, of an Arc: the moments of flatter ones are those of a Rectangle.
FLATTEST = 0.1


class Arc(CrossSection):
    """Thin strip with a circular arc as cross-section, such as a tape spring; at 360 degrees a slit tube.

    Parameters
    ----------
    radius : float, m
        Radius of the middle line.
    angle : float, rad
        Angle of the arc, from 0.1 rad to a full turn; the apex of the arc points along y.
    thickness : float, m
        Thickness of the strip, below the radius.

    Notes
    -----
    The shape of the section is constant; that of a `TapeSection` flattens in a fold.
    """

    radius: units.Length
    angle: units.Angle
    thickness: units.Length
    #: Largest angle, rad.
    deepest: ClassVar[float] = 2.0 * math.pi

    @model_validator(mode="after")
    def _check(self) -> Self:
        if not FLATTEST <= self.angle <= self.deepest * (1.0 + 1e-12):
            low, high, own = (math.degrees(one) for one in (FLATTEST, self.deepest, self.angle))
            message = f"angle is {own:.6g} deg; it must be from {low:.3g} to {high:.6g} deg"
            raise PydanticCustomError("section", "{message}", {"message": message})
        if self.thickness >= self.radius:
            raise PydanticCustomError("section", "the thickness of the wall must be below its radius")
        return self

    @property
    def sides(self) -> tuple[float, float]:
        """Extents along y and z, m."""
        return self.thickness, 2.0 * self.radius * math.sin(min(0.5 * self.angle, 0.5 * math.pi))

    def properties(self, nu: float) -> Properties:
        """Area, moments and factors.

        Notes
        -----
        With the half angle p, s = sin p, c = cos p: A = 2 p R t and the moments of a sector of a ring, exactly.
        J = 2 p R t^3/3 (St Venant's, of thin walls); shear centre at 2 R (s - p c)/(p - s c) from the arc's centre; the
        shear factors make int Q^2/t ds A/I^2 the flexibility of a thin wall, Q the static moment (Jourawski).
        """
        R, t, p = self.radius, self.thickness, min(0.5 * self.angle, math.pi)
        s, c = math.sin(p), math.cos(p)
        area, thick = 2.0 * p * R * t, (t / R) ** 2
        y = R * (1.0 + thick / 12.0) * s / p
        ring = R**3 * t * (1.0 + 0.25 * thick)  # of (b^4 - a^4)/4, a and b its radii
        Iz = ring * (p + s * c) - area * y * y
        Iy = ring * (p - s * c)
        along_y = 2.0 * s * s * (p / 3.0 - 2.0 / p) + 3.0 * s * c + p
        along_z = p * (1.0 + 2.0 * c * c) - 3.0 * s * c
        shear_y = (p + s * c - 2.0 * s * s / p) ** 2 / (2.0 * p * along_y)
        shear_z = (p - s * c) ** 2 / (2.0 * p * along_z)
        centre = 2.0 * R * (s - p * c) / (p - s * c)
        return Properties(area, Iy, Iz, area * t * t / 3.0, shear_y, shear_z, 0.0, centre - y, 0.0)


#: Largest angle of a section that flattens, whose theory is that of a shallow arc.
DEEPEST = 0.75 * math.pi


class FlatteningConstants(NamedTuple):
    """Constants of `evolvent.kernels.tape`: N m2, 1, 1/m, m2, m2, 1, 1 if closed; mass of a coordinate, kg m3."""

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
    Bending about z follows the shallow shell of Wuest and Mansfield (`evolvent.kernels.tape`), and each node has the
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
    Bending about z is that of two shallow shells whose edges stay in one plane and turn freely there
    (`evolvent.kernels.tape`), alike in both senses. All else is linear, with the properties of the closed thin wall.
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
        C = np.array(self.matrix)
        for k in range(6):
            if not C[k, k] > 0.0:
                self._refuse_matrix(f"its entry ({k + 1}, {k + 1}) is {C[k, k]:.6g}; it must be above 0")
        scale = np.sqrt(np.diag(C))
        unit = C / np.outer(scale, scale)
        apart = np.abs(unit - unit.T)
        if apart.max() > SYMMETRIC:
            i, k = sorted(map(int, np.unravel_index(apart.argmax(), apart.shape)))
            self._refuse_matrix(
                f"its entries ({i + 1}, {k + 1}) and ({k + 1}, {i + 1}) are {C[i, k]:.6g} and {C[k, i]:.6g}; it must "
                f"be symmetric"
            )
        least = float(np.linalg.eigvalsh(0.5 * (unit + unit.T))[0])
        if not least > SYMMETRIC:
            self._refuse_matrix(
                f"beside its diagonal its least eigenvalue is {least:.3g}; it must be above {SYMMETRIC:g}: no section "
                f"gives energy when it is strained"
            )
        return self

    @staticmethod
    def _refuse_matrix(reason: str) -> None:
        message = f"the matrix is no stiffness; {reason}"
        raise PydanticCustomError("section", "{message}", {"message": message})

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


class _Named:
    """A pydantic annotation: the name of a material stands for it."""

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """A name, or the keys of a material."""
        return {"anyOf": [{"enum": sorted(MATERIALS)}, handler(schema)]}


def _by_name(value: Any) -> Any:
    if not isinstance(value, str):
        return value
    if value not in MATERIALS:
        message = f"a material by name must be known; {nearest(value, MATERIALS)}"
        raise PydanticCustomError("material", "{message}", {"message": message})
    return MATERIALS[value]


MaterialOrName = Annotated[Material, BeforeValidator(_by_name), _Named()]
