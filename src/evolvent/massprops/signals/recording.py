"""What every reader returns."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from evolvent.base.errors import InputError, nearest


def distinct(names: Iterable[str]) -> list[str]:
    """Names, a number behind those that stand twice, and behind "column" in place of an empty one."""
    taken: set[str] = set()
    last: dict[str, int] = {}
    found: list[str] = []
    for name in names:
        name = name.strip() or f"column {len(found) + 1}"
        fresh = name
        while fresh in taken:
            last[name] = last.get(name, 1) + 1
            fresh = f"{name} ({last[name]})"
        taken.add(fresh)
        found.append(fresh)
    return found


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


@dataclass(frozen=True, eq=False)
class Signals:
    """Columns of numbers as a file holds them.

    Attributes
    ----------
    names : c names, all different
    data : (N, c) float, NaN where a sample is missing
    units : c units as the file states them, '' where it states none
    rate : Hz, where the file states one, else None
    path : of the file
    format : "CSV", "TDMS", "UFF 58", "MAT", "HDF5", "WAV" or "run"
    sha256 : of the file's bytes, hexadecimal
    left_out : columns that are not among them -> what they hold instead of numbers
    """

    names: tuple[str, ...]
    data: np.ndarray
    units: tuple[str, ...]
    rate: float | None
    path: str
    format: str
    sha256: str
    left_out: Mapping[str, Words] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.data.flags.writeable = False

    def index(self, column: str | int, key: str = "column") -> int:
        """Index of a column given by name, or by number from 1; `key` names it in messages.

        Raises
        ------
        InputError
            If there is no such column; it names the nearest.
        """
        if isinstance(column, int):
            if 1 <= column <= len(self.names):
                return column - 1
            raise InputError(
                f"{key} is {column}, but {self.path!r} has {len(self.names)} columns, counted from 1: "
                f"{', '.join(self.names)}"
            )
        if column in self.left_out:
            raise InputError(f"{key} is {column!r}, which is no signal in {self.path!r}: {self.left_out[column]}")
        if column not in self.names:
            raise InputError(f"{key} is {column!r}, which {self.path!r} does not hold; {nearest(column, self.names)}")
        return self.names.index(column)

    def column(self, column: str | int) -> np.ndarray:
        """(N,) the samples of one column."""
        return np.asarray(self.data[:, self.index(column)])
