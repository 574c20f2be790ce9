"""Observations of reaction wheels, thrusters and attitude controllers."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.kernels import attitude, rigid
from evolvent.results.observe.variables import Observed, dot, norm, turned
from evolvent.results.observe.view import View

Array = np.ndarray


def _evaluated(view: View, family: str, name: str, *fields: str) -> dict[str, Array]:
    """Fields of a part's record that the forces leave behind, at every sample."""
    model, index = view.model, view.index(name)
    kept = []
    for k, t in enumerate(view.t):
        rigid.kinematics(float(t), view.y[k], model)
        attitude.actuator_forces(float(t), view.y[k], model)
        row = getattr(model, family)[index]
        kept.append([np.array(row[field], dtype=float) for field in fields])
    return {field: np.array([values[i] for values in kept]) for i, field in enumerate(fields)}


def observe_wheel(view: View, name: str) -> Observed:
    """Angle, rate, torques, momentum and energy of a reaction wheel.

    Notes
    -----
    Momentum and energy are those beyond what the body's inertia has of the wheel: h = J rate n, and
    J rate (rate/2 + n . w).
    """
    found, row = Observed(), view.model.wheels[view.index(name)]
    pose = view.pose(int(row["body"]))
    seen = _evaluated(view, "wheels", name, "motor", "drag")
    rate, inertia = view.y[:, int(row["iv"])], float(row["inertia"])
    n = turned(pose.R, row["axis"])
    found.scalar("angle", view.y[:, int(row["iq"])], "rad", "angle of the wheel relative to its body")
    found.scalar("rate", rate, "rad s-1", "rate of the wheel relative to its body")
    found.scalar("torque", seen["motor"], "N m", "torque of the motor on the wheel")
    found.scalar("friction_torque", -seen["drag"], "N m", "torque of friction on the wheel")
    found.scalar("wheel_momentum", inertia * rate, "kg m2 s-1", "angular momentum relative to the body, about the axis")
    text = "angular momentum relative to the body, inertial axes"
    found.vector("angular_momentum", inertia * rate[:, None] * n, "kg m2 s-1", text)
    energy = inertia * rate * (0.5 * rate + dot(n, pose.w))
    found.scalar("energy_kinetic", energy, "J", "kinetic energy beyond that of the wheel fixed in its body")
    part = view.part(name)
    if part.radius is not None:
        found.drawn = [
            {
                "spool": {
                    "body": part.body, "radius": part.radius, "angle": "angle", "centre": list(part.centre),
                    "axis": [float(c) for c in row["axis"]], "width": 0.3 * part.radius,
                }
            }
        ]  # fmt: skip
    found.plots = ["rate", "torque"]
    return found


def observe_thruster(view: View, name: str) -> Observed:
    """Force and impulse of a thruster."""
    found, row = Observed(), view.model.thrusters[view.index(name)]
    push = _evaluated(view, "thrusters", name, "push")["push"]
    pose = view.pose(int(row["body"]))
    found.scalar("thrust", push, "N", "force of the thruster")
    found.scalar("impulse", view.y[:, int(row["iv"])], "N s", "integral of the thrust since the start")
    found.vector("position", pose.x + turned(pose.R, row["local"]), "m", "position of the thruster, inertial axes")
    force = push[:, None] * turned(pose.R, row["direction"])
    found.vector("force", force, "N", "force on the body, inertial axes")
    found.drawn = [{"forces": {"name": name, "points": "position", "vectors": "force"}}]
    found.plots = ["thrust"]
    return found


def observe_controller(view: View, name: str) -> Observed:
    """Errors of attitude and rate, and the commanded torque of a controller."""
    found = Observed()
    seen: dict[str, Any] = _evaluated(view, "controllers", name, "error", "slip", "torque")
    found.vector("error", seen["error"], "rad", "rotation vector from the target to the body, body axes")
    found.scalar("error_angle", norm(seen["error"]), "rad", "angle between the target and the body")
    found.vector("rate_error", seen["slip"], "rad s-1", "angular velocity relative to the target, body axes")
    found.vector("torque", seen["torque"], "N m", "commanded torque, body axes")
    found.plots = ["error", "torque"]
    return found
