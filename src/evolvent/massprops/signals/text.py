"""CSV and its like: the separator, the decimal sign, names and units are found from the text."""

from __future__ import annotations

import io
import re
from typing import NamedTuple

import numpy as np

from evolvent.base import units as texts
from evolvent.base.errors import InputError
from evolvent.massprops.signals.recording import distinct

_MISSING = ("", "nan", "na", "n/a", "null", "none", "-", "--")
_NUMBER = re.compile(r"[-+]?(\d+([.,]\d*)?|[.,]\d+)([eEdD][-+]?\d+)?")
#: Lines that may stand before the numbers, and lines from one on by which the separator is judged.
_PREAMBLE, _FOLLOWING = 200, 20


class Words(NamedTuple):
    """A column that is no signal, since at least half of its cells are no numbers.

    Attributes
    ----------
    words, rows : int, cells that hold words, and all
    numbers : int, cells that hold a number
    line : int, in the file, of the first word
    first : str, that word
    """

    words: int
    rows: int
    numbers: int
    line: int
    first: str

    def __str__(self) -> str:
        return f"{self.words} of its {self.rows} cells are words, the first in line {self.line}: {self.first!r}"


def read_text(raw: bytes, name: str) -> tuple[dict[str, np.ndarray], dict[str, str], None, dict[str, Words]]:
    """Columns and units of a text, and its columns of words; names such as 'left (mm)' or 'left [mm]' hold their unit.

    Raises
    ------
    InputError
        If it is no table of numbers; a wrong entry is named by its line.
    """
    text = _decoded(raw, name)
    lines = text.splitlines()
    separator, first = _layout(lines, name)
    width = len(_split(lines[first], separator))
    above = [_split(line, separator) for line in lines[:first] if line.strip() and not _comment(line, separator, width)]
    titles = [row for row in above if len(row) == width]
    if not titles and lines[:first]:  # names may be parted by another sign than the numbers
        others = [_split(lines[first - 1], sign) for sign in "\t;," if sign != separator]
        titles = [row for row in others if len(row) == width > 1]
    heads, marks = (titles[-2], titles[-1]) if _units_row(titles) else (titles[-1] if titles else [], [])
    columns = _numbers(lines[first:], separator, width, name, first)
    named = [texts.head_and_unit(head.lstrip("#% ")) for head in heads] if heads else [("", "")] * width
    names = distinct(title for title, _ in named)
    units = {
        n: unit or (marks[c].strip("[]() ") if marks else "")
        for c, (n, (_, unit)) in enumerate(zip(names, named, strict=True))
    }
    found = dict(zip(names, columns, strict=True))
    kept = {n: column for n, column in found.items() if not isinstance(column, Words)}
    if not kept:
        raise InputError(f"cannot read {name!r}: no column of it holds numbers")
    return kept, units, None, {n: column for n, column in found.items() if isinstance(column, Words)}


def _decoded(raw: bytes, name: str) -> str:
    encodings = ("utf-16",) if raw.startswith((b"\xff\xfe", b"\xfe\xff")) else ("utf-8-sig", "cp1252")
    for encoding in encodings:
        try:
            return raw.decode(encoding)
        except UnicodeDecodeError:
            continue
    raise InputError(f"cannot read {name!r}: it is not a text file")


def _split(line: str, separator: str) -> list[str]:
    cells = line.split() if separator == " " else line.split(separator)
    return [cell.strip().strip('"').strip() for cell in cells]


def _comment(line: str, separator: str, width: int) -> bool:
    return line.lstrip().startswith(("#", "%", "//")) and len(_split(line, separator)) != width


class _Row(NamedTuple):
    """How many cells a line has; whether it holds data: a number at least, and no more words than numbers; no words."""

    cells: int
    is_row: bool
    whole: bool


def _row(line: str, separator: str) -> _Row:
    cells = _split(line, separator)
    numbers = sum(bool(_NUMBER.fullmatch(cell)) for cell in cells)
    words = sum(not _NUMBER.fullmatch(cell) and cell.lower() not in _MISSING for cell in cells)
    return _Row(len(cells), numbers > 0 and words <= numbers, words == 0)


def _layout(lines: list[str], name: str) -> tuple[str, int]:
    """Separator and the first line of data: the separator that gives most cells in the same number on each line."""
    best: tuple[bool, bool, int] | None = None
    found = ("", 0)
    for separator in ("\t", ";", ",", " "):
        rows = [_row(line, separator) if line.strip() else None for line in lines[: _PREAMBLE + _FOLLOWING]]
        for k, row in enumerate(rows[:_PREAMBLE]):
            if row is None or not row.is_row:
                continue
            following = [more for more in rows[k : k + _FOLLOWING] if more is not None]
            even = all(more.cells == row.cells and more.is_row for more in following[:8])
            score = (row.cells > 1, all(more.whole for more in following), row.cells)
            if even and len(following) > 1 and (best is None or score > best):
                best, found = score, (separator, k)
            if even:
                break
    if best is None:
        raise InputError(f"cannot read {name!r}: it is no table of numbers of two lines or more")
    return found


def _units_row(titles: list[list[str]]) -> bool:
    """Whether the last title line is one of units: short words below the line of names."""
    if len(titles) < 2:
        return False
    return all(len(cell) <= 8 for cell in titles[-1]) and not all(cell == "" for cell in titles[-1])


def _numbers(lines: list[str], separator: str, width: int, name: str, first: int) -> list[np.ndarray | Words]:
    """Columns as floats; `Words` for one of which at least half the cells are no numbers, words among them."""
    import pandas as pd

    comma = separator != "," and not any("." in line for line in lines[:50]) and any("," in line for line in lines[:50])
    try:
        table = pd.read_csv(
            io.StringIO("\n".join(lines)),
            sep=r"\s+" if separator == " " else separator,
            header=None,
            names=list(range(width)),
            index_col=False,
            decimal="," if comma else ".",
            na_values=list(_MISSING),
            skipinitialspace=True,
            on_bad_lines="error",
            low_memory=False,
        )
    except (pd.errors.ParserError, ValueError) as error:
        match = re.search(r"line (\d+)", str(error))
        where = f"line {int(match[1]) + first} has more cells than the {width} of the others" if match else str(error)
        raise InputError(f"cannot read {name!r}: {where}") from None
    found: list[np.ndarray | Words] = []
    for c in range(width):
        column = table[c]
        values = pd.to_numeric(column, errors="coerce").to_numpy(dtype=float)
        wrong = np.flatnonzero(np.isnan(values) & column.notna().to_numpy())
        if not wrong.size:
            found.append(values)
            continue
        line, cell = first + 1 + int(wrong[0]), str(column.iloc[wrong[0]])[:40]
        if np.isnan(values).sum() < len(values) // 2:
            raise InputError(
                f"cannot read {name!r}: line {line} holds {cell!r} in column {c + 1}, where a number must be"
            )
        found.append(Words(wrong.size, len(values), int(np.sum(~np.isnan(values))), line, cell))
    return found
