"""CSV and its like, as `evolvent.base.tables` reads them."""

from __future__ import annotations

import functools

import numpy as np

from evolvent.base import tables
from evolvent.base.errors import InputError
from evolvent.base.tables.cells import is_missing, is_number
from evolvent.massprops.signals.recording import Column


def read(raw: bytes, name: str) -> tuple[list[Column], dict[str, str], list[str]]:
    """Columns of a text, names of the others -> why they are left out, and notes, to which reading adds.

    Columns of dates, clocks and counters that wrap are in s.

    Raises
    ------
    InputError
        If it is no table of numbers.
    """
    table = tables.read(raw, name)
    clock = tables.time_of(table)
    found: list[Column] = []
    left: dict[str, str] = {}
    for k, own in enumerate(table.names):
        stated = {"rate": table.rate, "start": table.start, "times": _times_of(table, k, clock), "path": table.heads[k]}
        if k == clock or k in table.stamps:
            found.append(_time(table, k))
        elif table.is_empty(k + 1):
            left[own] = "no cell holds anything"
        elif table.is_numeric(k + 1):
            samples = functools.partial(table.numbers, k + 1)
            found.append(Column(own, table.rows, samples, table.units[k], **stated))  # type: ignore[arg-type]
        else:
            why = _words(table, k)
            if not why:
                left[own] = "no cell holds a number"
            else:
                refuse = functools.partial(_refuse, table, k, why)
                found.append(Column(own, table.rows, refuse, table.units[k], **stated))  # type: ignore[arg-type]
    if not found or (left and all(one.name in _clocks(table, clock) for one in found)):
        raise InputError(f"cannot read {name!r}: no column of it holds numbers")
    return found, left, table.notes


def _clocks(table: tables.Table, clock: int | None) -> list[str]:
    return [table.names[k] for k in {*table.stamps, *(() if clock is None else (clock,))}]


def _times_of(table: tables.Table, place: int, clock: int | None) -> str:
    """The column that holds the times of another one where no name is guessed; '' else.

    It is that of dates and clocks, and of several with equal heads the one before.
    """
    if clock is None or table.rate is not None:
        return ""
    same = [k for k, head in enumerate(table.heads) if head == table.heads[clock]]
    before = [k for k in same if k < place]
    if clock in table.stamps or (len(same) > 1 and before):
        return table.names[before[-1] if before else clock]
    return ""


def _time(table: tables.Table, place: int) -> Column:
    """A column of times: as it stands, but for dates, clocks, counters that wrap and counts since 1970."""
    made = functools.partial(Column, table.names[place], table.rows, path=table.heads[place])
    try:
        times = tables.seconds(table, place + 1)
    except InputError:
        return made(functools.partial(_seconds, table, place), "s")
    if place not in table.stamps and set(times.notes) <= {tables.NO_UNIT}:
        return made(functools.partial(table.numbers, place + 1), table.units[place])
    return made(lambda: times.start + times.seconds, "s", notes=times.notes)


def _seconds(table: tables.Table, place: int) -> np.ndarray:
    times = tables.seconds(table, place + 1)
    return times.start + times.seconds


def _words(table: tables.Table, place: int) -> str:
    """What a column holds in place of numbers; '' where no cell is one."""
    cells = table.words(place + 1)
    wrong = [k for k, cell in enumerate(cells) if not is_number(cell) and not is_missing(cell)]
    if not any(map(is_number, cells)):
        return ""
    if not wrong:
        return "its numbers cannot be told"
    return (
        f"{len(wrong)} of its {len(cells)} cells are words, the first in line {table.line(wrong[0])}: "
        f"{cells[wrong[0]][:40]!r}"
    )


def _refuse(table: tables.Table, place: int, why: str) -> np.ndarray:
    if "words" not in why:
        return table.numbers(place + 1)
    raise InputError(
        f"the column {table.names[place]!r} of {table.path!r} is no signal: {why}; correct it, or name the columns "
        "that are signals under signals.sensors"
    )
