"""Profiles: functions of time by which a load acts."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Mapping
from typing import Annotated, Any, Generic, TypeVar

import numpy as np
import scipy
from pydantic import BeforeValidator
from pydantic_core import PydanticCustomError

from evolvent.assembly import expressions
from evolvent.assembly.builder import Builder
from evolvent.kernels import profile as kernels
from evolvent.parts.expression import Constants, TimeExpression, refuse_unused
from evolvent_base import units
from evolvent_base.errors import InputError, nearest
from evolvent_base.schema import Section

__all__ = ["Profile"]

V = TypeVar("V")


def table_rows(value: Any, columns: str = "[time, value]", least: int = 2) -> Any:
    """Rows of a table of two columns; a unit that stands in the last row alone is that of its column."""
    rows = value.tolist() if isinstance(value, np.ndarray) else value
    if not isinstance(rows, (list, tuple)) or len(rows) < least:
        many = "two or more rows" if least == 2 else "one or more rows"
        raise PydanticCustomError("table", "it must be a list of {many} {columns}", {"many": many, "columns": columns})
    if any(not isinstance(row, (list, tuple)) or len(row) != 2 for row in rows):
        raise PydanticCustomError("table", "every row of it must have two values, {columns}", {"columns": columns})
    try:
        found = [units.shared_unit(list(column)) for column in zip(*rows, strict=True)]
    except (units.UnitError, TypeError, ValueError) as error:
        raise PydanticCustomError("table", "{why}", {"why": str(error)}) from None
    return list(zip(*found, strict=True))


class Ramp(Section, Generic[V]):
    """A smooth step from one value to another, held before and after.

    Parameters
    ----------
    initial, final : values
    start, duration : float, s

    Notes
    -----
    initial + (final - initial) (10 s^3 - 15 s^4 + 6 s^5), s = (t - start)/duration: slope and curvature are continuous.
    """

    initial: V = 0.0  # type: ignore[assignment]
    final: V
    start: units.Time = 0.0
    duration: units.Duration

    def pieces(self) -> tuple[list[float], list[list[float]], float, float]:
        """Times, coefficients of the pieces, values before and after."""
        times = [self.start, self.start + self.duration]
        return times, [_step(self.initial, self.final, self.duration)], float(self.initial), float(self.final)  # type: ignore[arg-type]


class Sine(Section, Generic[V]):
    """A sine: offset + amplitude sin(2 pi frequency (t - start) + phase); zero before `start` and from `until` on.

    Parameters
    ----------
    amplitude, offset : values
    frequency : float, Hz
    phase : float, rad
    start, until : float, s; without an end it goes on
    """

    amplitude: V
    frequency: units.Frequency
    phase: units.Angle = 0.0
    offset: V = 0.0  # type: ignore[assignment]
    start: units.Time = 0.0
    until: units.Time | None = None


class Pulse(Section, Generic[V]):
    """A value from `start` for `duration`, and zero otherwise.

    Parameters
    ----------
    value : value
    start, duration : float, s
    rise : float, s, of smooth steps at its start and end, within its duration
    """

    value: V
    start: units.Time = 0.0
    duration: units.Duration
    rise: units.DurationOrZero = 0.0

    def pieces(self) -> tuple[list[float], list[list[float]], float, float]:
        """Times, coefficients of the pieces, values before and after."""
        value, end = float(self.value), self.start + self.duration  # type: ignore[arg-type]
        if self.rise == 0.0:
            return [self.start, end], [_level(value)], 0.0, 0.0
        times = [self.start, self.start + self.rise, end - self.rise, end]
        found = [_step(0.0, value, self.rise), _level(value), _step(value, 0.0, self.rise)]
        if times[1] >= times[2]:
            times, found = [times[0], times[1], end], [found[0], found[2]]
        return times, found, 0.0, 0.0


class Profile(Section, Generic[V]):
    """A function of time, of one of these kinds; a list alone is a table.

    Parameters
    ----------
    table : rows [time, value], in order of time; straight lines between them, the first and last values are held before
        and after; two rows of one time are a jump
    smooth : bool, whether a monotone cubic (PCHIP) goes through the table's rows instead
    ramp : a smooth step
    sine : a sine
    pulse : a value for a while
    constant : value
    expression : str, of t (s) and of `constants`, in SI units
    constants : mapping of names to numbers
    """

    table: Annotated[tuple[tuple[units.Time, V], ...], BeforeValidator(table_rows)] | None = None
    smooth: bool = False
    ramp: Ramp[V] | None = None
    sine: Sine[V] | None = None
    pulse: Pulse[V] | None = None
    constant: V | None = None
    expression: TimeExpression | None = None
    constants: Constants | None = None


def kind_hint(value: Any, kinds: Iterable[str]) -> str:
    """How a kind is written of a profile or drive that is given as a word or under the key `kind`; '' for others."""
    word = value.get("kind") if isinstance(value, Mapping) else value
    if not isinstance(word, str):
        return ""
    close = difflib.get_close_matches(word.strip().lower(), list(kinds), n=1, cutoff=0.7)
    if not close:
        return f"{word!r} is not a kind; {nearest(word, kinds)}" if isinstance(value, Mapping) else ""
    return f"the kind is the key of a mapping; did you mean {{{close[0]}: ...}}?"


KINDS = ("table", "ramp", "sine", "pulse", "constant", "expression")


def _as_keys(value: Any) -> Any:
    """A list as the table of a profile."""
    if isinstance(value, (list, tuple, np.ndarray)):
        return {"table": value}
    hint = kind_hint(value, KINDS)
    if hint:
        raise PydanticCustomError("profile", "{hint}", {"hint": hint})
    if not isinstance(value, (Mapping, Profile)):
        allowed = f"rows [time, value], or a mapping with one of the keys {', '.join(KINDS)}"
        raise PydanticCustomError("profile", "it must be {allowed}", {"allowed": allowed})
    return value


#: Validator that reads a profile; modules of parts define the types for other quantities in the same way.
AS_PROFILE = BeforeValidator(_as_keys)
ForceProfile = Annotated[Profile[units.Force], AS_PROFILE]
TorqueProfile = Annotated[Profile[units.Torque], AS_PROFILE]


def write_profile(builder: Builder, name: str, profile: Profile[Any]) -> list[float]:
    """Parameters of a profile as `evolvent.kernels.profile` reads them; its corners become breaks.

    Parameters
    ----------
    builder : Builder
    name : str, the key that holds the profile, for messages
    """
    given = [kind for kind in KINDS if getattr(profile, kind) is not None]
    if len(given) != 1:
        found = f"has the keys {', '.join(given)}" if given else "is empty"
        raise InputError(f"{name} {found}; it must have one of {', '.join(KINDS)}")
    for key, kind in (("smooth", "table"), ("constants", "expression")):
        if getattr(profile, key) and given[0] != kind:
            raise InputError(f"{name}.{key} goes with {kind}, not with {given[0]}")
    if profile.sine is not None:
        return _sine(builder, name, profile.sine)
    if profile.expression is not None:
        program = expressions.compile_expression(
            profile.expression, ("t",), profile.constants, name=f"{name}.expression"
        )
        refuse_unused(f"{name}.constants", profile.constants, f"{name}.expression", [program.text])
        _add_breaks(builder, program.corners)
        return [kernels.EXPRESSION, *program.code]
    if profile.constant is not None:
        times, coefficients, before, after = [0.0, 1.0], [_level(profile.constant)], profile.constant, profile.constant
    elif profile.table is not None:
        times, coefficients, before, after = _table(name, profile.table, smooth=profile.smooth)
        _add_breaks(builder, times)
    else:
        pulse = profile.pulse
        if pulse is not None and 2.0 * pulse.rise > pulse.duration * (1.0 + 1e-12):
            raise InputError(
                f"{name}.pulse.rise is {pulse.rise!r} s; it must be at most half of {name}.pulse.duration, "
                f"{pulse.duration!r} s"
            )
        times, coefficients, before, after = (profile.ramp or pulse).pieces()  # type: ignore[union-attr]
        _add_breaks(builder, times)
    return [kernels.PIECES, len(times), before, after, *times, *np.ravel(coefficients)]


def _add_breaks(builder: Builder, times: Iterable[float]) -> None:
    builder.breaks.update(float(t) for t in times if t > 0.0)


def _sine(builder: Builder, name: str, sine: Sine[Any]) -> list[float]:
    end = math.inf if sine.until is None else sine.until
    if not end > sine.start:
        raise InputError(f"{name}.sine.until is {sine.until!r} s; it must be after {name}.sine.start, {sine.start!r} s")
    _add_breaks(builder, (t for t in (sine.start, end) if math.isfinite(t)))
    turning = 2.0 * math.pi * sine.frequency
    return [kernels.SINE, sine.amplitude, turning, sine.phase, sine.offset, sine.start, end]


def _level(value: float) -> list[float]:
    return [0.0, 0.0, 0.0, 0.0, 0.0, value]


def _step(before: Any, after: Any, duration: float) -> list[float]:
    """Coefficients of a smooth step, highest power first."""
    d = after - before
    return [6.0 * d / duration**5, -15.0 * d / duration**4, 10.0 * d / duration**3, 0.0, 0.0, float(before)]


def _table(name: str, rows: Any, *, smooth: bool) -> tuple[list[float], list[list[float]], float, float]:
    """Pieces of a table."""
    times, values = (list(column) for column in zip(*rows, strict=True))
    for k in range(1, len(rows)):
        twice = times[k] == times[k - 1]
        if times[k] < times[k - 1] or (twice and (smooth or (k > 1 and times[k] == times[k - 2]))):
            raise InputError(f"{name}.table: row {k + 1} is at {times[k]!r} s, not after the row before")
    if times[-1] == times[0]:
        raise InputError(f"{name}.table: all its rows are at {times[0]!r} s; it needs two times")
    if smooth:
        found = scipy.interpolate.PchipInterpolator(times, values).c.T
        return times, [[0.0, 0.0, *row] for row in found.tolist()], values[0], values[-1]
    kept, coefficients = [times[0]], []
    for k in range(1, len(rows)):
        if times[k] > times[k - 1]:
            slope = (values[k] - values[k - 1]) / (times[k] - times[k - 1])
            kept.append(times[k])
            coefficients.append([0.0, 0.0, 0.0, 0.0, slope, values[k - 1]])
    return kept, coefficients, values[0], values[-1]
