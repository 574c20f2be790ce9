"""Point mass."""

from __future__ import annotations

from typing import Literal

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.families.joints import joint as kernels
from evolvent.families.joints.part_rows import add_row
from evolvent.families.joints.part_sides import point_side
from evolvent.families.threads.part_joint import carry_point
from evolvent.parts.base import Group, Part, PointReference
from evolvent_base import units
from evolvent_base.errors import InputError


class Point(Part):
    """A point mass, free in three directions, or fixed to a point of another part.

    Parameters
    ----------
    mass : float, kg
        Of the point.
    position, velocity : (3,) float, m and m/s
        At the start, inertial axes.
    at : point, optional
        Point of a body, beam or rod, such as "boom.tip" or "hub.left", or the end of a thread, "tether.tip", that the
        mass is fixed to; position and velocity are those of that point.
    """

    kind: Literal["point"] = "point"
    group = Group.BODIES
    mass: units.Mass
    position: units.Position = (0.0, 0.0, 0.0)
    velocity: units.Velocity = (0.0, 0.0, 0.0)
    at: PointReference | None = None

    def write(self, builder: Builder, name: str) -> None:
        """Write the point into the family `points`; fixed to a point, three rows of `joints` as well."""
        position, velocity, held = self.position, self.velocity, None
        if self.at is not None:
            for key in ("position", "velocity"):
                if key in self.model_fields_set:
                    raise InputError(f"{name}.{key} and {name}.at are both given; {name}.at says where the point is")
            key = f"{name}.at"
            if carry_point(builder, name, self):
                return
            held = point_side(builder, self.at, key)
            position, velocity = tuple(held.u), tuple(builder.velocity_of(self.at, key))
        q, v = builder.coordinates(position, velocity)
        index = builder.add("points", iq=q, iv=v, mass=self.mass, compliance=1.0 / self.mass)
        builder.names[name] = ("points", index)
        if held is not None:
            own = point_side(builder, name)
            for along in np.eye(3):
                add_row(builder, kernels.POINT, held, own, along=along)
