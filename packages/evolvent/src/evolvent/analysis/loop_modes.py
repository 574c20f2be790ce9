"""Modes of a closed loop of feedback: eigenvalues of the map of the motion from one command to the next.

The map is linear about a steady turn, in which the spools stand still: the motion between samples by central
differences of the integration itself, results that are measured by differences of these, the law by its slopes. Filter,
delay and the spool's rate are states of the map, so that the poles are those of sampled control, without a model of
the delay.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping

import numpy as np

from evolvent.analysis import feedback
from evolvent.analysis.stepping import SteppedAssembly
from evolvent.assembly import families
from evolvent.assembly.assembled import Assembly
from evolvent.kernels import blocks as kinds, rigid
from evolvent.model.registry import asked
from evolvent_base.answer import Answer, Section, Table
from evolvent_base.errors import InputError, RunFailed
from evolvent_base.showing import Answered

Array = np.ndarray
#: Increments of the state, and of a law's variables, relative to their sizes, for central differences.
_STATE, _LAW = 1e-5, 1e-6
#: Parts of the state by which a turn may differ from a steady one.
_STEADY = 1e-4
#: Size of eigenvalues of the map that are round-off: states of the delay.
_NOTHING = 1e-6
#: Change of an eigenvalue of the map by the loop, from which on the mode is one of the loop.
MOVED = 1e-7
#: Relative tolerance of the integration between samples.
_TOLERANCE = 1e-10


@dataclasses.dataclass(frozen=True)
class LoopModes(Answered):
    """Modes of a closed loop that the loop moves; the others are those of the motion without it.

    Attributes
    ----------
    pole : (n,) complex, 1/s, by frequency; of each pair the one above the real axis. Frequencies above pi / period
        appear below it, as in all sampled control
    period : float, s, of samples
    map : (m, m) float, of motion, spool, filters and delay, from one command to the next
    time : float, s, at which the law was taken
    """

    pole: Array
    period: float
    map: Array
    time: float

    @property
    def frequency(self) -> Array:
        """Sizes of the poles, rad/s: (n,)."""
        return np.abs(self.pole)

    @property
    def damping_ratio(self) -> Array:
        """-Re(pole) / |pole|: (n,)."""
        return -self.pole.real / np.maximum(self.frequency, 1e-300)

    @property
    def growth(self) -> float:
        """Largest rate at which a mode grows, 1/s; below zero where all decay."""
        return float(self.pole.real.max())

    def answer(self) -> Answer:
        """Frequencies, damping ratios and growth, a row a mode."""
        rows = [
            (str(k), f"{self.frequency[k]:.6g}", f"{self.damping_ratio[k]:.4g}", f"{pole.real:.3g}")
            for k, pole in enumerate(self.pole)
        ]
        table = Table(heads=("mode", "frequency, rad/s", "damping ratio", "growth, 1/s"), rows=rows)
        return Answer(title="Modes of the closed loop", sections=[Section(title="", blocks=[table])])


def loop_modes(
    assembly: Assembly, *, time: float = 0.0, values: Mapping[str, float] | None = None, count: int = 10
) -> LoopModes:
    """Modes of a system whose spool reacts, about the steady turn at its start.

    Parameters
    ----------
    time : float, s, at which the law's slopes are taken
    values : variables of the law, rates of these, and v, where they are not those of the steady turn
    count : int, how many of the slowest modes

    Raises
    ------
    InputError
        If nothing reacts, more than one spool does, or the start is no steady turn.
    """
    if assembly.relaxations:
        raise InputError(
            f"{next(iter(assembly.relaxations.values()))[0]!r} is viscoelastic, which modes of a closed loop do not "
            f"support; leave its `viscoelastic` out"
        )
    drives = feedback.reels(assembly)
    if len(drives) != 1:
        found = "no spool reacts" if not drives else f"{' and '.join(map(repr, drives))} react"
        raise InputError(f"{found}; modes of a closed loop are those of one drive `feedback`")
    name, drive = next(iter(drives.items()))
    if drive.rate != 0.0:
        raise InputError(f"{name}.drive.rate is {drive.rate:g} rad/s; modes are those of a spool that stands still: 0")
    of = _Plant(assembly, drive.sensor.period)
    loop = of.loop
    late, offset = loop.late, loop.offset
    parts = [of.linear(loop.period - offset)] + ([of.linear(offset)] if offset > 0.0 else [])
    C, at_rest = of.outputs()
    K = _slopes(loop, time, at_rest, drive.angle, dict(values or {}))
    A, opened = (_map(parts, C, slopes, late, loop) for slopes in (K, 0.0 * K))
    z, own = np.linalg.eigvals(A), np.linalg.eigvals(opened)
    moved = np.abs(z[:, None] - own).min(axis=1) > MOVED
    poles = np.log(z[moved & (np.abs(z) > _NOTHING)].astype(complex)) / loop.period
    poles = poles[poles.imag >= 0.0]
    poles = poles[np.argsort(np.abs(poles), kind="stable")][:count]
    return LoopModes(poles, loop.period, A, time)


def _slopes(loop: feedback.Loop, time: float, at_rest: Array, angle: float, values: dict[str, float]) -> Array:
    """Slopes of the law by angle, rate, variables and their rates: (2 + 2 k,)."""
    names = loop.drive.names
    point = dict(zip(names, [time, angle, 0.0, *at_rest, *np.zeros(at_rest.size)], strict=True))
    for key in values:
        if key not in names:
            raise InputError(f"values has {key!r}; known: {', '.join(names)}")
    point |= values
    x = np.array([point[name] for name in names])

    def law(x: Array) -> float:
        return loop.law(x[0], x[1], x[2], x[3:])

    found = []
    for k in range(1, x.size):
        d = np.zeros(x.size)
        d[k] = _LAW * max(abs(x[k]), 1e-2)
        found.append((law(x + d) - law(x - d)) / (2.0 * d[k]))
    if not np.all(np.isfinite(found)):
        raise InputError(f"{loop.name}.drive.law has no finite slopes at {point}")
    return np.array(found)


def _map(parts: list[Array], C: Array, K: Array, late: int, loop: feedback.Loop) -> Array:
    """The map from a command to the next one, of motion, angle and rate, and of values and rates of samples on the way.

    Parameters
    ----------
    parts : of the interval up to the sample, and after it: (n + 2, n + 3), of motion, angle, rate, and acceleration
    C : (k, n + 2), variables by motion, angle and rate
    K : slopes of the law by angle, rate, values and rates of variables
    """
    k, n = C.shape[0], C.shape[1]
    share = 1.0 if loop.drive.sensor.filter == 0.0 else -math.expm1(-loop.period / loop.drive.sensor.filter)
    size = n + 2 * k * (late + 1)
    columns = []
    for x in np.eye(size):
        motion, queue = x[:n], x[n:].reshape(late + 1, 2 * k)  # the newest sample first
        command = K[:2] @ motion[n - 2 :] + K[2:] @ queue[late]
        a = (command - motion[n - 1]) / loop.period
        motion = parts[0] @ np.append(motion, a)
        filtered = queue[0, :k] + share * (C @ motion - queue[0, :k])
        newest = np.append(filtered, (filtered - queue[0, :k]) / loop.period)
        for part in parts[1:]:
            motion = part @ np.append(motion, a)
        columns.append(np.concatenate([motion, newest, queue[:late].ravel()]))
    return np.array(columns).T


class _Plant:
    """The motion between samples about a steady turn, in axes that turn with it."""

    def __init__(self, assembly: Assembly, period: float) -> None:
        method = "dopri5" if all(families.suit_adaptive_steps(assembly.model)) else "rk4"
        self.stepper = SteppedAssembly(
            assembly, method=method, start=0.0, until=8.0 * period, tolerance=_TOLERANCE,
            absolute_tolerance=1e-2 * _TOLERANCE,
        )  # fmt: skip
        self.loop = self.stepper.loops[0]
        self.y0, self.s0 = assembly.y.copy(), assembly.s.copy()
        self.model = self.stepper.assembly.model
        self.n_q, self.n_v = int(self.model.info.nq), int(self.model.info.nv)
        self.axis, self.centre, self.turn = self._turning()
        self.basis, self.read = self._coordinates()

    def _turning(self) -> tuple[Array, Array, float]:
        """Axis, a point on it, and rate of the steady turn of the spool's body."""
        self.stepper.place(self.y0)
        row = self.model.bodies[int(self.loop.record(self.model)["body"][0])]
        rate = float(np.linalg.norm(row["w"]))
        if rate == 0.0:
            return np.array([0.0, 0.0, 1.0]), np.zeros(3), 0.0
        centre = row["x"] + np.cross(row["w"], row["v"]) / rate**2 if row["motion"] == rigid.FREE else row["x"]
        return row["w"] / rate, np.asarray(centre, dtype=float).copy(), rate

    def _coordinates(self) -> tuple[Array, Array]:
        """Directions of the state that are free, as columns (ny, n), and what reads their parts of a state (n, ny)."""
        model, found, ways = self.model, [], self._ways()
        for row, off in zip(model.blocks, kinds.idle(model, self.s0), strict=True):
            if off:
                continue
            q, v, kind = int(row["iq"]), int(row["iv"]), int(row["kind"])
            if kind not in (kinds.POSITION, kinds.ANGLE, kinds.SCALAR) or model.info.slender > 0:
                raise InputError("modes of a closed loop are those of threads on a body that turns about an axis")
            own = np.eye(int(row["count"]))
            fixed = q in ways
            if fixed:  # directions, whose length stays
                along = self.y0[q : q + 3]
                own = np.linalg.svd(along[None])[2][1:]
            for d in own:
                moved, faster = np.zeros(self.y0.size), np.zeros(self.y0.size)
                moved[q : q + d.size], faster[v : v + d.size] = d, d
                if fixed:  # the rate of a direction stays across it
                    moved[v : v + 3] -= (d @ self.y0[v : v + 3]) * along
                found += [moved, faster]
        basis = np.array(found).T
        return basis, np.linalg.pinv(basis)

    def _ways(self) -> set[int]:
        """First indices of coordinates that are directions."""
        return {int(q) for directions in asked("state.directions").values() for q in directions(self.model)}

    def _back(self, y: Array, angle: float) -> Array:
        """A state turned back by an angle about the axis; angles of bodies stay."""
        c, s, u = math.cos(angle), math.sin(angle), self.axis
        cross = np.array([[0.0, -u[2], u[1]], [u[2], 0.0, -u[0]], [-u[1], u[0], 0.0]])
        R = c * np.eye(3) + s * cross + (1.0 - c) * np.outer(u, u)
        found, ways = y.copy(), self._ways()
        for row in self.model.blocks:
            if row["kind"] == kinds.POSITION:
                q, v = int(row["iq"]), int(row["iv"])
                centre = 0.0 if q in ways else self.centre
                found[q : q + 3] = R.T @ (y[q : q + 3] - centre) + centre
                found[v : v + 3] = R.T @ y[v : v + 3]
        return found

    def _moved(self, y: Array, angle: float, rate: float, acceleration: float, length: float) -> Array:
        """The state after `length` s, turned back, of a spool at an angle, a rate and an acceleration at first."""
        loop, after = self.loop, rate + acceleration * length
        end = loop.start + (loop.offset or loop.period)
        piece = feedback.Command(loop.start, angle, rate, rate + acceleration * (end - loop.start))
        if length > end - loop.start:  # the piece of the table is the shorter part
            piece = feedback.Command(loop.start, angle, rate, after)
            end = loop.start + length
        loop.write(self.stepper, piece, end)
        try:
            found = self.stepper.moved(y, self.s0, length)
        except RunFailed as error:
            raise InputError(
                f"the motion beside the steady turn cannot be followed: {error}; a spool that stands at {angle:g} rad "
                "just where a node of its thread is released or wound has no modes there: give it another angle"
            ) from None
        return self._back(found, self.turn * length)

    def linear(self, length: float) -> Array:
        """Derivatives of motion, angle and rate after `length` s by these and the acceleration: (n + 2, n + 3)."""
        angle, n = self.loop.drive.angle, self.basis.shape[1]
        still = self._moved(self.y0, angle, 0.0, 0.0, length)
        change = still - self.y0
        change[[int(row["iq"]) for row in self.model.blocks if row["kind"] in (kinds.ANGLE, kinds.SCALAR)]] = 0.0
        off, size = float(np.abs(self.read @ change).max()), float(np.abs(self.y0).max())
        if not off <= _STEADY * size:
            raise InputError(
                f"the start is no steady turn: it changes by {off:.2g} in {length:g} s; modes of a closed loop are "
                f"those about a thread that is straight along its pay-out axis, on a body that turns steadily"
            )
        columns = []
        for k in range(n + 3):
            d = _STATE * (1.0 if k < n else max(self.turn, 1e-2))
            ends = []
            for sign in (1.0, -1.0):
                y, own_angle, rate, acceleration = self.y0, angle, 0.0, 0.0
                if k < n:
                    y = y + sign * d * self.basis[:, k]
                elif k == n:
                    own_angle += sign * d
                elif k == n + 1:
                    rate = sign * d
                else:
                    acceleration = sign * d
                ends.append(self._moved(y, own_angle, rate, acceleration, length))
            columns.append(self.read @ (ends[0] - ends[1]) / (2.0 * d))
        found = np.zeros((n + 2, n + 3))
        found[:n] = np.array(columns).T
        found[n, n:] = 1.0, length, 0.5 * length**2
        found[n + 1, n + 1 :] = 1.0, length
        return found

    def outputs(self) -> tuple[Array, Array]:
        """Variables by motion, angle and rate of the spool, (k, n + 2), and their values in the steady turn, (k,)."""
        angle, n = self.loop.drive.angle, self.basis.shape[1]
        end = self.loop.start + (self.loop.offset or self.loop.period)

        def seen(y: Array, at: float, rate: float) -> Array:
            self.loop.write(self.stepper, feedback.Command(self.loop.start, at, rate, rate), end)
            self.stepper.place(y)
            values = np.array([self.stepper.value(address) for address in self.loop.addresses])
            return np.where(np.isfinite(values), values, 0.0)

        columns = []
        for k in range(n + 2):
            d, y = _STATE, [self.y0, self.y0]
            if k < n:
                y = [self.y0 + d * self.basis[:, k], self.y0 - d * self.basis[:, k]]
            move = (d if k == n else 0.0, d if k == n + 1 else 0.0)
            plus, minus = seen(y[0], angle + move[0], move[1]), seen(y[1], angle - move[0], -move[1])
            columns.append((plus - minus) / (2.0 * d))
        return np.array(columns).T, seen(self.y0, angle, 0.0)
