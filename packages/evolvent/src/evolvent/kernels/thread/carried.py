"""Tangents of what bodies carry of threads: wound thread, ends, and free spools."""

from numba import void

from evolvent.algebra.sparse import SPARSE, add_block, add_entry
from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.kernels import rigid
from evolvent.kernels.drive import FREE as FREE_SPOOL
from evolvent.kernels.markers import ON_BODY
from evolvent.kernels.rotations import cross, turn, turn_back
from evolvent.kernels.sides import add_turning
from evolvent.kernels.thread.wound import wound_mass
from evolvent.model import MODEL

USED_FOR = "threads"


@indirect(void(MODEL, SPARSE))
def add_carried_weights(model, matrix):
    """Add what turns of bodies change in the torques of the weight of wound thread and of ends."""
    threads, nodes, gravity, local = model.threads, model.nodes, model.info.gravity, model.e[2]
    for p in range(threads.size):
        e, b, Q, Z = threads[p].end, threads[p].body, threads[p].departure, threads[p].normal
        if e >= 0 and model.markers[e].kind == ON_BODY:
            m, place = -nodes[threads[p].node].mass, model.markers[e].local
            add_turning(matrix, model, model.markers[e].index, place, m * gravity[0], m * gravity[1], m * gravity[2])
        if threads[p].carried:
            m = -threads[p].copies * (wound_mass(model.switches, threads, nodes, p) - threads[p].leaving)
            for c in range(3):
                local[c] = Q[c] - threads[p].radius * Z[c]
            add_turning(matrix, model, b, local, m * gravity[0], m * gravity[1], m * gravity[2])


@indirect(void(VECTOR, REAL, REAL, MODEL, SPARSE))
def add_carried_inertia(y, c_mass, c_rate, model, matrix):
    """Add the inertial forces of what bodies carry, after the accelerations of the bodies are known.

    Notes
    -----
    With the mass m, first moment S and moment of inertia I about the origin, the angular momentum h relative to the
    body, w and w' in body axes and the acceleration a of the origin: force m a + R (w' x S + w x (w x S)), torque
    S x R^T a + I w' + w x (I w + h).
    """
    bodies, n_q, K, h = model.bodies, model.info.nq, model.K12, model.scratch[0]
    for b in range(bodies.size):
        at, M, R = bodies[b].iv - n_q, bodies[b].M, bodies[b].R
        if bodies[b].motion == rigid.SPIN:
            add_entry(matrix, at, at, c_mass * bodies[b].J)
        if bodies[b].motion != rigid.FREE:
            continue
        add_momenta(y, b, c_rate, h, model, matrix)
        S = turn_back(R, M[1, 5], -M[0, 5], M[0, 4])
        v = bodies[b].iv + 3
        w, a = (y[v], y[v + 1], y[v + 2]), turn_back(R, bodies[b].a[0], bodies[b].a[1], bodies[b].a[2])
        f = turn_back(R, bodies[b].a[3], bodies[b].a[4], bodies[b].a[5])
        f, sweep = cross(f[0], f[1], f[2], S[0], S[1], S[2]), cross(w[0], w[1], w[2], S[0], S[1], S[2])
        g = cross(w[0], w[1], w[2], sweep[0], sweep[1], sweep[2])
        f = (f[0] + g[0], f[1] + g[1], f[2] + g[2])
        for i in range(3):
            for j in range(3):
                K[6 + i, j] = 0.0
                for k in range(3):
                    for n in range(3):
                        K[6 + i, j] += R[k, i] * M[3 + k, 3 + n] * R[n, j]
        for i in range(3):
            h[i] += K[6 + i, 0] * w[0] + K[6 + i, 1] * w[1] + K[6 + i, 2] * w[2]
        for j in range(3):
            d = (1.0 * (j == 0), 1.0 * (j == 1), 1.0 * (j == 2))
            r = cross(d[0], d[1], d[2], S[0], S[1], S[2])
            one = cross(d[0], d[1], d[2], sweep[0], sweep[1], sweep[2])
            two, t = cross(w[0], w[1], w[2], r[0], r[1], r[2]), cross(d[0], d[1], d[2], f[0], f[1], f[2])
            x, y_, z = (
                c_mass * r[0] + c_rate * (one[0] + two[0]) + t[0],
                c_mass * r[1] + c_rate * (one[1] + two[1]) + t[1],
                c_mass * r[2] + c_rate * (one[2] + two[2]) + t[2],
            )
            K[0, 3 + j], K[1, 3 + j], K[2, 3 + j] = turn(R, x, y_, z)
            one = cross(d[0], d[1], d[2], h[0], h[1], h[2])
            two = cross(w[0], w[1], w[2], K[6, j], K[7, j], K[8, j])
            t = cross(a[0], a[1], a[2], d[0], d[1], d[2])
            t = cross(S[0], S[1], S[2], t[0], t[1], t[2])
            for i in range(3):
                K[3 + i, 3 + j] = c_mass * K[6 + i, j] + c_rate * (one[i] + two[i]) + t[i]
                K[i, j] = c_mass * M[i, j]
            t = turn_back(R, d[0], d[1], d[2])
            K[3, j], K[4, j], K[5, j] = cross(c_mass * S[0], c_mass * S[1], c_mass * S[2], t[0], t[1], t[2])
        add_block(matrix, at, at, K, 0, 0, 6, 6, 1.0)


@inlined
def add_momenta(y, b, c_rate, h, model, matrix):
    """Angular momentum of the spools of body b relative to it into h : (3,), body axes; add what free ones change."""
    threads, n_q, v = model.threads, model.info.nq, model.bodies[b].iv + 3
    for c in range(3):
        h[c] = 0.0
    for p in range(threads.size):
        S, Y = threads[p].copies * threads[p].spool, threads[p].chord
        if threads[p].body != b or S == 0.0:
            continue
        rate = threads[p].b[1] / threads[p].r
        for c in range(3):
            h[c] += S * rate * Y[c]
        if threads[p].drive == FREE_SPOOL:
            t = cross(y[v], y[v + 1], y[v + 2], Y[0], Y[1], Y[2])
            for c in range(3):
                add_entry(matrix, v - n_q + c, threads[p].spool_v - n_q, c_rate * S * t[c])
