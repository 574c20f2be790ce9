"""The keys that vary in a study, and their values: given, spaced or drawn."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from evolvent.design.studies import distributions, draws, measured
from evolvent_base import schema, units
from evolvent_base.errors import InputError

#: Most cases that a study may have; every one is checked before the first is run.
MOST_CASES = 1_000_000
#: Letters of a distribution, above which a table is stated by its first and last value.
_LONG = 160


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
    draw : int, which draw its values follow; keys of one draw vary together
    text : str, the distribution as the study states it; '' of values that are given
    """

    key: str
    values: tuple[Any, ...]
    unit: str
    what: str
    stage: str = ""
    entry: bool = False
    draw: int = 0
    text: str = ""

    @property
    def path(self) -> str:
        """Key of the case."""
        return self.key.removeprefix(f"{self.stage}.") if self.stage else self.key

    def written(self, place: int) -> Any:
        """The value at an index as a case holds it."""
        return written(self.values[place], self.unit, entry=self.entry)


def written(value: Any, unit: str, *, entry: bool) -> Any:
    """A value of a key as a case holds it: the entry of a list with its unit, whose others may have another one."""
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    return f"{value!r} {unit}" if entry and unit and is_number else value


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


def annotation(kind: Any, key: str, content: Any = None, *, called: str = "over") -> tuple[Any, str]:
    """What reads a key's value (`units.Quantity`, `units.Whole` or None), and what the key is.

    Parameters
    ----------
    kind : pydantic model of the case
    key : str, dotted
    content : mapping, the case as it is written; keys of its parts depend on their kinds
    called : str, what names the key, for messages

    Raises
    ------
    InputError
        If the case has no such key.
    """
    try:
        found = schema.locate(kind, key, content)
    except InputError as error:
        raise InputError(f"{called}: {error}") from None
    reader = next((one for _, marks in found.types for mark in marks if (one := _reader(mark, found.entry))), None)
    what = str(getattr(reader, "what", "")).removeprefix("a ").removeprefix("an ")
    return reader, found.text or what or key


def _reader(mark: Any, entry: bool) -> units.Quantity | units.Whole | None:
    """What reads one number of a key with such an annotation; None where the key takes none."""
    if isinstance(mark, (units.OneOrMore, units.Tensor)) or (isinstance(mark, units.Vector) and entry):
        mark = mark.quantity
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
    correlation: Any = None,
    nominal: Callable[[str], Any] = lambda path: None,
    tables: measured.Tables | None = None,
) -> tuple[Axis, ...]:
    """The keys that vary, with their values.

    Parameters
    ----------
    over : mapping, of the study; where values are drawn, keys joined by commas share one draw
    sample : str, of the study
    kind : pydantic model of the case
    samples, seed : int, of values that are drawn
    stages : sequence of str, names of the study's stages
    content : mapping, the case as it is written
    correlation : of the study, list of [key, key, value]
    nominal : function of a key of the case that returns its value in the case
    tables : the files that distributions may name

    Raises
    ------
    InputError
        One sentence that names the key, its value and what is allowed.
    """
    if not over:
        raise InputError("over is missing; it must name the keys that vary, such as blade.nodes: [10, 20]")
    drawn = sample in draws.DRAWN
    found: list[Axis] = []
    spread: list[distributions.Distribution] = []
    for group, (names, given) in enumerate(over.items()):
        for key in [one.strip() for one in str(names).split(",")] if drawn else [str(names)]:
            stage, _, path = key.partition(".")
            stage, path = (stage, path) if stage in stages and not _is_known(kind, key, content) else ("", key)
            reader, what = annotation(kind, path, content)
            where = f"over.{key}"
            if key in [axis.key for axis in found]:
                raise InputError(f"over names {key!r} twice; a key varies in one way")
            values: Sequence[Any] = ()
            if drawn:
                spread.append(distributions.read(where, given, reader, functools.partial(nominal, path), tables))
            else:
                values = _given(where, given, reader, sample)
            found.append(
                Axis(
                    key=key,
                    values=tuple(values),
                    unit=getattr(reader, "unit", ""),
                    what=what,
                    stage=stage,
                    entry=key.rpartition(".")[2].isdecimal(),
                    draw=group,
                    text=_shown(given) if drawn else "",
                )
            )
    lengths = {axis.key: len(axis.values) for axis in found}
    if sample == "list" and len(set(lengths.values())) > 1:
        listed = ", ".join(f"{key} has {n}" for key, n in lengths.items())
        raise InputError(f"the lists of 'over' must be equally long with sample: list, but {listed}")
    return tuple(_drawn(found, spread, sample, samples, seed, correlation) if drawn else found)


def _drawn(
    found: Sequence[Axis],
    spread: Sequence[distributions.Distribution],
    sample: str,
    samples: int,
    seed: int,
    correlation: Any,
) -> list[Axis]:
    """The axes with the values that are drawn."""
    size = 1 + max(axis.draw for axis in found)
    matrix = draws.correlation_matrix(correlation, {axis.key: axis.draw for axis in found}, size)
    draws.check(sample, samples, size, matrix is not None)
    cases = draws.count(sample, samples, size)
    if cases > MOST_CASES:
        raise InputError(f"the study has {cases:.3g} cases; at most {MOST_CASES} are possible")
    u = draws.probabilities(sample, samples, size, seed, matrix)
    listed = []
    for axis, one in zip(found, spread, strict=True):
        own = u[:, axis.draw]
        values = [one.ends()[int(end)] for end in own] if sample == "corners" else one.quantiles(own)
        listed.append(dataclasses.replace(axis, values=tuple(values)))
    return listed


def _shown(given: Any) -> str:
    """A distribution as the study states it."""
    if isinstance(given, Mapping):
        kind = "normal" if "mean" in given else "uniform"
        return f"{kind}({', '.join(str(given[key]) for key in given)})"
    text, values = str(given), str(given).count(",") + 1
    if len(text) > _LONG:  # a table of many values
        text = f"{text[: text.find(',')]}, ... {text[text.rfind(',') + 2 : -1]}), {values} values"
    return text


def _given(where: str, given: Any, reader: Any, sample: str) -> Sequence[Any]:
    """Values that a study lists, or equally spaced ones."""
    if isinstance(given, dict) and sample == "grid":
        return _points(where, given, reader)
    if isinstance(given, list) and given:
        return given
    allowed = "a list of values, or {from, to, points}" if sample == "grid" else "a list of values"
    raise InputError(f"{where} is {schema.shown(given)}; with sample: {sample} it must be {allowed}")


def _points(where: str, given: Mapping[str, Any], reader: Any) -> list[Any]:
    """Equally spaced points."""
    distributions.check_fields(where, given, ("from", "to", "points", "spacing"))
    _numeric(where, reader)
    first, last = (distributions.number(where, given, key, reader) for key in ("from", "to"))
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


def _numeric(where: str, reader: Any) -> None:
    if reader is None:
        raise InputError(f"{where} takes words or lists, so it has no range; give a list of values")


def value_at(case: Any, key: str) -> Any:
    """Value of a dotted key of a checked case, as JSON can hold it.

    Raises
    ------
    InputError
        If the case gives nothing there.
    """
    try:
        return _value_at(case, key)
    except (LookupError, TypeError, ValueError):
        raise InputError(f"the case gives nothing at {key!r}; 'evolvent show FILE' prints its keys") from None


def _value_at(case: Any, key: str) -> Any:
    place, choice = case, None
    for name in key.split("."):
        if choice is not None and name in choice.kinds:
            only = list(choice.kinds[name].model_fields)
            place, choice = (getattr(place, only[0]) if key.endswith(f".{name}") and len(only) == 1 else place), None
        elif isinstance(place, Mapping):
            place, choice = place[schema.member(place, name)], None
        elif isinstance(place, units.Turned) and name in place.given:
            place, choice = place.given[name], None
        elif isinstance(place, schema.Section):
            field = type(place).model_fields[name]
            place, choice = (
                getattr(place, name),
                next((m for m in schema.marks(field) if isinstance(m, schema.OneOf)), None),
            )
        else:
            place, choice = place[int(name)], None
    return choice.write(place) if choice is not None and place is not None else _as_json(place)


def _as_json(value: Any) -> Any:
    """A value of a checked case as JSON can hold it."""
    if isinstance(value, schema.Section):
        return value.model_dump(mode="json")
    if isinstance(value, Mapping):
        return {name: _as_json(one) for name, one in value.items()}
    return [_as_json(one) for one in value] if isinstance(value, tuple) else value
