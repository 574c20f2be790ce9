"""Residual and tangent of threads, but for segments of fixed length (`joined`), as implicit methods need them.

The switches of the state (nodes and whole threads released) stand in `Model.switches`. Wound nodes keep their
places; what wound thread adds to a body's mass and forces is as under explicit methods (see `wound`).
"""

import math

from numba import types, void

from evolvent.algebra.sparse import SPARSE, add_entry
from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.kernels import rigid
from evolvent.kernels.drive import FREE as FREE_SPOOL
from evolvent.kernels.rotations import turn, turn_back
from evolvent.kernels.thread.carried import add_carried_inertia, add_carried_weights
from evolvent.kernels.thread.end import TINY, is_end
from evolvent.kernels.thread.fields import add_wound_field_tangents, wound_fields
from evolvent.kernels.thread.free import add_spool_residual, add_spool_tangent, turn_spools
from evolvent.kernels.thread.joined import joined_thread
from evolvent.kernels.thread.loads import add_node_load_tangents, node_loads
from evolvent.kernels.thread.moving import add_moving_residual
from evolvent.kernels.thread.moving_tangent import add_moving_tangent
from evolvent.kernels.thread.relaxing import relaxes
from evolvent.kernels.thread.spool import JOINED, MOVING
from evolvent.kernels.thread.springs import (
    add_segment_tangent,
    natural_segment,
    segment_count,
    segment_force,
    segment_slope,
    segment_vector,
    spring_points,
    spring_thread,
)
from evolvent.kernels.thread.wound import carry_power, carry_wound, reels
from evolvent.model import MODEL

USED_FOR = "threads"


@indirect(types.UniTuple(REAL, 3)(REAL, VECTOR, VECTOR, REAL, MODEL, VECTOR))
def add_thread_residual(t, y, a, step, model, F):
    """Add threads to a residual (`equations.implicit.residual`): before points and bodies, which get their forces.

    Returns
    -------
    dissipated, given, spools : float, W, powers taken by damping and friction, given by loads on threads, by the spools
    """
    bodies, threads, nodes = model.bodies, model.threads, model.nodes
    n_q, s = model.info.nq, model.switches
    for b in range(bodies.size):  # masses of threads alone
        bodies[b].J, bodies[b].has_mass_matrix = 0.0, 1
        for i in range(6):
            for j in range(6):
                bodies[b].M[i, j] = 0.0
    reels(t, y, s, model)
    turn_spools(t, y, a, model)
    given, dy = carry_wound(s, model), model.dy[0]
    if model.fields.size > 0:
        given += wound_fields(t, s, model)
    dissipated, power, spools = add_forces(t, y, 0.0, is_loaded(model), model, dy)
    given += power
    for p in range(threads.size):
        v = threads[p].iv
        if threads[p].kind != JOINED:
            _note_segments(t, y, step, model, p)
        for i in range(threads[p].n if threads[p].kind != MOVING else 0):
            m = nodes[threads[p].node + i].mass
            for c in range(v + 3 * i, v + 3 * i + 3):
                if is_end(threads, p, i):  # these coordinates stand still
                    F[c - n_q] = a[c - n_q]
                else:  # beside the forces of joints
                    F[c - n_q] += m * (a[c - n_q] - (dy[c] if i < s[p] else 0.0))
    model.strands[nodes.size, 0] = t
    for b in range(bodies.size):
        _add_inertia(a, n_q, bodies, b, F)
    for p in range(threads.size):
        if threads[p].kind == MOVING:
            lost, power, driven = add_moving_residual(y, a, is_loaded(model), p, model, F)
            dissipated, given, spools = dissipated + lost, given + power, spools + driven
    dissipated += add_spool_residual(y, a, model, F)
    return dissipated, given, spools + carry_power(s, model)


@inlined
def is_loaded(model):
    """Whether nodes carry loads: weight, loads on threads, fields."""
    gravity = model.info.gravity
    falls = gravity[0] != 0.0 or gravity[1] != 0.0 or gravity[2] != 0.0
    return falls or model.loads.size > 0 or model.fields.size > 0


@inlined
def add_forces(t, y, h, loaded, model, dy):
    """Accelerations of all threads' nodes into dy, and pulls on what they end at; powers taken, given, of spools, W."""
    threads, s, dissipated, given, spools = model.threads, model.switches, 0.0, 0.0, 0.0
    for p in range(threads.size):
        if loaded:
            spring_points(y, s, threads, model.nodes, p)
            given += node_loads(t, s, model, p)
        if threads[p].kind == JOINED:
            spools += joined_thread(y, s, model, p, loaded, dy)
            continue
        if threads[p].kind == MOVING:  # its inertia needs the accelerations of the bodies
            for i in range(threads[p].n):
                segment_force(y, 0.0, s, p, i, model)
            continue
        lost, driven = spring_thread(y, h, s, model, p, loaded, dy)
        dissipated += lost
        spools += driven
    return dissipated, given, spools


@inlined
def _note_segments(t, y, step, model, p):
    """Fill `Model.strands` of thread p.

    Notes
    -----
    Far from the solution the tension c (length - l0) is mostly the square of the turn of a step, and a tangent with it
    leads Newton's method astray. Turned segments are given the tension that the last correction dx led to if the
    thread were straight, T + c e . dx, and the first one of a step that of its start: the multiplier of a segment of
    fixed length (Magisano, Leonetti & Garcea, 2017). Where segments go slack, or the length at the spool is unknown,
    that is c (e . d - rest) of the vector d along the last direction e, and none of a slack segment. Of a viscoelastic
    one c is that of the relaxed stiffness, and the first form is used.
    """
    threads, nodes, s, strands = model.threads, model.nodes, model.switches, model.strands
    before = strands[nodes.size, 0]
    for i in range(s[p]):
        row, T = strands[threads[p].node + i], nodes[threads[p].node + i].tension
        rest, stiffness = natural_segment(s, threads, p, i)
        by_length = threads[p].slack != 0 or threads[p].drive == FREE_SPOOL
        if relaxes(threads, p):
            by_length, stiffness = False, stiffness * nodes[threads[p].node + i].along
        dx, dy, dz, _, _, _ = segment_vector(y, s, p, i, model)
        if step == 0.0:
            row[7] = T
            row[8] = T
        elif t != before:
            if t > before:
                row[8] = row[6]
            row[7] = row[8]
        else:
            along = row[3] * (dx - row[0]) + row[4] * (dy - row[1]) + row[5] * (dz - row[2])
            row[7] = row[6] + stiffness * along
            if by_length:
                row[7] = stiffness * (row[3] * dx + row[4] * dy + row[5] * dz - rest)
        if threads[p].slack != 0:
            row[7] = max(row[7], 0.0) if T != 0.0 else 0.0
        length = math.sqrt(dx * dx + dy * dy + dz * dz)
        scale = 1.0 / length if length > TINY else 0.0
        row[0], row[1], row[2] = dx, dy, dz
        row[3], row[4], row[5] = scale * dx, scale * dy, scale * dz
        row[6] = T


@inlined
def _add_inertia(a, n_q, bodies, b, F):
    """Inertia of what threads add to body b; its acceleration twist goes to its a."""
    at, R, M, A = bodies[b].iv - n_q, bodies[b].R, bodies[b].M, bodies[b].a
    for i in range(6):
        A[i] = 0.0
    if bodies[b].motion == rigid.SPIN:
        n = bodies[b].axis
        nx, ny, nz = turn(R, n[0], n[1], n[2])
        A[3], A[4], A[5] = nx * a[at], ny * a[at], nz * a[at]
        F[at] += bodies[b].J * a[at]
    elif bodies[b].motion == rigid.FREE:
        A[0], A[1], A[2] = a[at], a[at + 1], a[at + 2]
        A[3], A[4], A[5] = turn(R, a[at + 3], a[at + 4], a[at + 5])
        own = bodies[b].L[1]
        for i in range(6):
            own[i] = 0.0
            for j in range(6):
                own[i] += M[i, j] * A[j]
        x, yy, z = turn_back(R, own[3], own[4], own[5])
        for c in range(3):
            F[at + c] += own[c]
        F[at + 3], F[at + 4], F[at + 5] = F[at + 3] + x, F[at + 4] + yy, F[at + 5] + z


@indirect(void(VECTOR, REAL, REAL, MODEL, SPARSE))
def add_thread_tangent(y, c_mass, c_rate, model, matrix):
    """Add threads to a tangent."""
    threads, s, t = model.threads, model.switches, model.strands[model.nodes.size, 0]
    add_node_masses(c_mass, model, matrix)
    add_segment_tangents(y, 0.0, c_rate, model, matrix)
    for p in range(threads.size):
        if threads[p].kind == MOVING:
            add_moving_tangent(y, c_mass, c_rate, p, model, matrix)
        if threads[p].drive == FREE_SPOOL:
            along = segment_slope(0.0, c_rate, p, max(s[p] - 1, 0), model)
            add_spool_tangent(t, y, 0.0, c_mass, c_rate, along, p, model, matrix)
    if model.loads.size > 0 or model.fields.size > 0:
        add_node_load_tangents(t, c_rate, model, matrix)
    if model.fields.size > 0:
        add_wound_field_tangents(t, c_rate, model, matrix)
    add_carried_weights(model, matrix)
    add_carried_inertia(y, c_mass, c_rate, model, matrix)


@inlined
def add_node_masses(c_mass, model, matrix):
    """c_mass times the masses of nodes; without masses, in statics, coordinates that no force moves are held."""
    threads, s = model.threads, model.switches
    for p in range(threads.size):
        for i in range(threads[p].n if threads[p].kind != MOVING else 0):
            at, mass = threads[p].iv + 3 * i - model.info.nq, model.nodes[threads[p].node + i].mass
            if is_end(threads, p, i):
                mass = 1.0
            idle = c_mass == 0.0 and (i >= s[p] or is_end(threads, p, i))
            for c in range(at, at + 3):
                add_entry(matrix, c, c, mass if idle else c_mass * mass)


@inlined
def add_segment_tangents(y, h, c_rate, model, matrix):
    """Tangents of all segments; of a state with the tensions that `_note_segments` gives them."""
    threads, nodes, strands, s = model.threads, model.nodes, model.strands, model.switches
    for p in range(threads.size):
        for i in range(segment_count(s, threads, p) if threads[p].kind != JOINED else 0):
            k = threads[p].node + i
            T = strands[k, 7] if h == 0.0 else nodes[k].tension
            add_segment_tangent(y, h, segment_slope(h, c_rate, p, i, model), T, p, i, model, matrix)
