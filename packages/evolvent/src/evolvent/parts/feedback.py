"""A drive that reacts: the rate of a spool by a law of measured quantities, sampled and held."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BeforeValidator, Field
from pydantic_core import PydanticCustomError

from evolvent.assembly import expressions
from evolvent.assembly.builder import Builder
from evolvent.kernels import drive as kernels
from evolvent.parts.drive_kind import DriveKind, DriveRow, check_start
from evolvent.parts.expression import VARIABLES, Constants, FeedbackLaw, refuse_unused
from evolvent_base import units
from evolvent_base.errors import InputError, nearest
from evolvent_base.schema import Section

__all__ = ["FeedbackDrive", "Limits", "Sensor"]

#: End of the name of the rate of a measured quantity.
RATE = "_rate"
#: Most measured quantities.
MOST = 10
_RATE = units.Quantity(what="an angular rate", unit="rad/s", example="6 rad/s")
#: Largest delay, in periods.
MOST_PERIODS = 10_000


def _read_variables(value: Any) -> Any:
    allowed = f"a mapping of at most {MOST} names to results, such as {{lag: blade.tip_lag}}"
    fits = isinstance(value, Mapping) and 0 < len(value) <= MOST
    if not fits or not all(expressions.is_name(key) and isinstance(name, str) for key, name in value.items()):
        raise PydanticCustomError("variables", "it must be {allowed}", {"allowed": allowed})
    return value


def _read_noise(value: Any) -> Any:
    allowed = "a mapping of names of variables to a number or a text with a unit, such as {lag: 0.1 deg}"
    if not isinstance(value, Mapping) or not all(_is_size(size) for size in value.values()):
        raise PydanticCustomError("noise", "it must be {allowed}", {"allowed": allowed})
    return value


def _is_size(size: Any) -> bool:
    """Whether noise is a text, whose unit is read where the quantity is known, or a finite number of 0 or more."""
    is_number = isinstance(size, (int, float)) and not isinstance(size, bool)
    return isinstance(size, str) or (is_number and 0.0 <= size < math.inf)


class Sensor(Section):
    """How quantities are measured.

    Parameters
    ----------
    period : float, s, between samples, and between commands
    delay : float, s, from a sample to the command that follows from it
    filter : float, s, time constant of a low-pass filter of first order on every quantity; 0 for none
    noise : mapping of names of variables to the standard deviation of their noise, white from sample to sample, before
        the filter
    seed : int, of the noise
    """

    period: units.Duration
    delay: units.DurationOrZero = 0.0
    filter: units.DurationOrZero = 0.0
    noise: Annotated[Mapping[str, float | str], BeforeValidator(_read_noise)] = Field(default_factory=dict)
    seed: Annotated[int, units.Whole(least=0, most=2**31 - 1)] = 0

    def refusals(self) -> Any:
        """A delay of very many periods."""
        if self.delay > MOST_PERIODS * self.period:
            yield f"sensor.delay is {self.delay:g} s, more than {MOST_PERIODS} times sensor.period, {self.period:g} s"


class Limits(Section):
    """What the motor of a spool can do.

    Parameters
    ----------
    rate : (2,) float, rad/s, least and largest rate; a negative one reels in
    acceleration : float, rad/s2, largest size of the acceleration; left out: the rate may change at will in a period
    """

    rate: Annotated[tuple[float, ...], units.Vector(quantity=_RATE, size=2)] | None = None
    acceleration: (
        Annotated[float, units.Quantity(what="an angular acceleration", unit="rad/s^2", example="2 rad/s^2", above=0.0)]
        | None
    ) = None

    def refusals(self) -> Any:
        """A least rate that is not below the largest."""
        if self.rate is not None and not self.rate[0] < self.rate[1]:
            yield f"limits.rate is {list(self.rate)}; the first, the least, must be below the second, the largest"


class FeedbackDrive(DriveKind):
    """A drive that reacts to what is measured of the motion: a law in discrete time.

    Parameters
    ----------
    law : expression of the rate to which the spool is commanded, rad/s: of time t (s), the commanded angle x (rad) and
        rate v (rad/s) of the spool, and of every variable and its rate, by its name with ``_rate`` behind it
    variables : mapping of names to results of parts, by the names that they have in a run: {lag: blade.tip_lag}
    constants : mapping of names to numbers, SI units
    sensor : period, delay, filter, noise and seed of the measurement
    limits : rate and acceleration of the spool
    angle, rate : float, rad and rad/s, of the spool at the start

    Notes
    -----
    Every period the variables are sampled, with their noise, and filtered. After the delay the law gives the rate that
    the spool reaches at the end of the next period, at a constant acceleration. The rate of a variable is the
    difference of its filtered values over a period. What cannot be measured, such as the direction of a thread of which
    nothing is out, keeps its last value, 0 at the start. The spool stops where its thread is all out, or all wound.
    """

    law: FeedbackLaw
    variables: Annotated[dict[str, str], BeforeValidator(_read_variables)]
    constants: Constants | None = None
    sensor: Sensor
    limits: Limits = Limits()
    angle: units.Angle = 0.0
    rate: units.AngularRate = 0.0

    @property
    def names(self) -> tuple[str, ...]:
        """Variables of the law, in the order in which it is evaluated."""
        rates = [f"{name}{RATE}" for name in self.variables]
        return (*VARIABLES["feedback"], *self.variables, *rates)

    def program(self, name: str) -> expressions.Program:
        """The law, compiled; `name` of the drive, for messages.

        Raises
        ------
        InputError
        """
        return expressions.compile_expression(self.law, self.names, self.constants, name=f"{name}.law")

    def write(self, builder: Builder, name: str) -> DriveRow:
        """Store a table that comes to rest; the loop has its own written while it runs."""
        check_start(name, self.angle)
        twice = [key for key in self.names if self.names.count(key) > 1]
        if twice:
            raise InputError(
                f"{name}.variables: {twice[0]!r} would stand for two quantities; t, x, v and a name that ends with "
                f"{RATE} of another one are taken"
            )
        self.program(name)
        refuse_unused(f"{name}.constants", self.constants, f"{name}.law", [self.law])
        used = expressions.names(self.law)
        for key in self.variables:
            if key not in used and f"{key}{RATE}" not in used:
                raise InputError(f"{name}.variables has {key!r}, which {name}.law, {self.law!r}, does not use")
        for key in self.sensor.noise:
            if key not in self.variables:
                raise InputError(f"{name}.sensor.noise has {key!r}; {nearest(str(key), self.variables)}")
        if self.limits.rate is not None and not self.limits.rate[0] <= self.rate <= self.limits.rate[1]:
            raise InputError(
                f"{name}.rate is {self.rate:g} rad/s, outside {name}.limits.rate, {list(self.limits.rate)}"
            )
        period = self.sensor.period
        piece = [0.0, 0.0, -0.5 * self.rate / period, self.rate, self.angle]
        return DriveRow(kernels.TABLE, *builder.parameters([2.0, 0.0, period, *piece]), law=kernels.OPEN)

    def at(self, builder: Builder, row: DriveRow, time: float) -> tuple[float, float, float]:
        """Angle and rate at the start."""
        return self.angle, self.rate, 0.0
