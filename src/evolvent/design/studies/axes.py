"""The keys that vary in a study, and their values: given, spaced or drawn."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from evolvent.base import schema, units
from evolvent.base.errors import InputError, nearest

#: Most cases that a study may have; every one is checked before the first is run.
MOST_CASES = 1_000_000


@dataclasses.dataclass(frozen=True, kw_only=True)
class Axis:
    """A key that varies.

    Attributes
    ----------
    key : str, dotted, of the case; or after the name of the stage that it is for
    stage : str, that stage's name, '' for all of them
    values : tuple, one for each point (grid) or for each case
    unit, what : str, of the key, as its schema says
    entry : bool, whether the key is an entry of a list, whose others may have another unit
    """

    key: str
    values: tuple[Any, ...]
    unit: str
    what: str
    stage: str = ""
    entry: bool = False

    @property
    def path(self) -> str:
        """Key of the case."""
        return self.key.removeprefix(f"{self.stage}.") if self.stage else self.key

    def written(self, place: int) -> Any:
        """The value at an index as a case holds it."""
        value = self.values[place]
        is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
        return f"{value!r} {self.unit}" if self.entry and self.unit and is_number else value


def whole_number(content: Mapping[str, Any], key: str, default: int, *, least: int, most: int, where: str = "") -> int:
    """A whole number of a mapping, or the default.

    Raises
    ------
    InputError
        If it is none, or out of bounds.
    """
    value = content.get(key, default)
    if key in content and (isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most):
        raise InputError(f"{where}{key} is {schema.shown(value)}; it must be a whole number from {least} to {most}")
    return int(value)


def annotation(kind: Any, key: str, content: Any = None) -> tuple[Any, str]:
    """What reads a key's value (`units.Quantity`, `units.Whole` or None), and what the key is.

    Parameters
    ----------
    kind : pydantic model of the case
    key : str, dotted
    content : mapping, the case as it is written; keys of its parts depend on their kinds

    Raises
    ------
    InputError
        If the case has no such key.
    """
    try:
        found = schema.locate(kind, key, content)
    except InputError as error:
        raise InputError(f"over: {error}") from None
    reader = next((one for _, marks in found.types for mark in marks if (one := _reader(mark, found.entry))), None)
    what = str(getattr(reader, "what", "")).removeprefix("a ").removeprefix("an ")
    return reader, found.text or what or key


def _reader(mark: Any, entry: bool) -> units.Quantity | units.Whole | None:
    """What reads one number of a key with such an annotation; None where the key takes none."""
    if isinstance(mark, (units.OneOrMore, units.Tensor)) or (isinstance(mark, units.Vector) and entry):
        return mark.quantity
    return mark if isinstance(mark, (units.Quantity, units.Whole)) else None


def _is_known(kind: Any, key: str, content: Any) -> bool:
    """Whether a case has the key."""
    try:
        schema.locate(kind, key, content)
    except InputError:
        return False
    return True


def axes(
    over: Mapping[str, Any],
    sample: str,
    kind: Any,
    *,
    samples: int,
    seed: int,
    stages: Sequence[str] = (),
    content: Any = None,
) -> tuple[Axis, ...]:
    """The keys that vary, with their values.

    Parameters
    ----------
    over : mapping, of the study
    sample : str, of the study
    kind : pydantic model of the case
    samples, seed : int, of values that are drawn
    stages : sequence of str, names of the study's stages
    content : mapping, the case as it is written

    Raises
    ------
    InputError
        One sentence that names the key, its value and what is allowed.
    """
    if not over:
        raise InputError("over is missing; it must name the keys that vary, such as blade.nodes: [10, 20]")
    found = []
    drawn = _draws(sample, samples, len(over), seed)
    for k, (key, given) in enumerate(over.items()):
        stage, _, path = str(key).partition(".")
        stage = stage if stage in stages and not _is_known(kind, str(key), content) else ""
        reader, what = annotation(kind, path if stage else str(key), content)
        where = f"over.{key}"
        if drawn is not None:
            values = _spread(where, given, reader, drawn[:, k])
        elif isinstance(given, dict) and sample == "grid":
            values = _points(where, given, reader)
        elif isinstance(given, list) and given:
            values = given
        else:
            allowed = "a list of values, or {from, to, points}" if sample == "grid" else "a list of values"
            raise InputError(f"{where} is {schema.shown(given)}; with sample: {sample} it must be {allowed}")
        unit = getattr(reader, "unit", "")
        entry = str(key).rpartition(".")[2].isdecimal()
        found.append(Axis(key=str(key), values=tuple(values), unit=unit, what=what, stage=stage, entry=entry))
    lengths = {axis.key: len(axis.values) for axis in found}
    if sample == "list" and len(set(lengths.values())) > 1:
        listed = ", ".join(f"{key} has {n}" for key, n in lengths.items())
        raise InputError(f"the lists of 'over' must be equally long with sample: list, but {listed}")
    return tuple(found)


def _draws(sample: str, n: int, keys: int, seed: int) -> np.ndarray | None:
    """Numbers in (0, 1), one for each case and key; None where values are given."""
    if sample in ("grid", "list"):
        return None
    rng = np.random.default_rng(np.random.SeedSequence(seed))
    drawn = rng.random((n, keys))
    if sample == "latin-hypercube":
        order = np.stack([rng.permutation(n) for _ in range(keys)], axis=1)
        drawn = (order + drawn) / n
    return np.clip(drawn, 2.0**-53, 1.0 - 2.0**-53)


def _fields(where: str, given: Mapping[str, Any], *allowed: Sequence[str]) -> None:
    """Refuse keys other than those of one of the `allowed` forms."""
    known = {key for form in allowed for key in form}
    for key in given:
        if key not in known:
            raise InputError(f"unknown key '{where}.{key}'; {nearest(str(key), known)}")


def _number(where: str, given: Mapping[str, Any], key: str, reader: Any) -> float:
    """A number of a range, in the SI unit of the swept key."""
    if key not in given:
        raise InputError(f"{where}.{key} is missing; a range has a 'from' and a 'to'")
    value, unit = given[key], getattr(reader, "unit", "")
    problem = "it is not a finite number"
    try:
        if not isinstance(value, bool) and isinstance(value, (int, float, str)):
            number = units.parse(value, unit) if isinstance(value, str) else float(value)
            if math.isfinite(number):
                return number
    except OverflowError:
        pass
    except units.UnitError as error:
        problem = str(error)
    wanted = f"a number in {unit}, or with a unit of that kind" if unit else "a plain number"
    raise InputError(f"{where}.{key} is {schema.shown(value)}; it must be {wanted}; {problem}")


def _points(where: str, given: Mapping[str, Any], reader: Any) -> list[Any]:
    """Equally spaced points."""
    _fields(where, given, ("from", "to", "points", "spacing"))
    _numeric(where, reader)
    first, last = (_number(where, given, key, reader) for key in ("from", "to"))
    if "points" not in given:
        raise InputError(f"{where}.points is missing; it must be the number of points, such as 11")
    points = whole_number(given, "points", 0, least=1, most=MOST_CASES, where=f"{where}.")
    spacing = given.get("spacing", "linear")
    if spacing not in ("linear", "log"):
        raise InputError(f"{where}.spacing is {spacing!r}; it must be 'linear' or 'log'")
    if spacing == "linear":
        values = np.linspace(first, last, points)
    elif first > 0.0 and last > 0.0:
        values = np.geomspace(first, last, points)
    else:
        raise InputError(f"{where}.spacing is 'log', but the range from {first:g} to {last:g} is not above zero")
    return [int(v) if isinstance(reader, units.Whole) and v.is_integer() else float(v) for v in values]


def _spread(where: str, given: Any, reader: Any, drawn: np.ndarray) -> list[Any]:
    """Values of a distribution at the numbers `drawn` from (0, 1)."""
    _numeric(where, reader)
    if not isinstance(given, dict) or not ({"mean", "std"} & set(given) or {"from", "to"} & set(given)):
        raise InputError(
            f"{where} is {schema.shown(given)}; it must be {{from, to}} (uniform) or {{mean, std}} (normal)"
        )
    if {"mean", "std"} & set(given):
        from scipy.special import ndtri

        _fields(where, given, ("mean", "std"))
        mean, std = (_number(where, given, key, reader) for key in ("mean", "std"))
        if std < 0.0:
            raise InputError(f"{where}.std is {std:g}; it must not be below zero")
        values = mean + std * ndtri(drawn)
    else:
        _fields(where, given, ("from", "to"))
        first, last = (_number(where, given, key, reader) for key in ("from", "to"))
        if isinstance(reader, units.Whole):
            return [int(v) for v in np.floor(first + (last + 1.0 - first) * drawn)]
        values = first + (last - first) * drawn
    return [round(v) for v in values] if isinstance(reader, units.Whole) else [float(v) for v in values]


def _numeric(where: str, reader: Any) -> None:
    if reader is None:
        raise InputError(f"{where} takes words or lists, so it has no range; give a list of values")
