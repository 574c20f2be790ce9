"""Tangents of threads on a mesh that moves (`moving`), and what a steady turn changes."""

from numba import types, void

from evolvent.algebra.sparse import SPARSE, add_entry
from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.kernels.rigid import point_kinematics
from evolvent.kernels.rotations import cross, turn_back
from evolvent.kernels.sides import ON_BODY, add_turning, side_columns
from evolvent.kernels.thread.end import is_end
from evolvent.kernels.thread.moving import FORCE, PAYOUT, PAYOUT_MASS, USED_FOR, flow_rates, inertia
from evolvent.kernels.thread.springs import segment_vector
from evolvent.model import MODEL

__all__ = ["USED_FOR", "add_moving_tangent", "add_payout", "add_turning_elements", "note_drift"]
_I = types.int64


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
    rates, k6 = flow_rates(threads, p)
    n, first, held = threads[p].n, threads[p].iv - model.info.nq, is_end(threads, p, 0)
    for c in range(first, first + 3):
        own = c_mass * threads[p].tip_mass
        if held:  # these coordinates stand still
            own = c_mass if c_mass != 0.0 else 1.0
        add_entry(matrix, c, c, own)
    oi = ii = io = 0.0
    for i in range(n):
        oo, io = inertia(i, rates, 1.0, c_rate, c_mass, 0.0, 0.0, 0.0)
        oi, ii = inertia(i, rates, 0.0, 0.0, 0.0, 1.0, c_rate, c_mass)
        o = first + 3 * i
        for c in range(o, o + 3):
            if not (held and i == 0):
                add_entry(matrix, c, c, k6 * oo)
                if i < n - 1:
                    add_entry(matrix, c, c + 3, k6 * oi)
                    add_entry(matrix, c + 3, c, k6 * io)
            if i < n - 1:
                add_entry(matrix, c + 3, c + 3, k6 * ii)
    J, L, o = model.J[0], model.K12, first + 3 * (n - 1)
    vo, vi = inertia(n - 1, rates, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0)
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
def add_payout(y, c_mass, c_rate, p, model, matrix):
    """Couple free spool p with the nodes of its thread and with its body; returns its own part, N m.

    Left out is what rates change in the inertia, which only slows Newton's method.
    """
    threads, nodes, root, J = model.threads, model.nodes, model.threads[p].root, model.J[0]
    n, r, length, copies = threads[p].n, threads[p].r, threads[p].b[0], float(threads[p].copies)
    EA = (threads[p].stiffness + c_rate * threads[p].damping) * threads[p].segment
    k, first = threads[p].spool_v - model.info.nq, threads[p].iv
    at, m = side_columns(model, ON_BODY, threads[p].body, -1, threads[p].departure, True, J)
    own = c_mass * r * r * root[PAYOUT_MASS]
    for i in range(n):
        node = threads[p].node + i
        ex, ey, ez, _, _, _ = segment_vector(y, model.switches, p, i, model)
        stretch = nodes[node].length * n / length
        if threads[p].slack != 0 and nodes[node].tension == 0.0:
            stretch = 0.0  # without a force
        e, change = (ex, ey, ez), r * EA * stretch / (length * nodes[node].length)
        own += r * r * EA / length * stretch * stretch / n
        for c in range(3):
            o = first - model.info.nq + 3 * i + c
            value = r * c_mass * nodes[node].end[c] - change * e[c]
            if not is_end(threads, p, i):
                add_entry(matrix, o, k, value)
                add_entry(matrix, k, o, copies * value)
            if i < n - 1:
                add_entry(matrix, o + 3, k, change * e[c])
                add_entry(matrix, k, o + 3, copies * change * e[c])
                continue
            value = copies * (r * c_mass * root[PAYOUT + c] + change * e[c])
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
