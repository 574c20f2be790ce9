"""The log of a deployment as a table of steps, and what of a run it is compared with."""

from __future__ import annotations

import csv
import datetime
import math
import re
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from evolvent.base import safe_open
from evolvent.base.errors import InputError
from evolvent.results.measurements import Measurements, Series
from evolvent.systems.wire_booms.case import PAIRS
from evolvent.systems.wire_booms.structure import SPEED, timeline

COLUMNS = (
    "pair", "start_utc", "end_utc", "stroke_before_m", "stroke_after_m", "rate_before_rpm", "rate_after_rpm",
)  # fmt: skip
RPM = 2.0 * math.pi / 60.0
#: Rise of the rate from one row to the next above which the craft was spun up between them, rpm.
SPIN_UP = 0.5
#: Variables that a log holds.
_OBSERVED = ("spin_rate",)


class Row(NamedTuple):
    """One step of a log; a rate that it lacks is not a number."""

    pair: str
    duration: float
    before: float
    after: float
    rate_before: float
    rate_after: float


def is_log(path: str) -> bool:
    """Whether a file begins with the columns of such a log."""
    try:
        head = next(csv.reader(_lines(path)), [])
    except (InputError, csv.Error):
        return False
    return {"pair", "stroke_after_m", "rate_after_rpm"} <= {name.strip() for name in head}


def read(path: str) -> tuple[list[Row], list[str]]:
    """The steps of a log, and notes on rows whose times cannot be used.

    Raises
    ------
    InputError
        Naming the row and the column that cannot be read.
    """
    try:
        read_rows = list(csv.DictReader(_lines(path)))
    except csv.Error as error:
        raise InputError(f"cannot read {path!r}: {error}") from None
    for k, row in enumerate(read_rows, start=1):
        if None in row:
            raise InputError(f"row {k} of {path!r} has more fields than its first line names columns")
    rows = [{name.strip(): (value or "").strip() for name, value in row.items()} for row in read_rows]
    for name in COLUMNS:
        if rows and name not in rows[0]:
            raise InputError(f"{path!r} has no column {name!r}; a log of wire booms has {', '.join(COLUMNS)}")
    if not rows:
        raise InputError(f"{path!r} holds no step; it must hold one row for each")
    notes: list[str] = []
    return [_row(path, k, row, notes) for k, row in enumerate(rows, start=1)], notes


def _lines(path: str) -> list[str]:
    return safe_open.text(path).removeprefix("\ufeff").splitlines()


def _row(path: str, k: int, row: dict[str, str], notes: list[str]) -> Row:
    pair = "-".join(re.findall(r"\d", row["pair"]))
    if pair not in PAIRS:
        raise InputError(f"row {k} of {path!r} has the pair {row['pair']!r}; it must be one of {', '.join(PAIRS)}")
    before, after = (_number(path, k, row, name) for name in ("stroke_before_m", "stroke_after_m"))
    first, last = (_number(path, k, row, name, missing=True) for name in ("rate_before_rpm", "rate_after_rpm"))
    if min(before, after) < 0.0:
        raise InputError(f"row {k} of {path!r} has a stroke of {min(before, after):g} m; it must be 0 m or more")
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
    return Row(pair, duration, before, after, first, last)


def _number(path: str, k: int, row: dict[str, str], name: str, *, missing: bool = False) -> float:
    if missing and not row[name]:
        return math.nan
    try:
        number = float(row[name])
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise InputError(f"row {k} of {path!r} has {name} {row[name]!r}; it must be a number")
    return number


def grouped(rows: Sequence[Row]) -> list[list[Row]]:
    """Rows between spin-ups: the first rate of a row is above the last one before it; missing rates are passed over."""
    groups: list[list[Row]] = [[]]
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
    from evolvent import cases

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
