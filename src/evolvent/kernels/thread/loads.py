"""Loads on the released nodes of a thread."""

import math

from numba import types

from evolvent.jit import INTEGERS, REAL, VECTOR, indirect, inlined
from evolvent.kernels.fields import acceleration
from evolvent.kernels.loads import AT_MARKER, node_share, thread_load
from evolvent.kernels.thread.wound import TINY
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


@indirect(REAL(REAL, INTEGERS, MODEL, types.int64, VECTOR))
def load_resultant(t, s, model, a, out):
    """Resultant of load a on its thread, of a state whose nodes are known; returns its power, W, on all copies.

    Parameters
    ----------
    out : (6,) float, output: force (N), middle of the released thread (m), inertial axes; where it leaves the spool if
        nothing is released
    """
    threads, nodes, bodies, loads = model.threads, model.nodes, model.bodies, model.loads
    e, position, velocity = model.scratch[0], model.scratch[1], model.scratch[2]
    p = loads[a].target
    power, length = 0.0, 0.0
    for c in range(6):
        out[c] = 0.0
    for i in range(s[p]):
        node_motion(threads, nodes, s, p, i, e, position, velocity)
        fx, fy, fz = thread_load(t, loads, model, bodies, a, threads[p].body, threads[p].chord, position, velocity, e)
        span = node_share(loads, a, i, nodes[threads[p].node + i].span)
        out[0] += fx * span
        out[1] += fy * span
        out[2] += fz * span
        power += span * (fx * velocity[0] + fy * velocity[1] + fz * velocity[2])
        length += span
        for c in range(3):
            out[3 + c] += span * position[c]
    for c in range(3):
        out[3 + c] = out[3 + c] / length if length > 0.0 else threads[p].Q[c]
    return power * threads[p].copies


@indirect(REAL(REAL, INTEGERS, MODEL, types.int64))
def node_loads(t, s, model, p):
    """Accelerations by loads of the released nodes into af, from x and v; returns their power, W."""
    threads, nodes, bodies, loads = model.threads, model.nodes, model.bodies, model.loads
    gravity, scratch = model.info.gravity, model.scratch
    first, j = threads[p].node, s[p]
    power = 0.0
    for i in range(j):
        k = first + i
        for c in range(3):
            nodes[k].af[c] = gravity[c]
    if model.fields.size > 0:
        for i in range(j):
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
                scale = node_share(loads, a, i, nodes[k].span) / nodes[k].mass
                nodes[k].af[0] += fx * scale
                nodes[k].af[1] += fy * scale
                nodes[k].af[2] += fz * scale
    for i in range(j):
        k = first + i
        power += nodes[k].mass * (
            nodes[k].af[0] * nodes[k].v[0] + nodes[k].af[1] * nodes[k].v[1] + nodes[k].af[2] * nodes[k].v[2]
        )
    return power * threads[p].copies
