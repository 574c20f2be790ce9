"""A rigid cylinder that beams touch."""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np

from evolvent import units
from evolvent.builder import Builder
from evolvent.errors import InputError
from evolvent.parts.base import BeamNames, BodyName, unit
from evolvent.parts.contact import Contact


class CylinderContact(Contact):
    """A rigid cylinder on a body (or the ground), and the beams that touch it.

    Parameters
    ----------
    body : str
        Body that the cylinder is fixed to, or ground.
    beams : list of str
        Beams whose contact points it pushes out.
    radius : float, m
        To the beams' axes.
    half_length : float, m, optional
        Half the cylinder's length; without limit if left out.
    centre : (3,) float, m
        Body axes.
    axis : (3,) float
        Body axes.
    skip : int
        Contact points next to the root that are left out (where the root itself is joined to the cylinder).
    initial_overlap : float
        Depth, in radii, up to which beams may lie below the surface at the start.
    """

    kind: Literal["cylinder-contact"] = "cylinder-contact"
    body: BodyName
    beams: BeamNames
    radius: units.Length
    half_length: units.Length | None = None
    centre: units.Position = (0.0, 0.0, 0.0)
    axis: units.Direction = (0.0, 0.0, 1.0)
    skip: Annotated[int, units.Whole(least=0, most=100_000)] = 0
    initial_overlap: units.NumberOrZero = 1e-3

    def write(self, builder: Builder, name: str) -> None:
        """Write the cylinder and its contact points."""
        body = builder.find(self.body, "bodies")
        centre, axis = np.array(self.centre), unit(self.axis)
        first = len(builder.rows["contact_points"])
        pose = builder.poses[body]
        for beam in self.beams:
            self._add_points(builder, name, beam, pose.x + pose.R @ centre, pose.R @ axis)
        index = builder.add(
            "cylinders",
            body=body,
            first=first,
            last=len(builder.rows["contact_points"]),
            under=-1,
            centre=centre,
            axis=axis,
            radius=self.radius,
            half_length=math.inf if self.half_length is None else self.half_length,
            **self.law_fields(),
        )
        builder.names[name] = ("cylinders", index)

    def _add_points(self, builder: Builder, name: str, beam: str, centre: np.ndarray, axis: np.ndarray) -> None:
        """Contact points of a beam; refused where it starts inside."""
        half = math.inf if self.half_length is None else self.half_length
        for fields in self.contact_points(builder, builder.find(beam, "beams"))[self.skip :]:
            S, iq = fields["S"], fields["iq"]
            at = sum(S[j] * np.array(builder.q[iq[j] : iq[j] + 3]) for j in range(4)) - centre
            off = float(np.linalg.norm(at - (at @ axis) * axis)) - self.radius
            if off < -self.initial_overlap * self.radius and abs(at @ axis) < half:
                raise InputError(
                    f"{beam!r} starts inside the cylinder {name!r}: a point of it is {-off:.3g} m below its surface"
                )
            builder.add("contact_points", **fields)
