"""CSV and its like, as `evolvent.base.tables` reads them."""

from __future__ import annotations

import numpy as np

from evolvent.base import tables
from evolvent.base.errors import InputError
from evolvent.base.tables.cells import is_missing, is_number
from evolvent.massprops.signals.recording import Words


def read_text(raw: bytes, name: str) -> tuple[dict[str, np.ndarray], dict[str, str], float | None, dict[str, Words]]:
    """Columns and units of a text, its rate, and its columns of words. Times of dates and clocks are in s.

    Raises
    ------
    InputError
        If it is no table of numbers.
    """
    table = tables.read(raw, name)
    units = dict(zip(table.names, table.units, strict=True))
    columns: dict[str, np.ndarray] = {}
    left_out: dict[str, Words] = {}
    clock, empty = tables.time_of(table), False
    for k, column in enumerate(table.names):
        if k == clock:
            columns[column], units[column] = _times(table, k)
        elif table.is_empty(k + 1):
            empty = empty or bool(table.heads[k])
        else:
            try:
                columns[column] = table.numbers(k + 1)
            except InputError:
                found = _words(table, k)
                if not found.words:
                    raise
                left_out[column] = found
    if not columns or (len(columns) == 1 and clock is not None and empty):
        raise InputError(f"cannot read {name!r}: no column of it holds numbers")
    return columns, units, table.rate, left_out


def _times(table: tables.Table, place: int) -> tuple[np.ndarray, str]:
    """A column of times and its unit: as it stands, but for dates, clocks and counters that wrap, which are in s."""
    if place not in table.stamps and len(table.numbers(place + 1)) < 2:
        return table.numbers(place + 1), table.units[place]
    times = tables.seconds(table, place + 1)
    if place not in table.stamps and set(times.notes) <= {tables.NO_UNIT}:
        return table.numbers(place + 1), table.units[place]
    return times.start + times.seconds, "s"


def _words(table: tables.Table, place: int) -> Words:
    cells = table.words(place + 1)
    numbers = [is_number(cell) for cell in cells]
    wrong = [k for k, cell in enumerate(cells) if not numbers[k] and not is_missing(cell)]
    first = wrong[0] if wrong else 0
    return Words(len(wrong), len(cells), sum(numbers), table.line(first), cells[first][:40])
