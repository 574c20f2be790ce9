"""What a model must have for a function, or for those of a module, to be called on it: `USED_FOR`, `jit.indirect`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

#: A family that is not empty, a function of the model, or several of them, of which one is enough.
Condition = str | Callable[[Any], Any] | tuple[Any, ...]


def nonzero(values: np.ndarray) -> np.ndarray:
    """Which values of a field are not 0."""
    return np.asarray(values != 0)


def not_negative(values: np.ndarray) -> np.ndarray:
    """Which values of a field are 0 or above."""
    return np.asarray(values >= 0)


def having(family: str, **fields: Any) -> Callable[[Any], bool]:
    """Whether a record of a family has in its fields the values given, or those for which a function given is true."""

    def condition(model: Any) -> bool:
        found = getattr(model, family)
        if not found.size:
            return False
        tests = [value(found[name]) if callable(value) else found[name] == value for name, value in fields.items()]
        return bool(np.logical_and.reduce(tests).any())

    return condition


def has(model: Any, condition: Condition) -> bool:
    """Whether a model meets a condition."""
    if isinstance(condition, str):
        return bool(getattr(model, condition).size)
    if isinstance(condition, tuple):
        return any(has(model, one) for one in condition)
    return bool(condition(model))
