"""Steps of generalized-alpha as linear maps, kept while a run takes them, and their transposes (the adjoint).

Notes
-----
A step from z0 = (e0, v0, a0, d0) to z1, with e changes of the coordinates along increments of the state (of a free
body's attitude a turn in its axes), v velocities, a the algorithmic and d the true accelerations, is linear in the
change u of its increments but for the turns::

    e1 = T u + E e0,   v1 = r u + ...,   a1 = u/(beta h^2) + ...,   d1 = c u + ...          T = Jr(dq), E = exp(-dq)
    K e1 + C v1 + M d1 + G^T mu + R_p dp = 0,   G e1 + g_p dp = 0                           r, c: `alpha.rates`

K, C and M are kept, with R_p of each parameter. Backwards, with the derivatives (x, y, z, w) of a value by z1, the
transposed equations have one solution W for all parameters::

    (K T + r C + c M)^T W = T^T x + r y + z/(beta h^2) + c w,        dvalue -= W^T R_p dp

Steps that end on a latch, an event, a change of loads or the end of the run are kept as dense maps, which
`evolvent.solvers.adjoint` finds by neighbours.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types, void

from evolvent.compiled.jit import INTEGERS, MATRIX, REAL, VECTOR, indirect, inlined
from evolvent.compiled.pointer import Struct, array, at_address
from evolvent.flow.implicit import residual, tangent
from evolvent.kernels import coordinate, sparse, sparse_lu, user_events
from evolvent.kernels.blocks import RATE, ROTATION, displace
from evolvent.kernels.sparse import AT, BLOCK, COLUMN, COUNT, FIRST, SIZE, SPARSE, START, WIDTH
from evolvent.model import MODEL
from evolvent.solvers import alpha, implicit_loop, implicit_method as method
from evolvent.solvers.dense import interpolate
from evolvent.solvers.implicit_state import BUDGET, WORKSPACE
from evolvent.solvers.steps_beside import NONE, TOGETHER, TRIED, take_step

_I = types.int64
#: Numbers of a step in `Tape.numbers`: time and length, part of the algorithmic accelerations that it starts from,
#: scale of the constraints, and its samples, from the first up to another one.
TIME, LENGTH, PART, SCALE, FIRST_SAMPLE, END_SAMPLE, N_NUMBERS = range(7)
#: `Tape.counts`: steps that are kept, whether the time of the steps depends on the parameters, kind and latch of the
#: last step (`steps_beside.step_beside`).
STEPS, SHIFTED, KIND, LATCH, N_COUNTS = range(5)
#: Status of a tape that is full, before a step to a given time, and behind a step that is taken back to end on an
#: event.
FULL, LANDS, SEARCHES = 11, 12, 13
#: Change of time by which forces are derived, of a step; and sizes of changes by which samples are.
SHIFT, CHANGE = 1e-4, 1e-6
#: Corrections of a solution at most, and where they have converged.
MOST, CONVERGED = 12, 1e-14
_model_at = at_address(MODEL)


class Tape(Struct):
    """Steps that are kept: n at most.

    Attributes
    ----------
    counts : (N_COUNTS,) int; numbers : (n, N_NUMBERS) float
    y0, y1 : (n, ny) float, states at the ends; dq : (n, nv) float, increments
    K, C : (n, nz) float, values of the matrices, C times r, constraints times their scale
    M : (nz,) float, values of the mass matrix, which is constant
    rows : (n, parameters + 1, nv + nj) float, half the differences of the residuals of neighbours of each group of
        parameters, and the derivative by the time last
    r : (nv + nj,) float, scratch
    """

    counts: np.ndarray = array(1, np.int64)
    numbers: np.ndarray = array(2)
    y0: np.ndarray = array(2)
    y1: np.ndarray = array(2)
    dq: np.ndarray = array(2)
    K: np.ndarray = array(2)
    C: np.ndarray = array(2)
    M: np.ndarray = array(1)
    rows: np.ndarray = array(3)
    r: np.ndarray = array(1)


TAPE = Tape._numba_type_


# ------------------------------------------------------------------------------------------------ forwards


@inlined
def _add_residual(t, factor, scale, n, group, own, work, tape):
    """Add `factor` times the residual of a model at the end of the step, at time t, to a row of the tape."""
    n_v = own.info.nv
    residual(t, work.y, work.dv1, work.la, 0.0, 1.0, own, tape.r, work.powers[1])
    for i in range(tape.r.size):
        tape.rows[n, group, i] += factor * tape.r[i] * (1.0 if i < n_v else scale)


@inlined
def _keep_matrix(t, c_mass, c_rate, scale, model, room, work, values, less):
    """Values of the tangent into `values`, less those of `less`."""
    tangent(t, work.y, work.la, c_mass, c_rate, scale, model, room)
    for i in range(values.size):
        values[i] = room.values[i] - less[i]


@indirect(void(MODEL, WORKSPACE))
def note_start(model, work):
    """What records keep of the start of a step, of a state that has been changed."""
    t = work.loop.time
    if model.coordinates.size > 0:
        coordinate.note_turns(t, work.y, model.switches, model)
    if model.events.size > 0:
        user_events.note_values(t, work.y, model)
        for k in range(model.events.size):
            model.events[k].value = model.events[k].now


@indirect(void(REAL, REAL, REAL, _I, MODEL, WORKSPACE, TAPE, SPARSE, INTEGERS))
def keep_step(t0, part, h, first, model, work, tape, room, models):
    """Keep the step of length h from t0 that a run has taken.

    Parameters
    ----------
    part : float, of the algorithmic accelerations; first : int, its first sample
    room : SparseBlocks as the run's, scratch
    models : (2 groups,) int, addresses of the models of neighbours, at larger and smaller parameters
    """
    n, t = tape.counts[STEPS], t0 + h
    c_mass, c_rate = alpha.rates(h, work.options)
    scale, numbers = method.scale_of(h, work.options), tape.numbers[n]
    numbers[TIME], numbers[LENGTH], numbers[PART], numbers[SCALE] = t0, h, part, scale
    numbers[FIRST_SAMPLE], numbers[END_SAMPLE] = first, work.loop.sample
    for i in range(work.y.size):
        tape.y0[n, i], tape.y1[n, i] = work.y0[i], work.y[i]
    for i in range(work.dq.size):
        tape.dq[n, i] = work.dq[i]
    groups, shifted = len(models) // 2, tape.counts[SHIFTED] != 0
    for k in range(len(models)):
        own = _model_at(models[k])
        for i in range(model.switches.size):
            own.switches[i] = model.switches[i]
        if k % 2 == 0:
            for i in range(tape.r.size):
                tape.rows[n, k // 2, i] = 0.0
        _add_residual(t, 0.5 - (k % 2), scale, n, k // 2, own, work, tape)
    for i in range(tape.r.size):
        tape.rows[n, groups, i] = 0.0
    if shifted:
        for side in (1.0, -1.0):
            _add_residual(t + side * SHIFT * h, 0.5 * side / (SHIFT * h), scale, n, groups, model, work, tape)
    residual(t, work.y, work.dv1, work.la, 0.0, 1.0, model, tape.r, work.powers[1])
    for i in range(tape.K.shape[1]):
        tape.K[n, i] = 0.0
    _keep_matrix(t, 0.0, 0.0, scale, model, room, work, tape.K[n], tape.K[n])
    _keep_matrix(t, 0.0, c_rate, scale, model, room, work, tape.C[n], tape.K[n])
    if n == 0:
        _keep_matrix(t, c_mass, 0.0, scale, model, room, work, tape.M, tape.K[n])
        for i in range(tape.M.size):
            tape.M[i] /= c_mass
    tape.counts[STEPS] += 1


@indirect(_I(_I, MODEL, SPARSE, WORKSPACE, TAPE, SPARSE, INTEGERS))
def advance_keeping(budget, model, matrix, work, tape, room, models):
    """Go on for `budget` steps, and keep them; returns a status.

    That is one of `steps_beside.take_step`; `FULL` or `LANDS` before a step that is not taken yet; or `SEARCHES` behind
    one that has been taken back. `TOGETHER` where an event has come without a search.
    """
    loop, near = work.loop, 10.0 * work.options.smallest
    end = work.samples[work.samples.size - 1]
    for _ in range(budget):
        if tape.counts[STEPS] == tape.numbers.shape[0]:
            return FULL
        stops = loop.stop < work.stops.size and work.stops[loop.stop] < end - near
        target = work.stops[loop.stop] if stops else end
        _, lands = implicit_loop.step_length(target - loop.time, model, work)
        if lands and (stops or tape.counts[SHIFTED] != 0):
            return LANDS
        t0, steps, first, last = loop.time, loop.steps, loop.sample, loop.last
        code, tape.counts[KIND], tape.counts[LATCH] = take_step(model, matrix, work)
        if loop.steps > steps:
            if tape.counts[LATCH] != NONE:
                return TOGETHER
            keep_step(t0, min(loop.last / last, 1.0), loop.last, first, model, work, tape, room, models)
        elif tape.counts[LATCH] == TRIED and math.isfinite(loop.event_step) and code == BUDGET:
            return SEARCHES
        if code != BUDGET:
            return code
    return BUDGET


# ------------------------------------------------------------------------------------------------ backwards


@inlined
def _transpose(K, C, M, c_mass, matrix):
    """The transpose of K + C + c_mass M into a matrix."""
    sparse.clear(matrix)
    table, values = matrix.table, matrix.values
    for b in range(table.shape[0]):
        m, w, at = table[b, SIZE], table[b, WIDTH], table[b, AT]
        for r in range(m):
            for c in range(m):
                i = at + c * m + r
                values[at + r * m + c] = K[i] + C[i] + c_mass * M[i]
        upper, lower = at + m * m, at + m * m + m * w
        for i in range(m * w):
            values[upper + i] = K[lower + i] + C[lower + i] + c_mass * M[lower + i]
            values[lower + i] = K[upper + i] + C[upper + i] + c_mass * M[upper + i]


@inlined
def _multiply(values, matrix, x, out):
    """Product of the transpose of a matrix, given by its values, with x, by unknowns."""
    table, later, unknown = matrix.table, matrix.later, matrix.unknown
    for i in range(out.size):
        out[i] = 0.0
    for b in range(table.shape[0]):
        m, w, at, start = table[b, SIZE], table[b, WIDTH], table[b, AT], table[b, START]
        for r in range(m):
            i = unknown[start + r]
            for c in range(m):
                out[unknown[start + c]] += values[at + r * m + c] * x[i]
            for k in range(table[b, FIRST], table[b, FIRST] + table[b, COUNT]):
                first, column = table[later[k, BLOCK], START], later[k, COLUMN]
                for c in range(table[later[k, BLOCK], SIZE]):
                    j, entry = unknown[first + c], at + m * m + r * w + column + c
                    out[j] += values[entry] * x[i]
                    out[i] += values[entry + m * w] * x[j]


@inlined
def _turn_factors(x, y, z):
    """Factors a, b, c of [d]x and [d]x^2 in Jr(d) = 1 - a [d]x + b [d]x^2 and of both in exp(-d): 1 - c [d]x + a ..."""
    square = x * x + y * y + z * z
    if square < 1e-4:
        return (
            0.5 - square / 24.0 + square * square / 720.0, 1.0 / 6.0 - square / 120.0 + square * square / 5040.0,
            1.0 - square / 6.0 + square * square / 120.0,
        )  # fmt: skip
    angle = math.sqrt(square)
    return (
        (1.0 - math.cos(angle)) / square, (angle - math.sin(angle)) / (square * angle), math.sin(angle) / angle,
    )  # fmt: skip


@inlined
def _turn_transposed(dq, moves, model, x, out):
    """Out = T^T x, or E^T x if `moves`: of turns by dq, the same for all other coordinates."""
    blocks, n_q = model.blocks, model.info.nq
    for i in range(dq.size):
        out[i] = x[i]
    for k in range(blocks.size):
        if blocks[k].kind == ROTATION:
            at = blocks[k].iv - n_q
            a, b, c = dq[at], dq[at + 1], dq[at + 2]
            by_turn, by_square, by_sine = _turn_factors(a, b, c)
            first, second = (by_sine, by_turn) if moves else (by_turn, by_square)
            px, py, pz = x[at], x[at + 1], x[at + 2]  # [d]x^T = -[d]x
            ux, uy, uz = b * pz - c * py, c * px - a * pz, a * py - b * px
            wx, wy, wz = b * uz - c * uy, c * ux - a * uz, a * uy - b * ux
            out[at] += first * ux + second * wx
            out[at + 1] += first * uy + second * wy
            out[at + 2] += first * uz + second * wz


@inlined
def _turns(dq, model):
    """Whether a body turns freely in a step."""
    blocks, n_q, found = model.blocks, model.info.nq, False
    for k in range(blocks.size):
        at = blocks[k].iv - n_q
        found = found or (blocks[k].kind == ROTATION and (dq[at] != 0.0 or dq[at + 1] != 0.0 or dq[at + 2] != 0.0))
    return found


@inlined
def _solve_transposed(n, c_mass, tape, matrix, model, right, W, parts):
    """Solve (K T + C + c_mass M)^T W = right with the factors of the same without T; whether that converges.

    Then `parts` are K^T W, C^T W and M^T W.
    """
    n_v, size, turns = model.info.nv, right.size, _turns(tape.dq[n], model)
    r, turned, change, largest = parts[3], parts[4], 0.0, 0.0
    for i in range(size):
        W[i], r[i] = 0.0, right[i]
    for _ in range(MOST):
        largest = change = 0.0
        sparse_lu.solve(matrix, r)
        for i in range(size):
            W[i] += r[i]
            change, largest = max(change, abs(r[i])), max(largest, abs(W[i]))
        _multiply(tape.K[n], matrix, W, parts[0])
        _multiply(tape.C[n], matrix, W, parts[1])
        _multiply(tape.M, matrix, W, parts[2])
        if not turns or not change > CONVERGED * largest:
            return True
        _turn_transposed(tape.dq[n], False, model, parts[0], turned)
        for i in range(size):
            r[i] = right[i] - (turned[i] if i < n_v else parts[0, i]) - parts[1, i] - c_mass * parts[2, i]
    return change <= 1e-9 * largest


@indirect(_I(_I, _I, TAPE, SPARSE, MODEL, WORKSPACE, MATRIX, MATRIX, MATRIX, MATRIX))
def pull_back(first, last, tape, matrix, model, work, derivatives, found, parts, vectors):
    """Take derivatives of values by the state at the end of step `last` back to the start of step `first`.

    Parameters
    ----------
    matrix : scratch; work : Workspace, of the method's constants
    derivatives : (values, 4 nv + 1) float, by (e, v, a, d) and the time by which the steps are shifted
    found : (values (groups + 1), nv + nj) float, to which products of W and the rows are added
    parts : (5, nv + nj) float, scratch; vectors : (2, nv + nj) float, scratch

    Returns
    -------
    int, the number of steps that are left where one is singular; -1 where all are done
    """
    options, n_v, groups = work.options, model.info.nv, tape.rows.shape[1]
    am, af, beta, gamma = options.alpha_m, options.alpha_f, options.beta, options.gamma
    k, half = (1.0 - am) / (1.0 - af), 1.0 / (2.0 * beta) - 1.0
    right, W = vectors[0], vectors[1]
    for n in range(last, first - 1, -1):
        h, part = tape.numbers[n, LENGTH], tape.numbers[n, PART]
        c_mass, c_rate = alpha.rates(h, options)
        c_step = 1.0 / (beta * h * h)
        _transpose(tape.K[n], tape.C[n], tape.M, c_mass, matrix)
        if sparse_lu.factor(matrix) != 0:
            return n + 1
        for q in range(derivatives.shape[0]):
            x, y = derivatives[q, :n_v], derivatives[q, n_v : 2 * n_v]
            z, w = derivatives[q, 2 * n_v : 3 * n_v], derivatives[q, 3 * n_v : 4 * n_v]
            _turn_transposed(tape.dq[n], False, model, x, parts[4])
            for i in range(right.size):
                right[i] = parts[4, i] + c_rate * y[i] + c_step * z[i] + c_mass * w[i] if i < n_v else 0.0
            if not _solve_transposed(n, c_mass, tape, matrix, model, right, W, parts):
                return n + 1
            for g in range(groups):
                for i in range(right.size):
                    found[q * groups + g, i] += W[i] * tape.rows[n, g, i]
            for i in range(right.size):
                derivatives[q, 4 * n_v] -= W[i] * tape.rows[n, groups - 1, i]
            for i in range(n_v):
                x[i] -= parts[0, i]
                y[i] -= parts[1, i] / c_rate
                w[i] -= parts[2, i]
            _turn_transposed(tape.dq[n], True, model, x, parts[4])
            for i in range(n_v):
                x[i] = parts[4, i]
                yi, zi, wi = y[i], z[i], w[i]
                y[i] = (1.0 - gamma / beta) * yi - (zi + k * wi) / (beta * h)
                a = h * (1.0 - gamma - gamma * half) * yi - half * zi + (am / (1.0 - af) - k * half) * wi
                z[i] = part * a
                w[i] = (1.0 - part) * a - af / (1.0 - af) * wi
    return -1


@inlined
def _along(difference, y, seed, model):
    """Product of a difference of two states near y, with the derivatives by changes of its coordinates and rates."""
    blocks, n_q, n_v, found = model.blocks, model.info.nq, model.info.nv, 0.0
    for k in range(blocks.size):
        q, v, at = blocks[k].iq, blocks[k].iv, blocks[k].iv - n_q
        for i in range(blocks[k].count):
            found += seed[n_v + at + i] * difference[v + i]
        if blocks[k].kind == ROTATION:  # twice the vector of the conjugate of y times the difference
            a, b, c, d = y[q], y[q + 1], y[q + 2], y[q + 3]
            p, r, s, u = difference[q], difference[q + 1], difference[q + 2], difference[q + 3]
            found += 2.0 * seed[at] * (a * r - b * p - c * u + d * s)
            found += 2.0 * seed[at + 1] * (a * s - c * p - d * r + b * u)
            found += 2.0 * seed[at + 2] * (a * u - d * p - b * s + c * r)
        elif blocks[k].kind != RATE:
            for i in range(blocks[k].count):
                found += seed[at + i] * difference[q + i]
    return found


@indirect(void(REAL, REAL, VECTOR, VECTOR, VECTOR, MODEL, MATRIX, VECTOR, VECTOR, VECTOR))
def pull_back_sample(theta, h, y0, y1, seed, model, states, move, start, end):
    """Add to derivatives by the ends of a step those of a value by a sample between them.

    Parameters
    ----------
    theta : float, part of the step of length h
    seed : (2 nv,) float, derivatives by coordinates and rates at the sample
    states : (4, ny) float, scratch; move : (nv,) float, scratch
    start, end : (4 nv + 1,) float, as of `pull_back`
    """
    n_q, n_v = model.info.nq, model.info.nv
    at, up, down, moved = states[0], states[1], states[2], states[3]
    interpolate(theta, h, y0, y1, model, at)
    for i in range(n_v):
        move[i] = 0.0
    for side in range(2):
        own, to = (y0, start) if side == 0 else (y1, end)
        for j in range(2 * n_v):
            for sign in (1.0, -1.0):
                out = up if sign > 0.0 else down
                for i in range(own.size):
                    moved[i] = own[i]
                if j < n_v:
                    move[j] = sign * CHANGE
                    displace(own, move, False, model, moved)
                    move[j] = 0.0
                else:
                    moved[n_q + j - n_v] += sign * CHANGE / h
                if side == 0:
                    interpolate(theta, h, moved, y1, model, out)
                else:
                    interpolate(theta, h, y0, moved, model, out)
            for i in range(at.size):
                up[i] -= down[i]
            to[j] += _along(up, at, seed, model) / (2.0 * CHANGE if j < n_v else 2.0 * CHANGE / h)
    if theta < 1.0:  # at a given time
        d = min(1e-4, 0.5 * theta, 0.5 * (1.0 - theta))
        interpolate(theta + d, h, y0, y1, model, up)
        interpolate(theta - d, h, y0, y1, model, down)
        for i in range(at.size):
            up[i] -= down[i]
        start[4 * n_v] -= _along(up, at, seed, model) / (2.0 * d * h)
