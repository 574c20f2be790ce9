"""Stand-ins for a number and for a model, by which it is found what follows from them and what does not."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NoReturn

import numpy as np

from evolvent.model import Model
from evolvent_base.columns import UndecidedError, undecided

#: Array of a model, and field of its records ("" of all that the array has).
Read = tuple[str, str]


class AnyNumber:
    """Any finite number from `low` to `high`, but those in `without`.

    It can be passed on, and compared where the answer is the same for all of them. Whatever else is done with it raises
    an exception. What a function does with it, it does with each of them.

    Attributes
    ----------
    without : set of float, numbers with which it was compared
    """

    __slots__ = ("high", "low", "without")
    __hash__ = None  # type: ignore[assignment]

    def __init__(self, low: float, high: float) -> None:
        self.low, self.high, self.without = low, high, set[float]()

    def __eq__(self, other: object) -> bool:
        if isinstance(other, int | float):
            self.without.add(float(other))
            return False
        if other is None or isinstance(other, str):
            return False
        raise UndecidedError

    def __ne__(self, other: object) -> bool:
        return not self == other

    def __bool__(self) -> bool:
        return self != 0.0

    def _alike(self, low: bool, high: bool) -> bool:
        if low != high:
            raise UndecidedError
        return low

    def __lt__(self, other: Any) -> bool:
        return self._alike(self.low < other, self.high < other)

    def __le__(self, other: Any) -> bool:
        return self._alike(self.low <= other, self.high <= other)

    def __gt__(self, other: Any) -> bool:
        return self._alike(self.low > other, self.high > other)

    def __ge__(self, other: Any) -> bool:
        return self._alike(self.low >= other, self.high >= other)


#: What else could be done with a number.
_BINARY = "add sub mul truediv floordiv mod divmod pow and or xor lshift rshift matmul"
_UNARY = "neg pos abs invert float int complex index round trunc floor ceil str repr format array copy deepcopy"
for _name in f"{_BINARY} {_BINARY.replace(' ', ' r')} radd {_UNARY}".split():
    setattr(AnyNumber, f"__{_name}__", undecided)


class _Records:
    """Records, or one of them, of which it is noted which fields are read."""

    __slots__ = ("_name", "_raw", "_reads")
    __hash__ = None  # type: ignore[assignment]

    def __init__(self, name: str, raw: Any, reads: set[Read]) -> None:
        object.__setattr__(self, "_name", name)
        object.__setattr__(self, "_raw", raw)
        object.__setattr__(self, "_reads", reads)

    def __getitem__(self, key: Any) -> Any:
        if isinstance(key, str):
            self._reads.add((self._name, key))
            return self._raw[key]
        found = self._raw[key]
        return _Records(self._name, found, self._reads) if found.dtype.names else self._whole(found)

    def __getattr__(self, name: str) -> Any:
        if name in (self._raw.dtype.names or ()):
            return self[name]
        if name.startswith("__array"):  # of what `__array__` stands for
            raise AttributeError(name)
        if name.startswith("_"):
            _refuse(self._reads)
        found = getattr(self._raw, name)
        return found if name in ("dtype", "ndim", "shape", "size") else self._whole(found)

    def _whole(self, found: Any) -> Any:
        self._reads.add((self._name, ""))
        return found

    def __setattr__(self, name: str, value: Any) -> NoReturn:
        _refuse(self._reads)

    def __setitem__(self, key: Any, value: Any) -> NoReturn:
        _refuse(self._reads)

    def __len__(self) -> int:
        return len(self._raw)

    def __iter__(self) -> Iterator[Any]:
        return (self[k] for k in range(len(self._raw)))

    def __array__(self, *given: Any, **named: Any) -> Any:
        return self._whole(np.asarray(self._raw, *given))

    def __eq__(self, other: object) -> Any:
        return self._whole(self._raw == other)

    def __ne__(self, other: object) -> Any:
        return self._whole(self._raw != other)


class _Model:
    """A model of which it is noted what is read; compiled code refuses it."""

    def __init__(self, model: Model, reads: set[Read]) -> None:
        self.__dict__["_of"], self.__dict__["_reads"] = model, reads

    def __getattr__(self, name: str) -> Any:
        if name not in type(self._of)._fields:
            _refuse(self._reads)
        found = getattr(self._of, name)
        if getattr(found, "dtype", None) is not None and found.dtype.names:
            return _Records(name, found, self._reads)
        self._reads.add((name, ""))
        return found

    def __setattr__(self, name: str, value: Any) -> NoReturn:
        _refuse(self._reads)


#: Among what is read where that is not known.
_UNKNOWN: Read = "", ""


def _refuse(found: set[Read]) -> NoReturn:
    """Note that what is read is not known."""
    found.add(_UNKNOWN)
    raise UndecidedError


def reads(act: Callable[[Any], object], model: Model) -> frozenset[Read] | None:
    """What a function of a model reads of it; None where that is not known, as of one that calls compiled code.

    While nothing of that changes, the function returns the same.

    Parameters
    ----------
    act : function of a model
    model : Model, to which it is applied
    """
    found = set[Read]()
    try:
        act(_Model(model, found))
    except (Exception, UndecidedError):  # noqa: BLE001  (whatever the function does with what is no model)
        return None
    return None if _UNKNOWN in found else frozenset(found)
