"""A body with four reaction wheels."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent import System, parts

J = np.array((2.0, 3.0, 4.0))
AXES = [(1, 0, 1), (-1, 0, 1), (0, 1, 1), (0, -1, 1)]


def bus(wheels: dict[str, Any] | None = None, control: dict[str, Any] | None = None, **body: Any) -> System:
    """A body of 10 kg with four wheels in a pyramid."""
    system = System()
    system.add(parts.RigidBody(mass=10.0, inertia=tuple(J), **body), "bus")
    names = [
        system.add(
            parts.ReactionWheel(body="bus", axis=axis, inertia=0.05, **{"rate": 10.0 * k} | (wheels or {})), f"w{k}"
        )
        for k, axis in enumerate(AXES)
    ]
    if control is not None:
        system.add(parts.AttitudeController(body="bus", actuators=names, **control), "control")
    return system
