"""Uncertainty of fitted parameters: of the data, and of the integration of the runs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from evolvent_base.errors import InputError

Array = np.ndarray
#: Fewest residuals whose autocorrelation is tested.
MANY = 10


def of_data(J: Array, r: Array, parameters: Any, least: float, *, given: bool) -> tuple[Array, Array]:
    """Standard errors (SI) and correlations: inverse of J^T J, times the variance of the residuals if none is given."""
    norms = np.linalg.norm(J, axis=0)
    idle = [p.key for p, n in zip(parameters, norms, strict=True) if n == 0.0]
    if idle:
        raise InputError(f"the data do not depend on {', '.join(idle)}; leave it out of --fit")
    _, s, vt = np.linalg.svd(J / norms, full_matrices=False)
    if s[-1] < least * s[0]:
        mixed = [p.key for p, share in zip(parameters, vt[-1], strict=True) if abs(share) > 0.1]
        raise InputError(f"the data cannot separate {', '.join(mixed)}; leave one of them out of --fit")
    covariance = (vt.T / s**2) @ vt / np.outer(norms, norms)
    if not given:
        covariance = covariance * float(r @ r) / (r.size - len(parameters))
    deviation = np.sqrt(np.diag(covariance))
    scales = np.array([p.scale for p in parameters])
    return deviation * scales, covariance / np.outer(deviation, deviation)


def shift(J: Array, change: Array) -> Array:
    """Change of the fitted parameters, in their scales, where residuals change by so much: of first order.

    Parameters
    ----------
    J : (n, p) float, derivatives of the residuals at the solution
    change : (n,) float
    """
    norms = np.linalg.norm(J, axis=0)
    found: Array = -np.linalg.lstsq(J / norms, change, rcond=None)[0] / norms
    return found


def following(residuals: Sequence[Array]) -> str:
    """A sentence where residuals, in one or more series, follow one another more than by chance; else ''."""
    size, square = sum(r.size for r in residuals), sum(float(r @ r) for r in residuals)
    found = sum(float(r[1:] @ r[:-1]) for r in residuals) / square if size >= MANY and square > 0.0 else 0.0
    if found <= 2.0 / np.sqrt(size):
        return ""
    return (
        f"residuals follow one another (correlation {found:.2f} from one value to the next): the model lacks "
        f"something, and standard errors are too small"
    )
