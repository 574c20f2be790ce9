"""Heads of columns: a name, and a unit in one of the forms in which people state it."""

from __future__ import annotations

import functools
import re

from evolvent_base.units.written import candidates

#: Words that a head may end with behind a low line, which are units of anything.
_TAILS = frozenset(
    ["mm", "um", "km", "deg", "mrad", "rpm", "hz", "khz", "mv", "uv", "kn", "mn", "nm", "pa", "kpa", "mpa"]
)
#: Such words that are other things behind a short name: the centre of mass, the radial part.
_LONG_TAILS = frozenset(["cm", "rad"])
#: Such words behind a name of the time.
_TAILS_OF_TIME = frozenset(["s", "ms", "us", "ns", "sec", "secs", "seconds", "msec", "usec", "min", "h"])
_NAMES_OF_TIME = frozenset(["t", "time", "zeit", "temps", "tiempo", "timestamp", "elapsed", "uptime"])


#: A head whose unit stands before the number of the run: "Time (s) Run #1".
_RUN = re.compile(
    r"([^\s(\[][^(\[]{0,60}?) ?[(\[]([^()\[\]]{1,30})[)\]] ?((?:run|trial|set|series|channel|ch) ?#?\d{1,4})", re.I
)


def head_and_unit(head: str) -> tuple[str, str]:
    """Name and unit of the head of a column: "angle [deg]" and "angle (deg)" -> "angle", "deg".

    "angle / deg" (ISO 80000), "angle in deg", "angle, deg" and "angle_deg" hold a unit as well, where it is a known
    one. Behind a low line a single letter is a unit of time alone, as in "time_s"; "a_x" and "pos_m" are names.

    A head without a unit, or of a unit alone, is a name.
    """
    text = head.strip()
    start = max(text.rfind("["), text.rfind("("))
    name, unit = text[:start].rstrip(), text[start + 1 : -1].strip()
    if start >= 0 and text[-1] in ")]" and name and not any(sign in unit for sign in ")]"):
        other = ("", "") if is_unit(unit) else _behind_a_sign(name)
        if other[1]:  # "Force, N (serial 123)"
            return other
        for sign in (" in", " /", ","):
            name = name.removesuffix(sign).rstrip() if name != sign.strip() else name
        return name, unit
    run = _RUN.fullmatch(text)
    if run and is_unit(run[2].strip()):
        return f"{run[1]} {run[3]}", run[2].strip()
    other = _behind_a_sign(text)
    if other[1]:
        return other
    name, _, unit = (part.strip() for part in text.rpartition("/"))
    if name.lower() in _NAMES_OF_TIME and unit.lower() in _TAILS_OF_TIME:
        return name, unit
    name, _, unit = text.rpartition("_")
    low = unit.lower()
    of_time = low in _TAILS_OF_TIME and bool(set(re.split(r"[\W_]+", name.lower())) & _NAMES_OF_TIME)
    if name and (of_time or low in _TAILS or (low in _LONG_TAILS and len(name) > 2)) and is_unit(unit):
        return name, unit
    return text, ""


def _behind_a_sign(text: str) -> tuple[str, str]:
    """Name and unit of "angle / deg", "angle in deg" and "angle, deg"; no unit in other texts."""
    for sign in (" / ", " in ", ", "):
        name, _, unit = (part.strip() for part in text.rpartition(sign))
        if name and is_unit(unit):
            return name, unit
    return text, ""


@functools.cache
def is_unit(text: str) -> bool:
    """Whether a text is a unit, as files write them."""
    return bool(text) and not text[0].isdigit() and bool(candidates(text))
