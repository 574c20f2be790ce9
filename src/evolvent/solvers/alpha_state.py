"""What the time loop of generalized-alpha carries from step to step, and the places of its entries."""

from __future__ import annotations

import math

import numpy as np
from numba import types, void

from evolvent.flow.implicit import tangent
from evolvent.jit import REAL, VECTOR, indirect, inlined
from evolvent.kernels import rigid, sparse_lu
from evolvent.kernels.flexible import NODE_VECTORS
from evolvent.kernels.sparse import SPARSE
from evolvent.model import MODEL
from evolvent.pointer import Struct, array

# status codes of the loop
BUDGET, DONE, AT_STOP, NO_CONVERGENCE, NOT_FINITE, SINGULAR, GAINED, REDUNDANT = 0, 1, 2, -1, -2, -3, -4, -5
# places in March.tally; OVER: looks in a row at which the account has gained too much; MET: whether
# anything touched in an iteration of the last step
STEPS, ITERATIONS, REJECTED, FACTORED, SAMPLE, STOP, FRESH, SET, OVER, MET, N_TALLY = range(11)
# places in March.clock; FACTOR: step of the matrix; QUALITY: its worst pivot so far; NET: what the account has gained
# since the start, LARGEST: since its lowest; LAST: step that the algorithmic accelerations belong to; EVENT: the next
# step's limit, where a latch lies
TIME, STEP, FACTOR, QUALITY, LARGEST, NET, LAST, EVENT, N_CLOCK = range(9)
# places in March.ledger: what causes have taken, what came in, energy now and at the start
BY_MASS, BY_STIFFNESS, BY_CONTACT, BY_FRICTION, BY_JOINTS, BY_SPRINGS, LOADS, DRIVES = range(8)
KINETIC, ELASTIC, BENDING, CONTACT, COUPLED, START, PEAK, SPOOLS, N_LEDGER = 8, 9, 10, 11, 12, 13, 14, 15, 16
# places in the options; SHARE: of contact forces that are means over a step
ALPHA_M, ALPHA_F, BETA, GAMMA, SHARE, NEWTON, TOLERANCE, SMALLEST, LONGEST, GAIN, MASS, SPAN, FLOOR, N_OPTIONS = range(
    14
)
#: Where Newton's method starts a step: from constant accelerations, from constant velocities, from what March holds.
ACCELERATED, COASTING, AS_IT_IS = 0, 1, 2
#: What a cylinder leaves at a sample: force, torque (inertial axes, at its body's origin), normal force, impulse of it,
#: points that touch.
N_CYLINDER = 9


class March(Struct):
    """What the loop carries.

    Attributes
    ----------
    y, y0, spare : (ny,) float, state at the end and the start of a step, and scratch
    v1 : (5, nv) float, algorithmic accelerations a, accelerations v', loads, accelerations w by forces that are means
        over the step, the part g of those that stiffness carries; those of its start in `v0`
    la, la0 : (nj,) float; dq : (nv,) float, increments; r, x : (nv + nj,) float
    weight : (nu,) float, size of each unknown that counts as 1
    kept : (12,) float, angular momentum that an isolated system keeps (see `keep_momentum`)
    powers : (2, N_POWERS) float, at the end and the start; gaps : (nj,) float, what feeds change in the joints' gaps
    samples : (nt,) float; stops : (ns,) float, times on which the loop lands and starts restart
    out_* : what is kept at the samples
    """

    y: np.ndarray = array(1)
    y0: np.ndarray = array(1)
    spare: np.ndarray = array(1)
    v1: np.ndarray = array(2)
    v0: np.ndarray = array(2)
    la: np.ndarray = array(1)
    la0: np.ndarray = array(1)
    dq: np.ndarray = array(1)
    r: np.ndarray = array(1)
    x: np.ndarray = array(1)
    weight: np.ndarray = array(1)
    powers: np.ndarray = array(2)
    gaps: np.ndarray = array(1)
    clock: np.ndarray = array(1)
    tally: np.ndarray = array(1, np.int64)
    ledger: np.ndarray = array(1)
    impulse: np.ndarray = array(1)
    kept: np.ndarray = array(1)
    samples: np.ndarray = array(1)
    stops: np.ndarray = array(1)
    out_y: np.ndarray = array(2)
    out_a: np.ndarray = array(2)
    out_la: np.ndarray = array(2)
    out_ledger: np.ndarray = array(2)
    out_cylinders: np.ndarray = array(3)
    out_bodies: np.ndarray = array(3)


MARCH = March._numba_type_
_I, _B = types.int64, types.boolean


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
    for k in range(points.size):
        q, at = points[k].iq, points[k].iv - n_q
        for c in range(3):
            y[q + c] = y0[q + c] + dq[at + c]
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


@indirect(_I(REAL, VECTOR, VECTOR, REAL, REAL, REAL, MODEL, SPARSE, MARCH))
def factor_at(t, y, la, c_mass, c_rate, scale, model, matrix, march):
    """Assemble and factor the matrix; returns what `sparse_lu.factor` returns."""
    tangent(t, y, la, c_mass, c_rate, scale, model, matrix)
    found = sparse_lu.factor(matrix)
    march.tally[FACTORED] += 1
    march.clock[QUALITY] = min(march.clock[QUALITY], matrix.quality[0])
    return found


@inlined
def short_c_mass(options):
    """c_mass of a step too short to feel stiffness."""
    return 1e16 / (options[SPAN] * options[SPAN])
