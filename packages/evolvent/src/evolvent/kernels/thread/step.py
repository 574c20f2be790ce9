"""Threads over a step of energy-momentum: forces, and the mass of theirs that bodies carry.

Wound thread that is carried and the end of a thread on a body are parts of that body, whose centre of mass and inertia
they change: its velocities and momenta are those of the whole.
"""

from numba import types, void

from evolvent.algebra.sparse import SPARSE
from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.kernels import rigid
from evolvent.kernels.drive import FREE as FREE_SPOOL
from evolvent.kernels.markers import ON_BODY
from evolvent.kernels.rotations import cross, turn
from evolvent.kernels.thread.carried import add_carried_weights
from evolvent.kernels.thread.end import is_end
from evolvent.kernels.thread.fields import add_wound_field_tangents, wound_fields
from evolvent.kernels.thread.free import add_spool_tangent, hold_spools
from evolvent.kernels.thread.implicit import add_forces, add_node_masses, add_segment_tangents, is_loaded
from evolvent.kernels.thread.loads import add_node_load_tangents
from evolvent.kernels.thread.spool import ring_radius, spool_pull
from evolvent.kernels.thread.springs import measure_segments, segment_slope
from evolvent.kernels.thread.wound import reels, wound_mass
from evolvent.model import MODEL

USED_FOR = "threads"
_I = types.int64


@indirect(void(_I, REAL, VECTOR, MODEL))
def measure_threads(end, t, y, model):
    """Lengths of all segments and rates of spools at the start (0) or the end (1) of a step, after `kinematics`."""
    threads, bodies, s = model.threads, model.bodies, model.switches
    reels(t, y, s, model)
    measure_segments(end, y, s, model)
    if end == 0:
        note_carried(model)
    for b in range(bodies.size):
        for c in range(3):
            if end == 0:
                bodies[b].spin0[c] = 0.0
            bodies[b].spin1[c] = 0.0
    for p in range(threads.size):
        if threads[p].end >= 0:
            v = model.nodes[threads[p].node].v
            square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
            if end == 0:
                threads[p].square0 = square
            threads[p].square1 = square
        h, b = turning_inertia(p, model) * threads[p].b[1] / threads[p].r, threads[p].body
        for c in range(3):
            if end == 0:
                bodies[b].spin0[c] += h * threads[p].chord[c]
            bodies[b].spin1[c] += h * threads[p].chord[c]


@inlined
def ring_inertia(p, model):
    """Inertia of the carried thread on spool p about the spool's axis, of all copies, kg m2."""
    threads, s = model.threads, model.switches
    r = ring_radius(s, threads, p)
    return threads[p].carried * threads[p].copies * wound_mass(s, threads, model.nodes, p) * r * r


@inlined
def turning_inertia(p, model):
    """Inertia of what turns with spool p, of all copies, kg m2: `ring_inertia` and that of a free spool."""
    threads, own = model.threads, 0.0
    if threads[p].drive == FREE_SPOOL:
        own = threads[p].copies * threads[p].spool_inertia
    return ring_inertia(p, model) + own


@inlined
def _add_mass(bodies, b, m, px, py, pz):
    """A point mass m at a place of body b, body axes."""
    p, square = (px, py, pz), px * px + py * py + pz * pz
    bodies[b].carried += m
    for i in range(3):
        bodies[b].moment[i] += m * p[i]
        bodies[b].own[i, i] += m * square
        for j in range(3):
            bodies[b].own[i, j] -= m * p[i] * p[j]


@indirect(void(MODEL))
def note_carried(model):
    """Mass of threads that moves with each body, its moment and its inertia; of a free body that of the whole.

    Notes
    -----
    Of a free body `moment` becomes the place of the common centre of mass, and `own` the inertia about that.
    """
    bodies, threads, nodes, markers = model.bodies, model.threads, model.nodes, model.markers
    for b in range(bodies.size):
        bodies[b].carried = 0.0
        for i in range(3):
            bodies[b].moment[i] = 0.0
            for j in range(3):
                bodies[b].own[i, j] = 0.0
    for p in range(threads.size):
        e = threads[p].end
        if e >= 0 and markers[e].kind == ON_BODY:
            local = markers[e].local
            _add_mass(bodies, markers[e].index, nodes[threads[p].node].mass, local[0], local[1], local[2])
        if threads[p].carried == 0:
            continue
        b, n, r, Q, Z = threads[p].body, threads[p].chord, threads[p].radius, threads[p].departure, threads[p].normal
        m = threads[p].copies * wound_mass(model.switches, threads, nodes, p)
        _add_mass(bodies, b, m, Q[0] - r * Z[0], Q[1] - r * Z[1], Q[2] - r * Z[2])
        across = 0.5 * ring_inertia(p, model)
        for i in range(3):
            bodies[b].own[i, i] += across
            for j in range(3):
                bodies[b].own[i, j] += across * n[i] * n[j]
    for b in range(bodies.size):
        if bodies[b].motion != rigid.FREE or bodies[b].carried == 0.0:
            continue
        total, c = bodies[b].mass + bodies[b].carried, bodies[b].moment
        for i in range(3):
            c[i] /= total
        square = c[0] * c[0] + c[1] * c[1] + c[2] * c[2]
        for i in range(3):
            bodies[b].own[i, i] -= total * square
            for j in range(3):
                bodies[b].own[i, j] += bodies[b].inertia[i, j] + total * c[i] * c[j]


@inlined
def _first_moment(bodies, b):
    """First moment of the thread that moves with body b about its origin, inertial axes, kg m."""
    c = bodies[b].moment
    x, y, z = turn(bodies[b].R, c[0], c[1], c[2])
    if bodies[b].motion == rigid.FREE:  # that of the whole, whose own part has none
        m = bodies[b].mass + bodies[b].carried
        return m * x, m * y, m * z
    return x, y, z


@indirect(types.UniTuple(REAL, 4)(REAL, REAL, VECTOR, VECTOR, VECTOR, MODEL, VECTOR))
def add_thread_step(t, h, y, v0, v1, model, F):
    """Forces of threads over a step of length h about the mean state y at t, onto bodies and points too; nodes into F.

    Parameters
    ----------
    v0, v1 : (ny,) float, states at both ends
    F : (nv,) float, the nodes' inertia less their forces is added

    Returns
    -------
    dissipated, given, spools, driven : float, W, as of `implicit.add_thread_residual`, means over the step, and what
        drives bodies against the inertia of threads
    """
    bodies, threads, nodes, s, n_q = model.bodies, model.threads, model.nodes, model.switches, model.info.nq
    gravity, dy, given, driven = model.info.gravity, model.dy[0], 0.0, 0.0
    reels(t, y, s, model)
    for p in range(threads.size):
        threads[p].b[0] = 0.5 * (threads[p].rest0 + threads[p].rest1)
        threads[p].b[1] = (threads[p].rest1 - threads[p].rest0) / h
    for b in range(bodies.size):
        m = bodies[b].carried
        if m == 0.0:
            continue
        w, v = bodies[b].w, bodies[b].v
        sx, sy, sz = _first_moment(bodies, b)
        rigid.add_wrench(bodies[b].F, sx / m, sy / m, sz / m, m * gravity[0], m * gravity[1], m * gravity[2])
        ux, uy, uz = cross(w[0], w[1], w[2], sx, sy, sz)
        given += gravity[0] * (m * v[0] + ux) + gravity[1] * (m * v[1] + uy) + gravity[2] * (m * v[2] + uz)
    if model.fields.size > 0:
        given += wound_fields(t, s, model)
    hold_spools(t, y, model)
    dissipated, power, spools = add_forces(t, y, h, is_loaded(model), model, dy)
    given += power
    for p in range(threads.size):
        for i in range(threads[p].n):
            moves = i < s[p] and not is_end(threads, p, i)
            m = nodes[threads[p].node + i].mass if moves else 1.0
            for c in range(threads[p].iv + 3 * i, threads[p].iv + 3 * i + 3):
                F[c - n_q] += m * ((v1[c] - v0[c]) / h - (dy[c] if moves else 0.0))
    for p in range(threads.size):
        b, e = threads[p].body, threads[p].end
        if e >= 0 and model.markers[e].kind == ON_BODY and bodies[model.markers[e].index].motion == rigid.DRIVEN:
            driven += 0.5 * nodes[threads[p].node].mass * (threads[p].square1 - threads[p].square0) / h
        n, before, after = threads[p].chord, threads[p].turning0, threads[p].turning1
        torque = after - before + _turns(b, v1, n, bodies) - _turns(b, v0, n, bodies)
        torque *= turning_inertia(p, model) / h
        if threads[p].drive == FREE_SPOOL:
            k, copies = threads[p].spool_v, threads[p].copies
            threads[p].spool = turning_inertia(p, model) / copies
            pull = threads[p].r * spool_pull(s, model, p)
            F[k - n_q] += torque - copies * (pull + threads[p].motor + threads[p].friction)
            dissipated -= copies * threads[p].friction * y[k]
        else:
            spools += 0.5 * torque * (before + after) - threads[p].field
        if bodies[b].motion == rigid.DRIVEN:
            a = bodies[b].axis
            driven += torque * bodies[b].rate * (a[0] * n[0] + a[1] * n[1] + a[2] * n[2])
    return dissipated, given, spools, driven


@inlined
def _turns(b, y, n, bodies):
    """Rate of a body about an axis of it, rad/s, of the state y; 0 of a driven one, whose rate is constant."""
    v = bodies[b].iv
    if bodies[b].motion == rigid.SPIN:
        a = bodies[b].axis
        return y[v] * (a[0] * n[0] + a[1] * n[1] + a[2] * n[2])
    if bodies[b].motion == rigid.FREE:
        return y[v + 3] * n[0] + y[v + 4] * n[1] + y[v + 5] * n[2]
    return 0.0


@indirect(void(REAL, VECTOR, REAL, REAL, REAL, MODEL, SPARSE))
def add_thread_step_tangent(t, y, h, c_mass, c_rate, model, matrix):
    """Twice the derivatives of `add_thread_step`, but for carried mass, which is that of bodies."""
    add_node_masses(c_mass, model, matrix)
    add_segment_tangents(y, h, c_rate, model, matrix)
    for p in range(model.threads.size):
        if model.threads[p].drive == FREE_SPOOL:
            along = segment_slope(h, c_rate, p, max(model.switches[p] - 1, 0), model)
            add_spool_tangent(t, y, h, c_mass, c_rate, along, p, model, matrix)
    if model.loads.size > 0 or model.fields.size > 0:
        add_node_load_tangents(t, c_rate, model, matrix)
    if model.fields.size > 0:
        add_wound_field_tangents(t, c_rate, model, matrix)
    add_carried_weights(model, matrix)
