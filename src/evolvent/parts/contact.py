"""What all parts share whose contact points touch something."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from evolvent.builder import Builder
from evolvent.errors import InputError
from evolvent.kernels import ancf, contact_laws, flexible
from evolvent.parts.checks import choice, not_negative, number, positive

LAWS = {
    "paper": contact_laws.PAPER,
    "hunt-crossley": contact_laws.HUNT_CROSSLEY,
    "conservative": contact_laws.CONSERVATIVE,
}


@dataclasses.dataclass(frozen=True, kw_only=True)
class Contact:
    """The law of a contact, and the contact points of a beam at which it acts.

    Parameters
    ----------
    law : {"hunt-crossley", "conservative", "paper"}
    stiffness : float, N/m^n, exponent : float, n, of each contact point
    damping : float, s/m (N s/m of the paper's law)
    points : int, contact points of an element, evenly spaced, its second node included
    friction : float, coefficient mu
    stick_stiffness, stick_damping : float, N/m and N s/m, of the bristle of a contact point that sticks
    """

    law: str = "hunt-crossley"
    stiffness: float = 1e4
    exponent: float = 1.0
    damping: float = 0.0
    points: int = 2
    friction: float = 0.0
    stick_stiffness: float = 1e3
    stick_damping: float = 0.0

    def law_fields(self, name: str) -> dict[str, Any]:
        """Fields of the law in the model, checked."""
        fields = {
            "law": choice(f"{name}.law", self.law, LAWS),
            "stiffness": positive(f"{name}.stiffness", self.stiffness),
            "exponent": number(f"{name}.exponent", self.exponent, least=1.0, allowed="a number from 1"),
            "share": 1.0,
        }
        for key in ("damping", "friction", "stick_stiffness", "stick_damping"):
            fields[key] = not_negative(f"{name}.{key}", getattr(self, key))
        return fields

    def contact_points(self, builder: Builder, name: str, beam: int) -> list[dict[str, Any]]:
        """Fields of the contact points of a beam, evenly spaced in each element, its second node included."""
        points = self.points
        if isinstance(points, bool) or not isinstance(points, int) or points < 1:
            raise InputError(f"{name}.points is {points!r}; it must be a whole number from 1")
        row, found = builder.rows["beams"][beam], []
        k = flexible.NODE_VECTORS[row["kind"]]
        vectors = np.array([0, 1, k, k + 1])
        for c in range(row["first_element"], row["first_element"] + row["elements"]):
            element = builder.rows["elements"][c]
            for i in range(1, points + 1):
                shape = np.empty(8)
                ancf.beam_shape(element["length"], i / points, 0.0, 0.0, shape)
                at = {"iq": element["iq"] + 3 * vectors, "iv": element["iv"] + 3 * vectors}
                found.append({"element": c, **at, "S": shape[[0, 1, 4, 5]], "reach": 1.5 * element["length"]})
        return found
