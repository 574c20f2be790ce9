"""Measured numbers of a torsion rig: readings with their uncertainties, and which record each of them belongs to."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from evolvent_massprops.torsion_rig.keys import OnRig, Orientation, Swing
from evolvent_massprops.uncertain import Uncertain

#: Units of inputs by the last part of their keys; metres else.
_UNITS = {
    "mass": "kg", "period": "s", "angle": "rad", "amplitude": "rad", "stiffness": "N m/rad", "fixture": "kg m²",
    "gravity": "m/s²", "damping_ratio": "1", "moment": "1", "tilt": "rad",
}  # fmt: skip
#: What a mounting repeats to, by the last part of its key.
_AGAIN = {"moment": "moment", "tilt": "angle", "miss": "distance"}


class Input(NamedTuple):
    """A measured number.

    Attributes
    ----------
    key : str
    unit : str
    value, std : float, with its standard uncertainty
    own : bool, whether one record alone depends on it
    dof : float, degrees of freedom of the uncertainty
    """

    key: str
    unit: str
    value: float
    std: float
    own: bool
    dof: float = math.inf

    @property
    def label(self) -> str:
        """What tables call it."""
        record, _, last = self.key.rpartition(".")
        return f"{record}, mounted again: {_AGAIN[last]}" if last in _AGAIN else self.key


def of_readings(readings: Sequence[Uncertain]) -> tuple[float, float, float]:
    """Mean of repeated readings, its standard uncertainty, and the degrees of freedom of that.

    Notes
    -----
    The scatter of the mean, s / sqrt(n) with n - 1 degrees of freedom (GUM, 4.2.3), and what is stated for a reading,
    which is taken as common to all of them, add in squares; degrees of freedom by Welch and Satterthwaite.
    """
    values = np.array([one.value for one in readings])
    stated = float(np.mean([one.std**2 for one in readings]))
    if len(values) == 1:
        return float(values[0]), math.sqrt(stated), math.inf
    scatter = float(values.var(ddof=1)) / len(values)
    dof = (scatter + stated) ** 2 / (scatter**2 / (len(values) - 1)) if scatter > 0.0 else math.inf
    return float(values.mean()), math.sqrt(scatter + stated), dof


class Inputs:
    """All numbers of a rig, by key.

    Attributes
    ----------
    listed : list of Input
    place : mapping, key -> number in `listed`
    """

    def __init__(self, given: OnRig) -> None:
        self.listed: list[Input] = []
        self.place: dict[str, int] = {}
        stand, body, names = given.stand, given.body, given.names()
        if stand.rod is not None:
            rod = stand.rod
            for key in ("mass", "diameter", "length", "period"):
                self._add(f"rod.{key}", getattr(rod, key))
            self._add("rod.damping_ratio", (rod.damping_ratio,))
        elif stand.stiffness is not None:
            self._add("stand.stiffness", (stand.stiffness,))
        self._add("stand.fixture", (stand.fixture,))
        if any(one.distance is not None for one in given.orientations):
            self._add("stand.line_offset", (stand.line_offset,))
        if body.mass is not None:
            self._add("body.mass", (body.mass,))
        if given.pendulums:
            self._add("stand.gravity", (stand.gravity,))
        for name, one in zip(names, given.orientations, strict=False):
            self._orientation(name, one, given)
        for name, swing in zip(names[len(given.orientations) :], given.pendulums, strict=True):
            self._swing(name, swing)

    def _orientation(self, name: str, one: Orientation, given: OnRig) -> None:
        self._add(f"{name}.period", one.period, own=True)
        self._add(f"{name}.damping_ratio", (one.damping_ratio,), own=True)
        again = given.stand.remounting
        self._add(f"{name}.moment", (Uncertain(0.0, again.moment),), own=True)
        if one.angle is not None:
            self._add(f"{name}.angle", one.angle, own=True)
            self._add(f"{name}.tilt", (Uncertain(0.0, again.angle),), own=True)
        if one.distance is not None:
            self._add(f"{name}.distance", one.distance, own=True)
            self._add(f"{name}.miss", (Uncertain(0.0, again.distance),), own=True)

    def _swing(self, name: str, swing: Swing) -> None:
        self._add(f"{name}.period", swing.period, own=True)
        self._add(f"{name}.damping_ratio", (swing.damping_ratio,), own=True)
        self._add(f"{name}.amplitude", (swing.amplitude,), own=True)
        if swing.length is not None:
            self._add(f"{name}.length", swing.length, own=True)
        elif swing.pivot is not None:
            for key, value in zip("xz", swing.pivot, strict=True):
                self._add(f"{name}.pivot {key}", (value,), own=True)

    def _add(self, key: str, readings: Sequence[Uncertain], *, own: bool = False) -> None:
        value, std, dof = of_readings(readings)
        self.place[key] = len(self.listed)
        self.listed.append(Input(key, _UNITS.get(key.rpartition(".")[2], "m"), value, std, own, dof))

    @property
    def values(self) -> np.ndarray:
        """(q,) float."""
        return np.array([one.value for one in self.listed])

    @property
    def std(self) -> np.ndarray:
        """(q,) float, standard uncertainties."""
        return np.array([one.std for one in self.listed])

    @property
    def own(self) -> np.ndarray:
        """(q,) bool, whether one record alone depends on it."""
        return np.array([one.own for one in self.listed])
