"""Observations of joint coordinates: springs of hinges and of travels, motors, synchronizations, resistances."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from evolvent.kernels import axial, coordinate_laws, resistance
from evolvent.model import (
    BY_COPPER,
    BY_DAMPER,
    BY_EDDY,
    BY_FRICTION,
    BY_GEAR,
    BY_HYSTERESIS,
    BY_LATCH,
    RESULTS,
)
from evolvent.results.observe.variables import Observed, observer
from evolvent.results.observe.view import View
from evolvent.solvers.common.solution import event_numbers

Array = np.ndarray
#: What the words of an angle are for a travel, in the order of replacement.
_OF_TRAVEL = {
    "angle of the second side as seen from the first, any number of turns": (
        "travel of the second end along the axis of the first"
    ),
    "angle": "travel",
    "torque": "force",
    "rad": "m",
    "N m": "N",
}  # fmt: skip


def _worded(row: Any, text: str) -> str:
    """Name, unit or words of a variable, of a row of the family `coordinates`."""
    if row["kind"] == axial.TRAVEL:
        for angle, travel in _OF_TRAVEL.items():
            text = text.replace(angle, travel)
    return text


def _add(view: View, found: Observed, family: str, index: Any, row: Any, fields: str, **words: str) -> None:
    """Add fields of records (one record, or a slice along `loop`); row : that of the coordinate."""
    for field in fields.split():
        values, result = view.fields[family][field][:, index], RESULTS[family][field]
        name, unit, text = (_worded(row, what).format(**words) for what in result)
        if values.ndim == 1:
            found.scalar(name, values, unit, text)
        else:
            found.along(name, "loop", values, unit, text)


def _since(view: View, account: int) -> Array:
    """What an account has gathered since the start: (nt,), J."""
    found: Array = view.y[:, account] - view.y[:1, account]
    return found


@observer("coordinates")
def observe_coordinate(view: View, name: str) -> Observed:
    """Angle or travel, rate, torque or force, energies and latch of a spring on the coordinate of a joint."""
    index, found = view.index(name), Observed()
    row = view.model.coordinates[index]
    account, rubs = int(row["account"]), row["friction"] > 0.0
    parts = "spring, damper, friction, stops and latch" if rubs else "spring, damper, stops and latch"
    _add(view, found, "coordinates", index, row, "angle rate torque stored lost", parts=parts)
    found.scalar("damper_work", _since(view, account + BY_DAMPER), "J", "energy that the damper has dissipated")
    if rubs:
        _add(view, found, "coordinates", index, row, "rubs")
        found.scalar("friction_work", _since(view, account + BY_FRICTION), "J", "energy that friction has dissipated")
    found.scalar("latched", view.s[:, int(row["switch"]) + 1], "1", "1 once the latch has locked")
    when = latch_time(view, index)
    found.scalar("latch_time", np.full(view.t.size, when), "s", "time at which the latch has locked")
    if math.isfinite(row["latch"]):
        _observe_latch(view, index, math.isfinite(when), found)
    if row["kind"] == axial.TRAVEL:
        on_first, _ = view.on_body(int(row["body"]), row["zero"])
        ends = np.stack([on_first, view.fields["coordinates"]["u"][:, index]], axis=1)
        found.along(RESULTS["coordinates"]["u"][0], "end", ends, *RESULTS["coordinates"]["u"][1:])
        found.drawn = [{"line": {"points": "ends", "kind": "spring", "values": ["force"]}}]
    found.plots = [_worded(row, "angle"), _worded(row, "torque")]
    return found


def _observe_latch(view: View, index: int, caught: bool, found: Observed) -> None:
    """Torque or force of a latch, its peak, and the energy that it dissipates."""
    row = view.model.coordinates[index]
    _add(view, found, "coordinates", index, row, "latch_torque")
    peak, rate = (np.full(view.t.size, float(row[key]) if caught else math.nan) for key in ("peak", "caught"))
    text = _worded(row, "largest absolute torque in the latch over all steps")
    found.scalar(_worded(row, "latch_torque_peak"), peak, _worded(row, "N m"), text)
    text = _worded(row, "rate of the angle at the time of latching")
    found.scalar("latch_rate", rate, _worded(row, "rad s-1"), text)
    taken = _since(view, int(row["account"]) + BY_LATCH)
    found.scalar("latch_work", taken, "J", "energy that the latch has dissipated since it locked")


def latch_time(view: View, index: int) -> float:
    """Time at which a hinge has locked, s: that of the run's event, or of its start; NaN where it has not."""
    solution = view.solution
    events = solution.event_times[solution.event_kinds == event_numbers(view.model, np.array(index))]
    if events.size:
        return float(events[0])
    locked = view.t.size > 0 and view.s[0, int(view.model.coordinates["switch"][index]) + 1] != 0
    return float(view.t[0]) if locked else math.nan


@observer("motors")
def observe_motor(view: View, name: str) -> Observed:
    """Torque or force, power and work of a motor, and the error of its coordinate against the reference."""
    index, found = view.index(name), Observed()
    motor = view.model.motors[index]
    row = view.model.coordinates[int(motor["coordinate"])]
    _add(view, found, "motors", index, row, "angle rate torque power")
    if math.isfinite(motor["latest"]) or motor["event"] != -1:
        _add(view, found, "motors", index, row, "on")
    found.scalar("work", _since(view, int(motor["account"])), "J", "work of the motor since the start")
    if motor["kind"] == coordinate_laws.BY_MOTION:
        _add(view, found, "motors", index, row, "reference")
        fields, text = view.fields["motors"], _worded(row, "reference angle of the motor minus the actual one")
        off = fields["reference"][:, index] - fields["angle"][:, index]
        found.scalar("error", off, _worded(row, "rad"), text)
    _observe_drivetrain(view, motor, index, row, found)
    found.plots = [_worded(row, "angle"), _worded(row, "torque")]
    return found


def _observe_drivetrain(view: View, motor: Any, index: int, row: Any, found: Observed) -> None:
    """Currents and powers of a motor's winding, and what is lost before the joint, by cause."""
    own = np.flatnonzero(view.model.drivetrains["motor"] == index)
    if not own.size:
        return
    k, at = int(own[0]), int(view.model.drivetrains["account"][own[0]])
    _add(view, found, "drivetrains", k, row, "torque cogging rubs stored")
    if motor["constant"] > 0.0:
        _add(view, found, "motors", index, row, "current")
        current, power = (view.fields["motors"][field][:, index] for field in ("current", "power"))
        copper, taken = motor["resistance"] * current * current, _since(view, at + BY_COPPER)
        found.scalar("electrical_power", power + copper, "W", "electrical power into the motor")
        found.scalar("copper_power", copper, "W", "power lost in the winding")
        work = _since(view, int(motor["account"])) + taken
        found.scalar("electrical_work", work, "J", "electrical energy into the motor since the start")
        found.scalar("copper_work", taken, "J", "energy lost in the winding")
    for name, cause, what in (
        ("eddy_work", BY_EDDY, "eddy currents"), ("magnetic_work", BY_HYSTERESIS, "magnetic hysteresis"),
        ("gear_work", BY_GEAR, "the gear"),
    ):  # fmt: skip
        found.scalar(name, _since(view, at + cause), "J", f"energy lost by {what}")


@observer("synchronizations")
def observe_synchronization(view: View, name: str) -> Observed:
    """Stretches and torques of the cable loops, their energy, and what they have dissipated."""
    model, found, first = view.model, Observed(), view.index(name)
    loops = slice(first, first + len(view.part(name).joints) - 1)
    row = model.coordinates[int(model.synchronizations["a"][first])]
    _add(view, found, "synchronizations", loops, row, "stretch torque")
    for field in ("energy", "lost"):
        key, unit, text = RESULTS["synchronizations"][field]
        found.scalar(key, view.fields["synchronizations"][field][:, loops].sum(axis=1), unit, text)
    lost = np.sum([_since(view, int(account)) for account in model.synchronizations["account"][loops]], axis=0)
    found.scalar("damper_work", lost, "J", "energy that the loops have dissipated")
    found.plots = ["difference", _worded(row, "torque")]
    return found


@observer("resistances")
def observe_resistance(view: View, name: str) -> Observed:
    """Torque or force of a harness, a tape-spring hinge or an adhesion, its energy, and what it has taken."""
    index, found = view.index(name), Observed()
    own = view.model.resistances[index]
    row = view.model.coordinates[int(own["coordinate"])]
    _add(view, found, "resistances", index, row, "angle rate torque stored")
    if own["kind"] == resistance.HARNESS:
        _add(view, found, "resistances", index, row, "rubs")
    _observe_losses(view, own, found)
    found.plots = [_worded(row, "angle"), _worded(row, "torque")]
    return found


def _observe_losses(view: View, own: Any, found: Observed) -> None:
    """What a resistance has taken, and when a tape snapped or an adhesion broke."""
    taken = _since(view, int(own["account"]))
    last, state = np.full(view.t.size, own["time"] if own["changes"] > 0.0 else math.nan), view.s[:, int(own["switch"])]
    if own["kind"] == resistance.HARNESS:
        found.scalar("hysteresis_work", taken, "J", "energy that the hysteresis has dissipated")
    elif own["kind"] == resistance.TAPE_SPRING:
        found.scalar("state", state, "1", "0 where the tape is straight, 1 where folded, 2 where folded the other way")
        found.scalar("snap_work", taken, "J", "energy that snaps have dissipated")
        found.scalar("snaps", np.full(view.t.size, own["changes"]), "1", "number of snaps in the run")
        found.scalar("snap_time", last, "s", "time of the last snap")
    else:
        found.scalar("released", state, "1", "1 once the adhesion has broken")
        found.scalar("adhesion_work", taken, "J", "energy that the adhesion has dissipated as it broke")
        found.scalar("release_time", last, "s", "time at which the adhesion has broken")


@observer("bearings")
def observe_bearing(view: View, name: str) -> Observed:
    """Friction of a bearing, its load by parts, and what it has taken."""
    index, found = view.index(name), Observed()
    own = view.model.bearings[index]
    row = view.model.coordinates[int(own["coordinate"])]
    _add(view, found, "bearings", index, row, "angle rate rubs limit")
    for field in ("radial_force", "axial_force", "tilting", "stored"):  # which are the same of an angle and a travel
        if field == "axial_force" and row["kind"] == axial.TRAVEL:
            continue
        key, unit, text = RESULTS["bearings"][field]
        found.scalar(key, view.fields["bearings"][field][:, index], unit, text)
    found.scalar("friction_work", _since(view, int(own["account"])), "J", "energy that friction has dissipated")
    found.plots = [_worded(row, "torque"), "radial_force"]
    return found
