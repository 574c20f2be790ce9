"""Thread on its spool: the drive, the departure point, and the inertia of what is wound."""

import math

from numba import void

from evolvent.compiled.jit import INTEGERS, REAL, VECTOR, indirect, inlined, kernel
from evolvent.kernels.drive import FREE as FREE_SPOOL, drive
from evolvent.kernels.rigid import add_ring, add_wrench, point_kinematics
from evolvent.kernels.rotations import cross, turn
from evolvent.kernels.thread.end import carry_end, is_end, place_end
from evolvent.kernels.thread.spool import (
    MOVING,
    carry_spool,
    layer_radius,
    note_spool,
    outer_radius,
    paid_out,
    ring_radius,
)
from evolvent.model import MODEL

USED_FOR = "threads"


@inlined
def spool(t, y, threads, parameters, p):
    """(angle, rate, acceleration) of spool p; a free spool's acceleration is zero until its tension is known."""
    if threads[p].drive == FREE_SPOOL:
        return y[threads[p].spool_q], y[threads[p].spool_v], 0.0
    return drive(threads[p].drive, parameters[threads[p].first : threads[p].last], threads[p].law, t)


@inlined
def place_reels(t, y, s, model):
    """Departure points of all reels: phi, b (length, rate, acceleration), arm d, Q (position, velocity), X."""
    threads, bodies, parameters = model.threads, model.bodies, model.parameters
    for p in range(threads.size):
        b = threads[p].body
        phi, rate, acceleration = spool(t, y, threads, parameters, p)
        r = threads[p].r = outer_radius(threads, p, phi)
        threads[p].phi = phi
        threads[p].b[0] = max(paid_out(threads, p, phi) - (s[p] - 1) * threads[p].segment, 0.0)
        threads[p].b[1] = r * rate
        threads[p].b[2] = r * acceleration - threads[p].coiling * rate * rate
        threads[p].element = threads[p].segment
        if threads[p].kind == MOVING:
            take_up(t, threads, parameters, p)
            spread(threads, model.nodes, p, paid_out(threads, p, phi) - threads[p].taken[0])
        note_spool(t, y, s, model, p)
        Q = threads[p].departure
        dx, dy, dz, vx, vy, vz = point_kinematics(bodies, b, Q[0], Q[1], Q[2])
        threads[p].d[0], threads[p].d[1], threads[p].d[2] = dx, dy, dz
        threads[p].Q[0], threads[p].Q[1], threads[p].Q[2] = (
            bodies[b].x[0] + dx,
            bodies[b].x[1] + dy,
            bodies[b].x[2] + dz,
        )
        threads[p].Q[3], threads[p].Q[4], threads[p].Q[5] = vx, vy, vz
        X = threads[p].payout_axis
        threads[p].X[0], threads[p].X[1], threads[p].X[2] = turn(bodies[b].R, X[0], X[1], X[2])
        if threads[p].end >= 0:
            place_end(y, model, p)


@indirect(void(REAL, VECTOR, INTEGERS, MODEL))
def reels(t, y, s, model):
    """`place_reels`, called by address."""
    place_reels(t, y, s, model)


@inlined
def take_up(t, threads, parameters, p):
    """Length of thread p on its take-up reel, with its first two derivatives, into `taken`; zeros without such a reel.

    A reel whose drive turns backwards takes up.
    """
    taken = threads[p].taken
    taken[0] = taken[1] = taken[2] = 0.0
    if threads[p].take_drive >= 0:
        own, r = parameters[threads[p].take_first : threads[p].take_last], threads[p].take_radius
        phi, rate, acceleration = drive(threads[p].take_drive, own, threads[p].take_law, t)
        taken[0], taken[1], taken[2] = -r * phi, -r * rate, -r * acceleration


@inlined
def spread(threads, nodes, p, out):
    """Length `out` (m) of thread p, on a mesh that moves, spread over its elements: lumped masses and spans of nodes.

    These carry loads; inertia is that of `moving`. Of an end that is fixed only the tip mass is lumped.
    """
    n, first = threads[p].n, threads[p].node
    threads[p].b[0] = max(out, 1e-9 * n * threads[p].segment)
    span = threads[p].element = threads[p].b[0] / n
    threads[p].growth = (threads[p].b[1] - threads[p].taken[1]) / threads[p].b[0]
    for i in range(n):
        nodes[first + i].span = span if i > 0 else 0.5 * span
        mass = threads[p].density * nodes[first + i].span + (threads[p].tip_mass if i == 0 else 0.0)
        nodes[first + i].mass, nodes[first + i].compliance = mass, 1.0 / mass
    if is_end(threads, p, 0):
        nodes[first].mass = nodes[first].compliance = threads[p].tip_mass


@inlined
def wound_node(threads, bodies, p, i):
    """Node i on spool p (eq. 2): arm from the body's origin and velocity relative to the body, inertial axes.

    That is where it is shown; its mass is evenly wound (see `carry_wound`).
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
    if threads[p].kind == MOVING:
        out = threads[p].b[0] + threads[p].taken[0]
        return threads[p].density * max(threads[p].n * threads[p].segment - out, 0.0)
    for i in range(s[p], threads[p].n):
        mass += nodes[threads[p].node + i].mass
    return mass


@inlined
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
        if threads[p].end >= 0:
            power += carry_end(model, p)
        if not threads[p].carried:
            carry_spool(model, p)
            continue
        b, r = threads[p].body, ring_radius(s, threads, p)
        wound = wound_mass(s, threads, nodes, p)
        threads[p].spool += wound * r * r
        # a node that is leaving (during an impulse) is at Q already
        m = threads[p].copies * (wound - threads[p].leaving)
        cx, cy, cz, nx, ny, nz = spool_axis(threads, bodies, p)
        rate, b2 = threads[p].b[1] / threads[p].r, threads[p].b[2]
        b2 += threads[p].coiling * rate * rate  # less what the change of the radius adds
        add_ring(bodies, b, m, r, cx, cy, cz, nx, ny, nz, rate, b2 / threads[p].r)
        carry_spool(model, p)
        if gx != 0.0 or gy != 0.0 or gz != 0.0:
            add_wrench(bodies[b].F, cx, cy, cz, m * gx, m * gy, m * gz)
            vx, vy, vz = cross(bodies[b].w[0], bodies[b].w[1], bodies[b].w[2], cx, cy, cz)
            power += m * (gx * (bodies[b].v[0] + vx) + gy * (bodies[b].v[1] + vy) + gz * (bodies[b].v[2] + vz))
    return power


@inlined
def carry_power(s, model):
    """Power of the spools on wound thread that bodies carry, from the bodies' accelerations a, W.

    Notes
    -----
    m r^2 (phi'' + n . omega') phi', n the spool's axis, of spools that a law turns, less what fields do there
    (`wound_fields`).
    """
    threads, nodes, bodies = model.threads, model.nodes, model.bodies
    power = 0.0
    for p in range(threads.size):
        if not threads[p].carried or threads[p].drive == FREE_SPOOL:
            continue
        r, b1, b2 = threads[p].r, threads[p].b[1], threads[p].b[2]
        b2 += threads[p].coiling * (b1 / r) * (b1 / r)
        share = ring_radius(s, threads, p) / r
        m = share * share * threads[p].copies * wound_mass(s, threads, nodes, p)
        cx, cy, cz, nx, ny, nz = spool_axis(threads, bodies, p)
        a = bodies[threads[p].body].a
        power += m * b1 * (b2 + r * (nx * a[3] + ny * a[4] + nz * a[5])) - threads[p].field
    return power


@inlined
def share_radius(threads, nodes, p, k):
    """Radius at which node k has the moment of inertia that the thread wound on spool p gains with it, m."""
    if threads[p].coiling == 0.0:
        return threads[p].radius
    first, n = threads[p].node, threads[p].n
    inside, wound = 0.0, first + n - k - 1
    for i in range(k + 1, first + n):
        inside += nodes[i].mass
    less, more = layer_radius(threads, p, wound), layer_radius(threads, p, wound + 1)
    return math.sqrt(more * more + inside * (more * more - less * less) / nodes[k].mass)


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
    b, r, m = threads[p].body, share_radius(threads, nodes, p, k), nodes[k].mass
    w, Q, x, u = bodies[b].w, threads[p].Q, nodes[k].x, nodes[k].v
    cx, cy, cz, nx, ny, nz = spool_axis(threads, bodies, p)
    vx, vy, vz = cross(w[0], w[1], w[2], cx, cy, cz)
    vx, vy, vz = m * (bodies[b].v[0] + vx), m * (bodies[b].v[1] + vy), m * (bodies[b].v[2] + vz)
    px, py, pz = m * u[0], m * u[1], m * u[2]
    # about Q: of the node, of the share's centre, of its turning
    hx, hy, hz = cross(x[0] - Q[0], x[1] - Q[1], x[2] - Q[2], px, py, pz)
    gx, gy, gz = cross(cx - threads[p].d[0], cy - threads[p].d[1], cz - threads[p].d[2], vx, vy, vz)
    k2 = 0.5 * m * r * r
    turning = k2 * (w[0] * nx + w[1] * ny + w[2] * nz) + m * r * (threads[p].b[1] * (r / threads[p].r))
    couple[0] = hx - gx - k2 * w[0] - turning * nx
    couple[1] = hy - gy - k2 * w[1] - turning * ny
    couple[2] = hz - gz - k2 * w[2] - turning * nz
    return px - vx, py - vy, pz - vz
