"""What every method returns."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from evolvent_base.answer import Answer, Section, Table
from evolvent_base.dense import facing
from evolvent_base.showing import Answered
from evolvent_massprops.identification.signals import Array, Signal, basis, fit_linear, noise_of, split
from evolvent_massprops.identification.swing_laws import Swing


class OrderCriteria(NamedTuple):
    """What the orders that were tried say; one row an order.

    Attributes
    ----------
    order : (k,) numbers of modes
    mdl : (k,) description length, natural units; least is best
    bic : (k,) Bayesian information criterion; least is best
    whiteness : (k,) p-value of the residual's highest line, were it white noise; small where a mode is left in it
    supported : (k,) bool; False where a mode cannot be distinguished from its neighbour or from the noise
    """

    order: Array
    mdl: Array
    bic: Array
    whiteness: Array
    supported: Array


class ModeShapes(NamedTuple):
    """Mode shapes at the sensors.

    Attributes
    ----------
    complex : (m, c), amplitude and phase as measured, turned so that each shape is as real as it can be
    real : (m, c), its real part: signed amplitudes at t = 0, the largest positive, in the sensors' units
    realness : (m,) 1 for sensors that move in phase or against it, 0 for a circle (modal phase collinearity)
    covariance : (2 m + m c, 2 m + m c) of frequency (m), decay_rate (m) and `real` (m c, over the sensors first)
    """

    complex: Array
    real: Array
    realness: Array
    covariance: Array

    @property
    def shape_covariance(self) -> Array:
        """(m, c, c) of each mode's `real`."""
        m, c = self.real.shape
        blocks = self.covariance[2 * m :, 2 * m :].reshape(m, c, m, c)
        return np.array([blocks[k, :, k] for k in range(m)]).reshape(m, c, c)


@dataclass(frozen=True, eq=False)
class IdentifiedModes(Answered):
    """Modes of free vibration, by rising frequency, m modes at c sensors.

    The model: x_c(t) = offset_c + drift_c t + sum_k amplitude_kc exp(-decay_rate_k t) cos(frequency_k t + phase_kc),
    where mode k is no swing with another law of decay (`swings`).

    Attributes
    ----------
    method : name of the method
    order : m
    names : c names of sensors
    frequency : (m,) rad/s, imaginary part of the pole; of a swing for the amplitude zero, by its viscous damping alone
    decay_rate : (m,) 1/s, minus the pole's real part; of a swing that by viscous damping alone
    amplitude, phase : (m, c) at the first sample, in the sensors' units; rad in (-pi, pi]
    offset, drift : (c,), drift in units a second, zero unless asked for
    covariance : (n, n), n = 2 m + 2 m c + c
        Of frequency (m), decay_rate (m), Re amplitude (m c), Im amplitude (m c) and offset (c), where the complex
        amplitude is amplitude exp(i phase), over the sensors first. NaN for methods other than VARPRO, from which
        none follows; and so are all `_std`.
    noise : (c,) standard deviation of each sensor's noise, as given or as estimated from the residual
    time : (N,) s, from the first sample
    data, fitted, residual : (N, c); data and residual are NaN where a sample is missing
    criteria : what was found for each order, None where the order was given
    warnings : sentences about what the data do not support
    iterations : steps that the fit took, 0 for methods that have none
    swings : m entries, or none: how each mode swings, None where it decays exponentially at one frequency
    """

    method: str
    order: int
    names: tuple[str, ...]
    frequency: Array
    decay_rate: Array
    amplitude: Array
    phase: Array
    offset: Array
    drift: Array
    covariance: Array
    noise: Array
    time: Array
    data: Array
    fitted: Array
    residual: Array
    criteria: OrderCriteria | None = None
    warnings: tuple[str, ...] = ()
    iterations: int = 0
    swings: tuple[Swing | None, ...] = ()

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, np.ndarray):
                value.flags.writeable = False

    # ------------------------------------------------------------------ derived

    @property
    def pole(self) -> Array:
        """(m,) complex, 1/s: -decay_rate + i frequency."""
        return np.asarray(-self.decay_rate + 1j * self.frequency)

    @property
    def complex_amplitude(self) -> Array:
        """(m, c) amplitude exp(i phase)."""
        return np.asarray(self.amplitude * np.exp(1j * self.phase))

    @property
    def natural_frequency(self) -> Array:
        """(m,) rad/s, magnitude of the pole."""
        return np.hypot(self.frequency, self.decay_rate)

    @property
    def damping_ratio(self) -> Array:
        """(m,) decay_rate / natural_frequency."""
        return np.asarray(self.decay_rate / self.natural_frequency)

    # ------------------------------------------------------------------ uncertainty

    @property
    def pole_covariance(self) -> Array:
        """(2 m, 2 m) of frequency (m) and decay_rate (m)."""
        return self.covariance[: 2 * self.order, : 2 * self.order]

    @property
    def frequency_std(self) -> Array:
        """(m,) rad/s."""
        return np.sqrt(np.diag(self.pole_covariance)[: self.order])

    @property
    def decay_rate_std(self) -> Array:
        """(m,) 1/s."""
        return np.sqrt(np.diag(self.pole_covariance)[self.order :])

    @property
    def natural_frequency_covariance(self) -> Array:
        """(m, m) of the magnitudes of the poles, first order."""
        return self._propagated(self.frequency / self.natural_frequency, self.decay_rate / self.natural_frequency)

    @property
    def natural_frequency_std(self) -> Array:
        """(m,) rad/s, first order."""
        return np.sqrt(np.maximum(np.diag(self.natural_frequency_covariance), 0.0))

    @property
    def damping_ratio_std(self) -> Array:
        """(m,) first order."""
        cube = self.natural_frequency**3
        C = self._propagated(-self.frequency * self.decay_rate / cube, self.frequency**2 / cube)
        return np.sqrt(np.maximum(np.diag(C), 0.0))

    def _propagated(self, by_frequency: Array, by_decay_rate: Array) -> Array:
        """(m, m) covariance of a number of each pole, from its derivatives (m,)."""
        J = np.hstack([np.diag(by_frequency), np.diag(by_decay_rate)])
        return np.asarray(J @ self.pole_covariance @ J.T)

    @property
    def amplitude_std(self) -> Array:
        """(m, c) first order."""
        return self._amplitude_std(np.cos(self.phase), np.sin(self.phase))

    @property
    def phase_std(self) -> Array:
        """(m, c) rad, first order; meaningless where the amplitude is within its own deviation of zero."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return self._amplitude_std(-np.sin(self.phase), np.cos(self.phase)) / self.amplitude

    def _amplitude_std(self, by_real: Array, by_imag: Array) -> Array:
        first, size = 2 * self.order, self.amplitude.size
        re = first + np.arange(size).reshape(self.amplitude.shape)
        im = re + size
        C = self.covariance
        variance = by_real**2 * C[re, re] + 2.0 * by_real * by_imag * C[re, im] + by_imag**2 * C[im, im]
        return np.sqrt(np.maximum(variance, 0.0))

    @property
    def offset_std(self) -> Array:
        """(c,)."""
        return np.sqrt(np.diag(self.covariance)[-len(self.names) :])

    # ------------------------------------------------------------------ use

    def mode_shapes(self) -> ModeShapes:
        """Signed shapes at the sensors, how real they are, and their covariance with the poles.

        Returns
        -------
        ModeShapes

        Notes
        -----
        Each shape is turned by half the phase of s = sum_c a_c^2 / noise_c^2, which makes its real part as large as it
        can be, and has the sign of `facing`; realness is ``|s| / sum_c |a_c|^2 / noise_c^2``, the modal phase
        collinearity. The covariance is first order, with the turn's own uncertainty: d turn angle =
        -Im(sum_c a_c da_c / noise_c^2 / s).
        """
        a = self.complex_amplitude
        m, sensors = a.shape
        square = ((a / self.noise) ** 2).sum(axis=1)
        realness = np.abs(square) / (np.abs(a / self.noise) ** 2).sum(axis=1)
        turn = np.exp(-0.5j * np.angle(square))
        shape = a * turn[:, np.newaxis]
        turn = turn * facing(shape.real)
        shape = a * turn[:, np.newaxis]
        # d Re shape = Re(turn da) - Im shape d angle, by Re da and by Im da
        size = m * sensors
        T = np.zeros((2 * m + size, len(self.covariance)))
        T[: 2 * m, : 2 * m] = np.eye(2 * m)
        for k in range(m):
            at = slice(k * sensors, (k + 1) * sensors)
            rows = np.arange(2 * m, 2 * m + size)[at]
            by_re = turn[k] * np.eye(sensors)
            angle = -a[k] / self.noise**2 / square[k]
            T[np.ix_(rows, rows)] = by_re.real - np.outer(shape[k].imag, angle.imag)
            T[np.ix_(rows, rows + size)] = -by_re.imag - np.outer(shape[k].imag, angle.real)
        return ModeShapes(shape, shape.real, realness, T @ self.covariance @ T.T)

    def parts(self, time: Array) -> Array:
        """(n, m, c) samples of each mode at times (n,), s from the first sample."""
        time = np.asarray(time, dtype=float)
        found = (np.exp(np.multiply.outer(time, self.pole))[:, :, None] * self.complex_amplitude).real
        for k, swing in enumerate(self.swings):
            if swing is not None:
                found[:, k] = swing.predict(time, self.complex_amplitude[k])
        return found

    def predict(self, time: Array) -> Array:
        """The fitted model (n, c) at other times, s from the first sample."""
        return np.asarray(self.parts(time).sum(axis=1) + self.offset + np.multiply.outer(time, self.drift))

    def answer(self) -> Answer:
        """Frequencies, decay rates, damping and the largest amplitudes, and warnings."""
        rows, with_swings = [], any(swing is not None for swing in self.swings)
        for k in range(self.order):
            c = int(np.argmax(self.amplitude[k]))
            swing = self.swings[k] if self.swings else None
            rows.append((
                f"{self.frequency[k]:.6g} ± {self.frequency_std[k]:.2g}",
                f"{self.decay_rate[k]:.4g} ± {self.decay_rate_std[k]:.2g}",
                f"{self.damping_ratio[k]:.3g}", f"{self.amplitude[k, c]:.4g} ({self.names[c]})",
                *(["" if swing is None else str(swing)] if with_swings else []),
            ))  # fmt: skip
        heads = ["frequency rad/s", "decay rate 1/s", "damping ratio", "largest amplitude"]
        heads += ["one swing"] if with_swings else []
        title = f"{self.order} modes by {self.method} from {len(self.time)} samples of {len(self.names)} sensors"
        sections = [Section(title=title, blocks=[Table(heads=heads, rows=rows, words=0)])]
        return Answer(title=title, sections=sections, warnings=self.warnings)


#: Quantities of `IdentifiedModes` for files and tables: name -> (units, text, whether of every sensor); '' is
#: the sensors' unit.
QUANTITIES = {
    "frequency": ("rad s-1", "identified frequency", False),
    "frequency_std": ("rad s-1", "standard deviation of the identified frequency", False),
    "decay_rate": ("s-1", "identified decay rate", False),
    "decay_rate_std": ("s-1", "standard deviation of the identified decay rate", False),
    "amplitude": ("", "identified amplitude at the sensor", True),
    "amplitude_std": ("", "standard deviation of the identified amplitude", True),
    "phase": ("rad", "identified phase at the sensor", True),
}


def mode_variables(
    modes: IdentifiedModes | None, *, unit: str, order: int = 0, sensors: int = 0
) -> dict[str, tuple[tuple[str, ...], Array, str, str]]:
    """Modes as variables over the dimensions "mode" and "sensor": name -> (dimensions, values, units, text).

    Parameters
    ----------
    modes : IdentifiedModes, or None where none were found
    unit : str, of the sensors
    order, sensors : int, numbers of modes and sensors where none were found; the values are then NaN
    """
    found: dict[str, tuple[tuple[str, ...], Array, str, str]] = {}
    for name, (units, text, each) in QUANTITIES.items():
        values = np.full((order, sensors) if each else order, np.nan) if modes is None else getattr(modes, name)
        found[f"mode_{name}"] = (("mode", "sensor") if each else ("mode",), values, units or unit, text)
    return found


def sort(poles: Array) -> Array:
    """Poles by rising frequency."""
    return poles[np.argsort(poles.imag, kind="stable")]


def make_modes(
    method: str,
    poles: Array,
    signal: Signal,
    *,
    coefficients: Array | None = None,
    noise: Array | None = None,
    covariance: Array | None = None,
    iterations: int = 0,
) -> IdentifiedModes:
    """Modes of given poles; those of a fit are in order and come with its linear `coefficients`.

    Without these, the amplitudes are those that fit best; without `noise`, it follows from the residual.
    """
    poles = sort(poles)
    m, sensors = len(poles), signal.data.shape[1]
    if coefficients is None:
        coefficients = fit_linear(poles, signal)[0]
    fitted = basis(poles, signal) @ coefficients
    residual = signal.data - fitted
    a = split(coefficients, m)
    if noise is None:
        noise = signal.noise if signal.noise is not None else noise_of(signal, np.nansum(residual**2, axis=0), m)
    size = 2 * m + 2 * m * sensors + sensors
    return IdentifiedModes(
        method=method,
        order=m,
        names=signal.names,
        frequency=poles.imag.copy(),
        decay_rate=-poles.real,
        amplitude=np.abs(a),
        phase=np.angle(a),
        offset=coefficients[2 * m],
        drift=coefficients[2 * m + 1] / signal.time[-1] if signal.degree else np.zeros(sensors),
        covariance=np.full((size, size), np.nan) if covariance is None else covariance,
        noise=noise,
        time=signal.time,
        data=signal.data,
        fitted=fitted,
        residual=residual,
        iterations=iterations,
    )
