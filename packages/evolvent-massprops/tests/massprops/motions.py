"""Motions of bodies on stands, many at a time, by equations of their own: nothing here is part of what it checks.

Pendulums: I(theta) theta'' + I'(theta) theta'^2 / 2 = M(theta) - c theta' - q theta' |theta'| - dry sign(theta'), with
sin(theta) of a pivot and the lift of a body on wires. Springs: Newton and Euler in full geometry.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

Array = np.ndarray
GRAVITY = 9.80665
#: Angle of the fastest motion in a step of RK4: frequencies are then off by its fourth power over 120, 7e-9.
ANGLE = 0.03


@dataclasses.dataclass(frozen=True, kw_only=True)
class Swing:
    """n pendulums; each field is a number or (n,), SI.

    Attributes
    ----------
    kind : "torsion", "bifilar", "trifilar" or "compound"
    inertia : about the axis of rotation, through the centre of mass but for the compound pendulum: about its pivot
    mass, distance : of the compound pendulum; `mass` also of what hangs on wires
    length, radius, above : of wires, and from the axis to their ends at the body and above
    stiffness : N m/rad of a torsion wire
    viscous, drag, dry : c, q and the moment of dry friction
    """

    kind: str
    inertia: Any
    mass: Any = 0.0
    distance: Any = 0.0
    length: Any = 1.0
    radius: Any = 0.0
    above: Any = 0.0
    stiffness: Any = 0.0
    viscous: Any = 0.0
    drag: Any = 0.0
    dry: Any = 0.0

    def restoring(self, theta: Array) -> tuple[Array, Array, Array]:
        """Moment, inertia and half the inertia's derivative at an angle."""
        if self.kind == "torsion":
            return -self.stiffness * theta, self.inertia + 0.0 * theta, 0.0 * theta
        if self.kind == "compound":
            return -self.mass * GRAVITY * self.distance * np.sin(theta), self.inertia + 0.0 * theta, 0.0 * theta
        product = self.radius * self.above
        H = np.sqrt(self.length**2 - self.radius**2 - self.above**2 + 2.0 * product * np.cos(theta))
        first = -product * np.sin(theta) / H
        second = -(product * np.cos(theta) + first**2) / H
        return self.mass * GRAVITY * first, self.inertia + self.mass * first**2, self.mass * first * second

    @property
    def gain(self) -> Array:
        """Restoring moment a radian of a small swing."""
        tiny = 1e-6
        return -self.restoring(np.broadcast_to(tiny, np.shape(self.inertia)))[0] / tiny

    @property
    def frequency(self) -> Array:
        """rad/s, of a small swing without damping."""
        return np.sqrt(self.gain / self.inertia)

    def acceleration(self, theta: Array, rate: Array, sign: Array) -> Array:
        """rad/s2, with dry friction against `sign`."""
        moment, inertia, slope = self.restoring(theta)
        moment = moment - self.viscous * rate - self.drag * rate * np.abs(rate) - self.dry * sign
        return (moment - slope * rate**2) / inertia

    def part(self, rows: Array) -> Swing:
        """Some of the pendulums."""
        full = {
            f.name: np.broadcast_to(getattr(self, f.name), np.shape(self.inertia))[rows]
            for f in dataclasses.fields(self)
            if f.name != "kind"
        }
        return Swing(kind=self.kind, **full)


@dataclasses.dataclass(frozen=True)
class Path:
    """Values (k, n, c) and rates of n motions on grids of their own steps (n,), s."""

    step: Array
    value: Array
    rate: Array

    def at(self, which: int, time: Array) -> Array:
        """(N, c) of one motion at any times, by cubic Hermite interpolation."""
        h = float(self.step[which])
        k = np.clip((time / h).astype(int), 0, len(self.value) - 2)
        s = (time / h - k)[:, None]
        x, v = self.value[:, which], h * self.rate[:, which]
        a, b, c, d = x[k], v[k], x[k + 1], v[k + 1]
        return (1 + 2 * s) * (1 - s) ** 2 * a + s * (1 - s) ** 2 * b + s * s * (3 - 2 * s) * c + s * s * (s - 1) * d


def swung(swing: Swing, theta: Array, rate: Array, duration: Array) -> Path:
    """Motions from n states; where dry friction turns over, steps end, and where it holds the body, it rests."""
    n = len(theta)
    h = ANGLE / np.broadcast_to(swing.frequency, (n,))
    count = int(np.ceil((duration / h).max())) + 2
    y, v = np.array(theta, dtype=float), np.array(rate, dtype=float)
    sign = np.where(v != 0.0, np.sign(v), -np.sign(y))
    rests = np.zeros(n, dtype=bool)
    values, rates = np.empty((count, n)), np.empty((count, n))
    is_dry = bool(np.any(np.asarray(swing.dry) > 0.0))
    for k in range(count):
        values[k], rates[k] = y, v
        new, speed = _step(swing, y, v, h, sign)
        if is_dry:
            turned = np.flatnonzero((speed * sign < 0.0) & ~rests)
            if turned.size:
                some = swing.part(turned)
                new[turned], speed[turned], rests[turned] = _turned(some, y[turned], v[turned], h[turned], sign[turned])
                sign[turned] *= -1.0
            new[rests], speed[rests] = np.where(rates[k] == 0.0, y, new)[rests], 0.0
        y, v = new, speed
    return Path(h, values[..., None], rates[..., None])


def _turned(swing: Swing, y: Array, v: Array, h: Array, sign: Array) -> tuple[Array, Array, Array]:
    """States after a step in which the motion comes to a stop, and whether friction holds it there."""
    part = h * v / (v - _step(swing, y, v, h, sign)[1])
    for _ in range(8):
        at, speed = _step(swing, y, v, part, sign)
        part = np.clip(part - speed / swing.acceleration(at, speed, sign), 0.0, h)
    at, _ = _step(swing, y, v, part, sign)
    held = np.abs(swing.restoring(at)[0]) <= swing.dry
    after, speed = _step(swing, at, np.zeros_like(v), h - part, -sign)
    return np.where(held, at, after), np.where(held, 0.0, speed), held


def _step(swing: Swing, y: Array, v: Array, h: Array, sign: Array) -> tuple[Array, Array]:
    """RK4."""
    a1 = swing.acceleration(y, v, sign)
    v2 = v + 0.5 * h * a1
    a2 = swing.acceleration(y + 0.5 * h * v, v2, sign)
    v3 = v + 0.5 * h * a2
    a3 = swing.acceleration(y + 0.5 * h * v2, v3, sign)
    v4 = v + h * a3
    a4 = swing.acceleration(y + h * v3, v4, sign)
    return y + h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4), v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)


# ------------------------------------------------------------------------------------------------ springs


@dataclasses.dataclass(frozen=True, kw_only=True)
class Hanging:
    """n bodies on the same hanging springs; y up.

    Attributes
    ----------
    points : (s, 3) m, of the springs' ends on the body, from the stiffness centre
    stiffness, length : N/m and m, of every spring
    mass, centre, inertia : (n,) kg, (n, 3) m, (n, 3) kg m2 about the body's axes
    viscous, drag, dry : of every spring along its axis, N s/m, N s2/m2 and N
    slip : m/s, speed above which dry friction has nine tenths of its value
    """

    points: Array
    stiffness: float
    length: float
    mass: Array
    centre: Array
    inertia: Array
    viscous: Any = 0.0
    drag: Any = 0.0
    dry: Any = 0.0
    slip: Any = 1.0

    @property
    def arms(self) -> Array:
        """(n, s, 3) of the springs' ends from the centre of mass, body axes."""
        return self.points - self.centre[:, None]

    def rate(self, x: Array) -> Array:
        """Derivative of the states (n, 13): position, quaternion, velocity, angular velocity in body axes."""
        q = x[:, 3:7] / np.sqrt(np.sum(x[:, 3:7] ** 2, axis=1))[:, None]
        R, w = rotation(q), x[:, 10:]
        r = self.arms @ np.swapaxes(R, 1, 2)
        turn = np.einsum("nij,nj->ni", R, w)
        d = x[:, None, :3] + r - (self.points + np.array([0.0, self.length, 0.0]))
        size = np.sqrt(np.sum(d * d, axis=2))
        e = d / size[..., None]
        speed = np.sum((x[:, None, 7:10] + cross(turn[:, None], r)) * e, axis=2)
        pull = self.stiffness * (size - self.length) + self._column(self.viscous) * speed
        pull = pull + self._column(self.drag) * speed * np.abs(speed)
        if np.any(np.asarray(self.dry) > 0.0):
            pull = pull + self._column(self.dry) * np.tanh(1.4722 * speed / self._column(self.slip))
        f = -pull[..., None] * e
        force = f.sum(axis=1)
        force[:, 1] -= self.mass * GRAVITY
        moment = np.einsum("nji,nj->ni", R, cross(r, f).sum(axis=1))
        y = np.empty_like(x)
        y[:, :3] = x[:, 7:10]
        y[:, 3] = -0.5 * np.sum(q[:, 1:] * w, axis=1)
        y[:, 4:7] = 0.5 * (q[:, :1] * w + cross(q[:, 1:], w))
        y[:, 7:10] = force / self.mass[:, None]
        y[:, 10:] = (moment - cross(w, self.inertia * w)) / self.inertia
        return y

    def _column(self, value: Any) -> Array:
        return np.broadcast_to(value, (len(self.mass),))[:, None]

    def rest(self) -> Array:
        """(n, 13) states of equilibrium, by Newton's method with central differences."""
        n = len(self.mass)
        x = np.zeros((n, 13))
        x[:, :3], x[:, 3] = self.centre, 1.0
        x[:, 1] -= self.mass * GRAVITY / (len(self.points) * self.stiffness)
        still = dataclasses.replace(self, viscous=0.0, drag=0.0, dry=0.0)
        for _ in range(30):
            J = np.empty((n, 6, 6))
            for k in range(6):
                d = np.zeros((n, 6))
                d[:, k] = 1e-5
                J[:, :, k] = (still.rate(moved(x, d))[:, 7:] - still.rate(moved(x, -d))[:, 7:]) / 2e-5
            x = moved(x, -np.linalg.solve(J, still.rate(x)[:, 7:, None])[..., 0])
        return x

    def readings(self, x: Array, sensors: Array, directions: Array) -> tuple[Array, Array]:
        """(n, c) m and m/s, of points (c, 3) on the body along level directions (c, 3)."""
        R = rotation(x[:, 3:7])
        r = (sensors - self.centre[:, None]) @ np.swapaxes(R, 1, 2)
        turn = np.einsum("nij,nj->ni", R, x[:, 10:])
        speed = x[:, None, 7:10] + cross(turn[:, None], r)
        return np.sum((x[:, None, :3] + r) * directions, axis=2), np.sum(speed * directions, axis=2)


def cross(a: Array, b: Array) -> Array:
    """Vector product along the last axis; NumPy's takes several times as long for few vectors."""
    x, y, z = np.moveaxis(a, -1, 0)
    u, v, w = np.moveaxis(b, -1, 0)
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=-1)


def rotation(q: Array) -> Array:
    """(n, 3, 3) body to level axes, of quaternions (n, 4), scalar first."""
    w, x, y, z = q.T
    rows = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def moved(x: Array, d: Array) -> Array:
    """States after a displacement and a turn by a small vector in body axes, d (n, 6)."""
    y = x.copy()
    y[:, :3] += d[:, :3]
    q, half = x[:, 3:7], 0.5 * d[:, 3:]
    y[:, 3] -= np.sum(q[:, 1:] * half, axis=1)
    y[:, 4:7] += q[:, :1] * half + cross(q[:, 1:], half)
    y[:, 3:7] /= np.sqrt(np.sum(y[:, 3:7] ** 2, axis=1))[:, None]
    return y


def shaken(body: Hanging, x: Array, duration: float, fastest: float, sensors: Array, directions: Array) -> Path:
    """Readings of bodies released in states (n, 13)."""
    h = 2.5 * ANGLE / fastest
    count = int(np.ceil(duration / h)) + 2
    values, rates = (np.empty((count, len(x), len(sensors))) for _ in range(2))
    for k in range(count):
        values[k], rates[k] = body.readings(x, sensors, directions)
        k1 = body.rate(x)
        k2 = body.rate(x + 0.5 * h * k1)
        k3 = body.rate(x + 0.5 * h * k2)
        k4 = body.rate(x + h * k3)
        x = x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return Path(np.full(len(x), h), values, rates)


# ------------------------------------------------------------------------------------------------ readings


def coloured(random: np.random.Generator, shape: tuple[int, int], memory: float) -> Array:
    """Noise x_k = memory x_(k-1) + white, (N, c), of unit variance."""
    import scipy.signal

    white = random.standard_normal(shape) * np.sqrt(1.0 - memory**2)
    white[0] /= np.sqrt(1.0 - memory**2)
    return np.asarray(scipy.signal.lfilter([1.0], [1.0, -memory], white, axis=0))


def clipped(read: Callable[[Array], Array], time: Array, limit: Array, corner: float, order: int) -> Array:
    """Readings (N, c) clipped at -limit and limit, then low-pass filtered (Butterworth, corner rad/s) from t = 0."""
    import scipy.signal

    fine = np.linspace(0.0, float(time[-1]), 24 * len(time))
    b, a = scipy.signal.butter(order, corner, fs=2.0 * np.pi / (fine[1] - fine[0]))
    y = scipy.signal.lfilter(b, a, np.clip(read(fine), -limit, limit), axis=0)
    return np.column_stack([np.interp(time, fine, y[:, c]) for c in range(y.shape[1])])
