"""Link of fixed length between two markers, and the cord that a drum winds up."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from evolvent.builder import Builder
from evolvent.errors import InputError
from evolvent.kernels import joint, springs
from evolvent.parts.checks import not_negative, positive, unit_vector
from evolvent.parts.joint import add_row, place_side


@dataclasses.dataclass(frozen=True, kw_only=True)
class Link:
    """A massless link of fixed length; with a drum, a cord that winds onto it without slipping.

    Parameters
    ----------
    a, b : as the ends of a `Spring`
    length : float, m; without a drum, the distance at the start if left out; with one, the cord's whole length,
        wound part included, measured from `anchor`
    drum : float, m, radius of a drum about `axis` through marker `a` (which must be on a body); 0 for none
    axis, anchor : (3,) float, body axes: the drum's axis, and the direction in which the cord is fixed to it
    sense : {1, -1}, the cord winds on in the positive or negative sense about `axis`

    Notes
    -----
    The motion of a cord is taken to stay in the plane across the drum's axis.
    """

    a: Any
    b: Any
    length: float | None = None
    drum: float = 0.0
    axis: Sequence[float] = (0.0, 0.0, 1.0)
    anchor: Sequence[float] = (1.0, 0.0, 0.0)
    sense: int = 1

    def write(self, builder: Builder, name: str) -> None:
        """Write the link into the family `links`."""
        a, b = builder.marker(self.a), builder.marker(self.b)
        distance = builder.marker_state(b)[0] - builder.marker_state(a)[0]
        drum = not_negative(f"{name}.drum", self.drum)
        axis = unit_vector(f"{name}.axis", self.axis)
        anchor = unit_vector(f"{name}.anchor", self.anchor)
        length = self.length
        if drum > 0.0:
            marker = builder.rows["markers"][a]
            if marker["kind"] != springs.ON_BODY:
                raise InputError(f"{name}.a is {self.a!r}; a drum must be on a body or on the ground")
            if length is None:
                raise InputError(f"{name}.length is missing; a cord on a drum needs its whole length")
            if abs(axis @ anchor) > 1e-9:
                raise InputError(f"{name}.anchor is {self.anchor!r}; it must be across the axis")
            n = builder.poses[marker["index"]].R @ axis
            if abs(n @ distance) > 1e-9 * np.linalg.norm(distance):
                raise InputError(f"{name}.b is not in the plane of the drum at {name}.a")
            if distance @ distance <= drum * drum:
                raise InputError(f"{name}.b is inside the drum of radius {drum} m at the start")
        elif length is None:
            length = float(np.linalg.norm(distance))
        if self.sense not in (1, -1):
            raise InputError(f"{name}.sense is {self.sense!r}; it must be 1 or -1")
        index = builder.add(
            "links",
            a=a,
            b=b,
            length=positive(f"{name}.length", float(length or 0.0)),
            drum=drum,
            axis=axis,
            zero=anchor,
            sense=self.sense,
        )
        builder.names[name] = ("links", index)
        # the same constraint as implicit methods have it
        sides = place_side(builder, self.a), place_side(builder, self.b)
        if drum > 0.0:
            add_row(
                builder, joint.CORD, *sides, centre=sides[0].local, axis=axis, zero=anchor, radius=drum,
                along=np.array([float(self.sense), 0.0, 0.0]), value=length,
            )  # fmt: skip
        else:
            add_row(builder, joint.DISTANCE, *sides, value=length)
