"""Thread of springs on a mesh that moves: n elements share the length that is out, and no node leaves or comes back.

Arbitrary Lagrangian-Eulerian description. Node i stands at the part xi_i = 1 - i/n of the length l that is out, from
the exit Q, which is node n. Inside an element r is linear in xi. Material flows through the mesh: it enters at Q at the
rate p, and leaves at the outer end, onto a take-up reel, at the rate o (m/s of natural length; 0 without one), so that
l' = p - o and

    V = dr/dt + ((1 - xi) l' + o)/l dr/dxi.

The kinetic energy of an element of mass m = mu l/n is the exact integral m (Vo.Vo + Vo.Vi + Vi.Vi)/6 of its outer and
inner end. With that of the wound thread, a ring of mass mu (L - integral of p), the mass is constant, and Lagrange's
equations for the nodes, the body and l hold without terms of flux. With lam = l'/l, b = n o/l, d = ro - ri and

    Vo = ro' + (i lam + b) d,  Vi = ri' + ((i + 1) lam + b) d,  Vo~ and Vi~ their derivatives at fixed xi

(lam' = l''/l - lam^2, b' = n o'/l - b lam) the forces of inertia of element i, which stand on the left of the
equations, are

    outer: m/6 (2 Vo~ + Vi~ + lam ((1 - 3 i) Vo - (3 i + 1) Vi) - 3 b (Vo + Vi))
    inner: m/6 (Vo~ + 2 Vi~ + lam ((3 i + 2) Vo + (3 i + 4) Vi) + 3 b (Vo + Vi))
    l:     (d'.S + d.S~ - T + 3 b m/6 d.(Vo + Vi))/l,  S = m/6 ((3 i + 1) Vo + (3 i + 2) Vi),
           S~ = lam S + m/6 ((3 i + 1) Vo~ + (3 i + 2) Vi~)
    flow:  mu/2 (d'.(Vo + Vi) + d.(Vo~ + Vi~)), of o at a constant l

and those of its tension N and strain e, with EA, -+N along d and (EA e^2/2 - N (1 + e))/n. Loads act on the nodes. The
mass matrix is tridiagonal, and eliminated from the tip inwards: what is left is a mass, a force and the coefficients of
l'' at Q, which the body carries. An end that is fixed to a driven body is a node whose motion is given.
"""

import math

from numba import types, void

from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.kernels.drive import FREE as FREE_SPOOL
from evolvent.kernels.rigid import FREE, SPIN, add_mass, add_wrench, assemble_mass_matrix, centripetal
from evolvent.kernels.rotations import cross, turn
from evolvent.kernels.rotor import add_reaction
from evolvent.kernels.thread.chain import departure_acceleration
from evolvent.kernels.thread.end import end_acceleration, is_end, pull_end
from evolvent.kernels.thread.spool import MOVING, is_loose, spool_direction
from evolvent.kernels.thread.springs import segment_force
from evolvent.kernels.thread.wound import spool_axis
from evolvent.model import MODEL, having

USED_FOR = having("threads", kind=MOVING)
_I = types.int64
#: Places in `root` of a thread: mass at Q, force there (3), coefficients of l'' (3); mass and force of l, force of the
#: flow at constant l.
MASS, FORCE, PAYOUT, PAYOUT_MASS, PAYOUT_FORCE, FLOW_FORCE = 0, 1, 4, 7, 8, 9


@inlined
def inertia(i, rates, xo, vo, ao, xi, vi, ai):
    """Forces of inertia of element i onto its ends, times 6/m, of one component of place, rate and acceleration.

    rates : of `flow_rates`. Linear in the last six.
    """
    lam, slope, b, change = rates
    d, w = xo - xi, vo - vi
    fo, fi = i * lam + b, (i + 1) * lam + b
    Vo, Vi = vo + fo * d, vi + fi * d
    Ao, Ai = ao + fo * w + (i * slope + change) * d, ai + fi * w + ((i + 1) * slope + change) * d
    outer = 2.0 * Ao + Ai + lam * ((1 - 3 * i) * Vo - (3 * i + 1) * Vi) - 3.0 * b * (Vo + Vi)
    inner = Ao + 2.0 * Ai + lam * ((3 * i + 2) * Vo + (3 * i + 4) * Vi) + 3.0 * b * (Vo + Vi)
    return outer, inner


@inlined
def flow_rates(threads, p):
    """Of thread p lam = l'/l and b = n o/l with their derivatives, (lam, lam', b, b'), and m/6 of an element."""
    length, n, lam, taken = threads[p].b[0], threads[p].n, threads[p].growth, threads[p].taken
    slope, b = (threads[p].b[2] - taken[2]) / length - lam * lam, n * taken[1] / length
    return (lam, slope, b, n * taken[2] / length - b * lam), threads[p].density * length / (6.0 * n)


@inlined
def _add_loads(p, model):
    """Turn the accelerations of the nodes by loads into forces; weight and fields on half an element at both ends.

    Returns the power of what is not in `node_loads`: at Q, and at a fixed end, whose material moves on.

    Notes
    -----
    A node's material moves on by i/l d per length paid out, and by n/l d per length that flows through, d the mean of
    the vectors of both elements.
    """
    threads, nodes, gravity = model.threads, model.nodes, model.info.gravity
    n, first, root, Q, length = threads[p].n, threads[p].node, threads[p].root, threads[p].Q, threads[p].b[0]
    half, flow = 0.5 * threads[p].density * length / n, n * threads[p].taken[1] / length
    power = 0.0
    for i in range(n):
        k = first + i
        if is_end(threads, p, i):
            for c in range(3):
                d, weight = nodes[k].x[c] - nodes[k + 1].x[c], half * (gravity[c] + threads[p].end_field[c])
                power += weight * nodes[k].v[c] + (nodes[k].af[c] + weight) * flow * d
                nodes[k].af[c] += weight
                root[FLOW_FORCE] += n / length * nodes[k].af[c] * d
            continue
        for c in range(3):
            nodes[k].af[c] *= nodes[k].mass
            if i > 0:
                inner = nodes[k + 1].x[c] if i < n - 1 else Q[c]
                work = 0.5 / length * nodes[k].af[c] * (nodes[k - 1].x[c] - inner)
                root[PAYOUT_FORCE] += i * work
                root[FLOW_FORCE] += n * work
    for c in range(3):
        along, weight = n / length * (nodes[first + n - 1].x[c] - Q[c]), half * (gravity[c] + threads[p].exit_field[c])
        root[FORCE + c] += weight
        root[PAYOUT_FORCE] += weight * along
        root[FLOW_FORCE] += weight * along
        power += weight * (Q[3 + c] + threads[p].b[1] * along)
    return threads[p].copies * power


@inlined
def node_motion(y, a, at, end, i, c, p, model):
    """Place, rate and acceleration of node i of thread p along axis c: of Q (i = n) and of a fixed end what is given.

    end : both given accelerations, of the outer end and of Q (three floats each)
    """
    threads = model.threads
    if i == threads[p].n:
        return threads[p].Q[c], threads[p].Q[3 + c], end[1][c]
    if is_end(threads, p, i):
        k = threads[p].node
        return model.nodes[k].x[c], model.nodes[k].v[c], end[0][c]
    return y[threads[p].iq + 3 * i + c], y[threads[p].iv + 3 * i + c], a[at + 3 * i + c]


@indirect(
    types.UniTuple(REAL, 2)(
        VECTOR, VECTOR, _I, types.UniTuple(types.UniTuple(REAL, 3), 2), types.boolean, _I, MODEL
    )
)  # fmt: skip
def add_elements(y, a, at, end, loaded, p, model):
    """Forces on the nodes of thread p into their `af`, on Q and l into `root`, and the coefficients of l''.

    Parameters
    ----------
    a, at : accelerations of the nodes, from an index on
    end : accelerations of a fixed outer end and of Q, m/s2, 3 floats each

    Returns
    -------
    power that damping takes, and of the weight at the ends, W
    """
    threads, nodes, s, root = model.threads, model.nodes, model.switches, model.threads[p].root
    n, first, length = threads[p].n, threads[p].node, threads[p].b[0]
    rates, k6 = flow_rates(threads, p)
    lam, slope, b, change = rates
    EA = threads[p].stiffness * threads[p].segment
    for c in range(root.size):
        root[c] = 0.0
    given = lost = 0.0
    if loaded:
        given = _add_loads(p, model)
    for i in range(n):
        for c in range(3):
            nodes[first + i].end[c] = 0.0
            if not loaded:
                nodes[first + i].af[c] = 0.0
    if not is_end(threads, p, 0):
        for c in range(3):
            nodes[first].af[c] -= threads[p].tip_mass * a[at + c]
    for i in range(n):
        k = first + i
        ex, ey, ez, scale, T, damped, rate = segment_force(y, 0.0, s, p, i, model)
        lost += damped * rate
        e, strain = (ex, ey, ez), nodes[k].length * n / length - 1.0
        taut = max(strain, 0.0) if threads[p].slack != 0 else strain
        root[PAYOUT_FORCE] += (T * (1.0 + strain) - 0.5 * EA * taut * taut) / n
        fo, fi = i * lam + b, (i + 1) * lam + b
        for c in range(3):
            xo, vo, ao = node_motion(y, a, at, end, i, c, p, model)
            xi, vi, ai = node_motion(y, a, at, end, i + 1, c, p, model)
            outer, inner = inertia(i, rates, xo, vo, ao, xi, vi, ai)
            outer, inner = k6 * outer + scale * T * e[c], k6 * inner - scale * T * e[c]
            d, u = xo - xi, vo - vi
            Vo, Vi = vo + fo * d, vi + fi * d
            Ao, Ai = ao + fo * u + (i * slope + change) * d, ai + fi * u + ((i + 1) * slope + change) * d
            S = k6 * ((3 * i + 1) * Vo + (3 * i + 2) * Vi)
            S1 = lam * S + k6 * ((3 * i + 1) * Ao + (3 * i + 2) * Ai) + 3.0 * b * k6 * (Vo + Vi)
            root[PAYOUT_FORCE] -= (u * S + d * S1 - k6 * (Vo * Vo + Vo * Vi + Vi * Vi)) / length
            along = k6 * d / length
            root[PAYOUT_MASS] += along * d / length * (i * (3 * i + 1) + (i + 1) * (3 * i + 2))
            nodes[k].af[c] -= outer
            nodes[k].end[c] += (3 * i + 1) * along
            if i < n - 1:
                nodes[k + 1].af[c] -= inner
                nodes[k + 1].end[c] += (3 * i + 2) * along
            else:
                root[FORCE + c] -= inner
                root[PAYOUT + c] += (3 * i + 2) * along
    return threads[p].copies * lost, given


@inlined
def _take_up_power(y, a, at, end, p, model):
    """Power of the take-up reel of thread p, W, from the accelerations of the nodes, after those of l are known.

    Notes
    -----
    The length taken up goes with that paid out at a constant l: its force is that of the flow less that of l.
    """
    threads, flow = model.threads, model.threads[p].root[FLOW_FORCE]
    if threads[p].taken[1] == 0.0:
        return 0.0
    (lam, slope, b, change), k6 = flow_rates(threads, p)
    n, length = threads[p].n, threads[p].b[0]
    for i in range(n):
        fo, fi = i * lam + b, (i + 1) * lam + b
        for c in range(3):
            xo, vo, ao = node_motion(y, a, at, end, i, c, p, model)
            xi, vi, ai = node_motion(y, a, at, end, i + 1, c, p, model)
            d, u = xo - xi, vo - vi
            V = vo + vi + (fo + fi) * d
            A = ao + ai + (fo + fi) * u + ((2 * i + 1) * slope + 2.0 * change) * d
            flow -= 3.0 * k6 * n / length * (u * V + d * A)
    return -threads[p].copies * (flow - threads[p].out_pull) * threads[p].taken[1]


@inlined
def _add_flux(p, model):
    """The momentum that the ring of wound thread of thread p gives away goes to its body; returns its pull on l, N.

    Notes
    -----
    With the ring's mass m, from which thread leaves at the spool's outer radius r, the velocity v of its centre, the
    body's rate w, its part u about the spool's axis n and rho = u + l'/r: momentum m v and m r^2/2 (w +
    (rho + l'/r) n), energy m (v.v + r^2 (w.w - u^2)/2 + r^2 rho^2)/2, of which m' = -mu l' leaves; and mu l' r rho less
    the energy per length.
    """
    threads, bodies, b = model.threads, model.bodies, model.threads[p].body
    r, w, out = threads[p].r, bodies[b].w, threads[p].density * threads[p].b[1]
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
    """Power of the drive or motor of the spool of thread p, but for its wound thread and inertia, W."""
    threads = model.threads
    if threads[p].drive == FREE_SPOOL:
        return threads[p].copies * threads[p].motor * y[threads[p].spool_v]
    return -threads[p].copies * threads[p].pull * threads[p].b[1]


# ---------------------------------------------------------------------------------------------- implicit methods


@indirect(types.UniTuple(REAL, 3)(VECTOR, VECTOR, types.boolean, _I, MODEL, VECTOR))
def add_moving_residual(y, a, loaded, p, model, F):
    """Add thread p to a residual, the accelerations of the bodies known; powers taken, given, and of the spools, W."""
    threads, bodies, nodes, first = model.threads, model.bodies, model.nodes, model.threads[p].node
    at, root, d, copies = threads[p].iv - model.info.nq, threads[p].root, threads[p].d, threads[p].copies
    ax, ay, az = departure_acceleration(threads, bodies, p)
    drift = threads[p].drift
    end = (end_acceleration(p, model), (ax + drift[0], ay + drift[1], az + drift[2]))
    lost, given = add_elements(y, a, at, end, loaded, p, model)
    for i in range(threads[p].n):
        for c in range(3):
            if is_end(threads, p, i):  # these coordinates stand still
                F[at + c] = a[at + c]
            else:
                F[at + 3 * i + c] -= nodes[first + i].af[c]
    if is_end(threads, p, 0):
        pull_end(model, p, nodes[first].af[0], nodes[first].af[1], nodes[first].af[2])
    fx, fy, fz = copies * root[FORCE], copies * root[FORCE + 1], copies * root[FORCE + 2]
    add_wrench(bodies[threads[p].body].F, d[0], d[1], d[2], fx, fy, fz)
    threads[p].out_pull = root[PAYOUT_FORCE]
    threads[p].pull = root[PAYOUT_FORCE] + _add_flux(p, model)
    return lost, given, _spool_power(y, p, model) + _take_up_power(y, a, at, end, p, model)


# ---------------------------------------------------------------------------------------------- explicit methods


@indirect(void(_I, MODEL))
def carry_root(p, model):
    """Eliminate the masses of thread p from the tip inwards; the body carries the one that is left at Q."""
    threads, nodes, d = model.threads, model.nodes, model.threads[p].d
    n, first = threads[p].n, threads[p].node
    k6 = threads[p].density * threads[p].b[0] / (6.0 * n)
    own = 2.0 * k6 + threads[p].tip_mass
    if is_end(threads, p, 0):  # whose motion is given
        own = math.inf
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
        rate = y[threads[p].spool_v]
        threads[p].b[2] = -threads[p].coiling * rate * rate
    end = (end_acceleration(p, model), (0.0, 0.0, 0.0))
    lost, given = add_elements(y, dy, at, end, loaded, p, model)
    carry_root(p, model)
    k6 = threads[p].density * threads[p].b[0] / (6.0 * n)
    for i in range(n):
        k = first + i
        part = k6 / nodes[k].piv
        for c in range(3):
            f, u = nodes[k].af[c], nodes[k].end[c]
            root[PAYOUT_MASS] -= u * u / nodes[k].piv
            root[PAYOUT_FORCE] -= u * f / nodes[k].piv
            if i < n - 1:
                nodes[k + 1].af[c] -= part * f
                nodes[k + 1].end[c] -= part * u
            else:
                root[FORCE + c] -= part * f
                root[PAYOUT + c] -= part * u
    cx, cy, cz = centripetal(bodies, b, d[0], d[1], d[2])
    m = root[MASS]
    fx, fy, fz = root[FORCE] - m * cx, root[FORCE + 1] - m * cy, root[FORCE + 2] - m * cz
    add_wrench(bodies[b].F, d[0], d[1], d[2], copies * fx, copies * fy, copies * fz)
    root[PAYOUT_FORCE] -= root[PAYOUT] * cx + root[PAYOUT + 1] * cy + root[PAYOUT + 2] * cz
    threads[p].out_pull = root[PAYOUT_FORCE]
    threads[p].pull = root[PAYOUT_FORCE] + _add_flux(p, model)
    if not is_loose(threads, p):
        return lost, given
    nx, ny, nz = spool_direction(threads, bodies, p)
    add_reaction(bodies, b, 0.0, copies * threads[p].spool_inertia * threads[p].b[1] / r, nx, ny, nz)
    u, own = _spool_row(p, model), threads[p].spool + r * r * root[PAYOUT_MASS]
    free = (r * threads[p].pull + threads[p].motor + threads[p].friction) / own
    for i in range(6):
        bodies[b].F[i] -= copies * free * u[i]
    if bodies[b].motion == SPIN:
        n3 = bodies[b].axis
        ax, ay, az = turn(bodies[b].R, n3[0], n3[1], n3[2])
        along = ax * u[3] + ay * u[4] + az * u[5]
        bodies[b].J -= copies * along * along / own
    elif bodies[b].motion == FREE:
        assemble_mass_matrix(bodies, b)
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
    cx, cy, cz = r * root[PAYOUT], r * root[PAYOUT + 1], r * root[PAYOUT + 2]
    tx, ty, tz = cross(d[0], d[1], d[2], cx, cy, cz)
    return cx, cy, cz, tx + S * nx, ty + S * ny, tz + S * nz


@indirect(REAL(VECTOR, _I, MODEL, VECTOR))
def moving_rates(y, p, model, dy):
    """Rates of thread p and of its free spool, the body's acceleration a known; returns the power of the spools, W."""
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
            dy[k] = torque / (threads[p].spool + r * r * root[PAYOUT_MASS])
        longer = r * dy[k]
        threads[p].b[2] = longer - threads[p].coiling * y[k] * y[k]
    cx, cy, cz = centripetal(bodies, threads[p].body, threads[p].d[0], threads[p].d[1], threads[p].d[2])
    ax, ay, az = departure_acceleration(threads, bodies, p)
    less = root[PAYOUT] * (ax - cx) + root[PAYOUT + 1] * (ay - cy) + root[PAYOUT + 2] * (az - cz)
    less += root[PAYOUT_MASS] * longer
    threads[p].pull -= less
    threads[p].out_pull -= less
    aQ, m, held = (ax, ay, az), root[MASS], is_end(threads, p, 0)
    for c in range(3):
        inner = aQ[c]
        for i in range(n - 1, -1, -1):
            k = first + i
            q, v = threads[p].iq + 3 * i + c, threads[p].iv + 3 * i + c
            force = nodes[k].af[c] - k6 * inner - nodes[k].end[c] * longer
            if held and i == 0:
                nodes[k].af[c] = force
                dy[q] = dy[v] = 0.0
                continue
            inner = force / nodes[k].piv
            dy[q], dy[v] = y[v], inner
            nodes[k].x[c] = y[q]
    if held:
        pull_end(model, p, nodes[first].af[0], nodes[first].af[1], nodes[first].af[2])
    _note_exit(
        p, model, root[FORCE] - m * ax - root[PAYOUT] * longer, root[FORCE + 1] - m * ay - root[PAYOUT + 1] * longer,
        root[FORCE + 2] - m * az - root[PAYOUT + 2] * longer,
    )  # fmt: skip
    end = (end_acceleration(p, model), aQ)
    return _spool_power(y, p, model) + _take_up_power(y, dy, threads[p].iv, end, p, model)


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
