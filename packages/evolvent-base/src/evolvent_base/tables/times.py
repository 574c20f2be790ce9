"""Seconds of a column of times: numbers with and without a unit, stamps, clocks, counters that wrap."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from evolvent_base.errors import InputError
from evolvent_base.tables import stamps, words
from evolvent_base.tables.cells import is_missing
from evolvent_base.tables.table import TextTable

#: What is said of times without a unit.
NO_UNIT = "the time states no unit: taken in s"
#: Seconds since 1970 that times in these units may be, 2001 to 2096; s -> name of the unit.
_EPOCH, _EPOCH_UNITS = (1.0e9, 4.0e9), {1.0: "s", 1e-3: "ms", 1e-6: "us", 1e-9: "ns"}
#: Days since 1900 of a spreadsheet's date, 1982 to 2119, and their longest usual step, days.
_SERIAL, _SERIAL_STEP = (30_000.0, 80_000.0), 2e-4
#: Bits of counters, and the units of what they count in s, beside the column's own.
_BITS, _COUNTED = (16, 24, 32), (1e-6, 1e-3)
#: Steps, in usual ones, that may be lost where a counter wraps.
_LOST = 20.0
#: How many times longer the longest step is if day and month are taken for one another, at least.
_TOLD = 10.0
#: Share of rows with the time of the row before above which the times are too coarse, and of a step.
_EQUAL, _COARSE = 0.2, 0.1


class Times(NamedTuple):
    """Times of the rows.

    Attributes
    ----------
    seconds : (N,) from the first row that has one, NaN where a row has none
    start : s, the time of that row by the file; 0 of dates and clocks
    notes : sentences on what the file leaves open
    """

    seconds: np.ndarray
    start: float
    notes: tuple[str, ...]


def time_of(table: TextTable) -> int | None:
    """Index of the column of times: by its name, or the only one with dates or clocks; None where there is none."""

    def rises(place: int) -> bool:
        try:
            steps = np.diff(table.numbers(place + 1))
        except InputError:
            return False
        return bool(steps.size) and bool(np.all(steps > 0.0))

    found = words.find_time(table.names, table.units, rises)
    if found is not None and not _varies(table, found):
        others = [k for k in words.time_columns(table.names, table.units) if _varies(table, k)]
        found = others[0] if others else None if table.is_empty(found + 1) else found
    if found is None and len(table.stamps) == 1:
        return table.stamps[0]
    if found is not None and table.rate is not None and found not in table.stamps:
        is_other = table.names[found] == "T" and not table.units[found]  # a temperature beside a stated rate
        if is_other or not rises(found):  # or segments that begin at 0 each
            return None
    return found


def _varies(table: TextTable, place: int) -> bool:
    """Whether a column holds different values: one that does not is a start or a step."""
    try:
        values = table.numbers(place + 1)
    except InputError:
        return True
    known = values[np.isfinite(values)]
    return bool(known.size) and (table.rows == 1 or bool(np.any(known != known[0])))


def seconds(table: TextTable, column: str | int | Sequence[str | int], *, fine: bool = True) -> Times:
    """Seconds of a column of times, or of a column of dates and one of clocks.

    Parameters
    ----------
    column : name, number from 1, or two of them; a column of clocks takes the dates of a column "date" beside it
    fine : whether times of which many are equal are refused

    Raises
    ------
    InputError
        If its cells are no times, are too coarse, or may mean different times.
    """
    columns = [column] if isinstance(column, (str, int)) else list(column)
    places = [table.index(one) for one in columns]
    found = _seconds(table, places)
    if fine:
        _check_fine(table, table.names[places[0]], found.seconds[np.isfinite(found.seconds)])
    return found


def _seconds(table: TextTable, places: list[int]) -> Times:
    if len(places) > 1 or places[0] in table.stamps:
        return _stamped(table, places)
    try:
        values = table.numbers(places[0] + 1)
    except InputError:
        if any(not is_missing(cell) and stamps.cells_of([cell]).wrong < 0 for cell in table.words(places[0] + 1)[:50]):
            return _stamped(table, places)
        raise
    return _counted(table, places[0], values)


# ------------------------------------------------------------------------------------------------ numbers


def _counted(table: TextTable, place: int, values: np.ndarray) -> Times:
    name = table.names[place]
    known = np.flatnonzero(np.isfinite(values))
    if not known.size:
        raise InputError(f"{table.path!r} holds no time in column {name!r}")
    first = float(values[known[0]])
    offset = values - first
    if abs(first) > 2.0**53:
        offset = _exact(table, place, values)
    notes: list[str] = []
    factor = _factor(table, place, values[known], notes)
    offset = _unwrapped(offset, values, factor, name, notes)
    back = np.flatnonzero(np.diff(offset[known]) < 0.0)
    if back.size:
        row = int(known[back[0] + 1])
        notes.append(
            f"the time steps back in line {table.line(row)}, from {values[known[back[0]]]:.9g} to {values[row]:.9g}"
        )
    is_epoch = _EPOCH[0] <= first * factor < _EPOCH[1] or factor == stamps.DAY
    if is_epoch:
        notes.append(f"the times count from the first row, which has {_cell(table, place, int(known[0]))}")
    return Times(offset * factor, 0.0 if is_epoch else first * factor, tuple(notes))


def _exact(table: TextTable, place: int, values: np.ndarray) -> np.ndarray:
    """Differences of whole numbers that are larger than floats hold exactly."""
    try:
        whole = [None if is_missing(cell) else int(cell) for cell in table.words(place + 1)]
    except ValueError:
        return values - values[np.flatnonzero(np.isfinite(values))[0]]
    first = next(one for one in whole if one is not None)
    return np.array([np.nan if one is None else float(one - first) for one in whole])


def _factor(table: TextTable, place: int, values: np.ndarray, notes: list[str]) -> float:
    """Seconds in the unit of a column."""
    name, unit = table.names[place], table.units[place]
    if unit and not words.is_form(unit):
        factor = words.factor(unit)
        if factor is None:
            raise InputError(
                f"the column {name!r} of {table.path!r} has the unit {unit!r}; a time is in s, ms, us or min"
            )
        return factor
    own = words.factor(words.own_unit(name))
    if own is not None:
        return own
    first, last = float(values[0]), float(values[-1])
    step = float(np.median(np.diff(values))) if len(values) > 1 else 0.0
    for factor, symbol in _EPOCH_UNITS.items():
        low, high = _EPOCH[0] / factor, _EPOCH[1] / factor
        if low <= first < high and low <= last < high and (symbol != "s" or step < 1000.0):
            notes.append(f"the time states no unit: by its size it counts {symbol} since 1970")
            return factor
    if _SERIAL[0] <= first <= last <= _SERIAL[1] and 0.0 < step < _SERIAL_STEP and last - first < 30.0:
        _check_serial(table, place, step, notes)
        return stamps.DAY
    notes.append(NO_UNIT)
    return 1.0


def _check_serial(table: TextTable, place: int, step: float, notes: list[str]) -> None:
    digits = max(len(cell.replace(",", ".").partition(".")[2]) for cell in table.words(place + 1)[:200])
    resolved = 10.0**-digits
    if resolved > _COARSE * step:
        raise InputError(
            f"the times of {table.path!r} are days of a spreadsheet with {digits} decimals, which resolve "
            f"{resolved * stamps.DAY:.2g} s of steps of {step * stamps.DAY:.2g} s; write them with more decimals, "
            "in s, or state the rate instead"
        )
    notes.append(
        f"the time states no unit: by its size it counts days as a spreadsheet does, to {resolved * stamps.DAY:.2g} s"
    )


def _unwrapped(offset: np.ndarray, values: np.ndarray, factor: float, name: str, notes: list[str]) -> np.ndarray:
    """Offsets with the range of a counter added where it wraps; other steps back are left."""
    known = np.flatnonzero(np.isfinite(offset))
    steps = np.diff(offset[known])
    backs = np.flatnonzero(steps < 0.0)
    forward = steps[steps > 0.0]
    if not backs.size or not forward.size:
        return offset
    usual = float(np.median(forward))
    finite = values[known]
    ranges = {2.0**bits: f"2^{bits}" for bits in _BITS}
    ranges |= {
        2.0**bits * unit / factor: f"2^{bits} {'us' if unit == 1e-6 else 'ms'}"
        for bits in (16, 32)
        for unit in _COUNTED
        if unit < factor
    }
    for size, text in sorted(ranges.items()):
        low = 0.0 if finite.min() >= 0.0 else -0.5 * size
        fits = np.ptp(finite) > 0.5 * size and np.all((finite >= low) & (finite <= low + size * (1.0 + 1e-9)))
        over = steps[backs] + size
        if fits and np.all((over > -1e-9 * size) & (over <= _LOST * usual)) and usual < 0.5 * size:
            added = np.zeros(len(offset))
            for back in backs:
                added[known[back + 1] :] += size
            notes.append(f"the counter {name!r} wraps at {text} {'once' if backs.size == 1 else f'{backs.size} times'}")
            return offset + added
    return offset


def _check_fine(table: TextTable, name: str, offset: np.ndarray) -> None:
    """Refuse times of which many are equal."""
    steps = np.diff(offset)
    equal = np.count_nonzero(steps == 0.0)
    if steps.size > equal > _EQUAL * steps.size:
        raise InputError(
            f"the times of {table.path!r} in column {name!r} are too coarse: {equal} of {len(offset)} rows have "
            "that of the row before; state the rate instead"
        )


# ------------------------------------------------------------------------------------------------ stamps


def _stamped(table: TextTable, places: list[int]) -> Times:
    found = []
    for place in places:
        cells = _read(table, place)
        found.append((place, cells))
    clock = next(((place, cells) for place, cells in found if cells.clock is not None), None)
    date = next((cells for _, cells in found if cells.days), None)
    beside = words.find_date(table.names) if date is None and clock is not None else None
    if beside is not None:
        cells = stamps.cells_of(table.words(beside + 1))
        date = cells if cells.wrong < 0 and cells.days and cells.clock is None else None
        beside = None if date is None else beside
    if clock is None:
        clock = _clock_beside(table, places)
    place = clock[0] if clock else found[0][0]
    name = table.names[place]
    notes: list[str] = []
    of_day = np.zeros(table.rows) if clock is None else _of_day(table, place, clock[1])
    offset = _over_midnight(of_day) if date is None else _dated(table, name, date.days, of_day)
    known = np.flatnonzero(np.isfinite(offset))
    if not known.size:
        raise InputError(f"{table.path!r} holds no time in column {name!r}")
    back = np.flatnonzero(np.diff(offset[known]) < 0.0)
    if back.size:
        notes.append(f"the time steps back in line {table.line(int(known[back[0] + 1]))}")
    row = int(known[0])
    shown = " ".join(_cell(table, k, row) for k in ([] if beside is None else [beside]) + places)
    notes.append(f"the times count from the first row, which has {shown}")
    return Times(offset - offset[row], 0.0, tuple(notes))


def _cell(table: TextTable, place: int, row: int) -> str:
    return table.cell(place + 1, row)


def _clock_beside(table: TextTable, places: list[int]) -> tuple[int, stamps.Cells] | None:
    """A column of times of day beside dates, where there is one such column."""
    others = [(k, stamps.cells_of(table.words(k + 1))) for k in table.stamps if k not in places]
    clocks = [(k, cells) for k, cells in others if cells.wrong < 0 and cells.clock is not None and not cells.days]
    if len(clocks) == 1:
        places.append(clocks[0][0])
        return clocks[0]
    return None


def _read(table: TextTable, place: int) -> stamps.Cells:
    texts = table.words(place + 1)
    cells = stamps.cells_of(texts)
    if cells.wrong >= 0:
        raise InputError(
            f"cannot read {table.path!r}: line {table.line(cells.wrong)} holds {texts[cells.wrong][:40]!r} in column "
            f"{table.names[place]!r}, where a time must be, such as 10:00:00.5 or 2026-11-28T10:00:00.5"
        )
    return cells


def _of_day(table: TextTable, place: int, cells: stamps.Cells) -> np.ndarray:
    """Seconds of a clock; of two numbers they may be hours and minutes, or minutes and seconds."""
    assert cells.clock is not None
    if "hm" not in cells.forms:
        return cells.clock
    unit = table.units[place].lower().replace(" ", "")
    texts = table.words(place + 1)
    short = np.array([cell.count(":") == 1 and "." not in cell and "," not in cell for cell in texts])
    firsts = [
        int(cell.partition(":")[0].rpartition(" ")[2])
        for cell, own in zip(texts, short, strict=True)
        if own and cell[:1].isdigit() and cell.partition(":")[0].isdigit()
    ]
    if unit.startswith("mm:ss") or len(cells.forms) > 1 or (firsts and max(firsts) > 23):
        return np.where(short, cells.clock / 60.0, cells.clock)
    if unit.startswith("hh:mm") or not firsts:
        return cells.clock
    raise InputError(
        f"the column {table.names[place]!r} of {table.path!r} holds {texts[int(np.argmax(short))]!r}, "
        "which may be hours and minutes, or minutes and seconds; name the form in its head, as in time (mm:ss)"
    )


def _over_midnight(of_day: np.ndarray) -> np.ndarray:
    """Seconds of a clock without dates: it begins again after 24 h, or after 12 h."""
    known = np.flatnonzero(np.isfinite(of_day))
    steps = np.diff(of_day[known])
    added = np.zeros(len(of_day))
    for back in np.flatnonzero(steps < 0.0):
        forward = np.median(steps[steps > 0.0]) if np.any(steps > 0.0) else 0.0
        size = next(
            (d for d in (0.5 * stamps.DAY, stamps.DAY) if 0.0 <= steps[back] + d <= max(_LOST * forward, 60.0)), 0.0
        )
        added[known[back + 1] :] += size
    return of_day + added


def _dated(table: TextTable, name: str, days: dict[str, np.ndarray], of_day: np.ndarray) -> np.ndarray:
    """Seconds of dates and clocks: the order of day and month is that in which time goes on."""
    found: list[np.ndarray] = []
    for order in ("dmy", "mdy"):
        own = days[order]
        if np.array_equal(np.isnan(own), np.isnan(days["dmy"]) & np.isnan(days["mdy"])):
            known = np.flatnonzero(np.isfinite(own))
            begin = own[known[0]] if known.size else 0.0
            same = bool(known.size) and bool(np.all(own[known] == begin))
            clock = _over_midnight(of_day) if same else of_day
            found.append((own - begin) * stamps.DAY + clock)
    if not found:
        raise InputError(f"the dates of {table.path!r} are of different forms; write them as 2026-11-28")
    if len(found) == 1 or np.array_equal(found[0], found[1], equal_nan=True):
        return found[0]
    worst = []
    for offset in found:
        steps = np.diff(offset[np.isfinite(offset)])
        worst.append(np.inf if np.any(steps < 0.0) else float(steps.max(initial=0.0)))
    if _TOLD * min(worst) > max(worst) or min(worst) == np.inf:
        raise InputError(
            f"the dates of {table.path!r} may begin with the day or with the month; write them as 2026-11-28"
        )
    return found[int(np.argmin(worst))]
