"""Material and cross-sections of beams: y across the thickness of a rib, z across its width."""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple, Self

from pydantic import BeforeValidator, GetJsonSchemaHandler, model_validator
from pydantic_core import PydanticCustomError

from evolvent import units
from evolvent.errors import nearest
from evolvent.schema import OneOf, Section


class Material(Section):
    """Isotropic and linearly elastic.

    Parameters
    ----------
    young_modulus : float, Pa
        Young's modulus.
    poisson_ratio : float
        Poisson's ratio, above -1 and below 0.5.
    density : float, kg/m^3
        Mass per volume.
    """

    young_modulus: units.Modulus
    poisson_ratio: units.PoissonRatio = 0.3
    density: units.Density

    @property
    def E(self) -> float:  # noqa: N802  (the letter of the formulas)
        """Young's modulus, Pa."""
        return self.young_modulus

    @property
    def nu(self) -> float:
        """Poisson's ratio."""
        return self.poisson_ratio

    @property
    def shear_modulus(self) -> float:
        """G = E/(2 (1 + nu)), Pa."""
        return self.E / (2.0 * (1.0 + self.nu))


class Properties(NamedTuple):
    """What a section adds to a beam's axis; m2 and m4.

    Iy = int z^2 dA (bending about y), Iz = int y^2 dA (bending about z), J of torsion, shear correction factors.
    """

    area: float
    Iy: float
    Iz: float
    J: float
    shear_y: float
    shear_z: float


class CrossSection(Section):
    """A cross-section, the same or changing along an element."""

    def at(self, xi: float) -> CrossSection:
        """The section at x = xi length; itself, where it is the same all along."""
        return self

    def between(self, first: float, last: float) -> CrossSection:
        """The piece of a beam's section from x = first to last, in parts of its length: one element of it."""
        return self

    def properties(self, nu: float) -> Properties:
        """Area, moments and shear factors, which depend on Poisson's ratio."""
        raise NotImplementedError(f"{type(self).__name__} has no properties()")

    def towards(self, other: Self, xi: float) -> Self:
        """Between itself (xi = 0) and another one of its kind (xi = 1)."""
        keys = type(self).model_fields
        return type(self)(**{key: (1.0 - xi) * getattr(self, key) + xi * getattr(other, key) for key in keys})


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


class General(CrossSection):
    """Any section, by its properties about its principal axes y and z.

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
    """

    area: units.Area
    Iy: units.SecondMoment
    Iz: units.SecondMoment
    J: units.SecondMoment
    shear_y: units.PositiveNumber = 5.0 / 6.0
    shear_z: units.PositiveNumber = 5.0 / 6.0

    def properties(self, nu: float) -> Properties:
        """Its own properties, whatever nu."""
        return Properties(self.area, self.Iy, self.Iz, self.J, self.shear_y, self.shear_z)


UNIFORM: dict[str, type[CrossSection]] = {"rectangle": Rectangle, "tube": Tube, "circle": Circle, "general": General}
UniformSection = Annotated[CrossSection, OneOf(UNIFORM)]


class Taper(CrossSection):
    """A section whose sides (of general sections: properties) change linearly along the beam.

    Parameters
    ----------
    root, tip : section
        At the ends of the beam, of the same kind.
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


# ---------------------------------------------------------------------------------------------- materials

#: Carbon fibre in epoxy, quasi-isotropic laminate of T300/5208: E = 69.7 GPa, nu = 0.296 by laminate theory from the
#: ply's 181, 10.3 and 7.17 GPa and nu = 0.28, density 1600 kg/m^3 (Tsai & Hahn 1980, Introduction to Composite
#: Materials). Of a laminate with most fibres along the beam E is higher and the shear modulus lower.
CFRP = Material(young_modulus=69.7e9, poisson_ratio=0.296, density=1600.0)
#: Aluminium 6061-T6: 9.9e3 ksi, 0.33, 0.098 lb/in^3 (MIL-HDBK-5J 2003).
ALUMINIUM = Material(young_modulus=68.3e9, poisson_ratio=0.33, density=2710.0)
#: Structural steel (EN 1993-1-1; density EN 1991-1-1).
STEEL = Material(young_modulus=210e9, poisson_ratio=0.3, density=7850.0)
#: Polyimide film Kapton HN at 23 C (DuPont, Kapton HN data sheet).
KAPTON = Material(young_modulus=2.5e9, poisson_ratio=0.34, density=1420.0)
#: Materials by name in case files.
MATERIALS = {"cfrp": CFRP, "aluminium": ALUMINIUM, "steel": STEEL, "kapton": KAPTON}


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
