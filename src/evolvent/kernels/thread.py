"""Lumped thread on a reel: spring segments or segments of fixed length, boundary segment, wound thread.

Node 0 is the tip, it leaves first; node i is released when the spool's angle reaches i l0 / r. Of the s released
nodes the last, s - 1, is the boundary node: its segment ends at the departure point Q and has the rest length
b = r (phi - (s - 1) l0 / r). Tangents e point outwards, from node i + 1 (or Q) to node i.

Spring segments hold positions and velocities of the nodes in the state (inertial axes). Segments of fixed length hold
the tangent e_i and its rate u_i = e_i' in the same slots, so that lengths are exact; once the whole thread is released
the slot of the last node holds that node's position and velocity.

Source: Tenenbaum (2014), equations 1 to 15; see `evolvent.systems.heliogyro`.
"""

import math

from numba import types, void

from evolvent.jit import INTEGERS, REAL, VECTOR, indirect, inlined, kernel
from evolvent.kernels.feed import FREE as FREE_SPOOL
from evolvent.kernels.feed import feed
from evolvent.kernels.loads import AT_MARKER, thread_load
from evolvent.kernels.rigid import add_ring, add_wrench, centripetal, point_kinematics
from evolvent.kernels.rotations import cross, turn
from evolvent.model import MODEL

SPRINGS, INEXTENSIBLE = 0, 1
SHORT = 1e-7  # of a segment: below this length a boundary link turns at the rate found at its release
TINY = 1e-9  # m: below this distance from Q a spring's direction is the feed direction (eq. 11)


@inlined
def spool(t, y, threads, parameters, p):
    """(angle, rate, acceleration) of spool p; a free spool's acceleration is zero until its tension is known."""
    if threads[p].feed == FREE_SPOOL:
        return y[threads[p].spool_q], y[threads[p].spool_v], 0.0
    return feed(threads[p].feed, parameters[threads[p].first : threads[p].last], threads[p].law, t)


@indirect(void(REAL, VECTOR, INTEGERS, MODEL))
def reels(t, y, s, model):
    """Departure points of all reels: phi, b (length, rate, acceleration), arm d, Q (position, velocity), X."""
    threads, bodies, parameters = model.threads, model.bodies, model.parameters
    for p in range(threads.size):
        b, r = threads[p].body, threads[p].radius
        phi, rate, acceleration = spool(t, y, threads, parameters, p)
        threads[p].phi = phi
        threads[p].b[0] = max(r * phi - (s[p] - 1) * threads[p].segment, 0.0)
        threads[p].b[1] = r * rate
        threads[p].b[2] = r * acceleration
        Q = threads[p].departure
        dx, dy, dz, vx, vy, vz = point_kinematics(bodies, b, Q[0], Q[1], Q[2])
        threads[p].d[0], threads[p].d[1], threads[p].d[2] = dx, dy, dz
        threads[p].Q[0], threads[p].Q[1], threads[p].Q[2] = (
            bodies[b].x[0] + dx,
            bodies[b].x[1] + dy,
            bodies[b].x[2] + dz,
        )
        threads[p].Q[3], threads[p].Q[4], threads[p].Q[5] = vx, vy, vz
        X = threads[p].feed_axis
        threads[p].X[0], threads[p].X[1], threads[p].X[2] = turn(bodies[b].R, X[0], X[1], X[2])


@inlined
def wound_node(threads, bodies, p, i):
    """Node i on spool p (eq. 2): arm from the body's origin and velocity relative to the body, inertial axes.

    That is where it is shown; what it weighs is evenly wound (see `carry_wound`).
    """
    r, b = threads[p].radius, threads[p].body
    angle = threads[p].phi - i * threads[p].segment / r
    c, n = math.cos(angle), math.sin(angle)
    Z = threads[p].normal
    zx, zy, zz = turn(bodies[b].R, Z[0], Z[1], Z[2])
    xx, xy, xz = threads[p].X[0], threads[p].X[1], threads[p].X[2]
    v = threads[p].b[1]
    sx, sz = r * n, r * (c - 1.0)
    ux, uz = v * c, -v * n
    return (
        threads[p].d[0] + sx * xx + sz * zx,
        threads[p].d[1] + sx * xy + sz * zy,
        threads[p].d[2] + sx * xz + sz * zz,
        ux * xx + uz * zx,
        ux * xy + uz * zy,
        ux * xz + uz * zz,
    )


@inlined
def spool_axis(threads, bodies, p):
    """Arm of spool p's centre from the body's origin, and its axis, inertial axes: six floats."""
    b, r, Y, Z = threads[p].body, threads[p].radius, threads[p].chord, threads[p].normal
    nx, ny, nz = turn(bodies[b].R, Y[0], Y[1], Y[2])
    zx, zy, zz = turn(bodies[b].R, Z[0], Z[1], Z[2])
    return threads[p].d[0] - r * zx, threads[p].d[1] - r * zy, threads[p].d[2] - r * zz, nx, ny, nz


@inlined
def wound_mass(s, threads, nodes, p):
    """Mass of the wound part of thread p, kg."""
    mass = 0.0
    for i in range(s[p], threads[p].n):
        mass += nodes[threads[p].node + i].mass
    return mass


@indirect(REAL(INTEGERS, MODEL))
def carry_wound(s, model):
    """Mass and inertial forces of wound thread onto its bodies (where carried); `spool` gets its inertia.

    Wound thread is a thin ring about the spool's axis, evenly wound: of the nodes on the spool (eq. 2), l0 / r apart,
    any few would lie to one side and swing round. Returns the power of its weight, W.
    """
    threads, nodes, bodies, gravity = model.threads, model.nodes, model.bodies, model.info.gravity
    gx, gy, gz = gravity[0], gravity[1], gravity[2]
    power = 0.0
    for p in range(threads.size):
        threads[p].spool = threads[p].spool_inertia
        if not threads[p].carried:
            continue
        b, r = threads[p].body, threads[p].radius
        wound = wound_mass(s, threads, nodes, p)
        threads[p].spool += wound * r * r
        # a node that is leaving (during an impulse) is at Q already
        m = threads[p].copies * (wound - threads[p].leaving)
        cx, cy, cz, nx, ny, nz = spool_axis(threads, bodies, p)
        add_ring(bodies, b, m, r, cx, cy, cz, nx, ny, nz, threads[p].b[1] / r, threads[p].b[2] / r)
        if gx != 0.0 or gy != 0.0 or gz != 0.0:
            add_wrench(bodies[b].F, cx, cy, cz, m * gx, m * gy, m * gz)
            vx, vy, vz = cross(bodies[b].w[0], bodies[b].w[1], bodies[b].w[2], cx, cy, cz)
            power += m * (gx * (bodies[b].v[0] + vx) + gy * (bodies[b].v[1] + vy) + gz * (bodies[b].v[2] + vz))
    return power


@indirect(REAL(INTEGERS, MODEL))
def carry_power(s, model):
    """Power of the spools on wound thread that bodies carry, from the bodies' accelerations a, W.

    Notes
    -----
    m r^2 (phi'' + n . omega') phi', n the spool's axis. A free spool's phi'' is known only now; its reaction on a
    driven body joins the body's wrench (a body that spins has its axis across the spool's).
    """
    threads, nodes, bodies = model.threads, model.nodes, model.bodies
    power = 0.0
    for p in range(threads.size):
        if not threads[p].carried:
            continue
        r, b1, b2 = threads[p].radius, threads[p].b[1], threads[p].b[2]
        m = threads[p].copies * wound_mass(s, threads, nodes, p)
        cx, cy, cz, nx, ny, nz = spool_axis(threads, bodies, p)
        a, F = bodies[threads[p].body].a, bodies[threads[p].body].F
        if threads[p].feed == FREE_SPOOL:
            F[3] -= m * r * b2 * nx
            F[4] -= m * r * b2 * ny
            F[5] -= m * r * b2 * nz
        else:
            power += m * b1 * (b2 + r * (nx * a[3] + ny * a[4] + nz * a[5]))
    return power


@kernel
def leave_spool(threads, nodes, bodies, p, k, couple):
    """Momentum of node k (its x, v) less its share of evenly wound thread on spool p: what it takes when it leaves.

    Parameters
    ----------
    couple : (3,) float, output, N m s

    Returns
    -------
    force impulse at Q, N s : three floats; `couple` goes with it
    """
    b, r, m = threads[p].body, threads[p].radius, nodes[k].mass
    w, Q, x, u = bodies[b].w, threads[p].Q, nodes[k].x, nodes[k].v
    cx, cy, cz, nx, ny, nz = spool_axis(threads, bodies, p)
    vx, vy, vz = cross(w[0], w[1], w[2], cx, cy, cz)
    vx, vy, vz = m * (bodies[b].v[0] + vx), m * (bodies[b].v[1] + vy), m * (bodies[b].v[2] + vz)
    px, py, pz = m * u[0], m * u[1], m * u[2]
    # about Q: of the node, of the share's centre, of its turning
    hx, hy, hz = cross(x[0] - Q[0], x[1] - Q[1], x[2] - Q[2], px, py, pz)
    gx, gy, gz = cross(cx - threads[p].d[0], cy - threads[p].d[1], cz - threads[p].d[2], vx, vy, vz)
    k2 = 0.5 * m * r * r
    turning = k2 * (w[0] * nx + w[1] * ny + w[2] * nz) + m * r * threads[p].b[1]
    couple[0] = hx - gx - k2 * w[0] - turning * nx
    couple[1] = hy - gy - k2 * w[1] - turning * ny
    couple[2] = hz - gz - k2 * w[2] - turning * nz
    return px - vx, py - vy, pz - vz


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
def spring_points(y, s, threads, nodes, p):
    """Positions and velocities of the released nodes of a spring thread into x, v."""
    first, q, v = threads[p].node, threads[p].iq, threads[p].iv
    for i in range(s[p]):
        for c in range(3):
            nodes[first + i].x[c] = y[q + 3 * i + c]
            nodes[first + i].v[c] = y[v + 3 * i + c]


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


@indirect(types.UniTuple(REAL, 2)(VECTOR, INTEGERS, MODEL, types.int64, types.boolean, VECTOR))
def spring_thread(y, s, model, p, loaded, dy):
    """Right-hand side of a spring thread (eqs. 3, 4, 7 to 11) and its pull on the body (eq. 15).

    Tensions go to the nodes. Returns (power dissipated, power of the spool), W.
    """
    threads, nodes, bodies = model.threads, model.nodes, model.bodies
    j = s[p]
    if j == 0:
        return 0.0, 0.0
    first, q, v, l0 = threads[p].node, threads[p].iq, threads[p].iv, threads[p].segment
    stiffness, damping = threads[p].stiffness, threads[p].damping
    dissipated = 0.0
    px = py = pz = 0.0  # pull of the outer segment on the node
    x, yy, z = y[q], y[q + 1], y[q + 2]
    vx, vy, vz = y[v], y[v + 1], y[v + 2]
    for i in range(j - 1):
        a, c = q + 3 * i, v + 3 * i
        x1, y1, z1 = y[a + 3], y[a + 4], y[a + 5]
        vx1, vy1, vz1 = y[c + 3], y[c + 4], y[c + 5]
        ex, ey, ez = x - x1, yy - y1, z - z1
        length = math.sqrt(ex * ex + ey * ey + ez * ez)
        scale = 1.0 / length
        rate = ((vx - vx1) * ex + (vy - vy1) * ey + (vz - vz1) * ez) * scale
        T = stiffness * (length - l0) + damping * rate
        dissipated += damping * rate * rate
        nodes[first + i].tension = T
        scale *= T
        ex *= scale
        ey *= scale
        ez *= scale
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
    else:  # along the velocity with which the node leaves: the feed's (eq. 11), or that turned along the thread
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
    T = elastic + damping * rate
    nodes[first + j - 1].tension = T
    a, c = q + 3 * (j - 1), v + 3 * (j - 1)
    m = nodes[first + j - 1].compliance
    dy[a], dy[a + 1], dy[a + 2] = vx, vy, vz
    dy[c] = (px - T * ex) * m
    dy[c + 1] = (py - T * ey) * m
    dy[c + 2] = (pz - T * ez) * m
    if loaded:
        for i in range(j):
            for k in range(3):
                dy[v + 3 * i + k] += nodes[first + i].af[k]
    copies = threads[p].copies
    pull = copies * T
    add_wrench(
        bodies[threads[p].body].F, threads[p].d[0], threads[p].d[1], threads[p].d[2], pull * ex, pull * ey, pull * ez
    )
    if threads[p].feed == FREE_SPOOL:
        k = threads[p].spool_v
        dy[threads[p].spool_q] = y[k]
        dy[k] = (threads[p].radius * T + threads[p].spool_torque) / threads[p].spool
        threads[p].b[2] = threads[p].radius * dy[k]
        dissipated += damping * rate * (stretch_rate - b1)
        power = threads[p].spool_torque * y[k]
    else:
        # what is left of the boundary's power once strain energy and dissipation are taken out
        dissipated += damping * rate * rate
        power = -elastic * b1 - damping * rate * (stretch_rate - rate)
    return copies * dissipated, copies * power


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
    if threads[p].feed == FREE_SPOOL:
        value -= threads[p].radius * threads[p].spool_torque / threads[p].spool
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
        return 0.0
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
        if threads[p].feed != FREE_SPOOL:
            return 0.0
        k = threads[p].spool_v
        dy[threads[p].spool_q], dy[k] = y[k], threads[p].spool_torque / threads[p].spool
        return threads[p].copies * threads[p].spool_torque * y[k]
    b0, b1, b2 = threads[p].b[0], threads[p].b[1], threads[p].b[2]
    T = nodes[first + links].tension
    power = -T * b1
    if threads[p].feed == FREE_SPOOL:
        k = threads[p].spool_v
        dy[threads[p].spool_q] = y[k]
        dy[k] = (threads[p].radius * T + threads[p].spool_torque) / threads[p].spool
        b2 = threads[p].b[2] = threads[p].radius * dy[k]
        power = threads[p].spool_torque * y[k]
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
