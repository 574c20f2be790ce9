"""Event that a user defines."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator
from pydantic_core import PydanticCustomError

from evolvent.assembly import expressions
from evolvent.assembly.builder import Builder
from evolvent.families.beams.part import node_of
from evolvent.kernels import rigid
from evolvent.parts.base import Group, Part, split_reference
from evolvent.parts.expression import Constants, EventLaw, Parameters, write_law
from evolvent_base.errors import InputError, nearest

_QUANTITY = re.compile(r"(?P<place>.+?)\.(?P<what>position|velocity|rate|angle)(?:\.(?P<axis>[xyz]))?")
#: Most variables of an event.
MOST = 30


def _read_variables(value: Any) -> Any:
    allowed = "a mapping of names to quantities of parts, such as {height: ball.position.z}"
    if not isinstance(value, Mapping) or not all(expressions.is_name(key) for key in value) or len(value) > MOST:
        raise PydanticCustomError("variables", "it must be {allowed}", {"allowed": allowed})
    return value


class Event(Part):
    """A moment to be found: where the law's value rises through zero.

    Parameters
    ----------
    law : an expression of t (s) and of `variables`, or a function under ``@evolvent.event_law``:
        ``law(t, y, parameters) -> value``, y the state vector
    variables : mapping of names to quantities of parts: of points, free bodies and beams' nodes ``ball.position.x``,
        ``boom.tip.velocity.y`` (m, m/s, inertial axes), of free bodies ``hub.rate.z`` (rad/s, body axes), of spinning
        bodies ``hub.angle`` and ``hub.rate`` (rad, rad/s)
    parameters : list of numbers, of a Python law
    constants : mapping of names to numbers, of an expression
    stops : bool, whether the run ends there

    Notes
    -----
    Under generalized-alpha and energy-momentum an event fires once; its time is found to 1e-6 of a step. Under explicit
    methods it fires whenever its value rises through zero. Equilibria and modes are those of the state before any
    event.

    An event that rises and falls again within a step is found as well: the value is evaluated at three inner places of
    every step, by the motion between its ends, and at more of them where that could bring it to zero. So a value with
    one extremum or kink in a quarter of a step is found above zero for 1e-5 of the step. A pulse that leaves no trace
    in between, or a value with several periods in a step, may be missed: then set `step`, or take a value that grows
    towards the event.
    """

    kind: Literal["event"] = "event"
    group = Group.CONTROL
    law: EventLaw
    variables: Annotated[dict[str, str], BeforeValidator(_read_variables)] | None = None
    parameters: Parameters = ()
    constants: Constants | None = None
    stops: bool = False

    def references(self) -> Iterator[str]:
        """Names of the parts in `variables`."""
        for text in (self.variables or {}).values():
            match = _QUANTITY.fullmatch(text)
            if match is not None:
                yield split_reference(match["place"])[0]

    def write(self, builder: Builder, name: str) -> None:
        """Write the event into the family `events`."""
        variables = self.variables or {}
        if variables and callable(self.law):
            raise InputError(f"{name}.variables are those of an expression; a Python law takes the state y")
        if "t" in variables:
            raise InputError(f"{name}.variables.t has the name of the time; give it another one")
        places = [_index(builder, f"{name}.variables.{key}", text) for key, text in variables.items()]
        fields = write_law(
            builder, name, self.law, "event", self.parameters, self.constants,
            variables=("t", *variables), before=[float(len(places)), *(float(place) for place, _ in places)],
        )  # fmt: skip
        for k, (_, is_velocity) in enumerate(places):
            if is_velocity:
                builder.velocity_parameters.append(fields["first"] + 1 + k)
        builder.names[name] = ("events", builder.add("events", stops=int(self.stops), **fields))


def _index(builder: Builder, key: str, text: str) -> tuple[int, bool]:
    """Index of a quantity among the coordinates, or among the velocities (True)."""
    match = _QUANTITY.fullmatch(text)
    if match is None:
        raise InputError(f"{key} is {text!r}; it must be a quantity such as 'ball.position.z' or 'hub.rate'")
    known, iq, iv = _quantities(builder, key, match["place"])
    what = f"{match['what']}.{match['axis']}" if match["axis"] else match["what"]
    if what not in known:
        raise InputError(f"{key} is {text!r}; {nearest(what, known)}")
    at, is_velocity = known[what]
    return (iv if is_velocity else iq) + at, is_velocity


def _quantities(builder: Builder, key: str, place: str) -> tuple[dict[str, tuple[int, bool]], int, int]:
    """Quantities of a place: where each stands from its coordinates or velocities on; and where these start."""
    part, point = split_reference(place)
    family, index = builder.names.get(part, ("", -1))
    vectors = {f"position.{c}": (k, False) for k, c in enumerate("xyz")}
    vectors |= {f"velocity.{c}": (k, True) for k, c in enumerate("xyz")}
    if family == "beams" and point is not None:
        _, _, iq, iv = node_of(builder, (part, point))
        return vectors, iq, iv
    if family == "points" and point is None:
        row = builder.rows["points"][index]
        return vectors, row["iq"], row["iv"]
    if family == "bodies" and point is None:
        row = builder.rows["bodies"][index]
        if row["motion"] == rigid.FREE:
            vectors |= {f"rate.{c}": (3 + k, True) for k, c in enumerate("xyz")}
            return vectors, row["iq"], row["iv"]
        if row["motion"] == rigid.SPIN:
            return {"angle": (0, False), "rate": (0, True)}, row["iq"], row["iv"]
    raise InputError(f"{key}: {place!r} is no point, no body that moves by forces, and no node of a beam")
