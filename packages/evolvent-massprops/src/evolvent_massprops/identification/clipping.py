"""Signals that were clipped and then filtered: they hold no flat run, but crests that are lower than their modes'."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from evolvent_massprops.identification.modes import IdentifiedModes
from evolvent_massprops.identification.signals import Array, Signal

#: Modes of this share of a sensor's strongest are its motion; weaker ones may be harmonics that clipping makes.
STRONG = 0.25
#: Levels that are tried, of the largest value of the motion.
LEVELS = np.linspace(0.3, 0.95, 14)
#: Lines of the record within which two modes are taken for one, or for a product of others.
LINES = 1.5
#: Harmonics are looked for above so many times the highest frequency of the motion.
ABOVE = 1.8
#: Degree of the slow changes of the motion that are no harmonics.
SLOW = 6
#: Least reduction of the sum of squares, in variances of the noise; over that by a cubic law; size beside the motion.
GAIN, OVER_CUBIC, SIZE = 60.0, 1.05, 2e-3


class Found(NamedTuple):
    """How well a level explains what the modes of a sensor leave.

    Attributes
    ----------
    level : of the motion, in the sensor's units
    gain : reduction of the sum of squares, in variances of the noise
    cubic : the same by a law of the third power
    size : root mean square of what is explained, over that of the motion
    """

    level: float
    gain: float
    cubic: float
    size: float


def clipped(modes: IdentifiedModes, signal: Signal) -> list[str]:
    """A sentence on each sensor whose crests are cut."""
    found = []
    for c, name in enumerate(signal.names):
        one = look(modes, signal, c)
        if one is not None and one.gain > GAIN and one.gain > OVER_CUBIC * one.cubic and one.size > SIZE:
            found.append(
                f"the crests of {name} are flattened where the swing is above {one.level:.3g}, and not below: it seems "
                "to be clipped before a filter; amplitudes and decay rates are wrong there: measure again with a wider "
                "range, or set signals.start to where the swing is smaller"
            )
    return found


def look(modes: IdentifiedModes, signal: Signal, c: int) -> Found | None:
    """What a hinge at some level explains of one sensor's samples; None where there is nothing to look at.

    Notes
    -----
    Crests that are cut by max(|s| - level, 0), s the motion, leave odd harmonics that die away with the crests above
    the level. They are compared above the modes' own frequencies, by their shape and its slope, which takes a filter's
    delay.
    """
    amplitude = modes.amplitude[:, c]
    strong = np.flatnonzero(amplitude >= STRONG * amplitude.max())
    motion, products = _sorted(modes, strong)
    if not signal.even or not signal.present[:, c].all() or not modes.noise[c] > signal.rounding[c]:
        return None
    low = ABOVE * float(modes.frequency[strong].max())
    count = len(modes.time)
    kept = np.fft.rfftfreq(count, signal.step / (2.0 * np.pi)) > low
    if np.count_nonzero(kept) < 8:
        return None
    parts = modes.parts(modes.time)[:, :, c].T
    x = 2.0 * signal.time / signal.time[-1] - 1.0
    slow = np.polynomial.legendre.legvander(x, SLOW)
    E = np.exp(np.multiply.outer(signal.time, modes.pole[motion]))
    carried = (slow[:, :, None] * E[:, None]).reshape(count, -1)
    Q = np.linalg.qr(np.column_stack([slow, carried.real, carried.imag]))[0]

    def high(x: Array) -> Array:
        lines = np.fft.rfft(x - Q @ (Q.T @ x))[kept]
        return np.concatenate([lines.real, lines.imag])

    s = parts[motion].sum(axis=0)
    others = [k for k in range(modes.order) if k not in products]
    e = high(signal.data[:, c] - modes.offset[c] - modes.drift[c] * signal.time - parts[others].sum(axis=0))
    top = float(np.abs(s).max())
    unit = float(modes.noise[c]) ** 2 * 0.5 * count
    cubic, _ = _explained((s / top) ** 3, e, high)
    best = max(
        (
            (*_explained(np.sign(s) * np.maximum(np.abs(s) / top - level, 0.0), e, high), float(level))
            for level in LEVELS
        ),
    )
    return Found(best[2] * top, best[0] / unit, cubic / unit, best[1] / float(np.linalg.norm(s)))


def _explained(q: Array, e: Array, high: Callable[[Array], Array]) -> tuple[float, float]:
    """Reduction of the sum of squares by a shape and its slope, and the size of what is explained, in samples.

    Both are 0 where crests are higher than the motion.
    """
    X = np.column_stack([high(q), high(np.gradient(q))])
    size = np.sqrt((X**2).sum(axis=0))
    if not np.all(size > 1e-9):
        return 0.0, 0.0
    X = X / size
    found = np.linalg.lstsq(X, e, rcond=None)[0]
    if found[0] >= 0.0:
        return 0.0, 0.0
    gain = float(np.sum((X @ found) ** 2))
    return gain, float(np.sqrt(2.0 * gain / len(q)))


def _sorted(modes: IdentifiedModes, strong: Array) -> tuple[list[int], set[int]]:
    """Modes that are the motion, with those beside them; and weaker ones at odd products of them."""
    w = modes.frequency
    line = 2.0 * np.pi / float(modes.time[-1])
    weak = [k for k in range(modes.order) if k not in strong]
    beside = [k for k in weak if np.any(np.abs(w[strong] - w[k]) < LINES * line)]
    places = [
        abs(w[a] + x * w[b] + y * w[d])
        for a, b, d in itertools.product(strong, strong, strong)
        for x, y in ((1, 1), (1, -1), (-1, -1))
    ]
    places += [5.0 * w[a] for a in strong]
    products = {k for k in weak if k not in beside and any(abs(w[k] - p) < 3.0 * LINES * line for p in places)}
    return [*strong.tolist(), *beside], products
