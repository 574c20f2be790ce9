"""What the methods read: the user's samples, checked, and the basis functions that are fitted to them."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypedDict

import numpy as np
import scipy

from evolvent_base.errors import InputError, nearest
from evolvent_base.signals.times import Times, cells, check_rate, read_times

Array = np.ndarray

#: Degree of the polynomial that is fitted to each sensor beside the modes.
DETREND = {"constant": 0, "linear": 1}
#: A sensor is called clipped where its extreme value is held so many samples in a row ...
FLAT_RUN = 3
#: ... and is taken so many times as often as the next value (a finely resolved sine: up to 2.4 times).
FLAT_SHARE = 5
#: Largest and least magnitude of a sensor's largest value; beyond, squares and their products leave the numbers.
LARGEST, LEAST = 1e75, 1e-75


@dataclass(frozen=True)
class Signal:
    """Samples of all sensors and their times.

    Attributes
    ----------
    time : (N,) s, from 0, even or not
    step : s, between samples that follow each other; on average where `time` is uneven
    data : (N, c), in the sensors' units, NaN where a sample is missing
    present : (N, c) bool
    names : c names of sensors
    degree : degree of the polynomial that is fitted to each sensor: 0 offset, 1 offset and drift
    band : (low, high) rad/s; modes are looked for inside
    noise : (c,) standard deviations that the user knows, or None
    origin : s, the user's time of the first sample
    even : whether `time` is step times 0, 1, 2, ...
    steady : (N,) s, the times without their scatter; None where they do not scatter
    unsure : relative standard uncertainty of all times together, by their rounding
    """

    time: Array
    step: float
    data: Array
    present: Array
    names: tuple[str, ...]
    degree: int
    band: tuple[float, float]
    noise: Array | None
    origin: float
    even: bool = True
    steady: Array | None = None
    unsure: float = 0.0

    @functools.cached_property
    def groups(self) -> list[tuple[Any, Array]]:
        """Sensors that have the same samples: (rows, sensors), most often a single group with all of them."""
        if self.present.all():
            return [(slice(None), np.arange(self.data.shape[1]))]
        patterns, group = np.unique(self.present, axis=1, return_inverse=True)
        group = np.ravel(group)
        return [(np.flatnonzero(patterns[:, i]), np.flatnonzero(group == i)) for i in range(patterns.shape[1])]

    @functools.cached_property
    def counts(self) -> Array:
        """(c,) number of samples that are there."""
        return self.present.sum(axis=0)

    @functools.cached_property
    def rounding(self) -> Array:
        """(c,) the least noise that can be distinguished from rounding: 1e-13 of each sensor's largest value."""
        return np.asarray(1e-13 * np.nanmax(np.abs(self.data), axis=0))

    @functools.cached_property
    def cells(self) -> Array | None:
        """(N,) int, the cells of an even grid that the samples are nearest to; None where the times are even."""
        return None if self.even else cells(self.time, self.step)

    @functools.cached_property
    def extent(self) -> int:
        """Number of cells of that grid from the first sample to the last."""
        return len(self.time) if self.cells is None else int(self.cells[-1]) + 1

    def part(self, rows: slice) -> Signal:
        """The samples of some rows alone, with time from the first of them."""
        time = self.time[rows] - self.time[rows][0]
        return replace(self, time=time, data=self.data[rows], present=self.present[rows], origin=0.0, steady=None)

    def with_data(self, data: Array) -> Signal:
        """The same times with other samples, none missing."""
        return replace(self, data=data, present=np.ones(data.shape, dtype=bool))


class Sampling(TypedDict, total=False):
    """What `read_signal` takes beside the samples."""

    rate: float | None
    time: Any
    names: Sequence[str] | None
    noise: Any
    band: Sequence[float] | None
    detrend: str


def read_signal(
    data: Any,
    *,
    rate: float | None = None,
    time: Any = None,
    names: Sequence[str] | None = None,
    noise: Any = None,
    band: Sequence[float] | None = None,
    detrend: str = "constant",
) -> Signal:
    """Check what the user gave.

    Parameters
    ----------
    data : (N,) or (N, c) array, or mapping from names of sensors to (N,) arrays; NaN where a sample is missing
    rate : Hz, samples a second; or
    time : (N,) s, rising
    names : c names of sensors
    noise : standard deviation of the sensors' noise, one number or (c,), in the units of `data`
    band : (low, high) rad/s
    detrend : "constant" (an offset is fitted to each sensor) or "linear" (an offset and a drift)

    Returns
    -------
    Signal

    Raises
    ------
    InputError
        Lengths that differ, times that do not rise or are absurdly far apart, a rate below twice the band's upper end,
        a sensor that is empty, constant or clipped, infinite, complex or huge values.
    """
    values, found = _read_data(data)
    length, sensors = values.shape
    names = _read_names(names if names is not None else found, sensors)
    if length < sensors:
        raise InputError(f"data has {length} samples of {sensors} sensors; its shape must be (samples, sensors)")
    if length < 8:
        raise InputError(f"data has {length} samples; at least 8 are needed")
    times = _read_time(rate, time, length)
    if detrend not in DETREND:
        raise InputError(f"detrend is {detrend!r}; {nearest(str(detrend), DETREND)}")
    _check_sensors(values, names)
    return Signal(
        time=times.time,
        step=times.step,
        data=values,
        present=~np.isnan(values),
        names=names,
        degree=DETREND[detrend],
        band=_read_band(band, times.step),
        noise=_read_noise(noise, sensors),
        origin=times.origin,
        even=times.even,
        steady=times.steady,
        unsure=times.unsure,
    )


def refuse_uneven(signal: Signal, method: str) -> None:
    """Refuse uneven times for a method that needs even ones."""
    if not signal.even:
        raise InputError(f"the time is not even, but {method} needs even times; varpro fits at any times")


def _read_data(data: Any) -> tuple[Array, Sequence[str] | None]:
    found = None
    parts = list(data.values()) if isinstance(data, Mapping) else [data]
    try:
        complex_ = any(np.iscomplexobj(np.asarray(part)) for part in parts)
    except ValueError:
        complex_ = False  # ragged, refused below
    if complex_:
        raise InputError("data is complex; give real samples, such as the real and imaginary parts as two sensors")
    if isinstance(data, Mapping):
        found = [str(name) for name in data]
        columns = [np.ravel(np.asarray(column, dtype=float)) for column in data.values()]
        lengths = {name: column.size for name, column in zip(found, columns, strict=True)}
        if len(set(lengths.values())) != 1:
            listed = ", ".join(f"{name}: {size}" for name, size in lengths.items())
            raise InputError(f"the sensors have unequal numbers of samples ({listed}); they must be equal")
        values = np.column_stack(columns)
    else:
        try:
            values = np.array(data, dtype=float)
        except (TypeError, ValueError):
            raise InputError("data is not an array of numbers, or its rows are of unequal lengths") from None
    if values.ndim == 1:
        values = values[:, np.newaxis]
    if values.ndim != 2 or values.size == 0:
        raise InputError(f"data has shape {values.shape}; it must be (samples,) or (samples, sensors)")
    return values, found


def _read_names(names: Sequence[str] | None, sensors: int) -> tuple[str, ...]:
    if names is None:
        return tuple(f"sensor {c + 1}" for c in range(sensors))
    if len(names) != sensors or len(set(names)) != sensors:
        raise InputError(f"names is {list(names)!r}; it must be {sensors} different names, one a sensor")
    return tuple(str(name) for name in names)


def _read_time(rate: float | None, time: Any, length: int) -> Times:
    if (rate is None) == (time is None):
        raise InputError("give either rate (samples a second) or time (the samples' times), not both or neither")
    if rate is not None:
        if not (isinstance(rate, (int, float, np.number)) and np.isfinite(rate) and rate > 0.0):
            raise InputError(f"rate is {rate!r}; it must be a finite number of samples a second above 0")
        check_rate(float(rate), "rate")
        step, row = 1.0 / float(rate), np.arange(length)
        return Times(step * row, step, 0.0, row, True, None, ())
    times = np.ravel(np.asarray(time, dtype=float))
    if times.size != length:
        raise InputError(f"time has {times.size} values and data {length} samples; they must be equal")
    return read_times(times)


def _read_band(band: Sequence[float] | None, step: float) -> tuple[float, float]:
    nyquist = np.pi / step
    if band is None:
        return 0.0, float(nyquist)
    if np.shape(band) != (2,) or not (np.all(np.isfinite(band)) and 0.0 <= band[0] < band[1]):
        raise InputError(f"band is {band!r}; it must be (low, high) in rad/s with 0 <= low < high")
    if band[1] > nyquist:
        raise InputError(
            f"band reaches up to {band[1]:.6g} rad/s; {1.0 / step:.6g} samples a second show nothing above "
            f"{nyquist:.6g} rad/s (half the rate): sample at {band[1] / np.pi:.6g} Hz or more"
        )
    return float(band[0]), float(band[1])


def _read_noise(noise: Any, sensors: int) -> Array | None:
    if noise is None:
        return None
    try:
        known = np.broadcast_to(np.asarray(noise, dtype=float), (sensors,)).copy()
    except ValueError:
        raise InputError(f"noise is {noise!r}; it must be one number or {sensors}, one a sensor") from None
    if not (np.all(np.isfinite(known)) and np.all(known > 0.0)):
        raise InputError(f"noise is {noise!r}; it must be finite and above 0")
    return known


def _check_sensors(values: Array, names: tuple[str, ...]) -> None:
    if np.all(np.isnan(values)):
        raise InputError("data is NaN everywhere")
    if np.any(np.isinf(values)):
        row, column = np.argwhere(np.isinf(values))[0]
        raise InputError(f"{names[column]} is infinite at sample {row}; a missing sample is NaN")
    empty = np.all(np.isnan(values), axis=0)
    if np.any(empty):
        raise InputError(f"{names[int(np.argmax(empty))]} is NaN everywhere; leave it out")
    highest, lowest = np.nanmax(values, axis=0), np.nanmin(values, axis=0)
    size = np.maximum(np.abs(highest), np.abs(lowest))
    if np.any(wrong := (size > LARGEST) | ((size < LEAST) & (size > 0.0))):
        c = int(np.argmax(wrong))
        raise InputError(
            f"{names[c]} has values of up to {size[c]:.3g}; use a unit in which they are between {LEAST:g} and "
            f"{LARGEST:g}"
        )
    dead = highest - lowest <= 1e-13 * size
    if np.any(dead):
        c = int(np.argmax(dead))
        raise InputError(f"{names[c]} is constant ({highest[c] + 0.0:.6g}): a dead sensor; leave it out")
    for side, extremes in (("highest", highest), ("lowest", lowest)):
        for c in np.flatnonzero((values == extremes).sum(axis=0) >= FLAT_RUN).tolist():
            held = _clipped_samples(values[:, c], float(extremes[c]))
            if held:
                raise InputError(
                    f"{names[c]} is clipped or held: {held} samples are at its {side} value {extremes[c]:.6g}; "
                    "measure again with a wider range, or put NaN in place of these samples"
                )


def _clipped_samples(column: Array, extreme: float) -> int:
    """Number of samples at the extreme value if it is held like a clipped signal's; else 0."""
    flat = column == extreme
    edges = np.flatnonzero(np.diff(np.concatenate(([0], flat.astype(int), [0]))))
    if (edges[1::2] - edges[::2]).max() < FLAT_RUN:
        return 0
    others = column[~flat & ~np.isnan(column)]
    following = others[np.argmin(np.abs(others - extreme))]
    count = int(flat.sum())
    return count if count >= FLAT_SHARE * int((others == following).sum()) else 0


def check_order(signal: Signal, order: Any) -> int:
    """`order` as an int; refused unless at least 1 and small enough for the samples of every sensor.

    Each sensor must have twice as many samples as unknowns of its own with the poles: 2 (4 order + 1).
    """
    if isinstance(order, bool) or not isinstance(order, (int, np.integer)) or order < 1:
        raise InputError(f"order is {order!r}; it must be a whole number of modes, 1 or more")
    worst = int(np.argmin(signal.counts))
    most = highest_order(signal)
    if order > most:
        raise InputError(
            f"order {order} asks too much of {signal.names[worst]}, which has {signal.counts[worst]} samples: "
            f"they allow {most} modes"
        )
    return int(order)


def highest_order(signal: Signal) -> int:
    """The largest number of modes that the samples allow, see `check_order`."""
    return int((signal.counts.min() / 2 - 1 - signal.degree) // 4)


def exponentials(poles: Array, time: Array) -> Array:
    """exp(poles t) : (N, m) complex, for `time` from 0.

    Of even times exp(p t) = exp(p t_block) exp(p t_rest): a seventh of the time of an exponential a sample, 2 roundings
    off.
    """
    block = 32
    first, rest = time[::block], time[:block]
    even = (first[:, np.newaxis] + rest).ravel()[: len(time)]
    if np.any(np.abs(time - even) > 4.0 * np.finfo(float).eps * even):
        return np.asarray(np.exp(np.multiply.outer(time, poles)))
    start, inner = np.exp(np.multiply.outer(first, poles)), np.exp(np.multiply.outer(rest, poles))
    return np.asarray((start[:, np.newaxis] * inner).reshape(len(start) * len(inner), len(poles))[: len(time)])


def basis(poles: Array, signal: Signal, *, slopes: bool = False) -> Array:
    """Columns that are fitted to a sensor: (N, 2 m + 1 + degree), or with their slopes (N, 4 m + 1 + degree).

    Re E, -Im E, the polynomial and, with `slopes`, t Re E and -t Im E, where E = exp(poles t): then
    ``Re(a E) = Re a Re E - Im a Im E``.
    """
    time, m = signal.time, len(poles)
    E = exponentials(poles, time)
    width = 2 * m + 1 + signal.degree
    A = np.empty((len(time), width + (2 * m if slopes else 0)))
    A[:, :m] = E.real
    np.negative(E.imag, out=A[:, m : 2 * m])
    A[:, 2 * m] = 1.0
    if signal.degree:
        A[:, 2 * m + 1] = time / time[-1]
    if slopes:
        np.multiply(A[:, : 2 * m], time[:, np.newaxis], out=A[:, width:])
    return A


def fit_linear(poles: Array, signal: Signal) -> tuple[Array, Array]:
    """Amplitudes, offsets and drifts for given poles by least squares.

    Returns
    -------
    coefficients : (2 m + 1 + degree, c): Re a, -Im a's partner Im a, polynomial; see `basis`
    residual : (N, c), NaN where a sample is missing
    """
    A = basis(poles, signal)
    coefficients = np.empty((A.shape[1], signal.data.shape[1]))
    for rows, sensors in signal.groups:
        coefficients[:, sensors] = np.linalg.lstsq(A[rows], signal.data[rows][:, sensors], rcond=None)[0]
    return coefficients, signal.data - A @ coefficients


def noise_of(signal: Signal, squares: Array, m: int, *, common: int = 2) -> Array:
    """(c,) standard deviation of the noise, from the sums of squares (c,) of the residual of a fit of `m` modes.

    Degrees of freedom: the samples less the sensor's own 2 m + 1 unknowns and its share of those that a mode has in
    `common` at all sensors, a frequency and a decay rate; 1 at least.
    """
    free = signal.counts - (2 * m + 1 + signal.degree) - common * m / len(squares)
    return np.maximum(np.sqrt(squares / np.maximum(free, 1.0)), signal.rounding)


def fit_term(signal: Signal, squares: Array, colour: Array | float = 1.0) -> float:
    """sum_c n_c log s_c^2 with s_c^2 the mean squares of a residual whose sums of squares are (c,).

    `colour` (c,) is the density of the noise near a mode over its mean: what a fit gains there counts so much less.
    """
    left = squares / signal.counts + (100.0 * signal.rounding) ** 2
    return float((signal.counts * np.log(left) / colour).sum())


def information(signal: Signal, squares: Array, unknowns: int, colour: Array | float = 1.0) -> float:
    """Bayesian information criterion of a fit with so many unknowns in all, see `fit_term`."""
    return fit_term(signal, squares, colour) + unknowns * float(np.log(signal.counts.sum()))


def power(data: Array, places: Array | None = None, *, padded: int = 1) -> Array:
    """(n // 2 + 1, c) squared magnitudes of the Fourier transform, n the samples times `padded`.

    Samples that are missing count as 0. Those of uneven times are put into the cells `places` (N,) of an even grid, see
    `Signal.cells`: white noise has the same expectation at all lines there, too.
    """
    values = np.where(np.isnan(data), 0.0, data)
    if places is not None:
        samples, values = values, np.zeros((int(places[-1]) + 1, data.shape[1]))
        np.add.at(values, places, samples)
    transform = np.fft.rfft(values, n=padded * len(values), axis=0)
    return np.asarray(transform.real**2 + transform.imag**2)


def noise_and_highest_frequency(signal: Signal) -> tuple[Array, float]:
    """A first look at the spectrum: noise of each sensor, and the highest frequency that stands out of it.

    Returns
    -------
    noise : (c,) from the median of each sensor's Hann-windowed periodogram
    highest : rad/s; the band's upper end if that is below half the rate
    """
    length, sensors = signal.data.shape
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * (np.arange(length) + 0.5) / length)
    mean = np.where(signal.present, signal.data, 0.0).sum(axis=0) / signal.counts
    spectrum = power((signal.data - mean) * window[:, np.newaxis])
    floor = np.median(spectrum, axis=0) / np.log(2.0) + (signal.rounding * length) ** 2
    nyquist = np.pi / signal.step
    highest = signal.band[1]
    if highest > 0.999 * nyquist:
        # the sum over sensors of white noise is Gamma(c) distributed; one bin in 10^4 records would pass
        level = scipy.special.gammainccinv(sensors, 1e-4 / len(spectrum))
        out = np.flatnonzero((spectrum / floor).sum(axis=1) > level)
        last = out[-1] + 2 if out.size else len(spectrum)
        highest = min(nyquist, 2.0 * np.pi * last / (length * signal.step))
    return np.sqrt(floor / (window**2).sum()), float(highest)


def split(coefficients: Array, m: int) -> Array:
    """Complex amplitudes (m, c) from the coefficients of `basis`."""
    return np.asarray(coefficients[:m] + 1j * coefficients[m : 2 * m])


def recorded(values: Array, *, noise: Any = 0.0, quantisation: float = 0.0, seed: int = 0) -> Array:
    """What sensors read of values (N, c): with white noise, then rounded to steps.

    Parameters
    ----------
    noise : float or (c,) float, standard deviation
    quantisation : float, step of the digital reading; 0 for none
    seed : int
    """
    noise = np.broadcast_to(np.asarray(noise, dtype=float), values.shape[1:])
    read = values + noise * np.random.default_rng(seed).standard_normal(values.shape) if noise.any() else values
    return quantisation * np.round(read / quantisation) if quantisation > 0.0 else read
