"""Threads with segments of fixed length under implicit methods: positions of nodes, and a constraint a segment.

The constraints are joints of the kind SEGMENT (`evolvent.kernels.gaps`): a node keeps the distance l0 to the next one,
or at the spool the distance b from Q. Their multipliers are the tensions, which the nodes' records hold from the last
forces of the joints on. Of a wound node the joint does not hold.
"""

import math

from evolvent.algebra.sparse import add_entry
from evolvent.compiled.jit import inlined
from evolvent.kernels.drive import FREE as FREE_SPOOL
from evolvent.kernels.gaps import SEGMENT
from evolvent.kernels.rigid import add_wrench
from evolvent.kernels.thread.spool import JOINED, MOVING, SPRINGS, held_tension, outer_radius, paid_out, pull_spool
from evolvent.kernels.thread.wound import spool

#: Part of a segment below which the one at a spool has just begun.
BEGUN = 1e-2


@inlined
def length_at_spool(t, y, model, p, i):
    """Length of the segment between the spool and node i of thread p, and its rate."""
    threads = model.threads
    phi, rate, _ = spool(t, y, threads, model.parameters, p)
    return paid_out(threads, p, phi) - i * threads[p].segment, outer_radius(threads, p, phi) * rate


@inlined
def has_springs(model):
    """Whether threads have segments of springs, which no step of an implicit method resolves."""
    found = False
    for p in range(model.threads.size):
        found = found or model.threads[p].kind == SPRINGS or model.threads[p].kind == MOVING
    return found


@inlined
def leaves_spool(model):
    """Whether the segment at a spool has just begun, after `reels`: it has no length to move about."""
    threads, s, found = model.threads, model.switches, False
    for p in range(threads.size):
        out = s[p] > 0 and s[threads.size + p] == 0
        found = found or (out and threads[p].kind == JOINED and threads[p].b[0] < BEGUN * threads[p].segment)
    return found


@inlined
def joined_thread(y, s, model, p, loaded, dy):
    """Accelerations of the nodes of thread p by loads alone into dy; returns the power of the spool, W.

    After `reels` and the forces of the joints; the rate of b is that of the interval.
    """
    threads, nodes, v = model.threads, model.nodes, model.threads[p].iv
    for i in range(s[p] if loaded else 0):
        for c in range(3):
            dy[v + 3 * i + c] = nodes[threads[p].node + i].af[c]
    if threads[p].drive == FREE_SPOOL:
        return threads[p].copies * threads[p].motor * y[threads[p].spool_v]
    return -threads[p].copies * held_tension(s, model, p) * threads[p].b[1]


@inlined
def couple_spool(matrix, p, row, scale, damped, model):
    """Couple the multiplier `row` of the segment at free spool p with the spool's angle: r T, and the length paid out.

    The radius is that of the last `reels`.
    """
    threads = model.threads
    if threads[p].drive == FREE_SPOOL:
        k, value = threads[p].spool_v - model.info.nq, scale * threads[p].r
        add_entry(matrix, k, row, -threads[p].copies * value)
        add_entry(matrix, row, k, -value * damped)


@inlined
def turn_spool(matrix, y, p, row, scale, model):
    """Add what the angle of free spool p changes in the length of the segment there, at the end of a step."""
    threads = model.threads
    if threads[p].drive == FREE_SPOOL:
        k = threads[p].spool_v - model.info.nq
        add_entry(matrix, row, k, -scale * outer_radius(threads, p, y[threads[p].spool_q]))


@inlined
def note_tensions(la, model):
    """Make the multipliers of the joints of segments the tensions of the nodes."""
    for k in range(model.joints.size):
        if model.joints[k].kind == SEGMENT:
            model.nodes[model.threads[model.joints[k].first].node + model.joints[k].last].tension = la[k]


@inlined
def pull_joined(s, model, p):
    """The tension that the records hold at the spool of thread p, onto its body and a free spool, after `reels`."""
    threads, Q, d = model.threads, model.threads[p].Q, model.threads[p].d
    if threads[p].kind != JOINED or s[p] == 0 or s[threads.size + p] != 0:
        return
    k = threads[p].node + s[p] - 1
    x, T = model.nodes[k].x, model.nodes[k].tension
    ex, ey, ez = x[0] - Q[0], x[1] - Q[1], x[2] - Q[2]
    length = math.sqrt(ex * ex + ey * ey + ez * ez)
    pull = threads[p].copies * T / length if length > 0.0 else 0.0
    add_wrench(model.bodies[threads[p].body].F, d[0], d[1], d[2], pull * ex, pull * ey, pull * ez)
    pull_spool(model, p, T)
