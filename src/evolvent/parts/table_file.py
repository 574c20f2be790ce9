"""Tables of two columns from files: comma-separated values whose first line names the columns with their units."""

from __future__ import annotations

import csv
import math

from pydantic_core import PydanticCustomError

from evolvent.base import safe_open
from evolvent.base.errors import InputError
from evolvent.base.units import head_and_unit

#: Ending of such a file.
ENDING = ".csv"


def rows_of(path: str) -> list[list[str]]:
    """Rows of a table, each value with the unit of its column.

    Parameters
    ----------
    path : str, of a file such as ``angle (deg),torque (N m)``, then a line for each row; empty lines and those that
        begin with # are passed over

    Raises
    ------
    PydanticCustomError
        Naming the file, and the line and the value that cannot be read.
    """
    if not path.endswith(ENDING):
        raise _error(f"{path!r} is neither a list of rows nor a file that ends with {ENDING}")
    try:
        text = safe_open.text(path)
    except InputError as error:
        raise _error(str(error)) from None
    try:
        rows = list(csv.reader(text.removeprefix("\ufeff").splitlines()))
    except csv.Error as error:
        raise _error(f"cannot read {path!r}: {error}") from None
    lines = [
        (k, [value.strip() for value in row])
        for k, row in enumerate(rows, start=1)
        if any(value.strip() for value in row) and not row[0].lstrip().startswith("#")
    ]
    units = [head_and_unit(head)[1] for head in (lines or [(0, [])])[0][1]]
    if len(units) != 2 or not all(units):
        raise _error(
            f"the first line of {path!r} must name two columns with their units, such as angle (deg),torque (N m)"
        )
    return [_row(path, k, values, units) for k, values in lines[1:]]


def _row(path: str, k: int, values: list[str], units: list[str]) -> list[str]:
    if len(values) != 2:
        raise _error(f"line {k} of {path!r} has {len(values)} values; it must have two")
    for value in values:
        try:
            finite = math.isfinite(float(value))
        except ValueError:
            finite = False
        if not finite:
            raise _error(f"line {k} of {path!r} has {value!r}; it must be a number")
    return [f"{value} {unit}" for value, unit in zip(values, units, strict=True)]


def _error(why: str) -> PydanticCustomError:
    return PydanticCustomError("table", "{why}", {"why": why})
