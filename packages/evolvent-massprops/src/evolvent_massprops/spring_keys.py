"""Keys of a body on springs: the springs, the body, and how it is set swinging and recorded for a plan."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from evolvent_base import units
from evolvent_base.errors import InputError
from evolvent_base.schema import Section
from evolvent_massprops import uncertain
from evolvent_massprops.excitation_keys import Excitation
from evolvent_massprops.mounting_keys import TurnsKey
from evolvent_massprops.uncertain import Uncertain

#: Names of a body's mass properties: here, and in `evolvent_massprops.inertia`.
PROPERTIES = {"mass": "mass", "offset_x": "ex", "height": "h", "offset_z": "ez"} | {
    name: name for name in ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
}
#: Keys of the stand that a recording may be asked for: here, and in `evolvent_massprops.inertia`.
CALIBRATED = {"half_length": "a", "half_width": "b", "common_factor": "stiffness"}


class Springs(Section):
    """Springs that hold the body; axes x and z horizontal, y up, from the stiffness centre."""

    kind: Literal["springs"] = "springs"
    support: Literal["hanging", "guided", "standing"] = Field(
        "hanging", description="hanging, standing: free in six degrees of freedom; guided: lateral motion and yaw held"
    )
    half_length: uncertain.LengthOrUnknown | None = Field(None, description="a: four springs at x = +-a")
    half_width: uncertain.LengthOrUnknown | None = Field(None, description="b: and z = +-b")
    points: tuple[tuple[uncertain.Position, uncertain.Position, uncertain.Position], ...] | None = Field(
        None, description="attachment points of any number of springs, in place of half_length and half_width"
    )
    stiffness: uncertain.Stiffnesses = Field(description="of each spring by itself: uncertainties are independent")
    common_factor: uncertain.FactorOrUnknown = Field(
        Uncertain(1.0), description="on all stiffnesses: what their calibrations have in common"
    )
    natural_length: uncertain.Lengths
    lateral_stiffness: uncertain.Laterals = (Uncertain(0.0),)
    damping: uncertain.Dampings = Field(
        (Uncertain(0.0),),
        description="of each spring; used by `evolvent plan` alone: in a recording the decay is measured",
    )
    lateral_damping: uncertain.Dampings = Field((Uncertain(0.0),), description="as damping")
    gravity: uncertain.Gravity = Uncertain(9.80665)

    @model_validator(mode="after")
    def _check(self) -> Springs:
        sides = [k for k in ("half_length", "half_width") if getattr(self, k) is not None]
        if self.points is not None and sides:
            raise InputError(f"stand.points and stand.{sides[0]} are both given; give one of them")
        if self.points is None and len(sides) < 2:
            missing = "half_width" if sides == ["half_length"] else "half_length"
            raise InputError(f"stand.{missing} is missing; give half_length and half_width, or points")
        for key in sides:
            if np.isnan(getattr(self, key).value):
                raise InputError(f"stand.{key} is unknown; give it a start, such as unknown near 0.87 m +- 1 mm")
        if self.points is not None and len(self.points) < 3:
            raise InputError(f"stand.points has {len(self.points)}; at least three springs hold a body")
        for key in ("stiffness", "natural_length", "lateral_stiffness", "damping", "lateral_damping"):
            given = len(getattr(self, key))
            if given not in (1, self.number):
                raise InputError(f"stand.{key} has {given} values, but there are {self.number} springs")
        return self

    @property
    def unknown(self) -> tuple[str, ...]:
        """Keys that are asked."""
        return tuple(k for k in CALIBRATED if (v := getattr(self, k)) is not None and v.unknown)

    @property
    def number(self) -> int:
        """Number of springs."""
        return 4 if self.points is None else len(self.points)

    @property
    def attachment_points(self) -> np.ndarray:
        """(n, 3) attachment points, m; (a, b), (a, -b), (-a, -b), (-a, b) in (x, z) for a rectangle."""
        if self.points is not None:
            return np.array([[c.value for c in point] for point in self.points])
        assert self.half_length is not None
        assert self.half_width is not None
        a, b = self.half_length.value, self.half_width.value
        return np.array([[a, 0.0, b], [a, 0.0, -b], [-a, 0.0, -b], [-a, 0.0, b]])


class SpringBody(Section):
    """The body on springs: each number known, or 'unknown'."""

    name: str = "body"
    mass: uncertain.MassOrUnknown
    offset_x: uncertain.PositionOrUnknown = Field(description="of the centre of mass from the stiffness centre")
    offset_z: uncertain.PositionOrUnknown = Field(description="of the centre of mass from the stiffness centre")
    height: uncertain.PositionOrUnknown = Field(description="of the attachment plane above the centre of mass")
    Ixx: uncertain.InertiaOrUnknown = Field(Uncertain(np.nan, 0.0, True), description="about the centre of mass")
    Iyy: uncertain.InertiaOrUnknown | None = Field(None, description="left out: anything that a body can have")
    Izz: uncertain.InertiaOrUnknown = Uncertain(np.nan, 0.0, True)
    Ixy: uncertain.ProductOrUnknown | None = Field(None, description="element of the tensor; left out: 0")
    Ixz: uncertain.ProductOrUnknown | None = None
    Iyz: uncertain.ProductOrUnknown | None = None

    @property
    def unknown(self) -> tuple[str, ...]:
        """Keys that are asked."""
        return tuple(k for k in PROPERTIES if (v := getattr(self, k)) is not None and v.unknown)


class Planned(Section):
    """How the body is set swinging and recorded, for `evolvent plan`; signals need no file for it."""

    force: Annotated[float, units.Quantity(what="a force", unit="N", example="1000 N", above=0.0)] | None = Field(
        None, description="of the pull, straight down, that is released at once; where it acts is compared"
    )
    places: Annotated[tuple[Literal["spring", "two springs", "point"], ...], Field(min_length=1)] = Field(
        ("spring", "two springs", "point"),
        description="where the force may act: at a spring, at two springs with shares of it, at a point between the "
        "springs",
    )
    excitation: Excitation | None = Field(
        None, description="in place of force: what sets the body in motion, as of the case inertia-stand"
    )
    noise: Annotated[float, units.Quantity(what="a length", unit="m", example="0.1 mm", above=0.0)] | None = Field(
        None, description="standard deviation of the noise of sensors that state none"
    )
    rate: units.Frequency | None = Field(None, description="of sampling; several are compared unless given")
    duration: units.Duration = Field(60.0, description="of the longest record")
    reference: SpringBody | None = Field(
        None, description="a body with known mass properties, with which the stand could be calibrated"
    )
    mountings: tuple[Annotated[Any, TurnsKey()], ...] = Field(
        (), description="rotations in which the body could be recorded as well, as of mounting.rotation"
    )

    @model_validator(mode="after")
    def _check(self) -> Planned:
        if (self.force is None) == (self.excitation is None):
            given = "neither" if self.force is None else "both"
            raise InputError(f"plan gives {given} of force and excitation; give one of them, such as force: 1000 N")
        if self.reference is not None and self.reference.unknown:
            asked = ", ".join(self.reference.unknown)
            raise InputError(f"plan.reference has the unknown {asked}; a reference body is known: give its value")
        return self
