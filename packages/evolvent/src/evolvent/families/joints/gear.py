"""Gears: q_1 + ratio q_2 keeps its value, of two angles or travels between bodies; a kind of the family `joints`.

The coordinates are measured as others (`axial`). The sum of angles counts modulo 2 pi/teeth, so that
angles need no counted turns: whole numbers of teeth make it the same after any number of them.
"""

import math

from numba import types, void

from evolvent.algebra.sparse import SPARSE, first_entry
from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.kernels.axial import ANGLE, gradients, measure_between, measure_end, push, rate_gradients, second_rate
from evolvent.kernels.axial_tangent import add_angle_tangent, add_travel_tangent
from evolvent.kernels.rotations import cross
from evolvent.model import MODEL

USED_FOR = "gear_coordinates"
_I = types.int64


@inlined
def wrapped(sum_, period):
    """A sum of angles, nearest to zero; all of it where the period is 0."""
    return sum_ - period * math.floor(sum_ / period + 0.5) if period > 0.0 else sum_


@indirect(void(_I, REAL, VECTOR, MODEL))
def gear_geometry(k, h, y, model):
    """Gap and rate of gear k of the family `joints` over an interval of length h, and gradients of its coordinates.

    Parameters
    ----------
    y, h : as of `axial.measure_between`; with h > 0 after `measure_gear` of both ends
    """
    joints, rows, held = model.joints, model.gear_coordinates, model.constraints
    total, rate, bends = 0.0, 0.0, 0.0
    for i in range(joints[k].first, joints[k].last):
        measure_between(rows, model.bodies, i, y, h, 0.0)
        total += rows[i].factor * rows[i].angle
        rate += rows[i].factor * rows[i].rate
        if h == 0.0:
            bends += rows[i].factor * second_rate(rows, model.bodies, i, y)
    joints[k].measured, held[k].rate, joints[k].bends = total, rate, bends
    held[k].gap = wrapped(total - joints[k].value, joints[k].radius)


@indirect(void(_I, _I, VECTOR, MODEL))
def measure_gear(k, end, y, model):
    """Coordinates of gear k at the start (end 0) or the end (1) of an interval."""
    for i in range(model.joints[k].first, model.joints[k].last):
        measure_end(model.gear_coordinates, model.bodies, i, y, 0.0, end)


@indirect(void(_I, REAL, MODEL, VECTOR))
def add_gear_force(k, la, model, F):
    """Forces of the multiplier la on the sides of gear k, by the last gradients."""
    joints, rows = model.joints, model.gear_coordinates
    for i in range(joints[k].first, joints[k].last):
        push(rows, model.bodies, model.info.nq, i, la * rows[i].factor, F)


@inlined
def note_gear_reaction(k, la, model):
    """Force and moment on the second body of a gear k between two coordinates of one pair of bodies, as of a screw."""
    joints, rows = model.joints, model.gear_coordinates
    first, last = joints[k].first, joints[k].last
    for i in range(first, last):
        if rows[i].body != rows[first].body or rows[i].other != rows[first].other:
            return
    for i in range(first, last):
        u, g, force = rows[i].u, rows[i].g, -la * rows[i].factor
        value = joints[k].force
        x, y, z = g[0], g[1], g[2]
        if rows[i].kind == ANGLE:
            value = joints[k].moment
            x, y, z = cross(u[0], u[1], u[2], g[0], g[1], g[2])
        value[0] += force * x
        value[1] += force * y
        value[2] += force * z


@indirect(void(_I, REAL, _I, REAL, REAL, MODEL, SPARSE))
def add_gear(k, la, row, scale, damped, model, matrix):
    """Add gear k with the multiplier la: its gradient as row and column `row`, and la times its second derivative.

    The gradient is multiplied by `scale`, the row by `damped` as well.
    """
    joints, rows, J = model.joints, model.gear_coordinates, model.J[0]
    for i in range(joints[k].first, joints[k].last):
        sides, factor = gradients(model, rows, i, J), rows[i].factor
        _add_gradient(matrix, row, sides, J, scale * factor * damped, scale * factor)
        if la != 0.0:
            if rows[i].kind == ANGLE:
                add_angle_tangent(model, rows, i, la * factor, 0.0, matrix)
            else:
                add_travel_tangent(model, rows, i, la * factor, 0.0, matrix)


@indirect(void(VECTOR, _I, _I, REAL, MODEL, SPARSE))
def add_gear_rates(y, k, row, scale, model, matrix):
    """Add scale times what a change of place alone changes in the rate of gear k as row `row`."""
    joints, rows, J = model.joints, model.gear_coordinates, model.J[0]
    for i in range(joints[k].first, joints[k].last):
        sides = rate_gradients(y, model, rows, i, J)
        _add_gradient(matrix, row, sides, J, scale * rows[i].factor, 0.0)


@inlined
def _add_gradient(matrix, row, sides, J, across, down):
    """Add the gradient J, on the unknowns `sides`, as row `row` times `across` and as column times `down`."""
    for side in range(2):
        at, n = sides[2 * side], sides[2 * side + 1]
        if n == 0:
            continue
        to, right, _ = first_entry(matrix, row, at)
        of, _, below = first_entry(matrix, at, row)
        for c in range(n):
            matrix.values[to + c * right] += across * J[side, c]
            matrix.values[of + c * below] += down * J[side, c]
