"""Copies of structs side by side: a struct for lanes, and what moves between it and the copies."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from typing import Any

import numpy as np
from numba import i8, types, void

from evolvent.compiled.jit import INTEGERS, indirect, lane_slot
from evolvent.compiled.lane_types import LANE, WIDTH, lane_zeros
from evolvent.compiled.pointer import Struct, address, lane_struct, number_at, put_number_at, word_at

_TABLE, _I = i8[:, ::1], types.int64
#: Columns of a table of fields: address and stride of the lane struct's records, stride of a copy's, number of records,
#: words in each, and 1 of lane numbers, 0 of integers.
_TO, _STRIDE, _OWN_STRIDE, _COUNT, _WORDS, _LANES, _COLUMNS = 0, 1, 2, 3, 4, 5, 6


@indirect(void(_TABLE, _TABLE, INTEGERS))
def _gather(table, addresses, order):
    """Put the copies of the numbers `order` (WIDTH,) into the lanes; integers are those of the first."""
    for e in range(table.shape[0]):
        for r in range(table[e, _COUNT]):
            to, at = table[e, _TO] + r * table[e, _STRIDE], r * table[e, _OWN_STRIDE]
            if table[e, _LANES] == 0:
                for w in range(table[e, _WORDS]):
                    put_number_at(to + 8 * w, number_at(addresses[e, order[0]] + at + 8 * w))
                continue
            for k in range(WIDTH):
                of = addresses[e, order[k]] + at
                for w in range(table[e, _WORDS]):
                    put_number_at(to + 8 * (WIDTH * w + k), number_at(of + 8 * w))


@indirect(void(_TABLE, _TABLE, INTEGERS))
def _scatter(table, addresses, order):
    """Put the first lanes, as many as `order` has numbers, into the copies of these numbers."""
    for e in range(table.shape[0]):
        for r in range(table[e, _COUNT]):
            of, at = table[e, _TO] + r * table[e, _STRIDE], r * table[e, _OWN_STRIDE]
            for k in range(order.size):
                to, lane, width = addresses[e, order[k]] + at, k, WIDTH
                if table[e, _LANES] == 0:
                    lane, width = 0, 1
                for w in range(table[e, _WORDS]):
                    put_number_at(to + 8 * w, number_at(of + 8 * (width * w + lane)))


@indirect(types.boolean(_TABLE, _TABLE, _I, _I))
def _are_alike(table, addresses, a, b):
    """Whether two copies have the same integers."""
    for e in range(table.shape[0]):
        if table[e, _LANES] == 0:
            for r in range(table[e, _COUNT]):
                at = r * table[e, _OWN_STRIDE]
                for w in range(table[e, _WORDS]):
                    if word_at(addresses[e, a] + at + 8 * w) != word_at(addresses[e, b] + at + 8 * w):
                        return False
    return True


class LaneCopies:
    """Copies of a struct, of which `WIDTH` at a time lie side by side in one for lanes.

    Parameters
    ----------
    copies : structs of one kind whose arrays are as large; the arrays that they have now are those that are moved
    slots : names of arrays, and of fields (``array.field``), of slots of functions, which lanes have their own of
    apart : names of arrays and of fields that are not moved

    Attributes
    ----------
    struct : the struct for lanes
    """

    def __init__(self, copies: Sequence[Struct], *, slots: Collection[str] = (), apart: Collection[str] = ()) -> None:
        self._rows: list[list[int]] = []
        self._addresses: list[list[int]] = []
        self.struct = self._join(copies, "", frozenset(slots), frozenset(apart))
        self._table = np.array(self._rows, dtype=np.int64).reshape(-1, _COLUMNS)
        self._at = np.array(self._addresses, dtype=np.int64).reshape(-1, len(copies))

    def gather(self, order: Sequence[int]) -> None:
        """Put copies into the lanes; the first again where there are fewer than lanes."""
        whole = [*order, *[order[0]] * (WIDTH - len(order))]
        _gather(self._table, self._at, np.array(whole, dtype=np.int64))

    def scatter(self, order: Sequence[int]) -> None:
        """Put the lanes back into the copies."""
        _scatter(self._table, self._at, np.array(order, dtype=np.int64))

    def are_alike(self, a: int, b: int) -> bool:
        """Whether two copies may go side by side: they have the same integers, which lanes share."""
        return bool(_are_alike(self._table, self._at, a, b))

    def _join(self, copies: Sequence[Any], path: str, slots: frozenset[str], apart: frozenset[str]) -> Any:
        """The struct for lanes of some structs; notes what moves."""
        kind, values = lane_struct(type(copies[0])), dict[str, Any]()
        for name, field in kind._fields.items():
            if field.value is not None:
                continue
            own = [getattr(copy, name) for copy in copies]
            if field.struct is not None:
                values[name] = self._join(own, f"{path}{name}.", slots, apart)
                continue
            found = lane_zeros(own[0].shape if field.ndim else 1, field.dtype)
            values[name] = found if field.ndim else found[0]
            if f"{path}{name}" in slots:
                found[...] = np.where(own[0] > 0, lane_slot(own[0]), own[0])
            elif f"{path}{name}" not in apart and found.size:
                if field.constant:
                    found[...] = own[0]
                else:
                    self._note(found, own, f"{path}{name}", slots, apart)
        return kind(**values)

    def _note(self, found: Any, own: list[Any], name: str, slots: Collection[str], apart: Collection[str]) -> None:
        """Note what moves between an array, or a record, for lanes and those of the copies."""
        places, size = [address(one) for one in own], own[0].dtype.itemsize
        for field, kind, to, of in _fields(found.dtype, own[0].dtype):
            if f"{name}.{field}" in slots:
                found[field] = np.where(own[0][field] > 0, lane_slot(own[0][field]), own[0][field])
            elif f"{name}.{field}" not in apart:
                is_lanes = kind.base == LANE
                words = kind.itemsize // (LANE.itemsize if is_lanes else 8)
                row = [address(found) + to, found.dtype.itemsize, size, found.size, words, int(is_lanes)]
                self._rows.append(row)
                self._addresses.append([place + of for place in places])


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
