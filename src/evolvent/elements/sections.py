"""Material and cross-sections of beams: y across the thickness of a rib, z across its width."""

from __future__ import annotations

import dataclasses
import math
from typing import NamedTuple, Protocol, Self, TypeVar

from evolvent.errors import InputError

_T = TypeVar("_T", bound="Rectangle | General")


def _check(what: object, *names: str) -> None:
    for name in names:
        value = getattr(what, name)
        if not (math.isfinite(value) and value > 0.0):
            raise InputError(f"{name} of a {type(what).__name__} is {value}; it must be above 0 and finite")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Material:
    """Isotropic and linearly elastic.

    Parameters
    ----------
    E : float, Pa, Young's modulus
    nu : float, Poisson's ratio, above -1 and below 0.5
    density : float, kg/m3
    """

    E: float
    nu: float
    density: float

    def __post_init__(self) -> None:
        _check(self, "E", "density")
        if not -1.0 < self.nu < 0.5:
            raise InputError(f"nu of a Material is {self.nu}; it must be above -1 and below 0.5")

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


class Section(Protocol):
    """A cross-section, the same or changing along an element."""

    def at(self, xi: float) -> Rectangle | General:
        """The section at x = xi length."""
        ...


@dataclasses.dataclass(frozen=True, kw_only=True)
class Rectangle:
    """Solid rectangle, `thickness` along y and `width` along z, m."""

    thickness: float
    width: float

    def __post_init__(self) -> None:
        _check(self, "thickness", "width")

    def at(self, xi: float) -> Self:
        """Itself."""
        return self

    def towards(self, other: Self, xi: float) -> Self:
        """Between itself (xi = 0) and another one (xi = 1)."""
        return _blend(self, other, xi)

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


@dataclasses.dataclass(frozen=True, kw_only=True)
class General:
    """Any section, by its properties about its principal axes y and z.

    Parameters
    ----------
    area : float, m2
    Iy, Iz : float, m4, int z^2 dA and int y^2 dA
    J : float, m4, torsion constant
    shear_y, shear_z : float, shear correction factors
    """

    area: float
    Iy: float
    Iz: float
    J: float
    shear_y: float = 5.0 / 6.0
    shear_z: float = 5.0 / 6.0

    def __post_init__(self) -> None:
        _check(self, "area", "Iy", "Iz", "J", "shear_y", "shear_z")

    def at(self, xi: float) -> Self:
        """Itself."""
        return self

    def towards(self, other: Self, xi: float) -> Self:
        """Between itself (xi = 0) and another one (xi = 1)."""
        return _blend(self, other, xi)

    def properties(self, nu: float) -> Properties:
        """Its own properties, whatever nu."""
        return Properties(self.area, self.Iy, self.Iz, self.J, self.shear_y, self.shear_z)


@dataclasses.dataclass(frozen=True)
class Taper:
    """A section whose sides (rectangles) or properties (general sections) change linearly along an element."""

    start: Rectangle | General
    end: Rectangle | General

    def __post_init__(self) -> None:
        if type(self.start) is not type(self.end):
            kinds = f"{type(self.start).__name__} and {type(self.end).__name__}"
            raise InputError(f"start and end of a Taper are {kinds}; they must be of the same kind")

    def at(self, xi: float) -> Rectangle | General:
        """The section at x = xi length."""
        return self.start.towards(self.end, xi)  # type: ignore[arg-type]

    def between(self, first: float, last: float) -> Taper:
        """The piece of a tapered rib from x = first to last, in parts of its length: one element of it."""
        return Taper(self.at(first), self.at(last))


def _blend(one: _T, other: _T, xi: float) -> _T:
    names = [field.name for field in dataclasses.fields(one)]
    return type(one)(**{name: (1.0 - xi) * getattr(one, name) + xi * getattr(other, name) for name in names})
