"""What threads show of a state: motion and tensions of all nodes, spools, pulls, energies and momenta."""

import math

from numba import types, void

from evolvent.compiled.jit import INTEGERS, VECTOR, indirect, inlined
from evolvent.kernels.drive import FREE as FREE_SPOOL
from evolvent.kernels.points import add_angular_momentum
from evolvent.kernels.rotations import cross
from evolvent.kernels.thread.energy import thread_inventory
from evolvent.kernels.thread.spool import MOVING, held_tension, hold_torque, outer_radius, paid_out, spool_pull
from evolvent.kernels.thread.wound import wound_node
from evolvent.model import ELASTIC, H_CARRIED, H_RELEASED, KINETIC, MODEL, P_ALL

USED_FOR = "threads"


@inlined
def _note_pull(x, inner, tension, out):
    """Pull (3,) of a tension at x towards the place `inner`."""
    dx, dy, dz = inner[0] - x[0], inner[1] - x[1], inner[2] - x[2]
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    scale = tension / length if length > 0.0 else 0.0
    out[0], out[1], out[2] = scale * dx, scale * dy, scale * dz


@indirect(void(VECTOR, INTEGERS, MODEL, types.int64))
def note_results(y, s, model, p):
    """Fields of thread p and of its nodes that are results; after the explicit right-hand side of the state."""
    threads, nodes, bodies = model.threads, model.nodes, model.bodies
    first, n, b, gone = threads[p].node, threads[p].n, threads[p].body, s[threads.size + p] != 0
    sums = threads[p].sums
    for i in range(sums.size):
        sums[i] = 0.0
    thread_inventory(y, s, model, p, sums)  # which places the released nodes
    w, at, moves = bodies[b].w, bodies[b].x, bodies[b].v
    for i in range(s[p], n):
        k, node = first + i, wound_node(threads, bodies, p, i)
        turning = cross(w[0], w[1], w[2], node[0], node[1], node[2])
        for c in range(3):
            nodes[k].x[c] = at[c] + node[c]
            nodes[k].v[c] = moves[c] + turning[c] + node[3 + c]
        nodes[k].tension = 0.0
    phi, whole = threads[p].phi, n * threads[p].segment
    threads[p].turning = threads[p].b[1] / threads[p].r
    threads[p].reach = outer_radius(threads, p, phi)
    threads[p].out = whole if gone else min(max(paid_out(threads, p, phi), 0.0), whole)
    if threads[p].kind == MOVING:
        threads[p].out = threads[p].b[0]
    threads[p].hub = held_tension(s, model, p)
    threads[p].torque = spool_pull(s, model, p) * threads[p].reach
    last = first + max(s[p] - 1, 0)
    _note_pull(threads[p].Q, nodes[last].x, threads[p].hub, threads[p].hub_pull)
    if threads[p].kind == MOVING:
        for c in range(3):
            threads[p].hub_pull[c] = threads[p].exit[c]
    tension = nodes[first].tension if s[p] > 0 else 0.0
    if s[p] > 1:
        _note_pull(nodes[first].x, nodes[first + 1].x, tension, threads[p].end_pull)
    else:
        _note_pull(nodes[first].x, threads[p].Q, tension, threads[p].end_pull)
    k = threads[p].spool_switch
    if threads[p].drive == FREE_SPOOL and k >= 0 and s[k] == 0:
        threads[p].friction = hold_torque(s, model, p)
    threads[p].kinetic, threads[p].elastic = sums[KINETIC], sums[ELASTIC]
    for c in range(3):
        threads[p].linear[c] = sums[P_ALL + c]
        threads[p].angular[c] = sums[H_RELEASED + c] + sums[H_CARRIED + c]
    if threads[p].tip >= 0:  # a point mass that has the mass of the first node
        m, x, v = model.points[threads[p].tip].mass, nodes[first].x, nodes[first].v
        threads[p].kinetic += 0.5 * m * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
        add_angular_momentum(threads[p].angular, 0, m, x[0], x[1], x[2], v[0], v[1], v[2])
        for c in range(3):
            threads[p].linear[c] += m * v[c]
