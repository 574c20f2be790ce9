"""Temperatures and long times as people read them."""

from __future__ import annotations

#: 0 degC, K.
CELSIUS = 273.15
#: A year of 365.25 days, s.
YEAR = 365.25 * 86400.0
#: Units of long times: name of one, name of several, s, and how many of it are said in it.
_UNITS = (
    ("year", "years", YEAR, 1.0), ("day", "days", 86400.0, 2.0), ("h", "h", 3600.0, 1.0), ("min", "min", 60.0, 2.0),
)  # fmt: skip
#: Times that are named at a logarithmic axis where they lie on it, and most of them at one axis.
_NAMED = (
    *(10.0**k for k in range(-9, 2)), 60.0, 600.0, 3600.0, 86400.0, 864000.0, *(YEAR * 10.0**k for k in range(7)),
)  # fmt: skip
_MOST_NAMED = 12


def celsius(temperature: float, digits: int = 6) -> str:
    """A temperature (K) in degC."""
    return f"{temperature - CELSIUS:.{digits}g} degC"


def shown_time(seconds: float, digits: int = 4) -> str:
    """A time in the largest unit of which it has one: "10 years", "1.5 h", "1 day"."""
    for one, several, size, least in _UNITS:
        if (count := f"{seconds / size:.{digits}g}") == "1" or seconds >= least * size:
            return f"{count} {one if count == '1' else several}"
    return f"{seconds:.{digits}g} s"


def named_times(first: float, last: float) -> dict[float, str]:
    """Names of times (s) for a logarithmic axis between two of them, far enough from each other."""
    found = [time for time in _NAMED if first * (1.0 - 1e-9) <= time <= last * (1.0 + 1e-9)]
    every = -(-len(found) // _MOST_NAMED)
    return {time: shown_time(time) for time in found[::-1][:: max(every, 1)][::-1]}
