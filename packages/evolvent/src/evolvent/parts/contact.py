"""What all parts share whose contact points touch something."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import field_serializer, model_validator
from pydantic_core import PydanticCustomError

from evolvent.assembly.builder import Builder
from evolvent.kernels import ancf, ancf_beams, contact_laws
from evolvent.parts.applies import Applies, given
from evolvent.parts.base import Part
from evolvent_base import units
from evolvent_base.errors import InputError

LAWS = {
    "paper": contact_laws.PAPER,
    "hunt-crossley": contact_laws.HUNT_CROSSLEY,
    "conservative": contact_laws.CONSERVATIVE,
}


class ContactLaw(Part):
    """The law of a contact.

    Parameters
    ----------
    law : {"hunt-crossley", "conservative", "paper"}
        Law of the normal force against the depth: hunt-crossley damps in proportion to the elastic force, paper by
        a damper beside it; conservative, of energy-momentum, gives back over a step all of the energy that it stores.
        All but energy-momentum take hunt-crossley in its place.
    stiffness : float, N/m^n
        Of each contact point.
    exponent : float
        Power n of the depth.
    damping : float, s/m (N s/m of the law paper)
        Of the normal force.
    friction : float
        Coefficient of friction.
    bristle_stiffness, bristle_damping : float, N/m and N s/m
        Of the tangential spring of a contact point that sticks.
    """

    applies: ClassVar[Applies] = {
        "bristle_stiffness": (given("friction"),),
        "bristle_damping": (given("friction"),),
    }
    kind: str = "contact"
    law: Literal["hunt-crossley", "conservative", "paper"] = "hunt-crossley"
    stiffness: units.ContactStiffness = 1e4
    exponent: units.Exponent = 1.0
    damping: units.ContactDampingOrZero = 0.0
    friction: units.NumberOrZero = 0.0
    bristle_stiffness: units.StiffnessOrZero = 1e3
    bristle_damping: units.DampingOrZero = 0.0

    @model_validator(mode="before")
    @classmethod
    def _check_units(cls, values: Any) -> Any:
        """Refuse units that belong to another exponent or law."""
        if not isinstance(values, Mapping):
            return values
        power = re.search(r"N/m(?:\^(\d+(?:\.\d+)?))?\s*$", str(values.get("stiffness", "")))
        exponent = str(values.get("exponent", cls.model_fields["exponent"].default)).strip()
        if power is not None and re.fullmatch(r"\d+\.?\d*", exponent) and float(power[1] or 1) != float(exponent):
            wanted = f"N/m^{float(exponent):g}"
            message = f"stiffness is {values['stiffness']!r}, but exponent is {exponent}; give stiffness in {wanted}"
            raise PydanticCustomError("contact", "{message}", {"message": message})
        damping, paper = str(values.get("damping", "")), values.get("law") == "paper"
        newtons = re.search(r"N s/m\s*$", damping) is not None
        if re.search(r"[a-z]", damping) and newtons != paper and damping.rstrip().endswith("s/m"):
            law = values.get("law", cls.model_fields["law"].default)
            message = f"damping is {damping!r}; law {law!r} takes it in {'N s/m' if paper else 's/m'}"
            raise PydanticCustomError("contact", "{message}", {"message": message})
        return values

    @field_serializer("stiffness", when_used="json")
    def _write_stiffness(self, value: float) -> str:
        return f"{value!r} N/m" if self.exponent == 1.0 else f"{value!r} N/m^{self.exponent!r}"

    @field_serializer("damping", when_used="json")
    def _write_damping(self, value: float) -> str:
        return f"{value!r} N s/m" if self.law == "paper" else f"{value!r} s/m"

    def law_fields(self) -> dict[str, Any]:
        """Fields of the law in the model."""
        keys = ("stiffness", "exponent", "damping", "friction", "bristle_stiffness", "bristle_damping")
        return {"law": LAWS[self.law], **{key: getattr(self, key) for key in keys}}

    def viscosity(self, mass: float) -> float:
        """`viscous` of `contact_laws.sliding_damper`, kg^(1/2), of a contact point with a mass in kg; here 0."""
        return 0.0


class Contact(ContactLaw):
    """The law of a contact, and the contact points of a beam at which it acts.

    Parameters
    ----------
    points : int
        Contact points of an element, evenly spaced, its second node included.
    """

    points: Annotated[int, units.Whole(least=1, most=1000)] = 2

    def refined(self, name: str) -> Part:
        """Refused: more elements have more contact points, and the stiffness is that of a point."""
        raise InputError(
            f"an estimate of the mesh error does not support {name!r}, whose stiffness is that of a contact point: "
            f"elements of half the length have others; compare with a case of more elements"
        )

    def contact_points(self, builder: Builder, beam: int) -> list[dict[str, Any]]:
        """Fields of the contact points of a beam, evenly spaced in each element, its second node included."""
        row, found = builder.rows["beams"][beam], []
        k = ancf_beams.NODE_VECTORS[row["kind"]]
        vectors = np.array([0, 1, k, k + 1])
        masses = builder.pools["M"]
        for c in range(row["first_element"], row["first_element"] + row["elements"]):
            element = builder.rows["elements"][c]
            M = masses[element["mass"]]
            viscous = self.viscosity(float(M[0, 0] + 2.0 * M[0, k] + M[k, k]) / self.points)
            for i in range(1, self.points + 1):
                shape = np.empty(8)
                ancf.beam_shape(element["length"], i / self.points, 0.0, 0.0, shape)
                at = {"iq": element["iq"] + 3 * vectors, "iv": element["iv"] + 3 * vectors}
                reach = 1.5 * element["length"]
                found.append({"element": c, **at, "S": shape[[0, 1, 4, 5]], "reach": reach, "viscous": viscous})
        return found
