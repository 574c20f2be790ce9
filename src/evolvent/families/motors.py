"""Motors."""

from __future__ import annotations

import numpy as np

from evolvent.kernels.ends import of_coordinates
from evolvent.model import DRIVETRAIN_ACCOUNTS
from evolvent.model.family import Family, Kind, record
from evolvent.model.layout import Accounts

Array = np.ndarray


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
    accounts=(Accounts(1),),
    times=("until",),
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
    accounts=(Accounts(DRIVETRAIN_ACCOUNTS, order=315),),  # behind those of bristles
    rubs=lambda found: np.ones(found.size, dtype=bool),
)  # fmt: skip
