"""Displacement of the coordinates by increments, and the factored tangent of a step."""

from __future__ import annotations

import math

from numba import types, void

from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.flow.implicit import tangent
from evolvent.kernels import rigid
from evolvent.kernels.flexible import NODE_VECTORS
from evolvent.kernels.sparse import SPARSE
from evolvent.model import MODEL
from evolvent.solvers.implicit_state import WORKSPACE, factor

_I = types.int64


@indirect(void(VECTOR, VECTOR, MODEL, VECTOR))
def displace(y0, dq, model, y):
    """Coordinates of y = those of y0 moved by dq; velocities are left."""
    bodies, points, beams = model.bodies, model.points, model.flexible.beams
    n_q = model.info.nq
    for k in range(beams.size):
        q, at, size = beams[k].iq, beams[k].iv - n_q, beams[k].nodes * 3 * NODE_VECTORS[beams[k].kind]
        for i in range(size):
            y[q + i] = y0[q + i] + dq[at + i]
    for k in range(model.threads.size):
        q, at = model.threads[k].iq, model.threads[k].iv - n_q
        for i in range(3 * model.threads[k].n):
            y[q + i] = y0[q + i] + dq[at + i]
        if model.threads[k].spool_q >= 0:
            y[model.threads[k].spool_q] = y0[model.threads[k].spool_q] + dq[model.threads[k].spool_v - n_q]
    for k in range(points.size):
        if points[k].mass == 0.0:  # a beam's node, which has moved with the beam
            continue
        q, at = points[k].iq, points[k].iv - n_q
        for c in range(3):
            y[q + c] = y0[q + c] + dq[at + c]
    for k in range(model.wheels.size):
        y[model.wheels[k].iq] = y0[model.wheels[k].iq] + dq[model.wheels[k].iv - n_q]
    for k in range(bodies.size):
        if bodies[k].motion == rigid.SPIN:
            y[bodies[k].iq] = y0[bodies[k].iq] + dq[bodies[k].iv - n_q]
        elif bodies[k].motion == rigid.FREE:
            q, at = bodies[k].iq, bodies[k].iv - n_q
            for c in range(3):
                y[q + c] = y0[q + c] + dq[at + c]
            turned(y0, q + 3, dq[at + 3], dq[at + 4], dq[at + 5], y)


@inlined
def turned(y0, q, px, py, pz, y):
    """Quaternion at y[q : q + 4] = the one of y0 times exp of the rotation vector p (body axes), of length 1."""
    angle = math.sqrt(px * px + py * py + pz * pz)
    s = math.sin(0.5 * angle) / angle if angle > 1e-8 else 0.5 - angle * angle / 48.0
    c = math.cos(0.5 * angle)
    bx, by, bz = s * px, s * py, s * pz
    w, x, yy, z = y0[q], y0[q + 1], y0[q + 2], y0[q + 3]
    a = w * c - x * bx - yy * by - z * bz
    b = w * bx + x * c + yy * bz - z * by
    d = w * by - x * bz + yy * c + z * bx
    e = w * bz + x * by - yy * bx + z * c
    n = 1.0 / math.sqrt(a * a + b * b + d * d + e * e)
    y[q], y[q + 1], y[q + 2], y[q + 3] = n * a, n * b, n * d, n * e


@indirect(_I(REAL, VECTOR, VECTOR, REAL, REAL, REAL, MODEL, SPARSE, WORKSPACE))
def factor_at(t, y, la, c_mass, c_rate, scale, model, matrix, work):
    """Assemble and factor the matrix; returns what `sparse_lu.factor` returns."""
    info = model.info
    info.compliance = 1.0 / scale
    tangent(t, y, la, c_mass, c_rate, scale, model, matrix)
    return factor(matrix, work)


#: c_mass of a step too short to feel stiffness, times the square of a run's span.
SHORT = 1e16


@inlined
def short_c_mass(options):
    """c_mass of a step too short to feel stiffness."""
    return SHORT / (options.span * options.span)
