"""Force of a Prony series at a position that is held after a ramp, at several temperatures, and its derivatives."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from evolvent.design.calibration.relaxation.curves import Curve
from evolvent.design.calibration.relaxation.shifts import Shift
from evolvent.elements.viscoelastic import MOST_DECADES

Array = np.ndarray
LN10 = float(np.log(10.0))


class Rows(NamedTuple):
    """Rows of all curves below one another.

    Attributes
    ----------
    time : (n,) float, s since the position is held
    force : (n,) float, in parts of the largest
    ramp : (n,) float, s, length of the ramp before
    curve, level : (n,) int, of which curve, and at which of the temperatures
    merged : (n,) float, how many values each row is the mean of
    """

    time: Array
    force: Array
    ramp: Array
    curve: Array
    level: Array
    merged: Array


def rows_of(curves: Sequence[Curve], levels: Sequence[int], scale: float) -> Rows:
    """Rows of curves.

    Parameters
    ----------
    levels : of each curve, at which of the temperatures it was measured
    scale : float, force that counts as 1
    """
    sizes = [one.times.size for one in curves]
    return Rows(
        time=np.concatenate([one.times for one in curves]),
        force=np.concatenate([one.forces for one in curves]) / scale,
        ramp=np.repeat([one.ramp for one in curves], sizes),
        curve=np.repeat(np.arange(len(curves)), sizes),
        level=np.repeat(levels, sizes),
        merged=np.ones(sum(sizes)),
    )


def thinned(rows: Rows, per_curve: int) -> Rows:
    """Rows of which those near one another in the logarithm of time are replaced by their mean."""
    parts = []
    for k in range(int(rows.curve.max()) + 1):
        own = np.flatnonzero(rows.curve == k)
        time = rows.time[own]
        low = time[time > 0.0].min(initial=np.inf)
        place = np.log(np.maximum(time, 0.5 * low))
        width = (place.max() - place.min()) / per_curve or 1.0
        _, group, count = np.unique(np.floor((place - place.min()) / width), return_inverse=True, return_counts=True)
        mean_time, mean_force = (np.bincount(group, weights=one[own]) / count for one in (rows.time, rows.force))
        first = own[np.unique(group, return_index=True)[1]]
        parts.append(
            Rows(mean_time, mean_force, rows.ramp[first], rows.curve[first], rows.level[first], count.astype(float))
        )
    return Rows(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def decay(time: Array, ramp: Array, tau: Array) -> tuple[Array, Array]:
    """Share of a branch that is left at a time after a ramp, and its derivative by the logarithm of tau.

    Parameters
    ----------
    time, ramp, tau : float arrays that fit one another, s

    Notes
    -----
    e^(-t/tau) (1 - e^(-x))/x with x = ramp/tau, which is e^(-t/tau) without a ramp.
    """
    held = np.exp(-time / tau)
    x = ramp / tau
    slow = np.where(x > 1e-12, -np.expm1(-x) / np.maximum(x, 1e-12), 1.0)
    share = held * slow
    return share, share * (time / tau) + held * np.where(x > 1e-12, slow - np.exp(-x), 0.0)


@dataclasses.dataclass(frozen=True)
class Response:
    """The model.

    Its parameters are what stays and the amplitudes; ln tau (s) of the terms; those of the shift; and, where each curve
    has an instantaneous force of its own, ln of that of each but the first over that of the first.

    Attributes
    ----------
    rows : Rows
    shift : Shift
    terms : int
    curves : int, of how many curves the instantaneous force is a parameter: all but the first, or none
    """

    rows: Rows
    shift: Shift
    terms: int
    curves: int

    @property
    def places(self) -> tuple[slice, slice, slice, slice]:
        """Where parameters stand: amplitudes with what stays first, ln tau, of the shift, of the curves."""
        n, k = self.terms, self.shift.size
        return slice(0, n + 1), slice(n + 1, 2 * n + 1), slice(2 * n + 1, 2 * n + 1 + k), slice(2 * n + 1 + k, None)

    @property
    def size(self) -> int:
        """Number of parameters."""
        return 2 * self.terms + 1 + self.shift.size + self.curves

    def at(self, x: Array) -> tuple[Array, Array]:
        """Forces (n,) and their derivatives (n, p)."""
        amplitudes, times, shifts, curves = (x[place] for place in self.places)
        decades, slopes = self.shift.at(shifts)
        rows = self.rows
        factor = np.exp(LN10 * np.clip(decades, -MOST_DECADES, MOST_DECADES)[rows.level])[:, None]
        share, slope = decay(rows.time[:, None], rows.ramp[:, None], np.exp(times) * factor)
        scale = np.exp(np.concatenate([[0.0], curves]))[rows.curve] if self.curves else np.ones(rows.time.size)
        force = scale * (amplitudes[0] + share @ amplitudes[1:])
        J = np.empty((rows.time.size, self.size))
        of_amplitude, of_time, of_shift, of_curve = self.places
        J[:, of_amplitude] = scale[:, None] * np.column_stack([np.ones(rows.time.size), share])
        J[:, of_time] = scale[:, None] * slope * amplitudes[1:]
        J[:, of_shift] = LN10 * J[:, of_time].sum(axis=1)[:, None] * slopes[rows.level]
        if self.curves:
            J[:, of_curve] = force[:, None] * (rows.curve[:, None] == np.arange(1, self.curves + 1))
        return force, J
