"""Loads on the released nodes of a thread."""

import math

from numba import types, void

from evolvent.algebra.sparse import SPARSE, add_block
from evolvent.compiled.jit import INTEGERS, REAL, VECTOR, indirect, inlined
from evolvent.kernels.fields import acceleration, gradient
from evolvent.kernels.law_means import force_gradient
from evolvent.kernels.loads import (
    AT_MARKER,
    FRAME,
    NODE,
    RADIATION,
    UNIFORM,
    node_share,
    panel_slopes,
    thread_load,
)
from evolvent.kernels.markers import ON_BODY as MARKER_ON_BODY, marker_turning
from evolvent.kernels.profile import window
from evolvent.kernels.rotations import cross, turn, turn_back
from evolvent.kernels.sides import ON_BODY, add_product, add_turning, side_columns, write_axial
from evolvent.kernels.thread.end import TINY, is_end, node_columns
from evolvent.kernels.thread.fields import note_end_fields
from evolvent.kernels.thread.spool import MOVING
from evolvent.kernels.work import note_power
from evolvent.model import MODEL


def USED_FOR(model):  # noqa: N802
    """Threads, and loads of any kind."""
    return model.threads.size and (model.loads.size or model.fields.size or model.info["gravity"].any())


@inlined
def node_motion(threads, nodes, s, p, i, e, x, v):
    """Outward tangent, position and velocity of a released node of a thread into e, x and v, (3,) each.

    Returns the distance between the neighbours along which the tangent stands, m.
    """
    k, last, held = threads[p].node + i, s[p] - 1, s[threads.size + p] == 0
    tangent = 0.0
    for c in range(3):
        outer = nodes[k - 1].x[c] if i > 0 else nodes[k].x[c]
        inner = nodes[k].x[c]
        if i < last:
            inner = nodes[k + 1].x[c]
        elif held:
            inner = threads[p].Q[c]
        e[c] = outer - inner
        tangent += e[c] * e[c]
    tangent = math.sqrt(tangent)
    for c in range(3):
        e[c] = e[c] / tangent if tangent > TINY else threads[p].X[c]
        x[c] = nodes[k].x[c]
        v[c] = nodes[k].v[c]
    return tangent


@indirect(void(types.int64, VECTOR, INTEGERS, REAL, MODEL))
def evaluate_thread_loads(n, times, s, factor, model):
    """Evaluate loads on threads, times `factor`, at sample n, whose nodes are known, into their records."""
    threads, nodes, bodies, loads = model.threads, model.nodes, model.bodies, model.loads
    e, x, v = model.scratch[0], model.scratch[1], model.scratch[2]
    for a in range(loads.size):
        if loads[a].kind >= AT_MARKER:
            continue
        p, force, middle, power, length = loads[a].target, loads[a].vector, loads[a].middle, 0.0, 0.0
        for c in range(3):
            force[c] = middle[c] = 0.0
        for i in range(s[p]):
            node_motion(threads, nodes, s, p, i, e, x, v)
            fx, fy, fz = thread_load(times[n], loads, model, bodies, a, threads[p].body, threads[p].chord, x, v, e)
            span = node_share(loads, a, i, nodes[threads[p].node + i].span)
            force[0], force[1], force[2] = force[0] + fx * span, force[1] + fy * span, force[2] + fz * span
            power += span * (fx * v[0] + fy * v[1] + fz * v[2])
            length += span
            for c in range(3):
                middle[c] += span * x[c]
        for c in range(3):
            force[c] *= factor
            middle[c] = middle[c] / length if length > 0.0 else threads[p].Q[c]
        note_power(loads[a], n, times, factor * power * threads[p].copies)


@indirect(REAL(REAL, INTEGERS, MODEL, types.int64))
def node_loads(t, s, model, p):
    """Accelerations by loads of the released nodes into af, from x and v; returns their power, W."""
    threads, nodes, bodies, loads = model.threads, model.nodes, model.bodies, model.loads
    gravity, scratch = model.info.gravity, model.scratch
    first, j = threads[p].node, s[p]
    power = 0.0
    for i in range(j):
        k = first + i
        for c in range(3):  # of a fixed end: the forces on it, its weight is that of its body or point
            nodes[k].af[c] = 0.0 if is_end(threads, p, i) else gravity[c]
    if model.fields.size > 0:
        if threads[p].kind == MOVING:
            note_end_fields(t, model, p)
        for i in range(j):
            if is_end(threads, p, i):
                continue
            k = first + i
            for c in range(3):
                scratch[1, c], scratch[2, c] = nodes[k].x[c], nodes[k].v[c]
            ax, ay, az = acceleration(t, model, scratch[1], scratch[2])
            nodes[k].af[0] += ax
            nodes[k].af[1] += ay
            nodes[k].af[2] += az
    if loads.size > 0:
        e, position, velocity = scratch[0], scratch[1], scratch[2]
        for i in range(j):
            k = first + i
            node_motion(threads, nodes, s, p, i, e, position, velocity)
            for a in range(loads.size):
                if loads[a].kind >= AT_MARKER or loads[a].target != p:
                    continue
                fx, fy, fz = thread_load(
                    t, loads, model, bodies, a, threads[p].body, threads[p].chord, position, velocity, e
                )
                mass = 1.0 if is_end(threads, p, i) else nodes[k].mass
                scale = node_share(loads, a, i, nodes[k].span) / mass
                nodes[k].af[0] += fx * scale
                nodes[k].af[1] += fy * scale
                nodes[k].af[2] += fz * scale
    for i in range(j):
        k = first + i
        power += (1.0 if is_end(threads, p, i) else nodes[k].mass) * (
            nodes[k].af[0] * nodes[k].v[0] + nodes[k].af[1] * nodes[k].v[1] + nodes[k].af[2] * nodes[k].v[2]
        )
    return power * threads[p].copies


# ---------------------------------------------------------------------------------------------- tangent


@indirect(void(REAL, REAL, MODEL, SPARSE))
def add_node_load_tangents(t, c_rate, model, matrix):
    """Add what fields and loads on released nodes change with their motion and with turns of bodies.

    Fields on an end on a body or a point are those of the body or of the point.
    """
    threads, nodes, loads, n_q, s = model.threads, model.nodes, model.loads, model.info.nq, model.switches
    e, x, v, A = model.scratch[0], model.scratch[1], model.scratch[2], model.K12
    for p in range(threads.size):
        for i in range(s[p]):
            k, at = threads[p].node + i, threads[p].iv + 3 * i - n_q
            node_motion(threads, nodes, s, p, i, e, x, v)
            if model.fields.size > 0 and not is_end(threads, p, i):
                gradient(t, model, x, v, 1.0, c_rate, A, 0)
                add_block(matrix, at, at, A, 0, 0, 3, 3, -nodes[k].mass)
            for a in range(loads.size):
                if loads[a].kind < AT_MARKER and loads[a].target == p:
                    share = node_share(loads, a, i, nodes[k].span)
                    if share != 0.0:
                        _add_node_load(t, c_rate, a, p, i, share, model, matrix)


@inlined
def _add_node_load(t, c_rate, a, p, i, share, model, matrix):
    """Add what load a changes on node i of thread p, whose state is noted in model.scratch."""
    loads, bodies, body = model.loads, model.bodies, model.threads[p].body
    e, x, v, A, J, L = model.scratch[0], model.scratch[1], model.scratch[2], model.K12, model.J[0], model.J[1]
    q, local = model.parameters[loads[a].first : loads[a].last], model.e[2]
    at, n = node_columns(model, p, i, J)
    turns, end = loads[a].kind in (NODE, UNIFORM) and q[FRAME] != 0.0, model.threads[p].end
    on_body = is_end(model.threads, p, i) and model.markers[end].kind == MARKER_ON_BODY
    if loads[a].law != 0:
        _law_slopes(t, a, body, 1.0, c_rate, turns, model)
        add_product(matrix, at, n, J, A, 0, 0, at, n, J, -share)
        if on_body and (v[0] != 0.0 or v[1] != 0.0 or v[2] != 0.0):
            _law_slopes(t, a, body, 0.0, 1.0, turns, model)
            bt, m = marker_turning(model, end, (x[0], x[1], x[2], v[0], v[1], v[2]), L)
            add_product(matrix, at, n, J, A, 0, 0, bt, m, L, -share)
    if loads[a].kind == RADIATION:
        _add_light(a, p, i, at, n, share, model, matrix)
    if turns or on_body:
        fx, fy, fz = thread_load(t, loads, model, bodies, a, body, model.threads[p].chord, x, v, e)
        if turns:
            local[0], local[1], local[2] = turn_back(bodies[body].R, fx, fy, fz)
            bt, m = side_columns(model, ON_BODY, body, -1, local, False, L)
            write_axial(A, 1.0, 0.0, e)
            add_product(matrix, at, n, J, A, 0, 0, bt, m, L, -share)
        if on_body:
            index, place = model.markers[end].index, model.markers[end].local
            add_turning(matrix, model, index, place, -share * fx, -share * fy, -share * fz)


@inlined
def _law_slopes(t, a, body, c_x, c_v, turns, model):
    """K12[:3, :3] = c_x df/dx + c_v df/dv of load a, a law, at the state in model.scratch."""
    loads, A, x, v = model.loads, model.K12, model.scratch[1], model.scratch[2]
    q, R = model.parameters[loads[a].first : loads[a].last], model.bodies[body].R
    if loads[a].kind != NODE:
        force_gradient(loads[a].law, q, t, x, v, c_x, c_v, A, 0, model)
        for c in range(3):
            for d in range(3):
                A[c, d] *= loads[a].scale
        return
    own, value = model.parameters[loads[a].law_first : loads[a].law_last], window(t, q[4], q[5], q[6])
    force_gradient(loads[a].law, own, t, x, v, c_x, c_v, A, 0, model)
    for d in range(3):
        fx, fy, fz = value * q[0] * A[0, d], value * q[1] * A[1, d], value * q[2] * A[2, d]
        if turns:
            fx, fy, fz = turn(R, fx, fy, fz)
        A[0, d], A[1, d], A[2, d] = fx, fy, fz


@inlined
def _add_light(a, p, i, at, n, share, model, matrix):
    """Add what the light of load a on node i of thread p changes with the thread's direction and the chord.

    Notes
    -----
    The force depends on the normal N/abs(N), N = e x c of the tangent e and the chord c. The tangent is d/abs(d), d the
    vector to the outer neighbour from the inner one.
    """
    threads, nodes, A, J, L = model.threads, model.nodes, model.K12, model.J[0], model.J[1]
    s, e, body, c = model.switches, model.scratch[0], threads[p].body, threads[p].chord
    length = node_motion(threads, nodes, s, p, i, e, model.scratch[1], model.scratch[2])
    _light_slopes(a, body, c, e, model)
    bt, m = side_columns(model, ON_BODY, body, -1, c, False, L)
    add_product(matrix, at, n, J, A, 3, 0, bt, m, L, -share)
    if length <= TINY:  # along the pay-out direction
        bt, m = side_columns(model, ON_BODY, body, -1, threads[p].payout_axis, False, L)
        add_product(matrix, at, n, J, A, 0, 0, bt, m, L, -share)
        return
    for r in range(3):
        along = A[r, 0] * e[0] + A[r, 1] * e[1] + A[r, 2] * e[2]
        for j in range(3):
            A[r, j] = (A[r, j] - along * e[j]) / length
    bt, m = node_columns(model, p, i - 1 if i > 0 else i, L)
    add_product(matrix, at, n, J, A, 0, 0, bt, m, L, -share)
    if i == s[p] - 1 and s[threads.size + p] == 0:
        bt, m = side_columns(model, ON_BODY, body, -1, threads[p].departure, True, L)
    else:
        bt, m = node_columns(model, p, i + 1 if i < s[p] - 1 else i, L)
    add_product(matrix, at, n, J, A, 0, 0, bt, m, L, share)


@inlined
def _light_slopes(a, body, chord, e, model):
    """Derivatives of the light of load a by the tangent e, K12[:3, :3], and by the chord, K12[3:6, :3]."""
    A, G = model.K12, model.K24
    q = model.parameters[model.loads[a].first : model.loads[a].last]
    c = turn(model.bodies[body].R, chord[0], chord[1], chord[2])
    nx, ny, nz = cross(e[0], e[1], e[2], c[0], c[1], c[2])
    size = math.sqrt(nx * nx + ny * ny + nz * nz)
    scale = 1.0 / size if size > 0.0 else 0.0
    nx, ny, nz = scale * nx, scale * ny, scale * nz
    panel_slopes(q[0], q[1], q[2], nx, ny, nz, q[3], q[4], G)
    for j in range(3):
        d = (1.0 * (j == 0), 1.0 * (j == 1), 1.0 * (j == 2))
        for by in range(2):
            x, y, z = cross(d[0], d[1], d[2], c[0], c[1], c[2])
            if by == 1:
                x, y, z = cross(e[0], e[1], e[2], d[0], d[1], d[2])
            along = nx * x + ny * y + nz * z
            x, y, z = scale * (x - along * nx), scale * (y - along * ny), scale * (z - along * nz)
            for r in range(3):
                A[3 * by + r, j] = G[r, 0] * x + G[r, 1] * y + G[r, 2] * z
