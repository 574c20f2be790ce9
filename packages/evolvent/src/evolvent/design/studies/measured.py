"""Measured values of a key in a column of a file: the distribution ``table(FILE.csv)`` or ``table(FILE.csv, COLUMN)``.

The values stand for the file from then on: a study that is kept holds them, and runs again without the file.
"""

from __future__ import annotations

import pathlib
from collections.abc import Callable, Collection, Mapping
from typing import Any

import numpy as np

from evolvent_base import safe_open, schema, tables
from evolvent_base.errors import InputError
from evolvent_base.units import UnitError, file_unit

#: How the distribution begins.
_BEGIN = "table("
#: Most values of a table.
MOST = 10_000


def file_of(given: Any) -> tuple[str, str] | None:
    """File and column ('' for none) of a distribution's text; None where it names no file."""
    text = given.strip() if isinstance(given, str) else ""
    if not (text.startswith(_BEGIN) and text.endswith(")")):
        return None
    file, _, column = (part.strip() for part in text[len(_BEGIN) : -1].partition(","))
    return (file, column) if file.lower().endswith(tables.ENDINGS) else None


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


class Tables:
    """The files of a study's distributions, each read once.

    Parameters
    ----------
    folder : pathlib.Path, in which, or below which, files that the study names must be
    trusted : texts of distributions whose files are named from the current folder on, and may be anywhere
    """

    def __init__(self, folder: pathlib.Path, trusted: Collection[Any] = ()) -> None:
        self._folder, self._trusted = folder, [one for one in trusted if file_of(one)]
        self._read: dict[str, dict[str | None, list[str]]] = {}  # distribution -> unit of a key -> values

    def values(self, where: str, given: str, unit: str | None = None) -> list[str]:
        """The values of a column with the unit of its head, as a distribution lists them.

        Parameters
        ----------
        where : str, the key that varies, for messages
        given : str, the distribution, which names a file
        unit : str, of the key; None for a column of any quantity

        Raises
        ------
        InputError
            One sentence that names the file, and the column or the row.
        """
        known = self._read.setdefault(given, {})
        if unit not in known:
            try:
                known[unit] = self._values(given, unit)
            except InputError as error:
                raise InputError(f"{where} is {schema.shown(given)}; {error}") from None
        return known[unit]

    def _values(self, given: str, wanted: str | None) -> list[str]:
        found = file_of(given)
        assert found is not None
        name, column = found
        table = tables.read(safe_open.content(self._path(name, given), most=safe_open.LARGEST_TEXT), name, whole=True)
        if table.rows > MOST:
            raise InputError(f"{name!r} has {table.rows} values; at most {MOST} are taken")
        if not column and len(table.names) > 1:
            named = any(table.heads)
            listed = f"the columns {', '.join(map(repr, table.names))}" if named else f"{len(table.names)} columns"
            raise InputError(f"{name!r} has {listed}; name one, as in table({name}, {table.names[0]})")
        place = table.index(column) if column else 0
        values = table.numbers(place + 1)
        wrong = np.flatnonzero(~np.isfinite(values))
        if wrong.size:
            row = int(wrong[0])
            raise InputError(f"{name!r}, line {table.line(row)}: {table.cell(place + 1, row)[:40]!r} is not a number")
        try:
            unit = file_unit(table.units[place], *([] if wanted is None else [wanted]))
        except UnitError as error:
            raise InputError(f"{name!r}, column {table.heads[place]!r}: {error}") from None
        return [f"{float(value)!r} {unit}".strip() for value in values]

    def _path(self, name: str, given: str) -> pathlib.Path:
        if given in self._trusted:
            return pathlib.Path(name)
        path = (self._folder / name).resolve()
        if not path.is_relative_to(self._folder.resolve()):
            raise InputError(f"{name!r} must be in the folder of its study, or below")
        return path

    def in_place(self, over: Mapping[str, Any]) -> dict[str, Any]:
        """The keys that vary, with the values, which have been read, in the place of their files."""
        return {key: given if file_of(given) is None else _text(next(iter(self._read[given].values())))
                for key, given in over.items()}  # fmt: skip
