"""Joints of type link: of fixed length between two points, or a cord that a drum winds up."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.families.joints import joint as kernels
from evolvent.families.joints.part_release import release_fields
from evolvent.families.joints.part_rows import add_row
from evolvent.families.joints.part_sides import point_side
from evolvent.kernels import markers
from evolvent.parts.base import unit
from evolvent_base.dense import norm, product
from evolvent_base.errors import InputError


def write_link(joint: Any, builder: Builder, name: str) -> None:
    """Write the link into the family `links`, and its row of `joints`, as which implicit methods have it."""
    if joint.a == joint.b:
        raise InputError(f"{name}.a and {name}.b are the same point, {joint.a!r}; give two points")
    a, b = builder.marker(joint.a, f"{name}.a"), builder.marker(joint.b, f"{name}.b")
    distance = builder.marker_state(b)[0] - builder.marker_state(a)[0]
    axis, anchor = unit(joint.axis), unit(joint.anchor)
    if joint.drum > 0.0:
        length, R = _cord(joint, builder, name, a, distance)
        axis, anchor = product(R.T, axis), product(R.T, anchor)
    else:
        length = norm(distance) if joint.length is None else joint.length
    if length == 0.0:
        raise InputError(f"{name}.length is missing, and the ends of the link coincide at the start")
    index = builder.add("links", a=a, b=b, length=length, drum=joint.drum, axis=axis, zero=anchor, sense=joint.sense)
    builder.names[name] = ("links", index)
    sides, release = (point_side(builder, joint.a), point_side(builder, joint.b)), release_fields(builder, name, joint)
    if joint.drum > 0.0:
        add_row(
            builder, kernels.CORD, *sides, centre=sides[0].local, axis=axis, zero=anchor, radius=joint.drum,
            along=np.array([float(joint.sense), 0.0, 0.0]), value=length, **release,
        )  # fmt: skip
    else:
        add_row(builder, kernels.DISTANCE, *sides, value=length, **release)


def _cord(joint: Any, builder: Builder, name: str, a: int, distance: np.ndarray) -> tuple[float, np.ndarray]:
    """Length of a cord on a drum, whose position is checked, and the orientation of the drum's body at the start."""
    marker = builder.rows["markers"][a]
    if marker["kind"] != markers.ON_BODY:
        raise InputError(f"{name}.a is {joint.a!r}; a drum must be on a body or on the ground")
    if joint.length is None:
        raise InputError(f"{name}.length is missing; a cord on a drum needs its whole length")
    n = unit(joint.axis)
    if abs(n @ unit(joint.anchor)) > 1e-9:
        raise InputError(f"{name}.anchor is {joint.anchor!r}; it must be across the axis")
    across = distance - (n @ distance) * n
    if across @ across <= joint.drum**2:
        raise InputError(f"{name}.b is inside the drum of radius {joint.drum} m at the start")
    return joint.length, builder.poses[marker["index"]].R
