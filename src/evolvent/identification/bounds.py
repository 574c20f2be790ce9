"""The least covariance that any unbiased estimate can have."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.errors import InputError
from evolvent.identification.signals import DETREND, Array, Signal, basis


def slope_factors(amplitudes: Array) -> Array:
    """S (2 m, 2 m, c): the signal's derivatives are the columns t Re E, -t Im E of `basis` times S.

    Columns of S: d/d frequency, d/d decay_rate. With x = Re(a E), dx/d frequency = Re(i t a E) and
    dx/d decay_rate = -Re(t a E).
    """
    m, sensors = amplitudes.shape
    S = np.zeros((2 * m, 2 * m, sensors))
    k = np.arange(m)
    S[k, k] = -amplitudes.imag
    S[m + k, k] = amplitudes.real
    S[k, m + k] = -amplitudes.real
    S[m + k, m + k] = -amplitudes.imag
    return S


def covariance(poles: Array, amplitudes: Array, noise: Array, signal: Signal) -> Array:
    """Inverse of the Fisher information of all parameters, white Gaussian noise of each sensor.

    Parameters
    ----------
    poles : (m,) complex, 1/s
    amplitudes : (m, c) complex
    noise : (c,) standard deviations
    signal : whose times, missing samples and polynomial count; its values do not

    Returns
    -------
    (n, n), n = 2 m + 2 m c + c
        Order: frequency (m), decay_rate (m), Re amplitude (m c), Im amplitude (m c), offset (c); amplitudes run over
        the sensors first. NaN where the parameters cannot be told apart at all.

    Notes
    -----
    With Phi the columns of a sensor's linear parameters, J the derivatives with respect to the poles and
    P the projector on the complement of Phi, the poles have C = [sum_c J_c^T P J_c / noise_c^2]^-1, and the linear
    parameters of sensors c and d have K_c C K_d^T + (c = d) noise_c^2 (Phi^T Phi)^-1, K_c = -Phi^+ J_c
    (Stoica & Moses, Spectral Analysis of Signals, 2005, appendix B).
    """
    m, sensors = amplitudes.shape
    width = 2 * m + 1 + signal.degree
    S = slope_factors(amplitudes)
    A = basis(poles, signal, slopes=True)
    information = np.zeros((2 * m, 2 * m))
    gains = np.empty((sensors, width, 2 * m))
    own = np.empty((sensors, width, width))
    try:
        for rows, members in signal.groups:
            R = np.asarray(np.linalg.qr(A[rows], mode="r"))
            upper = np.linalg.inv(R[:width, :width])
            slopes = R[width:, width:]
            for c in members:
                J = slopes @ S[:, :, c] / noise[c]
                information += J.T @ J
                gains[c] = -upper @ (R[:width, width:] @ S[:, :, c])
                own[c] = noise[c] ** 2 * upper @ upper.T
        scale = np.sqrt(np.diag(information))
        of_poles = np.linalg.inv(information / np.outer(scale, scale)) / np.outer(scale, scale)
    except np.linalg.LinAlgError:
        return np.full((2 * m + 2 * m * sensors + sensors,) * 2, np.nan)
    linear = np.einsum("cip,pq,djq->cidj", gains, of_poles, gains, optimize=True)
    each = np.arange(sensors)
    linear[each, :, each, :] += own
    cross = np.einsum("pq,djq->pdj", of_poles, gains)
    # from sensor-major (c, width) to Re a (m, c), Im a (m, c), offset (c)
    pick = np.array([c * width + i for i in range(2 * m + 1) for c in range(sensors)])
    linear = linear.reshape(sensors * width, sensors * width)[np.ix_(pick, pick)]
    cross = cross.reshape(2 * m, sensors * width)[:, pick]
    return np.block([[of_poles, cross], [cross.T, linear]])


def cramer_rao(
    frequency: Any,
    decay_rate: Any,
    amplitude: Any,
    *,
    phase: Any = 0.0,
    rate: float,
    length: int,
    noise: Any,
    detrend: str = "constant",
) -> Array:
    """Cramér-Rao bound of the poles: the least covariance of unbiased estimates.

    Parameters
    ----------
    frequency, decay_rate : (m,) rad/s, 1/s
    amplitude, phase : (m,) or (m, c), in the sensors' units, rad
    rate : Hz
    length : number of samples
    noise : standard deviation of white Gaussian noise, one number or (c,)
    detrend : "constant" or "linear", what is fitted to each sensor beside the modes

    Returns
    -------
    (2 m, 2 m)
        Covariance of frequency (m) and decay_rate (m), (rad/s)^2.

    Raises
    ------
    InputError
        If shapes do not fit, or `length` is too short.

    Notes
    -----
    ``cov = [sum_c J_c^T P J_c / noise_c^2]^-1``, see `covariance` in this module. One undamped mode far from 0 and
    from half the rate: var(frequency) = 24 noise^2 / (amplitude^2 T^2 N (N^2 - 1)), T the step (Rife & Boorstyn 1974).
    """
    frequency = np.atleast_1d(np.asarray(frequency, dtype=float))
    decay = np.broadcast_to(np.asarray(decay_rate, dtype=float), frequency.shape)
    m = frequency.size
    amplitude = np.asarray(amplitude, dtype=float)
    if amplitude.ndim < 2:
        amplitude = np.broadcast_to(amplitude, (m,))[:, np.newaxis]
    if amplitude.shape[0] != m:
        raise InputError(f"amplitude has shape {amplitude.shape}; it must be ({m},) or ({m}, sensors)")
    phase = np.asarray(phase, dtype=float)
    if phase.ndim == 1:
        phase = phase[:, np.newaxis]
    if detrend not in DETREND:
        raise InputError(f"detrend is {detrend!r}; known: constant, linear")
    if length < 4 * m + 2 + DETREND[detrend]:
        raise InputError(f"length is {length}; {m} modes need at least {4 * m + 2 + DETREND[detrend]} samples")
    sensors = amplitude.shape[1]
    step = 1.0 / rate
    signal = Signal(
        time=step * np.arange(length),
        step=step,
        data=np.zeros((length, sensors)),
        present=np.ones((length, sensors), dtype=bool),
        names=tuple(f"sensor {c + 1}" for c in range(sensors)),
        degree=DETREND[detrend],
        band=(0.0, np.pi / step),
        noise=None,
        origin=0.0,
    )
    known = np.broadcast_to(np.asarray(noise, dtype=float), (sensors,))
    return covariance(-decay + 1j * frequency, amplitude * np.exp(1j * phase), known, signal)[: 2 * m, : 2 * m]
