"""Joints of type guide: one motion of a free body held against the ground."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.families.joints import joint as kernels
from evolvent.families.joints.part_rows import add_row
from evolvent.families.joints.part_sides import direction_side, ground_end, point_side
from evolvent.kernels import constraint_rows, rigid
from evolvent.parts.base import unit
from evolvent_base.dense import dot, product
from evolvent_base.errors import InputError


def write_guide(joint: Any, builder: Builder, name: str) -> None:
    """Write the guide into the family `guides`, and its row of `joints`, as which implicit methods have it."""
    ground_end(builder, name, joint)
    found = builder.location(joint.b, f"{name}.b")
    body = found.row if found.family == "bodies" and not np.any(found.local) else -1
    if body < 0 or builder.rows["bodies"][body]["motion"] != rigid.FREE:
        raise InputError(f"{name}.b is {joint.b!r}; only a free body, named alone, can be guided")
    direction, pose = unit(joint.axis), builder.poses[body]
    if joint.axis_b is None:
        kind, held, value = constraint_rows.CENTRE, np.zeros(3), dot(direction, pose.x)
    else:
        kind, held, value = constraint_rows.AXIS, unit(joint.axis_b), 0.0
        off = dot(held, direction)
        if abs(off) > 1e-9:
            raise InputError(
                f"{name}.axis_b is {joint.axis_b!r}; it must be perpendicular to {name}.axis at the start "
                f"(their cosine is {off:.3g})"
            )
    own = product(pose.R.T, held)
    index = builder.add("guides", kind=kind, body=body, direction=direction, axis=own, value=value)
    builder.names[name] = ("guides", index)
    if joint.axis_b is None:
        ground = point_side(builder, (0.0, 0.0, 0.0))
        add_row(builder, kernels.POINT, ground, point_side(builder, joint.b), along=direction, value=value)
    else:
        turned = direction_side(builder, body, held)
        add_row(builder, kernels.DIRECTION, direction_side(builder, 0, direction), turned)
