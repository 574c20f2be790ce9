"""Which columns of a file belong together, and at which times their samples were taken."""

from __future__ import annotations

import dataclasses
import functools
import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from evolvent_base import tables, units
from evolvent_base.errors import InputError, counted
from evolvent_base.signals.recording import Column, Signals
from evolvent_base.signals.times import instead_of
from evolvent_base.tables import words

#: Names of columns that count samples or cycles.
_COUNTERS = (
    "sample",
    "samples",
    "index",
    "idx",
    "n",
    "no",
    "nr",
    "#",
    "count",
    "counter",
    "cycle",
    "record",
    "row",
    "scan",
)
#: Relative difference of a stated rate from the file's own that is refused.
RATE = 1e-3
#: Share of the samples by which columns of one rate and start may end apart.
ENDS = 0.01
#: Samples that a signal has at least.
FEWEST = 8
#: Units that a time without one may have, in s.
_OTHER_UNITS = {"ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0}
#: Times from which on they count from a date, and those of a recording from its first sample, s.
_EPOCH = 1e9
#: Days that MATLAB counts from the year 0, 1985 to 2114.
_DATENUM = (725_000.0, 772_000.0)
#: Columns that a sentence names at most.
_LISTED = 6


@dataclasses.dataclass(frozen=True, eq=False)
class Base:
    """Columns of one time base.

    Attributes
    ----------
    columns : indices of the columns
    size : samples that all of them have
    rate : Hz, None where the times of a column stand for it
    start : s, the file's time of the first sample, where a rate stands
    time : (N,) s, the times of a column, None where a rate stands
    times : index of that column
    notes : sentences on what was taken, and on what was left out
    """

    columns: tuple[int, ...]
    size: int
    rate: float | None
    start: float = 0.0
    time: np.ndarray | None = None
    times: int | None = None
    notes: tuple[str, ...] = ()


def is_named_time(name: str) -> bool:
    """Whether a column's name says that it holds times."""
    return bool(tables.time_columns([units.head_and_unit(name)[0]], [""]))


def choose(
    source: Signals, named: Sequence[tuple[str | int, str]], *, time: str | int | None, rate: float | None
) -> Base:
    """The columns that are signals, and their times.

    Parameters
    ----------
    source : columns of a file
    named : columns that are wanted with the keys that name them; none for all that are signals
    time : column of times that the description names
    rate : Hz, that it states

    Raises
    ------
    InputError
        For columns that are not there, columns of different times, times and rates that contradict each other, or none.
    """
    return _Choice(source, time, rate).base(named)


def times(source: Signals) -> tuple[int, ...]:
    """Columns of a file that hold times, the first of them the one that stands for all that have no own."""
    return tuple(_Choice(source, None, None).times)


def in_seconds(source: Signals, k: int) -> np.ndarray:
    """Times of a column, s; of one whose unit is no unit of time as they are."""
    return source.samples(k) * (words.factor(_unit(source.columns[k])) or 1.0)


class _Choice:
    def __init__(self, source: Signals, time: str | int | None, rate: float | None) -> None:
        self.source, self.rate = source, rate
        self.given = None if time is None else source.index(time, "signals.time")
        self.samples = functools.cache(source.samples)
        self.unexplained = functools.cache(self._unexplained)
        stated = {one.times for one in source.columns if one.times}
        self.stated = {k for k, one in enumerate(source.columns) if one.name in stated}
        named = [k for k in range(len(source.columns)) if k not in self.stated and self._is_time(k)]
        self.times = sorted({*self.stated, *named}, key=self._order)

    # -------------------------------------------------------------------------------------------- times

    def _name(self, k: int) -> str:
        return self.source.columns[k].name

    def _order(self, k: int) -> tuple[bool, bool, bool, int]:
        """The column of times that the file states first, then those with the name of a time, and with a unit."""
        one = self.source.columns[k]
        return (k not in self.stated, not is_named_time(_last(one)), not _unit(one), k)

    def _is_time(self, k: int) -> bool:
        """Whether a column holds times: by its name, or where it rises evenly by its unit or a part of its name."""
        one = self.source.columns[k]
        name, unit = _last(one), _unit(one)
        if k == self.given:
            return True
        if unit and words.factor(unit) is None and not words.is_form(unit):
            return False
        named = is_named_time(name)
        if named and one.rate is None and self.rate is None:
            return True
        if not self._rises(k):
            return False
        if named:
            return bool(unit) or len(name) > 1 or self._is_even(k)
        if name == "T" and self.rate is None and one.rate is None:
            return (
                tables.find_time([_last(other) for other in self.source.columns], self.source.units, self._rises) == k
            )
        parts = re.split(r"[\W\d_]+", name.lower())
        return (bool(unit) or any(part in tables.TIME_NAMES for part in parts)) and self._is_even(k)

    def _is_even(self, k: int) -> bool:
        """Whether a column rises by about the same at each sample, as no temperature T does."""
        steps = np.diff(self.samples(k))
        return float(steps.max()) < 1.5 * float(steps.min())

    def _rises(self, k: int) -> bool:
        try:
            steps = np.diff(self.samples(k))
        except InputError:
            return False
        return bool(steps.size and np.all(np.isfinite(steps)) and np.all(steps > 0.0))

    def _own_rate(self, k: int) -> float:
        """Samples in a unit of a column of times."""
        values = self.samples(k)
        return (values.size - 1) / float(values[-1] - values[0])

    def _near(self, k: int) -> int | None:
        """The column of times that belongs to another one: of equal length, near it in groups and name."""
        one = self.source.columns[k]
        own = [t for t in self.times if self.source.columns[t].size == one.size and t != k]

        def nearness(t: int) -> tuple[int, int]:
            other = self.source.columns[t]
            shared = next((n for n in range(len(one.group), 0, -1) if one.group[:n] == other.group[:n]), 0)
            return (-shared, own.index(t))

        best = min(own, key=nearness, default=None)
        alike = [t for t in own if best is not None and self._kind(t) == self._kind(best)]
        if len(alike) < 2:
            return best
        digits = re.findall(r"\d+", _last(one))
        numbered = [t for t in alike if digits and re.findall(r"\d+", _last(self.source.columns[t])) == digits]
        between = any(n not in self.times for n in range(min(alike), max(alike)))
        before = [t for t in sorted(alike) if t < k] if between else []
        return (*numbered, *before[-1:], best)[0]

    def _kind(self, k: int) -> tuple[tuple[str, ...], str]:
        """What columns of times that belong to others each have in common: group, and name without numbers."""
        one = self.source.columns[k]
        return one.group, re.sub(r"[\W\d_]+", "", _last(one))

    def _base(self, k: int) -> Base:
        """The times of one column."""
        one = self.source.columns[k]
        near = self.source.names.index(one.times) if one.times else self._near(k)
        if self.rate is not None:
            return self._by_rate(k, self.rate, near, "signals.rate")
        if self.given is not None:
            return self._by_times(k, self.given, one.rate)
        if one.times and near is not None:
            return self._by_times(k, near, None)
        if one.rate is not None:
            return self._by_rate(k, one.rate, near, "the rate that the file states")
        if near is not None:
            return self._by_times(k, near, None)
        others = [t for t in self.times if self.source.columns[t].size > 1]
        hint = ""
        if others:
            t = self.source.columns[others[0]]
            hint = f"; {t.name!r} has {t.size} values for {one.size} samples of {one.name!r}"
        elif wrong := [c for c in self.source.columns if is_named_time(_last(c)) and _unit(c)]:
            hint = f"; {wrong[0].name!r} has the unit {_unit(wrong[0])!r}; a time is in s, ms, us or min"
        elif rising := [n for n in range(len(self.source.columns)) if self._rises(n) and self._is_even(n)]:
            hint = f"; {self._name(rising[0])!r} rises evenly, as times do"
        hint += "".join(f"; {note}" for note in one.notes if "rate" in note)
        raise InputError(
            f"{self.source.path!r} states neither times nor a rate; give signals.rate, such as 50 Hz, or signals.time, "
            f"one of its columns {', '.join(self.source.names)}{hint}"
        )

    def _by_times(self, k: int, times: int, rate: float | None) -> Base:
        """Samples at the times of a column."""
        one, size = self.source.columns[times], self.source.columns[k].size
        if one.size != size:
            raise InputError(
                f"{one.name!r} of {self.source.path!r} has {one.size} times for {size} samples of {self._name(k)!r}; "
                "give signals.rate, or the column of its times as signals.time"
            )
        values = self.samples(times)
        if not _unit(one) and self.source.format == "MAT" and _DATENUM[0] < values[0] <= values[-1] < _DATENUM[1]:
            time = 86400.0 * (values - values[0])
            notes = (*one.notes, "the time states no unit: by its size it counts days as datenum does, to 1e-05 s")
        else:
            found = tables.seconds(_Vector(self.source.path, one, values).as_table(), 1)
            time, notes = found.start + found.seconds, (*one.notes, *found.notes)
        own = (size - 1) / float(time[-1] - time[0]) if time[-1] > time[0] else 0.0
        if rate is not None and own and abs(own / rate - 1.0) > RATE:
            notes = (*notes, f"the file states a rate of {rate:.6g} Hz, its column {one.name!r} has {own:.6g} Hz")
        return Base((k,), size, None, time=time, times=times, notes=notes)

    def _by_rate(self, k: int, rate: float, near: int | None, what: str) -> Base:
        """Samples at even times; the file's own rate and times, where it has them, must agree."""
        one, forced = self.source.columns[k], what == "signals.rate"
        notes: tuple[str, ...] = ()
        factor = 1.0
        if forced and one.rate is not None:
            if tables.NO_UNIT in one.notes:
                unit, factor = _by_size(one.rate, rate) or ("s", 1.0)
                notes = (f"the time states no unit; by {what} it is in {unit}",) if factor != 1.0 else ()
            self._agree(rate, one.rate / factor, "its own rate")
        start = one.start * factor
        if near is not None and self._rises(near):
            other, own = self.source.columns[near], self._own_rate(near)
            unit = _unit(other)
            factor = words.factor(unit) or 1.0
            if not unit and abs(own / rate - 1.0) > RATE:
                unit, factor = _by_size(own, rate) or ("", 1.0)
                if unit:
                    notes = (f"the column {other.name!r} states no unit; by {what} it is in {unit}",)
            if not unit and forced and self._counts(near):
                notes = (f"the column {other.name!r} counts samples: signals.rate was taken",)
            elif abs(own / factor / rate - 1.0) <= RATE:
                start = float(self.samples(near)[0]) * factor
                start = start if abs(start) < _EPOCH else 0.0
                notes = (*notes, *self.unexplained(near, factor, rate, what))
            elif forced:
                self._agree(rate, own / factor, f"the column {other.name!r}")
            elif unit or len(other.name) > 1:
                raise InputError(
                    f"{self.source.path!r} states a rate of {rate:.6g} Hz, but by its column {other.name!r} it has "
                    f"{own / factor:.6g} Hz; give signals.rate, or signals.time"
                )
        return Base((k,), one.size, rate, start, notes=notes)

    def _unexplained(self, times: int, factor: float, rate: float, what: str) -> tuple[str, ...]:
        return instead_of(factor * self.samples(times), rate, f"the column {self._name(times)!r}", what)

    def _agree(self, rate: float, own: float, what: str) -> None:
        if abs(own / rate - 1.0) > RATE:
            raise InputError(
                f"signals.rate is {rate:.6g} Hz, but by {what} {self.source.path!r} has {own:.6g} Hz; leave "
                "signals.rate out, or correct the file's clock by signals.clock"
            )

    # -------------------------------------------------------------------------------------------- columns

    def base(self, named: Sequence[tuple[str | int, str]]) -> Base:
        """The columns that are wanted with their times."""
        places = [self.source.index(column, key) for column, key in named]
        notes: list[str] = []
        if not places:
            places = self._signals(notes)
        if not places:
            time = f" but the time, {self._name(self.times[0])!r}" if self.times else ""
            raise InputError(f"{self.source.path!r} holds no column of numbers{time}; at least one must be a signal")
        groups: list[Base] = []
        for k in places:
            one = self._base(k)
            same = next((n for n, other in enumerate(groups) if self._are_one(one, other)), None)
            if same is None:
                groups.append(one)
            else:
                kept = groups[same]
                groups[same] = dataclasses.replace(
                    kept,
                    columns=(*kept.columns, k),
                    size=min(kept.size, one.size),
                    notes=tuple(dict.fromkeys((*kept.notes, *one.notes))),
                )
        if len(groups) > 1:
            told = "; ".join(map(self._told, groups))
            what = "signals.sensors name" if named else f"{self.source.path!r} holds"
            how = "evaluate them one by one" if named else "name the ones wanted under signals.sensors or --variables"
            raise InputError(f"{what} columns of different times: {told}; {how}")
        (found,) = groups
        longest = max(found.columns, key=lambda k: self.source.columns[k].size)
        if self.source.columns[longest].size > found.size:
            notes.append(
                f"{self._name(longest)!r} and others go on behind the {found.size} samples that all columns have"
            )
        if not named:
            near = {found.times, *(self._near(k) for k in found.columns)}
            notes += [f"{self._name(t)!r} is left out: it is another time" for t in self.times if t not in near]
        own = [note for k in found.columns for note in self.source.columns[k].notes]
        if self.rate is not None:
            own = [note for note in own if note != tables.NO_UNIT]
        return dataclasses.replace(found, notes=tuple(dict.fromkeys((*notes, *found.notes, *own))))

    def _signals(self, notes: list[str]) -> list[int]:
        """All columns that can be signals; the others are noted."""
        found, constant = [], []
        for k, one in enumerate(self.source.columns):
            if k == self.given or k in self.times:
                continue
            if one.size < FEWEST:
                notes.append(f"{one.name!r} is left out: it has {counted(one.size, 'sample')}")
            elif self._counts(k):
                notes.append(f"{one.name!r} is left out: it counts samples")
            else:
                values = self.samples(k)
                if np.nanmin(values, initial=np.inf) == np.nanmax(values, initial=-np.inf):
                    constant.append(k)
                found.append(k)
        if len(constant) < len(found):
            for k in constant:
                notes.append(f"{self._name(k)!r} is left out: all its samples are {self.samples(k)[0]:g}")
                found.remove(k)
        return found

    def _counts(self, k: int) -> bool:
        """Whether a column counts samples: it rises by 1 at each, but where it begins again; or cycles, by its name."""
        values = self.samples(k)
        if not np.all(np.isfinite(values)) or np.any(values != np.round(values)):
            return False
        steps = np.diff(values)
        rising = steps == 1.0
        if np.count_nonzero(rising) >= 0.9 * steps.size and len(set(values[1:][~rising])) <= 1:
            return True
        return self._name(k).lower() in _COUNTERS and bool(np.all(steps >= 0.0)) and bool(np.any(steps > 0.0))

    def _are_one(self, one: Base, other: Base) -> bool:
        """Whether two columns have the same times."""
        if abs(one.size - other.size) > (ENDS * one.size if one.rate is not None else 0):
            return False
        if one.rate is not None and other.rate is not None:
            same = abs(one.rate / other.rate - 1.0) <= 1e-9
            return same and abs(one.start - other.start) * one.rate <= 1e-3
        return np.array_equal(one.time, other.time, equal_nan=True)  # type: ignore[arg-type]

    def _told(self, base: Base) -> str:
        names = [self._name(k) for k in base.columns]
        listed = ", ".join(names[:_LISTED]) + (f" and {len(names) - _LISTED} more" if len(names) > _LISTED else "")
        size = base.size
        if base.rate is None:
            assert base.times is not None
            return f"{listed} at the times of {self._name(base.times)!r} with {size} samples"
        start = f" from {base.start:g} s" if base.start else ""
        return f"{listed} at {base.rate:.6g} Hz{start} with {size} samples"


def _by_size(own: float, rate: float) -> tuple[str, float] | None:
    """The unit of times without one, and its s, in which a rate is `rate`; None without such a unit."""
    return next(((u, f) for u, f in _OTHER_UNITS.items() if abs(own / f / rate - 1.0) <= RATE), None)


def _last(one: Column) -> str:
    """The name of a column without those of its groups, as it stands in the file."""
    tail = one.path[sum(len(name) + 1 for name in one.group) :] if one.path else one.name
    return tail if tail in one.name or one.name in tail else one.name


def _unit(one: Column) -> str:
    """Unit of a column of times: that which the file states, or behind its name, as in time_ms."""
    return one.unit or units.head_and_unit(_last(one))[1] or words.own_unit(_last(one))


@dataclasses.dataclass(frozen=True, eq=False)
class _Vector:
    """A column of any file as what `tables.seconds` takes."""

    path: str
    column: Column
    values: np.ndarray
    stamps: tuple[int, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        return (self.column.name,)

    @property
    def units(self) -> tuple[str, ...]:
        return (_unit(self.column),)

    def index(self, column: Any) -> int:
        return 0

    def numbers(self, column: Any) -> np.ndarray:
        return self.values

    def words(self, column: Any) -> list[str]:
        return [repr(float(value)) for value in self.values]

    def cell(self, column: Any, row: int) -> str:
        return f"{self.values[row]:.15g}"

    def line(self, row: int) -> int:
        return row + 1

    def as_table(self) -> Any:
        """Itself, typed as a table."""
        return self
