"""How many modes the samples hold."""

from __future__ import annotations

import numpy as np
from scipy.special import gammaincc

from evolvent.identification.modes import Modes, OrderCriteria
from evolvent.identification.signals import (
    Array,
    Signal,
    fit_linear,
    highest_order,
    noise_floor,
    power,
    rounding,
)
from evolvent.identification.subspace import Starts, add_peaks
from evolvent.identification.variable_projection import Fit, fit, modes_of_fit, objections

#: Orders that are tried where the user sets no limit.
MOST_MODES = 10
#: The search ends after so many orders that do not better the description length.
PATIENCE = 2
#: A residual with a smaller p-value is not white.
WHITE = 1e-3


def whiteness(signal: Signal, residual: Array, noise: Array) -> float:
    """p-value of the highest line of the residual's periodogram, summed over sensors, were the residual white.

    Notes
    -----
    Each line of white noise is a sum of c exponential variables, Gamma(c); the highest of n such lines exceeds x with
    probability 1 - (1 - Q(c, x))^n (Fisher's test, Brockwell & Davis 1991, section 10.2, for known noise). What the
    fit has taken off near its modes makes the test careful rather than keen.
    """
    lines = power(residual)[1:-1] / (signal.counts * noise**2)
    total = lines.sum(axis=1)
    tail = gammaincc(residual.shape[1], total.max())
    return float(-np.expm1(len(total) * np.log1p(-min(float(tail), 1.0 - 1e-16))))


def criteria(signal: Signal, residual: Array, m: int) -> tuple[float, float]:
    """Description length and BIC of `m` modes with common poles.

    Notes
    -----
    MDL = sum_c n_c/2 log s_c^2 + sum over parameters of the half logarithm of their information: n_c for the 2 m
    amplitudes and the offset of a sensor, N^3 for each frequency and decay rate (Rissanen 1989; Djurić 1996, eq. 26).
    BIC = sum_c n_c log s_c^2 + k log(sum_c n_c), k all parameters. s_c^2 is the mean square of the residual.
    """
    counts = signal.counts
    power_left = np.nansum(residual**2, axis=0) / counts + (100.0 * rounding(signal)) ** 2
    fit_term = float((counts * np.log(power_left)).sum())
    own = 2 * m + 1 + signal.degree
    mdl = 0.5 * fit_term + 0.5 * own * float(np.log(counts).sum()) + 0.5 * 2 * m * 3.0 * np.log(len(signal.time))
    bic = fit_term + (own * len(counts) + 2 * m) * float(np.log(counts.sum()))
    return float(mdl), bic


def fit_order(signal: Signal, starts: Starts, order: int, previous: Fit | None) -> Fit:
    """The best fit of `order` modes from ESPRIT's start and from the fit of one mode less with a line added."""
    trials = [fit(starts.poles(order), signal)]
    if previous is not None:
        trials.append(fit(add_peaks(signal, previous.poles, order), signal))
    good = [trial for trial in trials if trial.converged] or trials
    return min(good, key=lambda trial: criteria(signal, trial.residual, order)[0])


def search(signal: Signal, limit: int | None = None) -> tuple[Modes | None, OrderCriteria]:
    """Try 0, 1, 2, ... modes and take the order that MDL asks for, confirmed by BIC and by a white residual.

    Parameters
    ----------
    signal
    limit : the largest order to try; MOST_MODES unless given, and never more than the samples allow

    Returns
    -------
    modes : of the order found; None where no mode stands out of the noise
    criteria : of all orders tried

    Notes
    -----
    Orders with a mode that cannot be told from its neighbour or from the noise are out of the question. Where MDL and
    BIC differ, the lower order is taken if its residual is white, else the higher.
    """
    most = min(MOST_MODES if limit is None else limit, highest_order(signal))
    starts = Starts(signal)
    rows: list[tuple[int, float, float, float, bool]] = []
    tried: list[Modes | None] = []
    previous: Fit | None = None
    for m in range(most + 1):
        if m == 0:
            found = fit_nothing(signal)
            supported, modes = True, None
        else:
            found = fit_order(signal, starts, m, previous)
            modes = modes_of_fit(found, signal)
            supported = found.converged and not objections(modes)
        rows.append(
            (m, *criteria(signal, found.residual, m), whiteness(signal, found.residual, found.noise), supported)
        )
        tried.append(modes)
        previous = found
        best = max(_least(rows, 1), _least(rows, 2))
        if m >= best + PATIENCE:
            break
    by_mdl, by_bic = _least(rows, 1), _least(rows, 2)
    low, high = sorted((by_mdl, by_bic))
    order = low if rows[low][3] >= WHITE else high
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    return tried[order], OrderCriteria(*columns)


def _least(rows: list[tuple[int, float, float, float, bool]], column: int) -> int:
    """The supported order of least criterion."""
    return min((row for row in rows if row[4]), key=lambda row: row[column])[0]


def fit_nothing(signal: Signal) -> Fit:
    """The fit of offsets alone."""
    residual = fit_linear(np.empty(0, dtype=complex), signal)[1]
    noise = signal.noise if signal.noise is not None else noise_floor(signal, residual, 0)
    return Fit(np.empty(0, dtype=complex), noise, residual, 0, True)
