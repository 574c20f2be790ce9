"""Checks of what a user writes into a part."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from evolvent.errors import InputError, nearest


def positive(name: str, value: float) -> float:
    """`value` as a float; refused unless finite and above zero."""
    if not (math.isfinite(value) and value > 0.0):
        raise InputError(f"{name} is {value!r}; it must be a finite number above 0")
    return float(value)


def not_negative(name: str, value: float) -> float:
    """`value` as a float; refused unless finite and at least zero."""
    if not (math.isfinite(value) and value >= 0.0):
        raise InputError(f"{name} is {value!r}; it must be a finite number, 0 or above")
    return float(value)


def vector(name: str, value: Sequence[float], size: int = 3) -> np.ndarray:
    """`value` as (size,) float; refused unless finite."""
    array = np.array(value, dtype=float)
    if array.shape != (size,) or not np.all(np.isfinite(array)):
        raise InputError(f"{name} is {value!r}; it must be {size} finite numbers")
    return array


def unit_vector(name: str, value: Sequence[float]) -> np.ndarray:
    """`value` as (3,) float of length 1; refused where its length is zero."""
    array = vector(name, value)
    length = float(np.linalg.norm(array))
    if length == 0.0:
        raise InputError(f"{name} is {value!r}; a direction must not be zero")
    return array / length


def choice(name: str, value: Any, known: dict[str, int]) -> int:
    """The number behind one of the `known` words."""
    if value not in known:
        raise InputError(f"{name} is {value!r}; {nearest(str(value), known)}")
    return known[value]
