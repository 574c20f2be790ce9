"""What a user writes about a stand: the signals, the stand, the body, and what is asked."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import Field, ValidationError, model_validator

from evolvent_base import packages, safe_open, schema, units
from evolvent_base.errors import InputError, nearest
from evolvent_base.overrides import copied, override
from evolvent_base.schema import Section
from evolvent_base.texts import parse_yaml
from evolvent_massprops import uncertain
from evolvent_massprops.keys import ColumnKey, DirectionKey, PointKey, TextKey
from evolvent_massprops.mounting_keys import Air, Mounting, SpringTare, refuse_massless
from evolvent_massprops.spring_keys import PROPERTIES, Planned, SpringBody, Springs
from evolvent_massprops.uncertain import Uncertain

#: Keys of which a recording may have its own, where all recordings go into one estimate.
COMBINED = ("mounting", "tare", "air", "plan")
NO_UNKNOWN = "body has no unknown; write 'unknown' for what is to be identified, such as Ixx: unknown"
KINDS = ("springs", "torsion", "bifilar", "trifilar", "compound")


Column = Annotated[str | int, ColumnKey()]
Point = Annotated[Any, PointKey()]


class Sensor(Section):
    """A column of the file and what stands behind it."""

    column: Column
    name: str | None = Field(None, description="in tables and figures; the column's unless given")
    point: Point | None = Field(None, description="its position on the body; not needed for a pendulum")
    direction: Annotated[Any, DirectionKey()] = Field("vertical", description="along which it is positive, level axes")
    unit: str | None = Field(None, description="of the column: mm, V, px, ...; it overrules what the file states")
    sensitivity: Annotated[str, TextKey("a reading per quantity, such as '0.5 V/mm +- 0.2 %'")] | None = Field(
        None, description="the column is divided by it; a standard uncertainty may follow +-"
    )
    noise: Annotated[str, TextKey("a value in the column's unit, such as '0.1 mm'")] | None = Field(
        None, description="standard deviation of its noise, if known; estimated unless given"
    )


class Signals(Section):
    """How the columns of a file are to be read."""

    time: Column | None = Field(None, description="column that holds the time; found by itself if called time or t")
    rate: Annotated[float, units.Quantity(what="a sampling rate", unit="Hz", example="50 Hz", above=0.0)] | None = (
        Field(None, description="in place of a time column, where the file does not state it")
    )
    clock: Annotated[
        Uncertain, uncertain.Measured(quantity=units.Quantity(what="a plain number", unit="", example="1 +- 1e-5"))
    ] = Field(Uncertain(1.0), description="true time over the file's time, with the uncertainty of its clock")
    unit: str | None = Field(None, description="of all sensors' columns that state none themselves")
    sensors: tuple[Sensor, ...] = Field((), description="left out for a pendulum: all columns but the time")
    start: units.Time | None = Field(None, description="samples before this time are left out")
    end: units.Time | None = Field(None, description="samples after this time are left out")
    gaps: Literal["bridge", "refuse"] = Field(
        "bridge", description="samples that are missing (empty, nan, no row): fitted around, or refused"
    )

    @model_validator(mode="after")
    def _check(self) -> Signals:
        if self.time is not None and self.rate is not None:
            raise InputError("signals.time and signals.rate are both given; give one of them")
        if self.start is not None and self.end is not None and self.end <= self.start:
            raise InputError(f"signals.end is {self.end:g} s; it must be after signals.start, {self.start:g} s")
        if self.clock.value <= 0.0:
            raise InputError(f"signals.clock is {self.clock.value:g}; it must be above 0")
        used = [s.column for s in self.sensors]
        twice = [c for c in used if used.count(c) > 1]
        if twice:
            raise InputError(f"signals.sensors names the column {twice[0]!r} twice")
        if self.time is not None and self.time in used:
            raise InputError(f"signals.sensors names {self.time!r}, which is the time")
        return self


_AMPLITUDE = (
    "of the swing, its mean over the recording; needed only where the signals are no angles and their rate changes too "
    "little to show it"
)


class _Wires(Section):
    """A body that turns about the vertical on parallel or leaning wires of equal length."""

    radius: uncertain.Length = Field(description="of the wires' ends at the body, from the axis")
    top_radius: uncertain.Length | None = Field(None, description="of their ends above; as radius unless given")
    length: uncertain.Length = Field(description="of the wires")
    amplitude: uncertain.Turn | None = Field(None, description=_AMPLITUDE)
    wire_stiffness: uncertain.TorsionOrZero = Field(Uncertain(0.0), description="torsional, of all wires together")
    gravity: uncertain.Gravity = Uncertain(9.80665)


class Trifilar(_Wires):
    """Three wires."""

    kind: Literal["trifilar"] = "trifilar"


class Bifilar(_Wires):
    """Two wires."""

    kind: Literal["bifilar"] = "bifilar"


class TorsionWire(Section):
    """A body that turns about the vertical on one wire or a torsion spring."""

    kind: Literal["torsion"] = "torsion"
    stiffness: uncertain.Torsion


class CompoundPendulum(Section):
    """A body that swings about a horizontal axis."""

    kind: Literal["compound"] = "compound"
    distance: uncertain.Length = Field(description="of the body's centre of mass from the axis of the pivot")
    amplitude: uncertain.Turn | None = Field(None, description=_AMPLITUDE)
    gravity: uncertain.Gravity = Uncertain(9.80665)


class Tare(Section):
    """Something that swings along, not asked for: what it adds is taken off."""

    name: str = "tare"
    mass: uncertain.Mass | None = Field(None, description="0 unless given")
    radius: uncertain.LengthOrZero = Field(Uncertain(0.0), description="of its centre of mass from the axis")
    inertia: uncertain.InertiaOrZero = Field(
        Uncertain(0.0), description="about the axis through its own centre of mass, parallel to that of the rotation"
    )


class PendulumBody(Section):
    """The body on wires; its moment of inertia about the vertical axis is asked."""

    name: str = "body"
    mass: uncertain.Mass | None = Field(None, description="needed on two or three wires")
    offset: uncertain.LengthOrZero | None = Field(
        None, description="of its centre of mass from the axis: the moment about its own axis is given as well"
    )


class CompoundBody(Section):
    """The body that swings; its moment about the axis through its centre of mass is asked."""

    name: str = "body"
    mass: uncertain.Mass


class Identification(Section):
    """How modes are read from the signals."""

    method: Literal["varpro", "esprit", "matrix-pencil", "tls-prony", "prony"] = Field(
        "varpro", description="only varpro gives uncertainties, and only it is certified"
    )
    order: Annotated[int, units.Whole(least=1, most=50)] | Literal["auto"] = Field(
        "auto", description="number of modes; auto: found from the signal"
    )
    band: (
        tuple[
            Annotated[float, units.Quantity(what="an angular rate", unit="rad/s", example="6 rad/s", least=0.0)],
            Annotated[float, units.Quantity(what="an angular rate", unit="rad/s", example="6 rad/s", above=0.0)],
        ]
        | None
    ) = Field(None, description="modes are looked for inside it")
    detrend: Literal["constant", "linear"] = Field("constant", description="an offset of each sensor, or also a drift")
    decay: Literal["auto", "viscous", "dry", "quadratic", "mixed"] = Field(
        "auto",
        description="law by which the strongest mode decays: viscous damping, dry friction, quadratic drag, or all "
        "three; auto: as the signal shows",
    )
    shapes: bool = Field(True, description="whether mode shapes are used in addition to the frequencies (springs)")
    model: Literal["full", "vertical"] = Field(
        "full",
        description="six degrees of freedom about the true equilibrium; vertical: heave, roll, pitch of a level body",
    )


class Uncertainty(Section):
    """How uncertainty is propagated."""

    method: Literal["gum", "monte-carlo"] = "gum"
    draws: Annotated[int, units.Whole(least=1000, most=1_000_000)] = 5000
    seed: Annotated[int, units.Whole(least=0, most=2**62)] = 1
    coverage_factor: Annotated[
        float, units.Quantity(what="a plain number", unit="", example="2", above=0.0, most=10.0)
    ] = Field(2.0, description="k of the expanded uncertainty U = k u")


Recordings = dict[str, dict[str, Any]]
_RECORDINGS: Any = Field({}, description="what differs from file to file: file name -> {key.path: value}")


class Signalling(Section):
    """How signals are read, and modes found in them."""

    title: str = ""
    remarks: str = ""
    signals: Signals = Signals()
    identification: Identification = Identification()


class _Description(Signalling):
    """A description of a stand."""

    uncertainty: Uncertainty = Uncertainty()
    recordings: Recordings = _RECORDINGS


class OnSprings(_Description):
    """A body on springs."""

    stand: Springs
    body: SpringBody
    tare: tuple[SpringTare, ...] = Field((), description="what moves along and is taken off, such as a cradle")
    mounting: Mounting | None = Field(None, description="the body turned or moved on the stand")
    air: Air | None = Field(None, description="that moves along; left out: none")
    plan: Planned | None = Field(None, description="for `evolvent plan`")

    @model_validator(mode="after")
    def _check(self) -> OnSprings:
        if not self.signals.sensors:
            raise InputError("signals.sensors is missing; name each column with the point where its sensor sits")
        for k, sensor in enumerate(self.signals.sensors):
            if sensor.point is None:
                raise InputError(f"signals.sensors.{k}.point is missing; it must be {PointKey.allowed}")
            if isinstance(sensor.point, int) and sensor.point > self.stand.number:
                raise InputError(
                    f"signals.sensors.{k}.point is {sensor.point}, but there are {self.stand.number} springs"
                )
        if not self.body.unknown and not any(self.unknown_of_tare) and not self.stand.unknown and not self.recordings:
            raise InputError(NO_UNKNOWN)
        known = any(key.split(".")[0] == "body" for keys in self.recordings.values() for key in keys)
        factor = self.stand.common_factor.unknown and not known
        if factor and "mass" in self.body.unknown and not (self.body.mass.std or self.stand.common_factor.std):
            raise InputError(
                "body.mass and stand.common_factor are both unknown; vibrations determine only their ratio: "
                "give one of them"
            )
        if self.mounting is not None and not self.mounting.body and not self.tare:
            raise InputError("mounting.body is false, but tare is missing; without it nothing is on the stand")
        if self.mounting is not None and not self.mounting.body:
            vertical = self.stand.support == "guided" or self.identification.model == "vertical"
            refuse_massless(self.tare, vertical=vertical)
        return self

    @property
    def unknown_of_tare(self) -> tuple[tuple[str, ...], ...]:
        """Keys of each tare that are asked."""
        return tuple(tuple(k for k in PROPERTIES if getattr(t, k).unknown) for t in self.tare)

    @property
    def has_mounting(self) -> bool:
        """Whether recordings go into one estimate: what is on the stand differs, the pull, or the stand is asked."""
        own = any(key.split(".")[0] in COMBINED for keys in self.recordings.values() for key in keys)
        calibrated = {"half_length", "half_width"} & set(self.stand.unknown) or not self.body.unknown
        return own or bool(self.tare) or self.mounting is not None or self.air is not None or bool(calibrated)


class OnTorsion(_Description):
    """A body on a torsion wire."""

    stand: TorsionWire
    body: PendulumBody = PendulumBody()
    tare: tuple[Tare, ...] = ()


class OnBifilar(_Description):
    """A body on two wires."""

    stand: Bifilar
    body: PendulumBody
    tare: tuple[Tare, ...] = ()


class OnTrifilar(_Description):
    """A body on three wires."""

    stand: Trifilar
    body: PendulumBody
    tare: tuple[Tare, ...] = ()


class OnPivot(_Description):
    """A body that swings about a pivot; what swings along hangs below the axis too."""

    stand: CompoundPendulum
    body: CompoundBody
    tare: tuple[Tare, ...] = ()


_CLASSES: dict[str, type[_Description]] = {
    "springs": OnSprings,
    "torsion": OnTorsion,
    "bifilar": OnBifilar,
    "trifilar": OnTrifilar,
    "compound": OnPivot,
}
OnWires: TypeAlias = OnTorsion | OnBifilar | OnTrifilar
Pendulum: TypeAlias = OnWires | OnPivot
Description: TypeAlias = OnSprings | Pendulum


def load(stand: Any, overrides: Mapping[str, Any] | None = None) -> Description:
    """A checked description of a stand.

    Parameters
    ----------
    stand : path, mapping, a description, or the name, file or content of a case of a system that is a stand
    overrides : mapping, dotted key -> value; of a case its own keys, or those of the description that it makes

    Returns
    -------
    Description

    Raises
    ------
    InputError
        One sentence that names the key, its value and what is allowed.
    """
    given = dict(overrides or {})
    content = _content(stand)
    if "system" in content or "parts" in content:
        content, given = _of_case(content, given)
    for key, value in given.items():
        _override(content, key, value)
    return _checked(content)


def _override(content: dict[str, Any], key: str, value: Any) -> None:
    """Put a value in the place of a key; an excitation of a plan takes that of its force, and the force its."""
    override(content, key, copied(value))
    plan, (head, *rest) = content.get("plan"), key.split(".")
    if head == "plan" and rest and isinstance(plan, dict):
        other = {"excitation": "force", "force": "excitation"}.get(rest[0])
        if other is not None and value is not None:
            plan.pop(other, None)


def _of_case(content: dict[str, Any], overrides: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """The description that a case makes, and those of the overrides that are its own keys and not the case's."""
    cases = _cases("a stand that is given as a case")
    content = cases.with_system(content)
    definition = cases.system_of(content)
    own = {key: value for key, value in overrides.items() if key.split(".")[0] in definition.Case.model_fields}
    if not _is_case(content, own):
        alone = {key: value for key, value in own.items() if _is_case(content, {key: value})}
        for key in own.keys() - alone.keys():
            if "+-" not in str(own[key]) and "unknown" not in str(own[key]) and not _is_key(key):
                cases.load(content, alone | {key: own[key]})  # says what is wrong
        own = alone
    rest = {key: value for key, value in overrides.items() if key not in own}
    found = definition.stand_description(cases.load(content, own))
    if found is None:
        raise InputError(
            f"the system {definition.Case.model_fields['system'].default!r} is no stand; give a description of a "
            "stand, or a case of the system 'inertia-stand'"
        )
    return found, rest


def _is_case(content: Mapping[str, Any], overrides: Mapping[str, Any]) -> bool:
    """Whether a case with changed keys can be used."""
    try:
        _cases("a case").load(content, overrides)
    except InputError:
        return False
    return True


def _cases(what: str) -> Any:
    """The module of cases, whose package simulates them."""
    return packages.module("evolvent.cases", what)


def _is_key(key: str) -> bool:
    """Whether a description of springs has a key."""
    kind: Any = OnSprings
    for name in key.split("."):
        if name not in kind.model_fields:
            return False
        kind = {"body": SpringBody, "stand": Springs, "identification": Identification}.get(name, Section)
    return True


def without_stand(columns: Sequence[str], overrides: Mapping[str, Any] | None = None) -> Signalling:
    """What is known of signals where no stand is described: which columns are sensors, and how modes are found.

    Parameters
    ----------
    columns : names of the sensors' columns; empty for all but the time
    overrides : mapping, dotted key -> value

    Raises
    ------
    InputError
        One sentence that names the key, its value and what is allowed.
    """
    content: dict[str, Any] = {"signals": {"unit": "dimensionless"}}
    if columns:
        content["signals"]["sensors"] = [{"column": name} for name in columns]
    for key, value in (overrides or {}).items():
        override(content, key, copied(value))
    try:
        return Signalling.model_validate(content)
    except ValidationError as error:
        raise InputError(schema.sentence(error.errors(include_url=False), Signalling)) from None


def for_recording(description: Description, name: str) -> tuple[Description, tuple[str, ...]]:
    """The description for one file, with the keys that are its own.

    Raises
    ------
    InputError
        If the description lists recordings, and this file is not among them.
    """
    if not description.recordings:
        return description, ()
    if name not in description.recordings:
        raise InputError(f"recordings does not name {name!r}; {nearest(name, description.recordings)}")
    content = description.model_dump(mode="json", exclude_none=True)
    own = description.recordings[name]
    for key, value in own.items():
        _override(content, key, value)
    try:
        return _checked(content), tuple(own)
    except InputError as error:
        raise InputError(f"recordings.{name}: {error}") from None


def model(kind: str) -> type[Section]:
    """The model of the descriptions of a kind of stand.

    Raises
    ------
    InputError
        If there is no such kind.
    """
    if kind not in _CLASSES:
        raise InputError(f"no stand is of kind {kind!r}; {nearest(kind, _CLASSES)}")
    return _CLASSES[kind]


def json_schema(kind: str) -> dict[str, Any]:
    """JSON schema of the descriptions of a kind of stand, for editors.

    Parameters
    ----------
    kind : str, of the stand

    Returns
    -------
    dict
    """
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **model(kind).model_json_schema()}


def _content(stand: Any) -> dict[str, Any]:
    if isinstance(stand, _Description):
        return stand.model_dump(mode="json", exclude_none=True)
    if isinstance(stand, Mapping):
        found: dict[str, Any] = copied(stand)
        return found
    if not isinstance(stand, (str, os.PathLike)):
        raise InputError(f"a stand is a file or a mapping, not {type(stand).__name__}")
    name = os.fspath(stand)
    if not os.path.exists(name) and not re.search(r"[./\\]", name):
        cases = _cases(f"there is no file {name!r}, and a case")
        if name not in cases.built_in():
            raise InputError(f"there is neither a file nor a case {name!r}; {nearest(name, cases.built_in())}")
        return cases.content_of(name)
    content = parse_yaml(safe_open.text(name), name)
    if not isinstance(content, dict):
        what = "is empty" if content is None else "is no mapping of keys to values"
        raise InputError(f"{name!r} {what}; it must describe signals, stand and body")
    return content


def _checked(content: dict[str, Any]) -> Description:
    stand = content.get("stand")
    if not isinstance(stand, Mapping):
        raise InputError(f"stand is missing; it must be a mapping with a kind: {', '.join(KINDS)}")
    kind = stand.get("kind")
    if not isinstance(kind, str) or kind not in _CLASSES:
        what = "missing" if kind is None else schema.shown(kind)
        raise InputError(f"stand.kind is {what}; {nearest(str(kind), KINDS)}")
    model: Any = _CLASSES[kind]
    try:
        return model.model_validate(content)
    except ValidationError as error:
        raise InputError(schema.sentence(error.errors(include_url=False), model)) from None
