"""Common base of springs of joints: the coordinate of a joint, an angle or a travel, and its resistance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.assembly.references import Location, split_reference
from evolvent.kernels import axial
from evolvent.parts.applies import Applies, given, left_out
from evolvent.parts.base import Part, unit
from evolvent.parts.joint import Joint
from evolvent_base.errors import InputError, nearest

#: Deflection at which friction slips by default, rad and m.
PRESLIDING = {axial.ANGLE: 1e-4, axial.TRAVEL: 1e-5}

#: Keys of springs of joints that apply only beside others.
COORDINATE_APPLIES: Applies = {
    "joint": (left_out("a", "b"),),
    "a": (left_out("joint"),),
    "b": (left_out("joint"),),
    "axis": (left_out("joint"),),
    "stop": (given("low", "high"),),
    "latch_stiffness": (given("latch"),),
    "latch_damping": (given("latch"),),
}


class Ends(NamedTuple):
    """What a coordinate is between: names of its ends, the body of the first, the point of the second, and the axis.

    The axis (3,) is of length 1, in inertial axes at the start.
    """

    a: Any
    b: Any
    body: int
    location: Location
    axis: np.ndarray


class CoordinateSpring(Part):
    """A spring on the coordinate of a joint: its ends, checks and row. Keys are those of the subclasses."""

    #: Key of the Coulomb friction, a force or a torque.
    friction_key: ClassVar[str]

    if TYPE_CHECKING:
        joint: str | None
        a: str | None
        b: Any
        axis: Any
        stiffness: float
        damping: float
        rest: float
        bristle_stiffness: float | None
        low: float | None
        high: float | None
        stop: float
        latch: float | None
        latch_stiffness: float
        latch_damping: float

    @property
    def friction(self) -> float:
        """Coulomb friction, N m or N."""
        return float(getattr(self, self.friction_key))

    def check(self, name: str, unit_of: str, stiffness: str) -> None:
        """Refuse stops, latches and friction without what they need."""
        if self.low is not None and self.high is not None and self.low > self.high:
            raise InputError(f"{name}.low is {self.low!r} {unit_of}, above {name}.high, {self.high!r} {unit_of}")
        if (self.low is not None or self.high is not None) and self.stop == 0.0:
            raise InputError(f"{name}.stop is {self.stop!r}; stops need a stiffness above 0 {stiffness}")
        if self.latch is not None and self.latch_stiffness == 0.0:
            raise InputError(
                f"{name}.latch_stiffness is {self.latch_stiffness!r}; a latch needs one above 0 {stiffness}"
            )
        if self.bristle_stiffness is not None and self.friction == 0.0:
            raise InputError(
                f"{name}.bristle_stiffness is given, but {name}.{self.friction_key} is 0.0; give one above 0"
            )
        if self.bristle_stiffness == 0.0:
            raise InputError(f"{name}.bristle_stiffness is 0.0; friction needs one above 0 {stiffness}")

    def ends(self, builder: Builder, name: str, types: Sequence[str]) -> Ends:
        """Ends and axis, its own or those of the joint that it names, which must be of one of the types."""
        if self.joint is None:
            for key in ("a", "b"):
                if getattr(self, key) is None:
                    raise InputError(f"{name}.{key} is missing; give {name}.a and {name}.b, or {name}.joint")
            index = builder.find(str(self.a), "bodies")
            return Ends(self.a, self.b, index, builder.location(self.b, f"{name}.b"), unit(self.axis))
        given = [key for key in ("a", "b", "axis") if key in self.model_fields_set and getattr(self, key) is not None]
        if given:
            raise InputError(
                f"{name}.{given[0]} and {name}.joint, {self.joint!r}, are both given; leave one of them out"
            )
        return ends_of_joint(builder, f"{name}.joint", self.joint, types)

    def add_row(
        self, builder: Builder, name: str, kind: int, body: int, axis: np.ndarray, start: float, fields: dict[str, Any]
    ) -> None:
        """Write the row of the family `coordinates`; axis : (3,) float, axes of the body."""
        latch = math.inf if self.latch is None else self.latch
        keys = ("stiffness", "damping", "rest", "friction", "stop", "latch_stiffness", "latch_damping")
        stick = self.bristle_stiffness
        found = add_coordinate(
            builder, kind, body, axis, start,
            {key: getattr(self, key) for key in keys} | fields,
            low=-math.inf if self.low is None else self.low,
            high=math.inf if self.high is None else self.high,
            latch=latch,
            stick=self.friction / PRESLIDING[kind] if stick is None else stick,
        )  # fmt: skip
        builder.names[name] = ("coordinates", found)


def add_coordinate(
    builder: Builder, kind: int, body: int, axis: np.ndarray, start: float, fields: dict[str, Any], *,
    low: float = -math.inf, high: float = math.inf, latch: float = math.inf, stick: float = 0.0,
) -> int:  # fmt: skip
    """Write a row of the family `coordinates`; returns its index."""
    return builder.add(
        "coordinates",
        kind=kind,
        body=body,
        axis=axis,
        low=low,
        high=high,
        latch=latch,
        stick=stick,
        side=1.0 if start > latch else -1.0,
        **({"angle": start, "before": start, "anchor": start} | fields),
    )


def ends_of_joint(builder: Builder, key: str, joint: str, types: Sequence[str]) -> Ends:
    """Ends and axis of a joint of one of the types; its body is the first end.

    Parameters
    ----------
    key : str, that names the joint, for messages
    """
    spec = builder.specs.get(joint)
    if not isinstance(spec, Joint):
        known = [name for name, part in builder.specs.items() if isinstance(part, Joint)]
        what = f"a {type(spec).__name__}" if spec is not None else "no part"
        raise InputError(
            f"{key} is {joint!r}, {what}; it must be a Joint of type {_either(types)}; {nearest_joint(joint, known)}"
        )
    if spec.type not in types:
        raise InputError(
            f"{key} is {joint!r}, a joint of type {spec.type!r}, which does not have this coordinate; it must be "
            f"of type {_either(types)}"
        )
    axis = unit(spec.axis)
    for a, b, along in ((spec.a, spec.b, axis), (spec.b, spec.a, -axis)):
        first = builder.location(a, f"{joint}.a")
        if first.family == "bodies":
            return Ends(_owner(a), b, first.row, builder.location(b, f"{joint}.b"), along)
    raise InputError(
        f"{key} is {joint!r}, with no end on a body, but at {spec.a!r} and {spec.b!r}; one end must be on a body"
    )


def _either(types: Sequence[str]) -> str:
    return " or ".join(repr(one) for one in types)


def nearest_joint(name: str, known: list[str]) -> str:
    """End of a sentence: the nearest of the known names."""
    return nearest(name, known) if known else "there is no joint"


def _owner(place: Any) -> Any:
    """The part that a point is on."""
    if isinstance(place, str):
        return split_reference(place)[0]
    return place[0] if isinstance(place[0], str) else "ground"
