"""The table within a text: its encoding, what separates its cells, and which of its lines are its rows."""

from __future__ import annotations

import collections
import contextlib
import csv
import re
from collections.abc import Sequence
from typing import NamedTuple

from evolvent_base.errors import InputError
from evolvent_base.tables.cells import is_missing, is_number, quantity

#: What may separate cells; the first of those that do equally well is taken. A blank stands for blanks and tabs.
SEPARATORS = ("\t", ";", "|", ",", " ")
#: Lines by which the separator is judged, and most characters of them: at the beginning, and as many in the middle.
_JUDGED, _CHARACTERS = 300, 200_000
#: Most lines that one quoted cell may reach over.
_LONGEST_CELL = 20
#: Times and dates: 10:00, 10:00:00.5, 28.11.2026, 2026-11-28T10:00:00.5+01:00, 11/28/2026 10:00 PM.
_DATE = (
    r"(?:\d{4}[-/]\d{3}|\d{4}[-/.]\d{1,2}[-/.]\d{1,2}|\d{1,2} [A-Za-z]{3,9} \d{4}"
    r"|\d{1,2}[-/.](?:\d{1,2}|[A-Za-z]{3})[-/.]\d{2}(?:\d{2})?)\.?"
)
_CLOCK = r"\d{1,4}:\d{1,2}(?::\d{1,2})?(?:[.,:]\d+)?(?: ?[AaPp]\.?[Mm]\.?)?"
_ZONE = r" ?(?:Z|[A-Z]{3,4}|[+-]\d\d:?\d\d)?"
STAMP = re.compile(
    rf"(?:\d{{8}}T\d{{6}}(?:[.,]\d+)?|{_DATE}|(?:-?\d+ days? )?{_CLOCK}|{_DATE}(?:[ T_]| - |, ?) ?{_CLOCK}){_ZONE}"
)
_COMMENT = re.compile(r"\s*(?:#|%|//|!|;)")
_SEP_LINE = re.compile(r"\"?sep=(.)\"?\s*", re.IGNORECASE)


def decoded(raw: bytes, path: str) -> str:
    """The text of a file.

    Raises
    ------
    InputError
        If it is none.
    """
    for encoding in _encodings(raw):
        try:
            return raw.decode(encoding).removeprefix("\ufeff")
        except UnicodeDecodeError:
            continue
    raise InputError(f"cannot read {path!r}: it is not a text file")


def is_text(raw: bytes) -> bool:
    """Whether bytes may be a text, by the zeros at their beginning."""
    return bool(_encodings(raw))


def _encodings(raw: bytes) -> list[str]:
    """Encodings that a text may have, the likeliest first; without a mark, UTF-16 has a zero in nearly every pair."""
    head = raw[:4096]
    if raw.startswith((b"\xff\xfe\0\0", b"\0\0\xfe\xff")):
        return ["utf-32"]
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        return ["utf-16"]
    if b"\0" not in head:
        return ["utf-8-sig", "cp1252"]
    even, odd = head[::2].count(0), head[1::2].count(0)
    return ["utf-16-le" if odd > even else "utf-16-be"] if abs(odd - even) > len(head) // 4 else []


def lines_of(text: str) -> tuple[list[str], list[int] | range]:
    """Lines without their ends, and their numbers from 1; an open quote goes on in the next line."""
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    if '"' not in text:
        return lines, range(1, len(lines) + 1)
    joined: list[str] = []
    numbers: list[int] = []
    k = 0
    while k < len(lines):
        line, last = lines[k], k
        while line.count('"') % 2 and last + 1 < min(len(lines), k + _LONGEST_CELL):
            last += 1
            line += "\n" + lines[last]
        if line.count('"') % 2:
            line, last = lines[k].replace('"', ""), k  # a sign of inches, or a quote that is never closed
        joined.append(line)
        numbers.append(k + 1)
        k = last + 1
    return joined, numbers


def split(line: str, separator: str) -> list[str]:
    """Cells of a line; '' separates none."""
    if not separator:
        cells = [line[1:-1].replace('""', '"') if len(line) > 1 and line[0] == line[-1] == '"' else line]
    elif separator == " ":
        cells = (
            [cell for cell in line.replace("\t", " ").split(" ") if cell]
            if '"' not in line
            else _quoted(line.replace("\t", " ").strip(), " ")
        )
    elif '"' not in line:
        cells = line.split(separator)
    else:
        cells = _quoted(line, separator)
    return [cell.strip() for cell in cells] or [""]


def _quoted(line: str, separator: str) -> list[str]:
    try:
        return next(csv.reader([line], delimiter=separator, skipinitialspace=True), [""])
    except csv.Error:
        return line.replace('"', "").split(separator)


def rows_of(lines: Sequence[str], separator: str) -> list[list[str]]:
    """Cells of many lines."""
    if separator in ("", " "):
        return [split(line, separator) for line in lines]
    if any('"' in line for line in lines):
        with contextlib.suppress(csv.Error):
            found = list(csv.reader(lines, delimiter=separator, skipinitialspace=True))
            if len(found) == len(lines):
                return found
        return [split(line, separator) for line in lines]
    return [line.split(separator) for line in lines]


def kind(cell: str) -> str:
    """What a cell holds: 'n' a number, 't' a time or date, 'e' nothing, 'w' a word."""
    if is_number(cell):
        return "n"
    if is_missing(cell):
        return "e"
    return "t" if STAMP.fullmatch(cell) else "n" if quantity(cell) else "w"


def is_comment(line: str, separator: str) -> bool:
    """Whether a line begins with the sign of a comment."""
    found = _COMMENT.match(line)
    return found is not None and not (found[0].strip() == ";" == separator)


class Kinds(NamedTuple):
    """What the cells of a line hold, by one letter each, and whether it may be a row of a table."""

    letters: str
    is_row: bool

    @property
    def width(self) -> int:
        """Number of cells."""
        return len(self.letters)

    @property
    def least(self) -> int:
        """Number of cells without the empty ones at its end, and of a row without the words there: remarks."""
        return len(self.letters.rstrip("ew" if self.is_row else "e"))


def kinds(line: str, separator: str) -> Kinds:
    """The kinds of a line's cells."""
    letters = "".join(map(kind, split(line, separator)))
    values = letters.count("n") + letters.count("t")
    return Kinds(letters, values > 0 and not is_comment(line, separator))


def separator_of(lines: Sequence[str]) -> str:
    """What separates the cells: the sign by which most lines have equally many cells, all of numbers or times."""
    for line in lines[:3]:
        stated = _SEP_LINE.fullmatch(line)
        if stated:
            return stated[1]
    middle = max(len(lines) // 2, _JUDGED)
    judged = _some(lines[:_JUDGED]) + _some(lines[middle : middle + _JUDGED])
    best, found = (False, 0.0), ""
    for separator in SEPARATORS:
        rows = [row for row in (kinds(line, separator) for line in judged) if row.is_row]
        widths = collections.Counter(row.width for row in rows)
        if not widths:
            continue
        width = max(widths, key=lambda w: (widths[w], w))
        whole = sum("w" not in row.letters for row in rows if row.least <= width <= row.width)
        half = sum(row.letters.count("w") <= row.width / 2 for row in rows if row.least <= width <= row.width)
        score = (width > 1, max(whole, 0.5 * half))
        if score[0] > best[0] or (score[0] == best[0] and score[1] > 1.02 * best[1]):
            best, found = score, separator if width > 1 else ""
            if (
                separator == " "
                and len(widths) > 1
                and all(is_number(line.strip()) for line in judged if line[:1].isdigit())
            ):
                found = ""  # one column, its digits grouped by blanks
    return found


def _some(lines: Sequence[str]) -> list[str]:
    """Lines that are not empty, up to a number of characters."""
    found: list[str] = []
    read = 0
    for line in lines:
        if line.strip():
            found.append(line)
        read += len(line)
        if read > _CHARACTERS:
            break
    return found
