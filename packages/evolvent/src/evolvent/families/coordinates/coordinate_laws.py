"""Laws of a joint's coordinate x, an angle or a travel: motors, synchronizations, latches; and their accounts.

A torque is the generalized force of a coordinate: N m of an angle, N of a travel. Torques are those on the left of the
equations: a positive one resists a growing coordinate. `coordinate` applies them.
"""

import math

from numba import types, void

from evolvent.compiled.jit import INTEGERS, REAL, VECTOR, indirect, inlined
from evolvent.compiled.lookups import spring_law_at
from evolvent.families.coordinates.joint_friction import taken_by_friction
from evolvent.kernels.extremes import note_extremes
from evolvent.kernels.law_means import FOLLOWS, SPRING, following_torque, scalar_mean, scalar_slope
from evolvent.kernels.law_slopes import spring_law_slope
from evolvent.kernels.profile import profile
from evolvent.model import BY_DAMPER, BY_FRICTION, BY_LATCH, FRICTION_FORCE, MODEL

USED_FOR = "coordinates"
#: Fields of coordinates whose extremes over all steps are kept.
EXTREMES = ("angle", "rate", "torque", "rubs", "latch_torque")
ANGLE, RATE, TORQUE, RUBS, LATCH_TORQUE = range(len(EXTREMES))
#: Kinds of motors.
BY_PROFILE, BY_LAW, BY_MOTION, BY_VOLTAGE, BY_CURRENT = range(5)


# ------------------------------------------------------------------------------------------------ motors


@indirect(void(REAL, REAL, INTEGERS, MODEL), used_for="motors")
def add_motors(t, share, s, model):
    """Add the torques of all motors to their coordinates; one that is switched off has none.

    Parameters
    ----------
    share : 1 at the coordinates of the last evaluation, 0.5 half way from the step's start to them
    s : (ns,) int, switches
    """
    coordinates, motors, over = model.coordinates, model.motors, model.info.over
    for k in range(motors.size):
        h, p = motors[k].coordinate, model.parameters[motors[k].first : motors[k].last]
        x, v = (
            coordinates[h].angle + (1.0 - share) * (coordinates[h].before - coordinates[h].angle),
            coordinates[h].rate,
        )
        motors[k].on = 1.0
        if motors[k].kind == BY_MOTION and over == 0.0:
            torque = following_torque(t, x, v, motors, k, model)[0]
        elif motors[k].kind == BY_MOTION:
            torque = scalar_mean(FOLLOWS, k, x, v, t, over, p, 0.0, motors[k].limit, model)
        if t >= motors[k].until or (motors[k].switch >= 0 and s[motors[k].switch] != 0):
            torque = motors[k].on = 0.0
        elif motors[k].kind == BY_PROFILE:
            torque = profile(t, motors[k].first, model)
        elif motors[k].kind == BY_LAW and over == 0.0:
            torque = spring_law_at(motors[k].law)(x, v, t, p)
        elif motors[k].kind == BY_LAW:
            torque = scalar_mean(SPRING, motors[k].law, x, v, t, over, p, 0.0, motors[k].limit, model)
        elif motors[k].kind == BY_VOLTAGE:
            constant = motors[k].constant
            torque = constant * (profile(t, motors[k].first, model) - constant * v) / motors[k].resistance
        elif motors[k].kind == BY_CURRENT:
            torque = motors[k].constant * profile(t, motors[k].first, model)
        if motors[k].kind != BY_MOTION and abs(torque) > motors[k].limit:
            torque = math.copysign(motors[k].limit, torque)
        motors[k].time, motors[k].angle, motors[k].rate = t, x, v
        motors[k].torque, motors[k].power = torque, torque * v
        if motors[k].constant > 0.0:
            motors[k].current = torque / motors[k].constant
        coordinates[h].applied -= torque


@inlined
def motor_power(model):
    """Power of all motors at the last evaluation, W."""
    power = 0.0
    for k in range(model.motors.size):
        power += model.motors[k].power
    return power


@indirect(void(MODEL), used_for="motors")
def measure_motor_slopes(model):
    """Derivatives of the motors' torques at the last evaluation, into the records of their coordinates."""
    coordinates, motors, over = model.coordinates, model.motors, model.info.over
    for h in range(coordinates.size):
        coordinates[h].motor_slope = coordinates[h].motor_damper = 0.0
    for k in range(motors.size):
        h, t, x, v = motors[k].coordinate, motors[k].time, motors[k].angle, motors[k].rate
        slope = damper = motors[k].slope = motors[k].damper = 0.0
        if motors[k].on == 0.0:
            continue
        p = model.parameters[motors[k].first : motors[k].last]
        if over != 0.0 and motors[k].kind in (BY_MOTION, BY_LAW):
            kind, law = (FOLLOWS, k) if motors[k].kind == BY_MOTION else (SPRING, motors[k].law)
            slope = scalar_slope(kind, law, x, 1.0, v, 0.0, t, over, p, 0.0, motors[k].limit, 1.0, model)
            damper = scalar_slope(kind, law, x, 0.0, v, 1.0, t, over, p, 0.0, motors[k].limit, 1.0, model)
        elif motors[k].kind == BY_MOTION:
            _, slope, damper = following_torque(t, x, v, motors, k, model)
        elif motors[k].kind == BY_LAW and abs(motors[k].torque) < motors[k].limit:
            slope = spring_law_slope(motors[k].law, x, 1.0, v, 0.0, t, p, 1.0)
            damper = spring_law_slope(motors[k].law, x, 0.0, v, 1.0, t, p, 1.0)
        elif motors[k].kind == BY_VOLTAGE and abs(motors[k].torque) < motors[k].limit:
            damper = -motors[k].constant * motors[k].constant / motors[k].resistance
        motors[k].slope, motors[k].damper = slope, damper
        coordinates[h].motor_slope -= slope
        coordinates[h].motor_damper -= damper


# ------------------------------------------------------------------------------------------------ synchronizations


@inlined
def _stretch(rows, k, a, b):
    """Stretch of cable k at its coordinates a and b."""
    return rows[k].ratio_b * b - rows[k].ratio_a * a - rows[k].offset


@indirect(types.UniTuple(REAL, 2)(REAL, MODEL), used_for="synchronizations")
def add_synchronizations(share, model):
    """Add the torques of all cables between coordinates; returns energy (J, at the end) and power dissipated (W).

    Parameters
    ----------
    share : as of `add_motors`
    """
    coordinates, rows, power = model.coordinates, model.synchronizations, 0.0
    for k in range(rows.size):
        a, b, ra, rb = rows[k].a, rows[k].b, rows[k].ratio_a, rows[k].ratio_b
        rest = 1.0 - share
        xa = coordinates[a].angle + rest * (coordinates[a].before - coordinates[a].angle)
        xb = coordinates[b].angle + rest * (coordinates[b].before - coordinates[b].angle)
        rate, c, d = rb * coordinates[b].rate - ra * coordinates[a].rate, rows[k].stiffness, rows[k].damping
        rows[k].stretch = _stretch(rows, k, xa, xb)
        torque = c * rows[k].stretch + d * rate
        rows[k].torque, rows[k].lost = torque, d * rate * rate
        power += rows[k].lost
        coordinates[a].applied -= ra * torque
        coordinates[b].applied += rb * torque
        coordinates[a].applied_slope += c * ra * ra
        coordinates[b].applied_slope += c * rb * rb
        coordinates[a].applied_damper += d * ra * ra
        coordinates[b].applied_damper += d * rb * rb
    return synchronization_energy(model), power


@inlined
def synchronization_energy(model):
    """Energy of all cables between coordinates at the last evaluation, J."""
    coordinates, rows, energy = model.coordinates, model.synchronizations, 0.0
    for k in range(rows.size):
        e = _stretch(rows, k, coordinates[rows[k].a].angle, coordinates[rows[k].b].angle)
        rows[k].energy = 0.5 * rows[k].stiffness * e * e
        energy += rows[k].energy
    return energy


# ------------------------------------------------------------------------------------------------ latches, accounts


@inlined
def latch_torque(coordinates, k, x, rate):
    """Torque of the latch of coordinate k where it has locked."""
    return coordinates[k].latch_stiffness * (x - coordinates[k].latch) + coordinates[k].latch_damping * rate


@inlined
def lock(s, coordinates, k):
    """Lock the latch of coordinate k, at the coordinate and rate of the last evaluation."""
    s[coordinates[k].switch + 1] = 1
    coordinates[k].caught = coordinates[k].rate
    caught = latch_torque(coordinates, k, coordinates[k].angle, coordinates[k].rate)
    note_extremes(coordinates[k].extremes, LATCH_TORQUE, caught)


@inlined
def note_coordinates(coordinates):
    """Take the last evaluation of all coordinates into their extremes over all steps."""
    for k in range(coordinates.size):
        note_extremes(coordinates[k].extremes, ANGLE, coordinates[k].angle)
        note_extremes(coordinates[k].extremes, RATE, coordinates[k].rate)
        note_extremes(coordinates[k].extremes, TORQUE, coordinates[k].torque)
        note_extremes(coordinates[k].extremes, RUBS, coordinates[k].rubs)
        note_extremes(coordinates[k].extremes, LATCH_TORQUE, coordinates[k].latch_torque)


@inlined
def write_account_rates(model, dy):
    """Rates of the accounts of coordinates under explicit methods, at the last evaluation."""
    coordinates = model.coordinates
    for k in range(coordinates.size):
        dy[coordinates[k].account + BY_DAMPER] = coordinates[k].lost - coordinates[k].latch_lost
        dy[coordinates[k].account + BY_LATCH] = coordinates[k].latch_lost


@indirect(REAL(REAL, REAL, VECTOR, MODEL))
def end_coordinate_step(h, share, y, model):
    """Accept a step of length h: accounts of coordinates in y, anchors of frictions; returns what friction takes, J.

    Parameters
    ----------
    share : 1 where the powers of the last evaluation are those of the step's end, 0.5 where they are means over it

    Notes
    -----
    Friction takes the work of its forces, those of both ends halfway, less what the bristle stores. Where its force of
    the end acts over the whole step, as under energy-momentum, that is stick (z1 slip + (z1 - z0)^2/2).
    """
    coordinates, now, rubbed = model.coordinates, (0.5 if share == 1.0 else 1.0) * h, 0.0
    then = h - now
    for k in range(coordinates.size):
        at = coordinates[k].account
        latch = now * coordinates[k].latch_lost + then * coordinates[k].latch_lost0
        y[at + BY_LATCH] += latch
        y[at + BY_DAMPER] += now * coordinates[k].lost + then * coordinates[k].lost0 - latch
        coordinates[k].lost0, coordinates[k].latch_lost0 = coordinates[k].lost, coordinates[k].latch_lost
        if coordinates[k].friction > 0.0:
            taken = taken_by_friction(coordinates, k, coordinates[k].angle, coordinates[k].before, share)
            y[at + BY_FRICTION] += taken
            y[at + FRICTION_FORCE] = coordinates[k].stick * coordinates[k].bristle
            rubbed += taken
    return rubbed
