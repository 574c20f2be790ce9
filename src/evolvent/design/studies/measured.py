"""Measured values of a key in a column of a file: the distribution ``table(FILE.csv)`` or ``table(FILE.csv, COLUMN)``.

The values stand for the file from then on: a study that is kept holds them, and runs again without the file.
"""

from __future__ import annotations

import csv
import math
import pathlib
from collections.abc import Callable, Collection, Mapping
from typing import Any

from evolvent.base import safe_open, schema
from evolvent.base.errors import InputError, nearest
from evolvent.base.units import head_and_unit

#: Endings of files of values, and how the distribution begins.
ENDINGS, _BEGIN = (".csv", ".tsv", ".txt"), "table("
#: Most values of a table.
MOST = 10_000


def file_of(given: Any) -> tuple[str, str] | None:
    """File and column ('' for none) of a distribution's text; None where it names no file."""
    text = given.strip() if isinstance(given, str) else ""
    if not (text.startswith(_BEGIN) and text.endswith(")")):
        return None
    file, _, column = (part.strip() for part in text[len(_BEGIN) : -1].partition(","))
    return (file, column) if file.lower().endswith(ENDINGS) else None


def renamed(over: Any, name: Callable[[str], str]) -> Any:
    """The keys that vary, with the files of their distributions named by a function of their names."""
    if not isinstance(over, Mapping):
        return over
    found = {}
    for key, given in over.items():
        file = file_of(given)
        found[key] = given if file is None else _text([name(file[0]), *filter(None, file[1:])])
    return found


def _text(arguments: list[str]) -> str:
    return f"{_BEGIN}{', '.join(arguments)})"


def _rows(text: str) -> list[tuple[int, list[str]]]:
    """Lines with anything in them, each by its number from 1, and their cells; lines that begin with # are left out."""
    lines = [line if line.strip() and not line.lstrip().startswith("#") else "" for line in text.split("\n")]
    first = next((line for line in lines if line), "")
    separator = next((sign for sign in "\t;" if sign in first), ",")
    read = (next(csv.reader([line], delimiter=separator, skipinitialspace=True), []) for line in lines)
    return [(k, [cell.strip() for cell in cells]) for k, cells in enumerate(read, start=1) if cells]


def _is_number(cell: str) -> bool:
    try:
        return math.isfinite(float(cell))
    except ValueError:
        return False


class Tables:
    """The files of a study's distributions, each read once.

    Parameters
    ----------
    folder : pathlib.Path, in which, or below which, files that the study names must be
    trusted : texts of distributions whose files are named from the current folder on, and may be anywhere
    """

    def __init__(self, folder: pathlib.Path, trusted: Collection[Any] = ()) -> None:
        self._folder, self._trusted = folder, [one for one in trusted if file_of(one)]
        self._read: dict[str, list[str]] = {}

    def values(self, where: str, given: str) -> list[str]:
        """The values of a column with the unit of its head, as a distribution lists them.

        Parameters
        ----------
        where : str, the key that varies, for messages
        given : str, the distribution, which names a file

        Raises
        ------
        InputError
            One sentence that names the file, and the column or the row.
        """
        if given not in self._read:
            try:
                self._read[given] = self._values(given)
            except InputError as error:
                raise InputError(f"{where} is {schema.shown(given)}; {error}") from None
        return self._read[given]

    def _values(self, given: str) -> list[str]:
        found = file_of(given)
        assert found is not None
        name, column = found
        try:
            rows = _rows(safe_open.text(self._path(name, given)))
        except csv.Error as error:
            raise InputError(f"cannot read {name!r}: {error}") from None
        head = [head_and_unit(cell) for cell in rows[0][1]] if rows and not any(map(_is_number, rows[0][1])) else []
        names, rows = [title for title, _ in head], rows[bool(head) :]
        width = len(head) or (len(rows[0][1]) if rows else 1)
        if not rows:
            raise InputError(f"{name!r} holds no values")
        if len(rows) > MOST:
            raise InputError(f"{name!r} has {len(rows)} values; at most {MOST} are taken")
        if column and column not in names:
            raise InputError(f"{name!r} has no column {column!r}; {nearest(column, names)}")
        if not column and width > 1:
            listed = f"the columns {', '.join(map(repr, names))}" if names else f"{width} columns without names"
            raise InputError(f"{name!r} has {listed}; name one, as in table({name}, {names[0] if names else 'NAME'})")
        place = names.index(column) if column else 0
        unit = head[place][1] if head else ""
        for row, cells in rows:
            if len(cells) != width:
                raise InputError(f"{name!r}, row {row}, has {len(cells)} cells; the table has {width} columns")
            if not _is_number(cells[place]):
                raise InputError(f"{name!r}, row {row}: {cells[place][:40]!r} is not a number")
        return [f"{cells[place]} {unit}".strip() for _, cells in rows]

    def _path(self, name: str, given: str) -> pathlib.Path:
        if given in self._trusted:
            return pathlib.Path(name)
        path = (self._folder / name).resolve()
        if not path.is_relative_to(self._folder.resolve()):
            raise InputError(f"{name!r} must be in the folder of its study, or below")
        return path

    def in_place(self, over: Mapping[str, Any]) -> dict[str, Any]:
        """The keys that vary, with the values in the place of their files."""
        return {key: given if file_of(given) is None else _text(self.values(f"over.{key}", given))
                for key, given in over.items()}  # fmt: skip
