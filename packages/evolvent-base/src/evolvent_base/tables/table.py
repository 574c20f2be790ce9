"""A table of a text file, whose columns are judged when they are asked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np

from evolvent_base.errors import InputError, counted, nearest, visible
from evolvent_base.tables import cells as numbers_of
from evolvent_base.tables.heads import Head
from evolvent_base.tables.layout import rows_of

#: Rows that are parted into cells at a time.
_CHUNK, _FIRST = 16_384, 1000


class TextTable:
    """Columns of a text.

    Attributes
    ----------
    path : str
    names : of the columns, all different; "column 3" where the file states none
    heads : of the columns as they stand in the file, with their units
    units : as the file states them, '' where it states none
    rows : int
    stamps : indices of columns of dates or clocks
    rate : Hz, where the head states one, else None
    start : s, the time of the first row where the head states one, else 0
    notes : sentences on what was left out or taken where the file leaves it open
    """

    def __init__(
        self,
        path: str,
        head: Head,
        lines: Sequence[str],
        numbers: Sequence[int],
        separator: str,
        width: int,
        stamps: Sequence[int] = (),
        marks: Mapping[int, str] = MappingProxyType({}),
    ) -> None:
        self.path, self.rows = path, len(lines)
        self.heads = tuple(visible(one).strip() for one in head.heads)
        self.names = tuple(visible(one) for one in head.names)
        self.units = tuple(visible(one).strip() for one in head.units)
        self.rate, self.start = head.rate, head.start
        self.notes: list[str] = list(head.notes)
        self._lines, self._numbers, self._separator, self._width = lines, numbers, separator, width
        self._stated, self._marks = head.decimal, marks
        self.stamps = tuple(place for place in stamps if place < len(self.names))
        self._parsed: dict[int, np.ndarray] = {}
        self._clean: list[np.ndarray | None] | None = None
        self._usual, self._is_quoted = ".", False
        self._signs: dict[int, bool] = {}
        self._decimals: dict[int, str] = {}

    def index(self, column: str | int, key: str = "column") -> int:
        """Index of a column given by name, by its whole head, or by number from 1; `key` names it in messages.

        Raises
        ------
        InputError
            If there is no such column; it names the nearest.
        """
        if isinstance(column, int):
            if 1 <= column <= len(self.names):
                return column - 1
            raise InputError(
                f"{key} is {column}, but {self.path!r} has {counted(len(self.names), 'column')}, counted from 1: "
                f"{', '.join(self.names)}"
            )
        for known in (self.names, self.heads):
            if column in known:
                return known.index(column)
        raise InputError(f"{key} is {column!r}, which {self.path!r} does not hold; {nearest(column, self.names)}")

    def line(self, row: int) -> int:
        """Number of the line of the file, from 1, that holds a row, counted from 0."""
        return self._numbers[row]

    def words(self, column: str | int) -> list[str]:
        """Cells of a column as they stand."""
        place = self.index(column)
        found: list[str] = []
        for begin in range(0, len(self._lines), _CHUNK):
            found += [row[place].strip() for row in self._rows(self._lines[begin : begin + _CHUNK])]
        return found

    def numbers(self, column: str | int) -> np.ndarray:
        """(rows,) values of a column, NaN where a cell is empty, "NaN", "NA" or "-".

        Raises
        ------
        InputError
            If a cell holds something else, or it is not clear whether a sign is decimal or groups thousands.
        """
        place = self.index(column)
        if place not in self._parsed:
            values = self._fast()[place]
            if values is None or not self._is_sure(place):
                values = self._slow(place)
            values.flags.writeable = False
            self._parsed[place] = values
        return self._parsed[place]

    def is_numeric(self, column: str | int) -> bool:
        """Whether a column holds numbers, and no words."""
        try:
            return not bool(np.all(np.isnan(self.numbers(column))))
        except InputError:
            return False

    def is_empty(self, column: str | int) -> bool:
        """Whether no cell of a column holds anything."""
        values = self._fast()[self.index(column)]
        return (values is None and all(map(numbers_of.is_missing, self.words(column)))) or (
            values is not None and bool(np.all(np.isnan(values)))
        )

    def cell(self, column: str | int, row: int) -> str:
        """One cell as it stands."""
        return self._rows([self._lines[row]])[0][self.index(column)].strip()

    # -------------------------------------------------------------------------------------------- parsing

    def _rows(self, lines: Sequence[str]) -> list[list[str]]:
        """Cells of lines, as many of each."""
        rows = rows_of(lines, self._separator)
        return [row if len(row) >= self._width else row + [""] * (self._width - len(row)) for row in rows]

    def _fast(self) -> list[np.ndarray | None]:
        """Columns of numbers with the usual decimal sign of the file; None of others, which are read cell by cell."""
        if self._clean is None:
            self._usual = self._stated or self._first_sign()
            self._is_quoted = any('"' in line for line in self._lines[:_FIRST])
            parts: list[list[np.ndarray] | None] = [[] for _ in self.names]
            whole: list[int] = []  # columns without empty cells, so far
            begin = 0
            while begin < len(self._lines):
                chunk = self._lines[begin : begin + (_CHUNK if begin else _FIRST)]
                begin += len(chunk)
                found = self._loaded(chunk, [k for k in whole if parts[k] is not None])
                left = [k for k, known in enumerate(parts) if known is not None and k not in found]
                if left:
                    columns = list(zip(*self._rows(chunk), strict=False))
                    found |= {k: numbers_of.values(columns[k], self._usual) for k in left}
                for k, values in found.items():
                    known = parts[k]
                    if known is not None:
                        parts[k] = None if values is None else [*known, values]
                if begin == len(chunk):
                    whole = [k for k, known in enumerate(parts) if known and not np.isnan(known[0]).any()]
            self._clean = [None if known is None else np.concatenate(known) for known in parts]
        return self._clean

    def _first_sign(self) -> str:
        """The decimal sign that is tried first."""
        lines = self._lines[:_FIRST]
        return (
            "," if self._separator != "," and any("," in x for x in lines) and not any("." in x for x in lines) else "."
        )

    def _loaded(self, lines: Sequence[str], places: list[int]) -> dict[int, np.ndarray | None]:
        """Columns of numbers alone, read at once; none of them where one holds something else."""
        if not places or not self._separator or (self._separator == " " and not all(map(str.isascii, lines))):
            return {}
        if self._usual == ",":
            if any("." in line for line in lines):
                return {}
            lines = [line.replace(",", ".") for line in lines]
        delimiter = None if self._separator == " " else self._separator
        try:
            found = np.loadtxt(lines, comments=None, delimiter=delimiter, quotechar='"', usecols=places, ndmin=2)
        except ValueError:
            return {}
        return dict(zip(places, found.T.copy(), strict=True)) if len(found) == len(lines) else {}

    def _has_sign(self, place: int) -> bool:
        """Whether a column that is read at once holds the decimal sign."""
        if place not in self._signs:
            values = self._fast()[place]
            assert values is not None
            known = values[np.isfinite(values)]
            self._signs[place] = bool(np.any(known != np.round(known))) or any(
                self._usual in cell for cell in self.words(place + 1)
            )
        return self._signs[place]

    def _is_sure(self, place: int) -> bool:
        """Whether a column that is read at once can mean nothing else: its signs group no thousands."""
        values = self._fast()[place]
        if values is None:
            return False
        if self._usual == self._stated or (self._separator == "," and self._usual == "." and not self._is_quoted):
            return True
        known = values[np.isfinite(values)]
        below = (np.abs(known) < 1.0) & (known != 0.0)
        with np.errstate(over="ignore", invalid="ignore"):
            finer = np.abs(known * 1e3 - np.round(known * 1e3)) > 1e-6 * np.maximum(1.0, np.abs(known) * 1e-3)
        return bool(np.any(below | finer)) or not self._has_sign(place)

    def _slow(self, place: int) -> np.ndarray:
        """A column by its own texts."""
        texts = self._texts(place)
        decimal = self._decimal(place, texts)
        values, wrong = numbers_of.floats(texts, decimal)
        if wrong >= 0:
            text = texts[wrong]
            if numbers_of.is_number(text):
                other = next(k for k, cell in enumerate(texts) if decimal in cell and numbers_of.is_number(cell))
                raise InputError(
                    f"cannot read {self.path!r}: line {self.line(other)} holds {texts[other]!r} and line "
                    f"{self.line(wrong)} {text!r} in column {self.names[place]!r}; one column has one decimal sign"
                )
            raise InputError(
                f"cannot read {self.path!r}: line {self.line(wrong)} holds {text[:40]!r} in column "
                f"{self.names[place]!r}, where a number must be"
            )
        group = next((cell for cell in texts if numbers_of.is_grouped(cell, decimal)), "")
        if group:
            shown = f"{numbers_of.number(group, decimal):.12g}"
            self._note(f"the cells of {self.names[place]!r} are grouped by thousands: {group!r} is {shown}")
        return values

    def _texts(self, place: int) -> list[str]:
        """Cells of a column without the unit that stands behind each."""
        texts, mark = self.words(place + 1), self._marks.get(place, "")
        return [cell.removesuffix(mark).rstrip() for cell in texts] if mark else texts

    def _note(self, sentence: str) -> None:
        if sentence not in self.notes:
            self.notes.append(sentence)

    def _own_decimal(self, place: int, texts: Sequence[str] | None = None) -> str:
        """The decimal signs that a column may have by its own cells: see `cells.readings`."""
        if place not in self._decimals:
            texts = self._texts(place) if texts is None else texts
            self._decimals[place] = numbers_of.readings(texts)
        return self._decimals[place]

    def _decimal(self, place: int, texts: Sequence[str]) -> str:
        """The decimal sign of a column: by its cells, what the head states, or the other columns."""
        own = self._own_decimal(place, texts)
        if len(own) == 1:
            return own
        if self._stated:
            return self._stated
        if own and not numbers_of.has_sign(texts):
            return "."
        if not own:
            return "."  # cells of both kinds: the first of the other kind is named
        found = {self._vote(k) for k in range(len(self.names)) if k != place} - {""}
        if self._separator == "," and not any("," in cell for cell in texts):
            found = found or {"."}
        if len(found) == 1:
            return found.pop()
        row, text = next((k, cell) for k, cell in enumerate(texts) if ("." in cell or "," in cell))
        sign = "'.'" if "." in text else "','"
        bare = text.replace(".", "").replace(",", "")
        raise InputError(
            f"cannot read {self.path!r}: line {self.line(row)} holds {text!r} in column {self.names[place]!r}; the "
            f"file does not show whether {sign} is the decimal sign or groups thousands; write {bare}, or {text + '0'}"
        )

    def _vote(self, place: int) -> str:
        """The decimal sign that a column shows, or ''."""
        if self._is_sure(place):
            return self._usual if self._has_sign(place) else ""
        texts = self._texts(place)
        found = self._own_decimal(place, texts)
        return found if len(found) == 1 and numbers_of.has_sign(texts) else ""
