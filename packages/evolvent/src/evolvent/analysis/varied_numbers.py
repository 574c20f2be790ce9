"""Numbers that keys stand for in parts, and what follows from many values of them at once."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from pydantic import BaseModel, ValidationError

from evolvent.analysis import variation
from evolvent.assembly.variants import Changes, Variants
from evolvent_base.columns import Column, UndecidedError, stacked
from evolvent_base.errors import InputError

Array = np.ndarray
#: Part, and the names of the fields that lead from it to a number.
Leaf = tuple[str, tuple[str, ...]]
#: Fewest points that are evaluated together.
LEAST = 4


class Together(NamedTuple):
    """What follows from many points.

    Attributes
    ----------
    changes : Changes, of the first of them
    numbers : mapping, array of the model, field ("" of an array of numbers) and row -> (n, ...) float
    """

    changes: Changes
    numbers: dict[tuple[str, str, int], Array]


class VariedNumbers:
    """Numbers of the parts of a system, which keys vary.

    A part writes itself once for all points, with columns of numbers (`evolvent_base.columns`) in the place of numbers.
    What it writes must be what it writes for the first and the last of the points that lie beyond all before.

    Parameters
    ----------
    system, variants : System, and the Variants by which it was assembled first
    """

    def __init__(self, system: Any, variants: Variants) -> None:
        self._system, self._variants = system, variants
        self._leaves: dict[str, tuple[Leaf, ...]] = {}
        self._proven: dict[tuple[str, ...], list[tuple[float, float]]] = {}

    def together(self, points: Sequence[Mapping[str, Any]], alone: Any) -> Together | None:
        """What follows from points, or None where it has to be found one by one.

        Parameters
        ----------
        points : of which each has a number for each of the same keys
        alone : function of a point, its Changes, for the points by which it is checked
        """
        keys = tuple(sorted(points[0])) if points else ()
        if len(points) < LEAST or not keys or any(point.keys() != points[0].keys() for point in points):
            return None
        columns = {key: [point[key] for point in points] for key in keys}
        if not all(type(one) in (int, float) and math.isfinite(one) for of in columns.values() for one in of):
            return None
        leaves = {key: self._leaves_of(key, columns[key]) for key in keys}
        if not all(leaves.values()) or not self._accepts(leaves, columns):
            return None
        parts = dict[str, Any]()
        for key, of in leaves.items():
            column = Column(np.array(columns[key], dtype=float))
            for name, path in of:
                parts[name] = replaced(parts.get(name, self._system.parts[name]), path, column)
        try:
            changes = self._variants.columns(self._system._gravity, parts)
            fields = None if changes is None else _fields(changes, len(points))
        except (Exception, UndecidedError):  # noqa: BLE001  (whatever a part does with what is no number)
            return None
        if changes is None or fields is None or not self._are_proven(keys, columns, points, fields, alone):
            return None
        return Together(changes, fields)

    def parts(self, point: Mapping[str, Any]) -> Mapping[str, Any] | None:
        """Parts with the numbers of a point, where it is known which these are."""
        if not all(key in self._leaves and type(value) in (int, float) for key, value in point.items()):
            return None
        found = dict(self._system.parts)
        for key, value in point.items():
            for name, path in self._leaves[key]:
                found[name] = replaced(found[name], path, float(value))
        return found

    def _leaves_of(self, key: str, values: Sequence[float]) -> tuple[Leaf, ...]:
        """Numbers that a key stands for: those that are its value, where nothing else differs."""
        if key not in self._leaves:
            found = set[tuple[Leaf, ...]]()
            for value in {min(values), max(values), values[len(values) // 2]}:
                own = variation.with_values(self._system, {key: value})
                if own.settings != self._system.settings or own.sections != self._system.sections:
                    return ()
                if list(own.parts) != list(self._system.parts):
                    return ()
                leaves = list[Leaf]()
                for name, part in own.parts.items():
                    if part is not self._system.parts[name]:
                        paths = list(_different(part, self._system.parts[name], value))
                        if None in paths:
                            return ()
                        leaves += [(name, path) for path in paths if path is not None]
                if leaves:  # else it is the value of the system
                    found.add(tuple(leaves))
            if len(found) != 1:
                return ()
            self._leaves[key] = found.pop()
        return self._leaves[key]

    def _accepts(self, leaves: Mapping[str, Sequence[Leaf]], columns: Mapping[str, Sequence[float]]) -> bool:
        """Whether the parts accept all values."""
        rooms = dict[Leaf, Any]()
        for of in leaves.values():
            for name, path in of:
                for k in range(len(path)):
                    if (name, path[:k]) not in rooms:
                        rooms[name, path[:k]] = _at(self._system.parts[name], path[:k]).model_copy()
        try:
            for k in range(len(next(iter(columns.values())))):
                for key, of in leaves.items():
                    for name, path in of:
                        value: Any = columns[key][k]
                        for depth in range(len(path) - 1, -1, -1):
                            room = rooms[name, path[:depth]]
                            type(room).__pydantic_validator__.validate_assignment(room, path[depth], value)
                            if depth == len(path) - 1 and getattr(room, path[depth]) != value:
                                return False
                            value = room
        except (ValidationError, InputError):
            return False
        return True

    def _are_proven(
        self, keys: tuple[str, ...], columns: Mapping[str, Sequence[float]], points: Sequence[Mapping[str, Any]],
        fields: Mapping[tuple[str, str, int], Array], alone: Any,
    ) -> bool:  # fmt: skip
        """Whether the first and the last point have alone what they have among others."""
        ranges = [(min(columns[key]), max(columns[key])) for key in keys]
        known = self._proven.get(keys)
        if known is not None and all(a <= c and d <= b for (a, b), (c, d) in zip(known, ranges, strict=True)):
            return True
        for k in {int(np.argmin(columns[keys[0]])), int(np.argmax(columns[keys[0]])), len(points) - 1}:
            own: Changes = alone(points[k])
            found = {(one.family, one.field, one.row): one.value for one in own.records}
            found |= {("parameters", "", index): value for index, value in own.parameters.items()}
            if not found.keys() <= fields.keys():
                return False
            for place, stack in fields.items():
                expected = found.get(place)
                if expected is None:
                    expected = self._variants.nominal(*place)
                if np.asarray(expected, dtype=float).tobytes() != np.ascontiguousarray(stack[k]).tobytes():
                    return False
        if known is not None:
            ranges = [(min(a, c), max(b, d)) for (a, b), (c, d) in zip(known, ranges, strict=True)]
        self._proven[keys] = ranges
        return True


def _fields(changes: Changes, count: int) -> dict[tuple[str, str, int], Array]:
    """Numbers of all changes."""
    found: dict[tuple[str, str, int], Array] = {}
    shared = dict[int, Array]()  # what stands in several records
    for one in changes.records:
        if id(one.value) not in shared:
            shared[id(one.value)] = stacked(one.value, count)
        found[one.family, one.field, one.row] = shared[id(one.value)]
    return found | {("parameters", "", k): stacked(value, count) for k, value in changes.parameters.items()}


def replaced(part: Any, path: Sequence[str], value: Any) -> Any:
    """A copy of a part with another value at the end of a path of fields."""
    inside = value if len(path) == 1 else replaced(getattr(part, path[0]), path[1:], value)
    return part.model_copy(update={path[0]: inside})


def _at(part: Any, path: Sequence[str]) -> Any:
    for name in path:
        part = getattr(part, name)
    return part


def _different(part: Any, old: Any, value: float) -> Any:
    """Paths to the numbers that differ from those of another part, all of them `value`; None where more differs."""
    if type(part) is not type(old):
        yield None
        return
    for name in type(part).model_fields:
        own, other = getattr(part, name), getattr(old, name)
        if own is other:
            continue
        if isinstance(own, BaseModel):
            for path in _different(own, other, value):
                yield path if path is None else (name, *path)
        elif type(own) is float and isinstance(other, float):
            if own != other:
                yield (name,) if own == value else None
        elif own != other:
            yield None
