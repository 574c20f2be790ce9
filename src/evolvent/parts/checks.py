"""Checks of what a user writes into a part."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from evolvent.errors import InputError


def number(name: str, value: Any, *, least: float = -math.inf, allowed: str = "a finite number") -> float:
    """`value` as a float; refused unless it is a finite number, `least` or above."""
    try:
        result = float(value)
    except (TypeError, ValueError):
        result = math.nan
    if not (math.isfinite(result) and result >= least):
        raise InputError(f"{name} is {value!r}; it must be {allowed}")
    return result


def positive(name: str, value: Any, *, allowed: str = "a finite number above 0") -> float:
    """`value` as a float; refused unless finite and above zero."""
    return number(name, value, least=math.nextafter(0.0, 1.0), allowed=allowed)


def vector(name: str, value: Sequence[float], size: int = 3) -> np.ndarray:
    """`value` as (size,) float; refused unless finite."""
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError):
        array = np.full(0, math.nan)
    if array.shape != (size,) or not np.all(np.isfinite(array)):
        raise InputError(f"{name} is {value!r}; it must be {size} finite numbers")
    return array
