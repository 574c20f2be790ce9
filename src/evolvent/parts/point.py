"""Point mass."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from evolvent.builder import Builder
from evolvent.parts.checks import positive, vector


@dataclasses.dataclass(frozen=True, kw_only=True)
class Point:
    """A point mass, free in three directions.

    Parameters
    ----------
    mass : float, kg
    position, velocity : (3,) float, m and m/s, inertial frame, at the start
    """

    mass: float
    position: Sequence[float] = (0.0, 0.0, 0.0)
    velocity: Sequence[float] = (0.0, 0.0, 0.0)

    def write(self, builder: Builder, name: str) -> None:
        """Write the point into the family `points`."""
        q, v = builder.coordinates(
            list(vector(f"{name}.position", self.position)),
            list(vector(f"{name}.velocity", self.velocity)),
        )
        mass = positive(f"{name}.mass", self.mass)
        index = builder.add("points", iq=q, iv=v, mass=mass, compliance=1.0 / mass)
        builder.names[name] = ("points", index)
