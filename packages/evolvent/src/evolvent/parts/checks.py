"""Checks of what a user writes into a part."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from evolvent.kernels import rigid
from evolvent_base.errors import InputError
from evolvent_base.schema import Section
from evolvent_base.units import Measured


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


def check_rotor(body: Mapping[str, Any], axis: np.ndarray, inertia: float, key: str, name: str) -> None:
    """Refuse a rotor whose moment of inertia is not a part of that of its body.

    Parameters
    ----------
    body : row of the body
    axis : (3,) float, of the rotor, body axes
    inertia : float, kg m2
    key, name : str, the key that holds the inertia, and the body's name
    """
    if body["motion"] == rigid.FREE:
        left = float(np.linalg.eigvalsh(body["inertia"] - inertia * np.outer(axis, axis)).min())
        most = 1.0 / float(axis @ np.linalg.solve(body["inertia"], axis))
    elif body["motion"] == rigid.SPIN:
        along = float(body["axis"] @ axis) ** 2
        left = body["spin_inertia"] - inertia * along
        most = body["spin_inertia"] / along if along > 0.0 else np.inf
    else:
        return
    if left <= 0.0:
        raise InputError(
            f"{key} is {inertia!r} kg m2; the inertia of {name!r} includes it; it must be below {most:.6g} kg m2 "
            f"about this axis"
        )


def check_unit(key: str, value: Any, unit: str) -> None:
    """Refuse values, also inside sections and lists, that have another unit than what the other keys of a part say."""
    if isinstance(value, Section):
        for inner in type(value).model_fields:
            check_unit(f"{key}.{inner}", getattr(value, inner), unit)
    elif isinstance(value, tuple):
        for inner in value:
            check_unit(key, inner, unit)
    elif isinstance(value, Measured) and value.unit in ("N", "N m", "N/m", "Pa") and value.unit != unit:
        raise InputError(f"{key} has the unit {value.unit}; it must be in {unit}")
