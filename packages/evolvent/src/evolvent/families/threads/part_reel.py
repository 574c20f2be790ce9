"""Reel: a spool at any point of a body, from which one thread pays out."""

from __future__ import annotations

from typing import Literal

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.parts.base import BodyName, Group, Part, unit
from evolvent.parts.checks import check_rotor
from evolvent.parts.drive import FreeSpool
from evolvent.parts.law import Drive
from evolvent_base import units
from evolvent_base.errors import InputError


class Reel(Part):
    """A spool on a body.

    Parameters
    ----------
    body : str
        Body that carries it, or ground.
    radius : float, m
        Of the spool.
    drive : a drive of `evolvent.parts`
        How the spool turns.
    centre : (3,) float, m
        A point of the spool's axis, body axes.
    payout_axis : (3,) float
        Nominal direction in which the thread leaves, body axes (X of the spool's frame).
    spool_axis : (3,) float
        Axis of the spool, body axes (Y of the spool's frame), across `payout_axis`.

    Notes
    -----
    The departure point is Q = centre + radius Z with Z = X x Y (Tenenbaum 2014, eqs. 2 and 17).
    """

    kind: Literal["reel"] = "reel"
    group = Group.BODIES
    body: BodyName
    radius: units.Length
    drive: Drive
    centre: units.Position = (0.0, 0.0, 0.0)
    payout_axis: units.Direction = (1.0, 0.0, 0.0)
    spool_axis: units.Direction = (0.0, 1.0, 0.0)

    def frame(self, name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """X, Y, Z of the spool's frame in body axes."""
        X, Y = unit(self.payout_axis), unit(self.spool_axis)
        if abs(X @ Y) > 1e-9:
            raise InputError(f"{name}.payout_axis is {self.payout_axis!r}; it must be across {name}.spool_axis")
        return X, Y, np.cross(X, Y)

    def write(self, builder: Builder, name: str) -> None:
        """Check the reel; its thread writes the row."""
        index = builder.find(self.body, "bodies")
        _, Y, _ = self.frame(name)
        if isinstance(self.drive, FreeSpool):
            check_rotor(builder.rows["bodies"][index], Y, self.drive.inertia, f"{name}.drive.inertia", self.body)
        builder.names[name] = ("reels", -1)
