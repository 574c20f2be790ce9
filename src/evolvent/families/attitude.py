"""Reaction wheels, thrusters and controllers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from evolvent.kernels import rigid
from evolvent.kernels.blocks import RATE, SCALAR
from evolvent.kernels.drive import LAW
from evolvent.kernels.ends import of_bodies
from evolvent.model.family import Family, Kind, Records, record
from evolvent.model.questions import DRIVE, AdjointSupport, Block, Bound, Coordinates, Law, Moment, calls_law, never

Array = np.ndarray
_3 = (3,)


def _at_rotor(model: Any, k: int, moment: Moment, _: bool) -> Iterator[tuple[Any, ...]]:
    row, (time, y, _s) = model.wheels[k], moment
    yield float(y[row["iq"]]), float(y[row["iv"]]), time


def _angles(records: Records, _: Mapping[str, Any]) -> Iterator[Block]:
    for k, wheel in enumerate(records("wheels")):
        yield Block(SCALAR, wheel["iq"], wheel["iv"], k, wheel["inertia"])


def _impulses(records: Records, _: Mapping[str, Any]) -> Iterator[Block]:
    for k, thruster in enumerate(records("thrusters")):
        yield Block(RATE, -1, thruster["iv"], k, 0.0)


def _wheels_bound(model: Any, _: Array, felt: Mapping[str, Array]) -> Iterator[Bound]:
    """Friction; a rotor on a light body counts with the body's share."""
    for k, row in enumerate(model.wheels):
        slope = row["viscous"] + (row["friction"] / row["slip"] if row["friction"] > 0.0 else 0.0)
        n, b = np.array(row["axis"]), int(row["body"])
        J = np.array(model.bodies["inertia"][b])
        left = 1.0 / float(n @ np.linalg.solve(J, n)) - row["inertia"] if np.linalg.det(J) > 0.0 else row["inertia"]
        yield k, 0.0, float(slope * (1.0 / row["inertia"] + 1.0 / left))


def _controllers_bound(model: Any, _: Array, felt: Mapping[str, Array]) -> Iterator[Bound]:
    """Gains are felt by the body."""
    for row in model.controllers:
        b = int(row["body"])
        R = np.array(model.bodies["R"][b])
        for what, gains in enumerate((row["proportional"], row["derivative"])):
            felt["bodies"][what, b, 3:, 3:] += R @ np.diag(gains) @ R.T
    return iter(())


def _sizes(model: Any, _: float) -> Iterator[tuple[Any, Any]]:
    """The angle that turns the body by 1 rad."""
    for wheel in model.wheels:
        body, n = model.bodies[wheel["body"]], wheel["axis"]
        about = n @ body["inertia"] @ n if body["motion"] == rigid.FREE else body["spin_inertia"]
        yield int(wheel["iv"]), max(1.0, float(about / wheel["inertia"]))


# rate and angle of a wheel relative to its body, impulse of a thruster at iv; profile: index among the parameters,
# or -1; actuators of a controller: their kind, and `count` numbers from `place` on, then how they share its torque
WHEELS = Family(
    "wheels",
    record(
        "body iq iv profile law first last",
        "axis inertia torque torque_limit rate_limit viscous friction slip",
        "command motor drag coriolis motor0 drag0 angle rate rubs spin momentum kinetic",
        axis=_3, momentum=_3,
    ),
    order=120,
    results={
        "angle": ("angle", "rad", "angle of the wheel relative to its body"),
        "rate": ("rate", "rad s-1", "rate of the wheel relative to its body"),
        "motor": ("torque", "N m", "torque of the motor on the wheel"),
        "rubs": ("friction_torque", "N m", "torque of friction on the wheel"),
        "spin": ("wheel_momentum", "kg m2 s-1", "angular momentum relative to the body, about the axis"),
        "momentum": ("angular_momentum", "kg m2 s-1", "angular momentum relative to the body, inertial axes"),
        "kinetic": ("energy_kinetic", "J", "kinetic energy beyond that of the wheel fixed in its body"),
    },
    kinds=(
        Kind("a reaction wheel", symmetric=True),
    ),
    ends=of_bodies("body"),
    within=True,
    isolated=lambda found, records: bool(np.all(records("bodies")["motion"][found["body"]] == rigid.FREE)),
    laws=(Law("spring", calls_law, _at_rotor),),
    of_step=False,
    stiff=False,
    adjoint=AdjointSupport("its torque follows from the state and time, with all derivatives"),
    coordinates=(Coordinates(_angles, 60, len, spins=True),),
    bound=_wheels_bound,
    sizes=_sizes,
)  # fmt: skip

THRUSTERS = Family(
    "thrusters",
    record(
        "body iv profile", "local direction force limit", "command push push0 impulse place vector",
        local=_3, direction=_3, place=_3, vector=_3,
    ),
    order=130,
    results={
        "push": ("thrust", "N", "force of the thruster"),
        "impulse": ("impulse", "N s", "integral of the thrust since the start"),
        "place": ("position", "m", "position of the thruster, inertial axes"),
        "vector": ("force", "N", "force on the body, inertial axes"),
    },
    kinds=(
        Kind("a thruster"),
    ),
    of_step=False,
    stiff=False,
    adjoint=AdjointSupport("its force follows from the attitude and time"),
    coordinates=(Coordinates(_impulses, 90, lambda found: 0),),
    uneven=never,
)  # fmt: skip

CONTROLLERS = Family(
    "controllers",
    record(
        "body actuators count place path law first last",
        "proportional derivative target axis limit dead_band",
        "error slip torque off",
        proportional=_3, derivative=_3, target=(4,), axis=_3, error=_3, slip=_3, torque=_3,
    ),
    order=140,
    results={
        "error": ("error", "rad", "rotation vector from the target to the body, body axes"),
        "off": ("error_angle", "rad", "angle between the target and the body"),
        "slip": ("rate_error", "rad s-1", "angular velocity relative to the target, body axes"),
        "torque": ("torque", "N m", "commanded torque, body axes"),
    },
    kinds=(
        Kind("an attitude controller"),
    ),
    isolated=True,
    laws=(Law(DRIVE, lambda found: (found["law"] != 0) & (found["path"] == LAW)),),
    of_step=False,
    bound=_controllers_bound,
)  # fmt: skip
