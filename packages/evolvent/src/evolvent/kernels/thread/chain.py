"""Released thread with segments of fixed length: tensions, right-hand side, jumps of its rates.

The state holds the tangent e_i and its rate u_i = e_i', so that lengths are exact. Tensions T follow from a tridiagonal
system, whose last row is the boundary link's (see `evolvent.kernels.constraint_rows`).
"""

import math

from numba import types, void

from evolvent.compiled.jit import INTEGERS, REAL, VECTOR, indirect, inlined
from evolvent.kernels.drive import FREE as FREE_SPOOL
from evolvent.kernels.rigid import centripetal
from evolvent.kernels.rotations import cross
from evolvent.kernels.thread.spool import INEXTENSIBLE, is_loose, spool_acceleration
from evolvent.model import MODEL, having

USED_FOR = having("threads", kind=INEXTENSIBLE)
#: Of a segment: below this length a boundary link turns at the rate found at its release.
SHORT = 1e-7


@indirect(void(VECTOR, INTEGERS, MODEL, types.int64))
def chain_points(y, s, model, p):
    """Positions and velocities of the released nodes of an inextensible thread into x, v."""
    threads, nodes = model.threads, model.nodes
    j, n, first = s[p], threads[p].n, threads[p].node
    q, v, l0 = threads[p].iq, threads[p].iv, threads[p].segment
    for i in range(j - 1, -1, -1):
        k = first + i
        for c in range(3):
            e, u = y[q + 3 * i + c], y[v + 3 * i + c]
            if i < j - 1:
                nodes[k].x[c] = nodes[k + 1].x[c] + l0 * e
                nodes[k].v[c] = nodes[k + 1].v[c] + l0 * u
            elif j == n and s[threads.size + p] != 0:
                nodes[k].x[c] = e
                nodes[k].v[c] = u
            else:
                nodes[k].x[c] = threads[p].Q[c] + threads[p].b[0] * e
                nodes[k].v[c] = threads[p].Q[3 + c] + threads[p].b[1] * e + threads[p].b[0] * u


@inlined
def chain_links(s, threads, p):
    """Number of links with a node at both ends, and whether a boundary link to Q follows them."""
    j = s[p]
    bound = j > 0 and s[threads.size + p] == 0
    return max(j - 1, 0), bound


@indirect(REAL(VECTOR, INTEGERS, MODEL, types.int64))
def chain_matrix(y, s, model, p):
    """Eliminate the tensions of the free links: inverse pivots piv, factors off; returns the boundary's diagonal.

    Row i: -c_i-1,i / m_i T_i-1 + (1 / m_i + 1 / m_i+1) T_i - c_i,i+1 / m_i+1 T_i+1, with c the cosines between
    neighbouring tangents.
    """
    threads, nodes = model.threads, model.nodes
    links, bound = chain_links(s, threads, p)
    first, q = threads[p].node, threads[p].iq
    carry = 0.0  # off^2 / pivot of the row before
    for i in range(links):
        k, a = first + i, q + 3 * i
        piv = 1.0 / (nodes[k].compliance + nodes[k + 1].compliance - carry)
        nodes[k].piv = piv
        if i < links - 1 or bound:
            c = y[a] * y[a + 3] + y[a + 1] * y[a + 4] + y[a + 2] * y[a + 5]
            off = -c * nodes[k + 1].compliance
            nodes[k].off = off * piv
            carry = off * off * piv
    if not bound:
        return 1.0
    return nodes[first + links].compliance - carry


@indirect(REAL(VECTOR, INTEGERS, MODEL, types.int64, types.boolean))
def chain_rhs(y, s, model, p, loaded):
    """Velocity and load terms of the free links into rhs, eliminated; returns the boundary row's."""
    threads, nodes, bodies = model.threads, model.nodes, model.bodies
    links, bound = chain_links(s, threads, p)
    first, q, v, l0 = threads[p].node, threads[p].iq, threads[p].iv, threads[p].segment
    before = 0.0
    for i in range(links):
        k, a, c = first + i, q + 3 * i, v + 3 * i
        value = l0 * (y[c] * y[c] + y[c + 1] * y[c + 1] + y[c + 2] * y[c + 2])
        if loaded:
            for n in range(3):
                value += y[a + n] * (nodes[k].af[n] - nodes[k + 1].af[n])
        if i > 0:
            value -= nodes[k - 1].off * before
        nodes[k].rhs = value
        before = value
    if not bound:
        return 0.0
    k, a, c = first + links, q + 3 * links, v + 3 * links
    b = threads[p].body
    cx, cy, cz = centripetal(bodies, b, threads[p].d[0], threads[p].d[1], threads[p].d[2])
    value = threads[p].b[0] * (y[c] * y[c] + y[c + 1] * y[c + 1] + y[c + 2] * y[c + 2]) - threads[p].b[2]
    value -= y[a] * cx + y[a + 1] * cy + y[a + 2] * cz
    if loaded:
        value += y[a] * nodes[k].af[0] + y[a + 1] * nodes[k].af[1] + y[a + 2] * nodes[k].af[2]
    if is_loose(threads, p):
        value -= threads[p].r * (threads[p].motor + threads[p].friction) / threads[p].spool
    if links > 0:
        value -= nodes[k - 1].off * before
    return value


@indirect(void(INTEGERS, MODEL, types.int64, REAL))
def chain_solve(s, model, p, boundary_tension):
    """Tensions of all links once the boundary's is known."""
    threads, nodes = model.threads, model.nodes
    links, bound = chain_links(s, threads, p)
    first = threads[p].node
    outer = 0.0
    if bound:
        nodes[first + links].tension = boundary_tension
        outer = boundary_tension
    elif s[p] > 0:
        nodes[first + links].tension = 0.0
    for i in range(links - 1, -1, -1):
        k = first + i
        value = nodes[k].rhs * nodes[k].piv
        if i < links - 1 or bound:
            value -= nodes[k].off * outer
        outer = value
        nodes[k].tension = outer


@inlined
def departure_acceleration(threads, bodies, p):
    """Acceleration of Q from the body's acceleration twist a: three floats."""
    b = threads[p].body
    dx, dy, dz = threads[p].d[0], threads[p].d[1], threads[p].d[2]
    cx, cy, cz = centripetal(bodies, b, dx, dy, dz)
    ax, ay, az = cross(bodies[b].a[3], bodies[b].a[4], bodies[b].a[5], dx, dy, dz)
    return bodies[b].a[0] + ax + cx, bodies[b].a[1] + ay + cy, bodies[b].a[2] + az + cz


@indirect(REAL(VECTOR, INTEGERS, MODEL, types.int64, types.boolean, VECTOR))
def chain_rates(y, s, model, p, loaded, dy):
    """Right-hand side of an inextensible thread from its tensions and its body's acceleration a.

    Returns the power of the spool, W.
    """
    threads, nodes, bodies = model.threads, model.nodes, model.bodies
    links, bound = chain_links(s, threads, p)
    j = s[p]
    if j == 0:
        if threads[p].drive != FREE_SPOOL:
            return 0.0
        k = threads[p].spool_v
        dy[threads[p].spool_q], dy[k] = y[k], spool_acceleration(model, p, 0.0)
        return threads[p].copies * threads[p].motor * y[k]
    first, q, v, l0 = threads[p].node, threads[p].iq, threads[p].iv, threads[p].segment
    ox = oy = oz = 0.0  # acceleration of the next node outwards
    px = py = pz = 0.0  # its segment's pull
    for i in range(j):
        k, a, c = first + i, q + 3 * i, v + 3 * i
        m = nodes[k].compliance
        ax, ay, az = px * m, py * m, pz * m
        if i < links or bound:
            T = nodes[k].tension
            px, py, pz = T * y[a], T * y[a + 1], T * y[a + 2]
            ax -= px * m
            ay -= py * m
            az -= pz * m
        if loaded:
            ax += nodes[k].af[0]
            ay += nodes[k].af[1]
            az += nodes[k].af[2]
        if i > 0:
            dy[c - 3] = (ox - ax) / l0
            dy[c - 2] = (oy - ay) / l0
            dy[c - 1] = (oz - az) / l0
        dy[a], dy[a + 1], dy[a + 2] = y[c], y[c + 1], y[c + 2]
        ox, oy, oz = ax, ay, az
    a, c = q + 3 * links, v + 3 * links
    if not bound:
        dy[c], dy[c + 1], dy[c + 2] = ox, oy, oz
        if threads[p].drive != FREE_SPOOL:
            return 0.0
        k = threads[p].spool_v
        dy[threads[p].spool_q], dy[k] = y[k], spool_acceleration(model, p, 0.0)
        return threads[p].copies * threads[p].motor * y[k]
    b0, b1, b2 = threads[p].b[0], threads[p].b[1], threads[p].b[2]
    T = nodes[first + links].tension
    power = -T * b1
    if threads[p].drive == FREE_SPOOL:
        k = threads[p].spool_v
        dy[threads[p].spool_q] = y[k]
        dy[k] = spool_acceleration(model, p, T)
        b2 = threads[p].b[2] = threads[p].r * dy[k] - threads[p].coiling * y[k] * y[k]
        power = threads[p].motor * y[k]
    gx, gy, gz = departure_acceleration(threads, bodies, p)
    if b0 > SHORT * l0:
        k = 1.0 / b0
        dy[c] = (ox - gx - b2 * y[a] - 2.0 * b1 * y[c]) * k
        dy[c + 1] = (oy - gy - b2 * y[a + 1] - 2.0 * b1 * y[c + 1]) * k
        dy[c + 2] = (oz - gz - b2 * y[a + 2] - 2.0 * b1 * y[c + 2]) * k
    else:
        for i in range(3):
            dy[c + i] = threads[p].start[i]
    return power * threads[p].copies


@inlined
def boundary_step(s, threads, nodes, p):
    """A step (s) in which the boundary link turns through about one radian of its own swing: h^2 T / m = b + b' h."""
    links, bound = chain_links(s, threads, p)
    k = threads[p].node + links
    if not bound or nodes[k].tension <= 0.0:
        return math.inf
    scale = nodes[k].mass / nodes[k].tension
    half = 0.5 * threads[p].b[1] * scale
    return half + math.sqrt(half * half + max(threads[p].b[0], SHORT * threads[p].segment) * scale)


@inlined
def regular_rate(y, threads, nodes, bodies, p, i):
    """Rate of the tangent of a boundary link at the moment of its release: u = P (af - a_Q) / (2 b')."""
    a, c = threads[p].iq + 3 * i, threads[p].iv + 3 * i
    k = threads[p].node + i
    gx, gy, gz = departure_acceleration(threads, bodies, p)
    rx, ry, rz = nodes[k].af[0] - gx, nodes[k].af[1] - gy, nodes[k].af[2] - gz
    along = rx * y[a] + ry * y[a + 1] + rz * y[a + 2]
    scale = 0.5 / threads[p].b[1]
    y[c] = (rx - along * y[a]) * scale
    y[c + 1] = (ry - along * y[a + 1]) * scale
    y[c + 2] = (rz - along * y[a + 2]) * scale


@indirect(void(VECTOR, INTEGERS, MODEL, types.int64))
def kick_chain(y, s, model, p):
    """Jumps of the tangents' rates of an inextensible thread from the impulsive tensions T."""
    bodies, threads, nodes = model.bodies, model.threads, model.nodes
    links, bound = chain_links(s, threads, p)
    first, q, v, j = threads[p].node, threads[p].iq, threads[p].iv, s[p]
    if is_loose(threads, p) and bound:
        y[threads[p].spool_v] += threads[p].r * nodes[first + links].tension / threads[p].spool
    for c in range(3):
        outer = pull = 0.0
        for i in range(j):
            inner = nodes[first + i].tension * y[q + 3 * i + c] if (i < links or bound) else 0.0
            jump = (pull - inner) / nodes[first + i].mass
            if i > 0:
                y[v + 3 * (i - 1) + c] += (outer - jump) / threads[p].segment
            outer, pull = jump, inner
        if j > 0 and not bound:
            y[v + 3 * (j - 1) + c] += outer
        elif j > 0 and threads[p].b[0] > SHORT * threads[p].segment:
            b = threads[p].body
            d = threads[p].d
            a = bodies[b].a
            spin = cross(a[3], a[4], a[5], d[0], d[1], d[2])
            y[v + 3 * links + c] += (outer - a[c] - spin[c]) / threads[p].b[0]
    if bound:  # what the jump of b' left along the tangent does not belong to its turning
        a, k = q + 3 * links, v + 3 * links
        along = y[k] * y[a] + y[k + 1] * y[a + 1] + y[k + 2] * y[a + 2]
        for c in range(3):
            y[k + c] -= along * y[a + c]


@inlined
def project_chain(y, s, threads, p):
    """Tangents of thread p to unit length, their rates across them."""
    links, bound = chain_links(s, threads, p)
    if bound:
        links += 1
    for i in range(links):
        q, v = threads[p].iq + 3 * i, threads[p].iv + 3 * i
        scale = 1.0 / math.sqrt(y[q] * y[q] + y[q + 1] * y[q + 1] + y[q + 2] * y[q + 2])
        along = (y[q] * y[v] + y[q + 1] * y[v + 1] + y[q + 2] * y[v + 2]) * scale * scale
        for c in range(3):
            y[v + c] -= along * y[q + c]
            y[q + c] *= scale
