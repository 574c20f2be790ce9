"""Derivatives by central differences of evaluations."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

Array = np.ndarray


def central(
    values: Callable[[list[Array]], Sequence[Array]], x: Array, step: float, low: Array | float, high: Array | float
) -> Array:
    """Derivatives (n, p), one-sided at a bound and where one side has no values; NaN where neither has.

    Parameters
    ----------
    values : function of places (p,) to values (n,) at each, all finite or none; they are evaluated together
    x : (p,) float
    step : float, by which each entry of x changes
    low, high : (p,) float, bounds of x
    """
    ends = [np.clip(x + side * step * unit, low, high) for unit in np.eye(x.size) for side in (-1.0, 1.0)]
    middle, *found = values([x, *ends])
    derivatives = np.full((middle.size, x.size), np.nan)
    for k in range(x.size):
        a, b = (found[2 * k], ends[2 * k]) if np.all(np.isfinite(found[2 * k])) else (middle, x)
        c, d = (found[2 * k + 1], ends[2 * k + 1]) if np.all(np.isfinite(found[2 * k + 1])) else (middle, x)
        if d[k] > b[k]:
            derivatives[:, k] = (c - a) / (d[k] - b[k])
    return derivatives
