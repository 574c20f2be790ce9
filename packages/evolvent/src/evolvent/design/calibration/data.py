"""Measured data: values of observed variables, and where in the runs of a case they were measured.

Three kinds of files are read. A **history** has a column of times and one for each observed variable: one run is
compared with it at these times. A **table of runs** has columns named by keys of the case and one for each observed
variable: each row is its own run with these keys. A **log** is in a form that a system reads itself
(`SystemDefinition.measurements`). Only the columns that are named are read.
"""

from __future__ import annotations

import difflib
import os
import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from evolvent import cases
from evolvent.design.calibration import histories
from evolvent.results.measurements import Measurements, Series
from evolvent_base import safe_open, schema, signals, tables, units
from evolvent_base.errors import InputError, nearest
from evolvent_base.signals import timebase

Array = np.ndarray
#: How much a name is like a key that is taken to be meant.
_NEAR = 0.75


def read(path: str, case: Any, observed: Sequence[str]) -> Measurements:
    """The measured values of variables of a case.

    Parameters
    ----------
    path : str, a file, or the name of one of the system's own `data_files`
    case : name, file or content of a case
    observed : names of variables, each "NAME" or "NAME=COLUMN"

    Raises
    ------
    InputError
        For columns and units that do not fit.
    """
    content = cases.content_of(case)
    pairs = [(name.strip(), column.strip() or name.strip()) for name, _, column in (o.partition("=") for o in observed)]
    system = cases.system_of(content)
    if not os.path.exists(path):
        path = system.data_files.get(path, path)
    found = system.measurements(path, content, [name for name, _ in pairs])
    if isinstance(found, Measurements):
        return found
    table = opened(path)
    columns = [_Observed(name, place(table, column, "--observe NAME=COLUMN")) for name, column in pairs]
    clock = clock_of(table)
    keys = _keys(table, {clock, *(one.place for one in columns)}, content)
    if keys and (clock is None or clock in table.stamps):
        return _runs(table, content, columns, keys)
    return _history(table, clock, columns)


class _Observed(NamedTuple):
    """A variable and the place of its column."""

    name: str
    place: int


class _Recording:
    """Columns of a file that is no text, as those of a table."""

    def __init__(self, found: signals.Signals) -> None:
        self.names, self.heads, self.units, self.path = found.names, found.names, found.units, found.path
        self.stamps: tuple[int, ...] = ()
        self.notes: list[str] = list(found.notes)
        self.source = found

    @property
    def rows(self) -> int:
        """Number of rows of all columns together."""
        return len(self.source.data)

    def numbers(self, column: int) -> Array:
        """Samples of a column by its number from 1."""
        return self.source.column(column)

    def is_empty(self, column: int) -> bool:
        """Whether a column holds no number."""
        return not np.isfinite(self.numbers(column)).any()

    def line(self, row: int) -> int:
        """Number of a row, from 1."""
        return row + 1


def opened(path: str) -> Any:
    """The columns of a text file, or of a recording."""
    raw = safe_open.content(path)
    return tables.read(raw, path) if signals.is_text(raw, path) else _Recording(signals.read(path))


def clock_of(table: Any) -> int | None:
    """Place of the column of times of a text file; None where there is none, and of a recording."""
    return tables.time_of(table) if isinstance(table, tables.TextTable) else None


def place(table: Any, column: str, option: str) -> int:
    """Place of a column by its name, by its whole head, or by a name and unit written in another way.

    Parameters
    ----------
    option : str, with which the user names it, for messages
    """
    bare = [units.head_and_unit(head)[0] if head else name for head, name in zip(table.heads, table.names, strict=True)]
    name, unit = units.head_and_unit(column)
    whole = [k for k, head in enumerate(table.heads) if head == column]
    same = [k for k, own in enumerate(bare) if own == name and unit in ("", table.units[k])]
    found = whole or [k for k, own in enumerate(table.names) if own == column and bare.count(own) < 2] or same
    if len(found) == 1:
        return found[0]
    if found:
        listed = " and ".join(repr(table.heads[k]) for k in found)
        raise InputError(
            f"{table.path!r} has {len(found)} columns {column!r}: {listed}; write {option} with the whole head of one"
        )
    raise InputError(f"{table.path!r} has no column {column!r}; {nearest(column, table.names)}; or write {option}")


def _sentences(notes: Sequence[str]) -> list[str]:
    return [f"{note[0].upper()}{note[1:]}." for note in notes]


# ------------------------------------------------------------------------------------------------ histories


def _history(table: Any, clock: int | None, columns: Sequence[_Observed]) -> Measurements:
    notes: list[str] = []
    series = []
    for name, place in columns:
        column, unit = table.names[place], table.units[place]
        time = times(table, clock, place, notes, "--observe")
        if not unit:
            notes.append(f"The column {column!r} states no unit; its values are taken in that of {name}.")
        history = histories.History(table, column, unit, time, table.numbers(place + 1))
        at, values = history.cleaned(notes)
        labels = tuple(f"{t:.6g} s" for t in at)
        series.append(Series(name=name, unit=unit, values=values, labels=labels, times=histories.fixed(at)))
    notes = list(dict.fromkeys((*_sentences(table.notes), *notes)))
    return Measurements(source=table.path, series=tuple(series), notes=tuple(notes))


def times(table: Any, clock: int | None, place: int, notes: list[str], option: str) -> Array:
    """Times of the values of a column, s; `option` names it in messages."""
    if isinstance(table, _Recording):
        base = timebase.choose(table.source, [(place + 1, option)], time=None, rate=None)
        notes += _sentences(base.notes)
        if base.time is not None:
            return base.time
        assert base.rate is not None
        return np.asarray(base.start + np.arange(table.source.columns[place].size) / base.rate)
    if clock is None and table.rate is not None:
        return np.asarray(table.start + np.arange(table.rows) / table.rate)
    if clock is None:
        raise InputError(
            f"{table.path!r} has neither a column 'time' nor columns named by keys of the case; one of them must say "
            f"what each row belongs to; its columns are {', '.join(map(repr, table.names))}"
        )
    found = tables.seconds(table, clock + 1, fine=False)
    notes += _sentences([note for note in found.notes if not note.startswith("the time steps back")])
    return np.asarray(found.start + found.seconds)


# ------------------------------------------------------------------------------------------------ tables of runs


def _keys(table: Any, others: set[int | None], content: Mapping[str, Any]) -> list[int]:
    """Places of the columns that are named by keys of the case."""
    kind = cases.system(content["system"]).Case
    found = []
    for place, name in enumerate(table.names):
        if name.partition(".")[0] not in kind.model_fields:
            continue
        try:
            schema.locate(kind, name, content)
        except InputError:
            continue
        found += [place] if place not in others else []
    return found


def _runs(
    table: tables.TextTable, content: Mapping[str, Any], columns: Sequence[_Observed], keys: Sequence[int]
) -> Measurements:
    kind = cases.system(content["system"]).Case
    notes = []
    for place in sorted({*range(len(table.names))} - {*keys, *(one.place for one in columns)}):
        name = table.names[place]
        if re.search(r"\w\.\w", name) or difflib.get_close_matches(name, kind.model_fields, cutoff=_NEAR):
            schema.locate(kind, name, content)  # a key that is misspelt
        if not table.is_empty(place + 1):
            notes.append(f"The column {name!r} is no key of the case and is not used.")
    given: list[dict[str, Any]] = [{} for _ in range(table.rows)]
    for place in keys:
        key, unit = table.names[place], _unit_of_key(table, place, schema.locate(kind, table.names[place], content))
        for row, number in zip(given, _whole(table, place, "every row sets every key"), strict=True):
            row[key] = f"{number!r} {unit}" if unit else number
    labels = tuple(", ".join(f"{key} {value}" for key, value in row.items()) for row in given)
    series = []
    for name, place in columns:
        values = np.array(_whole(table, place, "every row has one"))
        series.append(Series(name=name, unit=table.units[place], values=values, labels=labels))
    return Measurements(
        source=table.path, series=tuple(series), rows=tuple(given), notes=(*_sentences(table.notes), *notes)
    )


def _whole(table: Any, place: int, why: str) -> list[float]:
    """Values of a column, none of which is missing."""
    values = table.numbers(place + 1)
    wrong = np.flatnonzero(~np.isfinite(values))
    if wrong.size:
        line = table.line(int(wrong[0]))
        raise InputError(f"the column {table.names[place]!r} of {table.path!r} lacks a value in line {line}; {why}")
    return [float(value) for value in values]


def _unit_of_key(table: Any, place: int, located: schema.Located) -> str:
    """The unit of a column in the spelling of case files."""
    text = table.units[place]
    marks = [getattr(mark, "quantity", mark) for _, own in located.types for mark in own]
    kinds = [one for mark in marks for one in getattr(mark, "quantities", (mark,))]
    wanted = [one.unit for one in kinds if isinstance(one, units.Quantity)]
    try:
        return units.file_unit(text, *wanted)
    except units.UnitError as error:
        raise InputError(f"the column {table.heads[place]!r} of {table.path!r}: {error}") from None
