"""Residual and tangent of threads with segments of springs, as implicit methods need them.

The switches of the state (nodes and whole threads released) stand in `Flexible.switches`. Wound nodes keep their
places; what wound thread adds to a body's mass and forces is as under explicit methods (see `wound`).
"""

import math

from numba import types, void

from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.kernels import rigid
from evolvent.kernels.drive import FREE as FREE_SPOOL
from evolvent.kernels.rotations import turn, turn_back
from evolvent.kernels.sides import ON_BODY, ON_COORDINATES, add_product, add_turning, side_columns
from evolvent.kernels.sparse import SPARSE, add_block, add_entry
from evolvent.kernels.thread.end import TINY, add_end_residual, add_end_tangent, clear_end_force, is_end
from evolvent.kernels.thread.fields import wound_fields
from evolvent.kernels.thread.free import add_spool_residual, add_spool_tangent, turn_spools
from evolvent.kernels.thread.loads import add_node_load_tangents, node_loads
from evolvent.kernels.thread.springs import spring_points, spring_thread
from evolvent.kernels.thread.wound import carry_power, carry_wound, reels
from evolvent.model import MODEL

_I = types.int64


@indirect(types.UniTuple(REAL, 4)(REAL, VECTOR, VECTOR, REAL, MODEL, VECTOR))
def add_thread_residual(t, y, a, step, model, r):
    """Add threads to a residual (`evolvent.flow.implicit.residual`) that has everything else.

    Returns
    -------
    dissipated, given, spools, driven : float, W, powers taken by damping and friction, given by loads on threads, by
        the spools, and by what drives bodies, against the forces of threads
    """
    bodies, threads, nodes, f = model.bodies, model.threads, model.nodes, model.flexible
    n_q, s, gravity = model.info.nq, f.switches, model.info.gravity
    for b in range(bodies.size):  # forces and masses of threads alone
        bodies[b].J = 0.0
        for i in range(6):
            bodies[b].L[0, i] = bodies[b].F[i]
            bodies[b].F[i] = 0.0
            for j in range(6):
                bodies[b].M[i, j] = 0.0
    reels(t, y, s, model)
    turn_spools(t, y, a, model)
    dissipated, given, spools = 0.0, carry_wound(s, model), 0.0
    loaded = gravity[0] != 0.0 or gravity[1] != 0.0 or gravity[2] != 0.0 or model.loads.size > 0
    if model.fields.size > 0:
        loaded = True
        given += wound_fields(t, s, model)
    dy = model.dy[0]
    for p in range(threads.size):
        clear_end_force(model, p)
    for p in range(threads.size):
        if loaded:
            spring_points(y, s, threads, nodes, p)
            given += node_loads(t, s, model, p)
        lost, driven = spring_thread(y, s, model, p, loaded, dy)
        dissipated += lost
        spools += driven
        v = threads[p].iv
        _note_segments(t, y, step, model, p)
        for i in range(threads[p].n):
            m = nodes[threads[p].node + i].mass
            for c in range(v + 3 * i, v + 3 * i + 3):
                r[c - n_q] = m * (a[c - n_q] - (dy[c] if i < s[p] else 0.0))
                if is_end(threads, p, i):  # these coordinates stand still
                    r[c - n_q] = a[c - n_q]
    for p in range(threads.size):
        add_end_residual(n_q, model, p, r)
    if threads.size > 0:
        f.strands[nodes.size, 0] = t
    moved = 0.0
    for b in range(bodies.size):
        moved -= _add_body_rows(a, n_q, bodies, b, r)
    dissipated += add_spool_residual(y, a, model, r)
    spools += carry_power(s, model)
    for b in range(bodies.size):
        for i in range(6):
            bodies[b].F[i] += bodies[b].L[0, i]
    return dissipated, given, spools, moved


@inlined
def _note_segments(t, y, step, model, p):
    """Fill `Flexible.strands` of thread p.

    Notes
    -----
    Far from the solution the tension c (length - l0) is mostly the square of the turn of a step, and a tangent with it
    leads Newton's method astray. Turned segments are given the tension that the last correction dx led to if the
    thread were straight, T + c e . dx, and the first one of a step that of its start: the multiplier of a segment of
    fixed length (Magisano, Leonetti & Garcea, 2017). Where segments go slack, or the length at the spool is unknown,
    that is c (e . d - rest) of the vector d along the last direction e, and none of a slack segment.
    """
    threads, nodes, s, strands = model.threads, model.nodes, model.flexible.switches, model.flexible.strands
    before, q, Q = strands[nodes.size, 0], threads[p].iq, threads[p].Q
    for i in range(s[p]):
        row, T, a = strands[threads[p].node + i], nodes[threads[p].node + i].tension, q + 3 * i
        inner = i < s[p] - 1
        x, yy, z = y[a], y[a + 1], y[a + 2]
        if is_end(threads, p, i):
            end = nodes[threads[p].node].x
            x, yy, z = end[0], end[1], end[2]
        dx = x - (y[a + 3] if inner else Q[0])
        dy = yy - (y[a + 4] if inner else Q[1])
        dz = z - (y[a + 5] if inner else Q[2])
        if step == 0.0:
            row[7] = T
            row[8] = T
        elif t != before:
            if t > before:
                row[8] = row[6]
            row[7] = row[8]
        else:
            along = row[3] * (dx - row[0]) + row[4] * (dy - row[1]) + row[5] * (dz - row[2])
            row[7] = row[6] + threads[p].stiffness * along
            if threads[p].slack != 0 or threads[p].drive == FREE_SPOOL:
                rest = threads[p].segment if inner else threads[p].b[0]
                row[7] = threads[p].stiffness * (row[3] * dx + row[4] * dy + row[5] * dz - rest)
        if threads[p].slack != 0:
            row[7] = max(row[7], 0.0) if T != 0.0 else 0.0
        length = math.sqrt(dx * dx + dy * dy + dz * dz)
        scale = 1.0 / length if length > TINY else 0.0
        row[0], row[1], row[2] = dx, dy, dz
        row[3], row[4], row[5] = scale * dx, scale * dy, scale * dz
        row[6] = T


@inlined
def _add_body_rows(a, n_q, bodies, b, r):
    """Inertia and forces of threads on body b; its acceleration twist goes to its a.

    Returns the power of the forces on a driven body, W.
    """
    at, R, M, G, A = bodies[b].iv - n_q, bodies[b].R, bodies[b].M, bodies[b].F, bodies[b].a
    for i in range(6):
        A[i] = 0.0
    if bodies[b].motion == rigid.SPIN:
        n = bodies[b].axis
        nx, ny, nz = turn(R, n[0], n[1], n[2])
        A[3], A[4], A[5] = nx * a[at], ny * a[at], nz * a[at]
        r[at] += bodies[b].J * a[at] - (nx * G[3] + ny * G[4] + nz * G[5])
    elif bodies[b].motion == rigid.FREE:
        A[0], A[1], A[2] = a[at], a[at + 1], a[at + 2]
        A[3], A[4], A[5] = turn(R, a[at + 3], a[at + 4], a[at + 5])
        first = bodies[b].L[1]
        for i in range(6):
            first[i] = -G[i]
            for j in range(6):
                first[i] += M[i, j] * A[j]
        x, yy, z = turn_back(R, first[3], first[4], first[5])
        for c in range(3):
            r[at + c] += first[c]
        r[at + 3] += x
        r[at + 4] += yy
        r[at + 5] += z
    else:
        v, w = bodies[b].v, bodies[b].w
        return G[0] * v[0] + G[1] * v[1] + G[2] * v[2] + G[3] * w[0] + G[4] * w[1] + G[5] * w[2]
    return 0.0


@indirect(void(VECTOR, REAL, REAL, MODEL, SPARSE))
def add_thread_tangent(y, c_mass, c_rate, model, matrix):
    """Add threads to a tangent; how the inertial forces of wound mass change is left out."""
    bodies, threads, nodes, f = model.bodies, model.threads, model.nodes, model.flexible
    n_q, s, K = model.info.nq, f.switches, f.K12
    for p in range(threads.size):
        q, v = threads[p].iq, threads[p].iv
        for i in range(threads[p].n):
            mass = 1.0 if is_end(threads, p, i) else nodes[threads[p].node + i].mass
            # without masses, in statics, coordinates that no force moves are held
            idle = c_mass == 0.0 and (i >= s[p] or is_end(threads, p, i))
            for c in range(v + 3 * i - n_q, v + 3 * i - n_q + 3):
                add_entry(matrix, c, c, mass if idle else c_mass * mass)
        held = is_end(threads, p, 0)
        if held and (s[p] > 1 or s[threads.size + p] == 0):
            add_end_tangent(y, _along(c_rate, p, 0, model), f.strands[threads[p].node, 7], p, model, matrix)
        for i in range(1 if held else 0, s[p] - 1):
            a, along = q + 3 * i, _along(c_rate, p, i, model)
            add_segment_tangent(
                y[a] - y[a + 3], y[a + 1] - y[a + 4], y[a + 2] - y[a + 5], along, f.strands[threads[p].node + i, 7],
                threads[p].body, v + 3 * i, v + 3 * i + 3, 1.0, p, n_q, model, matrix,
            )  # fmt: skip
        if s[p] > (1 if held else 0) and s[threads.size + p] == 0:
            i, Q = s[p] - 1, threads[p].Q
            a, along = q + 3 * i, _along(c_rate, p, i, model)
            add_segment_tangent(
                y[a] - Q[0], y[a + 1] - Q[1], y[a + 2] - Q[2], along, f.strands[threads[p].node + i, 7],
                threads[p].body, v + 3 * i, -1, float(threads[p].copies), p, n_q, model, matrix,
            )  # fmt: skip
        if threads[p].drive == FREE_SPOOL:
            along = _along(c_rate, p, max(s[p] - 1, 0), model)
            add_spool_tangent(f.strands[nodes.size, 0], y, c_mass, c_rate, along, p, model, matrix)
    if model.loads.size > 0 or model.fields.size > 0:
        add_node_load_tangents(f.strands[nodes.size, 0], c_rate, model, matrix)
    for b in range(bodies.size):
        at = bodies[b].iv - n_q
        if bodies[b].motion == rigid.SPIN:
            add_entry(matrix, at, at, c_mass * bodies[b].J)
        elif bodies[b].motion == rigid.FREE:
            M, R = bodies[b].M, bodies[b].R
            for i in range(3):
                for j in range(3):
                    corner = side = turned = 0.0
                    for k in range(3):
                        side += M[i, 3 + k] * R[k, j]
                        turned += R[k, i] * M[3 + k, j]
                        for n in range(3):
                            corner += R[k, i] * M[3 + k, 3 + n] * R[n, j]
                    K[i, j], K[i, 3 + j] = c_mass * M[i, j], c_mass * side
                    K[3 + i, j], K[3 + i, 3 + j] = c_mass * turned, c_mass * corner
            add_block(matrix, at, at, K, 0, 0, 6, 6, 1.0)


@inlined
def _along(c_rate, p, i, model):
    """Stiffness along segment i of thread p with that of its damping, N/m: none where it is slack."""
    threads = model.threads
    if threads[p].slack != 0 and model.nodes[threads[p].node + i].tension == 0.0:
        return 0.0
    return threads[p].stiffness + c_rate * threads[p].damping


@indirect(void(REAL, REAL, REAL, REAL, REAL, _I, _I, _I, REAL, _I, _I, MODEL, SPARSE))
def add_segment_tangent(dx, dy, dz, along, tension, body, outer, inner, copies, p, n_q, model, matrix):
    """Tangent of the segment (dx, dy, dz) from what is inwards to the node at velocity `outer`.

    Inwards is the node at velocity `inner`, or where that is -1 the departure point, whose body carries all copies.
    """
    threads, f = model.threads, model.flexible
    Ja, Jb = f.J[0], f.J[1]
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    if length > TINY:
        ex, ey, ez = dx / length, dy / length, dz / length
        across = tension / length
    else:
        X = threads[p].X
        ex, ey, ez, across = X[0], X[1], X[2], 0.0
    k = along - across
    if inner >= 0:
        _add_link(matrix, outer - n_q, inner - n_q, (ex, ey, ez), k, across, f.K12)
        return
    K00, K11, K22 = across + k * ex * ex, across + k * ey * ey, across + k * ez * ez
    K01, K02, K12 = k * ex * ey, k * ex * ez, k * ey * ez
    local = threads[p].departure
    a, n = side_columns(model, ON_COORDINATES, -1, outer, local, True, Ja)
    b, m = side_columns(model, ON_BODY, body, -1, local, True, Jb)
    add_product(matrix, a, n, Ja, K00, K01, K02, K11, K12, K22, a, n, Ja, 1.0)
    add_product(matrix, a, n, Ja, K00, K01, K02, K11, K12, K22, b, m, Jb, -1.0)
    add_product(matrix, b, m, Jb, K00, K01, K02, K11, K12, K22, a, n, Ja, -copies)
    add_product(matrix, b, m, Jb, K00, K01, K02, K11, K12, K22, b, m, Jb, copies)
    T = -copies * tension
    add_turning(matrix, model, body, local, T * ex, T * ey, T * ez)


@inlined
def _add_link(matrix, outer, inner, e, k, across, K):
    """Tangent k e e^T + across I between two nodes; K : scratch."""
    for i in range(3):
        for j in range(3):
            K[i, j] = k * e[i] * e[j] + (across if i == j else 0.0)
    for p in (outer, inner):
        for q in (outer, inner):
            add_block(matrix, p, q, K, 0, 0, 3, 3, 1.0 if p == q else -1.0)
