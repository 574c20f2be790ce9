"""Tension cable: a part with its own force law."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from pydantic import field_validator
from pydantic_core import PydanticCustomError

from evolvent import law, parts
from evolvent_base import units


@law
def tension(t, x, v, p, f):
    """Forces on the two ends; p holds stiffness, damping and length without load."""
    dx, dy, dz = x[3] - x[0], x[4] - x[1], x[5] - x[2]
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    extension = length - p[2]
    if extension <= 0.0:
        return 0.0, 0.0
    ex, ey, ez = dx / length, dy / length, dz / length
    rate = ex * (v[3] - v[0]) + ey * (v[4] - v[1]) + ez * (v[5] - v[2])
    elastic = p[0] * extension
    damping = max(p[1] * rate, -elastic)  # the cable never pushes
    force = elastic + damping
    f[0], f[1], f[2] = force * ex, force * ey, force * ez
    f[3], f[4], f[5] = -force * ex, -force * ey, -force * ez
    return 0.5 * elastic * extension, damping * rate


class TensionCable(parts.CustomForce):
    """A massless cable between two points, which pulls where it is longer than without load, and never pushes.

    Parameters
    ----------
    points : list of two points
        Its ends.
    stiffness : float, N/m
        Of the whole cable.
    damping : float, N s/m
        Of the whole cable.
    length : float, m, optional
        Without load; the distance of its ends at the start if left out.
    """

    kind: Literal["tension-cable"] = "tension-cable"
    stiffness: units.Stiffness
    damping: units.DampingOrZero = 0.0
    length: units.Length | None = None

    @field_validator("points")
    @classmethod
    def _two(cls, points: Any) -> Any:
        if len(points) != 2:
            raise PydanticCustomError("points", "it must be a list of two points")
        return points

    def law_and_parameters(self, positions: np.ndarray) -> tuple[Any, Sequence[float]]:
        """The law, and the numbers that it is called with."""
        apart = float(np.linalg.norm(positions[1] - positions[0]))
        return tension, (self.stiffness, self.damping, apart if self.length is None else self.length)
