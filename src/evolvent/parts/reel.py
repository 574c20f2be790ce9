"""Reel: a spool at any point of a body, from which one thread pays out."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from evolvent.builder import Builder
from evolvent.errors import InputError
from evolvent.kernels import rigid
from evolvent.parts.checks import positive, unit_vector, vector
from evolvent.parts.drive import DriveKind, FreeSpool


@dataclasses.dataclass(frozen=True, kw_only=True)
class Reel:
    """A spool on a body.

    Parameters
    ----------
    body : str, name of the body that carries it ("ground" for none)
    centre : (3,) float, m, a point of the spool's axis, body axes
    feed_axis : (3,) float, nominal direction in which the thread leaves, body axes (X of the spool's frame)
    spool_axis : (3,) float, axis of the spool, body axes (Y of the spool's frame), across `feed_axis`
    radius : float, m
    feed : one of the feeds of `evolvent.parts`

    Notes
    -----
    The departure point is Q = centre + radius Z with Z = X x Y (Tenenbaum 2014, eqs. 2 and 17).
    """

    body: str
    radius: float
    feed: DriveKind
    centre: Sequence[float] = (0.0, 0.0, 0.0)
    feed_axis: Sequence[float] = (1.0, 0.0, 0.0)
    spool_axis: Sequence[float] = (0.0, 1.0, 0.0)

    def frame(self, name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """X, Y, Z of the spool's frame in body axes."""
        X = unit_vector(f"{name}.feed_axis", self.feed_axis)
        Y = unit_vector(f"{name}.spool_axis", self.spool_axis)
        if abs(X @ Y) > 1e-9:
            raise InputError(f"{name}.feed_axis must be across {name}.spool_axis")
        return X, Y, np.cross(X, Y)

    def write(self, builder: Builder, name: str) -> None:
        """Check the reel; its thread writes the row."""
        index = builder.find(self.body, "bodies")
        positive(f"{name}.radius", self.radius)
        _, Y, _ = self.frame(name)
        centre = vector(f"{name}.centre", self.centre)
        if isinstance(self.feed, FreeSpool):
            row = builder.rows["bodies"][index]
            turns_with = abs(row["axis"] @ Y) > 1e-9 or abs(centre @ Y) > 1e-9
            if row["motion"] == rigid.FREE or (row["motion"] == rigid.SPIN and turns_with):
                raise InputError(f"{name}: a free spool needs a driven body, or one that spins across the spool's axis")
        builder.names[name] = ("reels", -1)
