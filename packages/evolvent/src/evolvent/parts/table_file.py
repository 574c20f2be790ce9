"""Curves from files: rows [angle, torque] or [travel, force] of a text whose columns name their units."""

from __future__ import annotations

import contextlib

import numpy as np
from pydantic_core import PydanticCustomError

from evolvent_base import safe_open, tables
from evolvent_base.errors import InputError
from evolvent_base.units import UnitError, file_unit

#: What the two columns hold, and its units.
_COLUMNS = {"an angle or a travel": ("rad", "m"), "a torque or a force": ("N m", "N")}


def rows_of(path: str) -> list[list[str]]:
    """Rows of a curve, each value with the unit of its column.

    Parameters
    ----------
    path : str, of a file with a column of angles or travels and one of torques or forces, found by their units;
        other columns are not read

    Raises
    ------
    PydanticCustomError
        Naming the file, and the line and the value that cannot be read.
    """
    try:
        return _rows(path)
    except InputError as error:
        raise PydanticCustomError("table", "{why}", {"why": str(error)}) from None


def _rows(path: str) -> list[list[str]]:
    if not path.lower().endswith(tables.ENDINGS):
        raise InputError(f"{path!r} is neither a list of rows nor a file that ends with {' or '.join(tables.ENDINGS)}")
    table = tables.read(safe_open.content(path, most=safe_open.LARGEST_TEXT), path, whole=True)
    columns = []
    for what, wanted in _COLUMNS.items():
        place, unit = _column(table, what, wanted)
        values = table.numbers(place + 1)
        wrong = np.flatnonzero(~np.isfinite(values))
        if wrong.size:
            row = int(wrong[0])
            raise InputError(
                f"line {table.line(row)} of {path!r} has {table.cell(place + 1, row)!r}; it must be a number"
            )
        columns.append([f"{float(value)!r} {unit}" for value in values])
    return [list(row) for row in zip(*columns, strict=True)]


def _column(table: tables.TextTable, what: str, wanted: tuple[str, ...]) -> tuple[int, str]:
    """Place and unit of the only column of a kind."""
    found = {}
    for place, text in enumerate(table.units):
        with contextlib.suppress(UnitError):
            found[place] = file_unit(text, *wanted)
    found = {place: unit for place, unit in found.items() if unit}
    if len(found) == 1:
        return found.popitem()
    if found:
        names = ", ".join(repr(table.heads[place]) for place in found)
        raise InputError(f"{table.path!r} has {len(found)} columns of {what}: {names}; leave one of them")
    named = ", ".join(repr(head) for head in table.heads if head) or "no names"
    raise InputError(
        f"the head of {table.path!r}, {named}, has no column in a unit of {what}; it must name two columns with their "
        "units, such as angle (deg),torque (N m)"
    )
