"""Poles from the signal subspace of a block Hankel matrix: matrix pencil and ESPRIT (HTLS) on all sensors.

Row i, column j of a sensor's Hankel matrix is its sample i stride + j: with a stride above 1 the sensor's interleaved
subsequences stand as further columns beside each other, so that few rows span a long record. The signal's columns are
spanned by the vectors (1, z, z^2, ...), z = exp(pole stride step); the mean of a sensor's columns lies in the same
span, and taking it off removes the offset without touching the modes.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple, Unpack

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from evolvent_base.errors import InputError
from evolvent_massprops.identification.modes import IdentifiedModes, make_modes, sort
from evolvent_massprops.identification.signals import (
    Array,
    Sampling,
    Signal,
    basis,
    check_order,
    fit_linear,
    noise_and_highest_frequency,
    power,
    read_signal,
    refuse_uneven,
)

#: With a stride, the fastest mode turns at most so much from row to row, in half turns.
TURN = 0.85
#: Rows that a stride leaves at least, where the record is long enough.
ROWS = 48
#: Rows at most: the eigenvalue problem grows with their third power.
MOST_ROWS = 128
#: Between uneven samples a value is interpolated up to so many steps from one.
FAR = 1.5


class Subspace(NamedTuple):
    """Left singular vectors of the block Hankel matrix, the largest singular value last.

    Attributes
    ----------
    vectors : (rows, rows)
    stride : samples from row to row
    """

    vectors: Array
    stride: int


def hankel_subspace(signal: Signal, weights: Array, *, rows: int, stride: int) -> Subspace:
    """Left singular vectors of all sensors' Hankel matrices side by side, by the eigenvectors of their Gram matrix.

    Parameters
    ----------
    signal : without missing samples
    weights : (c,) one over each sensor's noise
    rows, stride : see Subspace
    """
    span = (rows - 1) * stride + 1
    centred = (signal.data - signal.data.mean(axis=0)) * weights
    windows = sliding_window_view(centred, span, axis=0)[:, :, ::stride]  # (columns, c, rows)
    columns = len(windows)
    H = windows.transpose(2, 1, 0).reshape(rows, -1)
    # take off what an offset (and a drift) puts into each sensor's rows
    trend = np.full((columns, 1), columns**-0.5)
    if signal.degree:
        trend = np.linalg.qr(np.vander(np.linspace(-1.0, 1.0, columns), signal.degree + 1))[0]
    common = (H.reshape(-1, columns) @ trend).reshape(rows, -1)
    return Subspace(np.linalg.eigh(H @ H.T - common @ common.T)[1], stride)


def choose_stride(length: int, step: float, highest: float) -> int:
    """Stride at which `highest` (rad/s) turns by TURN half turns a row, and ROWS rows fit in half the data."""
    return max(1, min(int(TURN * np.pi / (highest * step)), length // (2 * ROWS)))


def signal_subspace(signal: Signal) -> Subspace:
    """The subspace that ESPRIT reads, from samples none of which is missing."""
    noise, highest = noise_and_highest_frequency(signal)
    length = len(signal.time)
    stride = choose_stride(length, signal.step, highest)
    rows = min(MOST_ROWS, length // (2 * stride))
    return hankel_subspace(signal, 1.0 / noise, rows=rows, stride=stride)


def shift_poles(subspace: Subspace, order: int, step: float, *, total: bool) -> Array:
    """Poles of the modes that the `order` largest pairs of singular vectors hold; fewer where some do not oscillate.

    Parameters
    ----------
    total : whether the shift is solved by total least squares (ESPRIT, HTLS) or by least squares (matrix pencil)

    Notes
    -----
    U2 = U1 Psi, where U1, U2 are the signal vectors without their last and first row; the eigenvalues of Psi are
    exp(pole stride step). Total least squares: Psi = -V12 V22^-1, from the right singular vectors V of [U1 U2]
    (Roy & Kailath 1989; Van Huffel, Chen, Decanniere & Van Hecke 1994).
    """
    U = subspace.vectors[:, -2 * order :]
    if total:
        both = np.hstack((U[:-1], U[1:]))
        V = np.linalg.eigh(both.T @ both)[1][:, : 2 * order]
        shift = -np.linalg.solve(V[2 * order :].T, V[: 2 * order].T).T
    else:
        shift = np.linalg.lstsq(U[:-1], U[1:], rcond=None)[0]
    z = np.linalg.eigvals(shift)
    z = z[z.imag > 0.0]
    return sort(np.log(z) / (subspace.stride * step))


def peak(signal: Signal, residual: Array) -> complex:
    """A pole at the highest line of the residual within the band, that decays by one over the record."""
    scaled = residual / (np.nanstd(residual, axis=0) + signal.rounding)
    lines = power(scaled, signal.cells, padded=4).sum(axis=1)
    frequency = 2.0 * np.pi * np.arange(len(lines)) / (4 * signal.extent * signal.step)
    span = signal.time[-1]
    low, high = max(signal.band[0], np.pi / span), min(signal.band[1], 0.999 * np.pi / signal.step)
    lines[(frequency < low) | (frequency > high)] = -1.0
    return complex(-1.0 / span, frequency[int(np.argmax(lines))])


def add_peaks(signal: Signal, poles: Array, order: int) -> Array:
    """`poles` and as many of the residual's highest lines as make `order`."""
    while len(poles) < order:
        line = peak(signal, fit_linear(poles, signal)[1])
        while np.any(np.abs(poles - line) < 0.1 / signal.time[-1]):
            line += 0.5j / signal.time[-1]  # two equal poles could never part
        poles = sort(np.append(poles, line))
    return poles


def in_band(poles: Array, signal: Signal) -> Array:
    """The poles whose frequency lies in the band."""
    low, high = signal.band
    return poles[(poles.imag >= low) & (poles.imag <= high)]


def visible(poles: Array, signal: Signal) -> Array:
    """(m,) bool: modes below half the rate that neither decay faster than the samples nor grow beyond e^30."""
    slow, fast = -30.0 / signal.time[-1], 4.0 / signal.step
    w, decay = poles.imag, -poles.real
    return np.asarray((w > 0.0) & (w < np.pi / signal.step) & (decay > slow) & (decay < fast))


def candidates(poles: Array, signal: Signal) -> Array:
    """The poles that the samples can show and whose frequency lies in the band."""
    return in_band(poles[visible(poles, signal)], signal)


class Starts:
    """Start poles for any order of one signal, from the few subspaces that its samples allow.

    Without gaps there is one. With gaps there are two: of the longest stretch without any, and of the whole record with
    gaps filled, first by straight lines, then by what the first fit says. Of uneven times the samples are interpolated:
    the poles are starts, no more.
    """

    def __init__(self, signal: Signal) -> None:
        self.signal = signal = signal if signal.even else interpolated(signal)
        self.gaps = not bool(signal.present.all())
        self.subspaces = [signal_subspace(longest_stretch(signal) if self.gaps else signal)]
        if self.gaps:
            self.subspaces.append(signal_subspace(fill(signal)))

    def poles(self, order: int) -> Array:
        """(order,) poles of the subspace that fits best, made complete by lines of the residual."""
        found = [self._from(subspace, order) for subspace in self.subspaces]
        if len(found) == 1:
            return found[0]
        poles = min(found, key=lambda trial: misfit(self.signal, trial))
        for _ in range(2):
            trial = self._from(signal_subspace(fill(self.signal, poles)), order)
            if misfit(self.signal, trial) >= misfit(self.signal, poles):
                break
            poles = trial
        return poles

    def _from(self, subspace: Subspace, order: int) -> Array:
        if len(subspace.vectors) < 2 * order + 1:
            return add_peaks(self.signal, np.empty(0, dtype=complex), order)
        poles = candidates(shift_poles(subspace, order, self.signal.step, total=True), self.signal)
        if len(poles) < order:
            # a mode outside the band, or one that does not oscillate, took a dimension of the subspace
            for more in range(order + 1, min(2 * order + 4, (len(subspace.vectors) - 1) // 2)):
                trial = candidates(shift_poles(subspace, more, self.signal.step, total=True), self.signal)
                if len(trial) >= order:
                    poles = strongest(self.signal, trial, order)
                    break
        return add_peaks(self.signal, poles, order)


def interpolated(signal: Signal) -> Signal:
    """The signal on an even grid, by straight lines between samples; missing where none is within a step or two."""
    time = signal.step * np.arange(signal.extent)
    data = np.full((len(time), signal.data.shape[1]), np.nan)
    for c in range(data.shape[1]):
        there = signal.time[signal.present[:, c]]
        data[:, c] = np.interp(time, there, signal.data[signal.present[:, c], c])
        after = np.clip(np.searchsorted(there, time), 1, len(there) - 1)
        apart = np.minimum(np.abs(time - there[after - 1]), np.abs(time - there[after]))
        data[apart > FAR * signal.step, c] = np.nan
    return replace(signal, time=time, data=data, present=~np.isnan(data), even=True, steady=None)


def strongest(signal: Signal, poles: Array, order: int) -> Array:
    """The `order` poles whose modes hold most energy over the record, each sensor scaled by its deviation."""
    coefficients = fit_linear(poles, signal)[0]
    m = len(poles)
    square = (coefficients[:m] ** 2 + coefficients[m : 2 * m] ** 2) / np.nanvar(signal.data, axis=0)
    energy = square.sum(axis=1) * np.exp(2.0 * np.multiply.outer(poles.real, signal.time)).sum(axis=1)
    return sort(poles[np.argsort(energy)[m - order :]])


def misfit(signal: Signal, poles: Array) -> float:
    """Sum over sensors of the logarithm of the residual's power, samples that are there."""
    residual = fit_linear(poles, signal)[1]
    return float(np.log(np.nanmean(residual**2, axis=0) + signal.rounding**2).sum())


def longest_stretch(signal: Signal) -> Signal:
    """The longest run of samples that no sensor misses; the record filled by straight lines if that is a short one."""
    there = np.concatenate(([False], signal.present.all(axis=1), [False])).astype(int)
    first, last = np.flatnonzero(np.diff(there) == 1), np.flatnonzero(np.diff(there) == -1)
    if first.size:
        longest = int(np.argmax(last - first))
        if last[longest] - first[longest] >= max(len(signal.time) // 8, 16):
            return signal.part(slice(int(first[longest]), int(last[longest])))
    return fill(signal)


def fill(signal: Signal, poles: Array | None = None) -> Signal:
    """The signal with missing samples put in: by straight lines, or by the modes of `poles`."""
    data = signal.data.copy()
    if poles is not None:
        model = basis(poles, signal) @ fit_linear(poles, signal)[0]
    for c in range(data.shape[1]):
        there = signal.present[:, c]
        if poles is None:
            data[~there, c] = np.interp(signal.time[~there], signal.time[there], data[there, c])
        else:
            data[~there, c] = model[~there, c]
    return signal.with_data(data)


def check_poles(signal: Signal, order: int, poles: Array, method: str) -> Array:
    """`order` of the poles, those that lie in the band and hold most energy; refused where there are fewer."""
    poles = candidates(poles, signal)
    if len(poles) < order:
        raise InputError(
            f"{method} finds {len(poles)} of {order} modes (poles that oscillate within the band); use fewer"
        )
    return strongest(signal, poles, order) if len(poles) > order else poles


def complete_signal(method: str, data: Any, order: int, sampling: Sampling) -> tuple[Signal, int]:
    """The signal and the order that a `method` takes; refused for uneven times, missing samples, too high an order."""
    signal = read_signal(data, **sampling)
    refuse_uneven(signal, method)
    if not signal.present.all():
        worst = int(np.argmin(signal.counts))
        raise InputError(
            f"{signal.names[worst]} misses {len(signal.time) - signal.counts[worst]} samples; {method} needs all of "
            "them (varpro and identify fit those that are there)"
        )
    return signal, check_order(signal, order)


def esprit(data: Any, order: int, **sampling: Unpack[Sampling]) -> IdentifiedModes:
    """ESPRIT on all sensors (HTLS): the shift of the signal subspace by total least squares.

    Parameters
    ----------
    data : (N,) or (N, c) array, or mapping from names to (N,) arrays; no sample missing
    order : number of modes
    sampling : rate, time, names, noise, band, detrend, as for `identify`

    Returns
    -------
    IdentifiedModes
        With NaN as covariance: none follows from this method.

    Raises
    ------
    InputError
        As `identify`; and if fewer modes are found, or a sample is missing.

    Notes
    -----
    Roy & Kailath (1989); Van Huffel et al. (1994). Up to MOST_ROWS rows and half the record; subsequences as further
    columns, see this module.
    """
    signal, order = complete_signal("esprit", data, order, sampling)
    poles = shift_poles(signal_subspace(signal), order, signal.step, total=True)
    return make_modes("esprit", check_poles(signal, order, poles, "esprit"), signal)


def matrix_pencil(data: Any, order: int, **sampling: Unpack[Sampling]) -> IdentifiedModes:
    """Matrix pencil: as `esprit` without stride, by least squares.

    Parameters, returns and errors are those of `esprit`.

    Notes
    -----
    Hua & Sarkar (1990), with the pencil parameter N / 3, 400 at most.
    """
    signal, order = complete_signal("matrix_pencil", data, order, sampling)
    noise_std, _ = noise_and_highest_frequency(signal)
    subspace = hankel_subspace(signal, 1.0 / noise_std, rows=min(len(signal.time) // 3, 400) + 1, stride=1)
    poles = shift_poles(subspace, order, signal.step, total=False)
    return make_modes("matrix pencil", check_poles(signal, order, poles, "matrix_pencil"), signal)
