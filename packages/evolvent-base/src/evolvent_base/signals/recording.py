"""What every reader returns: columns that are judged when their samples are asked for."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from evolvent_base.errors import InputError, counted, nearest, visible

#: Names that a sentence lists at most.
_LISTED = 8


@dataclass(frozen=True, eq=False)
class Column:
    """Samples of one name, with what the file states of them.

    Attributes
    ----------
    name : str, different from those of the other columns of a file
    size : int, samples
    samples : () -> (size,) float, NaN where one is missing; raises InputError where they are no numbers
    unit : '' where the file states none
    rate : Hz, where the file states one, else None
    start : s, the time of the first sample by the file; it belongs to `rate`
    times : name of the column that holds its times by a statement of the file, '' without one
    path : its name with those of its groups, where `name` is another
    group : names of the group, struct or data set that it lies in, from the outermost
    notes : sentences on what was taken where the file leaves it open
    """

    name: str
    size: int
    samples: Callable[[], np.ndarray]
    unit: str = ""
    rate: float | None = None
    start: float = 0.0
    times: str = ""
    path: str = ""
    group: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def column(name: str, samples: np.ndarray, unit: str = "", **stated: object) -> Column:
    """A column whose samples are in memory; see `Column` for what is `stated`."""
    values = np.asarray(samples).ravel()
    return Column(name, values.size, lambda: values.astype(float), unit, **stated)  # type: ignore[arg-type]


@dataclass(frozen=True, eq=False)
class Signals:
    """Columns of numbers as a file holds them. Nothing is judged before it is asked for.

    Attributes
    ----------
    columns : of numbers, their names all different
    path : of the file
    format : "CSV", "TDMS", "UFF 58", "MAT", "HDF5", "WAV" or "run"
    sha256 : of the file's bytes, hexadecimal
    left_out : names that the file has beside these -> why they are no columns of numbers
    notes : sentences on the file, to which reading of a column may add
    places : names of all columns of a table in its order, by which they are counted; () for those of `columns`
    """

    columns: tuple[Column, ...]
    path: str
    format: str
    sha256: str
    left_out: Mapping[str, str] = field(default_factory=dict)
    notes: Sequence[str] = ()
    places: Sequence[str] = ()

    @classmethod
    def of(
        cls,
        names: Sequence[str],
        data: np.ndarray,
        units: Sequence[str],
        rate: float | None,
        *,
        path: str,
        format: str = "data",  # noqa: A002
        sha256: str = "",
    ) -> Signals:
        """Columns (N, c) of one rate that are no file's."""
        rows = zip(names, np.asarray(data).T, units, strict=True)
        return cls(tuple(column(n, x, unit, rate=rate) for n, x, unit in rows), path, format, sha256)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns."""
        return tuple(one.name for one in self.columns)

    @property
    def units(self) -> tuple[str, ...]:
        """Units of the columns as the file states them, '' where it states none."""
        return tuple(one.unit for one in self.columns)

    @property
    def rate(self) -> float | None:
        """Hz, where the file states one and the same rate of all columns, else None."""
        rates = {one.rate for one in self.columns}
        return rates.pop() if len(rates) == 1 else None

    @property
    def data(self) -> np.ndarray:
        """(N, c) the samples of all columns.

        Raises
        ------
        InputError
            If they are not equally many, or a column holds something else than numbers.
        """
        if len({one.size for one in self.columns}) > 1:
            sizes = ", ".join(f"{one.name}: {one.size}" for one in self.columns[:_LISTED])
            raise InputError(f"cannot read {self.path!r}: its columns have unequal numbers of samples ({sizes})")
        return np.column_stack([self.column(name) for name in self.names])

    def index(self, column: str | int, key: str = "column") -> int:
        """Index of a column given by name, or by number from 1; `key` names it in messages.

        A name without those of its groups is enough where only one column ends so.

        Raises
        ------
        InputError
            If there is no such column; it names the nearest.
        """
        if isinstance(column, int):
            known = self.places or self.names
            if not 1 <= column <= len(known):
                raise InputError(
                    f"{key} is {column}, but {self.path!r} has {counted(len(known), 'column')}, counted from 1: "
                    f"{', '.join(known)}"
                )
            column = known[column - 1]
        if column in self.left_out:
            raise InputError(f"{key} is {column!r}, which is no signal in {self.path!r}: {self.left_out[column]}")
        if column in self.names:
            return self.names.index(column)
        paths = [one.path for one in self.columns]
        if column in paths:
            return paths.index(column)
        ends = [
            k for k, one in enumerate(self.columns) if (one.path or one.name).endswith((f"/{column}", f".{column}"))
        ]
        if len(ends) == 1:
            return ends[0]
        raise InputError(f"{key} is {column!r}, which {self.path!r} does not hold; {nearest(column, self.names)}")

    def samples(self, k: int) -> np.ndarray:
        """(N,) the samples of the column of index k; see `column`."""
        one = self.columns[k]
        values = one.samples()
        if np.isinf(values).any():
            place = int(np.argmax(np.isinf(values))) + 1
            raise InputError(f"cannot read {self.path!r}: sample {place} of {visible(one.name)!r} is infinite")
        return values

    def column(self, column: str | int) -> np.ndarray:
        """(N,) the samples of one column.

        Raises
        ------
        InputError
            If there is no such column, or a sample of it is no finite number.
        """
        return self.samples(self.index(column))
