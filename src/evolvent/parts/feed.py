"""Feed laws: how a spool turns."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from evolvent import laws
from evolvent.builder import Builder
from evolvent.errors import InputError
from evolvent.kernels import feed as kernels
from evolvent.parts.checks import not_negative, number, positive, vector


class FeedRow(NamedTuple):
    """What a feed writes into its thread's row."""

    kind: int
    first: int
    last: int
    law: int = 0
    spool_q: int = -1
    spool_v: int = -1
    inertia: float = 0.0
    torque: float = 0.0


class Feed(Protocol):
    """A law of turning."""

    def write(self, builder: Builder, name: str) -> FeedRow:
        """Store parameters; returns the row's fields."""

    def at(self, builder: Builder, row: FeedRow, time: float) -> tuple[float, float, float]:
        """Angle, rate and acceleration at `time` (rad, rad/s, rad/s2)."""


def _evaluate(builder: Builder, row: FeedRow, time: float) -> tuple[float, float, float]:
    parameters = np.array(builder.values[row.first : row.last])
    angle, rate, acceleration = kernels.feed(row.kind, parameters, row.law, time)
    return float(angle), float(rate), float(acceleration)


@dataclasses.dataclass(frozen=True, kw_only=True)
class RampFeed:
    """Rates that follow one another, each reached by a smooth quintic step.

    Parameters
    ----------
    rate : float, rad/s, at the start
    angle : float, rad, turned at t = 0 (thread already out: angle times radius)
    steps : sequence of (time s, duration s, rate rad/s), in order of time
    """

    rate: float = 0.0
    angle: float = 0.0
    steps: Sequence[tuple[float, float, float]] = ()

    def write(self, builder: Builder, name: str) -> FeedRow:
        """Store the ramps and their corners."""
        flat = [
            not_negative(f"{name}.angle", self.angle),
            number(f"{name}.rate", self.rate),
            float(len(self.steps)),
        ]
        end = -np.inf
        for step in self.steps:
            time, duration, rate = vector(f"{name}.steps", step)
            if time < end:
                raise InputError(f"{name}.steps: the step at {time} s starts before the last one has ended")
            end = time + not_negative(f"{name}.steps duration", duration)
            builder.breaks.update((float(time), float(end)))
            flat += [time, duration, rate]
        return FeedRow(kernels.RAMPS, *builder.parameters(flat))

    def at(self, builder: Builder, row: FeedRow, time: float) -> tuple[float, float, float]:
        """Angle, rate and acceleration."""
        return _evaluate(builder, row, time)


def ConstantFeed(*, rate: float, angle: float = 0.0) -> RampFeed:  # noqa: N802  (reads as a part)
    """A feed of constant rate (rad/s) from an angle (rad) already turned."""
    return RampFeed(rate=rate, angle=angle)


@dataclasses.dataclass(frozen=True, kw_only=True)
class TableFeed:
    """A feed through tabulated values; constant rate before the first and after the last.

    Parameters
    ----------
    time : (k,) float, s, increasing, k >= 2
    rate : (k,) float, rad/s; monotone cubic (PCHIP) between, integrated for the angle
    angle : (k,) float, rad; cubic spline between. One of `rate` and `angle` is given.
    start : float, rad, angle at the first time (with `rate`)
    """

    time: Sequence[float]
    rate: Sequence[float] | None = None
    angle: Sequence[float] | None = None
    start: float = 0.0

    def write(self, builder: Builder, name: str) -> FeedRow:
        """Store the piecewise polynomial."""
        from scipy.interpolate import CubicSpline, PchipInterpolator  # 0.2 s that most runs do not need

        given = self.rate if self.rate is not None else self.angle
        if given is None or (self.rate is not None and self.angle is not None):
            raise InputError(f"{name}: a table needs either rate or angle beside time")
        t, values = np.array(self.time, dtype=float), np.array(given, dtype=float)
        if t.ndim != 1 or t.size < 2 or t.shape != values.shape:
            raise InputError(
                f"{name}: the table has {t.size} times and {values.size} values; it needs two or more of each"
            )
        if not (np.all(np.isfinite(t)) and np.all(np.isfinite(values))):
            row = int(np.flatnonzero(~(np.isfinite(t) & np.isfinite(values)))[0])
            raise InputError(
                f"{name}: row {row + 1} of the table is ({t[row]}, {values[row]}); every value must be finite"
            )
        if not np.all(np.diff(t) > 0.0):
            row = int(np.flatnonzero(np.diff(t) <= 0.0)[0]) + 1
            raise InputError(f"{name}: row {row + 1} of the table is at {t[row]} s, not after the row before")
        if self.rate is not None:
            curve = PchipInterpolator(t, values).antiderivative()
            coefficients = curve.c.copy()
            coefficients[-1] += self.start
        else:
            coefficients = CubicSpline(t, values).c
        full = np.zeros((5, t.size - 1))
        full[5 - coefficients.shape[0] :] = coefficients
        builder.breaks.update(float(x) for x in t)
        return FeedRow(kernels.TABLE, *builder.parameters([t.size, *t, *full.T.ravel()]))

    def at(self, builder: Builder, row: FeedRow, time: float) -> tuple[float, float, float]:
        """Angle, rate and acceleration."""
        return _evaluate(builder, row, time)


@dataclasses.dataclass(frozen=True, kw_only=True)
class LawFeed:
    """A feed by a user's law.

    Parameters
    ----------
    law : function under ``@evolvent.feed_law``: ``law(t, parameters) -> (angle, rate, acceleration)``
    parameters : sequence of float
    """

    law: Any
    parameters: Sequence[float] = ()

    def write(self, builder: Builder, name: str) -> FeedRow:
        """Store the law's address and parameters."""
        first, last = builder.parameters(self.parameters)
        return FeedRow(kernels.LAW, first, last, builder.law(self.law, "feed"))

    def at(self, builder: Builder, row: FeedRow, time: float) -> tuple[float, float, float]:
        """Angle, rate and acceleration; refused unless finite."""
        angle, rate, acceleration = laws.try_law(self.law, time, np.array(builder.values[row.first : row.last]))
        return angle, rate, acceleration


@dataclasses.dataclass(frozen=True, kw_only=True)
class FreeSpool:
    """A spool that the thread's tension turns, against or with a constant torque.

    Parameters
    ----------
    inertia : float, kg m2, of the empty spool (wound thread that is carried comes on top)
    torque : float, N m, of a motor (positive, pays out) or a brake that slips (negative)
    angle, rate : float, rad and rad/s, at the start
    """

    inertia: float
    torque: float = 0.0
    angle: float = 0.0
    rate: float = 0.0

    def write(self, builder: Builder, name: str) -> FeedRow:
        """Reserve the spool's angle and rate as coordinates."""
        inertia = positive(f"{name}.inertia", self.inertia)
        angle = not_negative(f"{name}.angle", self.angle)
        q, v = builder.coordinates([angle], [number(f"{name}.rate", self.rate)])
        return FeedRow(kernels.FREE, 0, 0, 0, q, v, inertia, number(f"{name}.torque", self.torque))

    def at(self, builder: Builder, row: FeedRow, time: float) -> tuple[float, float, float]:
        """Angle and rate at the start."""
        return self.angle, self.rate, 0.0
