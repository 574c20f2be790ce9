"""Cross-sections by their shape: y across the thickness of a rib, z across its width."""

from __future__ import annotations

import functools
import math
from typing import Any, ClassVar, NamedTuple, Self

from pydantic import model_validator
from pydantic_core import PydanticCustomError

from evolvent_base import units
from evolvent_base.columns import each
from evolvent_base.schema import Section


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


@functools.lru_cache(maxsize=1024)
def _torsion_series(t: float, w: float) -> float:
    """Sum over odd n of tanh(n pi w/(2 t))/n^5 for a rectangle with sides t and w; cached for equal elements."""
    return sum(math.tanh(n * math.pi * w / (2.0 * t)) / n**5 for n in range(1, 200, 2))


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
        t, w = each(min, y, z), each(max, y, z)
        J = w * t**3 * (1.0 / 3.0 - 64.0 / math.pi**5 * t / w * each(_torsion_series, t, w))
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
