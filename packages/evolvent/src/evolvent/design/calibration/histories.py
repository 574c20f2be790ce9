"""The values of one column over time: in the order of time, without rows that stand twice, and unwrapped."""

from __future__ import annotations

import dataclasses
import functools
import itertools
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from evolvent_base import units
from evolvent_base.errors import InputError, counted
from evolvent_base.tables import mark_of_missing

Array = np.ndarray
#: Share of rows at the time of the row before, with other values, above which the times are too coarse.
_EQUAL = 0.2
#: Most parts in each of which time goes on, where they overlap by this share of the time: several runs in one file.
_PARTS, _OVERLAP = 5, 0.1


def fixed(times: Array) -> Callable[[Mapping[str, Any]], Array]:
    """A function of a case to times that do not depend on it."""
    return functools.partial(_fixed, times)


def _fixed(times: Array, content: Mapping[str, Any]) -> Array:
    return times


@dataclasses.dataclass(frozen=True)
class History:
    """A column of a table and the times of its rows, s; of some rows where they are given."""

    table: Any
    column: str
    unit: str
    time: Array
    values: Array
    rows: Array | None = None

    def cleaned(self, notes: list[str]) -> tuple[Array, Array]:
        """Times that do not fall, and values; `notes` take what was done.

        Raises
        ------
        InputError
            If fewer than two rows have a value, the times are too coarse or those of several runs, or a value marks a
            missing one.
        """
        own = np.arange(self.values.size) if self.rows is None else self.rows
        good = np.isfinite(self.values[own]) & np.isfinite(self.time[own])
        if good.sum() < 2:
            raise InputError(f"{self._who()} has {good.sum()} values; it needs two or more")
        if not good.all():
            lacking = np.count_nonzero(~good)
            notes.append(f"{lacking} of {good.size} rows have no value of {self.column!r} and are left out.")
        rows = own[good]
        self._check_marks(rows)
        rows = self._in_order(rows, notes)
        rows = self._once(rows, notes)
        return self.time[rows], self._unwrapped(rows, notes)

    def _who(self) -> str:
        return f"the column {self.column!r} of {self.table.path!r}"

    def _in_order(self, rows: Array, notes: list[str]) -> Array:
        """Rows in the order of time."""
        time = self.time[rows]
        back = np.flatnonzero(np.diff(time) < 0.0) + 1
        if not back.size:
            return rows
        parts = np.split(time, back)
        whole = float(time.max() - time.min())
        ends = sorted((float(one.min()), float(one.max())) for one in parts)
        overlap = max((min(a[1], b[1]) - b[0] for a, b in itertools.pairwise(ends)), default=0.0)
        if len(parts) <= _PARTS and overlap > _OVERLAP * whole:
            raise InputError(
                f"the time of {self.table.path!r} begins again in line {self.table.line(int(rows[back[0]]))}: it holds "
                f"{len(parts)} runs; give the rows of one"
            )
        sentence = f"The rows are put into the order of time, which steps back in {counted(back.size, 'place')}."
        if sentence not in notes:
            notes.append(sentence)
        found: Array = rows[np.argsort(time, kind="stable")]
        return found

    def _once(self, rows: Array, notes: list[str]) -> Array:
        """Rows without those that have the time and the value of another."""
        time, values = self.time[rows], self.values[rows]
        same_time = np.concatenate([[False], np.diff(time) == 0.0])
        same = same_time & np.concatenate([[False], np.diff(values) == 0.0])
        coarse = np.count_nonzero(same_time & ~same)
        if coarse > _EQUAL * rows.size:
            raise InputError(
                f"the times of {self.table.path!r} are too coarse: {coarse} of {rows.size} rows have that of the row "
                "before and another value"
            )
        if same.any():
            notes.append(f"{counted(int(same.sum()), 'row')} of {self.column!r} stand twice and count once.")
        return rows[~same]

    def _check_marks(self, rows: Array) -> None:
        """Refuse a value far from all others that is written as a missing one is."""
        values = self.values[rows]
        far = mark_of_missing(values)
        if far is None:
            return
        raise InputError(
            f"line {self.table.line(int(rows[far]))} of {self.table.path!r} holds {values[far]:.12g} in column "
            f"{self.column!r}, far from all others; leave the cell empty if it marks a missing value"
        )

    def _unwrapped(self, rows: Array, notes: list[str]) -> Array:
        """Values; those of an angle that stays within one turn go on where they jump by a turn."""
        values = self.values[rows]
        try:
            turn = 2.0 * np.pi / units.factor(self.unit, "rad") if self.unit else np.inf
        except units.UnitError:
            return values
        steps = np.diff(values)
        jumps = np.flatnonzero(np.abs(steps) > 0.5 * turn)
        if not jumps.size or np.ptp(values) > turn * (1.0 + 1e-6):
            return values
        notes.append(
            f"The angle {self.column!r} jumps by a turn in {counted(jumps.size, 'place')}, first in line "
            f"{self.table.line(int(rows[jumps[0] + 1]))}; it goes on there from the value before."
        )
        return np.concatenate([[values[0]], values[0] + np.cumsum(steps - turn * np.round(steps / turn))])
