"""Compiled functions that evaluate the states of a finished run."""

from __future__ import annotations

from numba import types, void

from evolvent.compiled.jit import INTEGERS, MATRIX, REAL, VECTOR, indirect
from evolvent.compiled.pointer import number_at
from evolvent.flow.inventory import inventory
from evolvent.flow.rhs import rhs
from evolvent.kernels import (
    ancf_beams,
    attitude,
    beam_loads,
    beam_strains,
    bearing,
    contact,
    coordinate,
    fields,
    joint,
    loads,
    points,
    reduced,
    rigid,
    rod,
    springs,
    thermal,
    thread,
)
from evolvent.kernels.work import note_power
from evolvent.model import KEPT, MODEL

_3D, _4D = types.Array(REAL, 3, "C"), types.Array(REAL, 4, "C")
_INTEGERS_2D = types.Array(types.int64, 2, "C")


@indirect(
    void(
        VECTOR, MATRIX, _INTEGERS_2D, MATRIX, MODEL, _3D, _3D, MATRIX, _3D, _4D, _3D, _3D, _3D,
        MATRIX, _3D,
    )
)  # fmt: skip
def fill_observations(times, Y, S, LA, model, position, velocity, tension, spool, R, X, V, W, sums, thread_sums):
    """Fill `observations.Observations`, all but the first five arguments, from the states Y, S, LA at `times`."""
    bodies, threads, nodes = model.bodies, model.threads, model.nodes
    for n in range(times.size):
        if threads.size > 0:
            evaluate_threads(times[n], Y[n], S[n], LA[n], model)
        for k in range(nodes.size):
            tension[n, k] = nodes[k].tension
            for c in range(3):
                position[n, k, c], velocity[n, k, c] = nodes[k].x[c], nodes[k].v[c]
        for p in range(threads.size):
            spool[n, p, 0], spool[n, p, 1] = threads[p].phi, threads[p].turning
            for i in range(threads[p].sums.size):
                thread_sums[n, p, i] = threads[p].sums[i]
        inventory(times[n], Y[n], S[n], model, sums[n])
        for b in range(bodies.size):
            for c in range(3):
                X[n, b, c] = bodies[b].x[c]
                V[n, b, c] = bodies[b].v[c]
                W[n, b, c] = bodies[b].w[c]
                for d in range(3):
                    R[n, b, c, d] = bodies[b].R[c, d]


@indirect(void(REAL, VECTOR, INTEGERS, VECTOR, MODEL), used_for="threads")
def evaluate_threads(t, y, s, la, model):
    """Fields of threads and nodes that are results, into the records.

    Tensions are those of explicit methods, or the multipliers la of the joints that are segments.
    """
    thread.note_tensions(la, model)
    rhs(t, y, s, model, model.dy[0])
    for p in range(model.threads.size):
        thread.note_results(y, s, model, p)


@indirect(void(types.int64, VECTOR, VECTOR, INTEGERS, REAL, MODEL), used_for="fields")
def evaluate_fields(n, times, y, s, factor, model):
    """Resultant, power and work of each field on all masses, times `factor`, at sample n into its record.

    After `kinematics`, and `evaluate_threads` where there are threads. Overwrites `Model.P`, forces on bodies and on
    points.
    """
    n_q, on, masses, bodies, t = model.info.nq, model.fields, model.points, model.bodies, times[n]
    for k in range(on.size):
        force, P = on[k].force, model.P
        for i in range(on.size):
            on[i].scale = factor if i == k else 0.0
        points.clear_forces(masses)
        for b in range(bodies.size):
            for c in range(6):
                bodies[b].F[c] = 0.0
        for i in range(P.size):
            P[i] = 0.0
        for c in range(3):
            force[c] = 0.0
        power = fields.add_field_forces(t, y, model)
        if model.beams.size > 0:
            fields.add_beam_fields(t, y, model, P)
        if model.threads.size > 0:
            power += thread.wound_fields(t, s, model) + thread.add_node_fields(t, s, model, force)
        for i in range(masses.size):
            for c in range(3):
                force[c] += masses[i].f[c]
        for b in range(bodies.size):
            for c in range(3):
                force[c] += bodies[b].F[c]
        for i in range(model.beams.size):
            at, size = model.beams[i].iv - n_q, 3 * ancf_beams.NODE_VECTORS[model.beams[i].kind]
            for m in range(model.beams[i].nodes):
                for c in range(size):
                    power += P[at + size * m + c] * y[n_q + at + size * m + c]
                for c in range(3):
                    force[c] += P[at + size * m + c]
        note_power(on[k], n, times, power)
    for k in range(on.size):
        on[k].scale = factor


@indirect(void(types.int64, VECTOR, VECTOR, INTEGERS, VECTOR, REAL, MODEL))
def evaluate(n, times, y, s, la, factor, model):
    """Fields that are results, at sample n with the multipliers la of joints and a load factor, into the records.

    Joints are evaluated where la has theirs; without threads and bearings, which read them, it may be empty. The factor
    then stands in the records of fields as their `scale`. Samples follow each other: works go on from the sample
    before, and the first one, 0, starts them.
    """
    t = times[n]
    for k in range(model.fields.size):
        model.fields[k].scale = factor
    if model.threads.size > 0:
        evaluate_threads(t, y, s, la, model)
    rigid.kinematics(t, y, model)
    rigid.evaluate_bodies(y, model.bodies)
    points.evaluate_points(y, model.points)
    if model.springs.size > 0:
        springs.evaluate_springs(t, y, model)
    if model.thermal_loads.size > 0:
        thermal.evaluate_heat(t, factor, model)
    if model.elements.size > 0:
        beam_strains.evaluate_beams(y, model)
        beam_strains.evaluate_sums(y, model)
        beam_strains.evaluate_nodes(n, y, model)
    if model.rods.size > 0:
        rod.evaluate_rods(model, model.sums[1])
        rod.evaluate_sums(y, model)
        rod.evaluate_nodes(model)
    if model.reduced_bodies.size > 0:
        reduced.evaluate_reduced(y, model)
    if model.thermal_loads.size > 0:
        thermal.evaluate_energies(n, y, model)
    if model.loads.size > 0:
        loads.evaluate_loads(n, times, y, factor, model)
        if model.threads.size > 0:
            thread.evaluate_thread_loads(n, times, s, factor, model)
    if model.beam_loads.size > 0:
        beam_loads.evaluate_beam_loads(n, times, y, factor, model)
    if model.coordinates.size > 0:
        coordinate.add_coordinates(t, y, KEPT, s, model, model.F)
        bearing.note_bearings(model)
    if model.contact_surfaces.size > 0:
        contact.evaluate_points(y, model)
    if attitude.has_actuators(model) or model.controllers.size > 0:
        attitude.evaluate_actuators(t, y, model)
    if model.fields.size > 0:
        evaluate_fields(n, times, y, s, factor, model)
    for k in range(la.size):
        joint.joint_geometry(t, y, k, model)
        joint.note_reaction(k, la[k], model)


@indirect(void(VECTOR, MATRIX, _INTEGERS_2D, MATRIX, VECTOR, MODEL, _INTEGERS_2D, MATRIX))
def evaluate_samples(times, Y, S, LA, factors, model, fields, out):
    """Evaluate all samples as `evaluate` does one, and keep fields of records of each in a row of `out`.

    Parameters
    ----------
    fields : (m, 4) int, of each field: address in its family's first record, bytes from record to record, number of
        records, and numbers of the field
    out : (nt, n) float, field by field, record by record
    """
    for n in range(times.size):
        evaluate(n, times, Y[n], S[n], LA[n], factors[n], model)
        at = 0
        for i in range(fields.shape[0]):
            for k in range(fields[i, 2]):
                first = fields[i, 0] + k * fields[i, 1]
                for c in range(fields[i, 3]):
                    out[n, at + c] = number_at(first + 8 * c)
                at += fields[i, 3]
