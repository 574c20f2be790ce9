"""Joints of type gear: two angles or travels in a ratio."""

from __future__ import annotations

import fractions
import math
from typing import Any

from evolvent.assembly.builder import Builder
from evolvent.families.joints import joint as kernels
from evolvent.families.joints.part_coordinate import check_units, joint_of
from evolvent.families.joints.part_release import release_fields
from evolvent.families.joints.part_rows import add_row
from evolvent.families.joints.part_sides import NOTHING, across, relative_coordinate
from evolvent.kernels import axial, rigid, sides
from evolvent.parts.base import unit
from evolvent_base.dense import product
from evolvent_base.errors import InputError

#: Most teeth that a ratio of angles may need.
_MOST_TEETH = 200
#: Types of joints, and which coordinate of them a gear takes.
_COORDINATES = {"revolute": axial.ANGLE, "cylindrical": axial.ANGLE, "screw": axial.ANGLE, "prismatic": axial.TRAVEL}


def write_gear(joint: Any, builder: Builder, name: str) -> None:
    """Write a row of the family `joints`, and one of `gear_coordinates` for each coordinate."""
    if joint.a == joint.b:
        raise InputError(f"{name}.a and {name}.b are both {joint.a!r}; a gear needs two coordinates")
    if joint.ratio is None:
        raise InputError(f"{name}.ratio is missing; a gear needs one, such as 2.0")
    if joint.ratio == 0.0:
        raise InputError(f"{name}.ratio is 0.0; a gear needs a ratio other than 0")
    found = [_coordinate(builder, f"{name}.{key}", where) for key, where in (("a", joint.a), ("b", joint.b))]
    kinds = [fields["kind"] for fields in found]
    for key in ("stiffness", "damping"):
        check_units(f"{name}.{key}", getattr(joint, key), kinds[0])
    period = _period(name, joint.ratio, kinds)
    for fields, factor in zip(found, (1.0, joint.ratio), strict=True):
        builder.add("gear_coordinates", factor=factor, **fields)
    last = len(builder.rows["gear_coordinates"])
    builder.names[name] = ("joints", len(builder.rows["joints"]))
    add_row(
        builder, kernels.GEAR, NOTHING, NOTHING, first=last - 2, last=last, radius=period,
        stiffness=joint.stiffness, damping=joint.damping, **release_fields(builder, name, joint),
    )  # fmt: skip


def _period(name: str, ratio: float, kinds: list[int]) -> float:
    """By what the sum q_a + ratio q_b may change while nothing has moved; 0 of travels."""
    if kinds == [axial.TRAVEL, axial.TRAVEL]:
        return 0.0
    if kinds == [axial.TRAVEL, axial.ANGLE]:
        return abs(ratio) * 2.0 * math.pi
    if kinds == [axial.ANGLE, axial.TRAVEL]:
        return 2.0 * math.pi
    teeth = fractions.Fraction(ratio).limit_denominator(_MOST_TEETH)
    if abs(float(teeth) - ratio) > 1e-9 * abs(ratio):
        raise InputError(
            f"{name}.ratio is {ratio!r}; between two angles it must be a ratio of whole numbers of teeth "
            f"up to {_MOST_TEETH}, such as {teeth.numerator}/{teeth.denominator}"
        )
    return 2.0 * math.pi / teeth.denominator


def _coordinate(builder: Builder, key: str, where: Any) -> dict[str, Any]:
    """Fields of a coordinate: of a joint, or of a body that spins."""
    family, index = builder.names.get(where, ("", -1))
    if family == "bodies":
        wheel = builder.rows["bodies"][index]
        if wheel["motion"] != rigid.SPIN:
            raise InputError(f"{key} is {where!r}; it must be a body with motion 'spin', or a joint")
        local = across(wheel["axis"])[0]
        axis, start = product(wheel["R0"], wheel["axis"]), product(builder.poses[index].R, local)
        return {"kind": axial.ANGLE, "body": 0, "other": index, "axis": axis, "zero": start, "local": local}
    part = joint_of(builder, where)
    if part is None or part.type not in _COORDINATES:
        what = f"a joint of type {part.type!r}" if part is not None else "not a joint"
        raise InputError(
            f"{key} is {where!r}, {what}, which has no single angle or travel; name a revolute, cylindrical, "
            f"screw or prismatic joint, or a body that spins"
        )
    row, kind = builder.rows["joints"][index], _COORDINATES[part.type]
    if any(on != sides.ON_BODY for on in row["on"][:2]):
        raise InputError(f"{key} is {where!r}, a joint on a beam or a point; a gear needs a joint between two bodies")
    return relative_coordinate(
        builder, kind, (int(row["index"][0]), int(row["index"][1])), unit(part.axis), row["local"][1]
    )
