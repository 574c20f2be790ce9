"""How many modes the samples hold."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from evolvent_massprops.identification.modes import IdentifiedModes, OrderCriteria
from evolvent_massprops.identification.noise_density import faint
from evolvent_massprops.identification.signals import (
    Array,
    Signal,
    fit_linear,
    fit_term,
    highest_order,
    information,
    noise_of,
)
from evolvent_massprops.identification.subspace import Starts, add_peaks
from evolvent_massprops.identification.variable_projection import (
    WHITE,
    Fit,
    acceptable,
    evaluate,
    fit,
    modes_of_fit,
    own_unknowns,
    unsupported,
    whiteness,
    with_shared_noise,
)

__all__ = ["MOST_MODES", "PATIENCE", "WHITE", "criteria", "search", "whiteness"]

#: Orders that are tried where the user sets no limit.
MOST_MODES = 10
#: The search ends after so many orders that better neither criterion; after one where the best's residual is white.
PATIENCE = 2


def criteria(signal: Signal, squares: Array, m: int) -> tuple[float, float]:
    """Description length and BIC of `m` modes with common poles, whose residual has the sums of squares (c,).

    Notes
    -----
    MDL = sum_c n_c/2 log s_c^2 + sum over parameters of the half logarithm of their information: n_c for the 2 m
    amplitudes and the offset of a sensor, N^3 for each frequency and decay rate (Rissanen 1989; Djurić 1996, eq. 26).
    BIC = sum_c n_c log s_c^2 + k log(sum_c n_c), k all parameters. s_c^2 is the mean square of the residual.
    """
    counts, own = signal.counts, 2 * m + 1 + signal.degree
    unknown = own * float(np.log(counts).sum()) + 2 * m * 3.0 * float(np.log(len(signal.time)))
    mdl = 0.5 * (fit_term(signal, squares) + unknown)
    return mdl, information(signal, squares, own * len(counts) + 2 * m)


class _Row(NamedTuple):
    order: int
    mdl: float
    bic: float
    whiteness: float
    supported: bool


def fit_order(signal: Signal, starts: Starts, order: int, fewer: Array) -> Fit:
    """The best fit of `order` modes, from ESPRIT and from the poles of one mode `fewer` with a line added."""
    trials = [fit(starts.poles(order), signal), fit(add_peaks(signal, fewer, order), signal)]
    good = [trial for trial in trials if acceptable(trial, signal)] or trials
    return min(good, key=lambda trial: criteria(signal, trial.point.squares, order)[0])


def search(signal: Signal, limit: int | None = None) -> tuple[IdentifiedModes | None, OrderCriteria]:
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
    An order is rejected if one of its modes cannot be distinguished from its neighbour or from the noise, if its fit
    leaves the band, or if the fit does not converge. Where MDL and BIC differ, the lower order is taken if its residual
    is white, else the higher.
    """
    most = min(MOST_MODES if limit is None else limit, highest_order(signal))
    starts = Starts(signal)
    point = evaluate(np.empty(0, dtype=complex), signal)
    residual = fit_linear(point.poles, signal)[1]
    noise = signal.noise if signal.noise is not None else noise_of(signal, point.squares, 0)
    rows = [_Row(0, *criteria(signal, point.squares, 0), whiteness(signal, residual, noise, 1 + signal.degree), True)]
    tried: list[IdentifiedModes | None] = [None]
    for m in range(1, most + 1):
        found = fit_order(signal, starts, m, point.poles)
        point = found.point
        modes = modes_of_fit(found, signal)
        white = whiteness(signal, modes.residual, modes.noise, own_unknowns(modes, signal))
        supported = acceptable(found, signal) and not unsupported(modes)
        rows.append(_Row(m, *criteria(signal, point.squares, m), white, supported))
        tried.append(modes)
        best = max(min(rows, key=lambda row: row.mdl).order, min(rows, key=lambda row: row.bic).order)
        if m >= best + (1 if rows[best].whiteness >= WHITE else PATIENCE):
            break
    possible = [row for row in rows if row.supported]
    low, high = sorted(
        (min(possible, key=lambda row: row.mdl), min(possible, key=lambda row: row.bic)), key=lambda row: row.order
    )
    chosen = low if low.whiteness >= WHITE else high
    best_modes = tried[chosen.order]
    if best_modes is not None:
        best_modes = with_shared_noise(_above_coloured_noise(best_modes, signal), signal)
    return best_modes, OrderCriteria(*(np.array(column) for column in zip(*rows, strict=True)))


def _above_coloured_noise(modes: IdentifiedModes, signal: Signal) -> IdentifiedModes:
    """The modes that stand out of the noise near them, where it is not white; else all.

    Notes
    -----
    The criteria compare with the noise's mean power, so that noise with a memory gives modes where it is strongest.
    They are taken out one by one, the weakest first; if the residual is white without them, it was not of that kind.
    """
    kept = modes
    while kept.order > 1 and (weak := faint(kept, signal)).size:
        found = fit(np.delete(kept.pole, weak[0]), signal)
        if not acceptable(found, signal):
            break
        kept = modes_of_fit(found, signal)
    if kept is modes or whiteness(signal, kept.residual, kept.noise, own_unknowns(kept, signal)) >= WHITE:
        return modes
    return kept
