"""Copies of a struct side by side: a struct for lanes, and what moves between it and the blocks of the copies."""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterator
from typing import Any

import numpy as np
from numba import i8, types, void

from evolvent.compiled.jit import INTEGERS, TO_LANES, indirect
from evolvent.compiled.lane_types import LANE, WIDTH, lane_zeros
from evolvent.compiled.pointer import Struct, address, lane_struct, number_at, put_number_at, put_word_at, word_at
from evolvent.model.memory import Memory

_TABLE, _I = i8[:, ::1], types.int64
#: Columns of a table of fields: address and stride of the lane struct's records, offset in a block and stride of a
#: copy's, number of records, words in each, and what they are.
_TO, _STRIDE, _OF, _OWN_STRIDE, _COUNT, _WORDS, _WHAT, _COLUMNS = 0, 1, 2, 3, 4, 5, 6, 7
#: Words of a field: integers, lane numbers, and slots of functions, in place of which lanes have those for lanes.
_INTEGERS, _LANES, _SLOTS = 0, 1, 2


@indirect(void(_TABLE, INTEGERS))
def _gather(table, copies):
    """Put the copies, whose blocks are at addresses (WIDTH,), into the lanes; integers are those of the first."""
    for e in range(table.shape[0]):
        for r in range(table[e, _COUNT]):
            to, at = table[e, _TO] + r * table[e, _STRIDE], table[e, _OF] + r * table[e, _OWN_STRIDE]
            if table[e, _WHAT] == _LANES:
                for w in range(table[e, _WORDS]):
                    for k in range(WIDTH):
                        put_number_at(to + 8 * (WIDTH * w + k), number_at(copies[k] + at + 8 * w))
                continue
            for w in range(table[e, _WORDS]):
                word = word_at(copies[0] + at + 8 * w)
                if table[e, _WHAT] == _SLOTS and word > 0:
                    word += TO_LANES
                put_word_at(to + 8 * w, word)


@indirect(void(_TABLE, INTEGERS))
def _scatter(table, copies):
    """Put the first lanes into the copies whose blocks are at some addresses."""
    for e in range(table.shape[0]):
        if table[e, _WHAT] == _SLOTS:
            continue
        for r in range(table[e, _COUNT]):
            of, at = table[e, _TO] + r * table[e, _STRIDE], table[e, _OF] + r * table[e, _OWN_STRIDE]
            width, step = (WIDTH, 1) if table[e, _WHAT] == _LANES else (1, 0)
            for w in range(table[e, _WORDS]):
                for k in range(copies.size):
                    put_word_at(copies[k] + at + 8 * w, word_at(of + 8 * (width * w + step * k)))


@indirect(types.boolean(_TABLE, _I, _I))
def _are_alike(table, a, b):
    """Whether two copies, whose blocks are at addresses, have the same integers."""
    for e in range(table.shape[0]):
        if table[e, _WHAT] != _LANES:
            for r in range(table[e, _COUNT]):
                at = table[e, _OF] + r * table[e, _OWN_STRIDE]
                for w in range(table[e, _WORDS]):
                    if word_at(a + at + 8 * w) != word_at(b + at + 8 * w):
                        return False
    return True


class LaneCopies:
    """Copies of a struct in blocks of memory, of which `WIDTH` at a time lie side by side in one for lanes.

    Parameters
    ----------
    memory : Memory, the layout of the blocks
    name, of : the struct there
    slots : names of arrays, and of fields (``array.field``), of slots of functions, which lanes have their own of
    apart : names of arrays and of fields that are not moved

    Attributes
    ----------
    struct : the struct for lanes
    """

    def __init__(
        self, memory: Memory, name: str, of: Struct, *, slots: Collection[str] = (), apart: Collection[str] = ()
    ) -> None:
        self._rows: list[tuple[int, ...]] = []
        self._memory, self._slots, self._apart = memory, frozenset(slots), frozenset(apart)
        self.struct = self._join(of, (name,))
        self._table = np.array(self._rows, dtype=np.int64).reshape(-1, _COLUMNS)
        spans = sorted({(place.offset, place.offset + np.asarray(place.value).nbytes)
                        for path, place in memory.places.items() if path[0] == name})  # fmt: skip
        if any(end > first for (_, end), (first, _) in itertools.pairwise(spans)):
            raise TypeError(f"arrays of {name} lie within others")

    def gather(self, copies: np.ndarray) -> None:
        """Put copies, whose blocks are at addresses (k,), into the lanes; the first again where there are fewer."""
        _gather(self._table, np.append(copies, np.full(WIDTH - copies.size, copies[0])))

    def scatter(self, copies: np.ndarray) -> None:
        """Put the lanes back into the copies whose blocks are at addresses (k,)."""
        _scatter(self._table, copies)

    def are_alike(self, a: int, b: int) -> bool:
        """Whether two copies, whose blocks are at addresses, may go side by side: lanes share integers."""
        return bool(_are_alike(self._table, a, b))

    def _join(self, own: Struct, path: tuple[str, ...]) -> Any:
        """The struct for lanes of a struct; notes what moves."""
        kind, values = lane_struct(type(own)), dict[str, Any]()
        for name, field in kind._fields.items():
            if field.value is not None:
                continue
            value = getattr(own, name)
            if field.struct is not None:
                values[name] = self._join(value, (*path, name))
                continue
            found = lane_zeros(value.shape if field.ndim else 1, field.dtype)
            values[name] = found if field.ndim else found[0]
            place = self._memory.places.get((*path, name))
            if place is not None:
                self._rows += self._moved(found, value.dtype, place.offset, ".".join((*path[1:], name)))
            elif found.size:  # shared by all copies
                is_slots = ".".join((*path[1:], name)) in self._slots
                found[...] = np.where(value > 0, value + TO_LANES, value) if is_slots else value
        return kind(**values)

    def _moved(self, found: Any, own: np.dtype, offset: int, name: str) -> Iterator[tuple[int, ...]]:
        """What moves between an array, or a record, for lanes and those of the copies."""
        for field, kind, to, of in _fields(found.dtype, own):
            full = f"{name}.{field}" if field else name
            if not {name, full} & self._apart:
                what = _LANES if kind.base == LANE else _SLOTS if full in self._slots else _INTEGERS
                words = kind.itemsize // (LANE.itemsize if what == _LANES else 8)
                sizes = found.dtype.itemsize, offset + of, own.itemsize
                yield address(found) + to, *sizes, found.size, words, what


def _fields(lane: np.dtype, own: np.dtype) -> Iterator[tuple[str, np.dtype, int, int]]:
    """Fields of a dtype for lanes: name, kind, and places in a record of it and of one of a copy."""
    if lane == LANE or lane.names is None:
        yield "", lane, 0, 0
        return
    places, others = (dict(one.fields or {}) for one in (lane, own))
    for name, place in places.items():
        if place[0].base != LANE and place[0].base.names is not None:
            raise TypeError(f"{name} is a record in a record")
        yield name, place[0], place[1], others[name][1]
