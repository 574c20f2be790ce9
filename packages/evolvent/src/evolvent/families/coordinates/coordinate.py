"""Coordinates of joints with spring, damper, stops, latch and friction: angles of joint coordinates, and travels.

They are measured by `axial`; an angle is continuous over any number of turns. Each has two switches in the state: the
angle of the last step in quarter turns, rounded, which gives the number of whole turns, and whether the latch has
locked. A force acts over an interval of time, of which a state is one of length zero: the one of spring, stops and
latch is the change of their energy over that of the coordinate; motors and synchronizations act by the mean
coordinates, friction by its force at the end.
"""

import math

import numpy as np
from numba import types, void

from evolvent.compiled.jit import INTEGERS, REAL, VECTOR, indirect, inlined
from evolvent.families.coordinates.coordinate_laws import latch_torque
from evolvent.families.coordinates.excursion import first_passage
from evolvent.families.coordinates.joint_friction import (
    bristle_energy,
    end_kept_friction,
    friction_force,
    kept_friction,
)
from evolvent.families.coordinates.resistance import resistance_bound, until_end_of_curve
from evolvent.kernels import axial, rigid
from evolvent.kernels.axial import QUARTER, REACHED, SMALL, TRAVEL, measure_coordinate
from evolvent.kernels.calls import apply_at
from evolvent.kernels.viscoelastic import excess_square, lost_square, note_rate, relax, relaxed_over
from evolvent.model import BY_DAMPER, BY_FRICTION, MODEL

USED_FOR = "coordinates"
_I = types.int64
#: Angle that a step may turn a joint coordinate by at the rate of its start, and at the mean of both ends, rad; the
#: quarter turns of its start distinguish turns up to 3/4 pi.
MOST_TURNED, LIMIT_TURNED = 1.5, 2.2


@indirect(void(_I, VECTOR, INTEGERS, MODEL))
def measure_coordinates(end, y, s, model):
    """All coordinates at the start (end 0) or the end (1) of an interval, by the bodies' current positions."""
    for k in range(model.coordinates.size):
        axial.measure_end(model.coordinates, model.bodies, k, y, s[model.coordinates[k].switch], end)


@inlined
def _over(coordinates, k, x):
    """How far a coordinate is beyond its stops."""
    return max(x - coordinates[k].high, 0.0) + min(x - coordinates[k].low, 0.0)


@inlined
def coordinate_law(coordinates, k, latched, x0, x1, rate):
    """Torque that resists from x0 to x1, derivatives by coordinate and rate, energy at x1, and dissipated power."""
    stiffness, damping, off = coordinates[k].stiffness, coordinates[k].damping, x1 - coordinates[k].rest
    mean, before, over = 0.5 * (x0 + x1), _over(coordinates, k, x0), _over(coordinates, k, x1)
    torque = stiffness * (mean - coordinates[k].rest)
    energy = 0.5 * stiffness * off * off
    if before != 0.0 or over != 0.0:
        if abs(x1 - x0) > SMALL:
            torque += 0.5 * coordinates[k].stop * (over * over - before * before) / (x1 - x0)
        else:
            torque += 0.5 * coordinates[k].stop * (over + before)
        energy += 0.5 * coordinates[k].stop * over * over
    if over != 0.0:
        stiffness += coordinates[k].stop
    if latched != 0:
        off = x1 - coordinates[k].latch
        stiffness += coordinates[k].latch_stiffness
        damping += coordinates[k].latch_damping
        torque += coordinates[k].latch_stiffness * (mean - coordinates[k].latch)
        energy += 0.5 * coordinates[k].latch_stiffness * off * off
    return torque + damping * rate, stiffness, damping, energy, damping * rate * rate


@inlined
def add_applied(t, y, share, kept, s, model):
    """Torques of other parts on all coordinates; returns their energy (J), and the powers that they take and give (W).

    Parameters
    ----------
    share : 1 at the coordinates of the last evaluation, 0.5 half way from the step's start to them
    kept : 1 of a state y with its frictions among the accounts, else 0
    s : (ns,) int, switches
    """
    coordinates, calls, energy, power, driven = model.coordinates, model.torques_apply_calls, 0.0, 0.0, 0.0
    for k in range(coordinates.size):
        coordinates[k].applied = coordinates[k].applied_slope = coordinates[k].applied_damper = 0.0
    for k in range(calls.size):
        stored, lost, given = apply_at(model, calls[k])(t, share, kept, y, s, model)
        energy, power, driven = energy + stored, power + lost, driven + given
    return energy, power, driven


@indirect(types.UniTuple(REAL, 3)(REAL, VECTOR, REAL, INTEGERS, MODEL, VECTOR))
def add_coordinates(t, y, h, s, model, F):
    """Torques of all coordinates over an interval; returns energy at its end (J), powers that are taken and given (W).

    Parameters
    ----------
    t : float, s, middle of the interval
    y, h : as of `axial.measure_between`; with h > 0 after `measure_coordinates` of both ends; or KEPT, of a state with
        its frictions among the accounts
    """
    coordinates, n_q, kept = model.coordinates, model.info.nq, h < 0.0
    h = max(h, 0.0)
    for k in range(coordinates.size):
        axial.measure_between(coordinates, model.bodies, k, y, h, s[coordinates[k].switch])
    share, sticks = (1.0, 1.0) if h == 0.0 else (0.5, 2.0)  # friction is that of the end
    energy, power, driven = add_applied(t, y, share, 1 if kept else 0, s, model)
    for k in range(coordinates.size):
        latched, x, rate = s[coordinates[k].switch + 1], coordinates[k].angle, coordinates[k].rate
        start = x if h == 0.0 else coordinates[k].before
        torque, stiffness, damping, stored, lost = coordinate_law(coordinates, k, latched, start, x, rate)
        if coordinates[k].prony_end > coordinates[k].prony:
            torque, stiffness, stored, lost = _relaxed(h, kept, k, start, torque, stiffness, stored, lost, model)
        if kept:
            moved = x - coordinates[k].before if model.info.stepping != 0 else 0.0
            rubs, stick = kept_friction(y, coordinates, k, moved), 0.0
        else:
            rubs, stick = friction_force(coordinates, k, x)
        coordinates[k].torque, coordinates[k].stored = torque + rubs, stored + bristle_energy(coordinates, k)
        coordinates[k].slope = stiffness + sticks * stick + coordinates[k].applied_slope
        coordinates[k].damper = damping + coordinates[k].applied_damper
        coordinates[k].lost, coordinates[k].latch_lost, coordinates[k].latch_torque = lost, 0.0, 0.0
        if latched != 0:
            coordinates[k].latch_lost = coordinates[k].latch_damping * rate * rate
            coordinates[k].latch_torque = latch_torque(coordinates, k, x, rate)
        energy += coordinates[k].stored
        power += lost
        axial.push(coordinates, model.bodies, n_q, k, coordinates[k].torque + coordinates[k].applied, F)
    return energy, power, driven


@inlined
def _relaxed(h, kept, k, start, torque, stiffness, stored, lost, model):
    """Torque, stiffness, energy and dissipated power of `coordinate_law` with a spring that relaxes."""
    row = model.coordinates[k]
    first, last, branch, own, x1 = row.prony, row.prony_end, row.branch, row.stiffness, row.angle - row.rest
    added, factor = relax(first, last, branch, h, 0.5 * (start + row.angle) - row.rest, x1, model)
    torque, stiffness = torque + own * added, stiffness + own * (factor - 1.0)
    stored += 0.5 * own * excess_square(first, last, branch, x1, model)
    if kept:
        note_rate(first, last, branch, row.rate, model)
        lost += own * lost_square(first, last, branch, model)
    return torque, stiffness, stored, lost


@inlined
def end_relaxation(h, y, model):
    """What relaxation of all coordinates takes over a step of length h that is accepted, J; into the accounts in y."""
    coordinates, taken = model.coordinates, 0.0
    for k in range(coordinates.size):
        if coordinates[k].prony_end > coordinates[k].prony:
            lost = coordinates[k].stiffness * relaxed_over(
                coordinates[k].prony, coordinates[k].prony_end, coordinates[k].branch, h, model
            )
            y[coordinates[k].account + BY_DAMPER] += lost
            taken += lost
    return taken


@inlined
def end_frictions(y, model):
    """Frictions of coordinates at the end of an explicit step into the accounts of the state y; what they take, J.

    After `measure_coordinate` of all coordinates there.
    """
    coordinates, taken = model.coordinates, 0.0
    for k in range(coordinates.size):
        if coordinates[k].friction > 0.0:
            lost = end_kept_friction(y, coordinates, k, coordinates[k].angle - coordinates[k].before)
            y[coordinates[k].account + BY_FRICTION] += lost
            taken += lost
    return taken


@indirect(REAL(INTEGERS, MODEL))
def coordinate_energy(s, model):
    """Energy of all coordinates at the end of the last step, J."""
    coordinates, found = model.coordinates, 0.0
    for k in range(coordinates.size):
        x = coordinates[k].angle
        found += coordinate_law(coordinates, k, s[coordinates[k].switch + 1], x, x, 0.0)[3] + bristle_energy(
            coordinates, k
        )
        if coordinates[k].prony_end > coordinates[k].prony:
            first, last = coordinates[k].prony, coordinates[k].prony_end
            square = excess_square(first, last, coordinates[k].branch, x - coordinates[k].rest, model)
            found += 0.5 * coordinates[k].stiffness * square
    return found


# ------------------------------------------------------------------------------------------------ turns and latches


@inlined
def count_quarter_turns(s, coordinates):
    """Take the angles of the last forces as those of an accepted step: into the switches, and as its start."""
    for k in range(coordinates.size):
        coordinates[k].before, coordinates[k].pace = coordinates[k].angle, coordinates[k].rate
        if coordinates[k].kind != TRAVEL:
            s[coordinates[k].switch] = math.floor(coordinates[k].angle / QUARTER + 0.5)


@indirect(void(REAL, VECTOR, INTEGERS, MODEL))
def note_turns(t, y, s, model):
    """`count_quarter_turns` of a state whose forces have not been evaluated."""
    coordinates, bodies = model.coordinates, model.bodies
    rigid.kinematics(t, y, model)
    for k in range(coordinates.size):
        measure_coordinate(y, s, coordinates, bodies, k)
    count_quarter_turns(s, coordinates)


@indirect(void(REAL, VECTOR, INTEGERS, MODEL), used_for="resistances")
def begin_resistances(t, y, s, model):
    """Make a state at t the start of an implicit run for the bristles of resistances, which are among its accounts."""
    bristles, rows, coordinates = model.bristles, model.resistances, model.coordinates
    rigid.kinematics(t, y, model)
    for k in range(coordinates.size):
        measure_coordinate(y, s, coordinates, model.bodies, k)
    for k in range(rows.size):
        for i in range(rows[k].first, rows[k].last):
            bristles[i].before = coordinates[rows[k].coordinate].angle
            bristles[i].force = bristles[i].force0 = y[bristles[i].account]


@inlined
def longest_step(coordinates):
    """Time in which a coordinate turns by `MOST_TURNED` at the rate of the last step, s; infinity where none turns."""
    pace = 0.0
    for k in range(coordinates.size):
        if coordinates[k].kind != TRAVEL:
            pace = max(pace, abs(coordinates[k].pace))
    return MOST_TURNED / pace if pace > 0.0 else math.inf


@indirect(REAL(REAL, REAL, VECTOR, INTEGERS, MODEL))
def turned_beside(t, h, y, s, model):
    """Angle by which a step of length h to the state y at t turns a coordinate, by its rates, beside the limit."""
    coordinates, found = model.coordinates, 0.0
    rigid.kinematics(t, y, model)
    for k in range(coordinates.size):
        if coordinates[k].kind != TRAVEL:
            measure_coordinate(y, s, coordinates, model.bodies, k)
            found = max(found, 0.5 * h * abs(coordinates[k].pace + coordinates[k].rate))
    return found / LIMIT_TURNED


@inlined
def beside_latch(coordinates, k):
    """How far coordinate k is off its latch, now and before the last step, and its `leaves` and `comes`.

    Of those that latch together the means, by the stiffness of their latches, which lock without a torque in sum.
    """
    first, last = coordinates[k].together, coordinates[k].together_end
    if last == first:
        off, was = coordinates[k].angle - coordinates[k].latch, coordinates[k].before - coordinates[k].latch
        return off, was, coordinates[k].leaves, coordinates[k].comes
    off = was = p = q = whole = 0.0
    for i in range(first, last):
        c = coordinates[i].latch_stiffness
        off += c * (coordinates[i].angle - coordinates[i].latch)
        was += c * (coordinates[i].before - coordinates[i].latch)
        p, q, whole = p + c * coordinates[i].leaves, q + c * coordinates[i].comes, whole + c
    return off / whole, was / whole, p / whole, q / whole


@indirect(void(REAL, VECTOR, INTEGERS, MODEL, _I, VECTOR))
def latch_values(t, y, s, model, first, g):
    """Values of the events of all latches, from g[first] on: angle beyond the latch, -1 where none is open."""
    coordinates, bodies = model.coordinates, model.bodies
    rigid.kinematics(t, y, model)
    for k in range(coordinates.size):
        g[first + k] = -1.0
        switch = coordinates[k].switch
        if s[switch + 1] == 0 and math.isfinite(coordinates[k].latch):
            measure_coordinate(y, s, coordinates, bodies, k)
            for i in range(k + 1, coordinates[k].together_end):
                measure_coordinate(y, s, coordinates, bodies, i)
            g[first + k] = -coordinates[k].side * beside_latch(coordinates, k)[0]


@inlined
def measure_travels(h, last, means, coordinates):
    """How far the coordinates would move in a step of length h at their rates at its start and end, into their records.

    Parameters
    ----------
    last : float, s, length of the step before, 0 for none
    means : bool, whether rates are means over steps, whose parabola gives those at the ends
    """
    for k in range(coordinates.size):
        start, end = coordinates[k].pace, coordinates[k].rate
        if means and last > 0.0:
            bend = (end - start) / (last + h)
            start, end = start + last * bend, end + h * bend
        elif means:
            end = 2.0 * end - start
        coordinates[k].leaves, coordinates[k].comes = h * start, h * end


@inlined
def until_latch(s, model):
    """Part of the step at which the first latch is passed, or a curve of a resistance ends, by a secant.

    1 where there is none, or the step ends on it. What is passed and left again in the step, stops among it, is found
    by `first_passage`, after `measure_travels`.
    """
    coordinates = model.coordinates
    part = until_end_of_curve(s, model) if model.resistances.size > 0 else 1.0
    for k in range(coordinates.size):
        if s[coordinates[k].switch + 1] == 0 and math.isfinite(coordinates[k].latch):
            side = coordinates[k].side
            off, was, p, q = beside_latch(coordinates, k)
            if side * off < -REACHED and side * was > REACHED:
                part = min(part, was / (was - off))
            part = min(part, first_passage(side * was, side * off, side * p, side * q, REACHED))
        if coordinates[k].stop > 0.0:
            x, before, p, q = coordinates[k].angle, coordinates[k].before, coordinates[k].leaves, coordinates[k].comes
            high, low = coordinates[k].high, coordinates[k].low
            if math.isfinite(high):
                part = min(part, first_passage(high - before, high - x, -p, -q, REACHED))
            if math.isfinite(low):
                part = min(part, first_passage(before - low, x - low, p, q, REACHED))
    return part


@inlined
def latch_reached(s, coordinates, k):
    """Whether the open latch of joint coordinate k is reached at the angle of the last step."""
    if s[coordinates[k].switch + 1] != 0 or not math.isfinite(coordinates[k].latch):
        return False
    return coordinates[k].side * beside_latch(coordinates, k)[0] <= REACHED


def coordinate_bound(model):
    """Stiffness (N m/rad) and damping (N m s/rad) of all joint coordinates, every stop reached and every latch locked.

    Not compiled.
    """
    coordinates = model.coordinates
    locked = np.isfinite(coordinates["latch"])
    stiffness = (
        coordinates["stiffness"]
        + np.maximum(coordinates["stop"], 0.0)
        + np.where(locked, coordinates["latch_stiffness"], 0.0)
    )
    stiffness += np.where(coordinates["friction"] > 0.0, coordinates["stick"], 0.0) + resistance_bound(model)
    rows = model.drivetrains
    rubs = (rows["hysteresis"] > 0.0) | (rows["forward"] < 1.0) | (rows["backward"] < 1.0)
    np.add.at(stiffness, rows["coordinate"], np.where(rubs, rows["stick"], 0.0))
    return stiffness, coordinates["damping"] + np.where(locked, coordinates["latch_damping"], 0.0)
