"""Gear: two angles or travels in a ratio."""

from __future__ import annotations

import fractions
import math
from typing import Annotated, Any, Literal

from evolvent.assembly.builder import Builder
from evolvent.kernels import axial, joint, rigid, sides
from evolvent.parts.base import Part, Reference, unit
from evolvent.parts.joint import Joint, add_row
from evolvent.parts.joint_sides import NOTHING, across, relative_coordinate
from evolvent_base import units
from evolvent_base.dense import product
from evolvent_base.errors import InputError

#: Most teeth that a ratio of angles may need.
_MOST_TEETH = 200
#: Types of joints, and which coordinate of them a gear takes.
_COORDINATES = {"revolute": axial.ANGLE, "cylindrical": axial.ANGLE, "screw": axial.ANGLE, "prismatic": axial.TRAVEL}


class Gear(Part):
    """Two angles or travels in a fixed ratio: a pair of wheels, a rack and pinion, a belt, telescope stages on a cable.

    Parameters
    ----------
    a, b : str
        The two coordinates: the angle of a revolute, cylindrical or screw joint or the travel of a prismatic joint, of
        the joint's b relative to its a, both of them bodies; or the angle of a spinning body.
    ratio : float, 1, m/rad or rad/m
        q_a + ratio q_b stays constant. Meshing wheels have the ratio r_b/r_a of their radii, above 0; a belt has a
        negative ratio. Between two angles a ratio of whole numbers (of teeth) up to 200, such as 20/35.
    stiffness : float, N m/rad or N/m
        Above 0, a penalty in place of the constraint, referred to q_a.
    damping : float, N m s/rad or N s/m
        Damping of the penalty.
    until : float, s, optional
        Time at which the gear is released; never if left out.
    """

    kind: Literal["gear"] = "gear"
    a: Annotated[str, Reference(what="a joint or a spinning body")]
    b: Annotated[str, Reference(what="a joint or a spinning body")]
    ratio: units.Number
    stiffness: units.NumberOrZero = 0.0
    damping: units.NumberOrZero = 0.0
    until: units.Duration | None = None

    def write(self, builder: Builder, name: str) -> None:
        """Write a row of the family `joints`, and one of `gear_coordinates` for each coordinate."""
        if self.a == self.b:
            raise InputError(f"{name}.a and {name}.b are both {self.a!r}; a gear needs two coordinates")
        if self.ratio == 0.0:
            raise InputError(f"{name}.ratio is 0; it must not be 0")
        found = [_coordinate(builder, f"{name}.{key}", where) for key, where in (("a", self.a), ("b", self.b))]
        for fields, factor in zip(found, self._factors(name, found), strict=True):
            builder.add("gear_coordinates", factor=factor, **fields)
        last = len(builder.rows["gear_coordinates"])
        builder.names[name] = ("joints", len(builder.rows["joints"]))
        add_row(
            builder, joint.GEAR, NOTHING, NOTHING, first=last - 2, last=last, radius=self._period(found),
            stiffness=self.stiffness, damping=self.damping, until=math.inf if self.until is None else self.until,
        )  # fmt: skip

    def _factors(self, name: str, found: list[dict[str, Any]]) -> tuple[float, float]:
        if all(fields["kind"] == axial.ANGLE for fields in found):
            teeth = fractions.Fraction(self.ratio).limit_denominator(_MOST_TEETH)
            if abs(float(teeth) - self.ratio) > 1e-9 * abs(self.ratio):
                raise InputError(
                    f"{name}.ratio is {self.ratio!r}; between two angles it must be a ratio of whole numbers of teeth "
                    f"up to {_MOST_TEETH}, such as {teeth.numerator}/{teeth.denominator}"
                )
        return 1.0, self.ratio

    def _period(self, found: list[dict[str, Any]]) -> float:
        """By what the sum q_a + ratio q_b may change while nothing has moved; 0 of travels."""
        kinds = [fields["kind"] for fields in found]
        if kinds == [axial.TRAVEL, axial.TRAVEL]:
            return 0.0
        if kinds == [axial.TRAVEL, axial.ANGLE]:
            return abs(self.ratio) * 2.0 * math.pi
        if kinds == [axial.ANGLE, axial.TRAVEL]:
            return 2.0 * math.pi
        return 2.0 * math.pi / fractions.Fraction(self.ratio).limit_denominator(_MOST_TEETH).denominator


def _coordinate(builder: Builder, key: str, where: str) -> dict[str, Any]:
    """Fields of a coordinate: of a joint, or of a body that spins."""
    family, index = builder.names.get(where, ("", -1))
    if family == "bodies":
        wheel = builder.rows["bodies"][index]
        if wheel["motion"] != rigid.SPIN:
            raise InputError(f"{key} is {where!r}; it must be a body with motion 'spin', or a joint")
        local = across(wheel["axis"])[0]
        axis, start = product(wheel["R0"], wheel["axis"]), product(builder.poses[index].R, local)
        return {"kind": axial.ANGLE, "body": 0, "other": index, "axis": axis, "zero": start, "local": local}
    part = builder.specs.get(where)
    if not isinstance(part, Joint) or part.type not in _COORDINATES:
        what = f"a joint of type {part.type!r}" if isinstance(part, Joint) else "not a joint"
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
