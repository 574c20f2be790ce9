"""Coulomb friction of a joint's coordinate x, an angle or a travel, of joints, of drivetrains and of bearings.

Friction is a `bristle` that slips: force = stick z, abs(force) <= friction, z the deflection of the bristle, which has
no force at `anchor`. Within a step the anchor stays; its end moves the anchor to x - z.
"""

import math

from evolvent.compiled.jit import inlined
from evolvent.kernels.bristle import SLIP, bristle_between, energy_taken
from evolvent.model import FRICTION_FORCE

#: Numerical damping of friction that sticks, under generalized-alpha.
RELAX = 0.5
#: Part of the friction below which it is round-off that a coordinate moves back.
NEAR = 1e-6


@inlined
def friction_force(coordinates, k, x):
    """Friction at the coordinate x, and its derivative."""
    friction = coordinates[k].friction
    if friction <= 0.0:
        return 0.0, 0.0
    return stick_or_slip(coordinates, k, x, friction, friction)


@inlined
def stick_or_slip(rows, k, x, limit, friction):
    """Force of bristle k at x, and its derivative: at most `limit` where it sticks, `friction` where it slips.

    Notes
    -----
    Of a bristle that sticks the force is stick (z + relax (z - z0)), z0 at the step's start: generalized-alpha, which
    barely damps, would let a stiff bristle ring from slip to slip. Energy-momentum damps it by itself, since the force
    of the end acts over the whole step.

    Slip and stick are an active set: a coordinate that slips sticks once it moves back, without a limit of its force in
    that evaluation. Newton's method then needs a few iterations for a change of the set, where it could go to and fro
    for ever between slip one way and the other.
    """
    stick, relax, z0 = rows[k].stick, rows[k].relax, rows[k].bristle0
    z, slips, slope = x - rows[k].anchor, rows[k].slips, (1.0 + relax) * stick
    force = slope * z - relax * stick * z0
    if (slips == 0.0 and abs(force) <= limit) or (slips != 0.0 and slips * force < limit * (1.0 - NEAR)):
        rows[k].slips, rows[k].bristle, rows[k].rubs = 0.0, z, force
        return force, slope
    sense = 1.0 if force > 0.0 else -1.0
    rows[k].slips, rows[k].rubs = sense, sense * friction
    rows[k].bristle = (sense * friction + relax * stick * z0) / slope
    return sense * friction, 0.0


@inlined
def kept_friction(y, coordinates, k, moved):
    """Friction at a coordinate that has moved since a state whose friction is among the accounts of y."""
    friction, stick = coordinates[k].friction, coordinates[k].stick
    if friction <= 0.0:
        return 0.0
    force = min(max(y[coordinates[k].account + FRICTION_FORCE] + stick * moved, -friction), friction)
    coordinates[k].bristle, coordinates[k].rubs = force / stick, force
    return force


@inlined
def end_kept_friction(y, rows, k, moved):
    """Make a state that has moved since the last one the start of the next step for friction k; what that has taken, J.

    Notes
    -----
    Where friction slips all along, its mean force is that of both ends, since its limit may change; else it reaches the
    limit, that of the end, within the step.
    """
    at, stick, limit = rows[k].account + FRICTION_FORCE, rows[k].stick, rows[k].friction
    start, end = y[at], kept_friction(y, rows, k, moved)
    mean = 0.5 * (start + end)
    if rows[k].slips * moved <= 0.0:
        _, mean, _, _ = bristle_between(SLIP, stick, limit, start, moved)
    rows[k].slips = math.copysign(1.0, end) if abs(end) >= limit else 0.0
    y[at] = end
    return energy_taken(stick, start, end, mean, moved)


@inlined
def taken_by_friction(rows, k, angle, before, share):
    """What friction k has taken in a step from the coordinate `before` to `angle` (J), whose end becomes its start.

    Parameters
    ----------
    share : as of `end_coordinate_step`
    """
    z, z0, stick = rows[k].bristle, rows[k].bristle0, rows[k].stick
    slip = angle - rows[k].anchor - z
    taken = stick * (z * slip + 0.5 * (z - z0) * (z - z0))
    if share == 1.0:
        taken = 0.5 * (rows[k].rubs0 + rows[k].rubs) * (angle - before) - 0.5 * stick * (z * z - z0 * z0)
    rows[k].anchor, rows[k].bristle0, rows[k].rubs0 = angle - z, z, rows[k].rubs
    return taken


@inlined
def bristle_energy(coordinates, k):
    """Energy of the bristle of coordinate k, J."""
    return 0.5 * coordinates[k].stick * coordinates[k].bristle * coordinates[k].bristle
