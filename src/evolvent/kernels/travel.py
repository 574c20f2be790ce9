"""Travels: coordinates x = d . (u - p) of a point u along a direction d and from a point p that are fixed to a body.

A force f along d acts at u on what carries u, and with the other sign at the same point on the body. In vectors fixed
to bodies x is quadratic: along the mean shape its force does the work f dx exactly, as the energy-momentum step needs.
"""

from numba import types, void

from evolvent.compiled.jit import REAL, indirect, inlined
from evolvent.kernels import rigid
from evolvent.kernels.rotations import cross, turn, turn_back
from evolvent.kernels.sides import ON_BODY, add_product, add_turning, pull, side_columns, turn_axis
from evolvent.kernels.sparse import SPARSE, first_entry
from evolvent.model import MODEL

_I = types.int64


@inlined
def travel_geometry(hinges, bodies, k, u):
    """Direction of travel k, the travel of its point u (a tuple with its rate), and the rate of the travel."""
    b = hinges[k].body
    R, X, V, w, n, p = bodies[b].R, bodies[b].x, bodies[b].v, bodies[b].w, hinges[k].axis, hinges[k].zero
    dx, dy, dz = turn(R, n[0], n[1], n[2])
    px, py, pz = turn(R, p[0], p[1], p[2])
    ax, ay, az = u[0] - X[0], u[1] - X[1], u[2] - X[2]
    vx, vy, vz = cross(w[0], w[1], w[2], ax, ay, az)
    travel = dx * (ax - px) + dy * (ay - py) + dz * (az - pz)
    rate = dx * (u[3] - V[0] - vx) + dy * (u[4] - V[1] - vy) + dz * (u[5] - V[2] - vz)
    return (dx, dy, dz), travel, rate


@inlined
def push_travel(model, k, u, d, force, F):
    """Add the force of travel k, along d at u, to the left of the equations."""
    hinges, bodies, n_q = model.flexible.hinges, model.bodies, model.info.nq
    fx, fy, fz = force * d[0], force * d[1], force * d[2]
    pull(F, bodies, n_q, hinges[k].on, hinges[k].other, hinges[k].iv, u, True, fx, fy, fz)
    b = hinges[k].body
    X = bodies[b].x
    rigid.add_wrench(bodies[b].F, u[0] - X[0], u[1] - X[1], u[2] - X[2], fx, fy, fz)


@inlined
def place_on_body(model, k, u, local):
    """Write the point u, as seen from the body of travel k, to `local`, body axes."""
    bodies, b = model.bodies, model.flexible.hinges[k].body
    X = bodies[b].x
    local[0], local[1], local[2] = turn_back(bodies[b].R, u[0] - X[0], u[1] - X[1], u[2] - X[2])


@indirect(void(_I, REAL, MODEL, SPARSE))
def add_travel_tangent(k, slope, model, matrix):
    """Tangent of travel k, whose force has the derivative `slope` by the travel; after the last forces.

    Notes
    -----
    As seen from the body, the force f on u depends on u alone. With columns Jb of u, and Ja of a point fixed to the
    body there, u moves by s = Jb db - Ja da as seen from it, and f by slope d d.s + w x f, w the turn of the body. On
    the body acts -(f, u x f): its axes turn with it, its arm by s.
    """
    f, hinges = model.flexible, model.flexible.hinges
    a, on, other, g, u = hinges[k].body, hinges[k].on, hinges[k].other, hinges[k].g, hinges[k].u
    d = (g[0], g[1], g[2])
    force = (hinges[k].torque * d[0], hinges[k].torque * d[1], hinges[k].torque * d[2])
    Ja, Jb, local = f.J[0], f.J[1], f.e[2]
    place_on_body(model, k, u, local)
    at, na = side_columns(model, ON_BODY, a, -1, local, True, Ja)
    bt, nb = side_columns(model, on, other, hinges[k].iv, hinges[k].local, True, Jb)
    K = (d[0] * d[0], d[0] * d[1], d[0] * d[2], d[1] * d[1], d[1] * d[2], d[2] * d[2])
    add_product(matrix, bt, nb, Jb, K[0], K[1], K[2], K[3], K[4], K[5], bt, nb, Jb, slope)
    add_product(matrix, at, na, Ja, K[0], K[1], K[2], K[3], K[4], K[5], at, na, Ja, slope)
    add_product(matrix, bt, nb, Jb, K[0], K[1], K[2], K[3], K[4], K[5], at, na, Ja, -slope)
    add_product(matrix, at, na, Ja, K[0], K[1], K[2], K[3], K[4], K[5], bt, nb, Jb, -slope)
    if on == ON_BODY and nb > 0:
        add_turning(matrix, model, other, hinges[k].local, force[0], force[1], force[2])
    if na > 0:
        _add_turns_of_body(matrix, model, a, at, na, Ja, bt, nb, Jb, force)


@inlined
def _add_turns_of_body(matrix, model, a, at, na, Ja, bt, nb, Jb, force):
    """What a turn of the body changes in the force, and a move of the point as seen from it in the torque on it."""
    bodies, values, motion = model.bodies, matrix.values, model.bodies[a].motion
    R = bodies[a].R
    to, right, down = first_entry(matrix, bt, at)
    own, along, below = first_entry(matrix, at, at)
    of, beside, under = first_entry(matrix, at, bt)
    for c in range(na):
        nx, ny, nz = turn_axis(bodies, a, motion, c)
        tx, ty, tz = turn(R, nx, ny, nz)
        x, y, z = cross(tx, ty, tz, force[0], force[1], force[2])
        for r in range(nb if to >= 0 else 0):
            values[to + r * down + c * right] += Jb[0, r] * x + Jb[1, r] * y + Jb[2, r] * z
        if motion == rigid.FREE:
            values[own + c * along] -= x
            values[own + below + c * along] -= y
            values[own + 2 * below + c * along] -= z
        x, y, z = cross(Ja[0, c], Ja[1, c], Ja[2, c], force[0], force[1], force[2])
        for r in range(na):
            nx, ny, nz = turn_axis(bodies, a, motion, r)
            tx, ty, tz = turn(R, nx, ny, nz)
            values[own + r * below + c * along] += tx * x + ty * y + tz * z
    for c in range(nb if of >= 0 else 0):
        x, y, z = cross(Jb[0, c], Jb[1, c], Jb[2, c], force[0], force[1], force[2])
        for r in range(na):
            nx, ny, nz = turn_axis(bodies, a, motion, r)
            tx, ty, tz = turn(R, nx, ny, nz)
            values[of + r * under + c * beside] -= tx * x + ty * y + tz * z
