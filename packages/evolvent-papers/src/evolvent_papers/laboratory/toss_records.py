"""Recorded tosses of a cube: what is read, the start by the free flight, the pose at rest, and a robust fit to motions.

Lengths are those of the record. Whatever predicts a motion from a start can be fitted: the cube of this package, and
other programs (`benchmarks/tosses.py`).
"""

from __future__ import annotations

import dataclasses
import functools
import math
import pathlib
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from evolvent_base import progress
from evolvent_base.errors import InputError
from evolvent_papers.laboratory import tables

Array = np.ndarray
HEAD = (
    "time_s", "x_m", "y_m", "z_m", "qw", "qx", "qy", "qz", "vx_m_s", "vy_m_s", "vz_m_s",
    "wx_rad_s", "wy_rad_s", "wz_rad_s",
)  # fmt: skip
#: Half the side of the cube as its maker has it, m.
NOMINAL = 0.0524
#: Height of the lowest corner above the board below which the flight ends, m; least rows of a flight; rows at rest.
NEAR, LEAST_ROWS, LAST = 2e-3, 4, 5
#: Speeds below which the cube rests, m/s and rad/s.
STILL = (0.03, 0.3)
#: Times after the end of the flight at which errors are stated, s.
AFTER = tuple(round(0.02 * k, 2) for k in range(26))
#: Rotation from the recorded pose, rad, and distance, m, up to which a pose at rest is right.
RIGHT = (math.radians(30.0), NOMINAL)


class Start(NamedTuple):
    """A start of a motion.

    Attributes
    ----------
    position, velocity : (3,) float, m and m/s
    pose : Rotation, from the cube's axes to those of the board
    spin : (3,) float, rad/s, axes of the cube
    """

    position: Array
    velocity: Array
    pose: Rotation
    spin: Array

    def moved(self, by: Array) -> Start:
        """A start beside it: displacement (m), velocity, rotation (rad), spin of the cube; (12,) float."""
        turned = self.pose * Rotation.from_rotvec(by[6:9])
        return Start(self.position + by[:3], self.velocity + by[3:6], turned, self.spin + by[9:])


class Motion(NamedTuple):
    """A motion at the times of a record, or at the first of them.

    Attributes
    ----------
    position : (nt, 3) float, m
    pose : Rotation of (nt,)
    """

    position: Array
    pose: Rotation

    def apart(self, other: Motion) -> tuple[Array, Array]:
        """Displacements (m) and rotation vectors (rad) from another motion to this one: (nt, 3) float each."""
        n = min(len(self.position), len(other.position))
        return self.position[:n] - other.position[:n], (other.pose[:n].inv() * self.pose[:n]).as_rotvec()


class Off(NamedTuple):
    """Differences of two motions.

    Attributes
    ----------
    position, rotation : float, m and rad, means of the distance and of the angle over all rows
    position_after, rotation_after : (n,) float, at the times `AFTER`
    right : bool, whether both end in one pose: within `RIGHT`
    """

    position: float
    rotation: float
    position_after: Array
    rotation_after: Array
    right: bool


def difference(motion: Motion, other: Motion, rows: Sequence[int]) -> Off:
    """Differences of two motions, and those of these rows."""
    moved, turned = (np.linalg.norm(one, axis=1) for one in motion.apart(other))
    return Off(
        float(moved.mean()), float(turned.mean()), moved[list(rows)], turned[list(rows)],
        bool(turned[-1] <= RIGHT[0] and moved[-1] <= RIGHT[1]),
    )  # fmt: skip


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Toss:
    """A recorded toss.

    Attributes
    ----------
    name : str
    time : (nt,) float, s, from 0
    recorded : Motion
    velocity, spin : (nt, 3) float, m/s, and rad/s in axes of the cube
    """

    name: str
    time: Array
    recorded: Motion
    velocity: Array
    spin: Array

    @property
    def every(self) -> float:
        """Time between rows, s."""
        return float(self.time[-1]) / (self.time.size - 1)

    @functools.cached_property
    def touch(self) -> int:
        """Number of rows of the free flight, by the size at rest."""
        up = np.abs(self.recorded.pose.as_matrix()[:, 2]).sum(axis=1)
        low = self.recorded.position[:, 2] - self.recorded.position[-LAST:, 2].mean() * up
        near = np.flatnonzero(low < NEAR)
        return int(near[0]) if near.size else self.time.size

    @property
    def rests(self) -> bool:
        """Whether the record ends at rest."""
        last = np.linalg.norm(self.velocity[-1]), np.linalg.norm(self.spin[-1])
        return bool(last[0] < STILL[0] and last[1] < STILL[1])

    @functools.cached_property
    def tilt(self) -> Array:
        """Horizontal part of the normal of the face that lies on the board, at rest: (2,) float, rad."""
        matrix = self.recorded.pose[-LAST:].mean().as_matrix()
        face = int(np.argmax(np.abs(matrix[2])))
        return np.asarray(matrix[:2, face] * np.sign(matrix[2, face]))

    @property
    def height(self) -> float:
        """Height of the centre at rest, m."""
        return float(self.recorded.position[-LAST:, 2].mean())

    @functools.cached_property
    def flight(self) -> tuple[Array, Array]:
        """Equations of gravity and of the centre of mass's offset by the free flight: (3 nt, 4) and (3 nt,) float.

        Without what a straight motion explains: the columns are half the square of the time, downwards, and the axes
        of the cube.
        """
        k = self.touch
        line = np.vander(self.time[:k], 2)
        bent = np.eye(k) - line @ np.linalg.pinv(line)
        columns = np.zeros((3, k, 4))
        columns[2, :, 0] = bent @ (-0.5 * self.time[:k] ** 2)
        columns[:, :, 1:] = np.einsum("ij,jab->aib", bent, self.recorded.pose[:k].as_matrix())
        return columns.reshape(-1, 4), (bent @ self.recorded.position[:k]).T.ravel()

    def start(self, gravity: float, off: Array) -> Start:
        """The start by the free flight: a parabola of the centre of mass of known gravity, and a constant spin.

        Parameters
        ----------
        gravity : float, m/s2
        off : (3,) float, m, from the centre of mass to the recorded point, axes of the cube
        """
        k = self.touch
        line = np.vander(self.time[:k], 2)
        places = self.recorded.position[:k] - self.recorded.pose[:k].apply(off)
        places[:, 2] += 0.5 * gravity * self.time[:k] ** 2
        (velocity, position), *_ = np.linalg.lstsq(line, places, rcond=None)
        first, spin = self.recorded.pose[0], self.spin[0]
        for _ in range(4):  # each removes the products of the rotations that the one before leaves
            turned = first * Rotation.from_rotvec(self.time[:k, None] * spin)
            left = (turned.inv() * self.recorded.pose[:k]).as_rotvec()
            (rate, turn), *_ = np.linalg.lstsq(line, left, rcond=None)
            first, spin = first * Rotation.from_rotvec(turn), spin + rate
        return Start(position, velocity, first, spin)

    def first_row(self, off: Array) -> Start:
        """The start by the first row alone; argument as of `start`."""
        pose, spin = self.recorded.pose[0], self.spin[0]
        place, rate = pose.apply(off), pose.apply(np.cross(spin, off))
        return Start(self.recorded.position[0] - place, self.velocity[0] - rate, pose, spin)

    def flight_noise(self, gravity: float, off: Array) -> tuple[float, float]:
        """Root mean square of positions (m) and of rotations (rad) of the flight about that of the start."""
        k, start = self.touch, self.start(gravity, off)
        t = self.time[:k, None]
        fall, pose = np.array([0.0, 0.0, -0.5 * gravity]), start.pose * Rotation.from_rotvec(t * start.spin)
        flown = Motion(start.position + t * start.velocity + t**2 * fall + pose.apply(off), pose)
        moved, turned = (float(np.sqrt(np.sum(one**2) / (3 * (k - 2)))) for one in self.recorded.apart(flown))
        return moved, turned

    def row_at(self, after: float) -> int:
        """The row `after` s from the last one of the flight, the last of all at most."""
        return min(self.touch - 1 + round(after / self.every), self.time.size - 1)

    def off(self, motion: Motion) -> Off:
        """Differences of a motion from the recorded one."""
        return difference(motion, self.recorded, [self.row_at(after) for after in AFTER])


def tosses_of(folder: str | None, most: int) -> list[Toss]:
    """Tosses of the package, or of a folder with CSV files of the same form.

    Raises
    ------
    InputError
        If the folder has no such file, or one has no free flight or cannot be read.
    """
    files = tables.contents(folder, pathlib.Path(__file__).with_name("data") / "tosses.zip")
    if folder is not None:
        files = tables.having(files, HEAD, folder)
    return [_toss(file, tables.table(file, raw, HEAD)) for file, raw in files[:most]]


def _toss(file: str, values: Array) -> Toss:
    time, size = values[:, 0] - values[0, 0], np.linalg.norm(values[:, 4:8], axis=1)
    steps = np.diff(time)
    if not np.all(steps > 0.0) or steps.max() - steps.min() > 0.05 * steps.mean():
        raise InputError(
            f"{file}: time_s must increase in equal steps; they are {steps.min():.4g} to {steps.max():.4g} s"
        )
    if np.any(np.abs(size - 1.0) > 0.01):
        row = int(np.argmax(np.abs(size - 1.0)))
        raise InputError(f"{file}: qw, qx, qy, qz of row {row + 1} have the norm {size[row]:.4g}; it must be 1")
    pose = Rotation.from_quat(values[:, [5, 6, 7, 4]])
    toss = Toss(
        name=pathlib.Path(file).stem, time=time, recorded=Motion(values[:, 1:4], pose), velocity=values[:, 8:11],
        spin=values[:, 11:14],
    )  # fmt: skip
    if not LEAST_ROWS <= toss.touch < time.size:
        raise InputError(
            f"{file}: {toss.touch} of {time.size} rows are before the first touch; it needs {LEAST_ROWS} of them or "
            f"more, and rows after it"
        )
    return toss


# ------------------------------------------------------------------------------------------------ a robust fit


#: A prediction: of parameters, a toss and the number of rows.
Predict = Callable[[Array, Toss, int], Motion]
#: Difference, m, from which residuals of a fit count less; steps of derivatives; largest change at once.
_SCALE, _STEP, _LARGEST = 5e-3, 0.02, 0.7
_ROUNDS, _ENOUGH = 12, 1e-3


class Fit(NamedTuple):
    """Numbers fitted to tosses.

    Attributes
    ----------
    values : (p,) float
    covariance : (p, p) float
    cost : float, mean over the tosses of the robust squares, in units of `_SCALE`
    sooner : (p,) float, values by the rows up to the first horizon
    """

    values: Array
    covariance: Array
    cost: float
    sooner: Array


def residuals(motion: Motion, toss: Toss) -> Array:
    """Differences after the flight, m: displacements, and rotations times half the side; flat."""
    moved, turned = motion.apart(toss.recorded)
    return np.concatenate([moved[toss.touch :], NOMINAL * turned[toss.touch :]], axis=1).ravel()


def fitted(predict: Predict, start: Array, tosses: Sequence[Toss], horizons: Sequence[float]) -> Fit:
    """Numbers of the order of 1 by robust least squares over the rows up to `horizon` s after the first touch.

    Parameters
    ----------
    predict : function of numbers (p,), toss, number of rows, to a motion
    start : (p,) float
    horizons : sequence of float, s, one after the other: each fit starts from the one before

    Notes
    -----
    Levenberg and Marquardt's method with the loss 2 (sqrt(1 + r^2) - 1) of each residual r over `_SCALE`; each toss
    counts once. The covariance is that of the fit to the first horizon, by the infinitesimal jackknife over tosses:
    H^-1 (sum of g g^T) H^-1 with the gradient g of each toss, which holds without knowing how residuals of a toss are
    correlated. Later rows move too much with their starts for that; what they change in the values is added as d d^T,
    since a model that explained all rows would not change.
    """
    x, covariance, cost, sooner = np.asarray(start, dtype=float), np.zeros((0, 0)), math.inf, np.zeros(0)
    for k, horizon in enumerate(horizons):
        rows = [toss.row_at(horizon) + 1 for toss in tosses]

        def at(x: Array, rows: Sequence[int] = rows) -> list[Array]:
            progress.report("fitting", unit="evaluations")
            return [residuals(predict(x, one, n), one) / _SCALE for one, n in zip(tosses, rows, strict=True)]

        x, now = _least(at, x)
        cost = _cost(now)
        if k == 0:
            sooner, covariance = x, _jackknife(at, x, now)
    return Fit(x, covariance + np.outer(x - sooner, x - sooner), cost, sooner)


def _least(at: Callable[[Array], list[Array]], x: Array) -> tuple[Array, list[Array]]:
    """Numbers of least cost from those of a start, and their residuals."""
    now, damping = at(x), 1e-2
    for _ in range(_ROUNDS):
        normal, gradients = _normal(at, x, now)
        cost, better = _cost(now), None
        for _ in range(6):
            held = normal + damping * np.diag(np.diag(normal)) + 1e-9 * np.trace(normal) * np.eye(x.size)
            change = np.clip(-np.linalg.solve(held, gradients.sum(axis=0)), -_LARGEST, _LARGEST)
            tried = at(x + change)
            if _cost(tried) < cost:
                better, damping = tried, damping / 5.0
                break
            damping *= 6.0
        if better is None:
            break
        x, now = x + change, better
        if cost - _cost(now) < _ENOUGH * cost:
            break
    return x, now


def _jackknife(at: Callable[[Array], list[Array]], x: Array, now: Sequence[Array]) -> Array:
    """Covariance of numbers by the gradients of the tosses: (p, p)."""
    normal, gradients = _normal(at, x, now)
    inverse = np.linalg.pinv(normal, rcond=1e-8, hermitian=True)
    count = len(now)
    return np.asarray(inverse @ (gradients.T @ gradients) @ inverse * count / max(count - x.size, 1))


def _cost(each: Sequence[Array]) -> float:
    return float(np.mean([np.mean(2.0 * (np.sqrt(1.0 + one**2) - 1.0)) for one in each]))


def _normal(at: Callable[[Array], list[Array]], x: Array, now: Sequence[Array]) -> tuple[Array, Array]:
    """Normal matrix (p, p), and the gradient of each toss (n, p)."""
    sides = [at(x + _STEP * one) for one in np.eye(x.size)]
    normal, gradients = np.zeros((x.size, x.size)), []
    for k, r in enumerate(now):
        jacobian = np.column_stack([(side[k] - r) / _STEP for side in sides])
        weight = 1.0 / (np.sqrt(1.0 + r**2) * r.size)
        normal += (jacobian * weight[:, None]).T @ jacobian
        gradients.append((jacobian * weight[:, None]).T @ r)
    return normal, np.array(gradients)
