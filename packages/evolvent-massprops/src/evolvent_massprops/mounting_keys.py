"""Keys of what is on a stand besides the body: how the body is mounted, tare, and air that moves along."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from evolvent_base import units
from evolvent_base.errors import InputError
from evolvent_base.schema import OneOf, Section
from evolvent_massprops import uncertain
from evolvent_massprops.inertia import air
from evolvent_massprops.inertia.stand import inertia_defect
from evolvent_massprops.inertia.statics import rotation_matrix
from evolvent_massprops.keys import Key
from evolvent_massprops.uncertain import Uncertain

_TURN = re.compile(r"(.+?)\s+about\s+([xyz])")


Alignment = Annotated[float, units.Quantity(what="an angle", unit="rad", example="0.1 deg", least=0.0, most=0.2)]


class TurnsKey(Key):
    """Turns about the stand's axes, one after the other: tuple of (angle in rad, axis)."""

    allowed = "none, a turn such as '90 deg about x', or a list of turns that follow one another"

    def read(self, value: Any) -> tuple[tuple[float, str], ...]:
        """The value as it is kept."""
        if value == "none":
            return ()
        return tuple(self._turn(v) for v in (value if isinstance(value, (list, tuple)) else [value]))

    def _turn(self, value: Any) -> tuple[float, str]:
        if isinstance(value, tuple) and len(value) == 2 and isinstance(value[0], float):
            return value[0], str(value[1])
        match = _TURN.fullmatch(value.strip()) if isinstance(value, str) else None
        if match is None:
            raise self.refuse()
        try:
            return units.parse(match[1], "rad"), match[2]
        except units.UnitError as error:
            text = "it must be {allowed}; {reason}"
            raise PydanticCustomError("value", text, {"allowed": self.allowed, "reason": str(error)}) from None

    def write(self, value: Any) -> Any:
        """The value as a file has it."""
        return [f"{angle!r} rad about {axis}" for angle, axis in value] or "none"


class Mounting(Section):
    """How the body is fixed to the stand; where `recordings` gives other mountings, all go into one estimate."""

    rotation: Annotated[Any, TurnsKey()] = Field(
        (), description="of the body from where its axes are the stand's, about the stand's axes"
    )
    position: tuple[uncertain.PositionOrUnknown, uncertain.PositionOrUnknown, uncertain.PositionOrUnknown] = Field(
        (Uncertain(0.0), Uncertain(0.0), Uncertain(0.0)),
        description="of the point from which body.offset_x, height and offset_z count, from the stiffness centre, "
        "stand's axes",
    )
    alignment: Alignment = Field(0.0, description="standard uncertainty of the attitude about each axis of the stand")
    body: bool = Field(True, description="false: the stand was recorded without the body, with the tare alone")

    @property
    def matrix(self) -> np.ndarray:
        """(3, 3) body axes to the stand's."""
        R = np.eye(3)
        for angle, axis in self.rotation:
            R = rotation_matrix(angle * np.eye(3)["xyz".index(axis)]) @ R
        return R


class SpringTare(Section):
    """Something that moves along on the stand, such as a cradle, with its own mass properties, stand's axes."""

    name: str = "tare"
    mass: uncertain.MassOrZeroOrUnknown = Field(Uncertain(0.0), description="0 unless given")
    offset_x: uncertain.PositionOrUnknown = Field(
        Uncertain(0.0), description="of its centre of mass from the stiffness centre"
    )
    offset_z: uncertain.PositionOrUnknown = Field(Uncertain(0.0), description="likewise")
    height: uncertain.PositionOrUnknown = Field(
        Uncertain(0.0), description="of the attachment plane above its centre of mass"
    )
    Ixx: uncertain.InertiaOrZeroOrUnknown = Field(Uncertain(0.0), description="about its own centre of mass")
    Iyy: uncertain.InertiaOrZeroOrUnknown = Uncertain(0.0)
    Izz: uncertain.InertiaOrZeroOrUnknown = Uncertain(0.0)
    Ixy: uncertain.ProductOrUnknown = Field(Uncertain(0.0), description="element of the tensor")
    Ixz: uncertain.ProductOrUnknown = Uncertain(0.0)
    Iyz: uncertain.ProductOrUnknown = Uncertain(0.0)

    @model_validator(mode="after")
    def _check(self) -> SpringTare:
        values = {k: getattr(self, k).value for k in ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")}
        if any(map(math.isnan, values.values())) or not any(values.values()):
            return self
        xx, yy, zz, xy, xz, yz = values.values()
        if reason := inertia_defect(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])):
            raise InputError(f"the tare {self.name!r} has an inertia that no body has: {reason}")
        return self


def refuse_massless(tare: Sequence[SpringTare], *, vertical: bool) -> None:
    """Refuse a tare alone on the stand without a mass, or without a moment about an axis that it turns about.

    Parameters
    ----------
    vertical : bool, whether it turns about the horizontal axes alone
    """
    needed = ["mass"]
    if len(tare) == 1:  # several may have moments by their distances
        needed += ["Ixx", "Izz"] if vertical else ["Ixx", "Iyy", "Izz"]
    for key in needed:
        if not any((v := getattr(t, key)).unknown or v.value > 0.0 for t in tare):
            raise InputError(f"tare.0.{key} is 0; without the body it must be above 0 or 'unknown'")


class _Shape(Section):
    centre: units.Position = Field((0.0, 0.0, 0.0), description="from where offsets of the centre of mass count")
    of: Literal["body", "stand"] = Field("body", description="with which it moves, and in whose axes it is stated")
    factor: uncertain.Factor = Field(
        Uncertain(1.0), description="on the formula, with the standard uncertainty that it is given"
    )


class AirSphere(_Shape):
    """A sphere."""

    radius: units.Length

    def added(self) -> tuple[np.ndarray, np.ndarray]:
        """Added mass and moments (3, 3), per density."""
        return air.sphere(self.radius)


class AirDisc(_Shape):
    """A thin round plate."""

    radius: units.Length
    axis: units.Direction = (0.0, 1.0, 0.0)

    def added(self) -> tuple[np.ndarray, np.ndarray]:
        """Added mass and moments (3, 3), per density."""
        return air.disc(self.radius, np.array(self.axis))


class AirCylinder(_Shape):
    """A long cylinder."""

    radius: units.Length
    length: units.Length
    axis: units.Direction = (1.0, 0.0, 0.0)

    def added(self) -> tuple[np.ndarray, np.ndarray]:
        """Added mass and moments (3, 3), per density."""
        return air.cylinder(self.radius, self.length, np.array(self.axis))


class AirPlate(_Shape):
    """A thin rectangular plate."""

    length: units.Length
    width: units.Length
    axis: units.Direction = Field((0.0, 1.0, 0.0), description="its normal")
    along: units.Direction = Field((1.0, 0.0, 0.0), description="direction of its length")

    @model_validator(mode="after")
    def _check(self) -> AirPlate:
        if np.linalg.norm(np.cross(self.axis, self.along)) < 1e-6 * np.linalg.norm(self.axis) * np.linalg.norm(
            self.along
        ):
            raise InputError(f"axis and along of a plate are both {list(self.axis)}; its length lies across its normal")
        return self

    def added(self) -> tuple[np.ndarray, np.ndarray]:
        """Added mass and moments (3, 3), per density."""
        return air.plate(self.length, self.width, np.array(self.axis), np.array(self.along))


_Volume = Annotated[float, units.Quantity(what="a volume", unit="m^3", example="0.5 m^3", least=0.0)]
_Fifth = Annotated[float, units.Quantity(what="a fifth power of a length", unit="m^5", example="0.1 m^5", least=0.0)]


class AirGiven(_Shape):
    """Added mass and moments as known otherwise, over the density of air."""

    mass: tuple[_Volume, _Volume, _Volume] = Field((0.0, 0.0, 0.0), description="along x, y, z")
    moments: tuple[_Fifth, _Fifth, _Fifth] = Field((0.0, 0.0, 0.0), description="about x, y, z")

    def added(self) -> tuple[np.ndarray, np.ndarray]:
        """Added mass and moments (3, 3), per density."""
        return air.given(self.mass, self.moments)


#: Kinds of shapes that air surrounds, by the key of a file.
AIR_SHAPES = {"sphere": AirSphere, "disc": AirDisc, "cylinder": AirCylinder, "plate": AirPlate, "given": AirGiven}
_AirShape = Annotated[AirSphere | AirDisc | AirCylinder | AirPlate | AirGiven, OneOf(AIR_SHAPES)]


class Air(Section):
    """Air that moves with the body or the stand: it adds to the inertia, not to the weight."""

    density: uncertain.Density = Uncertain(1.204)
    shapes: tuple[_AirShape, ...] = Field(min_length=1)
