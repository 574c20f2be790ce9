"""What the measured torque of an arm's record is made of: noise, errors of the measured angle, and terms of a model.

- **Noise**: samples of a torque without correlation have a flat spectrum. Its level where the arm hardly moves says how
  much of it is at lower frequencies, which no model of the motion explains.
- **Errors of the angle** that recur with the angle are seen by their order, the number of periods in a turn of the arm:
  an error of the sensor has the same amplitude at every rate, a ripple of the torque moves the arm by less the faster
  it turns.
- **Terms** of a model of the torque are added one after another, each time the one that lowers the Bayesian
  information criterion most, and tested on motion that they were not fitted to.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
import scipy

from evolvent_base import answer as an
from evolvent_base.figures import Figure, Line, Panel, stacked

Array = np.ndarray
#: Noise is the mean of the spectrum between two of these frequencies, Hz, or above the last, whichever is lower.
QUIET = (10.0, 40.0)
#: Terms are fitted to torques below this frequency, Hz.
BELOW = 8.0
#: Errors of the angle are sought between these frequencies, Hz, at these orders per turn of the arm.
BAND, ORDERS = (6.0, 20.0), np.arange(2.0, 40.5, 0.5)
#: Below this rate friction changes its sign smoothly, rad/s; the arm swings above `SWINGS`, rad/s.
SLOW, SWINGS = 0.05, 1.0
#: More than this difference to the torque of a rigid arm, N m, within `NEAR`, s, is a push.
PUSH, NEAR = 1.0, 0.25
#: Cut-off frequencies of the rate in friction and of the torque that winds up the drive, Hz.
RATE_BELOW, WINDS_BELOW = 10.0, 20.0


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Sampled:
    """A record at even times: (nt,) float each; s, rad and N m."""

    name: str
    time: Array
    angle: Array
    torque: Array

    @staticmethod
    def of(name: str, time: Array, angle: Array, torque: Array) -> Sampled:
        """A record at times that rise, interpolated at even ones."""
        even = np.linspace(0.0, time[-1] - time[0], time.size)
        return Sampled(
            name=name, time=even, angle=np.interp(even, time - time[0], angle),
            torque=np.interp(even, time - time[0], torque),
        )  # fmt: skip

    @property
    def step(self) -> float:
        """Time between samples, s."""
        return float(self.time[1])

    def low(self, values: Array, below: float) -> Array:
        """Values below a frequency, Hz, by a Butterworth filter of order 2, forwards and backwards."""
        b, a = scipy.signal.butter(2, 2.0 * below * self.step)
        return np.asarray(scipy.signal.filtfilt(b, a, values))

    @functools.cached_property
    def slow(self) -> Array:
        """Angle below the half of `BAND`, rad."""
        return self.low(self.angle, BAND[0] / 2.0)

    @functools.cached_property
    def quick(self) -> Array:
        """Angle within `BAND`, rad."""
        return self.band(self.angle)

    def band(self, values: Array) -> Array:
        """Values within `BAND`, by a filter of the same kind."""
        b, a = scipy.signal.butter(2, [2.0 * one * self.step for one in BAND], "band")
        return np.asarray(scipy.signal.filtfilt(b, a, values))

    def within(self, first: float, last: float, edge: float) -> Array:
        """Times from one to another, further than an edge from both: (nt,) bool."""
        return np.asarray((self.time >= first + edge) & (self.time <= min(last, float(self.time[-1])) - edge))

    @functools.cached_property
    def rate(self) -> Array:
        """Rate of the angle below `RATE_BELOW`, rad/s."""
        return np.gradient(self.low(self.angle, RATE_BELOW), self.step)

    def spectrum(self, last: float) -> tuple[Array, Array]:
        """Frequencies, Hz, and power density of the torque until a time, (N m)^2/Hz, by Welch's method."""
        torque = self.torque[self.time <= last]
        found = scipy.signal.welch(torque, 1.0 / self.step, nperseg=min(256, torque.size))
        return np.asarray(found[0]), np.asarray(found[1])

    def noise(self, last: float) -> float:
        """Power density of the torque's noise until a time, (N m)^2/Hz, as if it were white."""
        frequency, density = self.spectrum(last)
        edges = (*QUIET, math.inf)
        return min(
            float(np.mean(density[(frequency >= low) & (frequency < high)])) for low, high in itertools.pairwise(edges)
        )


def rms(values: Array) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


# ------------------------------------------------------------------------------------------------ orders of the angle


@dataclasses.dataclass(frozen=True, kw_only=True)
class Order:
    """Error of an angle that recurs a number of times in a turn.

    Attributes
    ----------
    number : float, periods in a turn
    cosine, sine : float, rad, of the error
    share : float, part of the angle's mean square within `BAND` that it explains
    """

    number: float
    cosine: float
    sine: float
    share: float

    @property
    def amplitude(self) -> float:
        """Amplitude, rad."""
        return math.hypot(self.cosine, self.sine)


def order(record: Sampled, number: float, chosen: Array) -> Order:
    """Error of one order, by the angle within `BAND` at chosen times, (nt,) bool."""
    columns = np.stack([record.band(of(number * record.slow)) for of in (np.cos, np.sin)], axis=1)[chosen]
    values = record.quick[chosen]
    found = np.linalg.lstsq(columns, values, rcond=None)[0]
    share = 1.0 - (rms(values - columns @ found) / rms(values)) ** 2
    return Order(number=number, cosine=float(found[0]), sine=float(found[1]), share=share)


def explains(record: Sampled, one: Order, chosen: Array) -> float:
    """Part of the angle's mean square within `BAND` at chosen times that a known error explains."""
    turned = one.number * record.slow
    error = record.band(one.cosine * np.cos(turned) + one.sine * np.sin(turned))
    return 1.0 - (rms((record.quick - error)[chosen]) / rms(record.quick[chosen])) ** 2


# ------------------------------------------------------------------------------------------------ terms of the torque

#: Terms of every model, then those that may be added; those of the measured torque come last.
RIGID, FRICTION = ("moment of inertia", "weight"), "Coulomb friction"
WINDUP, DELAY = "windup of the drive", "delay of the torque"
OF_TORQUE = (WINDUP, DELAY)


def terms(record: Sampled, number: float) -> dict[str, list[Array]]:
    """Columns of each term, below `BELOW`: (nt,) float each.

    Parameters
    ----------
    number : float, order of errors of the angle and of ripples of the torque
    """

    def low(values: Array) -> Array:
        return record.low(values, BELOW)

    def twice(values: Array) -> Array:
        return np.gradient(np.gradient(low(values), record.step), record.step)

    q, v = record.angle, record.rate
    sign = np.tanh(v / SLOW)
    waves = [of(number * q) for of in (np.cos, np.sin)]
    return {
        RIGID[0]: [twice(q)],
        RIGID[1]: [low(np.sin(q))],
        FRICTION: [low(sign)],
        "viscous friction": [np.gradient(low(q), record.step)],
        "friction by load": [low(np.abs(np.sin(q)) * sign)],
        "Stribeck friction": [low(sign * np.exp(-((v / 0.5) ** 2)))],
        "offset": [np.ones_like(q)],
        "tilt of the axis": [low(np.cos(q))],
        f"torque ripple, order {number:g}": [low(one) for one in waves],
        f"error of the angle, order {number:g}": [twice(one) for one in waves],
        WINDUP: [twice(record.low(record.torque, WINDS_BELOW))],
        DELAY: [np.gradient(low(record.torque), record.step)],
    }


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Model:
    """Torque as a sum of terms.

    Attributes
    ----------
    names : tuple of str
    values : (p,) float, factors of the columns
    criterion : float, Bayesian information criterion
    """

    names: tuple[str, ...]
    values: Array
    criterion: float

    def torque(self, columns: Mapping[str, Sequence[Array]]) -> Array:
        """Torque by the columns of a record, N m: (nt,)."""
        return _stacked(columns, self.names) @ self.values

    def value(self, name: str, columns: Mapping[str, Sequence[Array]]) -> float:
        """Factor of the first column of a term."""
        before = self.names[: self.names.index(name)]
        return float(self.values[sum(len(columns[one]) for one in before)])


def _stacked(columns: Mapping[str, Sequence[Array]], names: Sequence[str]) -> Array:
    return np.stack([column for name in names for column in columns[name]], axis=1)


def fitted(
    columns: Mapping[str, Sequence[Array]], names: Sequence[str], torque: Array, chosen: Array, free: float
) -> Model:
    """Least squares of a torque below `BELOW` at chosen times.

    Parameters
    ----------
    free : float, number of independent values, twice the frequency times the duration
    """
    A = _stacked(columns, names)[chosen]
    values = np.linalg.lstsq(A, torque[chosen], rcond=None)[0]
    left = rms(torque[chosen] - A @ values)
    criterion = 2.0 * free * math.log(left) + values.size * math.log(free)
    return Model(names=tuple(names), values=values, criterion=criterion)


def path(
    columns: Mapping[str, Sequence[Array]], torque: Array, chosen: Array, step: float, without: Sequence[str] = ()
) -> list[Model]:
    """Models with one term more each, from a rigid arm without friction on, as long as the criterion falls.

    Parameters
    ----------
    step : float, s, between samples
    without : sequence of str, terms that are not added
    """
    free = 2.0 * BELOW * float(np.count_nonzero(chosen)) * step
    names = list(RIGID)
    found = [fitted(columns, names, torque, chosen, free)]
    while others := [one for one in columns if one not in names and one not in without]:
        best = min(
            (fitted(columns, [*names, one], torque, chosen, free) for one in others), key=lambda one: one.criterion
        )  # fmt: skip
        if best.criterion >= found[-1].criterion:
            break
        found.append(best)
        names = list(best.names)
    return found


# ------------------------------------------------------------------------------------------------ what is said


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Explained:
    """Tables, figure and notes on the torques of two records.

    Attributes
    ----------
    noise : float, share of the torque of the first record that is noise, below the frequency of the comparison
    paths : mapping, name of a record -> models of growing size that are fitted to it
    best : Model, of the second record, that leaves least of its later swings
    order : Order, of the error of the second record's angle
    """

    tables: tuple[an.Table, ...]
    figure: Figure
    notes: tuple[str, ...]
    noise: float
    paths: Mapping[str, Sequence[Model]]
    best: Model
    order: Order


def explained(first: Sampled, second: Sampled, until: float, below: float) -> Explained | None:
    """What the torque of two records is made of; None where samples are too far apart for it.

    Parameters
    ----------
    first : record that the prediction is fitted to
    second : record that is predicted
    until : float, s, end of the part of the second record to which models are fitted; later swings test them
    below : float, Hz, below which the torques are compared elsewhere
    """
    if max(first.step, second.step) * QUIET[-1] > 0.4:
        return None
    edge = 1.0 / BELOW
    used = {first.name: first.within(0.0, math.inf, edge), second.name: second.within(0.0, until, edge)}
    found = max((order(second, float(one), used[second.name]) for one in ORDERS), key=lambda one: one.share)
    columns = {one.name: terms(one, found.number) for one in (first, second)}
    torque = {one.name: one.low(one.torque, BELOW) for one in (first, second)}
    paths = {
        one.name: path(columns[one.name], torque[one.name], used[one.name], one.step, without)
        for one, without in ((first, OF_TORQUE), (second, ()))
    }
    swings = _swings(second, until, columns[second.name], torque[second.name], used[second.name])

    def left(model: Model, record: Sampled, chosen: Array, cut: float = BELOW) -> float:
        if not chosen.any() or (record is first and set(OF_TORQUE) & set(model.names)):
            return math.nan  # its torque is noise: terms of it would explain noise by itself
        off, whole = model.torque(columns[record.name]) - torque[record.name], torque[record.name]
        if cut < BELOW:
            off, whole = record.low(off, cut), record.low(whole, cut)
        return rms(off[chosen]) / rms(whole[chosen])

    one, two = used[first.name], used[second.name]
    best = min(paths[second.name], key=lambda model: left(model, second, swings if swings.any() else two))
    noisy, quiet = (
        math.sqrt(record.noise(last) * BELOW) / rms(torque[record.name][used[record.name]])
        for record, last in ((first, math.inf), (second, until))
    )
    own = (f"left of {first.name} (noise {100.0 * noisy:.0f} %)", lambda model: left(model, first, one))
    shown = [
        _table(paths[second.name], [
            (f"left of {second.name} (noise {100.0 * quiet:.0f} %)", lambda model: left(model, second, two)),
            (f"below {below:g} Hz", lambda model: left(model, second, two, below)),
            ("left of its later swings", lambda model: left(model, second, swings)),
            own,
        ], f"Torque below {BELOW:g} Hz by terms fitted to {second.name} until the arm stands upright"),
        _table(paths[first.name], [
            own, (f"below {below:g} Hz", lambda model: left(model, first, one, below)),
            (f"left of {second.name}", lambda model: left(model, second, two)),
        ], f"Torque below {BELOW:g} Hz by terms fitted to {first.name}"),
    ]  # fmt: skip
    share = math.sqrt(first.noise(math.inf) * below) / rms(first.low(first.torque, below)[used[first.name]])
    return Explained(
        tables=tuple(shown), figure=_figure(first, second, until, used, columns, torque, best),
        notes=_notes(first, second, share, below, found, used, swings, best, columns), noise=share, paths=paths,
        best=best, order=found,
    )  # fmt: skip


def _swings(record: Sampled, until: float, columns: Mapping[str, Sequence[Array]], torque: Array, used: Array) -> Array:
    """Times after the fitted part at which the arm swings and is not pushed: (nt,) bool."""
    arm = fitted(columns, [*RIGID, FRICTION], torque, used, 1.0)
    pushed = np.abs(arm.torque(columns) - torque) > PUSH
    wide = 2 * round(NEAR / record.step) + 1
    near = np.convolve(pushed, np.ones(wide), "same") > 0.5
    late = record.within(until, math.inf, 1.0 / BELOW)
    return np.asarray(late & (np.abs(record.rate) > SWINGS) & ~near)


def _table(models: Sequence[Model], shares: Sequence[tuple[str, Callable[[Model], float]]], title: str) -> an.Table:
    """Models, a row each, with what they leave."""
    rows = []
    for one, before in zip(models, (None, *models), strict=False):
        added = "nothing" if before is None else f"+ {one.names[-1]}"
        cells = [f"{100.0 * value:.1f} %" if math.isfinite(value) else "-" for value in (of(one) for _, of in shares)]
        rows.append((added, f"{one.criterion:.0f}", *cells))
    heads = ("added to moment of inertia and weight", "criterion", *(name for name, _ in shares))
    return an.Table(heads=heads, rows=rows, title=title)


def _notes(
    first: Sampled, second: Sampled, share: float, below: float, found: Order, used: Mapping[str, Array],
    swings: Array, best: Model, columns: Mapping[str, Mapping[str, Sequence[Array]]],
) -> tuple[str, ...]:  # fmt: skip
    """Sentences on noise, order and the model that is kept."""
    own = order(first, found.number, used[first.name])
    again = f", and {100.0 * explains(second, found, swings):.0f} % of its later swings" if swings.any() else ""
    smooth = first.low(scipy.signal.medfilt(first.torque, 5), BELOW)
    weight = fitted(columns[first.name], RIGID, smooth, used[first.name], 1.0).values[1]
    of = columns[second.name]
    kept = ", ".join(f"{name} {best.value(name, of):.3g}" for name in (*RIGID, FRICTION) if name in best.names)
    sentences = [
        f"noise of the torque of {first.name}: {first.noise(math.inf):.3f} (N m)2/Hz at high frequencies; if it is "
        f"white, {100.0 * share:.0f} % of the torque below {below:g} Hz; without peaks (median of 5 samples) a weight "
        f"of {weight:.1f} N m would be fitted",
        f"angle of {second.name}: an error of {1e3 * found.amplitude:.1f} mrad, {found.number:g} times a turn, "
        f"explains {100.0 * found.share:.0f} % of what is between {BAND[0]:g} and {BAND[1]:g} Hz{again}; {first.name} "
        f"has {1e3 * own.amplitude:.1f} mrad of it",
        f"kept for {second.name}: {', '.join(best.names)} (SI: {kept})",
    ]
    if WINDUP in best.names:
        soft = -best.value(WINDUP, of) / best.value(RIGID[0], of)
        sentences.append(f"windup of the drive: {1e3 * soft:.1f} mrad for 1 N m")
    return tuple(sentences)


def _figure(
    first: Sampled, second: Sampled, until: float, used: Mapping[str, Array],
    columns: Mapping[str, Mapping[str, Sequence[Array]]], torque: Mapping[str, Array], best: Model,
) -> Figure:  # fmt: skip
    """Spectra of the torques, share of the angle by order, and what two models leave of the torque."""
    spectra = [
        Line(x=frequency, y=density, label=name, color=c)
        for c, (name, (frequency, density)) in enumerate(
            ((first.name, first.spectrum(math.inf)), (second.name, second.spectrum(until)))
        )
    ]
    chosen = used[second.name]
    shares = [100.0 * order(second, float(one), chosen).share for one in ORDERS]
    time, measured = second.time[chosen], torque[second.name][chosen]
    rigid = fitted(columns[second.name], [*RIGID, FRICTION], torque[second.name], chosen, 1.0)
    off = [
        Line(x=time, y=measured - model.torque(columns[second.name])[chosen], label=label, color=c)
        for c, (model, label) in enumerate(((rigid, "rigid arm with friction"), (best, "model that is kept")))
    ]
    panels = [
        Panel(x_label="frequency, Hz", y_label="torque, (N m)2/Hz", lines=spectra, log=True),
        Panel(x_label="periods in a turn", y_label="angle explained, %", y_zero=True,
              lines=[Line(x=ORDERS, y=np.array(shares), label="", color=0)]),
        Panel(x_label="time, s", y_label=f"torque left below {BELOW:g} Hz, N m", lines=off),
    ]  # fmt: skip
    return Figure(
        name="driven-arm-torque", title="Motor-driven arm: what its torque is made of", panels=panels,
        height=stacked(len(panels)),
    )  # fmt: skip
