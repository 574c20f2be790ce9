"""Observations of joint coordinates: springs of hinges and of travels, motors, synchronizations."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from evolvent.kernels import coordinate
from evolvent.kernels import hinge as kernels
from evolvent.kernels.drive import drive
from evolvent.kernels.sides import ON_COORDINATES
from evolvent.model import BY_DAMPER, BY_FRICTION, BY_LATCH, FRICTION_FORCE
from evolvent.results.observe.variables import Observed, cross, dot, turned
from evolvent.results.observe.view import Side, View
from evolvent.solvers.solution import first_latch

Array = np.ndarray


class _Names(NamedTuple):
    """What the variables of a coordinate are called, and their units."""

    value: str
    unit: str
    rate: str
    torque: str
    torque_unit: str


_ANGLE = _Names("angle", "rad", "rad s-1", "torque", "N m")
_TRAVEL = _Names("travel", "m", "m s-1", "force", "N")


def _names(row: Any) -> _Names:
    return _TRAVEL if row["kind"] == coordinate.TRAVEL else _ANGLE


def coordinate_of(view: View, index: int) -> tuple[Array, Array]:
    """A joint's coordinate, rad (any number of turns) or m, and its rate: (nt,) each."""
    row = view.model.flexible.hinges[index]
    pose = view.pose(int(row["body"]))
    axis = turned(pose.R, row["axis"])
    if row["kind"] == coordinate.TRAVEL:
        side = _second(view, row)
        apart = side.u - pose.x
        moves = side.rate - pose.v - cross(pose.w, apart)
        return dot(axis, apart) - row["axis"] @ row["zero"], dot(axis, moves)
    zero, second = turned(pose.R, row["zero"]), _second(view, row)
    across = np.cross(axis, zero)
    p, q = dot(second.u, zero), dot(second.u, across)
    wrapped = np.arctan2(q, p)
    quarters = kernels.QUARTER * view.s[:, int(row["switch"])]
    seen = second.rate - np.cross(pose.w, second.u)
    rate = (p * dot(seen, across) - q * dot(seen, zero)) / (p * p + q * q)
    return wrapped + kernels.TURN * np.round((quarters - wrapped) / kernels.TURN), rate


def _second(view: View, row: Any) -> Side:
    """Second direction of a hinge, or the point of a travel, and its rate."""
    if row["on"] == ON_COORDINATES:
        return Side(view.coordinates(int(row["iq"])), view.coordinates(int(row["iv"])), -1)
    if row["kind"] == coordinate.TRAVEL:
        return Side(*view.on_body(int(row["other"]), row["local"]), int(row["other"]))
    pose = view.pose(int(row["other"]))
    u = turned(pose.R, row["local"])
    return Side(u, np.cross(pose.w, u), int(row["other"]))


def observe_coordinate(view: View, name: str) -> Observed:
    """Angle or travel, rate, torque or force, energies and latch of a spring on the coordinate of a joint."""
    hinges, index, found = view.model.flexible.hinges, view.index(name), Observed()
    row = hinges[index]
    called, account, latched = _names(row), int(row["account"]), view.s[:, int(row["switch"]) + 1]
    x, rate = coordinate_of(view, index)
    laws = [
        kernels.hinge_law(hinges, index, int(on), float(value), float(v))
        for on, value, v in zip(latched, x, rate, strict=True)
    ]
    torque, energy, lost = (np.array([law[k] for law in laws]).reshape(view.t.size) for k in (0, 3, 4))
    what = "angle of the second side as seen from the first, any number of turns"
    if called is _TRAVEL:
        what = "travel of the second end along the axis of the first"
    found.scalar(called.value, x, called.unit, what)
    found.scalar("rate", rate, called.rate, f"rate of the {called.value}")
    rubs = view.y[:, account + FRICTION_FORCE]
    parts = "spring, damper, stops and latch"
    if row["friction"] > 0.0:
        torque, parts = torque + rubs, "spring, damper, friction, stops and latch"
        energy = energy + 0.5 * rubs**2 / row["stick"]
    found.scalar(
        called.torque,
        torque,
        called.torque_unit,
        f"{called.torque} of the joint, sum of {parts}, positive against the {called.value}",
    )
    found.scalar("energy_elastic", energy, "J", "elastic energy of spring, stops and latch")
    found.scalar("dissipation", lost, "W", "power dissipated by the dampers of hinge and latch")
    since = view.y - view.y[:1]
    found.scalar("damper_work", since[:, account + BY_DAMPER], "J", "energy that the damper has dissipated")
    if row["friction"] > 0.0:
        unit = called.torque_unit
        found.scalar(f"friction_{called.torque}", rubs, unit, f"{called.torque} of friction, part of that of the joint")
        found.scalar("friction_work", since[:, account + BY_FRICTION], "J", "energy that friction has dissipated")
    found.scalar("latched", latched, "1", "1 once the latch has locked")
    when = latch_time(view, index)
    found.scalar("latch_time", np.full(view.t.size, when), "s", "time at which the latch has locked")
    if math.isfinite(row["latch"]):
        _observe_latch(view, row, called, math.isfinite(when), (x, rate, latched), found)
    if called is _TRAVEL:
        pose = view.pose(int(row["body"]))
        ends = np.stack([pose.x + turned(pose.R, row["zero"]), _second(view, row).u], axis=1)
        found.along("ends", "end", ends, "m", "point of travel 0 on the first part, and the second end, inertial axes")
        found.drawn = [{"line": {"points": "ends", "kind": "spring", "values": ["force"]}}]
    found.plots = [called.value, called.torque]
    return found


def _observe_latch(
    view: View, row: Any, called: _Names, caught: bool, motion: tuple[Array, Array, Array], found: Observed
) -> None:
    """Torque or force of a latch, its peak, and the energy that it dissipates."""
    x, rate, latched = motion
    account, unit = int(row["account"]), called.torque_unit
    load = latched * (row["latch_stiffness"] * (x - row["latch"]) + row["latch_damping"] * rate)
    found.scalar(f"latch_{called.torque}", load, unit, f"{called.torque} in the latch, part of that of the joint")
    size = view.t.size
    peak, at = (float(row[key]) if caught else math.nan for key in ("peak", "caught"))
    text = f"largest absolute {called.torque} in the latch over all steps"
    found.scalar(f"latch_{called.torque}_peak", np.full(size, peak), unit, text)
    found.scalar("latch_rate", np.full(size, at), called.rate, f"rate of the {called.value} at the time of latching")
    taken = view.y[:, account + BY_LATCH] - view.y[0, account + BY_LATCH] if size else np.zeros(0)
    found.scalar("latch_work", taken, "J", "energy that the latch has dissipated since it locked")


def latch_time(view: View, index: int) -> float:
    """Time at which a hinge has locked, s: that of the run's event, or of its start; NaN where it has not."""
    solution = view.solution
    events = solution.event_times[solution.event_kinds == first_latch(view.model) + index]
    if events.size:
        return float(events[0])
    locked = view.t.size > 0 and view.s[0, int(view.model.flexible.hinges["switch"][index]) + 1] != 0
    return float(view.t[0]) if locked else math.nan


def observe_motor(view: View, name: str) -> Observed:
    """Torque or force, power and work of a motor, and the error of its coordinate against the reference."""
    f, found = view.model.flexible, Observed()
    row = f.motors[view.index(name)]
    hinge = int(row["hinge"])
    called = _names(f.hinges[hinge])
    x, rate = coordinate_of(view, hinge)
    torque = _torques(view, view.index(name), x, rate)
    found.scalar(called.value, x, called.unit, f"{called.value} that the motor drives")
    found.scalar("rate", rate, called.rate, f"rate of the {called.value}")
    text = f"{called.torque} of the motor, positive where it increases the {called.value}"
    found.scalar(called.torque, torque, called.torque_unit, text)
    found.scalar("power", torque * rate, "W", "power of the motor")
    if math.isfinite(row["latest"]) or row["event"] != -1:
        on = view.t < row["until"]
        if row["switch"] >= 0:
            on &= view.s[:, int(row["switch"])] == 0
        found.scalar("on", on, "1", "1 until the motor is switched off, then 0")
    account = int(row["account"])
    work = view.y[:, account] - view.y[0, account] if view.t.size else np.zeros(0)
    found.scalar("work", work, "J", "work of the motor since the start")
    if row["kind"] == coordinate.BY_MOTION:
        parameters = view.model.parameters[int(row["first"]) : int(row["last"])]
        wanted = np.array([drive(int(row["drive"]), parameters, int(row["law"]), float(t))[0] for t in view.t])
        found.scalar("reference", wanted, called.unit, f"reference {called.value} of the motor")
        found.scalar("error", wanted - x, called.unit, f"reference {called.value} of the motor minus the actual one")
    found.plots = [called.value, called.torque]
    return found


def _torques(view: View, index: int, x: Array, rate: Array) -> Array:
    """Torques of a motor at the samples (nt,), by its compiled law."""
    model = view.model.copy()
    motors, hinges = model.flexible.motors, model.flexible.hinges
    hinge, found = int(motors["hinge"][index]), np.zeros(view.t.size)
    for k, t in enumerate(view.t):
        hinges["angle"][hinge], hinges["rate"][hinge] = x[k], rate[k]
        coordinate.add_motors(float(t), 1.0, view.s[k], model)
        found[k] = motors["torque"][index]
    return found


def observe_synchronization(view: View, name: str) -> Observed:
    """Stretches and torques of the cable loops, their energy, and what they have dissipated."""
    f, found, first = view.model.flexible, Observed(), view.index(name)
    rows = f.synchronizations[first : first + len(view.part(name).hinges) - 1]
    called = _names(f.hinges[int(rows["a"][0])])
    size = (view.t.size, rows.size)
    stretch, rate, lost = np.zeros(size), np.zeros(size), np.zeros(view.t.size)
    for i, row in enumerate(rows):
        (a, va), (b, vb) = (coordinate_of(view, int(row[key])) for key in ("a", "b"))
        stretch[:, i] = row["ratio_b"] * b - row["ratio_a"] * a - row["offset"]
        rate[:, i] = row["ratio_b"] * vb - row["ratio_a"] * va
        account = int(row["account"])
        lost += view.y[:, account] - (view.y[0, account] if view.t.size else 0.0)
    torque = rows["stiffness"] * stretch + rows["damping"] * rate
    text = f"difference of the {called.value}s that each loop couples, times their ratios"
    found.along("difference", "loop", stretch, called.unit, text)
    found.along(called.torque, "loop", torque, called.torque_unit, f"{called.torque} of each loop, at a ratio of 1")
    found.scalar("energy_elastic", 0.5 * stretch**2 @ rows["stiffness"], "J", "elastic energy of the loops")
    found.scalar("dissipation", rate**2 @ rows["damping"], "W", "power dissipated by the loops")
    found.scalar("damper_work", lost, "J", "energy that the loops have dissipated")
    found.plots = ["difference", called.torque]
    return found
