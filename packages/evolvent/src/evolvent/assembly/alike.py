"""Whether two values that parts have written are equal, or alike: zero, infinite and of a sign where the other is."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from evolvent_base.columns import has_columns, stacked

Array = np.ndarray
#: Entries of a matrix beside its largest one that are round-off.
ROUND_OFF = 1e-14


def different(row: Mapping[str, Any], before: Mapping[str, Any]) -> Iterator[str]:
    """Fields of a row that are not those of another."""
    for field in row if row.keys() == before.keys() else row.keys() | before.keys():
        if field not in row or field not in before or not _equal(row[field], before[field]):
            yield field


def _equal(a: Any, b: Any) -> bool:
    """Whether two values of a field are equal."""
    if isinstance(a, int | float) and isinstance(b, int | float):
        return a == b
    if a is b:
        return True
    if has_columns(a):
        return False
    if type(a) is type(b) is np.ndarray and a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes():
        return True
    return bool(np.array_equal(a, b))


def _sign(value: float) -> float:
    """Sign of a number; NaN of none, which is unlike any."""
    return math.nan if math.isnan(value) else int(value > 0.0) - int(value < 0.0)


def alike(new: Any, old: Any) -> bool:
    """Whether values are zero, infinite and of a sign where others are; of a matrix but for round-off."""
    if isinstance(new, int | float) and isinstance(old, int | float):
        return math.isfinite(new) == math.isfinite(old) and _sign(new) == _sign(old)
    if has_columns(new):
        return _all_alike(stacked(new), np.asarray(old, dtype=float))
    if new is None or old is None or np.shape(new) != np.shape(old):
        return False
    if not np.array_equal(np.isfinite(new), np.isfinite(old)):
        return False
    if np.ndim(new) < 2:
        return bool(np.array_equal(np.sign(new), np.sign(old)))
    least = ROUND_OFF * max(np.abs(new).max(initial=0.0), np.abs(old).max(initial=0.0))
    differ = np.sign(new) != np.sign(old)
    return bool(np.all(np.abs(new)[differ] <= least) and np.all(np.abs(old)[differ] <= least))


def _all_alike(stack: Array, old: Array) -> bool:
    """Whether each of a stack of values (n, ...) is like those of another one, as of `alike`."""
    if stack.shape[1:] != old.shape or not np.all(np.isfinite(stack) == np.isfinite(old)):
        return False
    differ = np.sign(stack) != np.sign(old)
    if old.ndim < 2:
        return not np.any(differ)
    if not np.any(differ):
        return True
    axes = tuple(range(1, stack.ndim))
    least = ROUND_OFF * np.maximum(np.abs(stack).max(axis=axes, initial=0.0), np.abs(old).max(initial=0.0))
    least = np.broadcast_to(least.reshape(-1, *np.ones(old.ndim, dtype=int)), stack.shape)
    small = (np.abs(stack) <= least) & (np.abs(old) <= least)
    return bool(np.all(small[differ]))


def equal_lists(name: str, new: list[Any], old: list[Any]) -> bool:
    """Whether two lists of a builder are equal, by the name of the list."""
    if len(new) != len(old):
        return False
    if name == "poses":
        pairs = (pair for one, other in zip(new, old, strict=True) for pair in zip(one, other, strict=True))
        return all(np.array_equal(a, b) for a, b in pairs)
    return bool(new == old)
