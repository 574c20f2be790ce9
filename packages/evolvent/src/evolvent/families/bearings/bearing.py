"""Bearings: friction of a hinge or a slide by the reactions of its joint, sticking included.

The joint's multipliers la give its force F and its moment M on the second body, at the joint's position. With the axis
n, the radial force Fr = F - (F.n) n and an arm of 1/span, two bearings `span` apart carry Fr/2 + arm n x M and
Fr/2 - arm n x M. The load of the friction is

    L = radial (|Fr/2 + arm n x M| + |Fr/2 - arm n x M|) + axial |F.n| + twist |M.n| + constant

of a hinge a length times a force: radial the radius of the journal, axial that of the thrust face, constant that times
the preload; of a slide a force: radial 1, twist 2/width, constant the preload. Friction is at most static L where the
step starts at rest, and coefficient L where it slides: the torque or force of a bristle in series with a slider, as of
`joint_friction.stick_or_slip`, whose limit follows the multipliers of the same iteration. Under energy-momentum these
are means over the step, and so are the vectors of the bodies.

The torque acts along the bearing's own coordinate, a row of the family `coordinates` between the bodies of the joint.
"""

import math

from numba import types, void

from evolvent.algebra.sparse import SPARSE, first_entry
from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.families.coordinates.joint_friction import RELAX, bristle_energy, stick_or_slip, taken_by_friction
from evolvent.kernels import axial, axial_tangent
from evolvent.kernels.axial import TRAVEL, both_sides, gradients
from evolvent.kernels.axial_tangent import add_angle_tangent, add_outer
from evolvent.kernels.gaps import ALONG, DIRECTION
from evolvent.kernels.rotations import cross, turn
from evolvent.model import MODEL

USED_FOR = "bearings"
#: Rate above which a bearing slides from the start on, rad/s or m/s.
_MOVES = 1e-9
#: What is `fresh` of a bearing: it goes on; it slides again behind an event; it has not moved yet.
STEPS, AGAIN, FIRST = 0.0, 1.0, 2.0


# ------------------------------------------------------------------------------------------------ load


@inlined
def _reaction(joints, first, last, la):
    """Force and moment of the joint with the rows first to last on its second body, inertial axes."""
    fx = fy = fz = mx = my = mz = 0.0
    for j in range(first, last):
        u, g = joints[j].u, joints[j].g
        if joints[j].kind == DIRECTION:
            x, y, z = cross(u[1, 0], u[1, 1], u[1, 2], g[1, 0], g[1, 1], g[1, 2])
            mx, my, mz = mx - la[j] * x, my - la[j] * y, mz - la[j] * z
        else:
            fx, fy, fz = fx - la[j] * g[1, 0], fy - la[j] * g[1, 1], fz - la[j] * g[1, 2]
    return (fx, fy, fz), (mx, my, mz)


@inlined
def _unit(x, y, z):
    """A vector of length 1 along another, or none where that is none; and its length."""
    size = math.sqrt(x * x + y * y + z * z)
    scale = 1.0 / size if size > 0.0 else 0.0
    return scale * x, scale * y, scale * z, size


@indirect(void(types.int64, VECTOR, MODEL))
def measure_load(k, la, model):
    """Load of bearing k with the multipliers la, its parts and its derivatives, into its record.

    After `joint.joint_geometry` of its joint, with the bodies where they were.
    """
    bearings, coordinates, bodies = model.bearings, model.coordinates, model.bodies
    c, arm, radial = bearings[k].coordinate, bearings[k].arm, bearings[k].radial
    a = coordinates[c].axis
    nx, ny, nz = turn(bodies[coordinates[c].body].R, a[0], a[1], a[2])
    nx, ny, nz, _ = _unit(nx, ny, nz)  # the mean of both ends of a step is shorter
    F, M = _reaction(model.joints, bearings[k].first, bearings[k].last, la)
    along, about = F[0] * nx + F[1] * ny + F[2] * nz, M[0] * nx + M[1] * ny + M[2] * nz
    rx, ry, rz = F[0] - along * nx, F[1] - along * ny, F[2] - along * nz
    wx, wy, wz = cross(nx, ny, nz, M[0], M[1], M[2])
    ax, ay, az, one = _unit(0.5 * rx + arm * wx, 0.5 * ry + arm * wy, 0.5 * rz + arm * wz)
    bx, by, bz, other = _unit(0.5 * rx - arm * wx, 0.5 * ry - arm * wy, 0.5 * rz - arm * wz)
    bearings[k].load = (
        radial * (one + other) + bearings[k].axial * abs(along) + bearings[k].twist * abs(about) + bearings[k].constant
    )
    bearings[k].radial_force, bearings[k].axial_force = one + other, along
    bearings[k].tilting = math.sqrt(wx * wx + wy * wy + wz * wz)
    px, py, pz = 0.5 * radial * (ax + bx), 0.5 * radial * (ay + by), 0.5 * radial * (az + bz)
    qx, qy, qz = radial * arm * (ax - bx), radial * arm * (ay - by), radial * arm * (az - bz)
    push = math.copysign(bearings[k].axial, along) if along != 0.0 else 0.0
    twist = math.copysign(bearings[k].twist, about) if about != 0.0 else 0.0
    f, m, d = bearings[k].by_force, bearings[k].by_moment, bearings[k].by_axis
    f[0], f[1], f[2] = px + push * nx, py + push * ny, pz + push * nz
    tx, ty, tz = cross(qx, qy, qz, nx, ny, nz)
    m[0], m[1], m[2] = tx + twist * nx, ty + twist * ny, tz + twist * nz
    tx, ty, tz = cross(M[0], M[1], M[2], qx, qy, qz)
    d[0] = tx - along * px + push * F[0] + twist * M[0]
    d[1] = ty - along * py + push * F[1] + twist * M[1]
    d[2] = tz - along * pz + push * F[2] + twist * M[2]


@inlined
def _by_multiplier(k, j, model):
    """Derivative of the load of bearing k by the multiplier of row j of its joint."""
    g, u = model.joints[j].g, model.joints[j].u
    if model.joints[j].kind == DIRECTION:
        m = model.bearings[k].by_moment
        x, y, z = cross(u[1, 0], u[1, 1], u[1, 2], g[1, 0], g[1, 1], g[1, 2])
        return -(m[0] * x + m[1] * y + m[2] * z)
    f = model.bearings[k].by_force
    return -(f[0] * g[1, 0] + f[1] * g[1, 1] + f[2] * g[1, 2])


@inlined
def _by_turns(k, la, model):
    """Derivatives of the load of bearing k by turns of both bodies of its coordinate: two vectors, inertial axes."""
    bearings, joints, coordinates = model.bearings, model.joints, model.coordinates
    c, f, m, d = bearings[k].coordinate, bearings[k].by_force, bearings[k].by_moment, bearings[k].by_axis
    body, axis = coordinates[c].body, coordinates[c].axis
    nx, ny, nz = turn(model.bodies[body].R, axis[0], axis[1], axis[2])
    own, other = cross(nx, ny, nz, d[0], d[1], d[2]), (0.0, 0.0, 0.0)
    for j in range(bearings[k].first, bearings[k].last):
        u, g, index, kind = joints[j].u, joints[j].g, joints[j].index, joints[j].kind
        if kind == ALONG:  # the force turns with the direction
            t = cross(g[1, 0], g[1, 1], g[1, 2], f[0], f[1], f[2])
            own, other = _turned(index[2] == body, own, other, -la[j], t)
        elif kind == DIRECTION:  # the moment turns with both directions
            x, y, z = cross(g[1, 0], g[1, 1], g[1, 2], m[0], m[1], m[2])
            own, other = _turned(index[1] == body, own, other, -la[j], cross(u[1, 0], u[1, 1], u[1, 2], x, y, z))
            x, y, z = cross(m[0], m[1], m[2], u[1, 0], u[1, 1], u[1, 2])
            own, other = _turned(index[0] == body, own, other, -la[j], cross(g[1, 0], g[1, 1], g[1, 2], x, y, z))
    return own, other


@inlined
def _turned(first, own, other, factor, t):
    """Add factor t to the derivative by a turn of the first body, or of the other one."""
    one, two = (factor, 0.0) if first else (0.0, factor)
    return (
        (own[0] + one * t[0], own[1] + one * t[1], own[2] + one * t[2]),
        (other[0] + two * t[0], other[1] + two * t[1], other[2] + two * t[2]),
    )


# ------------------------------------------------------------------------------------------------ friction


@inlined
def _friction(bearings, k, x, rate):
    """Friction of bearing k at its coordinate x, and its derivative by it.

    Notes
    -----
    Slip and stick are an active set (`joint_friction.stick_or_slip`). What decides between them is one limit
    throughout a step, the static one where the step starts at rest and the kinetic one where it slides, so that the
    set cannot go to and fro: friction that breaks away falls, and what it held moves on. A bearing that slides sticks
    once it moves back, without a limit in that evaluation.
    """
    load, fresh = bearings[k].load, bearings[k].fresh
    kinetic = bearings[k].coefficient * load
    if fresh != STEPS:
        sense = bearings[k].slips0
        if fresh == FIRST:
            sense = 0.0 if abs(rate) <= _MOVES else math.copysign(1.0, rate)
        if sense != 0.0:
            bearings[k].slips, bearings[k].rubs = sense, sense * kinetic
            bearings[k].bristle = bearings[k].bristle0 = sense * kinetic / bearings[k].stick
            return sense * kinetic, 0.0
    limit = kinetic if bearings[k].slips0 != 0.0 else bearings[k].static * load
    return stick_or_slip(bearings, k, x, limit, kinetic)


@indirect(REAL(REAL, VECTOR, MODEL, VECTOR))
def add_bearings(h, la, model, F):
    """Friction of all bearings over an interval of length h; returns the energy of their bristles at its end, J.

    After the forces of coordinates and of joints, with the multipliers la (nj,). Friction is that of the end.
    """
    bearings, coordinates = model.bearings, model.coordinates
    for k in range(bearings.size):
        c = bearings[k].coordinate
        measure_load(k, la, model)
        rubs, slope = _friction(bearings, k, coordinates[c].angle, coordinates[c].rate)
        bearings[k].slope = slope if h == 0.0 else 2.0 * slope
        bearings[k].limit = bearings[k].coefficient * bearings[k].load
        bearings[k].stored = bristle_energy(bearings, k)
        axial.push(coordinates, model.bodies, model.info.nq, c, rubs, F)
    return bearing_energy(model)


@inlined
def bearing_energy(model):
    """Energy of the bristles of all bearings, J."""
    found = 0.0
    for k in range(model.bearings.size):
        found += model.bearings[k].stored
    return found


@inlined
def change_of_friction(model):
    """Largest change of the friction of a bearing since the last call, beside its limit."""
    bearings, found = model.bearings, 0.0
    for k in range(bearings.size):
        change = abs(bearings[k].rubs - bearings[k].noted)
        bearings[k].noted = bearings[k].rubs
        if change > found * bearings[k].limit:
            found = change / bearings[k].limit if bearings[k].limit > 0.0 else math.inf
    return found


@inlined
def start_bearings(fresh, model):
    """Begin generalized-alpha at a state: what moves there slides already."""
    for k in range(model.bearings.size):
        model.bearings[k].relax, model.bearings[k].fresh = RELAX, fresh


@indirect(REAL(REAL, VECTOR, MODEL))
def end_bearings(share, y, model):
    """Accept a step: accounts of bearings in y, anchors of their bristles; returns what friction takes, J.

    Parameters
    ----------
    share : as of `coordinate_laws.end_coordinate_step`, as the formulas are
    """
    bearings, coordinates, rubbed = model.bearings, model.coordinates, 0.0
    for k in range(bearings.size):
        c = bearings[k].coordinate
        taken = taken_by_friction(bearings, k, coordinates[c].angle, coordinates[c].before, share)
        y[bearings[k].account] += taken
        rubbed += taken
        bearings[k].slips0, bearings[k].fresh = bearings[k].slips, STEPS
    return rubbed


@inlined
def note_bearings(model):
    """Coordinates and rates of bearings at the last evaluation of coordinates, into their records."""
    for k in range(model.bearings.size):
        c = model.bearings[k].coordinate
        model.bearings[k].angle, model.bearings[k].rate = model.coordinates[c].angle, model.coordinates[c].rate


# ------------------------------------------------------------------------------------------------ tangent


@indirect(void(REAL, VECTOR, MODEL, SPARSE))
def add_bearing_tangents(scale, la, model, matrix):
    """Tangents of all bearings, constraints times `scale`; after `add_bearings` with the multipliers la.

    Notes
    -----
    Of friction that slides, sense coefficient L J^T with the gradient J of the coordinate, the multipliers have the
    columns sense coefficient J^T dL/dla, and turns of the bodies sense coefficient J^T dL/dq.
    """
    bearings, coordinates, J, n_v = model.bearings, model.coordinates, model.J, model.info.nv
    for k in range(bearings.size):
        c, rubs = bearings[k].coordinate, bearings[k].rubs
        if coordinates[c].kind == TRAVEL:
            axial_tangent.add_travel_tangent(model, coordinates, c, rubs, bearings[k].slope, matrix)
        else:
            add_angle_tangent(model, coordinates, c, rubs, bearings[k].slope, matrix)
        factor = bearings[k].slips * bearings[k].coefficient
        if factor == 0.0:
            continue
        own, other = _by_turns(k, la, model)
        u, none = coordinates[c].u, (0.0, 0.0, 0.0)
        a = gradients(model, coordinates, c, J[0])
        b = both_sides(model, coordinates, c, (u[0], u[1], u[2]), none, own, other, J[1])
        add_outer(matrix, a, J[0], b, J[1], factor)
        for j in range(bearings[k].first, bearings[k].last):
            value = factor * scale * _by_multiplier(k, j, model)
            for i in range(2):
                at, n = a[2 * i], a[2 * i + 1]
                to, _, down = first_entry(matrix, at, n_v + j) if n > 0 else (-1, 0, 0)
                for r in range(n if to >= 0 else 0):
                    matrix.values[to + r * down] += value * J[0, i, r]
