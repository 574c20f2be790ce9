"""Prony's method: poles are roots of the polynomial by which each sample follows from those before it."""

from __future__ import annotations

from typing import Any, Unpack

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from evolvent_base.errors import InputError
from evolvent_massprops.identification.modes import IdentifiedModes, make_modes
from evolvent_massprops.identification.signals import Array, Sampling, Signal, noise_and_highest_frequency
from evolvent_massprops.identification.subspace import (
    candidates,
    check_poles,
    choose_stride,
    complete_signal,
    hankel_subspace,
    shift_poles,
    signal_subspace,
    strongest,
)


def prony(
    data: Any, order: int, *, samples_per_period: float | None = 2.5, **sampling: Unpack[Sampling]
) -> IdentifiedModes:
    """Least-squares Prony with decimation: the historical method, for comparison.

    Parameters
    ----------
    data, order : as for `esprit`
    samples_per_period : optional, above 2
        Every n-th sample is used, n such that the highest mode has at least so many samples a period; None for all.
    sampling : rate, time, names, noise, band, detrend, as for `identify`

    Returns
    -------
    IdentifiedModes
        With NaN as covariance: none follows from this method.

    Raises
    ------
    InputError
        As `esprit`.

    Notes
    -----
    Belyakov (2002): x[n] = A0 + sum of P damped cosines satisfies a linear prediction of order 2 P + 1, solved by
    least squares, for all sensors at once; the roots of its polynomial are the poles, and amplitudes are fitted
    linearly (to all samples). It is biased by noise, the more the more samples a period there are; see
    benchmarks/identification.py.
    """
    signal, order = complete_signal("prony", data, order, sampling)
    stride = _decimation(signal, order, samples_per_period)
    size = 2 * order + 1 + signal.degree
    kept = signal.data[::stride]
    if len(kept) < 2 * size:
        raise InputError(
            f"every {stride}-th sample leaves {len(kept)}; prony of order {order} needs {2 * size}: "
            "use more samples_per_period"
        )
    windows = np.concatenate([sliding_window_view(column, size + 1) for column in kept.T])
    prediction = np.linalg.lstsq(windows[:, :-1], -windows[:, -1], rcond=None)[0]
    roots = np.roots(np.concatenate(([1.0], prediction[::-1])))
    return _from_roots("prony", roots[roots.imag > 0.0], stride, signal, order)


def tls_prony(data: Any, order: int, **sampling: Unpack[Sampling]) -> IdentifiedModes:
    """Total-least-squares Prony: the least-norm prediction that is orthogonal to the signal subspace.

    Parameters, returns and errors are those of `esprit`.

    Notes
    -----
    Rahman & Yu (1987), with backward prediction over a third of the record as in Kumaresan & Tufts (1982): of the
    polynomial's roots those of the signal are the innermost. Interleaved subsequences as in `esprit`.
    """
    signal, order = complete_signal("tls_prony", data, order, sampling)
    floor, highest = noise_and_highest_frequency(signal)
    stride = choose_stride(len(signal.time), signal.step, highest)
    rows = max(2 * order + 2, min(64, len(signal.time) // (3 * stride)))
    complement = hankel_subspace(signal, 1.0 / floor, rows=rows, stride=stride).vectors[:, : rows - 2 * order]
    prediction = complement @ complement[0]
    roots = np.roots(prediction[::-1])
    roots = roots[roots.imag > 0.0]
    return _from_roots("tls prony", roots[np.argsort(np.abs(roots))[:order]], stride, signal, order)


def _decimation(signal: Signal, order: int, samples_per_period: float | None) -> int:
    if samples_per_period is None:
        return 1
    if not samples_per_period > 2.0:
        raise InputError(f"samples_per_period is {samples_per_period!r}; it must be above 2")
    return max(1, int(2.0 * np.pi / (_highest_mode(signal, order) * signal.step * samples_per_period)))


def _highest_mode(signal: Signal, order: int) -> float:
    """Highest frequency of the modes, rad/s: by ESPRIT; where that finds fewer, of all that stands out of the noise.

    Without noise far more than the modes stands out: what their lines spread, and harmonics.
    """
    highest = noise_and_highest_frequency(signal)[1]
    poles = candidates(shift_poles(signal_subspace(signal), order, signal.step, total=True), signal)
    if len(poles) < order:
        return highest
    return min(highest, float(strongest(signal, poles, order).imag.max()))


def _from_roots(method: str, roots: Array, stride: int, signal: Signal, order: int) -> IdentifiedModes:
    roots = roots[np.abs(roots) > 0.0]
    poles = np.log(roots) / (stride * signal.step)
    return make_modes(method, check_poles(signal, order, poles, method), signal)
