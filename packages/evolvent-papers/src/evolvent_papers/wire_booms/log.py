"""The log of a deployment as a table of steps, and what of a run it is compared with."""

from __future__ import annotations

import datetime
import math
import re
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from evolvent import cases
from evolvent.results.measurements import Measurements, Series
from evolvent_base import safe_open, tables, units
from evolvent_base.errors import InputError
from evolvent_papers.wire_booms.case import PAIRS
from evolvent_papers.wire_booms.structure import SPEED, timeline

#: Columns of a log: name -> unit where the head states none, None of words.
_UNITS = {
    "pair": None, "start_utc": None, "end_utc": None, "stroke_before": "m", "stroke_after": "m", "rate_before": "rpm",
    "rate_after": "rpm",
}  # fmt: skip
COLUMNS = tuple(name if unit is None else f"{name}_{unit}" for name, unit in _UNITS.items())
RPM = 2.0 * math.pi / 60.0
#: Rise of the rate from one row to the next above which the craft was spun up between them, rpm.
SPIN_UP = 0.5
#: Variables that a log holds.
_OBSERVED = ("spin_rate",)


class LogRow(NamedTuple):
    """One step of a log; a rate or a number of clicks that it lacks is not a number."""

    pair: str
    duration: float
    before: float
    after: float
    rate_before: float
    rate_after: float
    clicks: float


def is_log(path: str) -> bool:
    """Whether a file has the columns by which such a log is known."""
    try:
        table = tables.read(safe_open.content(path, most=safe_open.LARGEST_TEXT), path)
    except InputError:
        return False
    return all(_place(table, name) is not None for name in ("pair", "stroke_after", "rate_after"))


def _place(table: tables.TextTable, name: str) -> int | None:
    """Place of a column by its name, with its unit or without."""
    for known in (table.names, table.heads):
        for one in (name, f"{name}_{_UNITS.get(name)}"):
            if one in known:
                return known.index(one)
    return None


def read(path: str) -> tuple[list[LogRow], list[str]]:
    """The steps of a log, and notes on rows whose times cannot be used.

    Raises
    ------
    InputError
        Naming the row and the column that cannot be read.
    """
    table = tables.read(safe_open.content(path, most=safe_open.LARGEST_TEXT), path, whole=True)
    places = {name: _place(table, name) for name in _UNITS}
    for name, full in zip(_UNITS, COLUMNS, strict=True):
        if places[name] is None:
            raise InputError(f"{path!r} has no column {full!r}; a log of wire booms has {', '.join(COLUMNS)}")
    columns: dict[str, Any] = {}
    for name, place in places.items():
        assert place is not None
        unit = _UNITS[name]
        columns[name] = table.words(place + 1) if unit is None else _numbers(table, place, unit)
    clicks = _place(table, "clicks")
    columns["clicks"] = np.full(table.rows, np.nan) if clicks is None else _numbers(table, clicks, "")
    for name in ("stroke_before", "stroke_after"):
        for k, value in enumerate(columns[name]):
            if not value >= 0.0:
                shown = "no stroke" if math.isnan(value) else f"a stroke of {value:g} m"
                raise InputError(f"row {k + 1} of {path!r} has {shown}; it must be 0 m or more")
    notes: list[str] = []
    rows = [{name: column[k] for name, column in columns.items()} for k in range(table.rows)]
    return [_row(path, k, row, notes) for k, row in enumerate(rows, start=1)], notes


def _numbers(table: tables.TextTable, place: int, unit: str) -> np.ndarray:
    """Values of a column in a unit, that of the column where its head states none."""
    name = table.heads[place]
    try:
        factor = units.factor(table.units[place], unit) if table.units[place] else 1.0
    except units.UnitError as error:
        raise InputError(f"the column {name!r} of {table.path!r}: {error}") from None
    values = table.numbers(place + 1) * factor
    if np.isinf(values).any():
        raise InputError(f"row {int(np.argmax(np.isinf(values))) + 1} of {table.path!r} is infinite in column {name!r}")
    return values


def _row(path: str, k: int, row: dict[str, Any], notes: list[str]) -> LogRow:
    pair = "-".join(re.findall(r"\d", row["pair"]))
    if pair not in PAIRS:
        raise InputError(f"row {k} of {path!r} has the pair {row['pair']!r}; it must be one of {', '.join(PAIRS)}")
    before, after = float(row["stroke_before"]), float(row["stroke_after"])
    try:
        times = (datetime.datetime.fromisoformat(row[name].rstrip("Z")) for name in ("start_utc", "end_utc"))
        start, end = (time if time.tzinfo else time.replace(tzinfo=datetime.UTC) for time in times)
    except ValueError:
        raise InputError(f"row {k} of {path!r} has a time that is not of the form 2012-09-13T19:44:10") from None
    duration = (end - start).total_seconds()
    if duration <= 0.0:
        duration = abs(after - before) / SPEED or 1.0
        notes.append(
            f"Row {k} of the log ends at {row['end_utc']}, not after its start; its duration is taken as "
            f"{duration:.0f} s."
        )
    rates = float(row["rate_before"]), float(row["rate_after"])
    return LogRow(pair, duration, before, after, *rates, float(row["clicks"]))


def written(rows: Sequence[LogRow]) -> str:
    """A log with these rows, one behind the other in time."""
    lines, time = [",".join([*COLUMNS, "clicks"])], datetime.datetime(2000, 1, 1, tzinfo=datetime.UTC)
    for row in rows:
        start, time = time, time + datetime.timedelta(seconds=row.duration)
        numbers = ("" if math.isnan(x) else repr(x) for x in row[2:])
        lines.append(",".join([row.pair, start.isoformat(), time.isoformat(), *numbers]))
    return "\n".join(lines) + "\n"


def grouped(rows: Sequence[LogRow]) -> list[list[LogRow]]:
    """Rows between spin-ups: the first rate of a row is above the last one before it; missing rates are passed over."""
    groups: list[list[LogRow]] = [[]]
    last = math.inf
    for row in rows:
        known = [rate for rate in (row.rate_before, row.rate_after) if math.isfinite(rate)]
        if known and known[0] > last + SPIN_UP:
            groups.append([])
        groups[-1].append(row)
        last = known[-1] if known else last
    return groups


def measurements(path: str, case: Any, observed: Sequence[str]) -> Measurements | None:
    """Measured spin rates of a log, and the keys of a case that it sets; None of a file that is no such log.

    The rate before the first step of every group and the rates after all steps are compared: within a group the rate
    before a step is that after the step before, to within rounding.
    """
    if not is_log(path):
        return None
    if tuple(observed) != _OBSERVED:
        raise InputError(f"--observe is {', '.join(observed)!r}; a log of wire booms holds spin_rate alone")
    rows, notes = read(path)
    groups = grouped(rows)
    starts = [group[0].rate_before for group in groups]
    for group, rate in zip(groups, starts, strict=True):
        if not math.isfinite(rate):
            raise InputError(
                f"row {rows.index(group[0]) + 1} of {path!r} has no rate_before_rpm; "
                "the first step of a group needs one"
            )
    overrides: dict[str, Any] = {
        "groups": [[[r.pair, r.before, r.after, r.duration] for r in group] for group in groups],
        "rates": [rate * RPM for rate in starts],
        "start_lengths": [group[0].before for group in groups],
    }
    longest = max(max(row.before, row.after) for row in rows)
    if longest > cases.load(cases.content_of(case)).wire.length:
        overrides["wire.length"] = longest
        notes.append(f"wire.length is set to the longest stroke of the log, {longest:g} m.")
    names = [f"step {k + 1}" for k in range(len(rows))]
    firsts = np.cumsum([0, *map(len, groups[:-1])])
    values = np.array([*starts, *(row.rate_after for group in groups for row in group)])
    labels = [f"before {names[k]}" for k in firsts] + [f"after {name}" for name in names]

    def times(content: Any) -> np.ndarray:
        line = timeline(cases.load(content))
        return np.concatenate([line.before[firsts], line.after])

    order = np.argsort(times(cases.content_of(case, overrides)))
    order = order[np.isfinite(values[order])]
    series = Series(
        name="spin_rate", unit="rpm", values=values[order], labels=tuple(labels[k] for k in order),
        times=lambda content: times(content)[order],
    )  # fmt: skip
    return Measurements(source=path, overrides=overrides, series=(series,), notes=(*notes, *_NOTES))


_NOTES = (
    "The log holds spin rates before and after steps. It says nothing of the lag of the wires, of their tension, of "
    "their bending, or of the rate within a step.",
    "Spin rates give masses only in proportion to the moment of inertia of the spacecraft, body.inertia.",
)
