"""What a parameter changes in a model: numbers in its records, by which other models of the same system are changed."""

from __future__ import annotations

import ctypes
import dataclasses
import functools
from collections.abc import Iterable
from typing import Any

import numpy as np

from evolvent.assembly.assembled import Assembly
from evolvent.compiled.pointer import Struct
from evolvent_base.errors import InputError

Array = np.ndarray


@functools.cache
def _floats(dtype: np.dtype) -> Array:
    """Which 8-byte words of a record are floats, (n,) bool."""
    found = np.zeros(dtype.itemsize // 8, dtype=bool)

    def mark(kind: np.dtype, at: int) -> None:
        if kind.subdtype is not None:
            base, shape = kind.subdtype
            for i in range(int(np.prod(shape))):
                mark(base, at + i * base.itemsize)
        elif kind.fields is not None:
            for field in kind.fields.values():
                mark(field[0], at + field[1])
        elif kind.kind == "f":
            found[at // 8] = True

    mark(dtype, 0)
    return found


def _words(value: Any) -> Array:
    """The 8-byte words of an array or a record, as integers, in place."""
    if not value.nbytes:
        return np.zeros(0, np.int64)
    buffer: Any
    if isinstance(value, np.ndarray):
        buffer = memoryview(value.data).cast("B")
    else:  # of which a memoryview would be a copy
        buffer = (ctypes.c_char * value.nbytes).from_address(value.__array_interface__["data"][0])
    return np.frombuffer(buffer, dtype=np.int64)


def restore(base: Struct, changed: Struct, arrays: Iterable[str]) -> None:
    """Give some arrays of a changed model the numbers that they have in another one."""
    for key in arrays:
        _words(getattr(changed, key))[:] = _words(getattr(base, key))


@dataclasses.dataclass(frozen=True)
class Patch:
    """Numbers of a model that a parameter changes.

    Attributes
    ----------
    changes : tuple of (name of the array, (n,) int words, (n,) int their bits before, (n,) float after)
    """

    changes: tuple[tuple[str, Array, Array, Array], ...]

    @classmethod
    def between(cls, base: Assembly, changed: Assembly, name: str) -> Patch:
        """What differs between the models of two systems.

        Parameters
        ----------
        base, changed : of variants of one system, arrays that neither of them has touched are not compared
        name : str, of the parameter, for messages

        Raises
        ------
        InputError
            Where the parameter changes what the model is made of.
        """
        known = base.shared is not None and base.shared is changed.shared
        both = None if not known or base.touched is None or changed.touched is None else base.touched | changed.touched
        return cls.in_arrays(base.model, changed.model, base.model._asdict() if both is None else both, name)

    @classmethod
    def in_arrays(cls, base: Struct, changed: Struct, arrays: Iterable[str], name: str) -> Patch:
        """What differs between some arrays of two models; as of `between`."""
        found = []
        for key in arrays:
            value = getattr(base, key)
            before, after = _words(value), _words(getattr(changed, key))
            if before.size != after.size:
                raise InputError(f"{name!r} changes what the system is made of, by which there is no derivative")
            at = np.flatnonzero(before != after)
            if not at.size:
                continue
            dtype = value.dtype
            if not np.all(_floats(dtype)[at % (dtype.itemsize // 8)]):
                raise InputError(f"{name!r} changes what the system is made of, by which there is no derivative")
            found.append((key, at, before[at].copy(), after[at].view(np.float64).copy()))
        return cls(tuple(found))

    @classmethod
    def along(cls, up: Patch, down: Patch, factor: float) -> Patch:
        """What two patches of a model differ by, times a factor, added to the model."""
        found = []
        sides = [{key: row for key, *row in one.changes} for one in (up, down)]
        for key in {**sides[0], **sides[1]}:
            own = [one[key] for one in sides if key in one]
            at, first = np.unique(np.concatenate([row[0] for row in own]), return_index=True)
            before = np.concatenate([row[1] for row in own])[first]
            ends = []
            for one in sides:
                ends.append(before.copy().view(np.float64))
                if key in one:
                    ends[-1][np.searchsorted(at, one[key][0])] = one[key][2]
            after = before.view(np.float64) + factor * (ends[0] - ends[1])
            found.append((key, at, before, after))
        return cls(tuple(found))

    def write(self, model: Struct) -> None:
        """Change a model in place, where it still has the numbers of the first one."""
        for key, at, before, after in self.changes:
            words = _words(getattr(model, key))
            same = words[at] == before
            words[at[same]] = after[same].view(np.int64)

    def undo(self, model: Struct) -> None:
        """Restore the numbers of the first model, in one that `write` has changed."""
        for key, at, before, after in self.changes:
            words = _words(getattr(model, key))
            same = words[at] == after.view(np.int64)
            words[at[same]] = before[same]


@dataclasses.dataclass(frozen=True)
class Sides:
    """What a parameter changes to both sides, larger and smaller: of the model, and states at the start."""

    patches: tuple[Patch, Patch]
    starts: tuple[Array, Array]

    @classmethod
    def of(cls, base: Assembly, sides: tuple[Assembly, Assembly], name: str) -> Sides:
        """By the systems with the parameter changed.

        Raises
        ------
        InputError
            As of `Patch.between`.
        """
        up, down = sides
        return cls((Patch.between(base, up, name), Patch.between(base, down, name)), (up.y, down.y))
