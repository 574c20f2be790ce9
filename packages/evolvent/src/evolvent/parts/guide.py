"""Guide that holds one motion of a rigid body."""

from __future__ import annotations

from typing import Literal

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.kernels import constraint_rows, joint, rigid
from evolvent.parts.base import BodyName, Part, unit
from evolvent.parts.joint import add_row, direction_side, point_side
from evolvent_base import units
from evolvent_base.dense import dot, product
from evolvent_base.errors import InputError


class Guide(Part):
    """One motion of a free body held: of its centre along a direction, or of one of its axes out of a plane.

    Parameters
    ----------
    body : str
        A free body.
    direction : (3,) float
        Inertial axes.
    axis : (3,) float, optional
        Body axes. Left out, the centre of mass keeps its coordinate along `direction`. Given, this axis of the body
        stays perpendicular to `direction`, as it must be at the start.

    Notes
    -----
    The first pulls along `direction` at the centre of mass; the second turns about axis x direction.
    """

    kind: Literal["guide"] = "guide"
    body: BodyName
    direction: units.Direction
    axis: units.Direction | None = None

    def write(self, builder: Builder, name: str) -> None:
        """Write the guide into the family `guides`."""
        body = builder.find(self.body, "bodies")
        if builder.rows["bodies"][body]["motion"] != rigid.FREE:
            raise InputError(f"{name}.body is {self.body!r}; only a free body can be guided")
        direction = unit(self.direction)
        pose = builder.poses[body]
        if self.axis is None:
            kind, axis, value = constraint_rows.CENTRE, np.zeros(3), dot(direction, pose.x)
        else:
            kind, axis, value = constraint_rows.AXIS, unit(self.axis), 0.0
            off = dot(product(pose.R, axis), direction)
            if abs(off) > 1e-9:
                raise InputError(
                    f"{name}.axis is {self.axis!r}; it must be perpendicular to the direction at the start "
                    f"(their cosine is {off:.3g})"
                )
        index = builder.add("guides", kind=kind, body=body, direction=direction, axis=axis, value=value)
        builder.names[name] = ("guides", index)
        # the same constraint as implicit methods have it
        centre = point_side(builder, self.body)
        if self.axis is None:
            ground = point_side(builder, (0.0, 0.0, 0.0))
            add_row(builder, joint.POINT, ground, centre, along=direction, value=value)
        else:
            ground, turned = direction_side(builder, 0, direction), direction_side(builder, body, product(pose.R, axis))
            add_row(builder, joint.DIRECTION, ground, turned)
