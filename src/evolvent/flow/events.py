"""Events: nodes leave and reach their spools, threads are let go, a user's events."""

import numpy as np

from evolvent.flow.impulse import impulse, prepare
from evolvent.jit import event_law_at, inlined, kernel
from evolvent.kernels import joints, rigid, thread
from evolvent.kernels.rotations import cross
from evolvent.model import (
    ELASTIC,
    H_BODY,
    H_RELEASED,
    H_WOUND,
    JUMP_ANGULAR,
    JUMP_LINEAR,
    KINETIC,
    P_ALL,
    RELEASE,
)

#: Share of a segment by which a feed may run past the end of its thread (round-off of a run that ends just there).
OVERRUN = 1e-6


@kernel
def event_values(t, y, s, model, g):
    """Values of all events; an event fires where its value is not negative.

    Parameters
    ----------
    g : (ne,) float, output: release and capture of every thread, then the user's events
    """
    threads = model.threads
    n = threads.size
    for p in range(n):
        phi, rate, acceleration = thread.spool(t, y, threads, model.parameters, p)
        turn_per_node = threads[p].segment / threads[p].radius
        g[2 * p] = -1.0
        g[2 * p + 1] = -1.0
        if s[n + p] != 0:
            continue
        if rate > 0.0:
            g[2 * p] = phi / turn_per_node - s[p]
            if s[p] == threads[p].n and not threads[p].lets_go:
                g[2 * p] -= OVERRUN
        if rate < 0.0:
            g[2 * p + 1] = (s[p] - 1) + threads[p].capture - phi / turn_per_node
            if s[p] == 0:
                g[2 * p + 1] = -phi / turn_per_node - OVERRUN
    for k in range(model.events.size):
        parameters = model.parameters[model.events[k].first : model.events[k].last]
        g[2 * n + k] = event_law_at(model.events[k].law)(t, y, parameters)


@kernel
def apply_event(t, y, s, model, k, rhs1, inventory1):
    """Carry out event k on the state; returns 1 if the run is to stop there, -1 if a feed has outrun its thread.

    rhs1 and inventory1 are 1-tuples of these functions: called through pointers they are compiled once, not here again.
    """
    n = model.threads.size
    if k >= 2 * n:
        return model.events[k - 2 * n].stops
    account = model.info[0].nq + model.info[0].nv
    inventory1[0](t, y, s, model, model.sums[0])
    energy = model.sums[0][KINETIC] + model.sums[0][ELASTIC]
    p = k // 2
    if (s[p] == 0 and k % 2 == 1) or (s[p] == model.threads[p].n and k % 2 == 0 and not model.threads[p].lets_go):
        return -1
    for c in range(3):
        y[account + JUMP_ANGULAR + c] -= counted_momentum(model, model.sums[0], p, c)
        y[account + JUMP_LINEAR + c] -= model.sums[0][P_ALL + c]
    if k % 2 == 1:
        capture_node(t, y, s, model, p)
    elif s[p] < model.threads[p].n:
        release_node(t, y, s, model, p, rhs1)
    else:
        let_go(t, y, s, model, p)
    inventory1[0](t, y, s, model, model.sums[0])
    y[account + RELEASE] += model.sums[0][KINETIC] + model.sums[0][ELASTIC] - energy
    for c in range(3):
        y[account + JUMP_ANGULAR + c] += counted_momentum(model, model.sums[0], p, c)
        y[account + JUMP_LINEAR + c] += model.sums[0][P_ALL + c]
    return 0


@kernel
def counted_momentum(model, out, p, c):
    """Component c of the angular momentum that the model moves: wound thread counts where it is carried."""
    value = out[H_BODY + c] + out[H_RELEASED + c]
    if model.threads[p].carried:
        value += out[H_WOUND + c]
    return value


@kernel
def release_node(t, y, s, model, p, rhs1):
    """The next node leaves the spool at Q (eqs. 1, 12): with the feed's velocity, turned along the thread if set."""
    bodies, threads, nodes = model.bodies, model.threads, model.nodes
    i = s[p]
    q, v = threads[p].iq + 3 * i, threads[p].iv + 3 * i
    rigid.kinematics(t, y, bodies)
    thread.reels(t, y, s, threads, bodies, model.parameters)
    speed = threads[p].b[1]
    # a spool that turned back just after the node was taken up frees it with some length already out
    out = max(threads[p].b[0] - threads[p].segment, 0.0)
    e = model.scratch[0]
    for c in range(3):
        e[c] = threads[p].X[c]
    if i > 0 and (threads[p].turned or threads[p].kind == thread.INEXTENSIBLE):
        if threads[p].kind == thread.INEXTENSIBLE:
            for c in range(3):
                e[c] = y[q - 3 + c]
        else:
            length = 0.0
            for c in range(3):
                e[c] = y[q - 3 + c] - threads[p].Q[c]
                length += e[c] * e[c]
            length = np.sqrt(length)
            for c in range(3):
                e[c] /= length
    if threads[p].carried and i > 0:
        # while the node is still on the spool: it moves with the body, and the segment outwards pulls on Q
        m = nodes[threads[p].node + i].mass
        fx = m * speed * (threads[p].X[0] - e[0])
        fy = m * speed * (threads[p].X[1] - e[1])
        fz = m * speed * (threads[p].X[2] - e[2])
        prepare(t, y, s, model)
        impulse(y, s, model, p, fx, fy, fz)
        rigid.kinematics(t, y, bodies)
        thread.reels(t, y, s, threads, bodies, model.parameters)
    if threads[p].kind == thread.SPRINGS:
        for c in range(3):
            y[q + c] = threads[p].Q[c] + out * e[c]
            y[v + c] = threads[p].Q[3 + c] + speed * e[c]
        s[p] += 1
    else:
        for c in range(3):
            y[q + c] = e[c]
            y[v + c] = y[v - 3 + c] if i > 0 else 0.0
        s[p] += 1
    if threads[p].kind == thread.INEXTENSIBLE:
        for c in range(3):
            threads[p].start[c] = 0.0
        start_links(t, y, s, model, rhs1)


@kernel
def start_links(t, y, s, model, rhs1):
    """Put the boundary links that have no length yet onto their regular solution: their turning u and its rate g.

    All of them, since a release on one thread changes the acceleration of the body that carries the others.

    Notes
    -----
    b u' + 2 b' u = A. Where A = A0 + t A' the regular solution is u = A0 / 2 b' + t g, g = A' / 3 b'. From a short time
    later, reached with any g, u' = A' / b' - 2 g there: hence g = (u' + 2 g) / 3. Two rounds remove what A' owes to g.
    """
    threads, nodes, bodies = model.threads, model.nodes, model.bodies
    now, later = model.dy[0], model.dy[1]
    rhs1[0](t, y, s, model, now)
    for p in range(threads.size):
        if is_short(threads, s, p):
            thread.regular_rate(y, threads, nodes, bodies, p, s[p] - 1)
    for _ in range(2):
        for p in range(threads.size):
            if not is_short(threads, s, p):
                continue
            rhs1[0](t, y, s, model, now)
            b1, b2 = threads[p].b[1], threads[p].b[2]
            if threads[p].feed == thread.FREE_SPOOL:
                b2 = threads[p].radius * now[threads[p].spool_v]
            reach = 10.0 * thread.SHORT * threads[p].segment
            short = 2.0 * reach / (b1 + np.sqrt(b1 * b1 + 2.0 * max(b2, 0.0) * reach))
            for k in range(y.size):
                later[k] = y[k] + short * now[k]
            rhs1[0](t + short, later, s, model, now)
            v = threads[p].iv + 3 * (s[p] - 1)
            for c in range(3):
                threads[p].start[c] = (now[v + c] + 2.0 * threads[p].start[c]) / 3.0
            rhs1[0](t, y, s, model, now)


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


@kernel
def capture_node(t, y, s, model, p):
    """The boundary node goes back onto the spool; where wound thread is carried its momentum goes to the body."""
    bodies, threads, nodes = model.bodies, model.threads, model.nodes
    j = s[p]
    i = j - 1
    rigid.kinematics(t, y, bodies)
    thread.reels(t, y, s, threads, bodies, model.parameters)
    inextensible = threads[p].kind == thread.INEXTENSIBLE
    if inextensible:
        thread.chain_points(y, s, threads, nodes, p)
    else:
        thread.spring_points(y, s, threads, nodes, p)
    k = threads[p].node + i
    m = nodes[k].mass
    speed = threads[p].b[1]
    # the node's momentum less what it has on the spool, as a force impulse at Q and a couple
    x, u, Q, b = nodes[k].x, nodes[k].v, threads[p].Q, threads[p].body
    dx, dy, dz, ux, uy, uz, ax, ay, az = thread.wound_node(threads, bodies, p, i)
    wx, wy, wz = cross(bodies[b].w[0], bodies[b].w[1], bodies[b].w[2], dx, dy, dz)
    wx, wy, wz = bodies[b].v[0] + wx + ux, bodies[b].v[1] + wy + uy, bodies[b].v[2] + wz + uz
    fx, fy, fz = m * (u[0] - wx), m * (u[1] - wy), m * (u[2] - wz)
    before = cross(x[0], x[1], x[2], m * u[0], m * u[1], m * u[2])
    after = cross(bodies[b].x[0] + dx, bodies[b].x[1] + dy, bodies[b].x[2] + dz, m * wx, m * wy, m * wz)
    moment = cross(Q[0], Q[1], Q[2], fx, fy, fz)
    couple = model.scratch[0]
    for c in range(3):
        couple[c] = before[c] - after[c] - moment[c]
    if not threads[p].carried:
        fx = fy = fz = 0.0
        for c in range(3):
            couple[c] = 0.0
    s[p] = i
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
        prepare(t, y, s, model)
        for c in range(3):
            bodies[b].F[3 + c] = threads[p].copies * couple[c]
        for r in range(model.rows.size):
            if model.rows[r].kind == joints.THREAD and model.rows[r].index == p:
                model.rows[r].rx = threads[p].copies * (along - speed)
        impulse(y, s, model, p, fx, fy, fz)
    elif threads[p].carried:
        prepare(t, y, s, model)
        for c in range(3):
            bodies[b].F[3 + c] = threads[p].copies * couple[c]
        impulse(y, s, model, p, fx, fy, fz)


@kernel
def let_go(t, y, s, model, p):
    """The thread's end leaves the spool: the last node flies free (separation)."""
    bodies, threads, nodes = model.bodies, model.threads, model.nodes
    rigid.kinematics(t, y, bodies)
    thread.reels(t, y, s, threads, bodies, model.parameters)
    if threads[p].kind == thread.INEXTENSIBLE:
        thread.chain_points(y, s, threads, nodes, p)
        last = threads[p].n - 1
        k = threads[p].node + last
        for c in range(3):
            y[threads[p].iq + 3 * last + c] = nodes[k].x[c]
            y[threads[p].iv + 3 * last + c] = nodes[k].v[c]
    s[threads.size + p] = 1
