"""Resistances on a joint's coordinate x that depend on its path: harnesses, tape-spring hinges, adhesion.

A resistance is an elastic curve T(x), a table with straight lines between its rows, and bristles (`bristle`) beside it.
A torque is one on the left of the equations: a positive one resists a growing coordinate.

A curve may end at an angle, where the resistance changes over to another curve at once: a tape-spring that buckles, or
an adhesion that breaks. Steps end there; what the energy falls by is lost. Beyond its rows a curve goes on straight. A
viscoelastic curve relaxes by `relaxing_curve`; at a change over the strains of its branches stay.
"""

import math

import numpy as np
from numba import types

from evolvent.compiled.jit import INTEGERS, REAL, VECTOR, indirect, inlined
from evolvent.families.coordinates.excursion import first_passage
from evolvent.families.coordinates.joint_friction import NEAR
from evolvent.families.coordinates.relaxing_curve import excess_energy, relaxed_torque, snap
from evolvent.kernels.axial import SMALL
from evolvent.kernels.bristle import SLIP, bristle_between, energy_taken
from evolvent.kernels.profile import row_before
from evolvent.model import MODEL

USED_FOR = "resistances"
#: Kinds of resistances.
HARNESS, TAPE_SPRING, ADHESION = 0, 1, 2
#: A coordinate this near to the end of a curve, rad or m, has reached it.
AT_END = 1e-10


# ------------------------------------------------------------------------------------------------ curves


@inlined
def _slope(p, first, n, i):
    """Slope of a curve behind its row i."""
    return (p[first + n + i + 1] - p[first + n + i]) / (p[first + i + 1] - p[first + i])


@inlined
def curve_energy(p, curves, c, x):
    """Energy of curve c at x, J."""
    first, n = curves[c].first, curves[c].count
    i = row_before(p, first, n, x)
    d = x - p[first + i]
    return p[first + 2 * n + i] + d * (p[first + n + i] + 0.5 * _slope(p, first, n, i) * d)


@inlined
def curve_between(p, curves, c, x0, x1):
    """Mean torque of curve c from x0 to x1, and twice its derivative by x1; of a state x0 = x1 both are plain.

    Parameters
    ----------
    p : parameters, among them the curve's: its coordinates, torques and energies, `count` of each
    """
    first, n = curves[c].first, curves[c].count
    i, j = row_before(p, first, n, x0), row_before(p, first, n, x1)
    slope = _slope(p, first, n, j)
    end = p[first + n + j] + slope * (x1 - p[first + j])
    if i == j or abs(x1 - x0) < SMALL:
        return end - 0.5 * slope * (x1 - x0), slope
    up = 1 if x1 > x0 else 0
    a, b, t_a, t_b = p[first + i + up], p[first + j + 1 - up], p[first + n + i + up], p[first + n + j + 1 - up]
    area = (a - x0) * (t_a - 0.5 * _slope(p, first, n, i) * (a - x0))
    area += p[first + 2 * n + j + 1 - up] - p[first + 2 * n + i + up] + 0.5 * (x1 - b) * (t_b + end)
    mean = area / (x1 - x0)
    return mean, 2.0 * (end - mean) / (x1 - x0)


# ------------------------------------------------------------------------------------------------ bristles


@inlined
def _end_of_bristle(bristles, i, start, moved):
    """`bristle_between` of a step of generalized-alpha, which acts by the force of its end.

    Slip and stick are an active set, as of `joint_friction.friction_force`: what slips sticks once it moves back,
    without a limit in that evaluation.
    """
    stick, limit = bristles[i].stick, bristles[i].limit
    end, mean, by_end, by_mean = bristle_between(bristles[i].kind, stick, limit, start, moved)
    if bristles[i].kind == SLIP:
        free, slips = start + stick * moved, bristles[i].slips
        if (slips == 0.0 and abs(free) <= limit) or (slips != 0.0 and slips * free < limit * (1.0 - NEAR)):
            bristles[i].slips = 0.0
            return free, mean, stick, by_mean
        bristles[i].slips = 1.0 if free > 0.0 else -1.0
        return bristles[i].slips * limit, mean, 0.0, by_mean
    return end, mean, by_end, by_mean


@inlined
def _start_of(y, rows, bristles, i, kept):
    """Force of bristle i at the start of an interval: of the last step, or among the accounts of a state."""
    return y[bristles[i].account] if kept else bristles[i].force0


# ------------------------------------------------------------------------------------------------ resistances


@indirect(types.UniTuple(REAL, 2)(VECTOR, REAL, types.int64, INTEGERS, MODEL))
def add_resistances(y, share, kept, s, model):
    """Add the torques of all resistances to their coordinates; returns their energy at the end, J, and power lost, W.

    Parameters
    ----------
    share : 1 at the coordinates of the last evaluation, 0.5 for the mean from the step's start to them
    kept : 1 of a state whose bristles are among the accounts of y, else 0
    """
    coordinates, rows, bristles, energy, power = model.coordinates, model.resistances, model.bristles, 0.0, 0.0
    for k in range(rows.size):
        h = rows[k].coordinate
        x, before = coordinates[h].angle, coordinates[h].before
        curve = rows[k].curve + s[rows[k].switch]
        if kept != 0:
            curve = _curve_of_state(rows, model.curves, k, curve, x)
        torque, slope = curve_between(model.parameters, model.curves, curve, x if share == 1.0 else before, x)
        stored, rubs = curve_energy(model.parameters, model.curves, curve, x), 0.0
        if rows[k].prony_end > rows[k].prony:
            added, by_x, excess, lost = relaxed_torque(k, curve, share, before, x, torque, model)
            torque, slope, stored, power = torque + added, slope + by_x, stored + excess, power + lost
        for i in range(rows[k].first, rows[k].last):
            moved = x - (before if kept != 0 else bristles[i].before)
            if kept != 0 and model.info.stepping == 0:
                moved = 0.0
            stick, start = bristles[i].stick, _start_of(y, rows, bristles, i, kept != 0)
            if kept == 0 and share == 1.0:
                end, mean, by_end, by_mean = _end_of_bristle(bristles, i, start, moved)
            else:
                end, mean, by_end, by_mean = bristle_between(bristles[i].kind, stick, bristles[i].limit, start, moved)
            bristles[i].force = end
            rubs += end if share == 1.0 else mean
            slope += 0.0 if kept != 0 else (by_end if share == 1.0 else by_mean)
            stored += 0.5 * end * end / stick
        rows[k].angle, rows[k].rate = x, coordinates[h].rate
        rows[k].torque, rows[k].rubs, rows[k].stored = torque + rubs, rubs, stored
        coordinates[h].applied += torque + rubs
        coordinates[h].applied_slope += slope
        energy += stored
    return energy, power


@inlined
def _curve_of_state(rows, curves, k, curve, x):
    """The curve on which resistance k is at x, from one of its curves on."""
    if x < curves[curve].low:
        return rows[k].curve + curves[curve].below
    if x > curves[curve].high:
        return rows[k].curve + curves[curve].above
    return curve


@indirect(REAL(INTEGERS, MODEL))
def resistance_energy(s, model):
    """Energy of all resistances at the coordinates and the bristles of the last evaluation, J."""
    rows, bristles, found = model.resistances, model.bristles, 0.0
    for k in range(rows.size):
        x = model.coordinates[rows[k].coordinate].angle
        curve = rows[k].curve + s[rows[k].switch]
        found += curve_energy(model.parameters, model.curves, curve, x) + excess_energy(k, curve, x, model)
    for i in range(bristles.size):
        found += 0.5 * bristles[i].force * bristles[i].force / bristles[i].stick
    return found


@indirect(REAL(VECTOR, types.int64, REAL, MODEL))
def end_resistances(y, kept, share, model):
    """Accept a step at the coordinates of the last evaluation: bristles and losses into y; returns what they take, J.

    Parameters
    ----------
    kept : 1 under explicit methods, whose bristles are among the accounts of y, else 0
    share : 1 where forces of the ends of the step did the work, as under generalized-alpha, 0.5 where that were means
    """
    coordinates, rows, bristles, taken = model.coordinates, model.resistances, model.bristles, 0.0
    for k in range(rows.size):
        lost, h = 0.0, rows[k].coordinate
        x = coordinates[h].angle
        for i in range(rows[k].first, rows[k].last):
            moved = x - (coordinates[h].before if kept != 0 else bristles[i].before)
            stick, start = bristles[i].stick, _start_of(y, rows, bristles, i, kept != 0)
            end, mean, _, _ = bristle_between(bristles[i].kind, stick, bristles[i].limit, start, moved)
            if share == 1.0:
                mean = 0.5 * (start + end)
            lost += energy_taken(stick, start, end, mean, moved)
            bristles[i].force = bristles[i].force0 = y[bristles[i].account] = end
            bristles[i].before = x
        y[rows[k].account] += lost
        taken += lost
    return taken


@indirect(REAL(INTEGERS, MODEL))
def until_end_of_curve(s, model):
    """Part of the step at which the first curve ends; 1 where none does, or the step ends there.

    By a secant; one that ends in the step and is left again (`first_passage`) is found as well.
    """
    coordinates, rows, curves, part = model.coordinates, model.resistances, model.curves, 1.0
    for k in range(rows.size):
        c, h = rows[k].curve + s[rows[k].switch], rows[k].coordinate
        x, before = coordinates[h].angle, coordinates[h].before
        for end, sense in ((curves[c].high, 1.0), (curves[c].low, -1.0)):
            if math.isfinite(end) and sense * (x - end) > AT_END and sense * (before - end) < -AT_END:
                part = min(part, (end - before) / (x - before))
            if math.isfinite(end):
                p, q = -sense * coordinates[h].leaves, -sense * coordinates[h].comes
                part = min(part, first_passage(sense * (end - before), sense * (end - x), p, q, AT_END))
    return part


@indirect(REAL(REAL, VECTOR, INTEGERS, MODEL))
def change_curves(t, y, s, model):
    """Change over to other curves where those of the last step have ended; returns the energy that is lost, J.

    Not a number where none has.
    """
    rows, curves, p, found, taken = model.resistances, model.curves, model.parameters, False, 0.0
    for k in range(rows.size):
        c, x = rows[k].curve + s[rows[k].switch], model.coordinates[rows[k].coordinate].angle
        after = c
        if x >= curves[c].high - AT_END:
            after = rows[k].curve + curves[c].above
        elif x <= curves[c].low + AT_END:
            after = rows[k].curve + curves[c].below
        if after != c:
            lost = snap(k, after, x, y, model) * (curve_energy(p, curves, c, x) - curve_energy(p, curves, after, x))
            s[rows[k].switch] = after - rows[k].curve
            y[rows[k].account] += lost
            rows[k].time, rows[k].changes = t, rows[k].changes + 1.0
            taken += lost
            found = True
    return taken if found else math.nan


def resistance_bound(model):
    """Largest stiffness that the resistances have on each coordinate, N m/rad or N/m: (n,) float. Not compiled."""
    found = np.zeros(model.coordinates.size)
    for row in model.resistances:
        found[row["coordinate"]] += model.bristles["stick"][row["first"] : row["last"]].sum()
        slopes = [0.0]
        for curve in model.curves[row["curve"] : row["curve"] + row["curves"]]:
            first, n = int(curve["first"]), int(curve["count"])
            x, torque = model.parameters[first : first + n], model.parameters[first + n : first + 2 * n]
            slopes += list(np.diff(torque) / np.diff(x))
        found[row["coordinate"]] += max(slopes)
    return found
