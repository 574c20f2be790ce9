"""The coordinate of a joint, an angle or a travel, that springs, motors and resistances act on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.assembly.references import Location, split_reference
from evolvent.kernels import ancf_beams, axial
from evolvent.kernels.sides import ON_BODY, ON_COORDINATES
from evolvent.parts.base import unit
from evolvent_base.dense import dot, norm, product
from evolvent_base.errors import InputError, nearest
from evolvent_base.schema import Section
from evolvent_base.units import Measured

#: Units of an angle and what belongs to it, and those of a travel.
ANGLE_AND_TRAVEL = (
    ("rad", "m"), ("rad/s", "m/s"), ("N m", "N"), ("N m/rad", "N/m"), ("N m s/rad", "N s/m"),
)  # fmt: skip
#: Deflection at which friction slips by default, rad and m.
PRESLIDING = {axial.ANGLE: 1e-4, axial.TRAVEL: 1e-5}
#: Types of joints that have an angle, and those that have a travel; the first of each has no other coordinate.
TYPES = {axial.ANGLE: ("revolute", "cylindrical", "screw"), axial.TRAVEL: ("prismatic", "cylindrical", "screw")}
#: What the angle of a beam's node at the start may be off the one from the direction of angle 0, rad.
_LEAST_OFF = 1e-6


class Ends(NamedTuple):
    """What a coordinate is between: names of its ends, the body of the first, the point of the second, and the axis.

    The axis (3,) is of length 1, in inertial axes at the start.
    """

    a: Any
    b: Any
    body: int
    location: Location
    axis: np.ndarray


class Coordinate(NamedTuple):
    """A coordinate: its kind, the body that it is measured on, the axis (3,) in axes of that, its value at the start.

    `fields` are those of the family `coordinates` that say where the second end is.
    """

    kind: int
    body: int
    axis: np.ndarray
    start: float
    fields: dict[str, Any]

    def write(self, builder: Builder, own: dict[str, Any], **limits: float) -> int:
        """Write the row of the family `coordinates`, with fields of what acts on it; returns its index."""
        return add_coordinate(builder, self.kind, self.body, self.axis, self.start, own | self.fields, **limits)


def joint_of(builder: Builder, name: str | None) -> Any:
    """The `Joint` of a name; None of what is none."""
    spec = builder.specs.get(name) if name is not None else None
    return spec if getattr(spec, "kind", "") == "joint" else None


def find_coordinate(builder: Builder, key: str, name: str) -> int:
    """Row of the family `coordinates` of a spring, or a new one of a joint, which counts from 0 at the start.

    Parameters
    ----------
    key : str, that holds the name, for messages
    """
    family, index = builder.names.get(name, ("", -1))
    if family == "coordinates":
        return index
    spec: Any = builder.specs.get(name)
    if joint_of(builder, name) is None:
        known = [n for n, part in builder.specs.items() if getattr(part, "kind", "") in ("joint", "joint-spring")]
        what = f"a {type(spec).__name__}" if spec is not None else "no part"
        raise InputError(
            f"{key} is {name!r}, {what}, which has no coordinate; name a JointSpring, or a revolute or prismatic "
            f"Joint; {nearest_joint(name, known)}"
        )
    kind = next((kind for kind, types in TYPES.items() if types[0] == spec.type), None)
    if kind is None:
        raise InputError(
            f"{key} is {name!r}, a joint of type {spec.type!r}, which has no single coordinate; name a revolute or "
            f"prismatic joint, or a JointSpring on one of its axes"
        )
    own = f"{name} (coordinate)"
    ends = ends_of_joint(builder, f"{own}.joint", name, TYPES[kind])
    found = rotation(builder, own, ends) if kind == axial.ANGLE else translation(builder, own, ends)
    keys = ("stiffness", "damping", "rest", "friction", "stop", "latch_stiffness", "latch_damping")
    return found.write(builder, dict.fromkeys(keys, 0.0))


def rotation(
    builder: Builder, name: str, ends: Ends, start: float | None = None, zero: Sequence[float] | None = None
) -> Coordinate:
    """The angle of the second end about the axis.

    Parameters
    ----------
    start : float, rad, optional, at the start
    zero : (3,) float, optional, direction of angle 0 of a beam's node, inertial axes at the start
    """
    place, axis, R = ends.location, ends.axis, builder.poses[ends.body].R
    if place.family == "points":
        raise InputError(f"{name}.b is {ends.b!r}, a point mass, which has no angle; give a body or a beam's node")
    if place.family == "bodies":
        if place.row == ends.body:
            raise InputError(f"{name}.a and {name}.b are one body, {ends.a!r}; a hinge needs two parts")
        if zero is not None:
            raise InputError(f"{name}.zero is given, but {name}.b is a body; give {name}.start, its angle at the start")
        angle, e = start or 0.0, _across(axis)
        u = math.cos(angle) * e + math.sin(angle) * np.cross(axis, e)
        local = product(builder.poses[place.row].R.T, u)
        fields = {"on": ON_BODY, "other": place.row, "iq": -1, "iv": -1, "local": local}
    else:
        which, e, angle = _slope(builder, name, ends, start, zero)
        iq, iv = place.iq + 3 * which, place.iv + 3 * which
        fields = {"on": ON_COORDINATES, "other": -1, "iq": iq, "iv": iv, "local": np.zeros(3)}
    fields["zero"] = product(R.T, e)
    return Coordinate(axial.ANGLE, ends.body, product(R.T, axis), angle, fields)


def translation(builder: Builder, name: str, ends: Ends, start: float = 0.0) -> Coordinate:
    """The travel of the second end along the axis, `start` (m) at the start."""
    place, pose = ends.location, builder.poses[ends.body]
    on_body = place.family == "bodies"
    if on_body and place.row == ends.body:
        raise InputError(f"{name}.a and {name}.b are on one body, {ends.a!r}; a travel needs two parts")
    fields = {
        "on": ON_BODY if on_body else ON_COORDINATES,
        "other": place.row if on_body else -1,
        "iq": -1 if on_body else place.iq,
        "iv": -1 if on_body else place.iv,
        "local": np.asarray(place.local, dtype=float),
        "zero": product(pose.R.T, place.x - start * ends.axis - pose.x),
    }
    return Coordinate(axial.TRAVEL, ends.body, product(pose.R.T, ends.axis), start, fields)


def _slope(
    builder: Builder, name: str, ends: Ends, start: float | None, given: Sequence[float] | None
) -> tuple[int, np.ndarray, float]:
    """The slope of a beam's node that shows its angle, along it or across it; its direction of angle 0, its angle."""
    place, axis = ends.location, ends.axis
    slope = np.array(builder.q[place.iq + 3 : place.iq + 6])
    zero = unit(slope if given is None else given)
    if abs(zero @ axis) > 1e-6:
        raise InputError(f"{name}.zero is {tuple(zero.tolist())!r}; it must be across the axis")
    zero = zero - dot(zero, axis) * axis
    zero /= norm(zero)
    if given is None and start is not None:
        zero = math.cos(start) * zero - math.sin(start) * np.cross(axis, zero)
    which = 1
    if place.beam == ancf_beams.BEAM:
        across = np.array(builder.q[place.iq + 6 : place.iq + 12]).reshape(2, 3)
        which = 2 + int(np.argmin(np.abs(product(across, axis)) / np.linalg.norm(across, axis=1)))
        quarter = np.cross(axis, zero)
        zero = quarter if dot(across[which - 2], np.cross(axis, slope)) > 0.0 else -quarter
        slope = across[which - 2]
    angle = math.atan2(dot(slope, np.cross(axis, zero)), dot(slope, zero))
    if start is None:
        return which, zero, angle
    off = math.remainder(angle - start, 2.0 * math.pi)
    if abs(off) > _LEAST_OFF:
        raise InputError(
            f"{name}.start is {start:.9g} rad, but {name}.b is at {angle:.9g} rad from {name}.zero "
            f"(plus or minus whole turns); give that, or leave out one of the two"
        )
    return which, zero, start + off


def _across(axis: np.ndarray) -> np.ndarray:
    """A unit vector across another."""
    e = np.zeros(3)
    e[int(np.argmin(np.abs(axis)))] = 1.0
    return unit(np.cross(axis, e))


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
        together=0,
        together_end=0,
        **({"angle": start, "before": start, "anchor": start} | fields),
    )


def ends_of_joint(builder: Builder, key: str, joint: str, types: Sequence[str]) -> Ends:
    """Ends and axis of a joint of one of the types; its body is the first end.

    Parameters
    ----------
    key : str, that names the joint, for messages
    """
    spec: Any = builder.specs.get(joint)
    if joint_of(builder, joint) is None:
        known = [name for name in builder.specs if joint_of(builder, name) is not None]
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
    if spec.drive is not None and "axis" not in spec.model_fields_set:  # that of the spinning body which is driven
        body = builder.rows["bodies"][builder.location(spec.b, f"{joint}.b").row]
        axis = product(body["R0"], body["axis"])
    for a, b, along in ((spec.a, spec.b, axis), (spec.b, spec.a, -axis)):
        first = builder.location(a, f"{joint}.a")
        if first.family == "bodies":
            return Ends(owner_of(a), b, first.row, builder.location(b, f"{joint}.b"), along)
    raise InputError(
        f"{key} is {joint!r}, with no end on a body, but at {spec.a!r} and {spec.b!r}; one end must be on a body"
    )


def _either(types: Sequence[str]) -> str:
    return " or ".join(repr(one) for one in types)


def nearest_joint(name: str, known: list[str]) -> str:
    """End of a sentence: the nearest of the known names."""
    return nearest(name, known) if known else "there is no joint"


def owner_of(place: Any) -> Any:
    """The part that a point is on."""
    if isinstance(place, str):
        return split_reference(place)[0]
    return place[0] if isinstance(place[0], str) else "ground"


def check_units(key: str, value: Any, kind: int) -> None:
    """Refuse values, also inside sections and lists, that have units of a travel on an angle, or the other way round.

    Parameters
    ----------
    key : str, that holds the value, for messages
    kind : `axial.ANGLE` or `axial.TRAVEL`
    """
    if isinstance(value, Section):
        for inner in type(value).model_fields:
            check_units(f"{key}.{inner}", getattr(value, inner), kind)
    elif isinstance(value, tuple):
        for inner in value:
            check_units(key, inner, kind)
    elif isinstance(value, Measured):
        at = next((k for k, pair in enumerate(ANGLE_AND_TRAVEL) if value.unit in pair), None)
        if at is not None and value.unit != ANGLE_AND_TRAVEL[at][kind != axial.ANGLE]:
            what, wanted = ("an angle", 0) if kind == axial.ANGLE else ("a travel", 1)
            raise InputError(
                f"{key} is {float(value):g} {value.unit}, but its coordinate is {what}; give it in "
                f"{ANGLE_AND_TRAVEL[at][wanted]}"
            )
