"""The torque of a magnetic field on a body with a magnetic moment."""

from __future__ import annotations

import itertools
from typing import Any, Literal

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.families.loads.part import Load
from evolvent.parts.base import Group, Part, PointReference
from evolvent_base import units
from evolvent_base.errors import InputError

#: The moment m in inertial axes, by the rotation matrix of its body, and m x B.
_MOMENT = [f"(r{row}1*mx + r{row}2*my + r{row}3*mz)" for row in (1, 2, 3)]
_LAW = tuple(f"{_MOMENT[j]}*b{k + 1} - {_MOMENT[k]}*b{j + 1}" for j, k in ((1, 2), (2, 0), (0, 1)))


class MagneticTorque(Part):
    """Torque on a body with a magnetic moment in a uniform magnetic field.

    Parameters
    ----------
    at : str
        The body, or a node of a rod.
    moment : (3,) float, A m^2
        Magnetic moment (of a magnetorquer or a residual dipole), body axes.
    field : (3,) float, T
        Magnetic flux density, inertial axes.
    start : float, s
        When the torque begins.
    until : float, s, optional
        When it ends; never if left out.
    ramp : float, s
        Over which it grows smoothly; in statics it has grown.

    Notes
    -----
    T = m x B, with the potential energy -m . B (Wertz, 1978, Spacecraft Attitude Determination and Control, ch. 17).
    Small oscillations of a body with the moment of inertia J about the field's direction, across it, have the frequency
    sqrt(m B/J).
    """

    kind: Literal["magnetic-torque"] = "magnetic-torque"
    group = Group.LOADS
    at: PointReference
    moment: units.MagneticMoment
    field: units.MagneticField
    start: units.Time = 0.0
    until: units.Time | None = None
    ramp: units.DurationOrZero = 0.0

    def write(self, builder: Builder, name: str) -> None:
        """Write a torque by a law of the attitude (`Load`)."""
        if builder.location(self.at, f"{name}.at").family == "beams":
            raise InputError(
                f"{name}.at is {self.at!r}, a node of a beam, which has no attitude; give a body, or a node of a rod"
            )
        names = ("mx", "my", "mz", "b1", "b2", "b3")
        constants = dict(zip(names, itertools.chain(self.moment, self.field), strict=True))
        times = {"start": self.start, "until": self.until, "ramp": self.ramp}
        Load(at=self.at, type="torque", law=_LAW, constants=constants, **times).write(builder, name)

    def observe(self, view: Any, name: str, found: Any) -> None:
        """Add the moment and its potential energy to the results of a torque."""
        body = view.model.markers["index"][view.model.loads["target"][view.index(name)]]
        moment = view.pose(int(body)).R @ np.array(self.moment)
        found.vector("magnetic_moment", moment, "A m2", "magnetic moment, inertial axes")
        energy = -moment @ np.array(self.field)
        found.scalar("energy_magnetic", energy, "J", "potential energy of the moment in the field, -m . B")
