"""Fields: accelerations of every mass that follow from its position, its velocity and the time.

Bodies and elements of beams are integrated by points (`families.fields.part_points`) that have their mass, centre and
second moments; their forces are exact for a field that is linear in place and velocity, moments included. Under the
energy-momentum step the points move on straight lines, so that a linear field conserves energy there exactly and a
Coriolis force does no work.
"""

from numba import types, void

from evolvent.algebra.sparse import SPARSE, add_block
from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined, kernel
from evolvent.kernels.ancf_beams import NODE_VECTORS
from evolvent.kernels.law_means import add_force_gradient, force_of
from evolvent.kernels.rigid import add_wrench
from evolvent.kernels.rotations import cross, turn, turn_back
from evolvent.kernels.sides import ON_BODY, add_turning, side_columns
from evolvent.model import MODEL

USED_FOR = "fields"
#: Kinds of fields: an orbital frame, an acceleration by a user's law.
ORBIT, LAW = 0, 1


@kernel
def acceleration(t, model, x, v):
    """Sum of all fields at a position x with velocity v, (3,) each: three floats, m/s2.

    Notes
    -----
    Of an orbital frame K x - 2 w x v: K the gravity gradient with the centrifugal part, w the frame's rate.
    """
    fields = model.fields
    ax = ay = az = 0.0
    for k in range(fields.size):
        scale = fields[k].scale
        if fields[k].kind == LAW:
            p = model.parameters[fields[k].first : fields[k].last]
            bx, by, bz = force_of(fields[k].law, x, v, t, p, model)
        else:
            K, w = fields[k].K, fields[k].w
            cx, cy, cz = cross(w[0], w[1], w[2], v[0], v[1], v[2])
            bx = K[0, 0] * x[0] + K[0, 1] * x[1] + K[0, 2] * x[2] - 2.0 * cx
            by = K[1, 0] * x[0] + K[1, 1] * x[1] + K[1, 2] * x[2] - 2.0 * cy
            bz = K[2, 0] * x[0] + K[2, 1] * x[1] + K[2, 2] * x[2] - 2.0 * cz
        ax += scale * bx
        ay += scale * by
        az += scale * bz
    return ax, ay, az


@kernel
def gradient(t, model, x, v, c_x, c_v, A, row):
    """A[row : row + 3, :3] = c_x d a/dx + c_v d a/dv of the fields' sum; x and v are left as they were."""
    fields = model.fields
    for i in range(3):
        for j in range(3):
            A[row + i, j] = 0.0
    for k in range(fields.size):
        scale = fields[k].scale
        if fields[k].kind == LAW:
            p = model.parameters[fields[k].first : fields[k].last]
            add_force_gradient(fields[k].law, p, t, x, v, c_x, c_v, scale, A, row, model)
            continue
        K, w = fields[k].K, fields[k].w
        for j in range(3):
            turned = cross(w[0], w[1], w[2], 1.0 * (j == 0), 1.0 * (j == 1), 1.0 * (j == 2))
            for i in range(3):
                A[row + i, j] += scale * (c_x * K[i, j] - 2.0 * c_v * turned[i])


@inlined
def _body_point(model, k, x, v):
    """Position and velocity of field point k, on a body, into x and v; returns its arm."""
    own, b = model.field_points[k].local, model.field_points[k].body
    w, at, moves = model.bodies[b].w, model.bodies[b].x, model.bodies[b].v
    dx, dy, dz = turn(model.bodies[b].R, own[0], own[1], own[2])
    ux, uy, uz = cross(w[0], w[1], w[2], dx, dy, dz)
    x[0], x[1], x[2] = at[0] + dx, at[1] + dy, at[2] + dz
    v[0], v[1], v[2] = moves[0] + ux, moves[1] + uy, moves[2] + uz
    return dx, dy, dz


@inlined
def _element_point(y, model, k, x, v):
    """Position and velocity of field point k, in an element, into x and v; returns the number of its nodal vectors."""
    element = model.field_points[k].element
    elements, S = model.elements, model.field_points[k].S
    iq, iv = elements[element].iq, elements[element].iv
    n = 2 * NODE_VECTORS[model.beams[elements[element].beam].kind]
    for c in range(3):
        x[c] = v[c] = 0.0
        for j in range(n):
            x[c] += S[j] * y[iq + 3 * j + c]
            v[c] += S[j] * y[iv + 3 * j + c]
    return n


@indirect(REAL(REAL, VECTOR, MODEL))
def add_field_forces(t, y, model):
    """Forces of all fields on points and bodies, after `kinematics`; returns their power, W."""
    points, bodies, on = model.points, model.bodies, model.field_points
    x, v = model.scratch[1], model.scratch[2]
    power = 0.0
    for i in range(points.size):
        for c in range(3):
            x[c], v[c] = y[points[i].iq + c], y[points[i].iv + c]
        ax, ay, az = acceleration(t, model, x, v)
        m = points[i].mass
        points[i].f[0] += m * ax
        points[i].f[1] += m * ay
        points[i].f[2] += m * az
        power += m * (ax * v[0] + ay * v[1] + az * v[2])
    for k in range(on.size):
        if on[k].body < 0:
            continue
        dx, dy, dz = _body_point(model, k, x, v)
        ax, ay, az = acceleration(t, model, x, v)
        m = on[k].mass
        add_wrench(bodies[on[k].body].F, dx, dy, dz, m * ax, m * ay, m * az)
        power += m * (ax * v[0] + ay * v[1] + az * v[2])
    return power


@indirect(void(REAL, VECTOR, MODEL, VECTOR))
def add_beam_fields(t, y, model, P):
    """Forces of all fields on beams into the loads P."""
    on, elements, n_q = model.field_points, model.elements, model.info.nq
    x, v = model.scratch[1], model.scratch[2]
    for k in range(on.size):
        if on[k].element < 0:
            continue
        n = _element_point(y, model, k, x, v)
        ax, ay, az = acceleration(t, model, x, v)
        at, m = elements[on[k].element].iv - n_q, on[k].mass
        for j in range(n):
            s = m * on[k].S[j]
            P[at + 3 * j] += s * ax
            P[at + 3 * j + 1] += s * ay
            P[at + 3 * j + 2] += s * az


@indirect(void(REAL, VECTOR, REAL, MODEL, SPARSE))
def add_field_tangents(t, y, c_rate, model, matrix):
    """Add what fields on points, bodies and beams change with position, and c_rate times with velocity, to a matrix.

    That of threads is `kernels.thread.loads.add_node_load_tangents`.
    """
    points, on, n_q = model.points, model.field_points, model.info.nq
    x, v, A, K = model.scratch[1], model.scratch[2], model.K12, model.K24
    for i in range(points.size):
        for c in range(3):
            x[c], v[c] = y[points[i].iq + c], y[points[i].iv + c]
        gradient(t, model, x, v, 1.0, c_rate, A, 0)
        add_block(matrix, points[i].iv - n_q, points[i].iv - n_q, A, 0, 0, 3, 3, -points[i].mass)
    for k in range(on.size):
        if on[k].body >= 0:
            _body_point(model, k, x, v)
            add_body_point(t, on[k].body, on[k].mass, c_rate, model, matrix)
    last = -1
    for k in range(on.size):
        element = on[k].element
        if element < 0:
            continue
        if element != last:
            _add_element(last, model, matrix)
            for i in range(24):
                for j in range(24):
                    K[i, j] = 0.0
            last = element
        n = _element_point(y, model, k, x, v)
        gradient(t, model, x, v, 1.0, c_rate, A, 0)
        for i in range(n):
            for j in range(n):
                s = on[k].mass * on[k].S[i] * on[k].S[j]
                if s != 0.0:
                    for c in range(3):
                        for d in range(3):
                            K[3 * i + c, 3 * j + d] -= s * A[c, d]
    _add_element(last, model, matrix)


@inlined
def _add_element(element, model, matrix):
    """Add what K24 holds of an element to the matrix; of none where it is -1."""
    if element < 0:
        return
    elements = model.elements
    at = elements[element].iv - model.info.nq
    size = 3 * NODE_VECTORS[model.beams[elements[element].beam].kind]
    for r in range(0, 2 * size, size):
        for c in range(0, 2 * size, size):
            add_block(matrix, at + r, at + c, model.K24, r, c, size, size, 1.0)


@indirect(void(REAL, types.int64, REAL, REAL, MODEL, SPARSE))
def add_body_point(t, b, m, c_rate, model, matrix):
    """Add what fields on a mass m that body b carries change; its place and velocity are in scratch[1] and scratch[2].

    A velocity relative to the body turns with the body.
    """
    x, v, A, K, J = model.scratch[1], model.scratch[2], model.K12, model.K24, model.J[0]
    at, moves, L, local, own = model.bodies[b].x, model.bodies[b].v, model.J[1], model.e[1], model.e[2]
    ax, ay, az = acceleration(t, model, x, v)
    gradient(t, model, x, v, 1.0, c_rate, A, 0)
    local[0], local[1], local[2] = turn_back(model.bodies[b].R, x[0] - at[0], x[1] - at[1], x[2] - at[2])
    first, n = side_columns(model, ON_BODY, b, -1, local, True, J)
    wx, wy, wz = v[0] - moves[0], v[1] - moves[1], v[2] - moves[2]
    turns = wx != 0.0 or wy != 0.0 or wz != 0.0
    if turns:  # a turn of the body turns the point's velocity beside that of the origin
        own[0], own[1], own[2] = turn_back(model.bodies[b].R, wx, wy, wz)
        side_columns(model, ON_BODY, b, -1, own, False, L)
        gradient(t, model, x, v, 0.0, 1.0, A, 3)
    for i in range(n):
        for j in range(n):
            value = 0.0
            for c in range(3):
                for d in range(3):
                    value += J[c, i] * A[c, d] * J[d, j]
                    if turns:
                        value += J[c, i] * A[3 + c, d] * L[d, j]
            K[i, j] = value
    if n > 0:
        add_block(matrix, first, first, K, 0, 0, n, n, -m)
        add_turning(matrix, model, b, local, -m * ax, -m * ay, -m * az)
