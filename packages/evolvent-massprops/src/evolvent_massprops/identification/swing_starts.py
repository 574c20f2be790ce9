"""Where the fit of a swing begins: as a group of exponential modes does."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy

from evolvent_massprops import swing as kernel
from evolvent_massprops.identification import swing_model as model
from evolvent_massprops.identification.modes import IdentifiedModes
from evolvent_massprops.identification.signals import Array, Signal
from evolvent_massprops.identification.swing_model import Component, Reach, Restoring

#: Root mean square, of the first amplitude, by which the envelope of a group may differ from that of a swing; agreement
#: of the shapes of its modes.
RIPPLE, ALIKE = 0.08, 0.9
#: Points at which the envelope is compared for starts.
_POINTS = 200


class Kind(NamedTuple):
    """What is known of the strongest swing before.

    Attributes
    ----------
    restoring : Restoring; None where it is not known: a linear one, or one with a cubic term
    reach : Reach
    derivative : 0, 1, 2: sensors read x, x', x''
    avoid : rad/s, of another motion of the body, such as the sway on wires; nan for none
    """

    restoring: Restoring | None = None
    reach: Reach = model.UNKNOWN
    derivative: int = 0
    avoid: float = np.nan


def _alike(modes: IdentifiedModes, group: list[int]) -> bool:
    """Whether the modes of a group move the sensors alike, as parts of one swing do."""
    a = modes.complex_amplitude[group] / modes.noise
    size = np.sqrt((np.abs(a) ** 2).sum(axis=1))
    k = int(np.argmax(size))
    strong = size > 0.2 * size[k]
    agreement = np.abs(a @ a[k].conj()) / np.maximum(size * size[k], 1e-300)
    return bool(np.all(agreement[strong] > ALIKE))


def start_of(modes: IdentifiedModes, group: list[int], signal: Signal, kind: Kind) -> Component | None:
    """A swing that begins and decays as a group of exponential modes does; None where they beat, or differ in shape."""
    if not _alike(modes, group):
        return None
    weight = (modes.amplitude[group] / modes.noise) ** 2
    reference = int(np.argmax(np.abs(modes.complex_amplitude[group].sum(axis=0)) / modes.noise))
    if np.isfinite(kind.reach.factor):
        reference = int(np.argmax(weight.sum(axis=0)))
    time = np.linspace(0.0, float(signal.time[-1]), _POINTS)
    z = np.exp(np.multiply.outer(time, modes.pole[group])) @ modes.complex_amplitude[group, reference]
    carrier = float(modes.frequency[group][np.argmax(weight.sum(axis=1))])
    size = np.abs(z)
    phase = np.unwrap(np.angle(z * np.exp(-1j * carrier * time)))
    share = size**2 / max(float((size**2).sum()), 1e-300)
    b = size / max(float(size[: max(2, _POINTS // 20)].max()), 1e-300)
    rates, left = _envelope_rates(time, b)
    mean = float(np.clip(b.mean(), 0.05, 1.0))
    total = rates[0] + rates[1] / mean + rates[2] * mean
    if left > RIPPLE:
        return None
    restoring = kind.restoring if kind.restoring is not None else model.LINEAR
    slope = np.gradient(phase, time)
    w = carrier + float((slope * share).sum())
    square = 1.0
    if not restoring.linear:
        if np.isfinite(kind.reach.factor):
            square = (kind.reach.factor * float(size.max()) / w**kind.derivative) ** 2
        elif np.isfinite(kind.reach.mean):
            square = (kind.reach.mean / max(float(b.mean()), 1e-3)) ** 2
        else:
            fit = np.polyfit(b**2, slope, 1, w=np.sqrt(share))
            square = float(np.clip(-16.0 * fit[0] / w, 1e-4, 4.0))
        w *= 1.0 + square * float((b**2 * share).sum()) / 16.0
    return Component(
        pole=complex(0.0, w),
        rates=(total, 0.0, 0.0),
        phase=float(np.angle(z[0])) - kind.derivative * np.pi / 2.0,
        square=square,
        free_square=not restoring.linear,
        restoring=restoring,
        reach=kind.reach,
        derivative=kind.derivative,
        reference=reference,
    )


def _envelope_rates(time: Array, b: Array) -> tuple[tuple[float, float, float], float]:
    """d, D, Q of the envelope (n,) nearest to b, which begins at about 1, and the root mean square of what is left."""
    found = np.empty_like(b)

    def rest(x: Array) -> Array:
        kernel.envelope(np.ascontiguousarray(x[:3] / time[-1]), time, found)
        return x[3] * found - b

    there = b > 0.05
    last = max(int(np.argmin(there)) if not there.all() else len(b), 3)
    slope = max(float(-np.polyfit(time[:last], np.log(np.maximum(b[:last], 1e-6)), 1)[0]) * time[-1], 1e-2)
    limits = ([0.0, 0.0, 0.0, 0.5], [np.inf, np.inf, np.inf, 2.0])
    starts = ([slope, 1e-3, 1e-3, 1.0], [1e-3, 0.5 * slope, 1e-3, 1.0])
    best = min(
        (scipy.optimize.least_squares(rest, x, bounds=limits, max_nfev=50) for x in starts), key=lambda r: r.cost
    )
    rates = best.x[:3] / time[-1]
    return (float(rates[0]), float(rates[1]), float(rates[2])), float(np.sqrt(2.0 * best.cost / len(b)))
