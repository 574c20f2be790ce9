"""Equations between the measured numbers of a torsion rig and what is asked: moments, lines of the bar, pendulums."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy

from evolvent_massprops.torsion_rig.inputs import Inputs
from evolvent_massprops.torsion_rig.keys import OnRig


class Equation(NamedTuple):
    """One measured quantity that parameters predict.

    Attributes
    ----------
    name : str, of the record
    kind : str, "moment" in the plane, "line", "normal" or "pendulum"
    unit : str
    """

    name: str
    kind: str
    unit: str


def stiffness(y: np.ndarray, inputs: Inputs) -> np.ndarray:
    """Stiffness of the bar, N m/rad, of numbers (..., q).

    Notes
    -----
    k = (m (3 (d/2)^2 + l^2) / 12 + I_fixture) (2 pi / T)^2 / (1 - zeta^2).
    """
    at = inputs.place
    if "stand.stiffness" in at:
        return np.asarray(y[..., at["stand.stiffness"]])
    mass, diameter, length, period, damping = (
        y[..., at[f"rod.{key}"]] for key in ("mass", "diameter", "length", "period", "damping_ratio")
    )
    moment = mass * (0.75 * diameter**2 + length**2) / 12.0 + y[..., at["stand.fixture"]]
    return np.asarray(moment * (2.0 * np.pi / period) ** 2 / (1.0 - damping**2))


def directions(angle: np.ndarray) -> np.ndarray:
    """(..., 3) factors of Ixx, Ixz, Izz in the moment about a line of direction (cos, 0, -sin)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * c, -2.0 * s * c, s * s], axis=-1)


class Moments:
    """Moments about lines in the plane; parameters Ixx, Ixz, Izz, or Ixx of a round body.

    Parameters
    ----------
    given : OnRig
    inputs : Inputs
    """

    #: A stiffness that is off scales all moments alike, so that it does not weigh them against one another.
    shared = False

    def __init__(self, given: OnRig, inputs: Inputs) -> None:
        self.inputs, self.round = inputs, given.body.shape == "round"
        names = [n for n, one in zip(given.names(), given.orientations, strict=False) if one.about == "plane"]
        self.equations = tuple(Equation(n, "moment", "kg m²") for n in names)
        self.parameters = ("Ixx",) if self.round else ("Ixx", "Ixz", "Izz")

    def measured(self, y: np.ndarray) -> np.ndarray:
        """(..., n) moments by the periods, kg m2."""
        return np.stack([_torsion(y, self.inputs, one.name) for one in self.equations], axis=-1)

    def predicted(self, p: np.ndarray, y: np.ndarray) -> np.ndarray:
        """(..., n) moments by the tensor, kg m2."""
        at = self.inputs.place
        if self.round:
            return np.broadcast_to(p, (*np.broadcast_shapes(p.shape[:-1], y.shape[:-1]), len(self.equations)))
        angle = np.stack([y[..., at[f"{e.name}.angle"]] + y[..., at[f"{e.name}.tilt"]] for e in self.equations], -1)
        return np.asarray(np.sum(directions(angle) * p[..., None, :], axis=-1))

    def start(self, y: np.ndarray) -> np.ndarray:
        """(p,) parameters from which to begin."""
        J = self.measured(y)
        return np.full(1, J.mean()) if self.round else np.array([J.mean(), 0.0, J.mean()])


class Centre:
    """Lines of the bar, moments about the normal and pendulums; parameters x, z of the centre of mass, and Iyy.

    Parameters
    ----------
    given : OnRig
    inputs : Inputs
    lines : bool, whether lines are used
    """

    shared = True

    def __init__(self, given: OnRig, inputs: Inputs, *, lines: bool) -> None:
        self.inputs, self.lines = inputs, lines
        names, found = given.names(), []
        for name, one in zip(names, given.orientations, strict=False):
            if one.distance is not None and lines:
                found.append(Equation(name, "line", "m"))
            if one.about == "normal":
                found.append(Equation(name, "normal", "kg m²"))
        found += [Equation(name, "pendulum", "kg m²") for name in names[len(given.orientations) :]]
        self.equations = tuple(found)
        self.swings = any(one.kind != "line" for one in found)
        self.parameters = (*(("x", "z") if lines else ()), *(("Iyy",) if self.swings else ()))

    def measured(self, y: np.ndarray) -> np.ndarray:
        """(..., n) distances, m, and moments about the normal, kg m2; 0 of pendulums."""
        at, rows = self.inputs.place, []
        for one in self.equations:
            if one.kind == "line":
                read = y[..., at[f"{one.name}.distance"]] + y[..., at[f"{one.name}.miss"]]
                rows.append(read - y[..., at["stand.line_offset"]])
            elif one.kind == "normal":
                rows.append(_torsion(y, self.inputs, one.name))
            else:
                rows.append(np.zeros(y.shape[:-1]))
        return np.stack(rows, axis=-1)

    def predicted(self, p: np.ndarray, y: np.ndarray) -> np.ndarray:
        """(..., n) the same by the parameters; of a pendulum Iyy less that by its period."""
        at, rows = self.inputs.place, []
        for one in self.equations:
            if one.kind == "line":
                a = y[..., at[f"{one.name}.angle"]]
                rows.append(p[..., 0] * np.sin(a) + p[..., 1] * np.cos(a))
            elif one.kind == "normal":
                rows.append(p[..., -1] + np.zeros(y.shape[:-1]))
            else:
                rows.append(p[..., -1] - _swing(y, self.inputs, one.name, p))
        return np.stack(rows, axis=-1)

    def start(self, y: np.ndarray) -> np.ndarray:
        """(p,) parameters from which to begin: the point nearest to all lines, and the mean moment there."""
        at, p = self.inputs.place, np.zeros(len(self.parameters))
        if self.lines:
            names = [one.name for one in self.equations if one.kind == "line"]
            a = np.array([y[at[f"{name}.angle"]] for name in names])
            distance = np.array([y[at[f"{name}.distance"]] for name in names])
            p[:2] = np.linalg.lstsq(np.column_stack([np.sin(a), np.cos(a)]), distance, rcond=None)[0]
        if self.swings:
            kinds = np.array([one.kind != "line" for one in self.equations])
            p[-1] = float(np.mean((self.measured(y) - self.predicted(p, y))[kinds]))
        return p


def _torsion(y: np.ndarray, inputs: Inputs, name: str) -> np.ndarray:
    """Moment about the line of the bar, k T^2 (1 - zeta^2) / (2 pi)^2 less that of the fixture, kg m2."""
    at = inputs.place
    period, damping = y[..., at[f"{name}.period"]], y[..., at[f"{name}.damping_ratio"]]
    whole = stiffness(y, inputs) * (period / (2.0 * np.pi)) ** 2 * (1.0 - damping**2)
    return np.asarray((whole - y[..., at["stand.fixture"]]) * (1.0 + y[..., at[f"{name}.moment"]]))


def _swing(y: np.ndarray, inputs: Inputs, name: str, p: np.ndarray) -> np.ndarray:
    """Moment about the centre of mass by the period of a pendulum, m g l / omega^2 - m l^2, kg m2.

    Notes
    -----
    omega of a small swing without damping: 2 pi / (T sqrt(1 - zeta^2)) times 2 K(sin^2(A / 2)) / pi.
    """
    at = inputs.place
    if f"{name}.length" in at:
        length = y[..., at[f"{name}.length"]]
    else:
        length = np.hypot(p[..., 0] - y[..., at[f"{name}.pivot x"]], p[..., 1] - y[..., at[f"{name}.pivot z"]])
    mass, gravity = y[..., at["body.mass"]], y[..., at["stand.gravity"]]
    period, damping = y[..., at[f"{name}.period"]], y[..., at[f"{name}.damping_ratio"]]
    wide = scipy.special.ellipk(np.sin(0.5 * y[..., at[f"{name}.amplitude"]]) ** 2) * 2.0 / np.pi
    omega = 2.0 * np.pi / (period * np.sqrt(1.0 - damping**2)) * wide
    return np.asarray(mass * gravity * length / omega**2 - mass * length**2)
