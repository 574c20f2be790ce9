"""How strongly every varied key moves a result: a linear regression, and the indices of Sobol."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import scipy

Array = np.ndarray
#: Resamples of the bootstrap of Sobol indices, and its seed.
RESAMPLES, _SEED = 500, 20
#: Singular value of the standardised keys over the largest, below which a regression cannot distinguish them.
_LEAST = 1e-6


@dataclasses.dataclass(frozen=True, kw_only=True)
class Regression:
    """A linear regression on standardised values.

    Attributes
    ----------
    coefficients : (d,) float, standard deviations of the result for one of the key
    low, high : (d,) float, ends of their confidence intervals (Student's t)
    r2 : float, share of the variance that the linear model explains
    runs : int, that it rests on
    why : str, why there is none; else empty
    """

    coefficients: Array
    low: Array
    high: Array
    r2: float
    runs: int
    why: str = ""


def regression(x: Array, y: Array, wanted: float) -> Regression:
    """Standardised regression coefficients.

    Parameters
    ----------
    x : (n, d) float, values of the keys
    y : (n,) float, finite
    wanted : float, confidence of the intervals
    """
    n, d = x.shape
    none = np.full(d, np.nan)
    if n < d + 2:
        why = f"{n} runs with a value are too few for {d} keys; {d + 2} are needed"
        return Regression(coefficients=none, low=none, high=none, r2=math.nan, runs=n, why=why)
    spread, deviation = x.std(axis=0), float(y.std())
    if deviation <= 1e-12 * float(np.abs(y).max()):
        why = "the result does not vary"
        return Regression(coefficients=none, low=none, high=none, r2=math.nan, runs=n, why=why)
    varied = spread > 0.0
    xs = (x[:, varied] - x[:, varied].mean(axis=0)) / spread[varied]
    ys = (y - y.mean()) / deviation
    u, s, vt = np.linalg.svd(xs, full_matrices=False)
    if s.size == 0 or s[-1] < _LEAST * s[0]:
        why = "keys vary together, so that their shares cannot be distinguished"
        return Regression(coefficients=none, low=none, high=none, r2=math.nan, runs=n, why=why)
    own = vt.T @ ((u.T @ ys) / s)
    rest = float(np.sum((ys - xs @ own) ** 2))
    free = n - 1 - own.size
    errors = np.sqrt(np.sum((vt.T / s) ** 2, axis=1) * rest / free)
    half = float(scipy.special.stdtrit(free, 0.5 * (1.0 + wanted))) * errors
    coefficients, low, high = np.zeros(d), np.zeros(d), np.zeros(d)
    coefficients[varied], low[varied], high[varied] = own, own - half, own + half
    return Regression(coefficients=coefficients, low=low, high=high, r2=1.0 - rest / n, runs=n)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Indices:
    """Indices of Sobol.

    Attributes
    ----------
    first, total : (d,) float, shares of the variance: of a key alone, and with all its interactions
    first_low, first_high, total_low, total_high : (d,) float, ends of their confidence intervals (bootstrap)
    rows : int, of the base sample that they rest on
    left_out : int, rows left out since one of their runs has no value
    why : str, why there are none; else empty
    """

    first: Array
    total: Array
    first_low: Array
    first_high: Array
    total_low: Array
    total_high: Array
    rows: int
    left_out: int
    why: str = ""


def sobol(y: Array, keys: int, wanted: float) -> Indices:
    """First-order and total indices from the runs of a sample by Saltelli (`draws.saltelli`).

    Parameters
    ----------
    y : (n (keys + 2),) float; NaN of runs without a value, whose row is left out
    keys : int
    wanted : float, confidence of the intervals

    Notes
    -----
    Estimators of Saltelli et al. (2010), Comput. Phys. Commun. 181, 259, as in `scipy.stats.sobol_indices`; the
    intervals are percentiles of bootstrap resamples of rows.
    """
    rows = y.reshape(keys + 2, -1)
    whole = np.all(np.isfinite(rows), axis=0)
    left_out, n = int(np.sum(~whole)), int(whole.sum())
    a, b, ab = rows[0, whole], rows[1, whole], rows[2:, whole]
    both = np.concatenate([a, b])
    if n < 8 or both.std() <= 1e-12 * np.abs(both).max():
        none = np.full(keys, np.nan)
        why = f"{n} rows of the sample have all their values; 8 are needed" if n < 8 else "the result does not vary"
        return Indices(
            first=none, total=none, first_low=none, first_high=none, total_low=none, total_high=none,
            rows=n, left_out=left_out, why=why,
        )  # fmt: skip
    first, total = _indices(a, b, ab)
    rng = np.random.default_rng(np.random.SeedSequence(_SEED))
    resampled = [_indices(a[k], b[k], ab[:, k]) for k in rng.integers(0, n, size=(RESAMPLES, n))]
    ends = [0.5 * (1.0 - wanted), 0.5 * (1.0 + wanted)]
    (first_low, first_high), (total_low, total_high) = (
        np.nanquantile([one[which] for one in resampled], ends, axis=0) for which in (0, 1)
    )
    return Indices(
        first=first, total=total, first_low=first_low, first_high=first_high,
        total_low=total_low, total_high=total_high, rows=n, left_out=left_out,
    )  # fmt: skip


def _indices(a: Array, b: Array, ab: Array) -> tuple[Array, Array]:
    """First-order and total indices of results of both samples, (n,), and of the mixed ones, (d, n)."""
    both = np.concatenate([a, b])
    mean, variance = both.mean(), both.var()
    if variance == 0.0:
        return np.full(len(ab), np.nan), np.full(len(ab), np.nan)
    a, b, ab = a - mean, b - mean, ab - mean  # the estimators then lose no digits to the mean
    return np.mean(b * (ab - a), axis=1) / variance, 0.5 * np.mean((a - ab) ** 2, axis=1) / variance
