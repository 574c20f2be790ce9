"""What every reader returns."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from evolvent.errors import InputError, nearest


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
    """

    names: tuple[str, ...]
    data: np.ndarray
    units: tuple[str, ...]
    rate: float | None
    path: str
    format: str
    sha256: str

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
        if column not in self.names:
            raise InputError(f"{key} is {column!r}, which {self.path!r} does not hold; {nearest(column, self.names)}")
        return self.names.index(column)

    def column(self, column: str | int) -> np.ndarray:
        """(N,) the samples of one column."""
        return np.asarray(self.data[:, self.index(column)])
