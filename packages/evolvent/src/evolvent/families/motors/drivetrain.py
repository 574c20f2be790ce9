"""What a motor on a joint's coordinate x loses before the joint: detent, eddy currents, magnetic hysteresis, gear.

The rotor turns by n dx, n the ratio. Of the motor's torque T at the joint, D = T - n A sin(N n (x - x0)) - n^2 b x'
comes to the gear: less a detent torque of the amplitude A and that of eddy currents. Magnetic hysteresis, H = n h,
and the gear resist as friction does, by a bristle (`joint_friction.friction_force`) with the limit
- H + (1 - e) (D s - H) where the motor drives, D s > H: the joint has e (D s - H);
- (H - D s)/e_b + D s where the load drives: it must overcome (H - D s)/e_b;
s the sense of the motion that is resisted, e and e_b the efficiencies. With e_b = 0 the gear locks itself, up to a
torque that it `holds`. The detent has the energy (A/N) (1 - cos(N n (x - x0))), whose change over an interval is its
work.
"""

import math

from numba import types, void

from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.families.coordinates.joint_friction import (
    bristle_energy,
    end_kept_friction,
    friction_force,
    kept_friction,
    taken_by_friction,
)
from evolvent.model import BY_COPPER, BY_EDDY, BY_GEAR, BY_HYSTERESIS, FRICTION_FORCE, MODEL

USED_FOR = "drivetrains"
#: Part of what a self-locking gear holds over which it is released as the motor begins to drive.
_RELEASE = 0.01


@inlined
def _detent(rows, k, x0, x1):
    """Mean torque of the detent from x0 to x1, and twice its derivative by x1; of a state x0 = x1 both are plain."""
    size, turns = rows[k].ratio * rows[k].detent, rows[k].detents * rows[k].ratio
    mid, half = turns * (0.5 * (x0 + x1) - rows[k].offset), 0.5 * turns * (x1 - x0)
    sinc, bend = 1.0 - half * half / 6.0, -half / 3.0
    if abs(half) > 1e-3:
        sinc = math.sin(half) / half
        bend = (math.cos(half) - sinc) / half
    sine, cosine = math.sin(mid), math.cos(mid)
    return size * sine * sinc, size * turns * (cosine * sinc + sine * bend)


@inlined
def _detent_energy(rows, k, x):
    """Energy of the detent at x, J."""
    if rows[k].detent == 0.0:
        return 0.0
    return rows[k].detent / rows[k].detents * (1.0 - math.cos(rows[k].detents * rows[k].ratio * (x - rows[k].offset)))


@inlined
def friction_limit(rows, k, push):
    """Largest friction where the motor pushes by D s = `push` in the sense of the motion, and its derivative."""
    magnetic, forward, backward = rows[k].ratio * rows[k].hysteresis, rows[k].forward, rows[k].backward
    over = push - magnetic
    if backward > 0.0:
        if over > 0.0:
            return magnetic + (1.0 - forward) * over, 1.0 - forward
        return push - over / backward, 1.0 - 1.0 / backward
    holds, width = rows[k].holds, _RELEASE * rows[k].holds
    if over <= 0.0:
        return magnetic + holds, 0.0
    limit, slope = magnetic + (1.0 - forward) * over, 1.0 - forward
    if over < width:
        return limit + holds * (1.0 - over / width), slope - holds / width
    return limit, slope


@indirect(types.UniTuple(REAL, 2)(VECTOR, REAL, types.int64, MODEL))
def add_drivetrains(y, share, kept, model):
    """Add the torques of all drivetrains, after those of the motors; returns energy (J) and power of eddies (W).

    Parameters
    ----------
    share, kept : as of `resistance.add_resistances`
    """
    coordinates, rows, motors, energy, power = model.coordinates, model.drivetrains, model.motors, 0.0, 0.0
    for k in range(rows.size):
        h = rows[k].coordinate
        x, before, rate = coordinates[h].angle, coordinates[h].before, coordinates[h].rate
        detent, slope = _detent(rows, k, x if share == 1.0 else before, x)
        eddy = rows[k].ratio * rows[k].ratio * rows[k].eddy
        drive = motors[rows[k].motor].torque - detent - eddy * rate
        moved = x - before if model.info.stepping != 0 else 0.0
        trial = x - rows[k].anchor
        if kept != 0:
            trial = y[rows[k].account + FRICTION_FORCE] + rows[k].stick * moved
        rows[k].friction, rows[k].by_push = friction_limit(rows, k, drive if trial > 0.0 else -drive)
        stick = rubs = 0.0
        if rows[k].friction <= 0.0:
            rows[k].bristle = rows[k].rubs = rows[k].slips = 0.0
        if kept != 0:
            rubs = kept_friction(y, rows, k, moved)
        else:
            rubs, stick = friction_force(rows, k, x)
        rows[k].slope, rows[k].damper = slope, eddy
        rows[k].lost, rows[k].copper = eddy * rate * rate, copper_power(rows, motors, k)
        rows[k].cogging, rows[k].torque = detent, drive - rubs
        rows[k].stored = _detent_energy(rows, k, x) + bristle_energy(rows, k)
        coordinates[h].applied += detent + eddy * rate + rubs
        coordinates[h].applied_slope += slope + (stick if share == 1.0 else 2.0 * stick)
        coordinates[h].applied_damper += eddy
        energy += rows[k].stored
        power += rows[k].lost
    return energy, power


@inlined
def copper_power(rows, motors, k):
    """Power that the winding takes, W."""
    current = motors[rows[k].motor].current
    return motors[rows[k].motor].resistance * current * current


@indirect(void(MODEL))
def add_drivetrain_slopes(model):
    """What the limit of friction changes with the motor's torque, into the records of coordinates.

    After `coordinate_laws.measure_motor_slopes`.
    """
    coordinates, rows, motors = model.coordinates, model.drivetrains, model.motors
    for k in range(rows.size):
        if rows[k].slips != 0.0:
            h, by = rows[k].coordinate, rows[k].by_push
            coordinates[h].motor_slope += by * (motors[rows[k].motor].slope - rows[k].slope)
            coordinates[h].motor_damper += by * (motors[rows[k].motor].damper - rows[k].damper)


@indirect(REAL(MODEL))
def drivetrain_energy(model):
    """Energy of all detents and bristles at the coordinates of the last evaluation, J."""
    rows, found = model.drivetrains, 0.0
    for k in range(rows.size):
        found += _detent_energy(rows, k, model.coordinates[rows[k].coordinate].angle) + bristle_energy(rows, k)
    return found


@indirect(REAL(REAL, REAL, VECTOR, types.int64, MODEL))
def end_drivetrains(h, share, y, kept, model):
    """Accept a step of length h: accounts of drivetrains in y; returns what friction takes, J.

    Parameters
    ----------
    share : as of `coordinate_laws.end_coordinate_step`
    kept : 1 under explicit methods, whose frictions are among the accounts of y, and which integrate powers; else 0
    """
    rows, rubbed = model.drivetrains, 0.0
    now = (0.5 if share == 1.0 else 1.0) * h
    then = h - now
    for k in range(rows.size):
        at = rows[k].account
        x, before = model.coordinates[rows[k].coordinate].angle, model.coordinates[rows[k].coordinate].before
        limit = rows[k].friction
        magnetic = rows[k].ratio * rows[k].hysteresis / limit if limit > 0.0 else 0.0
        if kept != 0:
            taken = end_kept_friction(y, rows, k, x - before)
        else:
            taken = taken_by_friction(rows, k, x, before, share)
            y[at + FRICTION_FORCE] = rows[k].stick * rows[k].bristle
            y[at + BY_EDDY] += now * rows[k].lost + then * rows[k].lost0
            y[at + BY_COPPER] += now * rows[k].copper + then * rows[k].copper0
            rows[k].lost0, rows[k].copper0 = rows[k].lost, rows[k].copper
        y[at + BY_HYSTERESIS] += min(magnetic, 1.0) * taken
        y[at + BY_GEAR] += (1.0 - min(magnetic, 1.0)) * taken
        rubbed += taken
    return rubbed


@inlined
def write_drivetrain_rates(model, dy):
    """Rates of the accounts of drivetrains under explicit methods, at the last evaluation."""
    rows = model.drivetrains
    for k in range(rows.size):
        dy[rows[k].account + BY_EDDY], dy[rows[k].account + BY_COPPER] = rows[k].lost, rows[k].copper
