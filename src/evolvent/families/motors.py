"""Motors."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent.kernels import coordinate
from evolvent.kernels.coordinate_laws import BY_LAW, BY_MOTION, BY_PROFILE
from evolvent.kernels.drive import LAW
from evolvent.kernels.ends import of_coordinates
from evolvent.model.family import Family, Kind, record
from evolvent.model.questions import DRIVE, AdjointSupport, Law, Moment
from evolvent.model.records import BY_GEAR, BY_HYSTERESIS

Array = np.ndarray


def _at_coordinate(model: Any, k: int, moment: Moment, _: bool) -> Iterator[tuple[Any, ...]]:
    (time, y, s), coordinates, at = moment, model.coordinates, int(model.motors["coordinate"][k])
    coordinate.measure_coordinate(y, s, coordinates, model.bodies, at)
    yield time, float(coordinates["angle"][at]), float(coordinates["rate"][at])


# motors on coordinates: by a profile (kind 0), a user's law (1), PD to a drive's motion (2), a voltage (3) or a
# current (4), constant: N m/A or N/A, of the coordinate, resistance: ohm; slope, damper: derivatives; account:
# of the work; event, switch, until, latest: when they are switched off, as of joints; on: 1 at the last
# evaluation, or 0
MOTORS = Family(
    "motors",
    record(
        "coordinate kind drive law first last account event switch",
        "position_gain velocity_gain limit rate_limit until latest constant resistance",
        "on time angle rate torque power power0 reference current slope damper",
    ),
    order=260,
    results={
        "angle": ("angle", "rad", "angle that the motor drives"),
        "rate": ("rate", "rad s-1", "rate of the angle"),
        "torque": ("torque", "N m", "torque of the motor, positive where it increases the angle"),
        "power": ("power", "W", "power of the motor"),
        "on": ("on", "1", "1 until the motor is switched off, then 0"),
        "reference": ("reference", "rad", "reference angle of the motor"),
        "current": ("current", "A", "current of the winding"),
    },
    kinds=(
        Kind("a motor", symmetric=True),
    ),
    ends=of_coordinates("coordinate"),
    through=True,
    laws=(
        Law(DRIVE, lambda found: (found["kind"] == BY_MOTION) & (found["drive"] == LAW)),
        Law("motor", lambda found: found["kind"] == BY_LAW, _at_coordinate),
    ),
    means=lambda found: found["kind"] != BY_PROFILE,
    of_step=False,
    adjoint=AdjointSupport(
        "its torque follows from the state and time, with all derivatives",
        refused={"motors have a law": lambda found: found["kind"] == BY_LAW},
    ),
)  # fmt: skip

# what motors lose before their joints (`kernels.drivetrain`), with friction as of joint coordinates; forward,
# backward: efficiencies, holds: of a gear that locks itself
DRIVETRAINS = Family(
    "drivetrains",
    record(
        "coordinate motor account", "ratio detent detents offset hysteresis eddy forward backward holds stick",
        "friction by_push slips bristle bristle0 anchor relax rubs rubs0 slope damper cogging torque stored lost lost0 "
        "copper copper0",
    ),
    order=270,
    results={
        "torque": ("joint_torque", "N m", "torque on the joint, after detent, magnetic losses and gear"),
        "cogging": ("detent_torque", "N m", "torque of the detent, positive against the angle"),
        "rubs": ("friction_torque", "N m", "torque of magnetic hysteresis and gear, positive against the angle"),
        "stored": ("energy_elastic", "J", "energy of the detent and of the bristle of the gear"),
    },
    kinds=(
        Kind("a motor's drivetrain", symmetric=True),
    ),
    ends=of_coordinates("coordinate"),
    through=True,
    rubbed=lambda found: iter([found["account"] + BY_HYSTERESIS, found["account"] + BY_GEAR]),
)  # fmt: skip
