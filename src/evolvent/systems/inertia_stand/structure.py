"""The system of a case: body, springs and guides."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from evolvent import parts
from evolvent.motion import rotation_matrices
from evolvent.system import System

if TYPE_CHECKING:
    from evolvent.systems.inertia_stand.prepare import Prepared


def system_of(item: Prepared) -> System:
    """The parts "body", "spring-1" and so on and, of a guided body, "guide-x", "guide-z" and "guide-yaw"."""
    given = item.suspended
    R, rate = rotation_matrices(given.state[3:7]), given.state[10:13]
    if given.guided:  # without what turns the body's x axis out of its plane
        x, y, _ = R[:, 0]
        rate = rate - (y * rate[0] - x * rate[1]) / (x * x + y * y) * np.array([y, -x, 0.0])
    system = System(gravity=given.gravity.tolist())
    body = parts.RigidBody(
        mass=given.mass,
        inertia=given.inertia.tolist(),
        position=given.state[:3].tolist(),
        orientation=given.state[3:7].tolist(),
        velocity=given.state[7:10].tolist(),
        angular_velocity=(R.T @ rate).tolist(),
    )
    system.add(body, "body")
    own = ("stiffness", "damping", "length", "lateral_stiffness", "lateral_damping")
    for k in range(np.size(given.stiffness)):
        numbers = {name: float(getattr(given, name)[k]) for name in own}
        ends = {"a": tuple(given.ground[k]), "b": ("body", tuple(given.attachment[k]))}
        system.add(parts.Spring(**ends, axis=tuple(given.axis[k]), **numbers), f"spring-{k + 1}")
    if given.guided:
        along_x, along_z = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
        system.add(parts.Guide(body="body", direction=along_x), "guide-x")
        system.add(parts.Guide(body="body", direction=along_z), "guide-z")
        system.add(parts.Guide(body="body", direction=along_z, axis=along_x), "guide-yaw")
    return system
