"""Lines as monitors of a serial port write them: stamped, or with its name before each value."""

from __future__ import annotations

import re
from collections.abc import Sequence

from evolvent_base.tables.cells import is_number
from evolvent_base.tables.layout import kinds

#: A line with the time at which it came, "10:00:00.123 -> 1.5,2.5".
_STAMPED = re.compile(r"(\d{1,2}:\d{2}:\d{2}(?:[.,]\d+)?) -> ?(.*)", re.DOTALL)
#: A value behind its name, "ax: 1.5" or "ax=1.5", and what parts it from the next.
_LABELLED = re.compile(r"\s*([A-Za-z_µ][\w .\-/()]{0,30}?) ?[:=] ?([-+.\deE]+)([ \t,;|]+|$)")
#: Lines that are judged, the share of them that must have the form, and the longest line that may.
_JUDGED, _MOST, _LONGEST = 200, 0.8, 1000


def unstamped(lines: Sequence[str]) -> tuple[list[str], list[str]]:
    """Lines without the time at which each came, and those times; no times where lines have none."""
    judged = [line for line in lines[:_JUDGED] if line.strip()]
    if sum(bool(_STAMPED.fullmatch(line)) for line in judged) < max(1.0, _MOST * len(judged)):
        return list(lines), []
    found = [_STAMPED.fullmatch(line) for line in lines]
    return [one[2] if one else "" for one in found], [one[1] if one else "" for one in found]


def stamped(lines: Sequence[str], stamps: Sequence[str], separator: str) -> list[str]:
    """Rows with their times as the first cell, which is empty in lines with several words."""
    if not stamps:
        return list(lines)
    rows, sign = (kinds(line, separator).is_row for line in lines), separator or "\t"
    return [
        f"{stamp if row else ''}{sign}{line}" if row or (separator and separator in line) else line
        for line, stamp, row in zip(lines, stamps, rows, strict=True)
    ]


def unlabelled(lines: Sequence[str]) -> list[str] | None:
    """Rows of values whose names stand before each, with tabs, below a head; None of other lines.

    The head is the first line; the others are where they were.
    """
    judged = [line for line in lines[:_JUDGED] if line.strip()]
    known = [part for part in map(_parts, judged) if part]
    if len(known) < max(1.0, _MOST * len(judged)):
        return None
    names = [name for name, _ in max(known, key=len)]
    if len(set(names)) < len(names):
        return None
    rows = ((line, _parts(line)) for line in lines)
    found = ["\t".join(value for _, value in row) if [n for n, _ in row] == names else line for line, row in rows]
    return ["\t".join(names), *found]


def _parts(line: str) -> list[tuple[str, str]]:
    """Names and values of a line; none where it has another form."""
    if len(line) > _LONGEST:
        return []
    found, place = [], 0
    while place < len(line.rstrip()):
        part = _LABELLED.match(line, place)
        if part is None or not is_number(part[2]):
            return []
        found.append((part[1].strip(), part[2]))
        place = part.end()
    return found
