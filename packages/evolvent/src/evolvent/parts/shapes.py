"""Shapes of rigid bodies, by which they are drawn; of uniform density, their mass properties in closed form."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np

from evolvent.parts.base import unit
from evolvent_base import units
from evolvent_base.schema import OneOf, Section

__all__ = ["Box", "Capsule", "Cylinder", "Plane", "Sphere"]

SIDE = units.Quantity(what="a length", unit="m", example="0.5 m", above=0.0)


class Shape(Section):
    """A solid about the body's centre of mass, in body axes."""

    @property
    def volume(self) -> float:
        """m3."""
        raise NotImplementedError(f"{type(self).__name__} has no volume")

    def inertia_per_mass(self) -> np.ndarray:
        """(3, 3) float, m2, about the centre of mass, of uniform density."""
        raise NotImplementedError(f"{type(self).__name__} has no inertia_per_mass()")


class Box(Shape):
    """A box.

    Parameters
    ----------
    size : (3,) float, m
        Sides along x, y and z.
    """

    size: Annotated[units.Triple, units.Vector(quantity=SIDE)]

    @property
    def volume(self) -> float:
        """m3."""
        return math.prod(self.size)

    def inertia_per_mass(self) -> np.ndarray:
        """(3, 3) float, m2: (y^2 + z^2)/12 and so on."""
        squares = np.array(self.size) ** 2
        return np.diag(squares.sum() - squares) / 12.0


class Cylinder(Shape):
    """A circular cylinder.

    Parameters
    ----------
    radius : float, m
        Of the circle.
    length : float, m, optional
        Along the axis; without limit if left out, in contacts alone.
    axis : (3,) float
        Body axes.
    """

    radius: units.Length
    length: units.Length | None = None
    axis: units.Direction = (0.0, 0.0, 1.0)

    @property
    def span(self) -> float:
        """Length, m, infinite without ends."""
        return math.inf if self.length is None else self.length

    @property
    def volume(self) -> float:
        """m3."""
        return math.pi * self.radius**2 * self.span

    def inertia_per_mass(self) -> np.ndarray:
        """(3, 3) float, m2: r^2/2 along the axis, (3 r^2 + l^2)/12 across."""
        e, along, across = unit(self.axis), 0.5 * self.radius**2, (3.0 * self.radius**2 + self.span**2) / 12.0
        found: np.ndarray = across * np.eye(3) + (along - across) * np.outer(e, e)
        return found


class Sphere(Shape):
    """A sphere.

    Parameters
    ----------
    radius : float, m
        Of the sphere.
    """

    radius: units.Length

    @property
    def volume(self) -> float:
        """m3."""
        return 4.0 / 3.0 * math.pi * self.radius**3

    def inertia_per_mass(self) -> np.ndarray:
        """(3, 3) float, m2: 2 r^2/5."""
        return 0.4 * self.radius**2 * np.eye(3)


class Capsule(Shape):
    """A cylinder with hemispherical ends.

    Parameters
    ----------
    radius : float, m
        Of the cylinder and the hemispheres.
    length : float, m
        Of the cylinder, between the centres of the hemispheres.
    axis : (3,) float
        Body axes.
    """

    radius: units.Length
    length: units.Length
    axis: units.Direction = (0.0, 0.0, 1.0)

    @property
    def volume(self) -> float:
        """m3."""
        return math.pi * self.radius**2 * (self.length + 4.0 / 3.0 * self.radius)

    def inertia_per_mass(self) -> np.ndarray:
        """(3, 3) float, m2: of the cylinder and of the half spheres, whose centres of mass lie 3 r/8 from its ends."""
        e, r, length = unit(self.axis), self.radius, self.length
        middle = length / (length + 4.0 / 3.0 * r)
        ends = 1.0 - middle
        along = r**2 * (0.5 * middle + 0.4 * ends)
        across = middle * (3.0 * r**2 + length**2) / 12.0
        across += ends * (0.4 * r**2 + 0.25 * length**2 + 0.375 * r * length)
        found: np.ndarray = across * np.eye(3) + (along - across) * np.outer(e, e)
        return found


class Plane(Section):
    """A plane for contact, through a point of a body; its normal points to the side of what touches it.

    Parameters
    ----------
    normal : (3,) float
        Normal of the plane, body axes.
    size : float, m
        Diameter of the disc that represents the plane in drawings; the plane itself is infinite.
    """

    normal: units.Direction
    size: units.Length = 1.0


_SOLIDS: dict[str, type[Section]] = {"sphere": Sphere, "capsule": Capsule, "box": Box}
AnyShape = Annotated[Shape, OneOf({**_SOLIDS, "cylinder": Cylinder})]
SolidContactShape = Annotated[Shape, OneOf(_SOLIDS)]
ContactShape = Annotated[Section, OneOf({**_SOLIDS, "cylinder": Cylinder, "plane": Plane})]
