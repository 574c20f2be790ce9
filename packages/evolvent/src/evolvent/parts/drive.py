"""Drives: how a spool turns, or how a prescribed coordinate moves."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Generic

import numpy as np
import scipy
from pydantic import BeforeValidator, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import PydanticCustomError, core_schema
from typing_extensions import TypeVar

from evolvent.assembly import expressions
from evolvent.assembly.builder import Builder
from evolvent.compiled import laws
from evolvent.kernels import drive as kernels
from evolvent.parts.drive_kind import DriveKind, DriveRow, check_start
from evolvent.parts.expression import (
    Constants,
    DriveLaw,
    Parameters,
    SpringLaw,
    TimeExpression,
    refuse_without_law,
    write_law,
)
from evolvent.parts.feedback import FeedbackDrive
from evolvent.parts.profile import TorqueProfile, kind_hint, write_profile
from evolvent_base import units
from evolvent_base.errors import InputError, counted, nearest
from evolvent_base.schema import Section

__all__ = ["ConstantDrive", "ExpressionDrive", "FreeSpool", "LawDrive", "RampDrive", "TableDrive"]

#: Kinds that only spools have.
OF_SPOOLS = ("free", "feedback")
#: Coordinate and its rate: rad and rad/s of a spool or a body, m and m/s along a line.
A = TypeVar("A", default=units.Angle)
R = TypeVar("R", default=units.AngularRate)


class ConstantDrive(DriveKind, Generic[A, R]):
    """A constant rate.

    Parameters
    ----------
    rate : float, rad/s
    angle : float, rad, turned at t = 0 (thread already out: angle times radius)
    """

    rate: R
    angle: A = 0.0  # type: ignore[assignment]

    def write(self, builder: Builder, name: str) -> DriveRow:
        """Store the rate."""
        check_start(name, self.angle)
        return DriveRow(kernels.RAMPS, *builder.parameters([self.angle, self.rate, 0.0]))


class RampDrive(DriveKind, Generic[A, R]):
    """Rates that follow one another, each reached by a smooth quintic step.

    Parameters
    ----------
    rate : float, rad/s, at the start
    angle : float, rad, turned at t = 0 (thread already out: angle times radius)
    steps : list of [time s, duration s, rate rad/s], in order of time
    """

    rate: R = 0.0  # type: ignore[assignment]
    angle: A = 0.0  # type: ignore[assignment]
    steps: tuple[tuple[units.Time, units.DurationOrZero, R], ...] = ()

    def write(self, builder: Builder, name: str) -> DriveRow:
        """Store the ramps and their corners."""
        check_start(name, self.angle)
        flat: list[Any] = [self.angle, self.rate, float(len(self.steps))]
        end = -math.inf
        for time, duration, rate in self.steps:
            if time < end:
                raise InputError(f"{name}.steps: the step at {time} s starts before the last one has ended")
            end = time + duration
            builder.breaks.update((time, end))
            flat += [time, duration, rate]
        return DriveRow(kernels.RAMPS, *builder.parameters(flat))

    remedy: ClassVar[str] = "give the step of the RampDrive a duration above 0 s"

    def corners(self) -> Iterable[float]:
        """Steps without a duration."""
        return [time for time, duration, _ in self.steps if duration == 0.0]


def _one_unit(values: Any) -> Any:
    """The values of a table; a unit that stands in the last one alone is that of all."""
    try:
        return units.shared_unit(list(values)) if isinstance(values, (list, tuple, np.ndarray)) else values
    except units.UnitError as error:
        raise PydanticCustomError("table", "{why}", {"why": str(error)}) from None


class TableDrive(DriveKind, Generic[A, R]):
    """Tabulated values; constant rate before the first and after the last.

    Parameters
    ----------
    time : (k,) float, s, increasing, k >= 2
    rate : (k,) float, rad/s; monotone cubic (PCHIP) between, integrated for the angle
    angle : (k,) float, rad; cubic spline between. One of `rate` and `angle` is given.
    start : float, rad, angle at the first time (with `rate`)
    """

    time: units.Times
    rate: Annotated[tuple[R, ...], BeforeValidator(_one_unit)] | None = None
    angle: Annotated[tuple[A, ...], BeforeValidator(_one_unit)] | None = None
    start: A = 0.0  # type: ignore[assignment]

    def write(self, builder: Builder, name: str) -> DriveRow:
        """Store the piecewise polynomial."""
        given = self.rate if self.rate is not None else self.angle
        if given is None or (self.rate is not None and self.angle is not None):
            raise InputError(f"{name}: a table needs either rate or angle in addition to time")
        t, values = np.array(self.time), np.array(given, dtype=float)
        if t.size < 2 or t.size != values.size:
            raise InputError(
                f"{name}: the table has {counted(t.size, 'time')} and {counted(values.size, 'value')}; "
                f"it needs two or more of each"
            )
        if not np.all(np.diff(t) > 0.0):
            row = int(np.flatnonzero(np.diff(t) <= 0.0)[0]) + 1
            raise InputError(f"{name}: row {row + 1} of the table is at {t[row]} s, not after the row before")
        if self.rate is not None:
            curve = scipy.interpolate.PchipInterpolator(t, values).antiderivative()
            coefficients = curve.c.copy()
            coefficients[-1] += self.start
        else:
            coefficients = scipy.interpolate.CubicSpline(t, values).c
        full = np.zeros((5, t.size - 1))
        full[5 - coefficients.shape[0] :] = coefficients
        builder.breaks.update(float(x) for x in t)
        return DriveRow(kernels.TABLE, *builder.parameters([t.size, *t, *full.T.ravel()]))


class ExpressionDrive(DriveKind):
    """An angle (rad; m along a line) by an expression of t (s), which is differentiated twice for the rates.

    Parameters
    ----------
    expression : str
    constants : mapping of names to numbers, SI units
    """

    expression: TimeExpression
    constants: Constants | None = None

    def write(self, builder: Builder, name: str) -> DriveRow:
        """Store the expression."""
        return _law_row(builder, name, self.expression, constants=self.constants, key="expression")

    remedy: ClassVar[str] = "give an expression whose rate goes over smoothly, or a ramp whose steps have durations"

    def corners(self) -> Iterable[float]:
        """Times at which the expression goes over into another one."""
        return expressions.corners_of(self.expression, self.constants)

    def at(self, builder: Builder, row: DriveRow, time: float) -> tuple[float, float, float]:
        """Angle, rate and acceleration; refused unless finite."""
        run, described = builder.expressions[row.first]
        angle, rate, acceleration = _tried(builder, row, run, time, described)
        return angle, rate, acceleration


class LawDrive(DriveKind):
    """A drive by a Python law.

    Parameters
    ----------
    law : function under ``@evolvent.law``: ``law(t, parameters) -> (angle, rate, acceleration)``
    parameters : list of numbers
    """

    law: DriveLaw
    parameters: Parameters = ()

    def write(self, builder: Builder, name: str) -> DriveRow:
        """Store the law's address and parameters."""
        return _law_row(builder, name, self.law, parameters=self.parameters)

    def at(self, builder: Builder, row: DriveRow, time: float) -> tuple[float, float, float]:
        """Angle, rate and acceleration; refused unless finite."""
        angle, rate, acceleration = _tried(builder, row, self.law.of("drive"), time)
        return angle, rate, acceleration


def _law_row(builder: Builder, name: str, law: Any, **options: Any) -> DriveRow:
    fields = write_law(builder, name, law, "drive", **options)
    return DriveRow(kernels.LAW, fields["first"], fields["last"], fields["law"])


def _tried(builder: Builder, row: DriveRow, law: Any, time: float, described: str = "") -> tuple[float, ...]:
    return laws.try_law(law, time, np.array(builder.values[row.first : row.last]), described=described, kind="drive")


class FreeSpool(DriveKind):
    """A spool driven by the thread's tension, with a motor, a brake and friction between the spool and its body.

    Parameters
    ----------
    inertia : float, kg m2, moment of inertia of the empty spool about its axis, included in that of a moving body
        (that of wound thread with `wound_mass` 'carried' is added)
    torque : float, N m, constant torque of a motor on the spool (positive pays out)
    profile : torque of a motor as a function of time, N m, added to `torque`
    law : torque of a motor, N m, added to both: an expression of the spool's angle x (rad), its rate v (rad/s) and t
        (s), or a function under ``@evolvent.law``: ``law(angle, rate, t, parameters) -> torque``
    parameters : list of float, parameters of a Python law
    constants : mapping of names to float, constants of an expression
    brake : float, N m, torque of a brake: it holds the spool up to this torque and then slips at it (under
        generalized-alpha a spool that is held creeps at 1e-6 rad/s at most)
    friction_torque : float, N m, Coulomb friction of the bearing; it adds to the torque of the brake
    viscous_damping : float, N m s/rad, coefficient of viscous friction of the bearing
    angle, rate : float, rad and rad/s, of the spool at the start
    """

    inertia: units.Inertia
    torque: units.Torque = 0.0
    profile: TorqueProfile | None = None
    law: SpringLaw | None = None
    parameters: Parameters = ()
    constants: Constants | None = None
    brake: units.TorqueOrZero = 0.0
    friction_torque: units.TorqueOrZero = 0.0
    viscous_damping: units.RotationalDampingOrZero = 0.0
    angle: units.Angle = 0.0
    rate: units.AngularRate = 0.0

    def write(self, builder: Builder, name: str) -> DriveRow:
        """Reserve the spool's angle and rate as coordinates."""
        check_start(name, self.angle)
        q, v = builder.coordinates([self.angle], [self.rate])
        at, law = -1, {"law": 0, "first": 0, "last": 0}
        if self.profile is not None:
            at, _ = builder.parameters(write_profile(builder, f"{name}.profile", self.profile))
        if self.law is None:
            refuse_without_law(name, self)
        else:
            law = write_law(builder, name, self.law, "spring", self.parameters, self.constants)
        return DriveRow(
            kernels.FREE, 0, 0, 0, q, v, self.inertia, self.torque, self.brake + self.friction_torque,
            self.viscous_damping, at, law["law"], law["first"], law["last"],
        )  # fmt: skip

    def at(self, builder: Builder, row: DriveRow, time: float) -> tuple[float, float, float]:
        """Angle and rate at the start."""
        return self.angle, self.rate, 0.0


class _Keys(Section, Generic[A, R]):
    """Drives as a case file writes them: one of these keys."""

    constant: ConstantDrive[A, R] | None = None
    ramp: RampDrive[A, R] | None = None
    table: TableDrive[A, R] | None = None
    free: FreeSpool | None = None
    feedback: FeedbackDrive | None = None
    expression: TimeExpression | None = None
    constants: Constants | None = None


class _OneDrive:
    """A pydantic annotation on `_Keys`: a drive, made in Python or read from a mapping with one of the keys.

    Parameters
    ----------
    rate : str, example of a rate
    spool : bool, whether it may be free, or react
    """

    kinds: ClassVar[dict[str, type[DriveKind]]] = {
        "constant": ConstantDrive,
        "ramp": RampDrive,
        "table": TableDrive,
        "free": FreeSpool,
        "feedback": FeedbackDrive,
        "expression": ExpressionDrive,
    }

    def __init__(self, rate: str = "3.5 rad/s", *, spool: bool = False) -> None:
        self.names = [name for name in self.kinds if spool or name not in OF_SPOOLS]
        self.allowed = f"a mapping with one of the keys {', '.join(self.names)}, such as {{constant: {{rate: {rate}}}}}"

    def read(self, value: Any, handler: Any) -> DriveKind:
        """The drive itself."""
        if isinstance(value, DriveKind):
            if isinstance(value, FeedbackDrive) and "feedback" not in self.names:
                raise PydanticCustomError("drive", "it must be {allowed}", {"allowed": self.allowed})
            return value
        hint = kind_hint(value, self.kinds)
        if hint:
            raise PydanticCustomError("drive", "{hint}", {"hint": hint})
        if not isinstance(value, Mapping):
            raise PydanticCustomError("drive", "it must be {allowed}", {"allowed": self.allowed})
        given = [key for key in value if key != "constants"]
        if len(given) != 1:
            raise PydanticCustomError("drive", "it must be {allowed}", {"allowed": self.allowed})
        if given[0] not in self.kinds or (given[0] == "feedback" and given[0] not in self.names):
            guess = nearest(str(given[0]), self.names)
            raise PydanticCustomError("drive", "{key} is no drive; {guess}", {"key": repr(given[0]), "guess": guess})
        keys = handler(value)
        if keys.expression is not None:
            return ExpressionDrive(expression=keys.expression, constants=keys.constants)
        if keys.constants:
            raise PydanticCustomError("drive", "constants go with expression, not with {key}", {"key": given[0]})
        found: DriveKind = getattr(keys, given[0])
        return found

    def write(self, value: Any, info: Any) -> Any:
        """A drive as a case file holds it."""
        options = {"mode": info.mode, "exclude_defaults": info.exclude_defaults, "exclude_unset": info.exclude_unset}
        inner = value.model_dump(**options)
        if isinstance(value, ExpressionDrive | LawDrive):
            return inner
        return {next(key for key, kind in self.kinds.items() if isinstance(value, kind)): inner}

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        """A validator, and a serializer."""
        return core_schema.no_info_wrap_validator_function(
            self.read,
            handler(source),
            serialization=core_schema.plain_serializer_function_ser_schema(self.write, info_arg=True, when_used="json"),
        )

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """That of the keys."""
        return {**handler(schema["schema"]), "description": self.allowed}


if TYPE_CHECKING:
    Drive = DriveKind
    PathDrive = DriveKind
    LineDrive = DriveKind
else:
    #: How a spool or a body turns.
    Drive = Annotated[_Keys[units.Angle, units.AngularRate], _OneDrive(spool=True)]
    #: How a point is moved along a line (m, m/s) or round a circle (rad, rad/s).
    PathDrive = Annotated[_Keys[units.AngleOrLength, units.AngularRateOrSpeed], _OneDrive()]
    #: How a body is carried along a line.
    LineDrive = Annotated[_Keys[units.Coordinate, units.Speed], _OneDrive("5 cm/s")]
