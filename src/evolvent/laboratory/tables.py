"""Tables of measurements: CSV files of the package, and others of the same form."""

from __future__ import annotations

import math
import os
import pathlib
from collections.abc import Collection
from typing import Any

from evolvent.base import safe_open
from evolvent.base.errors import InputError, counted


def stored(name: str) -> str:
    """Content of a file of the package."""
    return (pathlib.Path(__file__).with_name("data") / name).read_text(encoding="utf-8")


def rows_of(
    own: str, data: str | None, *, measured: Collection[str], words: Collection[str] = ()
) -> list[dict[str, Any]]:
    """Rows of the package's table, or of other files with its first line.

    Parameters
    ----------
    own : str, the package's table; its first line names the columns
    data : str, file, or folder of which every CSV file with that first line is read; None for the package's table
    measured : names of the columns of measured values, which may be left out: of quantities that are predicted alone
    words : names of columns that hold words

    Returns
    -------
    list of dict
        Column to float, or to str; NaN where a measured value is left out.

    Raises
    ------
    InputError
        If there is no such file, or one cannot be read; the sentence names the line.
    """
    head = _cells(own.splitlines()[0])
    if data is None:
        return _read("the package's table", own, head, measured, words)
    if not os.path.isdir(data):
        return _read(data, safe_open.text(data), head, measured, words)
    paths = [os.path.join(data, one) for one in sorted(os.listdir(data)) if one.endswith(".csv")]
    texts = {path: safe_open.text(path) for path in paths}
    fitting = {path: text for path, text in texts.items() if _cells(text.partition("\n")[0]) == head}
    found = [row for path, text in fitting.items() for row in _read(path, text, head, measured, words)]
    if not found:
        raise InputError(f"{data} has no CSV file whose first line is {','.join(head)}")
    return found


def _cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.split(",")]


def _read(
    name: str, text: str, head: list[str], measured: Collection[str], words: Collection[str]
) -> list[dict[str, Any]]:
    """Rows of one table."""
    lines = text.splitlines()
    if not lines or _cells(lines[0]) != head:
        raise InputError(f"{name}: the first line must be {','.join(head)}")
    found = []
    for number, line in enumerate(lines[1:], 2):
        if not line.strip():
            continue
        cells = _cells(line)
        if len(cells) != len(head):
            raise InputError(f"{name}: line {number} has {counted(len(cells), 'value')}; it must have {len(head)}")
        row: dict[str, Any] = {}
        for column, cell in zip(head, cells, strict=True):
            where = f"{name}: {column} in line {number}"
            row[column] = cell if column in words else _number(cell, where, empty=column in measured)
        found.append(row)
    if not found:
        raise InputError(f"{name} has no rows")
    return found


def _number(cell: str, where: str, *, empty: bool) -> float:
    if empty and not cell:
        return math.nan
    try:
        value = float(cell)
    except ValueError:
        value = math.inf
    if not math.isfinite(value):
        raise InputError(
            f"{where} is {cell!r}; it must be a finite number{', or empty where nothing is measured' * empty}"
        )
    return value
