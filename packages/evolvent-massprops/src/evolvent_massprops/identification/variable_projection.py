"""Maximum likelihood: common poles fitted to all sensors, the linear parameters projected out (VARPRO)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple, Unpack

import numpy as np
import scipy

from evolvent_base.errors import InputError
from evolvent_massprops.identification.bounds import Factor, covariance, slope_factors
from evolvent_massprops.identification.modes import IdentifiedModes, make_modes, sort
from evolvent_massprops.identification.shared_noise import components, correlation, mixing, pair, refuse_copies, unmixed
from evolvent_massprops.identification.signals import (
    Array,
    Sampling,
    Signal,
    basis,
    check_order,
    noise_of,
    power,
    read_signal,
    split,
)
from evolvent_massprops.identification.subspace import Starts, add_peaks, in_band, visible

#: Steps at most. From ESPRIT's start 3 to 5 are usual.
MOST_STEPS = 100
#: Converged where a step changes the sum of squares (in units of the noise) by less: 1e-3 standard deviations.
TOLERANCE = 1e-6
#: Noise is estimated again, and the fit repeated, while a sensor's estimate moves by more than this share ...
NOISE_CHANGE = 0.02
#: ... and at most so many times.
MOST_REWEIGHTS = 4

#: A residual whose highest line has a smaller p-value is not white.
WHITE = 1e-3
#: Two frequencies are distinguished where they differ by so many standard deviations of their difference.
RESOLUTION = 2.0


class Point(NamedTuple):
    """The fit at some poles.

    Attributes
    ----------
    poles : (m,)
    factors : one a group of sensors
    coefficients : (2 m + 1 + degree, c), the linear parameters, see `basis`
    squares : (c,) sums of squares of the residual
    residual : (c, 2 m) the part of the residual in the directions of t Phi; with
    jacobian : (c, 2 m, 2 m), its derivatives with respect to frequency and decay_rate
    """

    poles: Array
    factors: list[Factor]
    coefficients: Array
    squares: Array
    residual: Array
    jacobian: Array


class Fit(NamedTuple):
    """Where the iteration ended.

    Attributes
    ----------
    point : with its poles
    noise : (c,) that the sensors were weighted with, estimated from the residual unless known
    steps : number of steps
    converged : False where the limit of steps was reached, or no step betters the fit though it is not stationary
    """

    point: Point
    noise: Array
    steps: int
    converged: bool


def evaluate(poles: Array, signal: Signal) -> Point:
    """Project the linear parameters out with one QR of [Phi, t Phi, data].

    R = [[R11 R12 R13], [0 R22 R23], [0 0 R33]]: in its coordinates the residual is (R23, R33), and t Phi projected
    is (R22, 0).
    """
    m, sensors = len(poles), signal.data.shape[1]
    width = 2 * m + 1 + signal.degree
    A = basis(poles, signal, slopes=True)
    coefficients = np.empty((width, sensors))
    squares = np.empty(sensors)
    residual = np.empty((sensors, 2 * m))
    jacobian = np.empty((sensors, 2 * m, 2 * m))
    factors = []
    for rows, members in signal.groups:
        R = np.asarray(np.linalg.qr(np.hstack((A[rows], signal.data[rows][:, members])), mode="r"))
        right = R[:, width + 2 * m :]
        try:
            coefficients[:, members] = np.linalg.solve(R[:width, :width], right[:width])
        except np.linalg.LinAlgError:  # two poles are equal: the smallest coefficients of all that fit
            coefficients[:, members] = np.linalg.lstsq(R[:width, :width], right[:width], rcond=None)[0]
        squares[members] = (right[width:] ** 2).sum(axis=0)
        residual[members] = right[width : width + 2 * m].T
        slopes = R[width : width + 2 * m, width : width + 2 * m]
        jacobian[members] = slopes @ slope_factors(split(coefficients[:, members], m)).transpose(2, 0, 1)
        factors.append(Factor(R[: width + 2 * m], members))
    return Point(poles, factors, coefficients, squares, residual, jacobian)


def _minimise(point: Point, signal: Signal, noise: Array) -> tuple[Point, int, bool]:
    """Levenberg-Marquardt on the projected residual with Kaufman's Jacobian: the end, steps, converged."""
    m = len(point.poles)
    damping = 0.0
    for step in range(1, MOST_STEPS + 1):
        J = (point.jacobian / noise[:, np.newaxis, np.newaxis]).reshape(-1, 2 * m)
        r = (point.residual / noise[:, np.newaxis]).ravel()
        scale = np.sqrt((J**2).sum(axis=0))
        if not (np.all(scale > 0.0) and np.all(np.isfinite(scale)) and np.all(np.isfinite(r))):
            return point, step, False
        J /= scale
        if damping > 0.0:
            J, r = np.vstack((J, np.sqrt(damping) * np.eye(2 * m))), np.append(r, np.zeros(2 * m))
        change = np.linalg.lstsq(J, r, rcond=None)[0]
        gain = float((r**2).sum() - ((J @ change - r) ** 2).sum())
        change = change / scale
        if gain <= TOLERANCE or np.abs(change).max() <= 4e-16 * np.abs(point.poles).max():
            return point, step, damping < 1.0
        poles = point.poles + 1j * change[:m] - change[m:]
        cost = (point.squares / noise**2).sum()
        trial = _attempt(poles, signal)
        if trial is not None and (trial.squares / noise**2).sum() < cost:
            point = trial
            damping = 0.0 if damping < 1e-3 else damping / 10.0
        elif trial is not None and gain <= 1e-9 * cost:
            return point, step, True  # rounding hides what is left to gain
        else:
            damping = max(10.0 * damping, 1e-3)
            if damping > 1e8:
                return point, step, False
    return point, MOST_STEPS, False


def _attempt(poles: Array, signal: Signal) -> Point | None:
    """The fit at `poles`; None where the samples cannot show them."""
    return evaluate(poles, signal) if np.all(visible(poles, signal)) else None


def fit(poles: Array, signal: Signal) -> Fit:
    """Fit common poles from a start, with each sensor weighted by its noise, known or estimated again."""
    m = len(poles)
    point = evaluate(poles, signal)
    noise = signal.noise if signal.noise is not None else noise_of(signal, point.squares, m)
    steps, converged = 0, False
    for _ in range(MOST_REWEIGHTS):
        point, taken, converged = _minimise(point, signal, noise)
        steps += taken
        if signal.noise is not None:
            break
        before, noise = noise, noise_of(signal, point.squares, m)
        if not converged or np.ptp(np.log(noise / before)) < NOISE_CHANGE:
            break
    if np.any(np.diff(point.poles.imag) < 0.0):
        point = evaluate(sort(point.poles), signal)
    return Fit(point, noise, steps, converged)


def whiteness(signal: Signal, residual: Array, noise: Array, unknowns: int = 0) -> float:
    """p-value of the highest line of the residual's periodogram, summed over sensors, were the residual white.

    Noise that sensors share is separated from lines: its components are taken in place of the sensors. `unknowns` is
    the number of parameters that were fitted to each sensor.

    Notes
    -----
    Each line of white noise is a sum of c exponential variables, Gamma(c); the highest of n such lines exceeds x with
    probability 1 - (1 - Q(c, x))^n (Fisher's test, Brockwell & Davis 1991, section 10.2, for known noise). What the
    fit has taken off near its modes makes the test careful rather than keen.
    """
    shared = correlation(signal, residual, noise, unknowns)
    parts = components(residual, noise, shared)
    lines = power(parts, signal.cells)[1:-1] / (signal.counts if shared is None else float(signal.counts.mean()))
    total = lines.sum(axis=1)
    tail = scipy.special.gammaincc(parts.shape[1], total.max())
    return float(-np.expm1(len(total) * np.log1p(-min(float(tail), 1.0 - 1e-16))))


def own_unknowns(modes: IdentifiedModes, signal: Signal) -> int:
    """Number of parameters that were fitted to each sensor."""
    return 2 * modes.order + 1 + signal.degree


def colour(modes: IdentifiedModes, signal: Signal) -> tuple[str, ...]:
    """A sentence where the residual is not white."""
    p = whiteness(signal, modes.residual, modes.noise, own_unknowns(modes, signal))
    if p >= WHITE:
        return ()
    return (
        f"the residual is not white (p = {p:.1g}): it holds more than these modes and noise, and the standard "
        "deviations are too small",
    )


def unsupported(modes: IdentifiedModes) -> tuple[str, ...]:
    """Modes that the data do not support: not apart from their neighbours or not above the noise; a sentence each."""
    w, C = modes.frequency, modes.pole_covariance
    if not np.all(np.isfinite(C)):
        return ("the modes cannot be distinguished: there are no standard deviations",)
    found = []
    for k in range(modes.order - 1):
        apart = np.sqrt(max(C[k, k] + C[k + 1, k + 1] - 2.0 * C[k, k + 1], 0.0))
        if w[k + 1] - w[k] < RESOLUTION * apart:
            found.append(
                f"modes {k + 1} and {k + 2} ({w[k]:.6g} and {w[k + 1]:.6g} rad/s) cannot be distinguished: they "
                f"differ by "
                f"{w[k + 1] - w[k]:.2g} ± {apart:.2g} rad/s"
            )
    above = (modes.amplitude / modes.amplitude_std).max(axis=1)
    found += [
        f"mode {k + 1} ({w[k]:.6g} rad/s) is not above the noise at any sensor" for k in np.flatnonzero(above < 3.0)
    ]
    return tuple(found)


def remarks(modes: IdentifiedModes) -> tuple[str, ...]:
    """What is unusual about modes of free vibration, a sentence each."""
    found = []
    for k, (w, decay) in enumerate(zip(modes.frequency, modes.decay_rate, strict=True)):
        name = f"mode {k + 1} ({w:.6g} rad/s)"
        if modes.time[-1] * w < 2.0 * np.pi:
            found.append(f"{name} is recorded for less than one period")
        if decay > w:
            found.append(f"{name} decays within less than a period: hardly an oscillation")
        if decay < -4.0 * modes.decay_rate_std[k]:
            found.append(f"{name} grows (decay rate {decay:.3g} 1/s)")
    return tuple(found)


def modes_of_fit(found: Fit, signal: Signal) -> IdentifiedModes:
    """Modes with the covariance that the fit gives."""
    point = found.point
    return make_modes(
        "varpro",
        point.poles,
        signal,
        coefficients=point.coefficients,
        noise=found.noise,
        covariance=covariance(point.factors, split(point.coefficients, len(point.poles)), found.noise),
        iterations=found.steps,
    )


def varpro(data: Any, order: int, *, start: Any = None, **sampling: Unpack[Sampling]) -> IdentifiedModes:
    """Maximum likelihood for white Gaussian noise: common poles, own amplitudes and offset of each sensor.

    Parameters
    ----------
    data : (N,) or (N, c) array, or mapping from names to (N,) arrays; NaN where a sample is missing
    order : number of modes
    start : (order,) complex poles to start from, 1/s; ESPRIT's unless given
    sampling : rate, time, names, noise, band, detrend, as for `identify`

    Returns
    -------
    IdentifiedModes
        With the covariance of all parameters, from the Fisher information at the fit.

    Raises
    ------
    InputError
        As `identify`; and where the fit does not converge: no numbers are returned that the data do not support.

    Notes
    -----
    Golub & Pereyra (1973) with Kaufman's (1975) Jacobian, whose gradient is exact; Levenberg-Marquardt steps, Gauss-
    Newton's while these succeed. Each sensor is weighted by its noise, which is estimated from the residual, with the
    degrees of freedom counted, and the fit repeated until it settles. Where the residuals of sensors are correlated
    and white, the fit is repeated with the joint covariance of their noise.
    """
    signal = read_signal(data, **sampling)
    order = check_order(signal, order)
    if start is not None:
        poles = np.atleast_1d(np.asarray(start, dtype=complex))
        fits = poles.shape == (order,) and len(np.unique(poles)) == order and np.all(np.isfinite(poles))
        if not (fits and np.all(visible(poles, signal))):
            raise InputError(
                f"start is {start!r}; it must be {order} different complex poles with imaginary parts above 0 and "
                f"below half the rate, {np.pi / signal.step:.6g} rad/s"
            )
        return checked_modes(fit(sort(poles), signal), signal)
    found = fit(Starts(signal).poles(order), signal)
    if acceptable(found, signal):
        modes = checked_modes(found, signal)
        if not modes.warnings:
            return modes
    # no good end: another start, the residual's highest lines one by one
    other = fit_lines(signal, order)
    good = [trial for trial in (found, other) if acceptable(trial, signal)] or [found]
    return checked_modes(min(good, key=lambda trial: float(np.log(trial.point.squares).sum())), signal)


def fit_lines(signal: Signal, order: int) -> Fit:
    """Fit 1, 2, ... `order` modes, each from the one before with the highest line of its residual added."""
    found = fit(add_peaks(signal, np.empty(0, dtype=complex), 1), signal)
    for m in range(2, order + 1):
        found = fit(add_peaks(signal, found.point.poles, m), signal)
    return found


def checked_modes(found: Fit, signal: Signal) -> IdentifiedModes:
    """Modes of a fit with its warnings; refused unless it converged, inside the band."""
    order = len(found.point.poles)
    if not found.converged:
        raise InputError(
            f"the data do not support {order} modes: their fit did not converge in {found.steps} steps; "
            "use fewer, or let identify find the order"
        )
    if len(in_band(found.point.poles, signal)) < order:
        outside = ", ".join(f"{w:.6g}" for w in found.point.poles.imag if not signal.band[0] <= w <= signal.band[1])
        raise InputError(
            f"the data do not support {order} modes in the band {signal.band[0]:.6g} to {signal.band[1]:.6g} rad/s: "
            f"the fit leaves it ({outside} rad/s)"
        )
    return with_shared_noise(modes_of_fit(found, signal), signal)


def acceptable(found: Fit, signal: Signal) -> bool:
    """Whether a fit converged inside the band."""
    return found.converged and len(in_band(found.point.poles, signal)) == len(found.point.poles)


def with_shared_noise(modes: IdentifiedModes, signal: Signal) -> IdentifiedModes:
    """The same modes with shared noise taken into account, and with all that speaks against them.

    Raises
    ------
    InputError
        If a sensor is a copy of another.
    """
    shared = correlation(signal, modes.residual, modes.noise, own_unknowns(modes, signal))
    effect = ""
    if shared is not None:
        joint = fit_jointly(modes, signal, shared)
        if joint is not None and not colour(joint, signal):  # what is not white is no noise to weight by
            modes = joint
            effect = "all sensors were weighted by the joint covariance of their noise"
        elif not colour(modes, signal):
            refuse_copies(signal)  # not earlier: without noise, sensors may well move alike
            effect = "the standard deviations assume it to be independent and are too small"
    shared_noise = (f"{pair(modes.names, shared)} share noise: {effect}",) if shared is not None and effect else ()
    return replace(modes, warnings=(*unsupported(modes), *remarks(modes), *colour(modes, signal), *shared_noise))


def fit_jointly(modes: IdentifiedModes, signal: Signal, shared: Array) -> IdentifiedModes | None:
    """Fit with the correlation `shared` of the sensors' noise; None where gaps or a singular covariance forbid it.

    Notes
    -----
    With L L^T the covariance of the noise, the combinations L^-1 x of the sensors have independent noise and the same
    poles; the amplitudes and the offset of the sensors are L times those of the combinations.
    """
    L = mixing(modes.noise, shared)
    if L is None or not signal.present.all():
        return None
    free = unmixed(signal, L)
    found = fit(modes.pole, free)
    if not acceptable(found, free):
        return None
    m, sensors = modes.order, len(L)
    C = covariance(found.point.factors, split(found.point.coefficients, m), found.noise)
    T = np.eye(len(C))
    for first in range(2 * m, len(C), sensors):
        T[first : first + sensors, first : first + sensors] = L
    return make_modes(
        "varpro",
        found.point.poles,
        signal,
        coefficients=found.point.coefficients @ L.T,
        noise=modes.noise,
        covariance=T @ C @ T.T,
        iterations=modes.iterations + found.steps,
    )


def frequencies_in(modes: IdentifiedModes, data: Any, *, rate: float) -> Array | None:
    """Frequencies (m,), rad/s, of the same modes in other signals; None where the fit from their poles fails.

    Parameters
    ----------
    modes : IdentifiedModes, identified in signals alike
    data : (N, c) float
    rate : float, Hz
    """
    try:
        found = fit(modes.pole, read_signal(data, rate=rate))
    except (InputError, np.linalg.LinAlgError):  # poles of other methods may be no start
        return None
    return np.asarray(found.point.poles.imag) if found.converged else None
