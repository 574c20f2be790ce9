"""What a user writes about a torsion rig: the rod that calibrates the bar, orientations of the part, pendulums."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError

from evolvent_base import safe_open, schema, units
from evolvent_base.errors import InputError
from evolvent_base.overrides import copied, override
from evolvent_base.schema import Section
from evolvent_base.texts import parse_yaml
from evolvent_massprops import uncertain
from evolvent_massprops.uncertain import Uncertain

#: Keys that only the description of a rig has.
OWN = ("orientations", "pendulums", "plan")
_Share = Annotated[float, units.Quantity(what="a share", unit="", example="0.3 %", least=0.0, most=0.5)]
_Tilt = Annotated[float, units.Quantity(what="an angle", unit="rad", example="0.5 deg", least=0.0, most=0.5)]
_Miss = Annotated[float, units.Quantity(what="a length", unit="m", example="1 mm", least=0.0, most=10.0)]
_DAMPING = "of the swing; the period without damping is sqrt(1 - damping_ratio^2) of the measured one"


class Rod(Section):
    """A round rod whose moment across its length is known from mass and size: m (3 (d/2)^2 + l^2) / 12."""

    mass: uncertain.MassReadings
    diameter: uncertain.LengthReadings
    length: uncertain.LengthReadings
    period: uncertain.PeriodReadings = Field(description="of torsion with the rod on the bar")
    damping_ratio: uncertain.Damping = Field(Uncertain(0.0), description=_DAMPING)


class Remounting(Section):
    """What the same orientation repeats to when the part is clamped again: standard uncertainties of one mounting."""

    moment: _Share = Field(0.0, description="of the moment, part of it")
    angle: _Tilt = Field(0.0, description="of the direction of the bar's line in the part")
    distance: _Miss = Field(0.0, description="of the distance of the bar's line")


class RigStand(Section):
    """A torsion bar on which a part hangs."""

    kind: Literal["torsion"] = "torsion"
    rod: Rod | None = Field(None, description="it gives the stiffness of the bar")
    stiffness: uncertain.Torsion | None = Field(None, description="of the bar, where it is known without a rod")
    fixture: uncertain.InertiaOrZero = Field(
        Uncertain(0.0), description="moment of what turns along with part and rod, about the bar's line"
    )
    line_offset: uncertain.Position = Field(
        Uncertain(0.0), description="of all distances alike, of an edge of the bar from which they were read; taken off"
    )
    remounting: Remounting = Remounting()
    gravity: uncertain.Gravity = Field(Uncertain(9.80665), description="for pendulums")

    def refusals(self) -> Iterator[str]:
        """Rules between keys."""
        if (self.rod is None) == (self.stiffness is None):
            what = "both given" if self.rod else "both missing"
            yield f"stand.rod and stand.stiffness are {what}; give one of them"


class RigBody(Section):
    """The part."""

    name: str = "part"
    mass: uncertain.Mass | None = Field(None, description="needed for pendulums, and for moments about the origin")
    shape: Literal["general", "round"] = Field(
        "general",
        description="round: a body of revolution about y, such as a wheel; all moments in its plane are alike",
    )


class Orientation(Section):
    """One way in which the part hangs on the bar, with its period."""

    name: str = Field("", description="in tables and sentences; its number unless given")
    about: Literal["plane", "normal"] = Field(
        "plane", description="the bar's line lies in the part's plane x, z, or along its normal y"
    )
    angle: uncertain.AngleReadings | None = Field(
        None, description="of the bar's line in the part: the line has the direction (cos, 0, -sin)"
    )
    distance: uncertain.DistanceReadings | None = Field(
        None, description="of the bar's line from the origin of the part, positive along (sin, 0, cos)"
    )
    period: uncertain.PeriodReadings
    damping_ratio: uncertain.Damping = Field(Uncertain(0.0), description=_DAMPING)


class Swing(Section):
    """The part as a compound pendulum about an axis along y."""

    name: str = ""
    period: uncertain.PeriodReadings
    length: uncertain.LengthReadings | None = Field(None, description="from the pivot to the centre of mass")
    pivot: tuple[uncertain.Position, uncertain.Position] | None = Field(
        None, description="x and z of the pivot in the part's axes; the length then follows from the centre of mass"
    )
    damping_ratio: uncertain.Damping = Field(Uncertain(0.0), description=_DAMPING)
    amplitude: uncertain.Turn = Field(Uncertain(0.0), description="of the swing; small unless given")

    def refusals(self) -> Iterator[str]:
        """Rules between keys."""
        if (self.length is None) == (self.pivot is None):
            what = "both given" if self.length else "both missing"
            yield f"length and pivot of a pendulum are {what}; give one of them"


class RigPlan(Section):
    """What `evolvent plan` needs to know of a measurement that was not made."""

    Ixx: uncertain.InertiaOrZero = Field(description="expected, about the centre of mass")
    Izz: uncertain.InertiaOrZero = Field(description="likewise")
    Ixz: Annotated[Uncertain, uncertain.Measured(quantity=units.Quantity(
        what="a product of inertia", unit="kg m^2", example="0.1 kg m^2",
    ))] = Field(Uncertain(0.0), description="element of the tensor")  # fmt: skip
    period: _Share = Field(1e-4, description="standard uncertainty of one reading of a period, part of it")
    angle: _Tilt = Field(0.0017453292519943296, description="standard uncertainty of an angle")
    mountings: Annotated[int, units.Whole(least=1, most=1000)] = Field(
        20, description="times that each orientation is clamped, at most"
    )


class RigUncertainty(Section):
    """How uncertainty is stated, and records are tested."""

    coverage_factor: Annotated[
        float, units.Quantity(what="a plain number", unit="", example="2", above=0.0, most=10.0)
    ] = Field(2.0, description="k of the expanded uncertainty U = k u")
    false_alarms: Annotated[
        float, units.Quantity(what="a share", unit="", example="1 %", above=0.0, most=0.2)
    ] = Field(0.01, description="how often one of all records may be called wrong where none is, at most")  # fmt: skip


class OnRig(Section):
    """A part on a torsion rig."""

    title: str = ""
    remarks: str = ""
    stand: RigStand
    body: RigBody = RigBody()
    orientations: tuple[Orientation, ...] = ()
    pendulums: tuple[Swing, ...] = ()
    uncertainty: RigUncertainty = RigUncertainty()
    plan: RigPlan | None = Field(None, description="for `evolvent plan`")

    def refusals(self) -> Iterator[str]:
        """Rules between keys."""
        if not self.orientations and not self.pendulums and self.plan is None:
            yield "orientations are missing; a torsion rig needs a period of torsion in each"
        for k, one in enumerate(self.orientations):
            if one.about == "plane" and one.angle is None and self.body.shape == "general":
                yield (
                    f"orientations.{k}.angle is missing; without it the moment belongs to no direction of the part "
                    "(of a wheel: body.shape: round)"
                )
            if one.distance is not None and one.angle is None:
                yield f"orientations.{k}.distance has no angle; a line needs both"
        if self.pendulums and self.body.mass is None:
            yield "body.mass is missing; a pendulum's moment grows with it"
        if len(names := self.names()) != len(set(names)):
            twice = next(one for one in names if names.count(one) > 1)
            yield f"two records are called {twice!r}; names must differ"

    def names(self) -> list[str]:
        """Names of orientations and pendulums."""
        named = [one.name or f"orientation {k + 1}" for k, one in enumerate(self.orientations)]
        return [*named, *(one.name or f"pendulum {k + 1}" for k, one in enumerate(self.pendulums))]


def states_rig(stand: Any, overrides: Mapping[str, Any] | None = None) -> bool:
    """Whether a file, a mapping or changed keys describe a torsion rig."""
    if isinstance(stand, OnRig):
        return True
    content = stand
    if isinstance(stand, (str, os.PathLike)):
        name = os.fspath(stand)
        if not os.path.isfile(name):
            return False
        content = parse_yaml(safe_open.text(name), name)
    if not isinstance(content, Mapping):
        return False
    inner = content.get("stand")
    if not isinstance(inner, Mapping) or inner.get("kind") != RigStand.model_fields["kind"].default:
        return False
    given = overrides or {}
    return "rod" in inner or any(key in content or any(k.split(".")[0] == key for k in given) for key in OWN)


def load(stand: Any, overrides: Mapping[str, Any] | None = None) -> OnRig:
    """A checked description of a torsion rig.

    Parameters
    ----------
    stand : path, mapping, or a description
    overrides : mapping, dotted key -> value

    Raises
    ------
    InputError
        One sentence that names the key, its value and what is allowed.
    """
    if isinstance(stand, OnRig):
        content = stand.model_dump(mode="json", exclude_none=True)
    elif isinstance(stand, Mapping):
        content = copied(stand)
    else:
        name = os.fspath(stand)
        content = parse_yaml(safe_open.text(name), name)
        if not isinstance(content, dict):
            raise InputError(f"{name!r} is no mapping of keys to values; it must describe stand, body and orientations")
    for key, value in (overrides or {}).items():
        override(content, key, copied(value))
    try:
        return OnRig.model_validate(content)
    except ValidationError as error:
        raise InputError(schema.sentence(error.errors(include_url=False), OnRig)) from None
