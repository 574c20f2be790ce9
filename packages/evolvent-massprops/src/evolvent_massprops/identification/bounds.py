"""The least covariance that any unbiased estimate can have."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from evolvent_base.errors import InputError
from evolvent_massprops.identification.signals import DETREND, Array, Signal, basis


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


class Factor(NamedTuple):
    """Triangular factor of [Phi, t Phi] for sensors with the same samples.

    Attributes
    ----------
    R : (4 m + 1 + degree, 4 m + 1 + degree) or wider
    sensors : their numbers
    """

    R: Array
    sensors: Array


def covariance(factors: Sequence[Factor], amplitudes: Array, noise: Array) -> Array:
    """Inverse of the Fisher information of all parameters, white Gaussian noise of each sensor.

    Parameters
    ----------
    factors : of `basis` with slopes, at the poles and times, one a group of sensors with the same samples
    amplitudes : (m, c) complex
    noise : (c,) standard deviations

    Returns
    -------
    (n, n), n = 2 m + 2 m c + c
        Order: frequency (m), decay_rate (m), Re amplitude (m c), Im amplitude (m c), offset (c); amplitudes run over
        the sensors first. NaN where the parameters cannot be distinguished at all.

    Notes
    -----
    With Phi the columns of a sensor's linear parameters, J the derivatives with respect to the poles and
    P the projector on the complement of Phi, the poles have C = [sum_c J_c^T P J_c / noise_c^2]^-1, and the linear
    parameters of sensors c and d have K_c C K_d^T + (c = d) noise_c^2 (Phi^T Phi)^-1, K_c = -Phi^+ J_c
    (Stoica & Moses, Spectral Analysis of Signals, 2005, appendix B).
    """
    m, sensors = amplitudes.shape
    width = factors[0].R.shape[0] - 2 * m
    S = slope_factors(amplitudes).transpose(2, 0, 1)
    projected = np.empty((sensors, 2 * m, 2 * m))
    gains = np.empty((sensors, width, 2 * m))
    own = np.empty((sensors, width, width))
    try:
        for R, members in factors:
            upper = np.linalg.inv(R[:width, :width])
            projected[members] = R[width:, width : width + 2 * m] @ S[members]
            gains[members] = -(upper @ R[:width, width : width + 2 * m]) @ S[members]
            own[members] = upper @ upper.T
        J = (projected / noise[:, np.newaxis, np.newaxis]).reshape(-1, 2 * m)
        scale = np.sqrt((J**2).sum(axis=0))
        inverse = np.linalg.inv(np.linalg.qr(J / scale)[1]) / scale[:, np.newaxis]
    except np.linalg.LinAlgError:
        return np.full((2 * m + 2 * m * sensors + sensors,) * 2, np.nan)
    of_poles = inverse @ inverse.T
    own *= (noise**2)[:, np.newaxis, np.newaxis]
    K = gains.reshape(-1, 2 * m)
    linear = K @ of_poles @ K.T
    for c in range(sensors):
        at = slice(c * width, (c + 1) * width)
        linear[at, at] += own[c]
    # from (c, width) over the parameters first to Re a (m, c), Im a (m, c), offset (c)
    pick = np.arange(sensors * width).reshape(sensors, width)[:, : 2 * m + 1].T.ravel()
    cross = of_poles @ K[pick].T
    whole = np.empty((2 * m + pick.size,) * 2)
    whole[: 2 * m, : 2 * m] = of_poles
    whole[: 2 * m, 2 * m :] = cross
    whole[2 * m :, : 2 * m] = cross.T
    whole[2 * m :, 2 * m :] = linear[np.ix_(pick, pick)]
    return whole


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
    R = np.asarray(np.linalg.qr(basis(-decay + 1j * frequency, signal, slopes=True), mode="r"))
    return covariance([Factor(R, np.arange(sensors))], amplitude * np.exp(1j * phase), known)[: 2 * m, : 2 * m]
