"""Loads on the released nodes of a thread."""

import math

from numba import types

from evolvent.jit import INTEGERS, REAL, indirect
from evolvent.kernels.loads import AT_MARKER, thread_load
from evolvent.kernels.thread.wound import TINY
from evolvent.model import MODEL


@indirect(REAL(REAL, INTEGERS, MODEL, types.int64))
def node_loads(t, s, model, p):
    """Accelerations by loads of the released nodes into af, from x and v; returns their power, W."""
    threads, nodes, bodies, loads = model.threads, model.nodes, model.bodies, model.loads
    gravity, parameters, scratch = model.info.gravity, model.parameters, model.scratch
    first, j = threads[p].node, s[p]
    power = 0.0
    for i in range(j):
        k = first + i
        for c in range(3):
            nodes[k].af[c] = gravity[c]
    if loads.size > 0:
        last = j - 1
        held = s[threads.size + p] == 0
        e, position, velocity = scratch[0], scratch[1], scratch[2]
        for i in range(j):
            k = first + i
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
                position[c] = nodes[k].x[c]
                velocity[c] = nodes[k].v[c]
            for a in range(loads.size):
                if loads[a].kind >= AT_MARKER or loads[a].target != p:
                    continue
                fx, fy, fz = thread_load(
                    t, loads, parameters, bodies, a, threads[p].body, threads[p].chord, position, velocity, e
                )
                scale = nodes[k].span / nodes[k].mass
                nodes[k].af[0] += fx * scale
                nodes[k].af[1] += fy * scale
                nodes[k].af[2] += fz * scale
    for i in range(j):
        k = first + i
        power += nodes[k].mass * (
            nodes[k].af[0] * nodes[k].v[0] + nodes[k].af[1] * nodes[k].v[1] + nodes[k].af[2] * nodes[k].v[2]
        )
    return power * threads[p].copies
