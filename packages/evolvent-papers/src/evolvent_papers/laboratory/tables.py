"""Tables of measurements: CSV files of the package, and others with the same columns."""

from __future__ import annotations

import os
import pathlib
import zipfile
from collections.abc import Collection, Sequence
from typing import Any

import numpy as np

from evolvent_base import safe_open, tables
from evolvent_base.errors import InputError

Array = np.ndarray


def stored(name: str) -> bytes:
    """Content of a file of the package."""
    return (pathlib.Path(__file__).with_name("data") / name).read_bytes()


def contents(folder: str | None, archive: pathlib.Path, kind: str = "") -> list[tuple[str, bytes]]:
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
            return [(one, files.read(one)) for one in sorted(files.namelist()) if one.startswith(kind)]
    if not os.path.isdir(folder):
        raise InputError(f"{folder!r} is not a folder with CSV files")
    names = sorted(one for one in os.listdir(folder) if one.lower().endswith(".csv"))
    return [(one, _content(os.path.join(folder, one))) for one in names]


def _content(path: str) -> bytes:
    return safe_open.content(path, most=safe_open.LARGEST_TEXT)


def having(files: Sequence[tuple[str, bytes]], head: Sequence[str], where: str) -> list[tuple[str, bytes]]:
    """Of files, name and content, those that are tables with these columns, in any order; `where` they are.

    Raises
    ------
    InputError
        If there is none.
    """

    def has(name: str, raw: bytes) -> bool:
        try:
            return set(tables.read(raw, name).heads) == set(head)
        except InputError:
            return False

    found = [(name, raw) for name, raw in files if has(name, raw)]
    if not found:
        raise InputError(f"{where} has no CSV file with the columns {','.join(head)} and rows below them")
    return found


def _read(name: str, raw: bytes, head: Sequence[str]) -> tables.TextTable:
    found = tables.read(raw, name, whole=True)
    if set(found.heads) != set(head):
        raise InputError(f"{name}: the columns must be {','.join(head)}")
    return found


def table(name: str, raw: bytes, head: Sequence[str]) -> Array:
    """Rows of a CSV file with these columns: (n, columns) float, in the order of `head`.

    Raises
    ------
    InputError
        If it has other columns, or a row is none of finite numbers.
    """
    found = _read(name, raw, head)
    values = np.column_stack([found.numbers(column) for column in head])
    if len(values) < 2 or not np.all(np.isfinite(values)):
        raise InputError(f"{name}: it needs two rows of finite numbers or more")
    return values


def rows_of(
    own: bytes, data: str | None, *, measured: Collection[str], words: Collection[str] = ()
) -> list[dict[str, Any]]:
    """Rows of the package's table, or of other files with its columns.

    Parameters
    ----------
    own : the package's table; its head names the columns
    data : str, file, or folder of which every CSV file with these columns is read; None for the package's table
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
    head = tables.read(own, "the package's table").heads
    if data is None:
        return rows("the package's table", own, head, measured, words)
    if not os.path.isdir(data):
        return rows(data, _content(data), head, measured, words)
    files = having(contents(data, pathlib.Path()), head, data)
    return [row for name, raw in files for row in rows(os.path.join(data, name), raw, head, measured, words)]


def rows(
    name: str, raw: bytes, head: Sequence[str], measured: Collection[str], words: Collection[str]
) -> list[dict[str, Any]]:
    """Rows of one table; arguments and errors as of `rows_of`."""
    found = _read(name, raw, head)
    columns: list[list[Any]] = []
    for column in head:
        if column in words:
            columns.append(found.words(column))
            continue
        values = found.numbers(column)
        wrong = np.flatnonzero(np.isinf(values) if column in measured else ~np.isfinite(values))
        if wrong.size:
            row, empty = int(wrong[0]), ", or empty where nothing is measured" * (column in measured)
            raise InputError(
                f"{name}: {column} in line {found.line(row)} is {found.cell(column, row)!r}; it must be a finite "
                f"number{empty}"
            )
        columns.append(values.tolist())
    return [dict(zip(head, row, strict=True)) for row in zip(*columns, strict=True)]
