"""Markers: points of bodies, and point masses, on which springs, loads and users' laws act."""

from numba import types

from evolvent.compiled.jit import VECTOR, entry, inlined
from evolvent.kernels.rigid import add_wrench, point_kinematics
from evolvent.kernels.rotations import turn_back
from evolvent.kernels.sides import ON_BODY as ON_SIDE, ON_COORDINATES, side_columns
from evolvent.model import family_type

ON_BODY, ON_POINT = 0, 1


@entry(VECTOR, family_type("markers"), family_type("points"), family_type("bodies"), types.int64)
@inlined
def marker_kinematics(y, markers, points, bodies, k):
    """Position and velocity of marker k, inertial axes: (x, y, z, vx, vy, vz)."""
    i = markers[k].index
    if markers[k].kind == ON_POINT:
        q, v = points[i].iq, points[i].iv
        return y[q], y[q + 1], y[q + 2], y[v], y[v + 1], y[v + 2]
    dx, dy, dz, vx, vy, vz = point_kinematics(bodies, i, markers[k].local[0], markers[k].local[1], markers[k].local[2])
    return bodies[i].x[0] + dx, bodies[i].x[1] + dy, bodies[i].x[2] + dz, vx, vy, vz


@inlined
def push_marker(markers, points, bodies, k, x, y, z, fx, fy, fz):
    """Apply a force at marker k, which stands at (x, y, z)."""
    i = markers[k].index
    if markers[k].kind == ON_POINT:
        points[i].f[0] += fx
        points[i].f[1] += fy
        points[i].f[2] += fz
    else:
        add_wrench(bodies[i].F, x - bodies[i].x[0], y - bodies[i].x[1], z - bodies[i].x[2], fx, fy, fz)


@inlined
def marker_columns(model, marker, J):
    """Write the columns J of a marker (`sides.side_columns`); returns its first unknown and their number."""
    index, local = model.markers[marker].index, model.markers[marker].local
    if model.markers[marker].kind == ON_POINT:
        return side_columns(model, ON_COORDINATES, -1, model.points[index].iv, local, True, J)
    return side_columns(model, ON_BODY, index, -1, local, True, J)


@inlined
def marker_turning(model, marker, u, J):
    """Write the columns J of what a turn of a marker's body changes in the marker's velocity, the rates u[3:6] there.

    Returns the first unknown and their number: none of a point, or of a body at rest.
    """
    i, own = model.markers[marker].index, model.e[2]
    if model.markers[marker].kind == ON_POINT:
        return 0, 0
    v = model.bodies[i].v
    own[0], own[1], own[2] = turn_back(model.bodies[i].R, u[3] - v[0], u[4] - v[1], u[5] - v[2])
    return side_columns(model, ON_SIDE, i, -1, own, False, J)


@inlined
def spring_energy(stiffness, extension):
    """U = k e^2 / 2, J; the tension is dU/de = k e, its derivative k."""
    return 0.5 * stiffness * extension * extension
