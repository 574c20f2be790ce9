"""Turns of beams that lie on one another."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from evolvent.builder import Builder
from evolvent.errors import InputError
from evolvent.kernels import contact_laws
from evolvent.kernels.layers import UNKNOWN
from evolvent.parts.checks import unit_vector, vector
from evolvent.parts.contact import Contact


@dataclasses.dataclass(frozen=True, kw_only=True)
class Layers(Contact):
    """Turns of a beam wound round a body, which lie on turns of the same beam or of a neighbour.

    Needs `generalized-alpha` or statics. A point that moves past the end of the beam below gains or loses the energy of
    its contact. A step with k points that touch costs of the order of k^2 times the number of elements more.

    Parameters
    ----------
    body : str, that the beams are wound round
    over : str, beam whose contact points are pushed out
    under : str, beam on whose turns they lie; "" for `over` itself. Of several beams hinged round a body, the next one
        in the sense of winding
    thickness : float or one of each element, m, of both beams across their flat side: the distance of touching axes
    width : float, m, of the beams along the axis, beyond which they lie side by side
    sense : {1, -1}, of winding about the axis
    centre, axis : (3,) float, body axes
    law : {"hunt-crossley", "paper"}
    stiffness : float, N/m^n, exponent : float, n, of each contact point
    damping : float, s/m (N s/m of the paper's law)
    points : int, contact points of an element, evenly spaced, its second node included
    friction : float, coefficient mu
    stick_stiffness, stick_damping : float, N/m and N s/m, of the bristle of a contact point that sticks
    """

    body: str
    over: str
    under: str = ""
    thickness: float | Sequence[float]
    width: float = math.inf
    sense: int = 1
    centre: Sequence[float] = (0.0, 0.0, 0.0)
    axis: Sequence[float] = (0.0, 0.0, 1.0)

    def write(self, builder: Builder, name: str) -> None:
        """Write the layer and its contact points."""
        body = builder.names["ground"][1] if self.body == "ground" else builder.find(self.body, "bodies")
        over = builder.find(self.over, "beams")
        under = builder.find(self.under, "beams") if self.under else over
        law = self.law_fields(name)
        if law["law"] == contact_laws.CONSERVATIVE:
            raise InputError(f"{name}.law is 'conservative', which layers do not know; take 'hunt-crossley' or 'paper'")
        if self.sense not in (1, -1):
            raise InputError(f"{name}.sense is {self.sense!r}; it must be 1 or -1")
        if not self.width > 0.0:
            raise InputError(f"{name}.width is {self.width!r}; it must be above 0 m")
        centre = vector(f"{name}.centre", self.centre)
        axis = unit_vector(f"{name}.axis", self.axis)
        pose = builder.poses[body]
        for beam, owner in {over: self.over, under: self.under or self.over}.items():
            self._thicken(builder, name, beam, owner)
        first = len(builder.rows["contact_points"])
        for fields in self.contact_points(builder, name, over):
            builder.add("contact_points", carrier=UNKNOWN, **fields)
        index = builder.add(
            "cylinders",
            body=body,
            first=first,
            last=len(builder.rows["contact_points"]),
            under=under,
            sense=float(self.sense),
            shift=self._shift(builder, over, under, pose.x + pose.R @ centre, pose.R @ axis),
            centre=centre,
            axis=axis,
            half_length=float(self.width),
            **law,
        )
        builder.names[name] = ("cylinders", index)

    def _thicken(self, builder: Builder, name: str, beam: int, owner: str) -> None:
        """Write the thickness into a beam's elements."""
        row = builder.rows["beams"][beam]
        found = np.array(self.thickness, dtype=float)
        if found.ndim == 0:
            found = np.full(row["elements"], found)
        if found.shape != (row["elements"],) or not np.all(np.isfinite(found)) or not np.all(found > 0.0):
            raise InputError(
                f"{name}.thickness is {self.thickness!r}; it must be a number above 0 m, or {row['elements']} of them, "
                f"one for each element of {owner!r}"
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
            roots.append(root - (root @ axis) * axis)
        angle = self.sense * math.atan2(float(np.cross(*roots) @ axis), float(roots[0] @ roots[1]))
        return angle if angle > 1e-9 else angle + 2.0 * math.pi
