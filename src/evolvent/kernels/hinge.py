"""Coordinates of joints with spring, damper, stops, latch and friction: angles of hinges, and travels.

They are measured by `axial`; an angle is continuous over any number of turns. Each has two switches in the state: the
angle of the last step in quarter turns, rounded, which gives the number of whole turns, and whether the latch has
locked. A force acts over an interval of time, of which a state is one of length zero: the one of spring, stops and
latch is the change of their energy over that of the coordinate; motors and synchronizations act by the mean
coordinates, friction by its force at the end.
"""

import math

import numpy as np
from numba import types, void

from evolvent.compiled.jit import INTEGERS, REAL, VECTOR, entry, indirect, inlined
from evolvent.kernels import axial, rigid
from evolvent.kernels.axial import QUARTER, SMALL, TRAVEL
from evolvent.kernels.coordinate import (
    add_motors,
    add_synchronizations,
    bristle_energy,
    friction_force,
    kept_friction,
    latch_torque,
    note_peaks,
    synchronization_energy,
)
from evolvent.model import BY_FRICTION, FRICTION_FORCE, MODEL, family_type

_I = types.int64
#: Angle that a step may turn a hinge by, rad; the quarter turns of its start distinguish turns up to 3/4 pi.
MOST_TURNED = 1.5
#: An angle this near to the latch's, rad, has reached it.
REACHED = 1e-10


@entry(VECTOR, INTEGERS, family_type("hinges"), family_type("bodies"), types.int64)
@inlined
def measure_coordinate(y, s, hinges, bodies, k):
    """Coordinate k of a state and its rate, second side and direction of its force, into its record."""
    axial.measure_between(hinges, bodies, k, y, 0.0, s[hinges[k].switch])


@indirect(void(_I, VECTOR, INTEGERS, MODEL))
def measure_hinges(end, y, s, model):
    """All coordinates at the start (end 0) or the end (1) of an interval, by the bodies' current positions."""
    for k in range(model.hinges.size):
        axial.measure_end(model.hinges, model.bodies, k, y, s[model.hinges[k].switch], end)


@inlined
def _over(hinges, k, x):
    """How far a coordinate is beyond its stops."""
    return max(x - hinges[k].high, 0.0) + min(x - hinges[k].low, 0.0)


@inlined
def hinge_law(hinges, k, latched, x0, x1, rate):
    """Torque that resists from x0 to x1, derivatives by coordinate and rate, energy at x1, and dissipated power."""
    stiffness, damping, off = hinges[k].stiffness, hinges[k].damping, x1 - hinges[k].rest
    mean, before, over = 0.5 * (x0 + x1), _over(hinges, k, x0), _over(hinges, k, x1)
    torque = stiffness * (mean - hinges[k].rest)
    energy = 0.5 * stiffness * off * off
    if before != 0.0 or over != 0.0:
        if abs(x1 - x0) > SMALL:
            torque += 0.5 * hinges[k].stop * (over * over - before * before) / (x1 - x0)
        else:
            torque += 0.5 * hinges[k].stop * (over + before)
        energy += 0.5 * hinges[k].stop * over * over
    if over != 0.0:
        stiffness += hinges[k].stop
    if latched != 0:
        off = x1 - hinges[k].latch
        stiffness += hinges[k].latch_stiffness
        damping += hinges[k].latch_damping
        torque += hinges[k].latch_stiffness * (mean - hinges[k].latch)
        energy += 0.5 * hinges[k].latch_stiffness * off * off
    return torque + damping * rate, stiffness, damping, energy, damping * rate * rate


@inlined
def add_applied(t, share, s, model):
    """Torques of motors and synchronizations of all coordinates; returns the latter's energy (J) and power lost (W).

    Parameters
    ----------
    share, s : as of `coordinate.add_motors`
    """
    hinges = model.hinges
    for k in range(hinges.size):
        hinges[k].applied = hinges[k].applied_slope = hinges[k].applied_damper = 0.0
    if model.motors.size > 0:
        add_motors(t, share, s, model)
    if model.synchronizations.size > 0:
        return add_synchronizations(share, model)
    return 0.0, 0.0


@indirect(types.UniTuple(REAL, 2)(REAL, VECTOR, REAL, INTEGERS, MODEL, VECTOR))
def add_hinges(t, y, h, s, model, F):
    """Torques of all coordinates over an interval; returns energy at its end (J) and power that dampers take (W).

    Parameters
    ----------
    t : float, s, middle of the interval
    y, h : as of `axial.measure_between`; with h > 0 after `measure_hinges` of both ends; or KEPT, of a state with its
        frictions among the accounts
    """
    hinges, n_q, kept = model.hinges, model.info.nq, h < 0.0
    h = max(h, 0.0)
    for k in range(hinges.size):
        axial.measure_between(hinges, model.bodies, k, y, h, s[hinges[k].switch])
    share, sticks = (1.0, 1.0) if h == 0.0 else (0.5, 2.0)  # friction is that of the end
    energy, power = add_applied(t, share, s, model)
    for k in range(hinges.size):
        latched, x, rate = s[hinges[k].switch + 1], hinges[k].angle, hinges[k].rate
        start = x if h == 0.0 else hinges[k].before
        torque, stiffness, damping, stored, lost = hinge_law(hinges, k, latched, start, x, rate)
        if kept:
            moved = x - hinges[k].before if model.info.stepping != 0 else 0.0
            rubs, stick = kept_friction(y, hinges, k, moved), 0.0
        else:
            rubs, stick = friction_force(hinges, k, x)
        hinges[k].torque, hinges[k].stored = torque + rubs, stored + bristle_energy(hinges, k)
        hinges[k].slope = stiffness + sticks * stick + hinges[k].applied_slope
        hinges[k].damper = damping + hinges[k].applied_damper
        hinges[k].lost, hinges[k].latch_lost, hinges[k].latch_torque = lost, 0.0, 0.0
        if latched != 0:
            hinges[k].latch_lost = hinges[k].latch_damping * rate * rate
            hinges[k].latch_torque = latch_torque(hinges, k, x, rate)
        energy += hinges[k].stored
        power += lost
        axial.push(hinges, model.bodies, n_q, k, hinges[k].torque + hinges[k].applied, F)
    return energy, power


@inlined
def end_frictions(y, s, model):
    """Frictions at the end of an explicit step into the accounts of the state y there; returns what they take, J."""
    hinges, taken = model.hinges, 0.0
    for k in range(hinges.size):
        if hinges[k].friction > 0.0:
            at, stick, before = hinges[k].account, hinges[k].stick, hinges[k].before
            measure_coordinate(y, s, hinges, model.bodies, k)
            moved, start = hinges[k].angle - before, y[at + FRICTION_FORCE]
            end = kept_friction(y, hinges, k, moved)
            lost = 0.5 * (start + end) * moved - 0.5 * (end * end - start * start) / stick
            y[at + FRICTION_FORCE] = end
            y[at + BY_FRICTION] += lost
            taken += lost
    return taken


@indirect(REAL(INTEGERS, MODEL))
def hinge_energy(s, model):
    """Energy of all coordinates and of the cables between them, at the end of the last step, J."""
    hinges, found = model.hinges, synchronization_energy(model)
    for k in range(hinges.size):
        x = hinges[k].angle
        found += hinge_law(hinges, k, s[hinges[k].switch + 1], x, x, 0.0)[3] + bristle_energy(hinges, k)
    return found


# ------------------------------------------------------------------------------------------------ turns and latches


@inlined
def end_hinge_step(s, hinges):
    """Take the angles of the last forces as those of an accepted step: into the switches, and as its start."""
    for k in range(hinges.size):
        hinges[k].before, hinges[k].pace = hinges[k].angle, 0.0
        if hinges[k].kind != TRAVEL:
            hinges[k].pace = abs(hinges[k].rate)
            s[hinges[k].switch] = math.floor(hinges[k].angle / QUARTER + 0.5)


@indirect(void(REAL, VECTOR, INTEGERS, MODEL))
def note_turns(t, y, s, model):
    """`end_hinge_step` of a state whose forces have not been evaluated."""
    hinges, bodies = model.hinges, model.bodies
    rigid.kinematics(t, y, model)
    for k in range(hinges.size):
        measure_coordinate(y, s, hinges, bodies, k)
    note_peaks(s, hinges, 1.0)
    end_hinge_step(s, hinges)


@inlined
def longest_step(hinges):
    """Time in which a hinge turns by `MOST_TURNED` at the rate of the last step, s; infinity where none turns."""
    pace = 0.0
    for k in range(hinges.size):
        pace = max(pace, hinges[k].pace)
    return MOST_TURNED / pace if pace > 0.0 else math.inf


@indirect(void(REAL, VECTOR, INTEGERS, MODEL, _I, VECTOR))
def latch_values(t, y, s, model, first, g):
    """Values of the events of all latches, from g[first] on: angle beyond the latch, -1 where none is open."""
    hinges, bodies = model.hinges, model.bodies
    rigid.kinematics(t, y, model)
    for k in range(hinges.size):
        g[first + k] = -1.0
        switch = hinges[k].switch
        if s[switch + 1] == 0 and math.isfinite(hinges[k].latch):
            measure_coordinate(y, s, hinges, bodies, k)
            g[first + k] = -hinges[k].side * (hinges[k].angle - hinges[k].latch)


@inlined
def until_latch(s, hinges):
    """Part of the step at which the first latch is passed, by a secant; 1 where none is, or the step ends on it."""
    part = 1.0
    for k in range(hinges.size):
        if s[hinges[k].switch + 1] == 0 and math.isfinite(hinges[k].latch):
            off, before = hinges[k].angle - hinges[k].latch, hinges[k].before - hinges[k].latch
            if hinges[k].side * off < -REACHED and hinges[k].side * before > REACHED:
                part = min(part, before / (before - off))
    return part


@inlined
def latch_reached(s, hinges, k):
    """Whether the open latch of hinge k is reached at the angle of the last step."""
    if s[hinges[k].switch + 1] != 0 or not math.isfinite(hinges[k].latch):
        return False
    return hinges[k].side * (hinges[k].angle - hinges[k].latch) <= REACHED


def hinge_bound(hinges):
    """Stiffness (N m/rad) and damping (N m s/rad) of all hinges, every stop reached and every latch locked.

    Not compiled.
    """
    locked = np.isfinite(hinges["latch"])
    stiffness = hinges["stiffness"] + np.maximum(hinges["stop"], 0.0) + np.where(locked, hinges["latch_stiffness"], 0.0)
    stiffness += np.where(hinges["friction"] > 0.0, hinges["stick"], 0.0)
    return stiffness, hinges["damping"] + np.where(locked, hinges["latch_damping"], 0.0)
