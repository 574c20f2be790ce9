"""A number with one value in each of many variants, with which what follows from it is computed for all at once."""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any, NoReturn

import numpy as np

Array = np.ndarray


class UndecidedError(BaseException):
    """More follows from a stand-in for numbers than it can tell; no `except Exception` takes another way for it."""


def undecided(*_: Any, **__: Any) -> NoReturn:
    """Refuse what a stand-in does not do."""
    raise UndecidedError


class Column:
    """Values of one number, which arithmetic takes one by one: each has the bits that it has alone.

    Arrays with columns are of the type object. A comparison is answered where it is the same for all values; what else
    is done with a column raises an exception.

    Parameters
    ----------
    values : (n,) float
    """

    __slots__ = ("values",)
    __hash__ = None  # type: ignore[assignment]

    def __init__(self, values: Array) -> None:
        self.values = values

    def _with(self, other: Any, act: Callable[[Any, Any], Any]) -> Any:
        if isinstance(other, Column):
            return act(self.values, other.values)
        if isinstance(other, bool | np.bool_) or not isinstance(other, int | float | np.integer):
            return NotImplemented
        return act(self.values, float(other))

    def _made(self, other: Any, act: Callable[[Any, Any], Any]) -> Any:
        found = self._with(other, act)
        return found if found is NotImplemented else Column(found)

    def __add__(self, other: Any) -> Any:
        return self._made(other, operator.add)

    __radd__ = __add__

    def __mul__(self, other: Any) -> Any:
        return self._made(other, operator.mul)

    __rmul__ = __mul__

    def __sub__(self, other: Any) -> Any:
        return self._made(other, operator.sub)

    def __rsub__(self, other: Any) -> Any:
        return self._made(other, lambda a, b: b - a)

    def __truediv__(self, other: Any) -> Any:
        return self._made(other, _divided)

    def __rtruediv__(self, other: Any) -> Any:
        return self._made(other, lambda a, b: _divided(b, a))

    def __pow__(self, other: Any) -> Any:
        if type(other) not in (int, float):
            return NotImplemented
        return Column(np.array([value**other for value in self.values.tolist()], dtype=float))

    def __neg__(self) -> Column:
        return Column(-self.values)

    def __pos__(self) -> Column:
        return self

    def __abs__(self) -> Column:
        return Column(np.abs(self.values))

    def sqrt(self) -> Column:
        """Square roots, which NumPy asks for by this name."""
        if not np.all(self.values >= 0.0):
            raise UndecidedError
        return Column(np.sqrt(self.values))

    def _answer(self, other: Any, act: Callable[[Any, Any], Any]) -> Any:
        found = self._with(other, act)
        if found is NotImplemented:
            raise UndecidedError
        if not (found.all() or not found.any()):
            raise UndecidedError
        return bool(found.all())

    def __eq__(self, other: object) -> bool:
        if other is None or isinstance(other, str):
            return False
        return bool(self._answer(other, operator.eq))

    def __ne__(self, other: object) -> bool:
        return not self == other

    def __bool__(self) -> bool:
        return self != 0.0

    def __lt__(self, other: Any) -> bool:
        return bool(self._answer(other, operator.lt))

    def __le__(self, other: Any) -> bool:
        return bool(self._answer(other, operator.le))

    def __gt__(self, other: Any) -> bool:
        return bool(self._answer(other, operator.gt))

    def __ge__(self, other: Any) -> bool:
        return bool(self._answer(other, operator.ge))


#: What else could be done with a number.
_OTHERS = "floordiv mod divmod and or xor lshift rshift matmul rpow rfloordiv rmod rdivmod float int complex index"
for _name in f"{_OTHERS} round trunc floor ceil str repr format copy deepcopy".split():
    setattr(Column, f"__{_name}__", undecided)


def _divided(a: Any, b: Any) -> Any:
    if np.any(np.asarray(b) == 0.0):  # at which Python raises an exception, and NumPy does not
        raise UndecidedError
    return a / b


def each(function: Callable[..., float], *numbers: Any) -> Any:
    """A function of numbers, such as `math.tanh` or `min`, of each value where columns are among them."""
    if not any(isinstance(one, Column) for one in numbers):
        return function(*numbers)
    count = next(one.values.size for one in numbers if isinstance(one, Column))
    listed = [stacked(one, count).tolist() for one in numbers]
    return Column(np.array([function(*one) for one in zip(*listed, strict=True)], dtype=float))


def has_columns(value: Any) -> bool:
    """Whether something is a column, or an array or list with columns."""
    if isinstance(value, list | tuple):
        return any(has_columns(one) for one in value)
    if isinstance(value, np.ndarray):
        return value.dtype == object and any(isinstance(one, Column) for one in value.ravel().tolist())
    return isinstance(value, Column)


def stacked(value: Any, count: int | None = None) -> Array:
    """Numbers of a column, or of an array with columns: (n, ...) float, also of what has none where `count` is given.

    Raises
    ------
    UndecidedError
        Where something else than numbers is in the array.
    """
    own = np.asarray(value, dtype=object) if has_columns(value) else np.asarray(value, dtype=float)
    if own.dtype != object:
        if count is None:
            raise UndecidedError
        return np.repeat(own[None], count, axis=0)
    flat = own.ravel().tolist()
    sizes = {one.values.size for one in flat if isinstance(one, Column)}
    if len(sizes) > 1 or not all(isinstance(one, Column | float | int) for one in flat):
        raise UndecidedError
    n = sizes.pop() if sizes else count
    if n is None:
        raise UndecidedError
    found = np.empty((n, len(flat)))
    for k, one in enumerate(flat):
        found[:, k] = one.values if isinstance(one, Column) else one
    return found.reshape(n, *own.shape)


def columns_of(stack: Array) -> Array:
    """An array of columns whose numbers are those of a stack (n, ...)."""
    flat = np.empty(stack[0].size, dtype=object)
    for k, values in enumerate(np.ascontiguousarray(stack.reshape(len(stack), -1).T)):
        flat[k] = Column(values)
    return flat.reshape(stack.shape[1:])
