"""Arrays and texts in groups, as MAT and HDF5 files hold them, become columns with their rates, units and names."""

from __future__ import annotations

import dataclasses
import difflib
import re
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from evolvent_base.signals.recording import Column, column
from evolvent_base.signals.statements import statement
from evolvent_base.signals.timebase import is_named_time
from evolvent_base.tables import distinct, words

Path = tuple[str, ...]

_NAMES = re.compile(r"name|label|channel|signal|column|header|heading|items|title|legend", re.IGNORECASE)
_UNITS = re.compile(r"unit", re.IGNORECASE)
#: What is done in MATLAB to save an object of a class as arrays.
_SAVED = {
    "timeseries": "t = {0}.Time; x = {0}.Data",
    "timetable": "t = seconds({0}.Properties.RowTimes); x = {0}.Variables",
}


class Tree(NamedTuple):
    """What a file holds.

    Attributes
    ----------
    leaves : names of groups and the own one -> numbers or texts; attributes of a data set lie below it
    others : names of all else -> what it is
    scales : data set -> axis -> the data set that the file states for this axis
    joint : sign between the names of groups
    """

    leaves: Mapping[Path, np.ndarray | tuple[str, ...]]
    others: Mapping[str, str]
    scales: Mapping[Path, Mapping[int, Path]]
    joint: str


def columns(tree: Tree) -> tuple[list[Column], dict[str, str]]:
    """Columns of a tree; and names of what else it holds -> why it is left out."""
    return _Reading(tree).columns()


class _Reading:
    """What the scalars and texts of a tree say of its arrays.

    Attributes
    ----------
    left : names of what are no columns -> why
    vectors : path -> array of two numbers or more, without dimensions of length 1
    holding : groups that hold such arrays, and these arrays
    steps, starts, texts : group or array -> what is stated for all below it
    """

    def __init__(self, tree: Tree) -> None:
        self.tree = tree
        self.left = {key: _other(key, what) for key, what in tree.others.items()}
        self.vectors: dict[Path, np.ndarray] = {}
        for path, leaf in tree.leaves.items():
            if isinstance(leaf, np.ndarray) and leaf.size > 1:
                if leaf.dtype.kind in "biuf":
                    self.vectors[path] = np.squeeze(leaf)
                else:
                    self.left[tree.joint.join(path)] = "it holds no real numbers"
        self.holding = {path[:k] for path in self.vectors for k in range(len(path) + 1)}
        self.steps: dict[Path, list[float]] = {}
        self.starts: dict[Path, float] = {}
        self.texts: dict[Path, dict[str, tuple[str, ...]]] = {}
        for path, leaf in tree.leaves.items():
            of_scalar = path[:-1] in tree.leaves and path[:-1] not in self.vectors
            if isinstance(leaf, tuple) and leaf and not of_scalar:
                key = "unit" if path[-2:] == ("quantity", "label") else path[-1]
                self.texts.setdefault(self._scope(path), {})[key] = leaf
            if leaf if isinstance(leaf, tuple) else leaf.size == 1 and leaf.dtype.kind in "biuf":
                self._stated(path, leaf)

    def _scope(self, path: Path) -> Path:
        """What a scalar or text describes: the nearest group or array above it that holds numbers."""
        scope = path[:-1]
        while scope and scope not in self.holding:
            scope = scope[:-1]
        return scope

    def _stated(self, path: Path, leaf: np.ndarray | tuple[str, ...]) -> None:
        """Keep a rate, step or start."""
        value = leaf[0] if isinstance(leaf, tuple) else leaf
        found = statement(path[-1], value, _text(self.tree.leaves.get((*path, "units"))))
        if found is not None and found[0] == "start":
            self.starts.setdefault(self._scope(path), found[1])
        elif found is not None:
            self.steps.setdefault(self._scope(path), []).append(found[1])

    def columns(self) -> tuple[list[Column], dict[str, str]]:
        """All columns, and what is left out."""
        made = [(path, one) for path, values in self.vectors.items() for one in self._columns(path, values)]
        names = distinct(one.name for _, one in made)
        of_path = {path: name for name, (path, _) in zip(names, made, strict=True)}
        found = []
        for name, (path, one) in zip(names, made, strict=True):
            times = [of_path[scale] for scale in self._time_scales(path).values() if scale in of_path and scale != path]
            found.append(dataclasses.replace(one, name=name, times=times[0] if times else ""))
        return found, self.left

    def _time_scales(self, path: Path) -> dict[int, Path]:
        """Axes of an array whose scale holds times, with these scales."""
        found = {}
        for axis, scale in self.tree.scales.get(path, {}).items():
            unit = _text(self.tree.leaves.get((*scale, "units"))).partition(" since ")[0]
            if is_named_time(scale[-1]) or (unit and words.factor(unit) is not None):
                found[axis] = scale
        return found

    def _columns(self, path: Path, values: np.ndarray) -> list[Column]:
        """The columns of one array."""
        joined = self.tree.joint.join(path)
        values = self._in_time(path, values)
        if values.ndim > 2:
            self.left[joined] = f"it has {values.ndim} dimensions"
            return []
        table = values.reshape(len(values), -1)
        count = table.shape[1]
        step, notes = self._step(path)
        start = next((self.starts[s] for s in _above(path) if s in self.starts), 0.0)
        names, of = self._texts(path, count, _NAMES), self._texts(path, count, _UNITS)
        scales = [self.tree.leaves.get(scale) for scale in self.tree.scales.get(path, {}).values()]
        names = next((one for one in scales if isinstance(one, tuple) and len(one) == count > 1), names)
        made = []
        for c in range(count):
            full = f"{joined} {c + 1}" if count > 1 else joined
            unit = of[c] if of else ""
            made.append(
                column(
                    (names[c] if names else "") or full,
                    table[:, c],
                    unit.partition(" since ")[0].strip(),
                    rate=1.0 / step if step else None,
                    start=start,
                    group=path[:-1],
                    path=full,
                    notes=notes,
                )
            )
        return made

    def _in_time(self, path: Path, values: np.ndarray) -> np.ndarray:
        """An array with the samples along its first axis: as many as there are times near it, else the longest."""
        if values.ndim == 1:
            return values
        axis = next(iter(self._time_scales(path)), None)
        if axis is None:
            near = [
                self.vectors[t].size
                for s in _above(path[:-1])
                for t in self.vectors
                if t[:-1] == s and self._is_time(t)
            ]
            axis = next((values.shape.index(n) for n in near if n in values.shape), None)
        if axis is None and values.ndim == 2:
            axis = int(values.shape[0] < values.shape[1])
        if axis is None:
            return values
        return np.moveaxis(values, axis, 0).reshape(values.shape[axis], -1)

    def _is_time(self, path: Path) -> bool:
        return self.vectors[path].ndim == 1 and is_named_time(path[-1])

    def _step(self, path: Path) -> tuple[float | None, tuple[str, ...]]:
        """The step that is stated nearest to an array, s; and a note where several differ, of which none is taken."""
        found = next((self.steps[scope] for scope in _above(path) if scope in self.steps), None)
        if not found:
            return None, ()
        if max(found) - min(found) > 1e-9 * max(found):
            rates = f"{1.0 / max(found):.6g} and {1.0 / min(found):.6g} Hz"
            return None, (f"the file states different sampling rates of {self.tree.joint.join(path)!r}, {rates}",)
        return found[0], ()

    def _texts(self, path: Path, count: int, pattern: re.Pattern[str]) -> tuple[str, ...]:
        """Names or units of the columns of an array: as many texts, or one unit of all; () without such."""
        few = (1, count) if pattern is _UNITS else (count,)
        for scope in _above(path):
            known = self.texts.get(scope, {})
            keys = [key for key, texts in known.items() if pattern.search(key) and len(texts) in few]
            if pattern is _NAMES and count == 1:
                keys = [key for key in keys if key.lower() == "label" and not self._is_time(path)]
            if pattern is _UNITS and scope != path:
                others = [p[-1] for p in self.vectors if p[:-1] == scope and p != path]
                foreign = [key for key in keys if any(_is_unit_of(key, one) for one in others)]
                keys = [key for key in keys if key not in foreign]
                if self._is_time(path):
                    keys = [key for key in keys if _is_unit_of(key, path[-1])]
            if keys:
                best = max(keys, key=lambda key: difflib.SequenceMatcher(None, key, path[-1]).ratio())
                return known[best] * (count if len(known[best]) == 1 else 1)
        return ()


def _above(path: Path) -> Iterator[Path]:
    """An array or group and the groups that it lies in, from the nearest."""
    return (path[:k] for k in range(len(path), -1, -1))


def _is_unit_of(key: str, name: str) -> bool:
    """Whether a text is the unit of one array alone, as acc_unit or accUnits of acc."""
    return re.fullmatch(re.escape(name) + r"[_. ]?units?", key, re.IGNORECASE) is not None


def _text(leaf: object) -> str:
    return str(leaf[0]).strip() if isinstance(leaf, tuple) and leaf else ""


def _other(key: str, what: str) -> str:
    """Why an object is no column, with what to do in MATLAB."""
    kind = what.rpartition(" ")[2].strip("'")
    if "object" not in what:
        return f"it is {what}"
    how = _SAVED.get(kind, "x = {0}.Variables" if kind == "table" else "x = double({0})").format(key)
    kept = ", ".join(repr(word.split()[0]) for word in how.split("; "))
    return f"it is {what}, which MATLAB alone reads; save arrays: {how}; save('file.mat', {kept})"
