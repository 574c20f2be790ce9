"""Tables of measurements: CSV files of the package, and others of the same form."""

from __future__ import annotations

import io
import math
import os
import pathlib
import zipfile
from collections.abc import Collection, Sequence
from typing import Any

import numpy as np

from evolvent.base import safe_open
from evolvent.base.errors import InputError, counted

Array = np.ndarray


def stored(name: str) -> str:
    """Content of a file of the package."""
    return (pathlib.Path(__file__).with_name("data") / name).read_text(encoding="utf-8")


def texts(folder: str | None, archive: pathlib.Path, kind: str = "") -> list[tuple[str, str]]:
    """Names and contents of CSV files: those of a folder, or, where none is given, those of a ZIP file of the package.

    Parameters
    ----------
    kind : str, with which names of files of the package begin

    Raises
    ------
    InputError
        If the folder is none.
    """
    if folder is None:
        with zipfile.ZipFile(archive) as files:
            return [(one, files.read(one).decode()) for one in sorted(files.namelist()) if one.startswith(kind)]
    if not os.path.isdir(folder):
        raise InputError(f"{folder!r} is not a folder with CSV files")
    return _texts_of(folder)


def _texts_of(folder: str) -> list[tuple[str, str]]:
    """Names and contents of the CSV files of a folder."""
    names = sorted(one for one in os.listdir(folder) if one.endswith(".csv"))
    return [(one, safe_open.text(os.path.join(folder, one))) for one in names]


def head_of(text: str) -> list[str]:
    """Words of the first line of a CSV file."""
    return _cells(text.partition("\n")[0])


def table(file: str, text: str, head: Sequence[str]) -> Array:
    """Rows of a CSV file: (n, columns) float.

    Raises
    ------
    InputError
        If its first line is another one, or a row is none of finite numbers.
    """
    check_head(file, text, head)
    try:
        values = np.loadtxt(io.StringIO(text), delimiter=",", skiprows=1, ndmin=2)
    except ValueError as error:
        raise InputError(f"{file}: it is no table of numbers ({error})") from None
    if len(values) < 2 or not np.all(np.isfinite(values)):
        raise InputError(f"{file}: it needs two rows of finite numbers or more")
    return values


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
    head = head_of(own)
    if data is None:
        return _read("the package's table", own, head, measured, words)
    if not os.path.isdir(data):
        return _read(data, safe_open.text(data), head, measured, words)
    fitting = [(os.path.join(data, name), text) for name, text in _texts_of(data) if head_of(text) == head]
    found = [row for path, text in fitting for row in _read(path, text, head, measured, words)]
    if not found:
        raise InputError(f"{data} has no CSV file whose first line is {','.join(head)}")
    return found


def check_head(name: str, text: str, head: Sequence[str]) -> None:
    """Refuse a CSV file whose first line is another one."""
    if head_of(text) != list(head):
        raise InputError(f"{name}: the first line must be {','.join(head)}")


def _cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.split(",")]


def _read(
    name: str, text: str, head: list[str], measured: Collection[str], words: Collection[str]
) -> list[dict[str, Any]]:
    """Rows of one table."""
    check_head(name, text, head)
    lines, found = text.splitlines(), []
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
