"""MAT files of version 5: numbers and texts, with those in structs and cells; every size is checked.

SciPy's reader trusts sizes and kinds that a damaged file states, and may end the process with a fault. The format is
level 5 of "MAT-File Format" (The MathWorks, 2024).
"""

from __future__ import annotations

import math
import zlib
from typing import Literal

import numpy as np

from evolvent_base.errors import InputError
from evolvent_base.safe_open import check_declared

Order = Literal["little", "big"]
#: What a file holds: the names of an array and of all that it lies in -> numbers, or rows of a text.
Leaves = dict[tuple[str, ...], "np.ndarray | tuple[str, ...]"]

#: Bytes that are decompressed at a time, which may become a thousand times as many.
_SLICE = 1 << 15
#: Levels of structs and cells, and arrays of a file, at most.
_DEEPEST, _MOST = 32, 100_000
_MATRIX, _COMPRESSED = 14, 15
_CELL, _STRUCT, _OBJECT, _CHAR, _SPARSE, _FUNCTION, _OPAQUE = 1, 2, 3, 4, 5, 16, 17
#: Kinds of elements that hold numbers -> their type; texts -> their encoding.
_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_TEXTS = {1: "latin-1", 2: "latin-1", 16: "utf-8", 17: "utf-16", 18: "utf-32", 4: "utf-16"}


class _Damaged(Exception):
    """An array is not as it says of itself."""


def is_version_5(raw: bytes) -> bool:
    """Whether a file's head is that of a MAT file of version 5."""
    return len(raw) >= 128 and raw[126:128] in (b"IM", b"MI")


def read(raw: bytes, name: str) -> tuple[Leaves, dict[str, str]]:
    """Arrays of numbers and texts; and names of all else -> what it is, such as "an object of the class 'table'".

    Parameters
    ----------
    raw : bytes of the file
    name : str, for messages

    Raises
    ------
    InputError
        If an array is damaged, or the compressed ones would fill the memory.
    """
    order: Order = "little" if raw[126:128] == b"IM" else "big"
    place, declared = 128, 0
    reader = _Reader(order)
    while place + 8 <= len(raw):
        kind, first, last, _ = _tag(raw, place, order)
        element = raw[place:last]
        if kind == _COMPRESSED:
            machine, pieces = zlib.decompressobj(), []
            for at in range(first, min(last, len(raw)), _SLICE):
                try:
                    pieces.append(machine.decompress(raw[at : min(at + _SLICE, last)]))
                except zlib.error:
                    raise InputError(f"cannot read {name!r}: its array {reader.count + 1} is damaged") from None
                declared += len(pieces[-1])
                check_declared(declared, len(raw), name)
                if machine.eof:
                    break
            element = b"".join(pieces)
        reader.title = "?"
        try:
            reader.matrix(element, (), 0)
        except (_Damaged, IndexError, ValueError, LookupError):
            raise InputError(f"cannot read {name!r}: its array {reader.title!r} is damaged") from None
        place = last
    return reader.leaves, reader.others


def _tag(raw: bytes, place: int, order: Order) -> tuple[int, int, int, int]:
    """Kind of an element at an address, the first byte of its data, the one after its last, and the next element."""
    kind, size = (int.from_bytes(raw[place + k : place + k + 4], order) for k in (0, 4))
    if kind >> 16:  # up to four bytes stand in the tag itself
        return kind & 0xFFFF, place + 4, place + 4 + (kind >> 16), place + 8
    return kind, place + 8, place + 8 + size, place + 8 + size + -size % 8


class _Reader:
    """What has been read of a file.

    Attributes
    ----------
    title : the array of the file that is being read
    """

    def __init__(self, order: Order) -> None:
        self.order, self.title, self.count = order, "?", 0
        self.leaves: Leaves = {}
        self.others: dict[str, str] = {}

    def matrix(self, element: bytes, path: tuple[str, ...], deep: int) -> None:
        """Keep an array; `path` : its names where it lies in another, whose own name is empty."""
        self.count += 1
        kind, place, end, _ = _tag(element, 0, self.order)
        if kind != _MATRIX or end > len(element) or deep > _DEEPEST or self.count > _MOST:
            raise _Damaged
        if place == end:
            return  # an empty array
        parts = []
        while place + 8 <= end:
            own, first, last, place = _tag(element, place, self.order)
            if last > end:
                raise _Damaged
            parts.append((own, element[first:last], element[first - 8 : last] if own == _MATRIX else b""))
            self.count += 1
            if not path and len(parts) == 3:
                self.title = parts[2][1][:80].decode("utf-8" if parts[2][0] == 16 else "latin-1", "replace")
        if place < end or len(parts) < 3 or parts[0][0] != 6 or len(parts[0][1]) != 8:
            raise _Damaged
        flags = int.from_bytes(parts[0][1][:4], self.order)
        class_ = flags & 0xFF
        if class_ >= _FUNCTION:
            words = [data[:80].decode("latin-1") for own, data, _ in parts[1:] if own in (1, 2)]
            what = f"an object of the class {words[2]!r}" if class_ == _OPAQUE and len(words) > 2 else "a function"
            self.others[".".join(path) or (words or ["?"])[0]] = what
            return
        if parts[1][0] not in (5, 6) or parts[2][0] not in _TEXTS:
            raise _Damaged
        shape = self._shape(parts[1][1])
        path = path or (self.title,)
        if path == ("",):
            return  # values of objects
        rest = parts[3:]
        if class_ == _CHAR:
            self.leaves[path] = self._text(rest, shape)
        elif class_ == _CELL:
            self._cell(rest, shape, path, deep)
        elif class_ in (_STRUCT, _OBJECT):
            self._struct(rest[class_ == _OBJECT :], shape, path, deep)
        elif 6 <= class_ <= 15:
            self.leaves[path] = self._numbers(rest, shape, is_complex=bool(flags & 0x800))
        else:
            self.others[".".join(path)] = "a sparse matrix" if class_ == _SPARSE else "of an unknown class"

    def _shape(self, data: bytes) -> tuple[int, ...]:
        shape = tuple(int.from_bytes(data[k : k + 4], self.order, signed=True) for k in range(0, len(data), 4))
        if len(data) % 4 or not 2 <= len(shape) <= 8 or min(shape) < 0:
            raise _Damaged
        return shape

    def _numbers(
        self, parts: list[tuple[int, bytes, bytes]], shape: tuple[int, ...], *, is_complex: bool
    ) -> np.ndarray:
        if len(parts) != 1 + is_complex:
            raise _Damaged
        found = []
        for own, data, _ in parts:
            type_ = np.dtype(_TYPES[own]).newbyteorder("<" if self.order == "little" else ">")
            if len(data) != math.prod(shape) * type_.itemsize:
                raise _Damaged
            found.append(np.frombuffer(data, dtype=type_).astype(type_.newbyteorder("=")))
        values = found[0] + 1j * found[1] if is_complex else found[0]
        return values.reshape(shape, order="F")

    def _text(self, parts: list[tuple[int, bytes, bytes]], shape: tuple[int, ...]) -> tuple[str, ...]:
        """Rows of a text, blanks at their ends gone."""
        if not parts or not math.prod(shape):
            return ()
        own, data, _ = parts[0]
        coding = _TEXTS[own]
        if coding in ("utf-16", "utf-32"):
            coding += "-le" if self.order == "little" else "-be"
        text = data.decode(coding, "replace")
        rows = shape[0]
        return tuple(text[k::rows].rstrip(" \0") for k in range(rows))

    def _cell(
        self, parts: list[tuple[int, bytes, bytes]], shape: tuple[int, ...], path: tuple[str, ...], deep: int
    ) -> None:
        """The cells; cells of texts alone become rows of one text."""
        if len(parts) != math.prod(shape):
            raise _Damaged
        texts = []
        for k, (_, _, whole) in enumerate(parts):
            own = (*path[:-1], f"{path[-1]}{{{k + 1}}}") if len(parts) > 1 else path
            self.matrix(whole, own, deep + 1)
            found = self.leaves.get(own)
            if isinstance(found, tuple) and len(found) <= 1:
                texts.append((own, found[0] if found else ""))
        if parts and len(texts) == len(parts):
            for own, _ in texts:
                self.leaves.pop(own, None)
            self.leaves[path] = tuple(text for _, text in texts)

    def _struct(
        self, parts: list[tuple[int, bytes, bytes]], shape: tuple[int, ...], path: tuple[str, ...], deep: int
    ) -> None:
        """The fields of a struct; those of an array of structs behind the number of its element."""
        length = int.from_bytes(parts[0][1], self.order)
        if length < 1 or len(parts[1][1]) % length:
            raise _Damaged
        names = [parts[1][1][k : k + length] for k in range(0, len(parts[1][1]), length)]
        fields = [one.partition(b"\0")[0].decode("latin-1") for one in names]
        count = math.prod(shape)
        if len(parts) - 2 != count * len(fields):
            raise _Damaged
        for k in range(count):
            own = path if count == 1 else (*path[:-1], f"{path[-1]}({k + 1})")
            for n, key in enumerate(fields):
                self.matrix(parts[2 + k * len(fields) + n][2], (*own, key), deep + 1)
