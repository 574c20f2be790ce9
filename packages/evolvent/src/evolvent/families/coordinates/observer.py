"""Observations of joint coordinates: springs of hinges and of travels, synchronizations, resistances."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from evolvent.families.coordinates import resistance
from evolvent.families.joints.observer_symbols import point_row
from evolvent.kernels import axial, sides
from evolvent.kernels.ancf_beams import NODE_VECTORS
from evolvent.model import (
    BY_DAMPER,
    BY_FRICTION,
    BY_LATCH,
    RESULTS,
)
from evolvent.results.observe.shapes import point_on
from evolvent.results.observe.symbols import Seat, entry, own_axis, pin, placed, seat_of, symbol
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
#: Share of the range between stops by which a coordinate passes one where it is said to have hit it.
_AT_STOP = 1e-6


def worded(row: Any, text: str) -> str:
    """Name, unit or words of a variable, of a row of the family `coordinates`."""
    if row["kind"] == axial.TRAVEL:
        for angle, travel in _OF_TRAVEL.items():
            text = text.replace(angle, travel)
    return text


def add_fields(view: View, found: Observed, family: str, index: Any, row: Any, fields: str, **words: str) -> None:
    """Add fields of records (one record, or a slice along `loop`); row : that of the coordinate."""
    for field in fields.split():
        name, unit, text = RESULTS[family][field]
        name = worded(row, name)
        if not view.wants(name):
            continue
        unit, text = worded(row, unit), worded(row, text).format(**words)
        values, extremes = view.fields[family][field][:, index], view.fields[family].extremes_of(field, index)
        if values.ndim == 1:
            found.scalar(name, values, unit, text, extremes=extremes)
        else:
            found.along(name, "loop", values, unit, text, extremes=extremes)


def since(view: View, account: int) -> Array:
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
    add_fields(view, found, "coordinates", index, row, "angle rate torque stored lost", parts=parts)
    found.scalar("damper_work", since(view, account + BY_DAMPER), "J", "energy that the damper has dissipated")
    if rubs:
        add_fields(view, found, "coordinates", index, row, "rubs")
        found.scalar("friction_work", since(view, account + BY_FRICTION), "J", "energy that friction has dissipated")
    found.scalar("latched", view.s[:, int(row["switch"]) + 1], "1", "1 once the latch has locked")
    if view.wants("latch_time"):
        when = np.full(view.t.size, latch_time(view, index))
        found.scalar("latch_time", when, "s", "time at which the latch has locked")
    if math.isfinite(row["latch"]):
        _observe_latch(view, index, found)
    if row["kind"] == axial.TRAVEL:
        on_first, _ = view.on_body(int(row["body"]), row["zero"])
        ends = np.stack([on_first, view.fields["coordinates"]["u"][:, index]], axis=1)
        found.along(RESULTS["coordinates"]["u"][0], "end", ends, *RESULTS["coordinates"]["u"][1:])
        found.drawn = [{"line": {"points": "ends", "kind": "spring", "values": ["force"]}}]
    found.plots = [worded(row, "angle"), worded(row, "torque")]
    if row["stop"] > 0.0:
        angle, span = view.fields["coordinates"]["angle"][:, index], abs(row["high"] - row["low"])
        near = np.full(view.t.size, _AT_STOP * span if math.isfinite(span) else 0.0)
        near[:1] *= -1.0  # one that starts at its stop does not hit it
        state = np.where(angle < row["low"] - near, 1, np.where(angle > row["high"] + near, 2, 0))
        found.changes(view.t, state, dict.fromkeys((1, 2), "stop hit"))
    return found


def _observe_latch(view: View, index: int, found: Observed) -> None:
    """Torque or force of a latch, its peak, and the energy that it dissipates."""
    row = view.model.coordinates[index]
    add_fields(view, found, "coordinates", index, row, "latch_torque")
    if view.wants(peak := worded(row, "latch_torque_peak"), "latch_rate"):
        caught = math.isfinite(latch_time(view, index))
        fields = view.fields["coordinates"]
        over, start = fields.extremes_of("latch_torque", index), fields["latch_torque"][:1, index]
        largest = math.nan
        if caught and over is not None:
            largest = float(np.abs([*over, *start]).max())  # of energy-momentum the former are means over steps
        text = worded(row, "largest absolute torque in the latch over all steps")
        found.scalar(peak, np.full(view.t.size, largest), worded(row, "N m"), text)
        rate = np.full(view.t.size, float(row["caught"]) if caught else math.nan)
        text = worded(row, "rate of the angle at the time of latching")
        found.scalar("latch_rate", rate, worded(row, "rad s-1"), text)
    taken = since(view, int(row["account"]) + BY_LATCH)
    found.scalar("latch_work", taken, "J", "energy that the latch has dissipated since it locked")


def latch_time(view: View, index: int) -> float:
    """Time at which a hinge has locked, s: that of the run's event, or of its start; NaN where it has not."""
    solution = view.solution
    events = solution.event_times[solution.event_kinds == event_numbers(view.model, np.array(index))]
    if events.size:
        return float(events[0])
    locked = view.t.size > 0 and view.s[0, int(view.model.coordinates["switch"][index]) + 1] != 0
    return float(view.t[0]) if locked else math.nan


@observer("synchronizations")
def observe_synchronization(view: View, name: str) -> Observed:
    """Stretches and torques of the cable loops, their energy, and what they have dissipated."""
    model, found, first = view.model, Observed(), view.index(name)
    loops = slice(first, first + len(view.part(name).joints) - 1)
    row = model.coordinates[int(model.synchronizations["a"][first])]
    add_fields(view, found, "synchronizations", loops, row, "stretch torque")
    for field in ("energy", "lost"):
        key, unit, text = RESULTS["synchronizations"][field]
        found.scalar(key, view.fields["synchronizations"][field][:, loops].sum(axis=1), unit, text)
    lost = np.sum([since(view, int(account)) for account in model.synchronizations["account"][loops]], axis=0)
    found.scalar("damper_work", lost, "J", "energy that the loops have dissipated")
    found.plots = ["difference", worded(row, "torque")]
    return found


@observer("resistances")
def observe_resistance(view: View, name: str) -> Observed:
    """Torque or force of a harness, a tape-spring hinge or an adhesion, its energy, and what it has taken."""
    index, found = view.index(name), Observed()
    own = view.model.resistances[index]
    row = view.model.coordinates[int(own["coordinate"])]
    add_fields(view, found, "resistances", index, row, "angle rate torque stored")
    if own["kind"] == resistance.HARNESS:
        add_fields(view, found, "resistances", index, row, "rubs")
    _observe_losses(view, own, found)
    found.plots = [worded(row, "angle"), worded(row, "torque")]
    return found


def _observe_losses(view: View, own: Any, found: Observed) -> None:
    """What a resistance has taken, and when a tape snapped or an adhesion broke."""
    taken = since(view, int(own["account"]))
    last, state = np.full(view.t.size, own["time"] if own["changes"] > 0.0 else math.nan), view.s[:, int(own["switch"])]
    if own["kind"] == resistance.HARNESS:
        found.scalar("hysteresis_work", taken, "J", "energy that the hysteresis has dissipated")
    elif own["kind"] == resistance.TAPE_SPRING:
        found.scalar("state", state, "1", "0 where the tape is straight, 1 where folded, 2 where folded the other way")
        found.scalar("snap_work", taken, "J", "energy that snaps have dissipated")
        found.scalar("snaps", np.full(view.t.size, own["changes"]), "1", "number of snaps in the run")
        found.scalar("snap_time", last, "s", "time of the last snap")
        found.changes(view.t, state, {0: "snapped straight", 1: "folded", 2: "folded the other way"})
    else:
        found.scalar("released", state, "1", "1 once the adhesion has broken")
        found.scalar("adhesion_work", taken, "J", "energy that the adhesion has dissipated as it broke")
        found.scalar("release_time", last, "s", "time at which the adhesion has broken")
        found.happens("released", float(last[-1]) if last.size else math.nan, view.t)


# ------------------------------------------------------------------------------------------------ symbols


@symbol("hinge")
def _joint_spring(view: View, name: str, found: Observed) -> None:
    """Two flanges at the ends of a hinge's pin; nothing of a travel, whose ends are drawn."""
    seat = seat_of(view, name) if "angle" in found.variables else None
    if seat is not None:
        axis = own_axis(view, seat)
        flanges = [pin(0.7, low, low + 0.25, axis) for low in (-1.25, 1.0)]
        found.drawn.append(entry(view, found, seat, solids=flanges))


@placed("joint-spring")
def _hinge_seat(view: View, name: str, part: Any) -> Seat | None:
    """Where a spring of a joint is: at its joint, at that between the same parts, or at its second end."""
    row = view.model.coordinates[view.index(name)]
    body, axis = int(row["body"]), np.array(row["axis"], dtype=float)
    if row["kind"] == axial.TRAVEL:
        return Seat(body, np.array(row["zero"]), axis)
    if part.joint is not None:
        return seat_of(view, part.joint)
    other = int(row["other"])
    for joint, candidate in view.assembly.parts.items():
        if getattr(candidate, "kind", "") == "joint" and candidate.type in ("revolute", "cylindrical", "universal"):
            found = point_row(view, joint)
            if found is not None and {(int(found["on"][i]), int(found["index"][i])) for i in (0, 1)} == {
                (sides.ON_BODY, body), (sides.ON_BODY, other),
            }:  # fmt: skip
                return seat_of(view, joint)
    if row["on"] == sides.ON_COORDINATES:
        return Seat(-1, _node_of_slope(view, int(row["iq"])), view.initial.pose(body).R[0] @ axis)
    owner = next(n for n, at in view.assembly.names.items() if at == ("bodies", other))
    place = point_on(part.b, owner, getattr(view.assembly.parts.get(owner), "points", None) or {})
    back = view.initial.pose(other).R[0].T @ view.initial.pose(body).R[0]
    return Seat(other, np.zeros(3) if place is None else place, back @ axis)


def _node_of_slope(view: View, iq: int) -> Array:
    """Position (nt, 3) of the node of a beam that has the slope with the coordinate iq."""
    beams = view.model.beams
    row = beams[np.flatnonzero((beams["iq"] >= 0) & (beams["iq"] <= iq))[-1]]
    node = 3 * NODE_VECTORS[int(row["kind"])]
    return view.coordinates(iq - (iq - int(row["iq"])) % node)
