"""Modes of one recording, with deviations that hold where the residual is not white."""

from __future__ import annotations

import dataclasses
import os
from typing import NamedTuple

import numpy as np

from evolvent_base import units
from evolvent_base.answer import Answer, Block, Section, Table
from evolvent_base.errors import InputError
from evolvent_base.showing import Shown
from evolvent_massprops import mode_figures
from evolvent_massprops.description import Pendulum, Signalling
from evolvent_massprops.identification import IdentifiedModes, identify
from evolvent_massprops.identification.clipping import clipped
from evolvent_massprops.identification.noise_density import density
from evolvent_massprops.identification.orders import WHITE, whiteness
from evolvent_massprops.identification.signals import Signal, read_signal
from evolvent_massprops.identification.swing_starts import Kind
from evolvent_massprops.recordings import Reading
from evolvent_massprops.rounding import shown

#: A mode this near to half the sampling rate may be a faster one seen through too few samples.
EDGE = 0.9
#: Share of a signal's square in a straight line above which it drifts.
DRIFT = 0.5
#: Change of the samples, of the largest, below which a recording is quiet before the swing.
QUIET = 0.2
#: All modes this many times faster than the body's heave are no modes of the body: its springs would stand that many
#: radii of gyration apart.
TOO_FAST = 30.0
#: Mains frequencies, Hz, of which so many harmonics are looked for, each so far from its place at most.
MAINS, HARMONICS, WANDER = (50.0, 60.0), 3, 0.06
#: Share of the strongest mode's decay rate below which a mode is said not to decay.
STEADY = 0.2
#: Residual over the stated noise above which the noise is stated too small.
UNDERSTATED = 3.0


@dataclasses.dataclass(frozen=True, eq=False)
class Modal(Shown):
    """Modes of a recording.

    Attributes
    ----------
    reading : Reading
    modes : IdentifiedModes, as identified
    white : p-value of the residual's highest line, were the residual white
    widening : (m,) factor on each mode's deviations, 1 where the residual is white
    frequency : (m,) rad/s, undamped, magnitudes of the poles
    frequency_covariance : (m, m), widened
    shapes : (m, c), signed amplitudes at the first sample
    shape_covariance : (m, c, c), widened
    warnings : sentences
    hum : indices of modes that mains hum explains
    clipped : those of the warnings that tell of sensors that were clipped before a filter
    """

    reading: Reading
    modes: IdentifiedModes
    white: float
    widening: np.ndarray
    frequency: np.ndarray
    frequency_covariance: np.ndarray
    shapes: np.ndarray
    shape_covariance: np.ndarray
    warnings: tuple[str, ...]
    hum: tuple[int, ...] = ()
    clipped: tuple[str, ...] = ()

    named = "modes"

    def answer(self) -> Answer:
        """Modes with the largest amplitude of each and where it is, figures, notes on the recording, and warnings."""
        m, reading, turn, rows = self.modes, self.reading, 2.0 * np.pi, []
        unit = "" if reading.unit == "dimensionless" else f" {reading.unit}"
        for k in range(m.order):
            wide, c = self.widening[k], int(m.amplitude[k].argmax())
            f, std = m.frequency[k], wide * m.frequency_std[k]
            row = shown(f / turn, std / turn), shown(f, std), shown(m.damping_ratio[k], wide * m.damping_ratio_std[k])
            where = f", {reading.names[c]}" if len(reading.names) > 1 else ""
            rows.append((f"mode {k + 1}", *row, f"{m.amplitude[k, c]:.4g}{unit}{where}"))
        heads = ("", "frequency Hz", "frequency rad/s", "damping ratio", "largest amplitude")
        title = f"modes of {os.path.basename(reading.source.path)}"
        blocks: list[Block] = [Table(heads=heads, rows=rows), *mode_figures.figures(m, reading.unit)]
        sections = [Section(title=title, blocks=blocks)]
        return Answer(title=title, sections=sections, warnings=[*reading.notes, *self.warnings])

    @property
    def frequency_std(self) -> np.ndarray:
        """(m,) rad/s, of the undamped frequencies, widened."""
        return np.sqrt(np.diag(self.frequency_covariance))

    @property
    def has_uncertainties(self) -> bool:
        """Whether the method gives uncertainties."""
        return bool(np.all(np.isfinite(self.frequency_covariance)))


#: Units of what sensors read of a swing, by the number of derivatives: angles, and lengths.
_ANGLES, _LENGTHS = ("rad", "rad/s", "rad/s^2"), ("m", "m/s", "m/s^2")


class Sensed(NamedTuple):
    """What sensors read of a motion.

    Attributes
    ----------
    derivative : how often it is differentiated: 0, 1, 2
    angle : size of the sensors' unit in rad, rad/s, rad/s^2; nan where they read no angle
    length : in m, m/s, m/s^2; nan where they read no length
    """

    derivative: int = 0
    angle: float = np.nan
    length: float = np.nan


def sensed(unit: str) -> Sensed:
    """What sensors read in a unit."""
    for n, (angle, length) in enumerate(zip(_ANGLES, _LENGTHS, strict=True)):
        for key, one in (("angle", angle), ("length", length)):
            try:
                return Sensed(n, **{key: units.factor(unit, one)})
            except units.UnitError:
                continue
    return Sensed()


def find(reading: Reading, given: Signalling, swing: Kind | None = None) -> Modal:
    """Identify the modes of a recording; `swing` is what the stand says of the strongest.

    Raises
    ------
    InputError
        As of `evolvent_massprops.identification.identify`.
    """
    chosen = given.identification
    try:
        modes = identify(
            reading.data,
            time=reading.time,
            method=chosen.method.replace("-", "_"),
            order=None if chosen.order == "auto" else int(chosen.order),
            names=reading.names,
            noise=reading.noise,
            band=chosen.band,
            detrend=chosen.detrend,
            decay=chosen.decay,
            swing=(swing or Kind())._replace(derivative=sensed(reading.unit).derivative),
        )
    except InputError as error:
        raise InputError(f"{error}{_drift(reading) if chosen.detrend == 'constant' else ''}") from None
    signal = read_signal(modes.data, time=modes.time, names=reading.names, noise=reading.noise)
    p, widening = _widening(signal, modes)
    found = modes.mode_shapes()
    widened = np.outer(widening, widening)
    hum, steady = _steady(modes, reading, widening, pendulum=isinstance(given, Pendulum))
    cut = tuple(clipped(modes, signal))
    return Modal(
        reading=reading,
        modes=modes,
        white=p,
        widening=widening,
        frequency=modes.natural_frequency,
        frequency_covariance=modes.natural_frequency_covariance * widened,
        shapes=found.real,
        shape_covariance=found.shape_covariance * np.diag(widened)[:, None, None],
        warnings=(*_identification_warnings(modes, widening, p, reading), *_edge(modes, reading), *steady, *cut),
        hum=hum,
        clipped=cut,
    )


def _drift(reading: Reading) -> str:
    """What to say of signals most of whose motion is a straight line; else nothing."""
    for name, x in zip(reading.names, reading.data.T, strict=True):
        there = np.isfinite(x)
        t, x = reading.time[there], x[there] - x[there].mean()
        line = np.polyval(np.polyfit(t, x, 1), t)
        if np.sum(line**2) > DRIFT * np.sum(x**2):
            return f"; {name} drifts by {line[-1] - line[0]:.3g} {reading.unit}: set identification.detrend=linear"
    return ""


def late_start_warning(reading: Reading) -> str:
    """What to say of a recording that begins before the swing does; else nothing.

    Notes
    -----
    A free vibration decays, so that its first samples change most. Quiet is a stretch at the beginning, longer than
    half a period of what follows, in which the samples change by less than `QUIET` of the most.
    """
    change = np.abs(np.diff(np.nan_to_num(reading.data, nan=0.0), axis=0))
    change[~np.isfinite(np.diff(reading.data, axis=0))] = 0.0
    sizes = np.sqrt(np.mean(change**2, axis=0))
    together = np.sqrt(np.mean((change / np.where(sizes > 0.0, sizes, 1.0)) ** 2, axis=1))
    first = int(np.argmax(together > QUIET * together.max()))
    if first < 8:
        return ""
    later = reading.data[first:] - np.nanmean(reading.data[first:], axis=0)
    lines = (np.abs(np.fft.rfft(np.nan_to_num(later), axis=0)) ** 2).sum(axis=1)
    period = len(later) / max(1, int(np.argmax(lines)))
    if first < 0.5 * period:
        return ""
    begins = reading.start + reading.time[first + 1]
    return f"the samples are quiet until {begins:.4g} s, where the swing seems to begin; set signals.start to it"


def _identification_warnings(modes: IdentifiedModes, widening: np.ndarray, p: float, reading: Reading) -> list[str]:
    """Warnings of the identification, that on the residual with what was done about it."""
    texts = [text for text in modes.warnings if not text.startswith("the residual is not white")]
    if reading.noise is not None:
        found = np.sqrt(np.nanmean(modes.residual**2, axis=0))
        ratio = found / reading.noise
        c = int(np.argmax(ratio))
        if ratio[c] > UNDERSTATED:
            return [
                *texts,
                f"the noise of {reading.names[c]} is stated as {reading.noise[c]:.3g} {reading.unit}, but the modes "
                f"leave {found[c]:.3g} {reading.unit}: it is stated too small, or the signals hold more than these "
                "modes; deviations are widened by the residual",
            ]
    if p < WHITE:
        most = int(np.argmax(widening))
        texts.append(
            f"the residual is not white (p = {p:.1g}): it holds more than these modes and white noise; deviations are "
            f"widened by the noise near each mode, at most {widening[most]:.1f} times (mode {most + 1})"
        )
    return texts


def _edge(modes: IdentifiedModes, reading: Reading) -> list[str]:
    half = np.pi * reading.rate
    near = [w for w in modes.frequency if w > EDGE * half]
    if not near:
        return []
    return [
        f"a mode at {near[-1]:.6g} rad/s is close to half the sampling rate ({half:.6g} rad/s); it may be a faster one "
        "seen through too few samples"
    ]


def _steady(
    modes: IdentifiedModes, reading: Reading, widening: np.ndarray, *, pendulum: bool
) -> tuple[tuple[int, ...], list[str]]:
    """Modes at a mains frequency, as it appears at this rate, and sentences on modes that do not decay.

    Of a pendulum any such mode is reported; a body on springs may have motions that nothing damps.

    Notes
    -----
    At the rate f a vibration of the frequency h appears at |h - n f|, n whole. A free vibration decays.
    """
    if not (modes.order > 1 and np.all(np.isfinite(modes.pole_covariance))):
        return (), []
    strongest = int(np.argmax((modes.amplitude**2).sum(axis=1)))
    std = widening * modes.decay_rate_std
    hum, texts = [], []
    for k, w in enumerate(modes.frequency):
        if k == strongest or abs(modes.decay_rate[k]) > 3.0 * std[k] or std[k] * modes.time[-1] > 1.0:
            continue
        own, name = float(w) / (2.0 * np.pi), f"the mode at {w:.6g} rad/s"
        near = min(3.0 * widening[k] * float(modes.frequency_std[k]) / (2.0 * np.pi), WANDER)
        for mains in (n * m for n in range(1, HARMONICS + 1) for m in MAINS):
            seen = abs(mains - reading.rate * round(mains / reading.rate))
            if abs(seen - own) < near + WANDER * mains / MAINS[0]:
                hum.append(k)
                texts.append(
                    f"{name} does not decay and lies where mains hum of {mains:g} Hz appears at {reading.rate:.6g} "
                    "samples a second: it is no free vibration"
                )
                break
        else:
            if pendulum and modes.decay_rate[k] + 2.0 * std[k] < STEADY * modes.decay_rate[strongest]:
                texts.append(
                    f"{name} does not decay as the others do: hum or a drive, perhaps seen through too few samples"
                )
    return tuple(hum), texts


def _widening(signal: Signal, modes: IdentifiedModes) -> tuple[float, np.ndarray]:
    """p-value of a white residual, and the factors.

    Notes
    -----
    In noise of the spectral density S a frequency's variance is S(frequency) over the mean of S times that in white
    noise of the same power, for S is smooth over the width of a line.
    """
    p = whiteness(signal, modes.residual, modes.noise)
    if p >= WHITE:
        return p, np.ones(modes.order)
    weight = (modes.amplitude / modes.noise) ** 2
    near = (weight * density(modes, signal)).sum(axis=1) / weight.sum(axis=1)
    return p, np.sqrt(np.maximum(near, 1.0))


def refuse_rate(expected: float, rate: float, what: str) -> None:
    """Refuse a sampling rate below twice a frequency, rad/s, that the stand is known to have."""
    if np.pi * rate <= expected:
        raise InputError(
            f"{rate:.6g} samples a second show nothing above {np.pi * rate:.6g} rad/s, but {what} is expected at "
            f"{expected:.6g} rad/s; sample at {expected / np.pi:.6g} Hz or more"
        )


def refuse_fast(heave: float, frequency: np.ndarray) -> None:
    """Refuse frequencies, rad/s, that are all far above the heave, rad/s, that stiffness and mass give."""
    slowest = float(frequency.min())
    if slowest > TOO_FAST * heave:
        raise InputError(
            f"the slowest mode found has {slowest:.6g} rad/s, but by the stated stiffness and mass the body heaves at "
            f"{heave:.6g} rad/s; check the unit of the time, the sampling rate, the stiffness and the mass"
        )
