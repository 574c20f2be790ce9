"""CSV and its like, as `evolvent_base.tables` reads them."""

from __future__ import annotations

import functools

import numpy as np

from evolvent_base import tables
from evolvent_base.errors import InputError
from evolvent_base.signals.recording import Column
from evolvent_base.tables.cells import is_missing, is_number


def read(raw: bytes, name: str) -> tuple[list[Column], dict[str, str], list[str], tuple[str, ...]]:
    """Columns of a text, names of the others -> why they are left out, notes, to which reading adds, and all names.

    Columns of dates, clocks and counters that wrap are in s.

    Raises
    ------
    InputError
        If it is no table of numbers.
    """
    table = tables.read(raw, name)
    clock = tables.time_of(table)
    stamped = clock is not None and clock in table.stamps and table.rate is None
    times = table.names[clock] if stamped and clock is not None else ""
    found: list[Column] = []
    left: dict[str, str] = {}
    for k, own in enumerate(table.names):
        if k == clock or k in table.stamps:
            one = _time(table, k)
            if k == clock or one.unit != "s" or np.ptp(one.samples()) > 0.0:
                found.append(one)
            else:
                left[own] = "it holds dates"
            continue
        why = "" if table.is_numeric(k + 1) else _words(table, k)
        if why.startswith("no cell"):
            left[own] = why
        else:
            samples = functools.partial(_refuse if why else _numbers, table, k, why)
            found.append(
                Column(own, table.rows, samples, table.units[k], table.rate, table.start, times, table.heads[k])
            )
    if not found or (left and all(one.name in _clocks(table, clock) for one in found)):
        raise InputError(f"cannot read {name!r}: no column of it holds numbers")
    return found, left, table.notes, table.names


def _clocks(table: tables.TextTable, clock: int | None) -> list[str]:
    return [table.names[k] for k in {*table.stamps, *(() if clock is None else (clock,))}]


def _time(table: tables.TextTable, place: int) -> Column:
    """A column of times: as it stands, but for dates, clocks, counters that wrap and counts since 1970."""
    made = functools.partial(Column, table.names[place], table.rows, path=table.heads[place])
    try:
        times = tables.seconds(table, place + 1)
    except InputError:
        return made(functools.partial(_seconds, table, place), "s")
    if place not in table.stamps and set(times.notes) <= {tables.NO_UNIT}:
        return made(functools.partial(table.numbers, place + 1), table.units[place])
    return made(lambda: times.start + times.seconds, "s", notes=times.notes)


def _seconds(table: tables.TextTable, place: int) -> np.ndarray:
    times = tables.seconds(table, place + 1)
    return times.start + times.seconds


def _words(table: tables.TextTable, place: int) -> str:
    """What a column holds in place of numbers; '' where its numbers are at fault."""
    if table.is_empty(place + 1):
        return "no cell holds anything"
    cells = table.words(place + 1)
    if not any(map(is_number, cells)):
        return "no cell holds a number"
    wrong = [k for k, cell in enumerate(cells) if not is_number(cell) and not is_missing(cell)]
    if not wrong:
        return ""
    return (
        f"{len(wrong)} of its {len(cells)} cells are words, the first in line {table.line(wrong[0])}: "
        f"{cells[wrong[0]][:40]!r}"
    )


def _numbers(table: tables.TextTable, place: int, why: str) -> np.ndarray:
    return table.numbers(place + 1)


def _refuse(table: tables.TextTable, place: int, why: str) -> np.ndarray:
    raise InputError(
        f"the column {table.names[place]!r} of {table.path!r} is no signal: {why}; correct it, or name the columns "
        "that are signals under signals.sensors"
    )
