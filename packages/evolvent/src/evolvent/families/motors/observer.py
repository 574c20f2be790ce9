"""Observations of motors: torque, power, work and losses; and their symbols."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from evolvent.families.coordinates import coordinate_laws
from evolvent.families.coordinates.observer import add_fields, since, worded
from evolvent.model import BY_COPPER, BY_EDDY, BY_GEAR, BY_HYSTERESIS
from evolvent.results.observe.symbols import entry, own_axis, pin, revolved, seat_of, symbol
from evolvent.results.observe.variables import Observed, observer
from evolvent.results.observe.view import View


@observer("motors")
def observe_motor(view: View, name: str) -> Observed:
    """Torque or force, power and work of a motor, and the error of its coordinate against the reference."""
    index, found = view.index(name), Observed()
    motor = view.model.motors[index]
    row = view.model.coordinates[int(motor["coordinate"])]
    add_fields(view, found, "motors", index, row, "angle rate torque power")
    if math.isfinite(motor["latest"]) or motor["event"] != -1:
        add_fields(view, found, "motors", index, row, "on")
    found.scalar("work", since(view, int(motor["account"])), "J", "work of the motor since the start")
    if motor["kind"] == coordinate_laws.BY_MOTION:
        add_fields(view, found, "motors", index, row, "reference")
        fields, text = view.fields["motors"], worded(row, "reference angle of the motor minus the actual one")
        off = fields["reference"][:, index] - fields["angle"][:, index]
        found.scalar("error", off, worded(row, "rad"), text)
    _observe_drivetrain(view, motor, index, row, found)
    found.plots = [worded(row, "angle"), worded(row, "torque")]
    found.plots += ["current"] if "current" in found.variables else []
    return found


def _observe_drivetrain(view: View, motor: Any, index: int, row: Any, found: Observed) -> None:
    """Currents and powers of a motor's winding, and what is lost before the joint, by cause."""
    own = np.flatnonzero(view.model.drivetrains["motor"] == index)
    if not own.size:
        return
    k, at = int(own[0]), int(view.model.drivetrains["account"][own[0]])
    add_fields(view, found, "drivetrains", k, row, "torque cogging rubs stored")
    if motor["constant"] > 0.0:
        add_fields(view, found, "motors", index, row, "current")
        current, power = (view.fields["motors"][field][:, index] for field in ("current", "power"))
        copper, taken = motor["resistance"] * current * current, since(view, at + BY_COPPER)
        found.scalar("electrical_power", power + copper, "W", "electrical power into the motor")
        found.scalar("copper_power", copper, "W", "power lost in the winding")
        work = since(view, int(motor["account"])) + taken
        found.scalar("electrical_work", work, "J", "electrical energy into the motor since the start")
        found.scalar("copper_work", taken, "J", "energy lost in the winding")
    for name, cause, what in (
        ("eddy_work", BY_EDDY, "eddy currents"), ("magnetic_work", BY_HYSTERESIS, "magnetic hysteresis"),
        ("gear_work", BY_GEAR, "the gear"),
    ):  # fmt: skip
        found.scalar(name, since(view, at + cause), "J", f"energy lost by {what}")


@symbol("motor")
def _motor(view: View, name: str, found: Observed) -> None:
    """A rotor beside its joint that turns with the angle; of a travel a cone along the axis."""
    seat = seat_of(view, view.part(name).joint)
    if seat is None:
        return
    axis = own_axis(view, seat)
    if "angle" in found.variables:
        solids = [pin(0.8, 1.3, 2.5, axis, turned="angle")]
    else:
        solids = [revolved([(0.6, 0.7), (1.8, 0.0)], axis)]
    found.drawn.append(entry(view, found, seat, solids=solids))
