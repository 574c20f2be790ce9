"""Tangents of the torques of joints' coordinates: of angles, of travels, and of cables between coordinates."""

from numba import types, void

from evolvent.algebra.sparse import SPARSE
from evolvent.compiled.jit import REAL, VECTOR, indirect
from evolvent.kernels import axial_tangent
from evolvent.kernels.axial import TRAVEL, gradients, rate_gradients
from evolvent.kernels.axial_tangent import add_angle_tangent, add_damping, add_outer
from evolvent.kernels.calls import tangent_at
from evolvent.model import MODEL, having
from evolvent.model.interval import INTERVAL

USED_FOR = "coordinates"


@indirect(void(INTERVAL, MODEL, SPARSE))
def add_coordinate_tangents(interval, model, matrix):
    """Tangents of all joint coordinates, at the coordinates of the last forces, which are over an interval.

    Notes
    -----
    With the rates of a state its gradients change. Over a step what counts are those at its end: of the mean, and h/2
    times their rates.
    """
    coordinates, calls = model.coordinates, model.torques_tangent_calls
    y, h, c_rate = interval.ym, interval.step.h, interval.step.c_rate
    for k in range(calls.size):
        tangent_at(model, calls[k])(interval, model, matrix)
    for k in range(coordinates.size):
        torque = coordinates[k].torque + coordinates[k].applied
        damping = coordinates[k].damper + coordinates[k].motor_damper
        slope = coordinates[k].slope + coordinates[k].motor_slope + c_rate * damping
        if coordinates[k].kind == TRAVEL:
            add_travel_tangent(k, torque, slope, model, matrix)
        else:
            add_angle_tangent(model, coordinates, k, torque, slope, matrix)
        by_rate = damping if h == 0.0 else 0.5 * h * slope
        if by_rate != 0.0:
            add_damping(y, model, coordinates, k, by_rate, matrix)


@indirect(void(types.int64, REAL, REAL, MODEL, SPARSE), used_for=having("coordinates", kind=TRAVEL))
def add_travel_tangent(k, along, slope, model, matrix):
    """`axial_tangent.add_travel_tangent` of a joint's coordinate."""
    axial_tangent.add_travel_tangent(model, model.coordinates, k, along, slope, matrix)


@indirect(void(VECTOR, REAL, REAL, MODEL, SPARSE), used_for="synchronizations")
def add_synchronization_tangents(y, h, c_rate, model, matrix):
    """What cables couple between different coordinates; the rest is among the slopes of each."""
    coordinates, rows, J = model.coordinates, model.synchronizations, model.J
    for k in range(rows.size):
        both = -rows[k].ratio_a * rows[k].ratio_b
        factor = both * (rows[k].stiffness + c_rate * rows[k].damping)
        by_rate = both * rows[k].damping if h == 0.0 else 0.5 * h * factor
        a = gradients(model, coordinates, rows[k].a, J[0])
        b = gradients(model, coordinates, rows[k].b, J[1])
        add_outer(matrix, a, J[0], b, J[1], factor)
        add_outer(matrix, b, J[1], a, J[0], factor)
        if by_rate != 0.0:
            rate_gradients(y, model, coordinates, rows[k].b, J[2])
            add_outer(matrix, a, J[0], b, J[2], by_rate)
            rate_gradients(y, model, coordinates, rows[k].a, J[2])
            add_outer(matrix, b, J[1], a, J[2], by_rate)
