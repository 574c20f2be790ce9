"""Maximum likelihood: common poles fitted to all sensors, the linear parameters projected out (VARPRO)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from evolvent.errors import InputError
from evolvent.identification.bounds import covariance, slope_factors
from evolvent.identification.modes import Modes, make_modes, sort
from evolvent.identification.signals import (
    Array,
    Signal,
    basis,
    check_order,
    fit_linear,
    noise_floor,
    read_signal,
    split,
)
from evolvent.identification.subspace import Starts, in_band

#: Steps at most. From ESPRIT's start 3 to 5 are usual.
MOST_STEPS = 100
#: Converged where a step changes the sum of squares (in units of the noise) by less: 1e-4 standard deviations.
TOLERANCE = 1e-8
#: Noise is estimated anew, and the fit repeated, while a sensor's estimate moves by more than this share ...
NOISE_CHANGE = 0.02
#: ... and at most so many times.
MOST_REWEIGHTS = 4


class Fit(NamedTuple):
    """Where the iteration ended.

    Attributes
    ----------
    poles : (m,)
    noise : (c,) that the sensors were weighted with, estimated from the residual unless known
    residual : (N, c)
    steps : number of steps
    converged : False where the limit of steps was reached, or no step betters the fit though it is not stationary
    """

    poles: Array
    noise: Array
    residual: Array
    steps: int
    converged: bool


class _Point(NamedTuple):
    cost: float
    jacobian: Array
    residual: Array


def _evaluate(poles: Array, signal: Signal, weights: Array) -> _Point:
    """Cost, and the projected residual and Jacobian in the coordinates that one QR of [Phi, t Phi, data] gives.

    R = [[R11 R12 R13], [0 R22 R23], [0 0 R33]]: the residual is (R23, R33) and t Phi projected is (R22, 0).
    """
    m = len(poles)
    width = 2 * m + 1 + signal.degree
    A = basis(poles, signal, slopes=True)
    cost = 0.0
    jacobians, residuals = [], []
    for rows, sensors in signal.groups:
        whole = len(sensors) == len(weights)
        Y = (signal.data if whole else signal.data[rows][:, sensors]) * weights[sensors]
        R = np.asarray(np.linalg.qr(np.hstack((A[rows], Y)), mode="r"))
        amplitudes = split(np.linalg.solve(R[:width, :width], R[:width, -len(sensors) :]), m)
        projected = R[width:, -len(sensors) :]
        cost += float((projected**2).sum())
        slopes = R[width : width + 2 * m, width : width + 2 * m]
        jacobians.append(np.einsum("ij,jkc->cik", slopes, slope_factors(amplitudes)).reshape(-1, 2 * m))
        residuals.append(projected[: 2 * m].T.ravel())
    return _Point(cost, np.concatenate(jacobians), np.concatenate(residuals))


def _minimise(poles: Array, signal: Signal, weights: Array) -> tuple[Array, int, bool]:
    """Levenberg-Marquardt on the projected residual with Kaufman's Jacobian: poles, steps, converged."""
    m = len(poles)
    nyquist = np.pi / signal.step
    span = signal.time[-1]
    # beyond these a mode is no oscillation that the samples show: a start from which none is found
    fastest = 4.0 / signal.step
    damping = 0.0
    point = _evaluate(poles, signal, weights)
    for step in range(1, MOST_STEPS + 1):
        scale = np.sqrt((point.jacobian**2).sum(axis=0))
        if not np.all(scale > 0.0):
            return poles, step, False
        J = point.jacobian / scale
        J, rhs = np.vstack((J, np.sqrt(damping) * np.eye(2 * m))), np.append(point.residual, np.zeros(2 * m))
        change = np.linalg.lstsq(J, rhs, rcond=None)[0]
        expected = float((point.residual**2).sum() - ((J @ change - rhs) ** 2).sum())
        change = change / scale
        if expected <= TOLERANCE or np.abs(change).max() <= 4e-16 * np.abs(poles).max():
            return poles, step, damping < 1.0
        trial = poles + (1j * change[:m] - change[m:])
        inside = np.all(
            (trial.imag > 0.0) & (trial.imag < nyquist) & (trial.real < 30.0 / span) & (trial.real > -fastest)
        )
        next_point = _evaluate(trial, signal, weights) if inside else None
        if next_point is not None and next_point.cost < point.cost:
            poles, point = trial, next_point
            damping = 0.0 if damping < 1e-3 else damping / 10.0
        else:
            if next_point is not None and expected <= 1e-9 * point.cost:
                return poles, step, True  # rounding hides what is left to gain
            damping = max(10.0 * damping, 1e-3)
            if damping > 1e8:
                return poles, step, False
    return poles, MOST_STEPS, False


def fit(poles: Array, signal: Signal) -> Fit:
    """Fit common poles from a start, with each sensor weighted by its noise, known or estimated anew."""
    m = len(poles)
    residual = fit_linear(poles, signal)[1]
    noise = signal.noise if signal.noise is not None else noise_floor(signal, residual, m)
    steps, converged = 0, False
    for _ in range(MOST_REWEIGHTS):
        poles, taken, converged = _minimise(poles, signal, 1.0 / noise)
        steps += taken
        residual = fit_linear(poles, signal)[1]
        if signal.noise is not None:
            break
        change, noise = noise, noise_floor(signal, residual, m)
        if not converged or np.ptp(np.log(noise / change)) < NOISE_CHANGE:
            break
    return Fit(sort(poles), noise, residual, steps, converged)


def objections(modes: Modes) -> tuple[str, ...]:
    """What the data do not support in a fit, a sentence each."""
    found = []
    w, w_std = modes.frequency, modes.frequency_std
    if not np.all(np.isfinite(w_std)):
        return ("the modes cannot be told apart: no standard deviations follow",)
    m, C = modes.order, modes.pole_covariance
    for k in range(m - 1):
        apart = np.sqrt(max(C[k, k] + C[k + 1, k + 1] - 2.0 * C[k, k + 1], 0.0))
        if w[k + 1] - w[k] < 2.0 * apart:
            found.append(
                f"modes {k + 1} and {k + 2} ({w[k]:.6g} and {w[k + 1]:.6g} rad/s) cannot be told apart: they differ by "
                f"{w[k + 1] - w[k]:.2g} ± {apart:.2g} rad/s"
            )
    deviation = modes.amplitude / modes.amplitude_std
    for k in range(m):
        if deviation[k].max() < 3.0:
            found.append(f"mode {k + 1} ({w[k]:.6g} rad/s) is not above the noise at any sensor")
        if modes.decay_rate[k] > w[k]:
            found.append(f"mode {k + 1} ({w[k]:.6g} rad/s) decays within less than a period: hardly an oscillation")
        if modes.decay_rate[k] < -4.0 * modes.decay_rate_std[k]:
            found.append(f"mode {k + 1} ({w[k]:.6g} rad/s) grows (decay rate {modes.decay_rate[k]:.3g} 1/s)")
    if modes.time[-1] * w[0] < 2.0 * np.pi:
        found.append(f"mode 1 ({w[0]:.6g} rad/s) is seen for less than one period")
    return tuple(found)


def modes_of_fit(found: Fit, signal: Signal) -> Modes:
    """Modes with the covariance that the fit gives."""
    amplitudes = split(fit_linear(found.poles, signal)[0], len(found.poles))
    return make_modes(
        "varpro",
        found.poles,
        signal,
        noise=found.noise,
        covariance=covariance(found.poles, amplitudes, found.noise, signal),
        iterations=found.steps,
    )


def varpro(
    data: Any,
    order: int,
    *,
    rate: float | None = None,
    time: Any = None,
    names: Sequence[str] | None = None,
    noise: Any = None,
    band: Sequence[float] | None = None,
    detrend: str = "constant",
    start: Any = None,
) -> Modes:
    """Maximum likelihood for white Gaussian noise: common poles, own amplitudes and offset of each sensor.

    Parameters
    ----------
    data : (N,) or (N, c) array, or mapping from names to (N,) arrays; NaN where a sample is missing
    order : number of modes
    rate, time, names, noise, band, detrend : as for `identify`
    start : (order,) complex poles to start from, 1/s; ESPRIT's unless given

    Returns
    -------
    Modes
        With the covariance of all parameters, from the Fisher information at the fit.

    Raises
    ------
    InputError
        As `identify`; and where the fit does not converge: no numbers are returned that the data do not support.

    Notes
    -----
    Golub & Pereyra (1973) with Kaufman's (1975) Jacobian, whose gradient is exact; Levenberg-Marquardt steps, Gauss-
    Newton's while these succeed. Each sensor is weighted by its noise, which is estimated from the residual, with the
    degrees of freedom counted, and the fit repeated until it settles.
    """
    signal = read_signal(data, rate=rate, time=time, names=names, noise=noise, band=band, detrend=detrend)
    order = check_order(signal, order)
    if start is not None:
        poles = np.atleast_1d(np.asarray(start, dtype=complex))
        if poles.shape != (order,) or not np.all(np.isfinite(poles)) or np.any(poles.imag <= 0.0):
            raise InputError(f"start is {start!r}; it must be {order} complex poles with positive imaginary parts")
        return checked_modes(fit(sort(poles), signal), signal)
    return checked_modes(fit(Starts(signal).poles(order), signal), signal)


def checked_modes(found: Fit, signal: Signal) -> Modes:
    """Modes of a fit with its warnings; refused unless it converged, inside the band."""
    order = len(found.poles)
    if not found.converged:
        raise InputError(
            f"the data do not support {order} modes: their fit did not converge in {found.steps} steps; "
            "ask for fewer, or let identify find the order"
        )
    if len(in_band(found.poles, signal)) < order:
        outside = ", ".join(f"{w:.6g}" for w in found.poles.imag if not signal.band[0] <= w <= signal.band[1])
        raise InputError(
            f"the data do not support {order} modes in the band {signal.band[0]:.6g} to {signal.band[1]:.6g} rad/s: "
            f"the fit leaves it ({outside} rad/s)"
        )
    modes = modes_of_fit(found, signal)
    return replace(modes, warnings=objections(modes))
