"""What the time loop of generalized-alpha carries from step to step."""

from __future__ import annotations

import math

import numpy as np
from numba import types, void

from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.compiled.pointer import Struct, array, record
from evolvent.flow.implicit import tangent
from evolvent.kernels import rigid, sparse_lu
from evolvent.kernels.flexible import NODE_VECTORS
from evolvent.kernels.sparse import SPARSE
from evolvent.model import MODEL
from evolvent.solvers.balance import BALANCE, EXTREMES

# status codes of the loop
BUDGET, DONE, AT_STOP, AT_RESTART = 0, 1, 2, 3
NO_CONVERGENCE, NOT_FINITE, SINGULAR, GAINED, REDUNDANT = -1, -2, -3, -4, -5
#: The loop's counters and clock. stale: 1 where the matrix must be factored again; contact_set: which points touch, as
#: `contact.pressed` counts; over: steps in a row at which the balance has gained too much; sample, stop: the
#: next ones; factored_step: step of the factored matrix; quality: its worst pivot so far; gain, lowest_gain: what the
#: balance has gained since the start, and the lowest of that so far, J; last_step: step that the algorithmic
#: accelerations belong to; event_step: limit of the next step, on which a latch or an event lies; start_energy: J;
#: latches: number of latches that have locked; extended: whether the step was made longer for an event; settling,
#: fastest, left, left0: as of `energy_loop.LOOP`; and the extremes of `evolvent.solvers.balance`.
LOOP = np.dtype(
    [(name, np.int64) for name in ("steps", "iterations", "rejected", "factorizations", "sample", "stop", "stale",
                                   "contact_set", "over", "latches", "extended", "settling")]
    + [(name, np.float64) for name in ("time", "step", "factored_step", "quality", "gain", "lowest_gain",
                                       "last_step", "event_step", "start_energy", "fastest", "left", "left0")]
    + list(EXTREMES),
    align=True,
)  # fmt: skip
#: Options of a run. newton, sharp: correction at which an iteration has converged, and share of `rates` that it may
#: leave; tolerance, rates: of coordinates and rates, 0 of fixed steps; gain: largest part of the energy moved that may
#: come from nothing; mass, span, floor: a typical mass (kg), time (s), energy (J).
OPTIONS = np.dtype(
    [(name, np.float64) for name in ("alpha_m", "alpha_f", "beta", "gamma", "newton", "sharp", "tolerance", "rates",
                                     "smallest", "longest", "gain", "mass", "span", "floor")]
)  # fmt: skip


class Workspace(Struct):
    """What the loop carries from step to step. Of a pair, 0 is the start of the step and 1 its end.

    Attributes
    ----------
    options, loop, balance : records (see `OPTIONS`, `LOOP` and `evolvent.solvers.balance`)
    row, row0 : (number of fields,) float, J, the fields of `balance`, and those of the step's start
    y, y0, spare : (ny,) float, state at the end and the start of a step, and scratch
    a1, a0 : (nv,) float, algorithmic accelerations
    dv1, dv0 : (nv,) float, accelerations v'
    loads1, loads0 : (nv,) float, loads
    la, la0 : (nj,) float, multipliers; dq : (nv,) float, increments; r, x : (nv + nj,) float
    weight : (nu,) float, size of each unknown that counts as 1; shares : (nv,) float, see
        `implicit_setup.shares`
    kept : (12,) float, angular momentum that an isolated system keeps (see `keep_momentum`)
    momenta : (6,) float, scratch
    powers : (2, N_POWERS) float, at the end and the start; gaps : (nj,) float, what drives change in the joints' gaps
    energies : (3,) float, scratch; impulse : (nc,) float, N s, of the normal forces of each cylinder; touched : (nbc,)
        float, likewise of each contact between bodies
    touches, friction : (2, nbc, N_TOUCH) and (2, n, 3) float, likewise
    cylinders, bodies : (2, nc, 10) and (2, nb, 6) float, forces (see `evolvent.solvers.sampled`), of the start first
    samples : (nt,) float; stops : (ns,) float, times on which the loop lands and restarts
    R0, x0, R1, x1 : (nb, 3, 3) and (nb, 3) float, rotations and positions of the bodies at both ends of a step
    ends, end_times : (nt, 2, ny) and (nt, 2) float, s, of the steps with the samples, where reactions are evaluated
    log_t, log_k : (nh + ne,) float and int, s, times of latches and events; their hinges, and -1 - k of event k
    out_* : what is kept at the samples
    """

    options: np.record = record(OPTIONS)
    loop: np.record = record(LOOP)
    balance: np.record = record(BALANCE)
    row: np.ndarray = array(1)
    row0: np.ndarray = array(1)
    y: np.ndarray = array(1)
    y0: np.ndarray = array(1)
    spare: np.ndarray = array(1)
    a1: np.ndarray = array(1)
    a0: np.ndarray = array(1)
    dv1: np.ndarray = array(1)
    dv0: np.ndarray = array(1)
    loads1: np.ndarray = array(1)
    loads0: np.ndarray = array(1)
    la: np.ndarray = array(1)
    la0: np.ndarray = array(1)
    dq: np.ndarray = array(1)
    r: np.ndarray = array(1)
    x: np.ndarray = array(1)
    weight: np.ndarray = array(1)
    shares: np.ndarray = array(1)
    powers: np.ndarray = array(2)
    gaps: np.ndarray = array(1)
    energies: np.ndarray = array(1)
    impulse: np.ndarray = array(1)
    touched: np.ndarray = array(1)
    touches: np.ndarray = array(3)
    friction: np.ndarray = array(3)
    cylinders: np.ndarray = array(3)
    bodies: np.ndarray = array(3)
    R0: np.ndarray = array(3)
    R1: np.ndarray = array(3)
    x0: np.ndarray = array(2)
    x1: np.ndarray = array(2)
    ends: np.ndarray = array(3)
    end_times: np.ndarray = array(2)
    kept: np.ndarray = array(1)
    samples: np.ndarray = array(1)
    stops: np.ndarray = array(1)
    momenta: np.ndarray = array(1)
    log_t: np.ndarray = array(1)
    log_k: np.ndarray = array(1, np.int64)
    out_y: np.ndarray = array(2)
    out_s: np.ndarray = array(2, np.int64)
    out_a: np.ndarray = array(2)
    out_la: np.ndarray = array(2)
    out_balance: np.ndarray = array(2)
    out_momenta: np.ndarray = array(2)
    out_cylinders: np.ndarray = array(3)
    out_touches: np.ndarray = array(3)
    out_friction: np.ndarray = array(3)
    out_bodies: np.ndarray = array(3)


WORKSPACE = Workspace._numba_type_
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
    found = sparse_lu.factor(matrix)
    work.loop.factorizations += 1
    work.loop.quality = min(work.loop.quality, matrix.quality[0])
    return found


#: c_mass of a step too short to feel stiffness, times the square of a run's span.
SHORT = 1e16


@inlined
def short_c_mass(options):
    """c_mass of a step too short to feel stiffness."""
    return SHORT / (options.span * options.span)
