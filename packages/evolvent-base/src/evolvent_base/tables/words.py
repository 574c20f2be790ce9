"""Names that people give to columns of times, and spellings of their units."""

from __future__ import annotations

import functools
import re
from collections.abc import Callable, Sequence

from evolvent_base import units as texts

#: Words for the time; `t` alone as well.
TIME_NAMES = (
    "time", "t", "zeit", "temps", "tiempo", "tempo", "tid", "tijd", "czas", "čas", "aika", "время", "时间", "時間",
    "timestamp", "elapsed", "uhrzeit", "messzeit", "zeitstempel", "datetime", "clock", "x_value", "millis", "micros",
    "laufzeit", "prüfzeit", "versuchszeit", "testzeit", "gesamtzeit",
    "seconds", "milliseconds", "microseconds", "sekunden", "millisekunden", "epoch", "utc",
)  # fmt: skip
#: Words for a date, which a column of clock times may stand beside.
DATE_NAMES = ("date", "datum", "fecha", "дата", "日期")
#: Words that may stand beside a word for the time.
_BESIDE = frozenset((
    "run", "latest", "series", "data", "set", "elapsed", "relative", "rel", "abs", "absolute", "system", "device",
    "local", "gmt", "since", "start", "sample", "stamp", "recorded", "measured", "measurement", "from", "of", "the",
    "in", "and", "date", "datum", "unix", "epoch", "channel", "ch", "relativ", "trial", "axis", "test", "total",
    "running", "scan", "log", "recording", "default", "rate", "seit", "beginn", "received",
))  # fmt: skip
#: Names of an axis, which is the time if its unit is one of time.
AXES = ("x", "x-axis", "x axis", "x_axis", "abscissa", "source", "trace_x")
#: Names of a time that say what it is counted in.
_OWN_UNITS = {"millis": "ms", "milliseconds": "ms", "millisekunden": "ms", "micros": "us", "microseconds": "us",
              "seconds": "s", "sekunden": "s"}  # fmt: skip
#: Longest name and form that is examined.
_LONGEST = 60
#: Forms that a unit of stamps may be stated in, which says nothing of their size.
_FORMS_OF_STAMPS = re.compile(r"[hHyYmMdDsSfF:./\- T,]*[hHyYmMdDsS]{2}[:./\-][hHyYmMdDsSfF:./\- T,]*|utc|gmt|iso.*")


def is_unit_of_time(unit: str) -> bool:
    """Whether a unit is one of time."""
    return factor(unit) is not None


@functools.cache
def factor(unit: str) -> float | None:
    """Seconds in a unit of time; None of what is none."""
    try:
        return texts.factor(unit, "s") if unit.strip() else None
    except texts.UnitError:
        return None


def is_form(unit: str) -> bool:
    """Whether a unit is the form of a stamp, such as hh:mm:ss."""
    return len(unit) <= _LONGEST and bool(_FORMS_OF_STAMPS.fullmatch(unit.strip().lower()))


def own_unit(name: str) -> str:
    """The unit that a name of the time is itself, such as `millis`; '' of other names."""
    return next((_OWN_UNITS[word] for word in _split(name) if word in _OWN_UNITS), "")


def _split(name: str) -> list[str]:
    if len(name) > _LONGEST:
        return []
    low = name.lower().strip()
    if low in TIME_NAMES:
        return [low]
    low = re.sub(r"\s*\(\d+\)$", "", low)
    if low == "x_value":
        return [low]
    low = re.sub(r"\b(run|trial|set|series|channel|ch)[ _#]*\d+", r"\1", low)
    return [word for word in re.split(r"[\W_]+", low) if word and not word.isdigit()]


def is_time(name: str) -> bool:
    """Whether a name is one of the time: a word for it, and none beside that it would be another quantity with."""
    if name.strip() in ("T", "Ts", "TS"):
        return False
    found = _split(name)
    own = [word for word in found if word in TIME_NAMES]
    return bool(own) and all(word in TIME_NAMES or word in _BESIDE for word in found)


def time_columns(names: Sequence[str], units: Sequence[str]) -> list[int]:
    """Places of all columns that are times by their names, and not something else by their units."""
    return [
        k
        for k, (name, unit) in enumerate(zip(names, units, strict=True))
        if is_time(name) and (not unit or is_unit_of_time(unit) or is_form(unit))
    ]


def find_time(names: Sequence[str], units: Sequence[str], rises: Callable[[int], bool] | None = None) -> int | None:
    """Place of the column that holds the time by its name; None if no name is one of a time.

    A name with a unit of time comes first, then the order of the columns. `T` is the time where its column rises and
    none is called `Ts`.

    Parameters
    ----------
    names, units : of the columns, the units '' where none is stated
    rises : place -> whether the samples of a column rise throughout
    """
    found = time_columns(names, units)
    if found:
        stated = [k for k in found if units[k] and not is_form(units[k])]
        return (stated or found)[0]
    axes = [k for k, name in enumerate(names) if name.lower() in AXES and is_unit_of_time(units[k])]
    if axes:
        return axes[0]
    if "T" in names and not {"Ts", "TS", "ts"} & set(names):
        place = list(names).index("T")
        if (not units[place] or is_unit_of_time(units[place])) and rises is not None and rises(place):
            return place
    return find_date(names)


def find_date(names: Sequence[str]) -> int | None:
    """Place of a column of dates by its name."""
    return next((k for k, name in enumerate(names) if set(_split(name)) & set(DATE_NAMES)), None)
