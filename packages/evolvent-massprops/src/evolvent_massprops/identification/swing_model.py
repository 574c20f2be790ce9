"""Modes and swings fitted to samples: the model and its least squares.

A **swing** is one mode whose decay need not be exponential: x'' + w0^2 G(x) = -2 d x' - mu sgn x' - q x'|x'|,
integrated by `evolvent_massprops.swing`; or, where the waveform is said to be sinusoidal, b(t) cos(w0 t + phase) with
the envelope b' = -(d b + D + Q b^2). All amplitudes at the sensors and all offsets are linear and are projected out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from evolvent_massprops import swing as kernel
from evolvent_massprops.identification.signals import Array, Signal, basis, exponentials, information, noise_of

#: Steps of Levenberg and Marquardt at most; converged where a step changes the weighted sum of squares by less.
MOST_STEPS, TOLERANCE = 40, 1e-5
#: Step of differences, in parts of what the record resolves.
DIFFERENCE = 1e-5
#: Times that the noise is estimated again.
REWEIGHTS = 3


class Restoring(NamedTuple):
    """What turns a body back: w0^2 (sine sin(x) H(0) / H(x) + line x), with the lift's inertia, see `swing`.

    Attributes
    ----------
    sine, line : shares of gravity and of elasticity; their sum is 1
    product, square : 2 P, S of the depth H = sqrt(S + 2 P cos x), m^2; 0 and 1 where there is none
    lift : mass over stiffness, s^2/m^2
    """

    sine: float = 0.0
    line: float = 1.0
    product: float = 0.0
    square: float = 1.0
    lift: float = 0.0

    @property
    def linear(self) -> bool:
        """Whether the frequency does not depend on the amplitude."""
        return self.sine == 0.0


LINEAR, PENDULUM = Restoring(), Restoring(1.0, 0.0)


class Reach(NamedTuple):
    """How far a swing goes, rad, at the first sample.

    Attributes
    ----------
    factor : rad (or rad/s, rad/s^2) in a unit of the sensors; nan where these are no angles
    mean, std : rad, amplitude stated for the mean over the record; nan where none is stated
    """

    factor: float = np.nan
    mean: float = np.nan
    std: float = np.nan


UNKNOWN = Reach()


@dataclass(frozen=True, eq=False)
class Component:
    """A mode of the model and where its parameters stand.

    Attributes
    ----------
    pole : complex, 1/s, of a linear mode; the start of a swing
    rates : (3,) d, D, Q of a swing, 1/s at the first amplitude; None of a linear mode
    law : (3,) bool, which of them are free
    phase : rad
    square : amplitude squared, rad^2, of a swing whose restoring is not linear; an estimate may be below zero
    cube : coefficient of x^3, for the amplitude 1
    sinusoidal : whether its waveform is
    free_square, free_cube : bool
    held : whether no parameter of it is free
    restoring : Restoring
    reach : Reach
    derivative : 0, 1, 2: sensors read x, x', x''
    reference : sensor in which it has the phase
    """

    pole: complex
    rates: tuple[float, float, float] | None = None
    law: tuple[bool, bool, bool] = (True, False, False)
    phase: float = 0.0
    square: float = 1.0
    cube: float = 0.0
    sinusoidal: bool = False
    free_square: bool = False
    free_cube: bool = False
    held: bool = False
    restoring: Restoring = LINEAR
    reach: Reach = UNKNOWN
    derivative: int = 0
    reference: int = 0

    @property
    def is_swing(self) -> bool:
        """Whether it is none of the linear modes."""
        return self.rates is not None

    @property
    def is_exponential(self) -> bool:
        """Whether it decays as a linear mode does."""
        return self.law == (True, False, False) and self.restoring.linear and not self.free_cube

    @property
    def fixed_gain(self) -> bool:
        """Whether its reference sensor reads its angle."""
        return bool(self.is_swing and self.free_square and np.isfinite(self.reach.factor))

    # ------------------------------------------------------------------ parameters

    def values(self) -> Array:
        """Free parameters."""
        if self.held:
            return np.empty(0)
        if self.rates is None:
            return np.array([self.pole.imag, -self.pole.real])
        found = [self.pole.imag, self.phase, *(r for r, free in zip(self.rates, self.law, strict=True) if free)]
        return np.array(found + [self.square] * self.free_square + [self.cube] * self.free_cube)

    def resolution(self, length: float) -> Array:
        """What a record of `length`, s, resolves of each parameter."""
        if self.held:
            return np.empty(0)
        line = 2.0 * np.pi / length
        if self.rates is None:
            return np.array([line, line])
        found = [line, 1.0] + [line] * sum(self.law)
        soft = 16.0 * line / self.pole.imag  # the frequency of a pendulum falls by a sixteenth of the square
        return np.array(found + [min(soft, 1.0)] * self.free_square + [1e-2] * self.free_cube)

    def least(self) -> Array:
        """Bounds of the parameters from below: nothing pushes a swing on, but one that grows exponentially."""
        if self.held:
            return np.empty(0)
        if self.rates is None:
            return np.array([0.0, -np.inf])
        alone = self.law == (True, False, False)
        found = [0.0, -np.inf] + [-np.inf if alone else 0.0] * sum(self.law)
        square = 0.0 if self.fixed_gain else -1.0
        return np.array(found + [square] * self.free_square + [-np.inf] * self.free_cube)

    def moved(self, values: Array) -> Component:
        """The same with other values."""
        if self.held:
            return self
        if self.rates is None:
            return replace(self, pole=complex(-values[1], values[0]))
        rest = list(values[2:])
        d, dry, drag = (float(rest.pop(0)) if free else 0.0 for free in self.law)
        square = float(rest.pop(0)) if self.free_square else self.square
        cube = float(rest.pop(0)) if self.free_cube else self.cube
        return replace(
            self, pole=complex(0.0, values[0]), phase=float(values[1]), rates=(d, dry, drag), square=square, cube=cube
        )

    # ------------------------------------------------------------------ shape

    @property
    def amplitude(self) -> float:
        """At the first sample: rad, or 1 where only the shape matters."""
        return float(np.sqrt(max(abs(self.square), 1e-12))) if not self.restoring.linear else 1.0

    def kernel_parameters(self) -> Array:
        """What `evolvent_massprops.swing.motion` takes."""
        assert self.rates is not None
        w, a = self.pole.imag, self.amplitude
        d, dry, drag = self.rates
        r = self.restoring
        return np.array(
            [
                w, d, dry * a * np.pi * w / 2.0, drag * 3.0 * np.pi / (4.0 * w * a),
                a * np.cos(self.phase), -a * np.sin(self.phase),
                r.sine, r.line, self.cube, r.product, r.square, r.lift, float(self.square < 0.0),
            ]
        )  # fmt: skip

    def motion(self, time: Array) -> Array:
        """(N, 3) x, x' / w0, x'' / w0^2, for the amplitude; sinusoidal ones without the rates of the envelope."""
        out = np.empty((len(time), 3))
        if self.sinusoidal:
            b = self.envelope(time)
            angle = self.pole.imag * time + self.phase
            out[:, 0] = b * np.cos(angle)
            out[:, 1] = -b * np.sin(angle)
            out[:, 2] = -out[:, 0]
        else:
            kernel.motion(self.kernel_parameters(), np.array(time), out)
        return out

    def envelope(self, time: Array) -> Array:
        """(N,) amplitude over that at the first sample, by the rates."""
        b = np.empty(len(time))
        kernel.envelope(np.array(self.rates), np.array(time), b)
        return b

    def columns(self, time: Array) -> Array:
        """(N, 2) what a sensor reads: in phase, and a quarter of a period before; linear modes as `basis`."""
        if self.rates is None:
            E = exponentials(np.array([self.pole]), time)
            return np.column_stack((E.real, -E.imag))
        x = self.motion(time)
        first, second = ((0, 1), (1, 2), (2, 1))[self.derivative]
        scale = self.pole.imag**self.derivative / self.reach.factor if self.fixed_gain else 1.0 / self.amplitude
        return np.ascontiguousarray(x[:, [first, second]] * scale)

    def phasors(self) -> tuple[complex, complex]:
        """Complex amplitudes at the first sample of both columns."""
        if self.rates is None:
            return 1.0, 1j
        z = np.exp(1j * self.phase)
        scale = self.amplitude * self.pole.imag**self.derivative / self.reach.factor if self.fixed_gain else 1.0
        first, second = ((1.0, 1j), (1j, -1.0), (-1.0, 1j))[self.derivative]
        return complex(first * z * scale), complex(second * z * scale)


class Solution(NamedTuple):
    """The model at some parameters, linear ones fitted.

    Attributes
    ----------
    components : Component each
    coefficients : (2 m + 1 + degree, c); 0 for those left out, 1 for a gain that is fixed
    residual : (N, c) NaN where a sample is missing
    penalty : (p,) stated amplitudes less those of the model, in standard deviations
    """

    components: tuple[Component, ...]
    coefficients: Array
    residual: Array
    penalty: Array


class Found(NamedTuple):
    """The end of a fit.

    Attributes
    ----------
    solution : Solution
    noise : (c,)
    squares : (c,) of the residual
    unknowns : number of all parameters
    steps : int
    converged : bool
    """

    solution: Solution
    noise: Array
    squares: Array
    unknowns: int
    steps: int
    converged: bool

    def bic(self, signal: Signal, colour: Array | float = 1.0) -> float:
        """Bayesian information criterion, see `signals.information`."""
        return information(signal, self.squares, self.unknowns, colour)


def split(components: tuple[Component, ...], values: Array) -> tuple[Component, ...]:
    """The components with the free parameters `values`, (p,), of all of them in turn."""
    found, first = [], 0
    for one in components:
        size = len(one.values())
        found.append(one.moved(values[first : first + size]))
        first += size
    return tuple(found)


def groups(components: tuple[Component, ...], signal: Signal) -> list[tuple[Any, Array, Array]]:
    """Rows, sensors, and columns in use of each group of sensors that share both."""
    found = []
    width = 2 * len(components) + 1 + signal.degree
    for rows, sensors in signal.groups:
        patterns: dict[tuple[int, ...], list[int]] = {}
        for c in sensors.tolist():
            own = tuple(k for k, one in enumerate(components) if one.is_swing and one.reference == c)
            patterns.setdefault(own, []).append(c)
        for own, members in patterns.items():
            used = np.ones(width, dtype=bool)
            used[[2 * k + 1 for k in own]] = False
            used[[2 * k for k in own if components[k].fixed_gain]] = False
            found.append((rows, np.array(members), np.flatnonzero(used)))
    return found


def columns(components: tuple[Component, ...], signal: Signal) -> Array:
    """(N, 2 m + 1 + degree) of all components and the polynomial."""
    return np.hstack([*(one.columns(signal.time) for one in components), basis(np.empty(0, dtype=complex), signal)])


def solve(components: tuple[Component, ...], signal: Signal) -> Solution:
    """The linear parameters that fit best."""
    A = columns(components, signal)
    coefficients = np.zeros((A.shape[1], signal.data.shape[1]))
    for k, one in enumerate(components):
        if one.fixed_gain:
            coefficients[2 * k, one.reference] = 1.0
    residual = np.full(signal.data.shape, np.nan)
    for rows, sensors, used in groups(components, signal):
        B, y = A[rows], signal.data[rows][:, sensors]
        y = y - B @ coefficients[:, sensors]
        Q, R = np.linalg.qr(B[:, used])
        right = Q.T @ y
        coefficients[np.ix_(used, sensors)] = _solved(R, right)
        left = y - Q @ right
        if isinstance(rows, slice):
            residual[:, sensors] = left
        else:
            residual[np.ix_(rows, sensors)] = left
    return Solution(components, coefficients, residual, penalty(components, signal))


def _solved(R: Array, right: Array) -> Array:
    """Solution of R x = right; the shortest of least squares where R is singular."""
    try:
        return np.linalg.solve(R, right)
    except np.linalg.LinAlgError:
        return np.linalg.lstsq(R, right, rcond=None)[0]


def penalty(components: tuple[Component, ...], signal: Signal) -> Array:
    """Stated amplitudes less those of the components, in standard deviations: see `Solution`."""
    found = []
    for one in components:
        if one.is_swing and one.free_square and np.isfinite(one.reach.mean) and not one.fixed_gain:
            mean = one.amplitude * float(one.envelope(signal.time).mean())
            found.append((mean - one.reach.mean) / max(one.reach.std, 1e-4 * one.reach.mean, 1e-6))
    return np.array(found)


def _stacked(solution: Solution, noise: Array) -> Array:
    r = (solution.residual / noise).ravel()
    return np.append(r[np.isfinite(r)], solution.penalty)


def fit(components: tuple[Component, ...], signal: Signal, noise: Array | None = None) -> Found:
    """Least squares from a start, each sensor weighted by its noise, known or estimated again."""
    known = signal.noise
    now = solve(components, signal)
    m, steps, converged = len(components), 0, False
    weight = known if known is not None else noise_of(signal, np.nansum(now.residual**2, axis=0), m, common=3)
    if noise is not None and known is None:
        weight = np.maximum(noise, signal.rounding)
    for _ in range(REWEIGHTS):
        now, taken, converged = _minimise(now, signal, weight)
        steps += taken
        if known is not None:
            break
        before, weight = weight, noise_of(signal, np.nansum(now.residual**2, axis=0), m, common=3)
        if np.ptp(np.log(weight / before)) < 0.02:
            break
    squares = np.nansum(now.residual**2, axis=0)
    own = sum(len(used) * len(sensors) for _, sensors, used in groups(now.components, signal))
    unknowns = sum(len(replace(one, held=False).values()) for one in now.components) + own - len(now.penalty)
    return Found(now, weight, squares, unknowns, steps, converged)


def _minimise(now: Solution, signal: Signal, noise: Array) -> tuple[Solution, int, bool]:
    length = float(signal.time[-1])
    damping = 0.0
    r = _stacked(now, noise)
    cost = float(r @ r)
    if not np.isfinite(cost):
        return now, 0, False
    for step in range(1, MOST_STEPS + 1):
        J = _slopes(now, signal, noise)
        scale = np.sqrt((J**2).sum(axis=0))
        if not np.all(np.isfinite(scale)):
            return now, step, False
        values = np.concatenate([one.values() for one in now.components])
        least = np.concatenate([one.least() for one in now.components])
        scale = np.where(scale > 0.0, scale, 1.0)
        J /= scale
        J[:, (values <= least) & (J.T @ r > 0.0)] = 0.0  # held by their bounds
        R = np.asarray(np.linalg.qr(np.column_stack((J, r)), mode="r"))
        K, g = R[: J.shape[1], : J.shape[1]], -R[: J.shape[1], -1]
        bound = np.concatenate([one.resolution(length) for one in now.components])
        while True:
            stacked = np.vstack((K, np.sqrt(damping) * np.eye(len(g)))) if damping else K
            change = np.linalg.lstsq(stacked, np.append(g, np.zeros(len(stacked) - len(g))), rcond=1e-12)[0]
            gain = float(g @ g - ((K @ change - g) ** 2).sum())
            if gain <= TOLERANCE * max(1.0, 1e-6 * cost):
                return now, step, True
            moved = change / scale
            far = float(np.abs(moved / bound).max())
            moved = moved / max(1.0, 2.0 * far)
            trial = solve(split(now.components, np.maximum(values + moved, least)), signal)
            s = _stacked(trial, noise)
            if len(s) == len(r) and float(s @ s) < cost:
                now, r, cost = trial, s, float(s @ s)
                damping = 0.0 if damping < 1e-3 else damping / 10.0
                break
            if gain <= 1e-9 * cost:
                return now, step, True
            damping = max(10.0 * damping, 1e-3)
            if damping > 1e8:
                return now, step, gain < 1e-3 * cost
    return now, MOST_STEPS, False


def _slopes(now: Solution, signal: Signal, noise: Array) -> Array:
    """(n, p) derivatives of the projected residual, see Notes.

    Notes
    -----
    With A = Q R and the residual r = y - A a of the linear parameters a, a change dA of the columns changes r by
    ``-(1 - Q Q^T) dA a - Q R^-T dA^T r`` (Golub and Pereyra, 1973). dA is that of differences; only the two columns of
    the component whose parameter it is change. So one factorisation of A serves all parameters.
    """
    length, components = float(signal.time[-1]), now.components
    A = columns(components, signal)
    factors = [(*group, *np.linalg.qr(A[group[0]][:, group[2]])) for group in groups(components, signal)]
    found, penalties, seen = [], [], np.isfinite(now.residual)
    for k, one in enumerate(components):
        values, steps = one.values(), DIFFERENCE * one.resolution(length)
        own = slice(2 * k, 2 * k + 2)
        changes = []
        for j, h in enumerate(steps):
            moved = values.copy()
            moved[j] += h
            other = one.moved(moved)
            changes.append((other.columns(signal.time) - A[:, own]) / h)
            if now.penalty.size:
                penalties.append((penalty((*components[:k], other, *components[k + 1 :]), signal) - now.penalty) / h)
        if not changes:
            continue
        D = np.stack(changes, axis=1)  # (N, own parameters, 2)
        slopes = np.full((len(D), len(noise), len(steps)), np.nan)
        for rows, sensors, used, Q, R in factors:
            E, left = D[rows], now.residual[rows][:, sensors]
            direct = (E.reshape(-1, 2) @ now.coefficients[own][:, sensors]).reshape(len(left), -1)
            turned = np.zeros((len(used), len(steps), len(sensors)))
            for place, column in enumerate(used.tolist()):
                if column // 2 == k and column < 2 * len(components):
                    turned[place] = E[:, :, column - 2 * k].T @ left
            inner = Q.T @ direct - _solved(R.T, turned.reshape(len(used), -1))
            change = (Q @ inner - direct).reshape(len(left), len(steps), len(sensors)).transpose(0, 2, 1)
            slopes[rows if isinstance(rows, slice) else np.asarray(rows)[:, np.newaxis], sensors] = change
        slopes /= noise[:, np.newaxis]
        found.append(slopes.reshape(-1, len(steps)) if seen.all() else slopes[seen])
    J = np.hstack(found)
    return np.vstack((J, np.array(penalties).T)) if penalties else J
