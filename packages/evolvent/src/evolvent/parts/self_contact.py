"""Turns of beams that lie on one another."""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.parts.base import BeamName, BodyName, unit
from evolvent.parts.contact import Contact
from evolvent_base import units
from evolvent_base.dense import dot, product
from evolvent_base.errors import InputError, counted

_THICKNESS = units.Quantity(what="a length", unit="m", example="0.3 mm", above=0.0)


class SelfContact(Contact):
    """Turns of a beam wound round a body, which lie on turns of the same beam or of a neighbour.

    Needs an implicit method or statics. Under `generalized-alpha` a point that moves past the end of the beam below
    gains or loses the energy of its contact, and a step with k points that touch costs of the order of k^2 times the
    number of elements more. Under `energy-momentum` it never gains energy there, and a step costs a few times as much.

    Parameters
    ----------
    law : {"hunt-crossley", "paper"}
        Law of the normal force against the depth.
    body : str
        Body that the beams are wound round, or ground.
    over : str
        Beam whose contact points are pushed out.
    under : str, optional
        Beam on whose turns they lie; `over` itself if left out. Of several beams hinged round a body, the next one in
        the sense of winding.
    thickness : float or one of each element, m
        Of both beams across their flat side: the distance of touching axes.
    width : float, m, optional
        Of the beams along the axis, beyond which they lie side by side; without limit if left out.
    sense : {1, -1}
        Of winding about the axis.
    centre : (3,) float, m
        Body axes.
    axis : (3,) float
        Body axes.
    """

    kind: Literal["self-contact"] = "self-contact"
    law: Literal["hunt-crossley", "paper"] = "hunt-crossley"
    body: BodyName
    over: BeamName
    under: BeamName | None = None
    thickness: Annotated[float | tuple[float, ...], units.OneOrMore(quantity=_THICKNESS, each="one of each element")]
    width: units.Length | None = None
    sense: Literal[1, -1] = 1
    centre: units.Position = (0.0, 0.0, 0.0)
    axis: units.Direction = (0.0, 0.0, 1.0)

    def write(self, builder: Builder, name: str) -> None:
        """Write the layer and its contact points."""
        body = builder.find(self.body, "bodies")
        over = builder.find(self.over, "beams")
        under = over if self.under is None else builder.find(self.under, "beams")
        centre, axis = np.array(self.centre), unit(self.axis)
        pose = builder.poses[body]
        for beam, owner in {over: self.over, under: self.under or self.over}.items():
            self._thicken(builder, name, beam, owner)
        first = len(builder.rows["contact_points"])
        for fields in self.contact_points(builder, over):
            builder.add("contact_points", carrier=-1, **fields)
        index = builder.add(
            "contact_surfaces",
            body=body,
            first=first,
            last=len(builder.rows["contact_points"]),
            under=under,
            sense=float(self.sense),
            shift=self._shift(builder, over, under, pose.x + product(pose.R, centre), product(pose.R, axis)),
            centre=centre,
            axis=axis,
            half_length=math.inf if self.width is None else self.width,
            **self.law_fields(),
        )
        builder.names[name] = ("contact_surfaces", index)

    def _thicken(self, builder: Builder, name: str, beam: int, owner: str) -> None:
        """Write the thickness into a beam's elements."""
        row = builder.rows["beams"][beam]
        found = np.array(self.thickness, dtype=float)
        if found.ndim == 0:
            found = np.full(row["elements"], found)
        if found.shape != (row["elements"],):
            raise InputError(
                f"{name}.thickness has {counted(found.size, 'value')}; it must be one value, or "
                f"{row['elements']} of them, one "
                f"for each element of {owner!r}"
            )
        for c in range(row["elements"]):
            builder.rows["elements"][row["first_element"] + c]["thickness"] = found[c]

    def _shift(self, builder: Builder, over: int, under: int, centre: np.ndarray, axis: np.ndarray) -> float:
        """Angle from the root of `over` to that of `under` in the sense of winding, above 0 to a whole turn."""
        if over == under:
            return 2.0 * math.pi
        roots = []
        for beam in (over, under):
            at = builder.rows["beams"][beam]["iq"]
            root = np.array(builder.q[at : at + 3]) - centre
            roots.append(root - dot(root, axis) * axis)
        angle = self.sense * math.atan2(dot(np.cross(*roots), axis), dot(*roots))
        return angle if angle > 1e-9 else angle + 2.0 * math.pi
