"""Link of fixed length between two points, and the cord that a drum winds up."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.kernels import joint, springs
from evolvent.parts.applies import Applies, given
from evolvent.parts.base import Part, PointReference, unit
from evolvent.parts.joint import add_row, point_side
from evolvent.parts.release import ReleaseName, release_fields
from evolvent_base import units
from evolvent_base.dense import norm, product
from evolvent_base.errors import InputError


class Link(Part):
    """A massless link of fixed length; with a drum, a cord that winds onto it.

    Parameters
    ----------
    a, b : point
        Ends, as of a `Spring`. For a node of a beam take a `Joint` of type "distance".
    length : float, m, optional
        Without a drum, the distance at the start if left out; with one, the cord's whole length, wound part included,
        measured from `anchor`.
    drum : float, m
        Radius of a drum about `axis` through `a` (which must be on a body or the ground); 0 for none.
    axis : (3,) float
        Of the drum, body axes.
    anchor : (3,) float
        Direction in which the cord is fixed to the drum, body axes.
    sense : {1, -1}
        The cord winds on in the positive or negative sense about `axis`.
    until : float, s, optional
        Time at which the link is released.
    released_by : str, optional
        Event, or spring with a latch, that releases the link where that comes before `until`.

    Notes
    -----
    A cord is fixed to the drum in the plane across its axis through `a`, at the radius `drum` in the direction
    `anchor`. It is taut and takes the shortest way over the drum: a helix, which goes over into the straight free part
    with one slope. It does not slip round the drum, and is free of friction along it; the drum is as long as needed. A
    cord that has unwound swings about its anchor, and then winds on in the other sense, unless it is released.

    A link pushes as well as it pulls; the result `tension` shows which.
    """

    applies: ClassVar[Applies] = {key: (given("drum"),) for key in ("axis", "anchor", "sense")}
    kind: Literal["link"] = "link"
    a: PointReference
    b: PointReference
    length: units.Length | None = None
    drum: units.LengthOrZero = 0.0
    axis: units.Direction = (0.0, 0.0, 1.0)
    anchor: units.Direction = (1.0, 0.0, 0.0)
    sense: Literal[1, -1] = 1
    until: units.Duration | None = None
    released_by: ReleaseName | None = None

    def write(self, builder: Builder, name: str) -> None:
        """Write the link into the family `links`."""
        if self.a == self.b:
            raise InputError(f"{name}.a and {name}.b are the same point, {self.a!r}; give two points")
        a, b = builder.marker(self.a, f"{name}.a"), builder.marker(self.b, f"{name}.b")
        distance = builder.marker_state(b)[0] - builder.marker_state(a)[0]
        axis, anchor = unit(self.axis), unit(self.anchor)
        if self.drum > 0.0:
            length = self._cord(builder, name, a, distance, axis, anchor)
        else:
            length = norm(distance) if self.length is None else self.length
        if length == 0.0:
            raise InputError(f"{name}.length is missing, and the ends of the link coincide at the start")
        index = builder.add("links", a=a, b=b, length=length, drum=self.drum, axis=axis, zero=anchor, sense=self.sense)
        builder.names[name] = ("links", index)
        # the same constraint as implicit methods have it
        sides, release = (point_side(builder, self.a), point_side(builder, self.b)), release_fields(builder, name, self)
        if self.drum > 0.0:
            add_row(
                builder, joint.CORD, *sides, centre=sides[0].local, axis=axis, zero=anchor, radius=self.drum,
                along=np.array([float(self.sense), 0.0, 0.0]), value=length, **release,
            )  # fmt: skip
        else:
            add_row(builder, joint.DISTANCE, *sides, value=length, **release)

    def _cord(
        self, builder: Builder, name: str, a: int, distance: np.ndarray, axis: np.ndarray, anchor: np.ndarray
    ) -> float:
        """Length of a cord on a drum, whose position is checked."""
        marker = builder.rows["markers"][a]
        if marker["kind"] != springs.ON_BODY:
            raise InputError(f"{name}.a is {self.a!r}; a drum must be on a body or on the ground")
        if self.length is None:
            raise InputError(f"{name}.length is missing; a cord on a drum needs its whole length")
        if abs(axis @ anchor) > 1e-9:
            raise InputError(f"{name}.anchor is {self.anchor!r}; it must be across the axis")
        n = product(builder.poses[marker["index"]].R, axis)
        across = distance - (n @ distance) * n
        if across @ across <= self.drum**2:
            raise InputError(f"{name}.b is inside the drum of radius {self.drum} m at the start")
        return self.length
