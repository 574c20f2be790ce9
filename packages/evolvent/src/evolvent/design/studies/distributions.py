"""Distributions of a key that varies: read from a text such as "normal(0.1 N m/rad, 5%)", and their quantiles.

=============================================  ====================================================================
text                                           what it is
=============================================  ====================================================================
``10%``, ``tolerance(5 deg)``                  uniform within the case's value less and plus this
``tolerance(-5%, 10%)``                        uniform from the case's value -5 % to the case's value +10 %
``uniform(LOW, HIGH)``                         equally probable values between two limits
``triangular(LOW, MODE, HIGH)``                a density that rises to the mode and falls from there
``normal(MEAN, STD)``                          a normal distribution
``truncated-normal(MEAN, STD, LOW, HIGH)``     a normal distribution without what lies beyond two limits
``table(VALUE, VALUE, ...)``                   measured values, each with the same probability
``table(FILE.csv)``, ``table(FILE, COLUMN)``   the same from a column of a file, with the unit of its head
=============================================  ====================================================================

``nominal`` stands for the case's own value. A percentage in the place of a value is a share of the case's value
(``uniform(90%, 110%)``), in the place of a standard deviation a share of the mean.
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import scipy

from evolvent.design.studies import measured
from evolvent_base import schema, units
from evolvent_base.errors import InputError, nearest

Array = np.ndarray
#: Names of the distributions, with the names of their arguments; `...` for any number of values.
KINDS: Mapping[str, tuple[str, ...]] = {
    "uniform": ("LOW", "HIGH"),
    "triangular": ("LOW", "MODE", "HIGH"),
    "normal": ("MEAN", "STD"),
    "truncated-normal": ("MEAN", "STD", "LOW", "HIGH"),
    "tolerance": ("DEVIATION",),
    "table": ("VALUE", "..."),
}
#: Standard deviations from the mean to the ends that the worst case takes of a normal distribution.
NORMAL_ENDS = 3.0


@dataclasses.dataclass(frozen=True, kw_only=True)
class Distribution:
    """A distribution of numbers in the SI unit of a key.

    Attributes
    ----------
    kind : str, one of `KINDS` without "tolerance", which is uniform
    values : tuple of float, its arguments in the order of `KINDS`
    whole : bool, whether the key takes whole numbers
    """

    kind: str
    values: tuple[float, ...]
    whole: bool = False

    def quantiles(self, u: Array) -> list[Any]:
        """Values at the probabilities u, (n,) from (0, 1)."""
        if self.whole and self.kind == "uniform":
            first, last = self.values
            return [int(v) for v in np.floor(first + (last + 1.0 - first) * u)]
        found = self._quantiles(u)
        return [round(v) for v in found] if self.whole else [float(v) for v in found]

    def _quantiles(self, u: Array) -> Array:
        match self.kind:
            case "uniform":
                low, high = self.values
                return np.asarray(low + (high - low) * u)
            case "triangular":
                low, mode, high = self.values
                below = low + np.sqrt(u * (high - low) * (mode - low))
                above = high - np.sqrt((1.0 - u) * (high - low) * (high - mode))
                return np.where(u * (high - low) < mode - low, below, above)
            case "normal":
                mean, std = self.values
                return np.asarray(mean + std * scipy.special.ndtri(u))
            case "truncated-normal":
                mean, std, low, high = self.values
                found = scipy.stats.truncnorm.ppf(u, (low - mean) / std, (high - mean) / std, loc=mean, scale=std)
                return np.clip(found, low, high)
            case _:
                listed = np.sort(self.values)  # so that a larger probability gives no smaller value
                return listed[np.minimum((u * listed.size).astype(int), listed.size - 1)]

    def ends(self) -> tuple[Any, Any]:
        """Smallest and largest value; of a normal distribution `NORMAL_ENDS` standard deviations from its mean."""
        if self.kind == "normal":
            mean, std = self.values
            low, high = mean - NORMAL_ENDS * std, mean + NORMAL_ENDS * std
        elif self.kind == "truncated-normal":
            low, high = self.values[2:]
        else:
            low, high = min(self.values), max(self.values)
        return (round(low), round(high)) if self.whole else (low, high)


def read(
    where: str, given: Any, reader: Any, nominal: Callable[[], Any], tables: measured.Tables | None = None
) -> Distribution:
    """The distribution that a study gives for a key.

    Parameters
    ----------
    where : str, the key, for messages
    given : text of this module's table, or a mapping {from, to} (uniform) or {mean, std} (normal)
    reader : what reads the key's value (`units.Quantity`, `units.Whole`)
    nominal : function that returns the case's own value of the key
    tables : the files that the text may name; none where it may not

    Raises
    ------
    InputError
        One sentence that names the key, its value and what is allowed.
    """
    if reader is None:
        raise InputError(f"{where} takes words or lists, so it has no range; give a list of values")
    whole = isinstance(reader, units.Whole)
    if tables is not None and measured.file_of(given) is not None:
        entries = _Reading(where, given, reader, nominal)
        listed = [entries.quantity(one) for one in tables.values(where, given, getattr(reader, "unit", ""))]
        return Distribution(kind="table", values=tuple(listed), whole=whole)
    if isinstance(given, str):
        kind, values = _of_text(where, given, _Reading(where, given, reader, nominal))
        return _checked(where, given, Distribution(kind=kind, values=tuple(values), whole=whole))
    if isinstance(given, dict) and {"mean", "std"} & set(given):
        check_fields(where, given, ("mean", "std"))
        mean, std = (number(where, given, key, reader) for key in ("mean", "std"))
        if std < 0.0:
            raise InputError(f"{where}.std is {std:g}; it must not be below zero")
        return Distribution(kind="normal", values=(mean, std), whole=whole)
    if isinstance(given, dict) and {"from", "to"} & set(given):
        check_fields(where, given, ("from", "to"))
        first, last = (number(where, given, key, reader) for key in ("from", "to"))
        return Distribution(kind="uniform", values=(first, last), whole=whole)
    raise InputError(
        f"{where} is {schema.shown(given)}; it must be {{from, to}} (uniform), {{mean, std}} (normal) or a text such "
        f"as 'normal(nominal, 5%)'; distributions: {', '.join(KINDS)}"
    )


@dataclasses.dataclass(frozen=True)
class _Reading:
    """Reads the arguments of a distribution's text."""

    where: str
    text: str
    reader: Any
    nominal: Callable[[], Any]

    def own(self) -> float:
        """The case's own value."""
        found = self.nominal()
        if isinstance(found, bool) or not isinstance(found, (int, float)):
            raise InputError(
                f"{self.where} is {self.text!r}, but the case's own value of the key is {schema.shown(found)}, no "
                f"number; write the distribution with values alone"
            )
        return float(found)

    def value(self, text: str) -> float:
        """A value: a quantity, 'nominal' or a share of it."""
        if text == "nominal":
            return self.own()
        if text.endswith("%"):
            return self.own() * self.share(text)
        return self.quantity(text)

    def spread(self, text: str, of: float) -> float:
        """A standard deviation or a deviation: a quantity, or a share of a value."""
        return abs(of) * self.share(text) if text.endswith("%") else self.quantity(text, difference=True)

    def share(self, text: str) -> float:
        """A percentage as a share."""
        try:
            found = float(text[:-1])
        except ValueError:
            found = math.nan
        if not math.isfinite(found):
            raise InputError(f"{self.where} is {self.text!r}; {text!r} is not a percentage, such as 5%")
        return found / 100.0

    def quantity(self, text: str, *, difference: bool = False) -> float:
        """A number with the unit of the key."""
        found = number(self.where, {text: text}, text, self.reader, inside=self.text)
        return found - number(self.where, {"": _zero(text)}, "", self.reader) if difference and _zero(text) else found


def _zero(text: str) -> str:
    """The zero of a quantity's unit where it has an offset (degrees Celsius), else ''."""
    unit = units.unit_of(text)
    return f"0 {unit}" if unit in ("degC", "°C", "celsius", "degF") else ""


def _of_text(where: str, text: str, read_: _Reading) -> tuple[str, list[float]]:
    """Kind and arguments of a distribution's text."""
    stripped = text.strip()
    if re.fullmatch(r"[^()]*%", stripped):
        stripped = f"tolerance({stripped})"
    match = re.fullmatch(r"([\w-]+)\s*\(([^()]*(?:\([^()]*\)[^()]*)*)\)", stripped)
    if match is None:
        raise InputError(
            f"{where} is {schema.shown(text)}; it must be a tolerance such as '10%', or a distribution such as "
            f"'normal(nominal, 5%)'; distributions: {', '.join(KINDS)}"
        )
    kind, arguments = match[1], [one.strip() for one in match[2].split(",")]
    if kind not in KINDS:
        raise InputError(f"{where} is {schema.shown(text)}; no distribution is called {kind!r}; {nearest(kind, KINDS)}")
    counts = {"table": range(1, measured.MOST + 1), "tolerance": range(1, 3)}.get(
        kind, range(len(KINDS[kind]), 1 + len(KINDS[kind]))
    )
    if len(arguments) not in counts or not all(arguments):
        form = f"{kind}({', '.join(KINDS[kind])})" + (" or tolerance(LOWER, UPPER)" if kind == "tolerance" else "")
        raise InputError(f"{where} is {schema.shown(text)}; it must have the form {form}")
    if kind == "tolerance":
        own = read_.own()
        off = [read_.spread(one, own) for one in arguments]
        if len(off) == 1:
            off = [-off[0], off[0]]
        return "uniform", [own + off[0], own + off[1]]
    if kind in ("normal", "truncated-normal"):
        mean = read_.value(arguments[0])
        return kind, [mean, read_.spread(arguments[1], mean), *map(read_.value, arguments[2:])]
    return kind, [read_.value(one) for one in arguments]


def _checked(where: str, text: str, found: Distribution) -> Distribution:
    """Refuse limits that are not in order, and spreads that are not above zero."""
    match found.kind:
        case "uniform":
            limits: Sequence[float] = found.values
        case "triangular":
            limits = found.values
        case "truncated-normal":
            limits = found.values[2:]
        case _:
            limits = ()
    if list(limits) != sorted(limits) or (len(limits) > 1 and limits[0] == limits[-1]):
        listed = ", ".join(f"{one:.6g}" for one in limits)
        raise InputError(f"{where} is {schema.shown(text)}; its limits must rise, but are {listed}")
    if found.kind.endswith("normal") and not found.values[1] > 0.0:
        raise InputError(
            f"{where} is {schema.shown(text)}; its standard deviation is {found.values[1]:g}, but must be above zero"
        )
    if found.whole and found.kind == "uniform" and any(v != round(v) for v in found.values):
        raise InputError(
            f"{where} is {schema.shown(text)}; the key takes whole numbers, so its limits must be whole numbers"
        )
    return found


# ------------------------------------------------------------------------------------------------ numbers of a range


def check_fields(where: str, given: Mapping[str, Any], allowed: Sequence[str]) -> None:
    """Refuse keys of a range other than those allowed.

    Raises
    ------
    InputError
        The sentence names the nearest.
    """
    for key in given:
        if key not in allowed:
            raise InputError(f"unknown key '{where}.{key}'; {nearest(str(key), allowed)}")


def number(where: str, given: Mapping[str, Any], key: str, reader: Any, *, inside: str = "") -> float:
    """A number of a range, in the SI unit of the key that varies.

    Parameters
    ----------
    inside : str, the text of the distribution that it stands in

    Raises
    ------
    InputError
        If it is missing, or no number of that unit.
    """
    if key not in given:
        raise InputError(f"{where}.{key} is missing; a range has a 'from' and a 'to'")
    value, unit = given[key], getattr(reader, "unit", "")
    problem = "it is not a finite number"
    try:
        if not isinstance(value, bool) and isinstance(value, (int, float, str)):
            found = units.parse(value, unit) if isinstance(value, str) else float(value)
            if math.isfinite(found):
                return found
    except OverflowError:
        pass
    except units.UnitError as error:
        problem = str(error)
    wanted = f"a number in {unit}, or with a unit of that kind" if unit else "a plain number"
    if inside:
        raise InputError(f"{where} is {schema.shown(inside)}; {value!r} must be {wanted}; {problem}")
    raise InputError(f"{where}.{key} is {schema.shown(value)}; it must be {wanted}; {problem}")


def value(where: str, given: Any, text: str, reader: Any, nominal: Callable[[], float]) -> float:
    """A value in the SI unit of a key: a quantity, ``nominal``, or a percentage of the case's own value.

    Parameters
    ----------
    where, given : str, the key and what holds the value, for messages
    text : str
    reader : what reads the key's value
    nominal : function that returns the case's own value

    Raises
    ------
    InputError
        If it is no such value.
    """
    return _Reading(where, given, reader, nominal).value(text.strip())
