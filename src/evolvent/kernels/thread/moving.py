"""Thread of springs on a mesh that moves: n elements share the length that is out, and no node leaves or comes back.

Arbitrary Lagrangian-Eulerian description. Node i stands at the part xi_i = 1 - i/n of the length l that is out, from
the exit Q, which is node n. Inside an element r is linear in xi. Material flows through the mesh: its velocity is

    V = dr/dt + (1 - xi) (l'/l) dr/dxi.

The kinetic energy of an element of mass m = mu l/n is the exact integral m (Vo.Vo + Vo.Vi + Vi.Vi)/6 of its outer and
inner end. With that of the wound thread, a ring of mass mu (L - l), the mass is constant, and Lagrange's equations for
the nodes, the body and l hold without terms of flux. With lam = l'/l, d = ro - ri and

    Vo = ro' + i lam d,  Vi = ri' + (i + 1) lam d,  Vo~ = ro'' + i (lam d)',  Vi~ = ri'' + (i + 1) (lam d)'

(at fixed xi, lam' = l''/l - lam^2) the forces of inertia of element i, which stand on the left of the equations, are

    outer: m/6 (2 Vo~ + Vi~ + lam ((1 - 3 i) Vo - (3 i + 1) Vi))
    inner: m/6 (Vo~ + 2 Vi~ + lam ((3 i + 2) Vo + (3 i + 4) Vi))
    l:     (d'.S + d.S~ - T)/l,  S = m/6 ((3 i + 1) Vo + (3 i + 2) Vi),
           S~ = lam S + m/6 ((3 i + 1) Vo~ + (3 i + 2) Vi~)

and those of its tension N and strain e, with EA, -+N along d and (EA e^2/2 - N (1 + e))/n. Loads act on the nodes. The
mass matrix is tridiagonal, and eliminated from the tip inwards: what is left is a mass, a force and the coefficients of
l'' at Q, which the body carries.
"""

import math

from numba import types, void

from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.kernels.drive import FREE as FREE_SPOOL
from evolvent.kernels.points import add_angular_momentum
from evolvent.kernels.rigid import FREE, SPIN, add_mass, add_wrench, centripetal, point_kinematics
from evolvent.kernels.rotations import cross, turn, turn_back
from evolvent.kernels.rotor import add_reaction
from evolvent.kernels.sides import ON_BODY, add_turning, side_columns
from evolvent.kernels.sparse import SPARSE, add_entry
from evolvent.kernels.thread.chain import departure_acceleration
from evolvent.kernels.thread.spool import is_loose, spool_direction
from evolvent.kernels.thread.springs import segment_force, segment_vector
from evolvent.kernels.thread.wound import spool_axis
from evolvent.model import H_RELEASED, KINETIC, MODEL, P_ALL, having, nonzero

USED_FOR = having("threads", moving=nonzero)
_I = types.int64
#: Part of the whole length that must be out.
LEAST_OUT = 1e-3
#: Places in `root` of a thread: mass at Q, force there (3), coefficients of l'' (3); mass and force of l.
MASS, FORCE, FEED, FEED_MASS, FEED_FORCE = 0, 1, 4, 7, 8


@inlined
def inertia(i, lam, slope, xo, vo, ao, xi, vi, ai):
    """Forces of inertia of element i onto its ends, times 6/m, of one component of place, rate and acceleration.

    slope : lam', 1/s2. Linear in the last six.
    """
    d, w = xo - xi, vo - vi
    Vo, Vi = vo + i * lam * d, vi + (i + 1) * lam * d
    change = lam * w + slope * d
    Ao, Ai = ao + i * change, ai + (i + 1) * change
    outer = 2.0 * Ao + Ai + lam * ((1 - 3 * i) * Vo - (3 * i + 1) * Vi)
    inner = Ao + 2.0 * Ai + lam * ((3 * i + 2) * Vo + (3 * i + 4) * Vi)
    return outer, inner


@inlined
def _rates(threads, p):
    """Of thread p lam = l'/l, its derivative, and m/6 of an element."""
    length, rate, acceleration = threads[p].b[0], threads[p].b[1], threads[p].b[2]
    lam = rate / length
    return lam, acceleration / length - lam * lam, threads[p].density * length / (6.0 * threads[p].n)


@inlined
def _add_loads(p, model):
    """Turn the accelerations of the nodes by loads into forces; the weight of half an element at Q; returns its power.

    Notes
    -----
    A node's material moves on by i/l d per length paid out, d the mean of the vectors of both elements.
    """
    threads, nodes, gravity = model.threads, model.nodes, model.info.gravity
    n, first, root, Q, length = threads[p].n, threads[p].node, threads[p].root, threads[p].Q, threads[p].b[0]
    for i in range(n):
        k = first + i
        for c in range(3):
            nodes[k].af[c] *= nodes[k].mass
            if i > 0:
                inner = nodes[k + 1].x[c] if i < n - 1 else Q[c]
                root[FEED_FORCE] += 0.5 * i / length * nodes[k].af[c] * (nodes[k - 1].x[c] - inner)
    power, half = 0.0, 0.5 * threads[p].density * length / n
    for c in range(3):
        along = n / length * (nodes[first + n - 1].x[c] - Q[c])
        root[FORCE + c] += half * gravity[c]
        root[FEED_FORCE] += half * gravity[c] * along
        power += half * gravity[c] * (Q[3 + c] + threads[p].b[1] * along)
    return threads[p].copies * power


@indirect(types.UniTuple(REAL, 2)(VECTOR, VECTOR, _I, types.UniTuple(REAL, 3), types.boolean, _I, MODEL))
def add_elements(y, a, at, aQ, loaded, p, model):
    """Forces on the nodes of thread p into their `af`, on Q and l into `root`, and the coefficients of l''.

    Parameters
    ----------
    a, at : accelerations of the nodes, from an index on
    aQ : 3 floats, acceleration of Q, m/s2

    Returns
    -------
    power that damping takes, and of the weight at Q, W
    """
    threads, nodes, s, root = model.threads, model.nodes, model.switches, model.threads[p].root
    n, first, Q, length = threads[p].n, threads[p].node, threads[p].Q, threads[p].b[0]
    lam, slope, k6 = _rates(threads, p)
    EA = threads[p].stiffness * threads[p].segment
    for c in range(9):
        root[c] = 0.0
    given = lost = 0.0
    if loaded:
        given = _add_loads(p, model)
    for i in range(n):
        for c in range(3):
            nodes[first + i].end[c] = 0.0
            if not loaded:
                nodes[first + i].af[c] = 0.0
    for c in range(3):
        nodes[first].af[c] -= threads[p].tip_mass * a[at + c]
    for i in range(n):
        k, q, v, w = first + i, threads[p].iq + 3 * i, threads[p].iv + 3 * i, at + 3 * i
        ex, ey, ez, scale, T, damped, rate, _ = segment_force(y, 0.0, s, p, i, model)
        lost += damped * rate
        e, strain = (ex, ey, ez), nodes[k].length * n / length - 1.0
        root[FEED_FORCE] += (T * (1.0 + strain) - 0.5 * EA * strain * strain) / n
        for c in range(3):
            xo, vo, ao = y[q + c], y[v + c], a[w + c]
            if i < n - 1:
                xi, vi, ai = y[q + 3 + c], y[v + 3 + c], a[w + 3 + c]
            else:
                xi, vi, ai = Q[c], Q[3 + c], aQ[c]
            outer, inner = inertia(i, lam, slope, xo, vo, ao, xi, vi, ai)
            outer, inner = k6 * outer + scale * T * e[c], k6 * inner - scale * T * e[c]
            d, u = xo - xi, vo - vi
            Vo, Vi = vo + i * lam * d, vi + (i + 1) * lam * d
            change = lam * u + slope * d
            Ao, Ai = ao + i * change, ai + (i + 1) * change
            S = k6 * ((3 * i + 1) * Vo + (3 * i + 2) * Vi)
            S1 = lam * S + k6 * ((3 * i + 1) * Ao + (3 * i + 2) * Ai)
            root[FEED_FORCE] -= (u * S + d * S1 - k6 * (Vo * Vo + Vo * Vi + Vi * Vi)) / length
            feed = k6 * d / length
            root[FEED_MASS] += feed * d / length * (i * (3 * i + 1) + (i + 1) * (3 * i + 2))
            nodes[k].af[c] -= outer
            nodes[k].end[c] += (3 * i + 1) * feed
            if i < n - 1:
                nodes[k + 1].af[c] -= inner
                nodes[k + 1].end[c] += (3 * i + 2) * feed
            else:
                root[FORCE + c] -= inner
                root[FEED + c] += (3 * i + 2) * feed
    return threads[p].copies * lost, given


@inlined
def _add_flux(p, model):
    """The momentum that the ring of wound thread of thread p gives away goes to its body; returns its pull on l, N.

    Notes
    -----
    With the ring's mass m = mu (L - l), the velocity v of its centre, the body's rate w, its part u about the spool's
    axis n and rho = u + l'/r: momentum m v and m r^2/2 (w + (rho + l'/r) n), energy m (v.v + r^2 (w.w - u^2)/2 +
    r^2 rho^2)/2, of which m' = -mu l' leaves; and mu l' r rho less the energy per length.
    """
    threads, bodies, b = model.threads, model.bodies, model.threads[p].body
    r, w, out = threads[p].radius, bodies[b].w, threads[p].density * threads[p].b[1]
    cx, cy, cz, nx, ny, nz = spool_axis(threads, bodies, p)
    vx, vy, vz = cross(w[0], w[1], w[2], cx, cy, cz)
    vx, vy, vz = bodies[b].v[0] + vx, bodies[b].v[1] + vy, bodies[b].v[2] + vz
    along, rate = w[0] * nx + w[1] * ny + w[2] * nz, threads[p].b[1] / r
    F, m, k = bodies[b].F, threads[p].copies * out, threads[p].copies * out * 0.5 * r * r
    add_wrench(F, cx, cy, cz, m * vx, m * vy, m * vz)
    F[3] += k * (w[0] + (along + 2.0 * rate) * nx)
    F[4] += k * (w[1] + (along + 2.0 * rate) * ny)
    F[5] += k * (w[2] + (along + 2.0 * rate) * nz)
    square = w[0] * w[0] + w[1] * w[1] + w[2] * w[2] - along * along
    energy = 0.5 * (vx * vx + vy * vy + vz * vz) + 0.25 * r * r * square + 0.5 * r * r * (along + rate) ** 2
    return out * r * (along + rate) - threads[p].density * energy


@inlined
def _note_exit(p, model, fx, fy, fz):
    """The pull of thread p on its body where it leaves, from the force (3 floats) that the mesh puts on Q there.

    Material that passes Q brings its momentum with it.
    """
    threads, nodes, Q = model.threads, model.nodes, model.threads[p].Q
    last, rate, f = threads[p].node + threads[p].n - 1, threads[p].b[1], (fx, fy, fz)
    for c in range(3):
        through = Q[3 + c] + rate * threads[p].n / threads[p].b[0] * (nodes[last].x[c] - Q[c])
        threads[p].exit[c] = f[c] + threads[p].density * rate * through


@inlined
def _spool_power(y, p, model):
    """Power of the drive or motor of thread p, but for its wound thread and inertia, W."""
    threads = model.threads
    if threads[p].drive == FREE_SPOOL:
        return threads[p].copies * threads[p].motor * y[threads[p].spool_v]
    return -threads[p].copies * threads[p].pull * threads[p].b[1]


# ---------------------------------------------------------------------------------------------- implicit methods


@indirect(types.UniTuple(REAL, 3)(VECTOR, VECTOR, types.boolean, _I, MODEL, VECTOR))
def add_moving_residual(y, a, loaded, p, model, F):
    """Add thread p to a residual, the accelerations of the bodies known; powers taken, given, and of the spool, W."""
    threads, bodies, nodes = model.threads, model.bodies, model.nodes
    at, root, d, copies = threads[p].iv - model.info.nq, threads[p].root, threads[p].d, threads[p].copies
    ax, ay, az = departure_acceleration(threads, bodies, p)
    drift = threads[p].drift
    lost, given = add_elements(y, a, at, (ax + drift[0], ay + drift[1], az + drift[2]), loaded, p, model)
    for i in range(threads[p].n):
        for c in range(3):
            F[at + 3 * i + c] -= nodes[threads[p].node + i].af[c]
    fx, fy, fz = copies * root[FORCE], copies * root[FORCE + 1], copies * root[FORCE + 2]
    add_wrench(bodies[threads[p].body].F, d[0], d[1], d[2], fx, fy, fz)
    threads[p].pull = root[FEED_FORCE] + _add_flux(p, model)
    return lost, given, _spool_power(y, p, model)


@inlined
def _write_columns(p, model, factor, by_rate, by_acceleration, c_rate, L):
    """L = factor J and what turns of the body change by rate and acceleration of Q, with their factors.

    Returns the first unknown of the body, and how many there are. J, in `Model.J[0]`, are the columns of Q.

    Notes
    -----
    With D(u) the columns of a vector u fixed to the body: a turn changes the rate w x d by D(w x d) and the
    acceleration of Q by D of that relative to the body's; a rate of turn changes that by D(w x d) + w x D(d).
    """
    threads, bodies, b, own, J, D = (
        model.threads,
        model.bodies,
        model.threads[p].body,
        model.e[2],
        model.J[0],
        model.J[1],
    )
    R, w, d, A, drift = bodies[b].R, bodies[b].w, threads[p].d, bodies[b].a, threads[p].drift
    at, m = side_columns(model, ON_BODY, b, -1, threads[p].departure, True, J)
    for r in range(3):
        for c in range(m):
            L[r, c] = factor * J[r, c]
    ux, uy, uz = cross(w[0], w[1], w[2], d[0], d[1], d[2])
    own[0], own[1], own[2] = turn_back(R, ux, uy, uz)
    side_columns(model, ON_BODY, b, -1, own, False, D)
    for r in range(3):
        for c in range(m):
            L[r, c] += (by_rate + c_rate * by_acceleration) * D[r, c]
    side_columns(model, ON_BODY, b, -1, threads[p].departure, False, D)
    turned = c_rate * by_acceleration
    for c in range(m):
        x, yy, z = cross(w[0], w[1], w[2], D[0, c], D[1, c], D[2, c])
        L[0, c], L[1, c], L[2, c] = L[0, c] + turned * x, L[1, c] + turned * yy, L[2, c] + turned * z
    tx, ty, tz = cross(A[3], A[4], A[5], d[0], d[1], d[2])
    sx, sy, sz = cross(w[0], w[1], w[2], ux, uy, uz)
    own[0], own[1], own[2] = turn_back(R, tx + sx + drift[0], ty + sy + drift[1], tz + sz + drift[2])
    side_columns(model, ON_BODY, b, -1, own, False, D)
    for r in range(3):
        for c in range(m):
            L[r, c] += by_acceleration * D[r, c]
    return at, m


@indirect(void(VECTOR, REAL, REAL, _I, MODEL, SPARSE))
def add_moving_tangent(y, c_mass, c_rate, p, model, matrix):
    """Add the inertia of thread p, after `add_moving_residual`; its elements' forces are those of `springs`.

    Exact where no length is paid out; else the momentum of the ring of wound thread is left out, which only slows
    Newton's method.
    """
    threads, nodes, root, copies = model.threads, model.nodes, model.threads[p].root, float(model.threads[p].copies)
    lam, slope, k6 = _rates(threads, p)
    n, first = threads[p].n, threads[p].iv - model.info.nq
    for c in range(3):
        add_entry(matrix, first + c, first + c, c_mass * threads[p].tip_mass)
    for i in range(n):
        oo, io = inertia(i, lam, slope, 1.0, c_rate, c_mass, 0.0, 0.0, 0.0)
        oi, ii = inertia(i, lam, slope, 0.0, 0.0, 0.0, 1.0, c_rate, c_mass)
        o = first + 3 * i
        for c in range(o, o + 3):
            add_entry(matrix, c, c, k6 * oo)
            if i < n - 1:
                add_entry(matrix, c, c + 3, k6 * oi)
                add_entry(matrix, c + 3, c, k6 * io)
                add_entry(matrix, c + 3, c + 3, k6 * ii)
    J, L, o = model.J[0], model.K12, first + 3 * (n - 1)
    vo, vi = inertia(n - 1, lam, slope, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0)
    # of accelerations these are 1 and 2; oo, io, oi and ii are those of the last element
    at, m = _write_columns(p, model, k6 * oi, k6 * vo, k6, c_rate, L)
    for r in range(3):
        for c in range(m):
            add_entry(matrix, o + r, at + c, L[r, c])
            add_entry(matrix, at + c, o + r, copies * k6 * io * J[r, c])
    at, m = _write_columns(p, model, k6 * ii, k6 * vi, 2.0 * k6, c_rate, L)
    for r in range(m):
        for c in range(m):
            value = J[0, r] * L[0, c] + J[1, r] * L[1, c] + J[2, r] * L[2, c]
            add_entry(matrix, at + r, at + c, copies * value)
    k = threads[p].node + n - 1
    ex, ey, ez, _, _, _ = segment_vector(y, model.switches, p, n - 1, model)
    T = copies * nodes[k].tension / nodes[k].length
    add_turning(
        matrix, model, threads[p].body, threads[p].departure, T * ex - copies * root[FORCE],
        T * ey - copies * root[FORCE + 1], T * ez - copies * root[FORCE + 2],
    )  # fmt: skip


@indirect(REAL(VECTOR, REAL, REAL, _I, MODEL, SPARSE))
def add_feed(y, c_mass, c_rate, p, model, matrix):
    """Couple free spool p with the nodes of its thread and with its body; returns its own part, N m.

    Left out is what rates change in the inertia, which only slows Newton's method.
    """
    threads, nodes, root, J = model.threads, model.nodes, model.threads[p].root, model.J[0]
    n, r, length, copies = threads[p].n, threads[p].r, threads[p].b[0], float(threads[p].copies)
    EA = (threads[p].stiffness + c_rate * threads[p].damping) * threads[p].segment
    k, first = threads[p].spool_v - model.info.nq, threads[p].iv
    at, m = side_columns(model, ON_BODY, threads[p].body, -1, threads[p].departure, True, J)
    own = c_mass * r * r * root[FEED_MASS]
    for i in range(n):
        node = threads[p].node + i
        ex, ey, ez, _, _, _ = segment_vector(y, model.switches, p, i, model)
        stretch = nodes[node].length * n / length
        e, change = (ex, ey, ez), r * EA * stretch / (length * nodes[node].length)
        own += r * r * EA / length * stretch * stretch / n
        for c in range(3):
            o = first - model.info.nq + 3 * i + c
            value = r * c_mass * nodes[node].end[c] - change * e[c]
            add_entry(matrix, o, k, value)
            add_entry(matrix, k, o, copies * value)
            if i < n - 1:
                add_entry(matrix, o + 3, k, change * e[c])
                add_entry(matrix, k, o + 3, copies * change * e[c])
                continue
            value = copies * (r * c_mass * root[FEED + c] + change * e[c])
            for j in range(m):
                add_entry(matrix, at + j, k, value * J[c, j])
                add_entry(matrix, k, at + j, value * J[c, j])
    return own


@inlined
def note_drift(factor, spin, p, model):
    """Acceleration of Q in a steady turn, (rate (3,), centre (3,)), times `factor`, into `drift` of thread p."""
    threads, bodies, b, Q = model.threads, model.bodies, model.threads[p].body, model.threads[p].departure
    dx, dy, dz, _, _, _ = point_kinematics(bodies, b, Q[0], Q[1], Q[2])
    x = bodies[b].x
    ux, uy, uz = cross(spin[0], spin[1], spin[2], x[0] + dx - spin[3], x[1] + dy - spin[4], x[2] + dz - spin[5])
    ux, uy, uz = cross(spin[0], spin[1], spin[2], ux, uy, uz)
    threads[p].drift[0], threads[p].drift[1], threads[p].drift[2] = factor * ux, factor * uy, factor * uz


@inlined
def add_turning_elements(factor, spin, p, model, matrix):
    """Add what the accelerations of a steady turn change with the places of the nodes of thread p."""
    threads = model.threads
    first, n, tip = threads[p].iv - model.info.nq, threads[p].n, threads[p].tip_mass
    k6 = threads[p].density * threads[p].b[0] / (6.0 * n)
    square = spin[0] * spin[0] + spin[1] * spin[1] + spin[2] * spin[2]
    for i in range(n):
        own = tip + 2.0 * k6 if i == 0 else 4.0 * k6
        for c in range(3):
            for e in range(3):
                value = factor * (spin[c] * spin[e] - (square if c == e else 0.0))
                o, q = first + 3 * i + c, first + 3 * i + e
                add_entry(matrix, o, q, own * value)
                if i < n - 1:
                    add_entry(matrix, o, q + 3, k6 * value)
                    add_entry(matrix, o + 3, q, k6 * value)


# ---------------------------------------------------------------------------------------------- explicit methods


@indirect(void(_I, MODEL))
def carry_root(p, model):
    """Eliminate the masses of thread p from the tip inwards; the body carries the one that is left at Q."""
    threads, nodes, d = model.threads, model.nodes, model.threads[p].d
    n, first = threads[p].n, threads[p].node
    k6 = threads[p].density * threads[p].b[0] / (6.0 * n)
    own = 2.0 * k6 + threads[p].tip_mass
    for i in range(n):
        nodes[first + i].piv = own
        own = (4.0 if i < n - 1 else 2.0) * k6 - k6 * k6 / own
    threads[p].root[MASS] = own
    add_mass(model.bodies, threads[p].body, threads[p].copies * own, d[0], d[1], d[2])


@indirect(types.UniTuple(REAL, 2)(VECTOR, types.boolean, _I, MODEL, VECTOR))
def hold_root(y, loaded, p, model, dy):
    """Forces of thread p and its mass onto its body; returns powers that damping takes and of the weight at Q, W.

    Notes
    -----
    A free spool's S (phi'' + n . w') = r pull + tau has -r (c . aQ + M l'') in its pull, c and M the coefficients of
    l'' that are left at Q. With u . (a, w') = r c . (a + w' x d) + S n . w' it is
    D phi'' = r pull0 + tau - u . (a, w'), D = S + r^2 M, and -u phi'' acts on the body.
    """
    threads, nodes, bodies, b, d = model.threads, model.nodes, model.bodies, model.threads[p].body, model.threads[p].d
    n, first, root, copies, r = threads[p].n, threads[p].node, threads[p].root, float(threads[p].copies), threads[p].r
    at = threads[p].iv  # where dy is zero
    for c in range(at, at + 3 * n):
        dy[c] = 0.0
    if threads[p].drive == FREE_SPOOL:
        threads[p].b[2] = 0.0
    lost, given = add_elements(y, dy, at, (0.0, 0.0, 0.0), loaded, p, model)
    carry_root(p, model)
    k6 = threads[p].density * threads[p].b[0] / (6.0 * n)
    for i in range(n):
        k = first + i
        part = k6 / nodes[k].piv
        for c in range(3):
            f, u = nodes[k].af[c], nodes[k].end[c]
            root[FEED_MASS] -= u * u / nodes[k].piv
            root[FEED_FORCE] -= u * f / nodes[k].piv
            if i < n - 1:
                nodes[k + 1].af[c] -= part * f
                nodes[k + 1].end[c] -= part * u
            else:
                root[FORCE + c] -= part * f
                root[FEED + c] -= part * u
    cx, cy, cz = centripetal(bodies, b, d[0], d[1], d[2])
    m = root[MASS]
    fx, fy, fz = root[FORCE] - m * cx, root[FORCE + 1] - m * cy, root[FORCE + 2] - m * cz
    add_wrench(bodies[b].F, d[0], d[1], d[2], copies * fx, copies * fy, copies * fz)
    root[FEED_FORCE] -= root[FEED] * cx + root[FEED + 1] * cy + root[FEED + 2] * cz
    threads[p].pull = root[FEED_FORCE] + _add_flux(p, model)
    if not is_loose(threads, p):
        return lost, given
    nx, ny, nz = spool_direction(threads, bodies, p)
    add_reaction(bodies, b, 0.0, copies * threads[p].spool_inertia * threads[p].b[1] / r, nx, ny, nz)
    u, own = _spool_row(p, model), threads[p].spool + r * r * root[FEED_MASS]
    free = (r * threads[p].pull + threads[p].motor + threads[p].friction) / own
    for i in range(6):
        bodies[b].F[i] -= copies * free * u[i]
    if bodies[b].motion == SPIN:
        n3 = bodies[b].axis
        ax, ay, az = turn(bodies[b].R, n3[0], n3[1], n3[2])
        along = ax * u[3] + ay * u[4] + az * u[5]
        bodies[b].J -= copies * along * along / own
    elif bodies[b].motion == FREE:
        for i in range(6):
            for j in range(6):
                bodies[b].M[i, j] -= copies * u[i] * u[j] / own
    return lost, given


@inlined
def _spool_row(p, model):
    """Coefficients of the accelerations of its body in the equation of free spool p (`hold_root`), 6 floats."""
    threads, root, d, r, S = (
        model.threads,
        model.threads[p].root,
        model.threads[p].d,
        model.threads[p].r,
        model.threads[p].spool,
    )
    nx, ny, nz = spool_direction(threads, model.bodies, p)
    cx, cy, cz = r * root[FEED], r * root[FEED + 1], r * root[FEED + 2]
    tx, ty, tz = cross(d[0], d[1], d[2], cx, cy, cz)
    return cx, cy, cz, tx + S * nx, ty + S * ny, tz + S * nz


@indirect(REAL(VECTOR, _I, MODEL, VECTOR))
def moving_rates(y, p, model, dy):
    """Rates of thread p and of its free spool, the body's acceleration a known; returns the power of the spool, W."""
    threads, nodes, bodies, root, r = (
        model.threads,
        model.nodes,
        model.bodies,
        model.threads[p].root,
        model.threads[p].r,
    )
    A, n, first = bodies[threads[p].body].a, threads[p].n, threads[p].node
    k6, longer = threads[p].density * threads[p].b[0] / (6.0 * n), 0.0
    if threads[p].drive == FREE_SPOOL:
        k = threads[p].spool_v
        dy[threads[p].spool_q], dy[k] = y[k], 0.0
        if is_loose(threads, p):
            u = _spool_row(p, model)
            torque = r * threads[p].pull + threads[p].motor + threads[p].friction
            for i in range(6):
                torque -= u[i] * A[i]
            dy[k] = torque / (threads[p].spool + r * r * root[FEED_MASS])
        longer = r * dy[k]
        threads[p].b[2] = longer
    cx, cy, cz = centripetal(bodies, threads[p].body, threads[p].d[0], threads[p].d[1], threads[p].d[2])
    ax, ay, az = departure_acceleration(threads, bodies, p)
    threads[p].pull -= root[FEED] * (ax - cx) + root[FEED + 1] * (ay - cy) + root[FEED + 2] * (az - cz)
    threads[p].pull -= root[FEED_MASS] * longer
    aQ, m = (ax, ay, az), root[MASS]
    for c in range(3):
        inner = aQ[c]
        for i in range(n - 1, -1, -1):
            k = first + i
            q, v = threads[p].iq + 3 * i + c, threads[p].iv + 3 * i + c
            inner = (nodes[k].af[c] - k6 * inner - nodes[k].end[c] * longer) / nodes[k].piv
            dy[q], dy[v] = y[v], inner
            nodes[k].x[c] = y[q]
    _note_exit(
        p, model, root[FORCE] - m * ax - root[FEED] * longer, root[FORCE + 1] - m * ay - root[FEED + 1] * longer,
        root[FORCE + 2] - m * az - root[FEED + 2] * longer,
    )  # fmt: skip
    return _spool_power(y, p, model)


@indirect(void(VECTOR, _I, MODEL))
def kick_moving(y, p, model):
    """Velocities of the nodes of thread p jump with that of Q, whose jump is that of its body's a."""
    threads, nodes = model.threads, model.nodes
    n, d, A = threads[p].n, threads[p].d, model.bodies[threads[p].body].a
    k6 = threads[p].density * threads[p].b[0] / (6.0 * n)
    x, yy, z = cross(A[3], A[4], A[5], d[0], d[1], d[2])
    jump = (A[0] + x, A[1] + yy, A[2] + z)
    for c in range(3):
        inner = jump[c]
        for i in range(n - 1, -1, -1):
            inner *= -k6 / nodes[threads[p].node + i].piv
            y[threads[p].iv + 3 * i + c] += inner


# ---------------------------------------------------------------------------------------------- energies


@indirect(REAL(VECTOR, _I, MODEL, VECTOR))
def moving_inventory(y, p, model, out):
    """Add kinetic energy and momenta of what is out of thread p to `out`; returns its elastic energy, J."""
    threads, Q, tip = model.threads, model.threads[p].Q, model.threads[p].tip_mass
    n, q, v, elastic = threads[p].n, threads[p].iq, threads[p].iv, 0.0
    lam, _, k6 = _rates(threads, p)
    c, rest = threads[p].stiffness * threads[p].segment * n / threads[p].b[0], threads[p].b[0] / n
    for i in range(n):
        ex, ey, ez, _, _, _ = segment_vector(y, model.switches, p, i, model)
        extension = math.sqrt(ex * ex + ey * ey + ez * ez) - rest
        elastic += 0.5 * c * extension * extension
        a, w = q + 3 * i, v + 3 * i
        xo, vo = (y[a], y[a + 1], y[a + 2]), (y[w], y[w + 1], y[w + 2])
        if i < n - 1:
            xi, vi = (y[a + 3], y[a + 4], y[a + 5]), (y[w + 3], y[w + 4], y[w + 5])
        else:
            xi, vi = (Q[0], Q[1], Q[2]), (Q[3], Q[4], Q[5])
        so, si = i * lam, (i + 1) * lam
        Vo = (vo[0] + so * ex, vo[1] + so * ey, vo[2] + so * ez)
        Vi = (vi[0] + si * ex, vi[1] + si * ey, vi[2] + si * ez)
        for e in range(3):
            out[KINETIC] += k6 * (Vo[e] * Vo[e] + Vo[e] * Vi[e] + Vi[e] * Vi[e])
            out[P_ALL + e] += 3.0 * k6 * (Vo[e] + Vi[e])
        ux, uy, uz = 2.0 * Vo[0] + Vi[0], 2.0 * Vo[1] + Vi[1], 2.0 * Vo[2] + Vi[2]
        add_angular_momentum(out, H_RELEASED, k6, xo[0], xo[1], xo[2], ux, uy, uz)
        ux, uy, uz = Vo[0] + 2.0 * Vi[0], Vo[1] + 2.0 * Vi[1], Vo[2] + 2.0 * Vi[2]
        add_angular_momentum(out, H_RELEASED, k6, xi[0], xi[1], xi[2], ux, uy, uz)
        if i == 0:
            add_angular_momentum(out, H_RELEASED, tip, xo[0], xo[1], xo[2], vo[0], vo[1], vo[2])
            for e in range(3):
                out[KINETIC] += 0.5 * tip * vo[e] * vo[e]
                out[P_ALL + e] += tip * vo[e]
    return elastic
