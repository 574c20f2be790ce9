"""Dates and times of day."""

from __future__ import annotations

import datetime
import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from evolvent_base.tables.cells import is_missing

DAY = 86400.0
#: Longest stamp.
_LONGEST = 60
#: A date, a time of day, or both; and the offset from universal time.
_STAMP = re.compile(
    r"(?:(?P<count>-?\d{1,5}) days? )?(?:(?P<date>\d{4}[-/]\d{3}|[\w.]+?[-/. ][\w]+[-/. ]\w+?)\.?)?"
    r"(?:(?(date)(?: - |, ?|[T_ ]) ?)(?P<clock>\d{1,4}:\d{1,2}(?::\d{1,2})?(?:[.,:]\d+)?)(?P<half> ?[AaPp]\.?[Mm]\.?)?"
    r" ?(?P<zone>Z|[A-Z]{3,4}|[+-]\d\d:?\d\d)?)?"
)
#: A stamp without signs between its numbers, 20261128T100000.5.
_BASIC = re.compile(r"(\d{4})(\d\d)(\d\d)T(\d\d)(\d\d)(\d\d.*)")
_DATE = re.compile(r"(\d{4}|\d{1,2})[-/. ](\d{1,2}|[^\W\d_]{3,9})[-/. ](\d{4}|\d{1,2})")
#: A date by the day of the year, 2026-332.
_OF_YEAR = re.compile(r"(\d{4})[-/](\d{3})")
_CLOCK = re.compile(r"(\d{1,4}):(\d{1,2})(?::(\d{1,2}))?(?:([.,:])(\d+))?")
_MONTHS = {
    name: k
    for names in ("jan feb mar apr may jun jul aug sep oct nov dec", "jän feb mär apr mai jun jul aug sep okt nov dez")
    for k, name in enumerate(names.split(), start=1)
}


class Cells(NamedTuple):
    """Stamps of a column, NaN where a cell is empty.

    Attributes
    ----------
    days : {order: (N,)} ordinal days by the order of day and month, "dmy" or "mdy"; empty where there are no dates
    clock : (N,) s since midnight, or None where there are no times of day
    forms : kinds of clocks: "hms", "hm" (two numbers), "ms" (two numbers and a fraction)
    is_half : whether all clocks have the form AM or PM
    wrong : place of the first cell that is no stamp, or -1
    """

    days: dict[str, np.ndarray]
    clock: np.ndarray | None
    forms: frozenset[str]
    is_half: bool
    wrong: int


def cells_of(texts: Sequence[str]) -> Cells:
    """Read stamps."""
    count = len(texts)
    dates: dict[str, tuple[float, float]] = {}
    days = {"dmy": np.full(count, np.nan), "mdy": np.full(count, np.nan)}
    clock = np.full(count, np.nan)
    forms: set[str] = set()
    zones: set[str] = set()
    half = has_date = has_clock = False
    for k, text in enumerate(texts):
        basic = _BASIC.fullmatch(text)
        text = "{}-{}-{}T{}:{}:{}".format(*basic.groups()) if basic else text
        found = _STAMP.fullmatch(text) if len(text) <= _LONGEST else None
        if found is None or not (found["date"] or found["clock"]):
            if is_missing(text):
                continue
            return Cells({}, None, frozenset(), False, k)
        if found["date"]:
            if found["date"] not in dates:
                dates[found["date"]] = _days(found["date"])
            own = dates[found["date"]]
            if own[0] != own[0] and own[1] != own[1]:
                return Cells({}, None, frozenset(), False, k)
            days["dmy"][k], days["mdy"][k], has_date = *own, True
        if found["clock"]:
            value, form = _clock(found["clock"])
            if not form:
                return Cells({}, None, frozenset(), False, k)
            if found["half"]:
                half = True
                value = value % 43200.0 + 43200.0 * (found["half"].strip()[0] in "pP")
            if found["zone"] and found["zone"][0] in "+-":
                hours, minutes = int(found["zone"][1:3]), int(found["zone"][-2:])
                value -= (60.0 * hours + minutes) * (60.0 if found["zone"][0] == "+" else -60.0)
            value += DAY * int(found["count"] or 0)
            zones.add((found["zone"] or "")[:4].lstrip("+-0123456789:"))
            if len(zones) > 1:  # words for zones of different offsets
                return Cells({}, None, frozenset(), False, k)
            clock[k], has_clock = value, True
            forms.add(form)
    return Cells(days if has_date else {}, clock if has_clock else None, frozenset(forms), half, -1)


def _days(text: str) -> tuple[float, float]:
    """Ordinal day of a date, with the day first and with the month first; NaN where it is none."""
    of_year = _OF_YEAR.fullmatch(text)
    if of_year:
        day = _ordinal(int(of_year[1]), 1, 1) + int(of_year[2]) - 1 if 1 <= int(of_year[2]) <= 366 else np.nan
        return day, day
    found = _DATE.fullmatch(text)
    if found is None:
        return np.nan, np.nan
    first, middle, last = found.groups()
    month = int(middle) if middle.isdigit() else _MONTHS.get(middle[:3].lower(), 0)
    if len(first) == 4:
        day = _ordinal(int(first), month, int(last))
        return day, day
    year = int(last) + (2000 if len(last) < 3 else 0)
    day = _ordinal(year, month, int(first))
    if not middle.isdigit() or "." in text:  # points stand in dates whose day comes first
        return day, day
    return day, _ordinal(year, int(first), month)


def _ordinal(year: int, month: int, day: int) -> float:
    try:
        return float(datetime.date(year, month, day).toordinal())
    except ValueError:
        return np.nan


def _clock(text: str) -> tuple[float, str]:
    """Seconds of a time of day, of two numbers as if they were hours and minutes; and its form."""
    found = _CLOCK.fullmatch(text)
    if found is None or int(found[2]) > 59 or (found[3] and int(found[3]) > 60):
        return np.nan, ""
    if found[4] == ":" and len(found[5]) != 3:  # neither milliseconds nor another known part
        return np.nan, ""
    fraction = float(f"0.{found[5]}") if found[5] else 0.0
    if found[3] is not None:
        return 3600.0 * int(found[1]) + 60.0 * int(found[2]) + int(found[3]) + fraction, "hms"
    if found[5]:
        return 60.0 * int(found[1]) + int(found[2]) + fraction, "ms"
    return 3600.0 * int(found[1]) + 60.0 * int(found[2]), "hm"


def clock_seconds(text: str) -> float | None:
    """Seconds since midnight of hh:mm:ss.fff; None of what is no time of day."""
    value, form = _clock(text.strip())
    return value if form == "hms" else None
