"""Structs in one block of memory: a copy of all their arrays is a copy of the block."""

from __future__ import annotations

import ctypes
import weakref
from collections.abc import Collection, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from evolvent.compiled.pointer import Struct, address

Array = np.ndarray
#: Bytes to which arrays are aligned: a line of the cache. Blocks are aligned to two, which processors load together.
LINE = 64


#: What is moved between structs, by both of them.
_MOVES: weakref.WeakKeyDictionary[Struct, weakref.WeakKeyDictionary[Struct, list[tuple[int, int, int]]]]
_MOVES = weakref.WeakKeyDictionary()


def take(to: Struct, of: Struct) -> None:
    """Take the values of another struct, whose arrays are as large; many times between the same two."""
    known = _MOVES.setdefault(to, weakref.WeakKeyDictionary())
    moves = known.get(of)
    if moves is None:
        moves = known[of] = to.moves(of)
    for at, source, size in moves:
        ctypes.memmove(at, source, size)


class _Place(NamedTuple):
    """Where an attribute of a struct stands in a block: offset in bytes, shape and type of the array."""

    offset: int
    shape: tuple[int, ...]
    value: Any

    @property
    def dtype(self) -> Any:
        """Type of its numbers."""
        return self.value.dtype


class Memory:
    """The layout of structs in one block of memory, with their headers, and the block as it is to be copied.

    Arrays that structs share stand there once, and so do arrays that lie within others. Constant attributes and arrays
    without entries stay where they are, and are shared by all copies.

    Parameters
    ----------
    structs : mapping, name -> struct
    later : pairs (name of the struct, attribute) of arrays that are written before they are read: a copy keeps in them
        what stood there

    Attributes
    ----------
    size : int, bytes of a copy; filled : int, the first of them that are copied
    places : mapping, (name of the struct, attribute, ...) -> where the array stands
    """

    def __init__(self, structs: Mapping[str, Struct], later: Collection[tuple[str, ...]] = ()) -> None:
        self._structs = dict(structs)
        headers = {path: of.__dict__["_headers"] for path, of in _nested(self._structs) if "_headers" in of.__dict__}
        arrays = {(*path, name): value for path, of in _nested(self._structs) for name, value in _own(of)}
        listed = [(one, path in later) for path, one in (*headers.items(), *arrays.items())]
        spans = sorted((address(one), address(one) + _bytes(one), int(waits)) for one, waits in listed)
        merged: list[list[int]] = []
        for first, end, waits in spans:
            if merged and first < merged[-1][1]:
                merged[-1][1:] = max(end, merged[-1][1]), min(waits, merged[-1][2])
            else:
                merged.append([first, end, waits])
        firsts, ends, wait = np.array(merged, dtype=np.int64).T
        lengths = -(-(ends - firsts) // LINE) * LINE
        order = np.argsort(wait, kind="stable")
        offsets = np.zeros(order.size, dtype=np.int64)
        offsets[order[1:]] = np.cumsum(lengths[order])[:-1]
        self.filled = int(lengths[wait == 0].sum())
        self.size = -(-int(lengths.sum()) // (2 * LINE)) * 2 * LINE

        def offset(at: int) -> int:
            """Where an address stands in the block; -1 of one outside."""
            k = int(np.searchsorted(firsts, at, side="right")) - 1
            return int(offsets[k] + at - firsts[k]) if k >= 0 and at < ends[k] else -1

        self.places = {path: _Place(offset(address(one)), np.shape(one), one) for path, one in arrays.items()}
        self._headers = {path: (offset(address(one)), one.size) for path, one in headers.items()}
        words, targets = list[int](), list[int]()
        for path, of in _nested(self._structs):
            if path not in headers:
                continue
            for at in type(of)._places.values():
                pointed = int(headers[path][at])
                if pointed and (target := offset(pointed)) >= 0:
                    words.append(self._headers[path][0] // 8 + at)
                    targets.append(target)
        self._words, self._targets = np.array(words, dtype=np.int64), np.array(targets, dtype=np.int64)
        self.image = np.zeros(self.size, dtype=np.uint8)
        self.take(self._structs, self.image)
        for path, (at, size) in self._headers.items():
            self.image[at : at + 8 * size] = headers[path].view(np.uint8)

    def room(self, count: int) -> Array:
        """Blocks for `count` copies, aligned, not filled: (count, size) uint8."""
        found = np.zeros(count * self.size + 2 * LINE, dtype=np.uint8)  # of which none is in memory yet
        first = -address(found) % (2 * LINE)
        return found[first : first + count * self.size].reshape(count, self.size)

    def fill(self, blocks: Array, which: Array) -> None:
        """Make some of the blocks (count, size) copies of the image."""
        for at in which.tolist():
            blocks[at, : self.filled] = self.image[: self.filled]
        if self._words.size:
            words, base = blocks.view(np.int64), address(blocks)
            words[which[:, None], self._words] = self._targets + base + self.size * which[:, None]

    def take(self, structs: Mapping[str, Struct], block: Array) -> None:
        """Write the values of structs of the same layout into a block."""
        found = dict(_nested(structs))
        for path, place in self.places.items():
            value = found[path[:-1]].__dict__[path[-1]]
            own = np.ndarray(place.shape, place.dtype, block.data, place.offset)
            own[...] = value

    def addresses(self, blocks: Array, name: str) -> Array:
        """Addresses of a struct in every block, as `Struct.address`: (count,) int."""
        return address(blocks) + self.size * np.arange(len(blocks)) + self._headers[name,][0]

    def values(self, blocks: Array, *path: str) -> Array:
        """An attribute of all copies as one array (count, ...), which is the memory of the copies."""
        place = self.places[path]
        base = np.ndarray(place.shape, place.dtype, self.image.data, place.offset)
        shape, strides = (len(blocks), *place.shape), (blocks.strides[0], *base.strides)
        return np.ndarray(shape, place.dtype, blocks.data, place.offset, strides)

    def views(self, block: Array) -> dict[str, Any]:
        """The structs of a block, which share its memory."""
        return {name: self._view((name,), of, block) for name, of in self._structs.items()}

    def _view(self, path: tuple[str, ...], of: Struct, block: Array) -> Any:
        found = object.__new__(type(of))
        own = found.__dict__
        own.update(of.__dict__)
        for name in of._own():
            value = own[name]
            if isinstance(value, Struct):
                own[name] = self._view((*path, name), value, block)
            elif (place := self.places.get((*path, name))) is not None:
                own[name] = _viewed(place, block)
        if path in self._headers:
            at, size = self._headers[path]
            own["_headers"] = headers = np.ndarray((size,), np.int64, block.data, at)
            own["address"] = address(headers)
        return found


def _viewed(place: _Place, block: Array) -> Any:
    """An array or a record in a block, of the class of that which it stands for."""
    if not isinstance(place.value, np.ndarray):
        return np.ndarray((1,), place.dtype, block.data, place.offset).view(np.recarray)[0]
    found = np.ndarray(place.shape, place.dtype, block.data, place.offset)
    return found.view(type(place.value))


def _nested(structs: Mapping[str, Struct], path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Struct]]:
    """Structs, and those that are their attributes, with the names that lead to them."""
    for name, of in structs.items():
        yield (*path, name), of
        inside = {key: value for key, value in of._asdict().items() if isinstance(value, Struct)}
        yield from _nested(inside, (*path, name))


def _own(of: Struct) -> Iterator[tuple[str, Any]]:
    """Arrays and records of a struct that each copy has its own of."""
    for name, value in of._asdict().items():
        if isinstance(value, Struct) or of._fields[name].constant or not _bytes(value):
            continue
        yield name, value


def _bytes(value: Any) -> int:
    """Bytes of an array or a record."""
    return int(value.nbytes if isinstance(value, np.ndarray) else value.dtype.itemsize)
