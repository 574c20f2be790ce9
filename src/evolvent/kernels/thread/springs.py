"""Released thread with segments of springs: right-hand side, its pull on the body."""

import math

from numba import types

from evolvent.compiled.jit import INTEGERS, REAL, VECTOR, indirect, inlined
from evolvent.kernels.drive import FREE as FREE_SPOOL
from evolvent.kernels.rigid import add_wrench
from evolvent.kernels.thread.end import TINY, is_end, pull_end
from evolvent.kernels.thread.spool import pull_spool
from evolvent.model import MODEL


@inlined
def spring_points(y, s, threads, nodes, p):
    """Positions and velocities of the released nodes of a spring thread into x, v."""
    first, q, v = threads[p].node, threads[p].iq, threads[p].iv
    for i in range(s[p]):
        if is_end(threads, p, i):  # see `end.place_end`
            continue
        for c in range(3):
            nodes[first + i].x[c] = y[q + 3 * i + c]
            nodes[first + i].v[c] = y[v + 3 * i + c]


@inlined
def taut(elastic, damped):
    """Elastic and damping part of the tension of a segment that goes slack, N: none below its length, no push above.

    A segment that contracts faster than its spring pulls carries no force: the damper takes what the spring releases.
    """
    if elastic <= 0.0:
        return 0.0, 0.0
    return elastic, max(damped, -elastic)


@indirect(REAL(VECTOR, INTEGERS, MODEL))
def longest_step(y, s, model):
    """Time until the first stretched segment without a pull is as short as its natural length, s; infinity for none.

    What its damper takes until then, and no longer, is c extension rate: a step that ends there integrates it exactly.
    """
    threads, nodes, found = model.threads, model.nodes, math.inf
    for p in range(threads.size):
        if threads[p].slack == 0:
            continue
        first, last, Q = threads[p].node, s[p] - 1, threads[p].Q
        for i in range(s[p] if s[threads.size + p] == 0 else last):
            q, v, rest, longer = threads[p].iq + 3 * i, threads[p].iv + 3 * i, threads[p].segment, 0.0
            if i == last:
                rest, longer = threads[p].b[0], threads[p].b[1]
            square = product = 0.0
            for c in range(3):
                x, u = y[q + c], y[v + c]
                if is_end(threads, p, i):
                    x, u = nodes[first].x[c], nodes[first].v[c]
                dx = x - (Q[c] if i == last else y[q + 3 + c])
                square += dx * dx
                product += dx * (u - (Q[3 + c] if i == last else y[v + 3 + c]))
            length = math.sqrt(square)
            if length - rest > 1e-9 * threads[p].segment:
                rate = product / length - longer
                if threads[p].stiffness * (length - rest) + threads[p].damping * rate <= 0.0:
                    found = min(found, (length - rest) / -rate)
    return found


@indirect(types.UniTuple(REAL, 2)(VECTOR, INTEGERS, MODEL, types.int64, types.boolean, VECTOR))
def spring_thread(y, s, model, p, loaded, dy):
    """Right-hand side of a spring thread (eqs. 3, 4, 7 to 11) and its pull on the body (eq. 15).

    Tensions go to the nodes. Returns (power dissipated, power of the spool), W.
    """
    threads, nodes, bodies = model.threads, model.nodes, model.bodies
    j, driven = s[p], 0.0
    if threads[p].drive == FREE_SPOOL:
        driven = threads[p].copies * threads[p].motor * y[threads[p].spool_v]
    if j == 0:
        return 0.0, driven
    first, q, v, l0 = threads[p].node, threads[p].iq, threads[p].iv, threads[p].segment
    stiffness, damping = threads[p].stiffness, threads[p].damping
    dissipated = 0.0
    px = py = pz = 0.0  # pull of the outer segment on the node
    x, yy, z = y[q], y[q + 1], y[q + 2]
    vx, vy, vz = y[v], y[v + 1], y[v + 2]
    if is_end(threads, p, 0):
        x, yy, z = nodes[first].x[0], nodes[first].x[1], nodes[first].x[2]
        vx, vy, vz = nodes[first].v[0], nodes[first].v[1], nodes[first].v[2]
    for i in range(j - 1):
        a, c = q + 3 * i, v + 3 * i
        x1, y1, z1 = y[a + 3], y[a + 4], y[a + 5]
        vx1, vy1, vz1 = y[c + 3], y[c + 4], y[c + 5]
        ex, ey, ez = x - x1, yy - y1, z - z1
        length = math.sqrt(ex * ex + ey * ey + ez * ez)
        scale = 1.0 / length
        rate = ((vx - vx1) * ex + (vy - vy1) * ey + (vz - vz1) * ez) * scale
        elastic, damped = stiffness * (length - l0), damping * rate
        if threads[p].slack != 0:
            elastic, damped = taut(elastic, damped)
        T = elastic + damped
        dissipated += damped * rate
        nodes[first + i].tension = T
        scale *= T
        ex *= scale
        ey *= scale
        ez *= scale
        if is_end(threads, p, i):
            pull_end(model, p, -ex, -ey, -ez)
        else:
            m = nodes[first + i].compliance
            dy[a], dy[a + 1], dy[a + 2] = vx, vy, vz
            dy[c] = (px - ex) * m
            dy[c + 1] = (py - ey) * m
            dy[c + 2] = (pz - ez) * m
        px, py, pz = ex, ey, ez
        x, yy, z, vx, vy, vz = x1, y1, z1, vx1, vy1, vz1
    ex, ey, ez = x - threads[p].Q[0], yy - threads[p].Q[1], z - threads[p].Q[2]
    length = math.sqrt(ex * ex + ey * ey + ez * ez)
    if length > TINY:
        scale = 1.0 / length
        ex *= scale
        ey *= scale
        ez *= scale
    else:  # along the velocity with which the node leaves: the drive's (eq. 11), or that turned along the thread
        ex, ey, ez = vx - threads[p].Q[3], vy - threads[p].Q[4], vz - threads[p].Q[5]
        length = math.sqrt(ex * ex + ey * ey + ez * ez)
        if length > 0.0:
            scale = 1.0 / length
            ex *= scale
            ey *= scale
            ez *= scale
        else:
            ex, ey, ez = threads[p].X[0], threads[p].X[1], threads[p].X[2]
        length = 0.0
    stretch_rate = (vx - threads[p].Q[3]) * ex + (vy - threads[p].Q[4]) * ey + (vz - threads[p].Q[5]) * ez
    b1 = threads[p].b[1]
    rate = stretch_rate - b1 * (threads[p].X[0] * ex + threads[p].X[1] * ey + threads[p].X[2] * ez)
    elastic = stiffness * (length - threads[p].b[0])
    if s[threads.size + p] != 0:  # released whole
        elastic = rate = 0.0
    damped = damping * rate
    if threads[p].slack != 0:
        elastic, damped = taut(elastic, damped)
    T = elastic + damped
    nodes[first + j - 1].tension = T
    a, c = q + 3 * (j - 1), v + 3 * (j - 1)
    if is_end(threads, p, j - 1):
        pull_end(model, p, -T * ex, -T * ey, -T * ez)
    else:
        m = nodes[first + j - 1].compliance
        dy[a], dy[a + 1], dy[a + 2] = vx, vy, vz
        dy[c] = (px - T * ex) * m
        dy[c + 1] = (py - T * ey) * m
        dy[c + 2] = (pz - T * ez) * m
    if loaded:
        if is_end(threads, p, 0):
            pull_end(model, p, nodes[first].af[0], nodes[first].af[1], nodes[first].af[2])
        for i in range(1 if is_end(threads, p, 0) else 0, j):
            for k in range(3):
                dy[v + 3 * i + k] += nodes[first + i].af[k]
    copies = threads[p].copies
    pull = copies * T
    add_wrench(
        bodies[threads[p].body].F, threads[p].d[0], threads[p].d[1], threads[p].d[2], pull * ex, pull * ey, pull * ez
    )
    if threads[p].drive == FREE_SPOOL:  # which turns by `spool.spring_spools`
        pull_spool(model, p, T)
        dissipated += damped * (stretch_rate - b1)
        return copies * dissipated, driven
    else:
        # what is left of the boundary's power once strain energy and dissipation are taken out
        dissipated += damped * rate
        power = -elastic * b1 - damped * (stretch_rate - rate)
    return copies * dissipated, copies * power
