"""The log of a deployment as a table of steps, and what of a run it is compared with."""

from __future__ import annotations

import csv
import datetime
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from evolvent.errors import InputError
from evolvent.systems.wire_booms.case import PAIRS
from evolvent.systems.wire_booms.structure import timeline

if TYPE_CHECKING:
    from evolvent.calibration.data import Measurements

COLUMNS = (
    "pair", "start_utc", "end_utc", "stroke_before_m", "stroke_after_m", "rate_before_rpm", "rate_after_rpm",
)  # fmt: skip
RPM = 2.0 * math.pi / 60.0
#: Rise of the rate from one row to the next above which the craft was spun up between them, rpm.
SPIN_UP = 0.5
#: Variables that a log holds.
_OBSERVED = ("spin_rate",)


class Row(NamedTuple):
    """One step of a log."""

    pair: str
    duration: float
    before: float
    after: float
    rate_before: float
    rate_after: float


def is_log(path: str) -> bool:
    """Whether a file begins with the columns of such a log."""
    try:
        with open(path, encoding="utf-8-sig", newline="") as file:
            head = next(csv.reader(file), [])
    except (OSError, UnicodeDecodeError):
        return False
    return {"pair", "stroke_after_m", "rate_after_rpm"} <= {name.strip() for name in head}


def read(path: str) -> list[Row]:
    """The steps of a log.

    Raises
    ------
    InputError
        Naming the row and the column that cannot be read.
    """
    with open(path, encoding="utf-8-sig", newline="") as file:
        rows = [{(k or "").strip(): (v or "").strip() for k, v in row.items()} for row in csv.DictReader(file)]
    for name in COLUMNS:
        if rows and name not in rows[0]:
            raise InputError(f"{path!r} has no column {name!r}; a log of wire booms has {', '.join(COLUMNS)}")
    if not rows:
        raise InputError(f"{path!r} holds no step; it must hold one row for each")
    return [_row(path, k, row) for k, row in enumerate(rows, start=1)]


def _row(path: str, k: int, row: dict[str, str]) -> Row:
    if row["pair"] not in PAIRS:
        raise InputError(f"row {k} of {path!r} has the pair {row['pair']!r}; it must be one of {', '.join(PAIRS)}")
    numbers = []
    for name in ("stroke_before_m", "stroke_after_m", "rate_before_rpm", "rate_after_rpm"):
        try:
            number = float(row[name])
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise InputError(f"row {k} of {path!r} has {name} {row[name]!r}; it must be a number")
        numbers.append(number)
    try:
        start, end = (datetime.datetime.fromisoformat(row[name].rstrip("Z")) for name in ("start_utc", "end_utc"))
    except ValueError:
        raise InputError(f"row {k} of {path!r} has a time that is not of the form 2012-09-13T19:44:10") from None
    if end <= start:
        raise InputError(f"row {k} of {path!r} ends at {row['end_utc']}, not after its start, {row['start_utc']}")
    before, after, first, last = numbers
    return Row(row["pair"], (end - start).total_seconds(), before, after, first, last)


def grouped(rows: Sequence[Row]) -> list[list[Row]]:
    """Rows between spin-ups: the rate before a row is above that after the row before."""
    groups = [[rows[0]]]
    for previous, row in zip(rows, rows[1:], strict=False):
        if row.rate_before > previous.rate_after + SPIN_UP:
            groups.append([])
        groups[-1].append(row)
    return groups


def measurements(path: str, case: Any, observed: Sequence[str]) -> Measurements | None:
    """Measured spin rates of a log, and the keys of a case that it sets; None of a file that is no such log.

    The rate before the first step of every group and the rates after all steps are compared: within a group a rate
    before a step repeats that after the step before.
    """
    from evolvent import cases
    from evolvent.calibration.data import Measurements, Series

    if not is_log(path):
        return None
    if tuple(observed) != _OBSERVED:
        raise InputError(f"--observe is {', '.join(observed)!r}; a log of wire booms holds spin_rate alone")
    groups = grouped(read(path))
    overrides = {
        "groups": [[[r.pair, r.before, r.after, r.duration] for r in group] for group in groups],
        "rates": [group[0].rate_before * RPM for group in groups],
        "start_lengths": [group[0].before for group in groups],
    }
    names = [f"step {k + 1}" for k in range(sum(map(len, groups)))]
    firsts = np.cumsum([0, *map(len, groups[:-1])])
    values = [group[0].rate_before for group in groups] + [row.rate_after for group in groups for row in group]
    labels = [f"before {names[k]}" for k in firsts] + [f"after {name}" for name in names]

    def times(content: Any) -> np.ndarray:
        line = timeline(cases.load(content))
        return np.concatenate([line.before[firsts], line.after])

    order = np.argsort(times(cases.content_of(case, overrides)))
    series = Series(
        name="spin_rate", unit="rpm", values=np.array(values)[order], labels=tuple(labels[k] for k in order),
        times=lambda content: np.sort(times(content)),
    )  # fmt: skip
    return Measurements(source=path, overrides=overrides, series=(series,), notes=_NOTES)


_NOTES = (
    "The log holds spin rates before and after steps. It says nothing of the lag of the wires, of their tension, of their "
    "bending, or of the rate within a step.",
    "Spin rates give masses in proportion to the moment of inertia of the spacecraft, body.inertia, which is not fitted.",
)
