"""Loads on the released nodes of a thread."""

import math

from numba import types, void

from evolvent.compiled.jit import INTEGERS, REAL, VECTOR, indirect, inlined
from evolvent.kernels.fields import acceleration, gradient
from evolvent.kernels.law_slopes import force_law_gradient
from evolvent.kernels.loads import AT_MARKER, FRAME, LAW, NODE, RADIATION, node_share, thread_load
from evolvent.kernels.profile import window
from evolvent.kernels.rotations import turn, turn_back
from evolvent.kernels.sides import ON_BODY, side_columns
from evolvent.kernels.sparse import SPARSE, add_block
from evolvent.kernels.thread.end import TINY, is_end
from evolvent.kernels.work import note_power
from evolvent.model import MODEL


@inlined
def node_motion(threads, nodes, s, p, i, e, x, v):
    """Outward tangent, position and velocity of a released node of a thread into e, x and v, (3,) each."""
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
    """Add what fields and loads on released nodes change with their motion and with turns of the reel's body.

    Left out is how light follows the direction of a thread, and what the end of a thread on a body or a point changes.
    """
    threads, nodes, loads, n_q, s = model.threads, model.nodes, model.loads, model.info.nq, model.switches
    e, x, v, A = model.scratch[0], model.scratch[1], model.scratch[2], model.K12
    for p in range(threads.size):
        for i in range(1 if is_end(threads, p, 0) else 0, s[p]):
            k, at = threads[p].node + i, threads[p].iv + 3 * i - n_q
            node_motion(threads, nodes, s, p, i, e, x, v)
            if model.fields.size > 0:
                gradient(t, model, x, v, 1.0, c_rate, A, 0)
                add_block(matrix, at, at, A, 0, 0, 3, 3, -nodes[k].mass)
            for a in range(loads.size):
                if loads[a].kind < AT_MARKER and loads[a].target == p and loads[a].kind != RADIATION:
                    share = node_share(loads, a, i, nodes[k].span)
                    if share != 0.0:
                        _add_node_load(t, c_rate, a, p, at, share, model, matrix)


@inlined
def _add_node_load(t, c_rate, a, p, at, share, model, matrix):
    """Add what load a changes on a node of thread p, whose state is noted in model.scratch."""
    loads, bodies, body = model.loads, model.bodies, model.threads[p].body
    e, x, v, A, J = model.scratch[0], model.scratch[1], model.scratch[2], model.K12, model.J[0]
    q, R, local = model.parameters[loads[a].first : loads[a].last], bodies[body].R, model.e[2]
    turns = loads[a].kind != LAW and q[FRAME] != 0.0
    if loads[a].law != 0:
        if loads[a].kind == NODE:
            value = share * window(t, q[4], q[5], q[6])
            own = model.parameters[loads[a].law_first : loads[a].law_last]
            force_law_gradient(loads[a].law, own, t, x, v, 1.0, c_rate, A, 0)
            for c in range(3):
                for d in range(3):
                    A[c, d] *= q[c]
            if turns:
                for d in range(3):
                    A[0, d], A[1, d], A[2, d] = turn(R, A[0, d], A[1, d], A[2, d])
        else:
            value = share * loads[a].scale
            force_law_gradient(loads[a].law, q, t, x, v, 1.0, c_rate, A, 0)
        add_block(matrix, at, at, A, 0, 0, 3, 3, -value)
    if turns:
        fx, fy, fz = thread_load(t, loads, model, bodies, a, body, model.threads[p].chord, x, v, e)
        local[0], local[1], local[2] = turn_back(R, fx, fy, fz)
        bt, n = side_columns(model, ON_BODY, body, -1, local, False, J)
        if n > 0:
            add_block(matrix, at, bt, J, 0, 0, 3, n, -share)
