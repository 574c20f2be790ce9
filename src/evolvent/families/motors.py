"""Motors."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent.base.errors import InputError
from evolvent.kernels import coordinate, coordinate_laws
from evolvent.kernels.coordinate_laws import BY_LAW, BY_MOTION, BY_PROFILE
from evolvent.kernels.drive import LAW
from evolvent.kernels.ends import OfCoordinates
from evolvent.model.family import Family, Kind, record
from evolvent.model.questions import DRIVE, AdjointSupport, Law, Moment
from evolvent.model.shares import DAMPING, FRICTION, MOTOR, MOTOR_LOSSES, Rule, Shares

Array = np.ndarray


#: Shares of a motor beside its torque.
_MAGNETIC, _GEAR, _EDDY = "magnetic", "gear", "eddy"


def _of_motion(mechanism: Any, share: Any, still: bool) -> Any:
    """The record of a motor that follows a motion, at rest, where its reference is not known; None of others."""
    (row,) = (mechanism.whole.motors[k] for k in share.rows)
    return row if still and row["kind"] == coordinate_laws.BY_MOTION else None


def _motor_power(mechanism: Any, share: Any, at: Any, direction: Any, still: bool) -> float | None:
    """Of a motor that follows a motion, at rest: that of its limit."""
    row = _of_motion(mechanism, share, still)
    if row is None:
        return None
    if not math.isfinite(row["limit"]):
        raise InputError(
            f"{share.part!r} follows a motion, and its torque at rest is its limit; give {share.part}.limit, the "
            f"torque or force that it has at the worst"
        )
    return float(row["limit"]) * abs(float(direction.rates[int(row["coordinate"])]))


def _motor_force(mechanism: Any, share: Any, at: Any, direction: Any, still: bool) -> Array | None:
    row = _of_motion(mechanism, share, still)
    if row is None:
        return None
    k = int(row["coordinate"])
    return np.asarray(at.zero - math.copysign(float(row["limit"]), float(direction.rates[k])) * at.J[k])


def _loss(mechanism: Any, share: Any, at: Any, direction: Any, still: bool) -> float:
    """Minus the power that a motor loses before its joint; the detent with its amplitude, wherever the rotor is."""
    (row,) = (mechanism.whole.drivetrains[k] for k in share.rows)
    k, n = int(row["coordinate"]), float(row["ratio"])
    rate, hysteresis = abs(float(direction.rates[k])), n * float(row["hysteresis"])
    if share.aspect == _EDDY:
        own = float(at.J[k] @ at.y[mechanism.n_q : mechanism.n_q + mechanism.n_v])
        return -float(n * n * row["eddy"] * own * direction.rates[k])
    if share.aspect == _MAGNETIC:
        return -(hysteresis + n * float(row["detent"])) * rate
    motor = dataclasses.replace(share, label=share.part, family="motors", rows=(int(row["motor"]),))
    driving = mechanism.power(motor, at, direction, still=still)
    over = driving - hysteresis * rate
    if over > 0.0:
        return -float((1.0 - row["forward"]) * over)
    if row["backward"] == 0.0:
        return -float(row["holds"]) * rate
    return -float((1.0 / row["backward"] - 1.0) * -over)


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
    order=200,
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
    ends=OfCoordinates("coordinate"),
    through=True,
    local=True,
    changes="position_gain velocity_gain limit rate_limit",
    reads_inertia=False,
    smooth=True,
    shares=Shares((Rule(MOTOR),), place=4, power=_motor_power, force=_motor_force),
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
    order=210,
    results={
        "torque": ("joint_torque", "N m", "torque on the joint, after detent, magnetic losses and gear"),
        "cogging": ("detent_torque", "N m", "torque of the detent, positive against the angle"),
        "rubs": ("friction_torque", "N m", "torque of magnetic hysteresis and gear, positive against the angle"),
        "stored": ("energy_elastic", "J", "energy of the detent and of the bristle of the gear"),
    },
    kinds=(
        Kind("a motor's drivetrain", symmetric=True),
    ),
    ends=OfCoordinates("coordinate"),
    through=True,
    owner=lambda records, k: ("motors", int(records("drivetrains")["motor"][k])),
    local=True,
    reads_inertia=False,
    shares=Shares(
        (Rule(MOTOR_LOSSES, _MAGNETIC), Rule(FRICTION, _GEAR), Rule(DAMPING, _EDDY)), place=5, power=_loss
    ),
)  # fmt: skip
