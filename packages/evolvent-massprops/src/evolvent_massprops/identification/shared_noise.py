"""Noise that sensors share: found in the residual's correlation, taken into account by whitening across sensors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy

from evolvent_base.errors import InputError
from evolvent_massprops.identification.signals import Array, Signal

#: Sensors share noise where their residuals' correlation has a smaller p-value.
SHARED = 1e-4
#: Least eigenvalue of a correlation that can be inverted.
SINGULAR = 1e-6
#: Two sensors are copies where their samples' correlation is nearer to 1 or -1.
COPY = 1e-12


def correlation(signal: Signal, residual: Array, noise: Array, unknowns: int = 0) -> Array | None:
    """Correlation of the sensors' residuals, (c, c); None where that of independent noise would be as large.

    Parameters
    ----------
    signal
    residual : (N, c)
    noise : (c,) standard deviations; residuals at the level of rounding say nothing
    unknowns : number of parameters that were fitted to each sensor

    Notes
    -----
    For independent noise, n sum over pairs of correlation^2 is chi squared with a degree of freedom a pair, n the
    samples less the unknowns. Only samples that all sensors have are looked at.
    """
    sensors = residual.shape[1]
    if sensors < 2 or np.any(noise <= signal.rounding):
        return None
    r = residual if signal.present.all() else residual[signal.present.all(axis=1)]
    free = len(r) - unknowns
    if free < 8 * sensors:
        return None
    products = r.T @ r
    size = np.sqrt(np.diag(products))
    if not np.all(size > 0.0):
        return None
    found = products / np.outer(size, size)
    statistic = 0.5 * free * (float((found**2).sum()) - sensors)
    return found if scipy.special.gammaincc(0.25 * sensors * (sensors - 1), 0.5 * statistic) < SHARED else None


def components(residual: Array, noise: Array, shared: Array | None) -> Array:
    """(N, k) residual as k <= c components of unit variance, uncorrelated where it has the correlation `shared`."""
    scaled = residual / noise
    if shared is None:
        return scaled
    value, vector = np.linalg.eigh(shared)
    kept = value > SINGULAR
    return np.asarray(scaled @ (vector[:, kept] / np.sqrt(value[kept])))


def mixing(noise: Array, shared: Array) -> Array | None:
    """L (c, c) of the noise's covariance L L^T; None where that is singular."""
    if np.linalg.eigvalsh(shared)[0] < SINGULAR:
        return None
    return np.linalg.cholesky(shared * np.outer(noise, noise))


def unmixed(signal: Signal, L: Array) -> Signal:
    """Combinations of all sensors whose noise is independent and of unit variance; the poles stay the same."""
    return replace(signal, data=np.linalg.solve(L, signal.data.T).T, noise=np.ones(len(L)))


def refuse_copies(signal: Signal) -> None:
    """Refuse a sensor whose samples are another's, to a factor and an offset: it would count twice."""
    data = signal.data[signal.present.all(axis=1)]
    data = data - data.mean(axis=0)
    data = data / np.sqrt((data**2).sum(axis=0))
    same = np.argwhere(np.triu(np.abs(data.T @ data) > 1.0 - COPY, 1))
    if same.size:
        first, second = (signal.names[k] for k in same[0])
        raise InputError(f"{second} is a copy of {first}, including its noise, and would count twice; leave it out")


def pair(names: tuple[str, ...], shared: Array) -> str:
    """The two sensors that share most, and their correlation."""
    i, j = np.unravel_index(np.argmax(np.abs(np.triu(shared, 1))), shared.shape)
    return f"{names[i]} and {names[j]} (correlation {shared[i, j]:.2f})"
