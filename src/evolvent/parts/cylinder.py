"""A rigid cylinder that beams touch."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from evolvent.builder import Builder
from evolvent.errors import InputError
from evolvent.parts.checks import positive, unit_vector, vector
from evolvent.parts.contact import Contact


@dataclasses.dataclass(frozen=True, kw_only=True)
class Cylinder(Contact):
    """A rigid cylinder on a body (or the ground), and the beams whose contact points it pushes out.

    Parameters
    ----------
    body : str
    beams : sequence of str
    radius : float, m, to the beams' axes
    half_length : float, m
    centre, axis : (3,) float, body axes
    law : {"hunt-crossley", "conservative", "paper"}
    stiffness : float, N/m^n, exponent : float, n, of each contact point
    damping : float, s/m (N s/m of the paper's law)
    points : int, contact points of an element, evenly spaced, its second node included
    friction : float, coefficient mu
    stick_stiffness, stick_damping : float, N/m and N s/m, of the bristle of a contact point that sticks
    skip : int, contact points next to the root that are left out (the root itself is joined to the cylinder)
    sunk : float, depth, in radii, up to which beams may lie below the surface at the start
    """

    body: str
    beams: Sequence[str]
    radius: float
    half_length: float = math.inf
    centre: Sequence[float] = (0.0, 0.0, 0.0)
    axis: Sequence[float] = (0.0, 0.0, 1.0)
    skip: int = 0
    sunk: float = 1e-3

    def write(self, builder: Builder, name: str) -> None:
        """Write the cylinder and its contact points."""
        body = builder.names["ground"][1] if self.body == "ground" else builder.find(self.body, "bodies")
        law = self.law_fields(name)
        radius = positive(f"{name}.radius", self.radius)
        centre = vector(f"{name}.centre", self.centre)
        axis = unit_vector(f"{name}.axis", self.axis)
        if not self.half_length > 0.0:
            raise InputError(f"{name}.half_length is {self.half_length!r}; it must be above 0 m")
        first = len(builder.rows["contact_points"])
        pose = builder.poses[body]
        for beam in self.beams:
            self._checks(builder, name, beam, pose.x + pose.R @ centre, pose.R @ axis)
        index = builder.add(
            "cylinders",
            body=body,
            first=first,
            last=len(builder.rows["contact_points"]),
            under=-1,
            centre=centre,
            axis=axis,
            radius=radius,
            half_length=float(self.half_length),
            **law,
        )
        builder.names[name] = ("cylinders", index)

    def _checks(self, builder: Builder, name: str, beam: str, centre: np.ndarray, axis: np.ndarray) -> None:
        places = self.contact_points(builder, name, builder.find(beam, "beams"))
        for fields in places[self.skip :]:
            S, iq = fields["S"], fields["iq"]
            at = sum(S[j] * np.array(builder.q[iq[j] : iq[j] + 3]) for j in range(4)) - centre
            off = float(np.linalg.norm(at - (at @ axis) * axis)) - self.radius
            if off < -self.sunk * self.radius and abs(at @ axis) < self.half_length:
                raise InputError(
                    f"{beam!r} starts inside the cylinder {name!r}: a point of it is {-off:.3g} m below its surface"
                )
            builder.add("contact_points", **fields)
