"""Motors."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent.families.coordinates import coordinate_laws
from evolvent.families.coordinates.coordinate_laws import BY_LAW, BY_MOTION, BY_PROFILE
from evolvent.families.coordinates.joint_friction import RELAX
from evolvent.families.motors import drivetrain
from evolvent.kernels import axial, calls, turning
from evolvent.kernels.bristle import SLIP
from evolvent.kernels.drive import LAW
from evolvent.kernels.ends import OfCoordinates
from evolvent.kernels.extremes import note_extremes
from evolvent.model import DRIVETRAIN_ACCOUNTS, FRICTION_FORCE
from evolvent.model.family import Family, Kind, record
from evolvent.model.layout import Accounts
from evolvent.model.powers import RUBBED
from evolvent.model.questions import (
    DRIVE,
    AdjointSupport,
    Coupling,
    Explicit,
    Friction,
    Implicit,
    Law,
    Moment,
    Parts,
    Samples,
    Step,
    Switching,
    Torques,
)
from evolvent.model.records import BY_GEAR, BY_HYSTERESIS
from evolvent.model.shares import DAMPING, FRICTION, MOTOR, MOTOR_LOSSES, Rule, Shares
from evolvent_base.errors import InputError

Array = np.ndarray


@calls.release
def release(t, trigger, ends, y, s, model):
    """Switch off the motors that wait for a trigger."""
    motors, found = model.motors, 0
    for k in range(motors.size):
        if motors[k].event != trigger or (ends != 0 and not motors[k].until > t):
            continue
        if ends != 0:
            motors[k].until = t
        s[motors[k].switch] = 1
        found = 1
    return found


@calls.apply
def apply(t, share, kept, y, s, model):
    """Torques of all motors; their power is given."""
    coordinate_laws.add_motors(t, share, s, model)
    return 0.0, 0.0, coordinate_laws.motor_power(model)


@calls.tangent
def apply_tangent(interval, model, matrix):
    """Derivatives of `apply` into the records of coordinates."""
    coordinate_laws.measure_motor_slopes(model)


@calls.force
def explicit_force(interval, model):
    """Rates of the works of all motors."""
    for k in range(model.motors.size):
        interval.rates[model.motors[k].account] = model.motors[k].power


@calls.force
def end_step(interval, model):
    """Works of all motors into their accounts."""
    motors, step = model.motors, interval.step
    now = (0.5 if step.share == 1.0 else 1.0) * step.h
    then = step.h - now
    for k in range(motors.size):
        interval.y1[motors[k].account] += now * motors[k].power + then * motors[k].power0
        motors[k].power0 = motors[k].power


@calls.note_extremes
def note_motors(s, model):
    """Extremes of the coordinates, rates, torques, powers and currents of all motors."""
    rows = model.motors
    for k in range(rows.size):
        note_extremes(rows[k].extremes, 0, rows[k].angle)
        note_extremes(rows[k].extremes, 1, rows[k].rate)
        note_extremes(rows[k].extremes, 2, rows[k].torque)
        note_extremes(rows[k].extremes, 3, rows[k].power)
        note_extremes(rows[k].extremes, 4, rows[k].current)


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
    axial.measure_coordinate(y, s, coordinates, model.bodies, at)
    yield float(coordinates["angle"][at]), float(coordinates["rate"][at]), time


# motors on coordinates: by a profile (kind 0), a user's law (1), PD to a drive's motion (2), a voltage (3) or a
# current (4), constant: N m/A or N/A, of the coordinate, resistance: ohm; slope, damper: derivatives; account:
# of the work; event, switch, until, latest: when they are switched off, as of joints; on: 1 at the last
# evaluation, or 0
MOTORS = Family(
    "motors",
    record(
        "coordinate kind drive law first last account event switch",
        "position_gain velocity_gain limit rate_limit until latest constant resistance",
        "on time angle rate torque power power0 reference current slope damper extremes",
        extremes=(10,),
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
    isolated=True,
    accounts=(Accounts(1, order=2),),
    laws=(
        Law(DRIVE, lambda found: (found["kind"] == BY_MOTION) & (found["drive"] == LAW)),
        Law("spring", lambda found: found["kind"] == BY_LAW, _at_coordinate),
    ),
    times=("until",),
    shares=Shares((Rule(MOTOR),), place=4, power=_motor_power, force=_motor_force),
    smooth=True,
    of_step=False,
    adjoint=AdjointSupport(
        "its torque follows from the state and time, with all derivatives",
        refused={"motors have a law": lambda found: found["kind"] == BY_LAW},
    ),
    parts=Parts(changes="position_gain velocity_gain limit rate_limit", reads_inertia=False),
    coupling=Coupling(through=True),
    torques=Torques(apply=apply, tangent=apply_tangent),
    explicit=Explicit(force=explicit_force),
    implicit=Implicit(end_step=end_step),
    step=Step(means=lambda found: found["kind"] != BY_PROFILE),
    switching=Switching(release=release),
    samples=Samples(
        local=True, evaluate=False, extremes=("angle", "rate", "torque", "power", "current"),
        note_extremes=note_motors,
    ),
)  # fmt: skip


@calls.apply
def apply_drivetrains(t, share, kept, y, s, model):
    """What drivetrains take from the torques of their motors."""
    stored, lost = drivetrain.add_drivetrains(y, share, kept, model)
    return stored, lost, 0.0


@calls.tangent
def drivetrain_tangent(interval, model, matrix):
    """What the limits of friction change with the motors' torques, into the records of coordinates."""
    drivetrain.add_drivetrain_slopes(model)


@calls.force
def explicit_drivetrains(interval, model):
    """Rates of the accounts of drivetrains."""
    drivetrain.write_drivetrain_rates(model, interval.rates)


@calls.force
def end_drivetrains(interval, model):
    """Losses of drivetrains into their accounts."""
    step = interval.step
    interval.powers[RUBBED] += drivetrain.end_drivetrains(step.h, step.share, interval.y1, 0, model)


@calls.end_friction
def end_friction(y, model):
    """Frictions of drivetrains."""
    return drivetrain.end_drivetrains(0.0, 1.0, y, 1, model)


@calls.stored
def coupled_energy(t, model):
    """Energy of detents and bristles."""
    return drivetrain.drivetrain_energy(model)


@calls.contact_set
def contact_set(found, model):
    """Which drivetrains slip."""
    return turning.note_slips(found, model.drivetrains)


@calls.until_turn
def until_turn(y0, y, h, model):
    """Where the friction of a drivetrain turns back."""
    rows, part = model.drivetrains, turning.NO_TURN
    for k in range(rows.size):
        slider, start = model.coordinates[rows[k].coordinate], y[rows[k].account + FRICTION_FORCE]
        part = min(part, turning.until_slider_turns(SLIP, rows[k].stick, rows[k].friction, start, slider, h))
    return part


@calls.power
def friction_power(model):
    """Power of the frictions of drivetrains."""
    power = 0.0
    for k in range(model.drivetrains.size):
        power += model.drivetrains[k].rubs * model.coordinates[model.drivetrains[k].coordinate].end_rate
    return power


@calls.force
def start(interval, model):
    """Damping of the frictions' bristles."""
    if interval.step.share == 1.0 and interval.step.again == 0.0:
        for k in range(model.drivetrains.size):
            model.drivetrains[k].relax = RELAX


@calls.note_extremes
def note_drivetrains(s, model):
    """Extremes of the torques of all drivetrains on their joints."""
    for k in range(model.drivetrains.size):
        note_extremes(model.drivetrains[k].extremes, 0, model.drivetrains[k].torque)


# what motors lose before their joints (`drivetrain`), with friction as of joint coordinates; forward,
# backward: efficiencies, holds: of a gear that locks itself
DRIVETRAINS = Family(
    "drivetrains",
    record(
        "coordinate motor account", "ratio detent detents offset hysteresis eddy forward backward holds stick",
        "friction by_push slips bristle bristle0 anchor relax rubs rubs0 slope damper cogging torque stored lost lost0 "
        "copper copper0 extremes",
        extremes=(2,),
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
    isolated=True,
    accounts=(Accounts(DRIVETRAIN_ACCOUNTS, states=(0,), order=6),),
    shares=Shares(
        (Rule(MOTOR_LOSSES, _MAGNETIC), Rule(FRICTION, _GEAR), Rule(DAMPING, _EDDY)), place=5, power=_loss
    ),
    parts=Parts(owner=lambda assembly, k: ("motors", int(assembly.model.drivetrains["motor"][k])), reads_inertia=False),
    coupling=Coupling(through=True),
    torques=Torques(apply=apply_drivetrains, tangent=drivetrain_tangent),
    friction=Friction(
        end=end_friction, until_turn=until_turn, power=friction_power,
        rubbed=lambda found: iter([found["account"] + BY_HYSTERESIS, found["account"] + BY_GEAR]),
        rubs=lambda found: np.ones(found.size, dtype=bool),
    ),
    explicit=Explicit(force=explicit_drivetrains),
    implicit=Implicit(end_step=end_drivetrains, contact_set=contact_set, start=start),
    step=Step(energy=coupled_energy),
    samples=Samples(local=True, evaluate=False, extremes=("torque",), note_extremes=note_drivetrains),
)  # fmt: skip
