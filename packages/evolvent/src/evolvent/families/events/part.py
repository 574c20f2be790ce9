"""Event that a user defines."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator
from pydantic_core import PydanticCustomError

from evolvent.assembly import expressions
from evolvent.assembly.builder import Builder
from evolvent.kernels import rigid
from evolvent.model.registry import asked
from evolvent.parts.base import Group, Part, split_reference
from evolvent.parts.expression import Constants, EventLaw, Parameters, write_law
from evolvent_base.errors import InputError, nearest

Array = np.ndarray
_QUANTITY = re.compile(r"(?P<place>.+?)\.(?P<what>position|velocity|rate|angle)(?:\.(?P<axis>[xyz]))?")
#: Most variables of an event, and numbers of the state that they read.
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
    law : an expression of t (s) and of `variables`, or a function under ``@evolvent.law``:
        ``law(t, y, parameters) -> value``, y the state vector
    variables : mapping of names to quantities of parts: of points, free bodies, their points, and nodes of beams and
        rods ``ball.position.x``, ``boom.tip.velocity.y`` (m, m/s, inertial axes; off the centre of mass of a body
        positions alone), of free bodies ``hub.rate.z`` (rad/s, body axes), of spinning bodies ``hub.angle`` and
        ``hub.rate`` (rad, rad/s)
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
        if not callable(self.law):  # messages on names are of the law as it was given
            expressions.compile_expression(self.law, ("t", *variables), self.constants, name=f"{name}.law")
        law, places = self.law, dict[str, tuple[int, bool]]()
        for key, text in variables.items():
            shown, own = _read(builder, f"{name}.variables.{key}", key, text)
            law, places = re.sub(rf"\b{key}\b", shown, law), places | own
        if len(places) > MOST:
            raise InputError(f"{name}.variables read {len(places)} numbers of the state; at most {MOST} are allowed")
        fields = write_law(
            builder, name, law, "event", self.parameters, self.constants, variables=("t", *places),
            before=[float(len(places)), *(float(place) for place, _ in places.values())],
        )  # fmt: skip
        for k, (_, is_velocity) in enumerate(places.values()):
            if is_velocity:
                builder.velocity_parameters.append(fields["first"] + 1 + k)
        builder.names[name] = ("events", builder.add("events", stops=int(self.stops), **fields))


def _read(builder: Builder, key: str, name: str, text: str) -> tuple[str, dict[str, tuple[int, bool]]]:
    """What a variable reads: an expression, and its names with indices among coordinates, or velocities (True)."""
    match = _QUANTITY.fullmatch(text)
    if match is None:
        raise InputError(f"{key} is {text!r}; it must be a quantity such as 'ball.position.z' or 'hub.rate'")
    known, iq, iv, arm = _quantities(builder, key, match["place"])
    what = f"{match['what']}.{match['axis']}" if match["axis"] else match["what"]
    if match["what"] == "velocity" and np.any(arm):
        raise InputError(
            f"{key} is {text!r}, off the centre of mass of its body, where only positions are read; give "
            f"'{match['place']}.position.{match['axis'] or 'x'}', or the velocity of the body"
        )
    if what not in known:
        raise InputError(f"{key} is {text!r}; {nearest(what, known)}")
    at, is_velocity = known[what]
    places = {name: ((iv if is_velocity else iq) + at, is_velocity)}
    if match["what"] != "position" or not np.any(arm):
        return name, places
    attitude = [f"_{name}_{k}" for k in range(4)]
    turned = _turned(arm, "xyz".index(match["axis"]), attitude)
    return f"({name} + {turned})", places | {one: (iq + 3 + k, False) for k, one in enumerate(attitude)}


def _turned(arm: Array, i: int, q: list[str]) -> str:
    """Component i of a vector of body axes in inertial axes, by names of the quaternion's components, scalar first."""
    terms = []
    for j in range(3):
        k = next(one for one in range(3) if one not in {i, j})
        if i == j:
            entry = f"1 - 2*({q[1 + (i + 1) % 3]}**2 + {q[1 + (i + 2) % 3]}**2)"
        else:
            entry = f"2*({q[1 + i]}*{q[1 + j]} {'-' if j == (i + 1) % 3 else '+'} {q[0]}*{q[1 + k]})"
        terms += [f"({float(arm[j])!r})*({entry})"] if arm[j] else []
    return " + ".join(terms)


def _quantities(builder: Builder, key: str, place: str) -> tuple[dict[str, tuple[int, bool]], int, int, Array]:
    """Quantities of a place: where each stands from its coordinates or velocities on; where these start; its arm.

    The arm is that from the centre of mass of its body, (3,) float, body axes; off that only positions are read.
    """
    part, _ = split_reference(place)
    if builder.names.get(part, ("", -1))[0] in asked("parts.place"):
        at = builder.location(place, key)
        vectors = {f"position.{c}": (k, False) for k, c in enumerate("xyz")}
        velocities = {f"velocity.{c}": (k, True) for k, c in enumerate("xyz")}
        if at.family != "bodies":
            return vectors | velocities, at.iq, at.iv, np.zeros(3)
        row = builder.rows["bodies"][at.row]
        if row["motion"] == rigid.FREE:
            rates = {f"rate.{c}": (3 + k, True) for k, c in enumerate("xyz")}
            return vectors | velocities | rates, row["iq"], row["iv"], at.local
        if row["motion"] == rigid.SPIN and at.alone:
            return {"angle": (0, False), "rate": (0, True)}, row["iq"], row["iv"], np.zeros(3)
    raise InputError(f"{key}: {place!r} is no point, no body that moves by forces, and no node of a beam or rod")
