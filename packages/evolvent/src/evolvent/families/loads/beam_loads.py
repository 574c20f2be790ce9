"""Loads on beams: a torque about an axis spread over the mass, a force per length, a force at a vector of a node."""

import math

from numba import types, void

from evolvent.algebra.sparse import SPARSE, add_block, add_inner, inner
from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined, kernel
from evolvent.families.loads.node_loads import FIELD, LINE, MOMENT, POINT, add_following_load, follows, node_vector
from evolvent.kernels.ancf_beams import NODE_VECTORS
from evolvent.kernels.profile import profile, window
from evolvent.kernels.rotations import cross
from evolvent.kernels.work import note_load
from evolvent.model import MODEL

USED_FOR = "beam_loads"
__all__ = ["FIELD", "LINE", "MOMENT", "POINT", "add_beam_loads", "add_field_tangents", "evaluate_beam_loads", "follows"]


@indirect(void(REAL, VECTOR, REAL, MODEL, VECTOR))
def add_beam_loads(t, y, factor, model, P):
    """All beam loads at time t, times `factor`, into the loads P.

    Notes
    -----
    FIELD, a torque T about the axis z through c: force per mass T (z x (r - c) + p z)/J, J = int |z x (r - c)|^2 dm, of
    each beam, with the pitch p of a screw motion. LINE, force per length along `axis`. POINT, force along `axis` at a
    vector of coordinates. MOMENT and what follows the beam or a law: `node_loads`. A load with parameters and no law
    has a profile, by which its value is multiplied.
    """
    beam_loads = model.beam_loads
    for k in range(beam_loads.size):
        value = factor * beam_loads[k].value * window(t, beam_loads[k].start, beam_loads[k].end, beam_loads[k].ramp)
        beam_loads[k].now = value
        if value == 0.0:
            continue
        if beam_loads[k].law == 0 and beam_loads[k].last > beam_loads[k].first:
            value *= profile(t, beam_loads[k].first, model)
            beam_loads[k].now = value
        add_beam_load(t, y, k, value, model, P)


@inlined
def add_beam_load(t, y, k, value, model, P):
    """Load k times `value` into the loads P."""
    n_q = model.info.nq
    beams, elements, beam_loads = model.beams, model.elements, model.beam_loads
    if follows(beam_loads, k):
        add_following_load(t, y, k, value, model, P)
        return
    z, centre = beam_loads[k].axis, beam_loads[k].centre
    if beam_loads[k].kind == POINT:
        at = beam_loads[k].iv - n_q
        for c in range(3):
            P[at + c] += value * z[c]
        return
    beam = beam_loads[k].beam
    first, last = beams[beam].first_element, beams[beam].first_element + beams[beam].elements
    n = 2 * NODE_VECTORS[beams[beam].kind]
    if beam_loads[k].kind == LINE:
        for element in range(first, last):
            at, length = elements[element].iv - n_q, elements[element].length
            weights = 0.5 * length, length * length / 12.0
            for c in range(3):
                P[at + c] += value * z[c] * weights[0]
                P[at + 3 + c] += value * z[c] * weights[1]
                P[at + 3 * (n // 2) + c] += value * z[c] * weights[0]
                P[at + 3 * (n // 2) + 3 + c] -= value * z[c] * weights[1]
        return
    inertia = 0.0
    for element in range(first, last):
        inertia += _field(y, n_q, model, element, n, z, centre, 0.0, 0.0, P)
    for element in range(first, last):
        _field(y, n_q, model, element, n, z, centre, beam_loads[k].pitch, value / inertia, P)


@indirect(void(types.int64, VECTOR, VECTOR, REAL, MODEL))
def evaluate_beam_loads(n, times, y, factor, model):
    """Evaluate all beam loads, times `factor`, at sample n into their records; overwrites the loads `Model.P`."""
    n_q, n_v, P, t = model.info.nq, model.info.nv, model.P, times[n]
    for k in range(model.beam_loads.size):
        row, rate, along = model.beam_loads[k], 0.0, math.nan
        for i in range(n_v):
            P[i] = 0.0
        add_beam_load(t, y, k, row.value, model, P)
        for i in range(n_v):
            rate += P[i] * y[n_q + i]
        beam, vector, at = model.beams[row.beam], row.vector, row.first
        if row.kind != LINE:
            x, yy, z = node_vector(t, y, k, model)
            vector[0], vector[1], vector[2] = row.value * x, row.value * yy, row.value * z
        else:
            for c in range(3):
                vector[c] = 0.0
                for i in range(beam.nodes):
                    vector[c] += P[beam.iv - n_q + 3 * NODE_VECTORS[beam.kind] * i + c]
        _note_middle(y, k, model)
        if not follows(model.beam_loads, k) and row.kind != FIELD:
            place = row.middle if row.kind == LINE else y[row.iq : row.iq + 3]
            along = vector[0] * place[0] + vector[1] * place[1] + vector[2] * place[2]
        if row.law != 0 or row.last <= row.first:
            at = -1
        value = note_load(row, n, times, factor, rate, along, row.start, row.end, row.ramp, at, model)
        for c in range(3):
            vector[c] *= value


@inlined
def _note_middle(y, k, model):
    """Where load k acts into its record: on its axis, at its node, or in the mean over the length of its beam."""
    row = model.beam_loads[k]
    beam, middle = model.beams[row.beam], row.middle
    size = 3 * NODE_VECTORS[beam.kind]
    for c in range(3):
        if row.kind == FIELD:
            middle[c] = row.centre[c]
        elif row.kind != LINE:
            middle[c] = y[row.iq - (row.iq - beam.iq) % size + c]
        else:
            middle[c] = 0.0
            for i in range(beam.first_element, beam.first_element + beam.elements):
                iq, h = model.elements[i].iq, model.elements[i].length
                mean = 0.5 * (y[iq + c] + y[iq + size + c]) + h / 12.0 * (y[iq + 3 + c] - y[iq + size + 3 + c])
                middle[c] += h / beam.length * mean


@kernel
def _field_vectors(y, model, k, n, z, centre, pitch, out):
    """M (z x (e - c) + pitch z) of element k into out : (3 n,); returns M (z x (e - c)) . (z x (e - c)) for pitch 0."""
    iq, mass = model.elements[k].iq, model.elements[k].mass
    M = model.M[mass]
    half = n // 2
    e = model.e
    for j in range(n):
        x, y0, z0 = y[iq + 3 * j], y[iq + 3 * j + 1], y[iq + 3 * j + 2]
        if j == 0 or j == half:
            x, y0, z0 = x - centre[0], y0 - centre[1], z0 - centre[2]
        fx, fy, fz = cross(z[0], z[1], z[2], x, y0, z0)
        along = pitch if j == 0 or j == half else 0.0
        e[1, 3 * j], e[1, 3 * j + 1], e[1, 3 * j + 2] = fx + along * z[0], fy + along * z[1], fz + along * z[2]
    inertia = 0.0
    for i in range(n):
        fx = fy = fz = 0.0
        for j in range(n):
            fx += M[i, j] * e[1, 3 * j]
            fy += M[i, j] * e[1, 3 * j + 1]
            fz += M[i, j] * e[1, 3 * j + 2]
        inertia += fx * e[1, 3 * i] + fy * e[1, 3 * i + 1] + fz * e[1, 3 * i + 2]
        out[3 * i], out[3 * i + 1], out[3 * i + 2] = fx, fy, fz
    return inertia


@inlined
def _field(y, n_q, model, k, n, z, centre, pitch, scale, P):
    """Forces scale M (z x (e - c) + pitch z) of one element into P; for pitch 0 returns its inertia about the axis."""
    at, out = model.elements[k].iv - n_q, model.e[2]
    inertia = _field_vectors(y, model, k, n, z, centre, pitch, out)
    for i in range(3 * n):
        P[at + i] += scale * out[i]
    return inertia


# ---------------------------------------------------------------------------------------------- tangent


@inlined
def add_field_tangents(y, model, matrix):
    """Tangents of all torques that are spread over a beam's mass."""
    for k in range(model.beam_loads.size):
        if model.beam_loads[k].kind == FIELD and model.beam_loads[k].now != 0.0:
            add_field_tangent(y, k, model, matrix)


@indirect(void(VECTOR, types.int64, MODEL, SPARSE))
def add_field_tangent(y, k, model, matrix):
    """Add what load k, a FIELD, changes with the coordinates of its beam, at its last value.

    Notes
    -----
    With P = (T/J) M f, f = z x (e - c) + p z: -dP = -(T/J) M (z x de) + (T/J^2) M f dJ, and dJ = 2 M f0 . (z x de) of
    f0 = z x (e - c) couples all nodes of the beam, by an inner unknown (`algebra.sparse`).
    """
    n_q, row = model.info.nq, model.beam_loads[k]
    z, K, plain, whole = row.axis, model.K24, model.e[0], model.e[2]
    first = model.beams[row.beam].first_element
    last, n = first + model.beams[row.beam].elements, 2 * NODE_VECTORS[model.beams[row.beam].kind]
    inertia = 0.0
    for element in range(first, last):
        inertia += _field_vectors(y, model, element, n, z, row.centre, 0.0, plain)
    s, q, half = row.now / inertia, inner(matrix, 1), 3 * (n // 2)
    for element in range(first, last):
        at, mass = model.elements[element].iv - n_q, model.elements[element].mass
        M = model.M[mass]
        for i in range(n):
            for j in range(n):
                for c in range(3):
                    x, yy, zz = cross(z[0], z[1], z[2], 1.0 * (c == 0), 1.0 * (c == 1), 1.0 * (c == 2))
                    w = -s * M[i, j]
                    K[3 * i, 3 * j + c], K[3 * i + 1, 3 * j + c], K[3 * i + 2, 3 * j + c] = w * x, w * yy, w * zz
        for r in range(0, 2 * half, half):
            for c in range(0, 2 * half, half):
                add_block(matrix, at + r, at + c, K, r, c, half, half, 1.0)
        _field_vectors(y, model, element, n, z, row.centre, 0.0, plain)
        _field_vectors(y, model, element, n, z, row.centre, row.pitch, whole)
        for i in range(n):
            x, yy, zz = cross(plain[3 * i], plain[3 * i + 1], plain[3 * i + 2], z[0], z[1], z[2])
            add_inner(matrix, at + 3 * i, q, s / inertia * whole[3 * i], 2.0 * x)
            add_inner(matrix, at + 3 * i + 1, q, s / inertia * whole[3 * i + 1], 2.0 * yy)
            add_inner(matrix, at + 3 * i + 2, q, s / inertia * whole[3 * i + 2], 2.0 * zz)
