"""Coordinates."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent.families.coordinates import coordinate, coordinate_laws, coordinate_tangent
from evolvent.families.coordinates.joint_friction import RELAX
from evolvent.families.relaxation.family import set_of
from evolvent.kernels import axial, calls, turning, watches
from evolvent.kernels.bristle import SLIP
from evolvent.kernels.ends import of_coordinate
from evolvent.model import COORDINATE_ACCOUNTS, FRICTION_FORCE, KEPT
from evolvent.model.family import Family, Kind, has_friction, record
from evolvent.model.layout import LATCHED, Accounts, Events, Switches
from evolvent.model.powers import COUPLED_ENERGY, DRIVEN, JOINTS, RUBBED
from evolvent.model.questions import (
    AdjointSupport,
    Advice,
    Energies,
    Explicit,
    Friction,
    Implicit,
    Parts,
    Samples,
    Stability,
    Statics,
    Step,
    Switching,
)
from evolvent.model.records import BY_FRICTION
from evolvent.model.shares import DAMPING, FRICTION, SPRING, Rule, Shares

Array = np.ndarray
_3 = (3,)


def _is_angle(found: Array) -> Array:
    return np.asarray(found["kind"] == axial.ANGLE)


@calls.force
def force(interval, model):
    """Torques on all coordinates of joints, of motors and other parts on them too."""
    step, powers = interval.step, interval.powers
    stored, lost, driven = coordinate.add_coordinates(step.tm, interval.ym, step.h, model.switches, model, model.F)
    powers[COUPLED_ENERGY] += stored
    powers[JOINTS] += lost
    powers[DRIVEN] += driven


@calls.tangent
def tangent(interval, model, matrix):
    """Derivatives of `force`."""
    coordinate_tangent.add_coordinate_tangents(interval, model, matrix)


@calls.measure
def measure(end, t, y, model):
    """Angles and travels."""
    coordinate.measure_coordinates(end, y, model.switches, model)


@calls.force
def explicit_force(interval, model):
    """Torques on all coordinates of joints, rates of their accounts, and a bound of the step."""
    step, powers = interval.step, interval.powers
    _, lost, driven = coordinate.add_coordinates(step.t, interval.ym, KEPT, interval.s, model, model.F)
    powers[JOINTS] += lost
    powers[DRIVEN] += driven
    coordinate_laws.write_account_rates(model, interval.rates)
    model.info.step = min(model.info.step, coordinate.longest_step(model.coordinates))


@calls.energy
def explicit_energy(interval, model, out):
    """Energy of springs, latches, frictions and parts on coordinates."""
    stored, _, _ = coordinate.add_coordinates(interval.step.t, interval.ym, KEPT, interval.s, model, model.F)
    out[1] += stored


def _coupled(t: float, y: Array, s: Array, model: Any, scratch: Array) -> float:
    """Energy of springs, latches, frictions and parts on coordinates in a state of an explicit run, J."""
    return float(coordinate.add_coordinates(t, y, KEPT, s, model, scratch)[0])


#: Rate of a coordinate, beside that of the direction, below which it does not move.
_OFF = 1e-7
#: Deflections of a bristle, beside that at which friction slips, from which it is pulled along.
_SLIPPING = 2.0
_RULES = (
    Rule(SPRING, "stiffness", ("stiffness",), stored=False),
    Rule(DAMPING, "damping", ("damping",)),
    Rule(FRICTION, "friction", ("friction",)),
    Rule(SPRING, "stop", ("stop",), stored=False),
    Rule(SPRING, "latch", ("latch_stiffness",), stored=False),
    Rule(DAMPING, "latch_damping", ("latch_damping",)),
)


def _unforced(model: Any) -> dict[str, Array]:
    still = model.coordinates.copy()
    for field in (*Shares(_RULES).fields, "applied"):
        still[field] = 0.0
    return {"coordinates": still}


def _slip(mechanism: Any, share: Any, at: Any, direction: Any, own: Array) -> None:
    """Let friction slip against the direction."""
    if "friction" not in share.fields:
        return
    (k,) = share.rows
    x, rate = float(at.x[k]), float(direction.rates[k])
    own["relax"] = own["slips"] = own["bristle0"] = 0.0
    if abs(rate) <= _OFF:  # it does not move
        own["friction"] = 0.0
    else:
        own["anchor"] = x - math.copysign(_SLIPPING * float(own["friction"][0] / own["stick"][0]), rate)


def _uneven(turn: Any, rows: list[int]) -> Iterator[int]:
    """All but travels along the axis."""
    for k in rows:
        row = turn.model.coordinates[k]
        own = turn.model.bodies[row["body"]]
        if row["kind"] == axial.ANGLE or not turn.along(own["R0"] @ row["axis"]) or not turn.still[row["body"]]:
            yield k


@calls.force
def evaluate(interval, model):
    """Torques in a state with its frictions among the accounts, and all that acts on coordinates."""
    coordinate.add_coordinates(interval.step.t, interval.ym, KEPT, interval.s, model, model.F)


@calls.force
def end_step(interval, model):
    """Accounts of all coordinates, anchors of their frictions, and what these and relaxation have taken."""
    step = interval.step
    interval.powers[JOINTS] += coordinate.end_relaxation(step.h, interval.y1, model)
    taken = coordinate_laws.end_coordinate_step(step.h, step.share, interval.y1, model)
    interval.powers[RUBBED] += taken


@calls.end_friction
def end_friction(y, model):
    """Frictions of all coordinates."""
    return coordinate.end_frictions(y, model)


@calls.stored
def coupled_energy(t, model):
    """Energy of all coordinates."""
    return coordinate.coordinate_energy(model.switches, model)


@calls.contact_set
def contact_set(found, model):
    """Which coordinates slip."""
    for k in range(model.coordinates.size):
        if model.coordinates[k].friction > 0.0:
            found = 3 * found + 1 + int(model.coordinates[k].slips)
    return found


@calls.rates
def measure_rates(y, model):
    """Rates of all coordinates."""
    coordinates = model.coordinates
    for k in range(coordinates.size):
        coordinates[k].end_rate = axial.rate_of(coordinates, model.bodies, k, y)


@calls.note
def keep_rates(model):
    """Rates of all coordinates."""
    for k in range(model.coordinates.size):
        model.coordinates[k].start_rate = model.coordinates[k].end_rate


@calls.until_turn
def until_turn(y0, y, h, model):
    """Where the friction of a coordinate turns back."""
    rows, part = model.coordinates, turning.NO_TURN
    for k in range(rows.size):
        start = y[rows[k].account + FRICTION_FORCE]
        part = min(part, turning.until_slider_turns(SLIP, rows[k].stick, rows[k].friction, start, rows[k], h))
    return part


@calls.power
def friction_power(model):
    """Power of the frictions of all coordinates."""
    power = 0.0
    for k in range(model.coordinates.size):
        power += model.coordinates[k].rubs * model.coordinates[k].end_rate
    return power


def _turns_and_latch(found: Array, _: Any) -> Array:
    """Quarter turns of an angle, and whether the latch has locked: (2 n,) int."""
    turns = [round(float(row["angle"]) / axial.QUARTER) if row["kind"] == axial.ANGLE else 0 for row in found]
    return np.stack([turns, np.abs(found["angle"] - found["latch"]) <= axial.REACHED], axis=1).astype(int).ravel()


@calls.force
def start(interval, model):
    """Damping of the frictions' bristles."""
    if interval.step.share == 1.0 and interval.step.again == 0.0:
        for k in range(model.coordinates.size):
            model.coordinates[k].relax = RELAX


def _stiffen(model: Any) -> None:
    """Every stop is reached, every latch locked."""
    model.coordinates["stiffness"], model.coordinates["damping"] = coordinate.coordinate_bound(model)


@calls.power
def longest_turn(model):
    """Until a coordinate turns so far that its turns could not be counted."""
    return coordinate.longest_step(model.coordinates)


@calls.note_state
def measure_state(t, y, s, model):
    """Angles and travels of all coordinates, and their rates."""
    for k in range(model.coordinates.size):
        axial.measure_coordinate(y, s, model.coordinates, model.bodies, k)


@calls.note_extremes
def note_extremes(s, model):
    """Extremes of all coordinates, their rates and torques."""
    coordinate_laws.note_coordinates(model.coordinates)


@calls.take_step
def take_step(s, model):
    """Angles and rates of all coordinates, and their quarter turns."""
    coordinate.count_quarter_turns(s, model.coordinates)


@calls.until_event
def until_latch(h, last, means, model):
    """Until the first latch or stop is passed, or a curve of a resistance ends."""
    coordinate.measure_travels(h, last, means != 0, model.coordinates)
    return coordinate.until_latch(model.switches, model)


@calls.reached
def reached(first, model):
    """First open latch, from one on, that the angle of the last step has reached; -1 for none."""
    for k in range(first, model.coordinates.size):
        if coordinate.latch_reached(model.switches, model.coordinates, k):
            return k
    return -1


@calls.fire
def fire(t, k, ends, y, s, model):
    """The latch of coordinate k locks, and releases what waits for it."""
    released = watches.release(t, -2 - k, ends, y, s, model)
    coordinate_laws.lock(s, model.coordinates, k)
    return watches.CHANGES if released else 0


def _sets(model: Any, index: int) -> Iterator[tuple[str, float, str]]:
    row = model.coordinates[index]
    name, unit = ("angle", "rad") if row["kind"] == axial.ANGLE else ("travel", "m")
    yield f"{name} beyond that of rest", float(set_of(model, row)[0]), unit


# coordinates of joints. kind 0: angle about the body's `axis` from its direction `zero` to a second direction, a
# beam's slope (on 1, at iq, iv) or `local` of the body `other` (on 0); kind 1: travel along the body's `axis` from
# its point `zero` to a second point. switch: the first of two switches, the angle in quarter turns, rounded, and 1
# once latched. account: index of its accounts in the state (`COORDINATE_ACCOUNTS`). together, together_end: range of
# coordinates with which it latches, as the nodes of an edge; empty of one that latches alone.
# Of the last forces: torque of the joint, with derivatives slope and damper of all torques but for those of motors,
# which the tangent finds; applied: torque of motors and synchronizations, with derivatives of the latter; u, g:
# second side, and direction of the force on it; p, q: parts of a second direction at the start and the end of an
# interval; leaves, comes: how far it would move in a step at its rates at both ends; bristle: deflection of the
# friction, slips: the sense in which it slips, rubs: its force, relax: of its numerical damping; stored: J; lost,
# latch_lost: powers, W. Of the last step: before, pace, bristle0, rubs0, lost0, latch_lost0, and anchor, the
# coordinate at which the bristle has no force. caught: rate at which the latch has locked; start_rate, end_rate: in
# the states at both ends of a step (`kernels.turning`)
COORDINATES = Family(
    "coordinates",
    record(
        "kind body on other iq iv switch account prony prony_end branch together together_end",
        "axis zero local stiffness damping rest low high stop latch latch_stiffness latch_damping side friction stick",
        "angle rate torque before pace leaves comes slope damper applied applied_slope applied_damper motor_slope "
        "motor_damper u g p0 q0 p1 q1 bristle slips rubs relax stored lost latch_lost latch_torque bristle0 rubs0 "
        "lost0 latch_lost0 anchor caught start_rate end_rate extremes",
        axis=_3, zero=_3, local=_3, u=_3, g=_3, extremes=(2 * len(coordinate_laws.EXTREMES),),
    ),
    order=190,
    results={
        "angle": ("angle", "rad", "angle of the second side as seen from the first, any number of turns"),
        "rate": ("rate", "rad s-1", "rate of the angle"),
        "torque": ("torque", "N m", "torque of the joint, sum of {parts}, positive against the angle"),
        "stored": ("energy_elastic", "J", "elastic energy of spring, stops and latch"),
        "lost": ("dissipation", "W", "power dissipated by the dampers of spring and latch"),
        "rubs": ("friction_torque", "N m", "torque of friction, part of that of the joint"),
        "latch_torque": ("latch_torque", "N m", "torque in the latch, part of that of the joint"),
        "u": ("ends", "m", "point of travel 0 on the first part, and the second end, inertial axes"),
    },
    kinds=(
        Kind(
            "a joint spring on an angle",
            which=lambda found: _is_angle(found) & ~np.isfinite(found["latch"]) & (found["friction"] == 0.0),
            symmetric=True,
        ),
        Kind(
            "a joint spring on an angle with a latch",
            which=lambda found: _is_angle(found) & np.isfinite(found["latch"]) & (found["friction"] == 0.0),
            symmetric=True,
        ),
        Kind(
            "a joint spring on a travel",
            which=lambda found: ~_is_angle(found) & (found["friction"] == 0.0),
            symmetric=True,
        ),
        Kind(
            "a joint coordinate with friction",
            which=lambda found: found["friction"] > 0.0,
            symmetric=True,
        ),
    ),
    ends=of_coordinate,
    isolated=True,
    force=force,
    tangent=tangent,
    accounts=(Accounts(COORDINATE_ACCOUNTS, states=(FRICTION_FORCE,), order=1),),
    switches=(Switches(2, _turns_and_latch, order=1),),
    events=(
        Events(
            lambda found: found.size if np.any(np.isfinite(found["latch"])) else 0,
            lambda _, k: (k, LATCHED),
            order=2,
            values=coordinate.latch_values,
            fire=fire,
            is_watched=False,
            switches=lambda found: found["switch"] + 1,
        ),
    ),
    shares=Shares(_RULES, place=0, unforced=_unforced, prepare=_slip),
    smooth=True,
    of_step=lambda found: found["friction"] > 0.0,
    adjoint=AdjointSupport(
        "its torque follows from the state, with all derivatives; that it latches is found by neighbours", timed=False,
        refused={"joints have friction": lambda found: found["friction"] > 0.0},
        mirrored=lambda found: (found["kind"] == axial.TRAVEL) & (found["friction"] == 0.0),
        smooth=lambda found: (found["stop"] == 0.0) & (found["friction"] == 0.0),
    ),
    parts=Parts(
        is_motion=True, changes="stiffness damping rest friction stick low high stop latch_stiffness latch_damping",
        reads_inertia=False,
    ),
    friction=Friction(
        end=end_friction, measure_rates=measure_rates, keep_rates=keep_rates, until_turn=until_turn,
        power=friction_power, rubbed=lambda found: iter([found["account"] + BY_FRICTION]), rubs=has_friction,
    ),
    explicit=Explicit(
        force=explicit_force, energy=explicit_energy, excess=coordinate.turned_beside, measure=measure_state,
        take_step=take_step, note_state=coordinate.note_turns,
    ),
    stability=Stability(stiffest=_stiffen),
    implicit=Implicit(end_step=end_step, contact_set=contact_set, start=start),
    step=Step(measure=measure, longest=longest_turn, energy=coupled_energy),
    switching=Switching(until=until_latch, reached=reached),
    statics=Statics(uneven=_uneven, sets=_sets),
    energies=Energies(resists=("angle", "torque", "applied"), coupled=_coupled),
    samples=Samples(
        local=True, evaluate=evaluate, extremes=coordinate_laws.EXTREMES, note_extremes=note_extremes
    ),
    advice=Advice(implicit=(lambda found: found["friction"] > 0.0, "has friction, which sticks by stiff bristles")),
)  # fmt: skip
