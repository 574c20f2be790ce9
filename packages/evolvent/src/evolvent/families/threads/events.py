"""Events of threads: nodes leave and reach their spools, whole threads are released, spools stick and slip."""

import numpy as np
from numba import types, void

from evolvent.compiled.jit import INTEGERS, REAL, VECTOR, indirect, inlined
from evolvent.kernels import constraint_rows, rigid, thread
from evolvent.kernels.calls import state_at
from evolvent.kernels.drive import LEAST_OUT
from evolvent.kernels.impulse import impulse, prepare
from evolvent.kernels.rotations import cross
from evolvent.model import (
    ELASTIC,
    H_BODY,
    H_CARRIED,
    H_RELEASED,
    JUMP_ANGULAR,
    JUMP_LINEAR,
    KINETIC,
    MODEL,
    P_ALL,
    RELEASE,
    having,
)
from evolvent.model.layout import DUE

USED_FOR = "threads"

#: Share of a segment by which a drive may run past the end of its thread (round-off of a run that ends just there).
OVERRUN = 1e-6
#: Share of a segment within which of a stop of the drive no node leaves its spool: a link that stays shorter is stiff
#: without end, and one that grows from rest turns at any rate.
STAYS = 1e-6
#: Rate below which a spool with friction stands, rad/s.
STANDSTILL = 1e-9
#: Answer about an event of another family.
OTHER = 2


@inlined
def _rhs(t, y, s, model, dy):
    """The right-hand side of explicit methods."""
    state_at(model, model.rhs_calls[0])(t, y, s, model, dy)


@inlined
def event_values(t, y, s, model, g):
    """Values of the events of all threads, which stand first, and of all spools with friction, which stand last."""
    threads = model.threads
    n = threads.size
    for p in range(n):
        phi, rate, acceleration = thread.spool(t, y, threads, model.parameters, p)
        nodes_out = phi / (threads[p].segment / threads[p].radius)
        if threads[p].coiling != 0.0:
            nodes_out = thread.paid_out(threads, p, phi) / threads[p].segment
        g[2 * p] = -1.0
        g[2 * p + 1] = -1.0
        if s[n + p] != 0:
            continue
        if rate > 0.0 and not _stands_there(threads, p, s[p], rate, acceleration):
            g[2 * p] = nodes_out - s[p]
            if s[p] == threads[p].n and not threads[p].separates:
                g[2 * p] -= OVERRUN
        if rate < 0.0:
            g[2 * p + 1] = (s[p] - 1) + threads[p].capture - nodes_out
            if s[p] == 0 or (s[p] == 1 and threads[p].end >= 0):
                g[2 * p + 1] = -nodes_out - OVERRUN
            if threads[p].kind == thread.MOVING:
                least = LEAST_OUT * threads[p].n + threads[p].taken[0] / threads[p].segment
                g[2 * p + 1] = least - nodes_out - OVERRUN
    if model.info.brakes > 0:
        brake_values(t, y, s, model, g)


@inlined
def _stands_there(threads, p, i, rate, acceleration):
    """Whether the drive of thread p, of fixed segments, has just started or is about to stop: within `STAYS` of a way.

    Node i, if it is at the end of the spool then, leaves it where the drive has gone on.
    """
    if threads[p].kind != thread.INEXTENSIBLE or i == 0 or i >= threads[p].n:
        return False
    return rate * rate * threads[p].radius < abs(acceleration) * STAYS * threads[p].segment


@inlined
def brake_values(t, y, s, model, g):
    """Values of the events of spools with friction, the last of all: one that turns stops, one that sticks slips."""
    threads, stuck = model.threads, False
    first = g.size - s.size  # of the event that belongs to a switch; both stand at the end
    for p in range(threads.size):
        k = threads[p].spool_switch
        if k < 0:
            continue
        g[first + k] = -y[threads[p].spool_v] * s[k] - STANDSTILL
        stuck = stuck or s[k] == 0
    if not stuck:
        return
    _rhs(t, y, s, model, model.dy[1])
    for p in range(threads.size):
        k = threads[p].spool_switch
        if k >= 0 and s[k] == 0:
            g[first + k] = abs(thread.hold_torque(s, model, p)) / threads[p].spool_friction - 1.0


@inlined
def change_brake(t, y, s, model, switch):
    """A spool with friction has stopped and sticks, or turns on the other way where friction cannot hold it; or slips.

    An energy of the spool that is left at STANDSTILL is neglected.
    """
    threads = model.threads
    for p in range(threads.size):
        if threads[p].spool_switch != switch:
            continue
        y[threads[p].spool_v] = 0.0
        s[switch] = 0
        _rhs(t, y, s, model, model.dy[1])
        held = thread.hold_torque(s, model, p)
        if abs(held) / threads[p].spool_friction - 1.0 >= DUE:
            s[switch] = -1 if held > 0.0 else 1


@inlined
def is_release(s, threads, g, k):
    """Whether event k is that of a node leaving its spool, and due."""
    p = k // 2
    return k < 2 * threads.size and k % 2 == 0 and s[p] < threads[p].n and g[k] >= DUE


@inlined
def apply_event(t, y, s, model, k, g):
    """Carry out event k where it is one of threads, else `OTHER`; -1 where a drive has outrun its thread.

    All releases that are due by g, the values of the events, are carried out with the first of them; their values are
    then infinite.
    """
    n = model.threads.size
    if k >= model.info.ne - model.info.brakes:
        change_brake(t, y, s, model, k + s.size - model.info.ne)
        return 0
    if k >= 2 * n:
        return OTHER
    p = k // 2
    least = 1 if model.threads[p].end >= 0 else 0
    if model.threads[p].kind == thread.MOVING:
        least = s[p]  # no node leaves or comes back
    if (s[p] == least and k % 2 == 1) or (s[p] == model.threads[p].n and k % 2 == 0 and not model.threads[p].separates):
        return -1
    if is_release(s, model.threads, g, k):
        for i in range(k + 1, 2 * n):
            if is_release(s, model.threads, g, i):
                g[i] = np.inf
    add_to_balance(t, y, s, model, -1.0)
    if k % 2 == 1:
        capture_node(t, y, s, model, p)
    elif s[p] < model.threads[p].n:
        release_nodes(t, y, s, model, g)
    else:
        separate(t, y, s, model, p)
    add_to_balance(t, y, s, model, 1.0)
    thread.begin_strains(y, s, model)
    return 0


@inlined
def strike(model, p, fx, fy, fz, couple):
    """Add an impulse (N s) at the departure point of thread p, and a couple (N m s), to its body's wrench."""
    threads = model.threads
    F, d = model.bodies[threads[p].body].F, threads[p].d
    k = float(threads[p].copies)
    rigid.add_wrench(F, d[0], d[1], d[2], k * fx, k * fy, k * fz)
    for c in range(3):
        F[3 + c] += k * couple[c]


@inlined
def add_to_balance(t, y, s, model, sign):
    """Add the energy and momenta of the state, times `sign`, to the accounts of what events bring in."""
    account = model.info.nq + model.info.nv
    out = model.sums[0]
    state_at(model, model.inventory_calls[0])(t, y, s, model, out)
    y[account + RELEASE] += sign * (out[KINETIC] + out[ELASTIC])
    for c in range(3):
        y[account + JUMP_ANGULAR + c] += sign * (out[H_BODY + c] + out[H_RELEASED + c] + out[H_CARRIED + c])
        y[account + JUMP_LINEAR + c] += sign * out[P_ALL + c]


@indirect(void(REAL, VECTOR, INTEGERS, MODEL, VECTOR))
def release_nodes(t, y, s, model, g):
    """The next nodes leave their spools at Q (eqs. 1, 12): with the drive's velocity, turned along the thread if set.

    Where wound thread is carried the body takes up what the node's momentum differs from its share of evenly wound
    thread. All impulses come first, while the threads still end at Q with whole segments, then all nodes join them.
    """
    bodies, threads, nodes = model.bodies, model.threads, model.nodes
    rigid.kinematics(t, y, model)
    thread.reels(t, y, s, model)
    carried = fixed = False
    for p in range(threads.size):
        if is_release(s, threads, g, 2 * p):
            carried = carried or threads[p].carried != 0
            fixed = fixed or threads[p].kind == thread.INEXTENSIBLE
            if threads[p].carried:
                threads[p].leaving = nodes[threads[p].node + s[p]].mass
    if carried:
        prepare(t, y, s, model)
        couple = model.scratch[0]
        for p in range(threads.size):
            if threads[p].leaving > 0.0:
                place_node(y, s, threads, nodes, p)
                fx, fy, fz = thread.leave_spool(threads, nodes, bodies, p, threads[p].node + s[p], couple)
                for c in range(3):
                    couple[c] = -couple[c]
                strike(model, p, -fx, -fy, -fz, couple)
        impulse(y, s, model)
        rigid.kinematics(t, y, model)
        thread.reels(t, y, s, model)
    for p in range(threads.size):
        threads[p].leaving = 0.0
        if is_release(s, threads, g, 2 * p):
            place_node(y, s, threads, nodes, p)
            join_node(y, s, threads, nodes, p)
    if fixed:
        start_links(t, y, s, model)


@inlined
def place_node(y, s, threads, nodes, p):
    """Position and velocity with which the next node of thread p leaves, into its x and v."""
    i = s[p]
    k, q, v = threads[p].node + i, threads[p].iq + 3 * i, threads[p].iv + 3 * i
    x, u, Q = nodes[k].x, nodes[k].v, threads[p].Q
    for c in range(3):
        x[c] = threads[p].X[c]
        u[c] = 0.0
    if i > 0 and threads[p].kind == thread.INEXTENSIBLE:
        for c in range(3):
            x[c] = y[q - 3 + c]
            u[c] = y[v - 3 + c]
    elif i > 0 and threads[p].turned:
        length = 0.0
        for c in range(3):
            x[c] = (nodes[k - 1].x[c] if thread.is_end(threads, p, i - 1) else y[q - 3 + c]) - Q[c]
            length += x[c] * x[c]
        for c in range(3):
            x[c] /= np.sqrt(length)
    # a spool that turned back just after the node was taken up frees it with some length already out
    out = max(threads[p].b[0] - threads[p].segment, 0.0)
    for c in range(3):
        u[c] = Q[3 + c] + threads[p].b[1] * x[c] + out * u[c]
        x[c] = Q[c] + out * x[c]


@inlined
def join_node(y, s, threads, nodes, p):
    """The next node of thread p, placed by `place_node`, becomes its boundary node."""
    i = s[p]
    k, q, v = threads[p].node + i, threads[p].iq + 3 * i, threads[p].iv + 3 * i
    for c in range(3):
        if threads[p].kind == thread.SPRINGS:
            y[q + c], y[v + c] = nodes[k].x[c], nodes[k].v[c]
        else:
            y[q + c] = y[q - 3 + c] if i > 0 else threads[p].X[c]
            y[v + c] = y[v - 3 + c] if i > 0 else 0.0
            threads[p].start[c] = 0.0
    s[p] += 1


@indirect(void(REAL, VECTOR, INTEGERS, MODEL), used_for=having("threads", kind=thread.INEXTENSIBLE))
def start_links(t, y, s, model):
    """Put the boundary links that have no length yet onto their regular solution: their turning u and its rate g.

    All of them, since a release on one thread changes the acceleration of the body that carries the others.

    Notes
    -----
    b u' + 2 b' u = A. Where A = A0 + t A' the regular solution is u = A0 / 2 b' + t g, g = A' / 3 b'. From a short time
    later, reached with any g, u' = A' / b' - 2 g there: hence g = (u' + 2 g) / 3. Two rounds remove what A' owes to g.
    """
    threads, nodes, bodies = model.threads, model.nodes, model.bodies
    now, later = model.dy[0], model.dy[1]
    _rhs(t, y, s, model, now)
    for p in range(threads.size):
        if is_short(threads, s, p):
            thread.regular_rate(y, threads, nodes, bodies, p, s[p] - 1)
    for _ in range(2):
        for p in range(threads.size):
            if not is_short(threads, s, p):
                continue
            _rhs(t, y, s, model, now)
            b1, b2 = threads[p].b[1], threads[p].b[2]
            reach = 10.0 * thread.SHORT * threads[p].segment
            short = 2.0 * reach / (b1 + np.sqrt(b1 * b1 + 2.0 * max(b2, 0.0) * reach))
            for k in range(y.size):
                later[k] = y[k] + short * now[k]
            _rhs(t + short, later, s, model, now)
            v = threads[p].iv + 3 * (s[p] - 1)
            for c in range(3):
                threads[p].start[c] = (now[v + c] + 2.0 * threads[p].start[c]) / 3.0
            _rhs(t, y, s, model, now)


@inlined
def is_short(threads, s, p):
    """Whether thread p pays out of fixed segments and its boundary link has no length to speak of."""
    return (
        threads[p].kind == thread.INEXTENSIBLE
        and s[p] > 0
        and s[threads.size + p] == 0
        and threads[p].b[0] <= thread.SHORT * threads[p].segment
        and threads[p].b[1] > 0.0
    )


@indirect(void(REAL, VECTOR, INTEGERS, MODEL, types.int64))
def capture_node(t, y, s, model, p):
    """The boundary node goes back onto the spool; where wound thread is carried its momentum goes to the body."""
    bodies, threads, nodes = model.bodies, model.threads, model.nodes
    i = s[p] - 1
    k = threads[p].node + i
    rigid.kinematics(t, y, model)
    thread.reels(t, y, s, model)
    inextensible = threads[p].kind == thread.INEXTENSIBLE
    if inextensible:
        thread.chain_points(y, s, model, p)
    else:
        thread.spring_points(y, s, threads, nodes, p)
    couple = model.scratch[0]
    fx, fy, fz = thread.leave_spool(threads, nodes, bodies, p, k, couple)
    s[p] = i
    along = threads[p].b[1]
    if inextensible and i > 0:
        q, v = threads[p].iq + 3 * (i - 1), threads[p].iv + 3 * (i - 1)
        length = 0.0
        for c in range(3):
            y[q + c] = nodes[k - 1].x[c] - threads[p].Q[c]
            length += y[q + c] * y[q + c]
        length = np.sqrt(length)
        b0 = threads[p].b[0] + threads[p].segment
        along = 0.0
        for c in range(3):
            y[q + c] /= length
            y[v + c] = nodes[k - 1].v[c] - threads[p].Q[3 + c]
            along += y[v + c] * y[q + c]
        for c in range(3):
            y[v + c] = (y[v + c] - along * y[q + c]) / b0
        # the thread outwards moves along the new link, from its distance to the link's length
        shift = b0 - length
        for n in range(threads[p].node, k):
            m, u = nodes[n].mass, nodes[n].v
            hx, hy, hz = cross(y[q], y[q + 1], y[q + 2], m * u[0], m * u[1], m * u[2])
            couple[0] -= shift * hx
            couple[1] -= shift * hy
            couple[2] -= shift * hz
    prepare(t, y, s, model)
    if threads[p].carried:
        strike(model, p, fx, fy, fz, couple)
    for r in range(model.rows.size):
        if model.rows[r].kind == constraint_rows.THREAD and model.rows[r].index == p:
            model.rows[r].rx = threads[p].copies * (along - threads[p].b[1])
    impulse(y, s, model)


@indirect(void(REAL, VECTOR, INTEGERS, MODEL, types.int64))
def separate(t, y, s, model, p):
    """The thread's end leaves the spool: the last node flies free (separation)."""
    threads, nodes = model.threads, model.nodes
    rigid.kinematics(t, y, model)
    thread.reels(t, y, s, model)
    if threads[p].kind == thread.INEXTENSIBLE:
        thread.chain_points(y, s, model, p)
        last = threads[p].n - 1
        k = threads[p].node + last
        for c in range(3):
            y[threads[p].iq + 3 * last + c] = nodes[k].x[c]
            y[threads[p].iv + 3 * last + c] = nodes[k].v[c]
    s[threads.size + p] = 1
