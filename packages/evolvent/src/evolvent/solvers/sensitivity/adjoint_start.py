"""The start of a run by generalized-alpha as a linear map of parameters, and its transpose.

Notes
-----
The start (`evolvent.solvers.time.implicit.alpha_start`) follows from accelerations and multipliers x = (A, la) that fit
a state, R(x; state, p) = 0: equations of motion, and g'' = 0 of the constraints that hold. With H = R_x, which is the
mass matrix M and the gradient G of the constraints::

    R(x0; y) = 0,   R(x+; y+) = 0,   R(x-; y-) = 0        y+, y-: along the motion, by times d and -d from A
    J = (A+ - A-)/(2 d),   I = c J + w x A/12             w x A: of turns
    M N = G^T mu,   G N = G I                             the part of I that leaves the constraints
    d = A,   a = A + s h J,   v += h^2 N

Backwards, each of these has one transposed solution L for all parameters, of which the derivatives are -L^T R_p: first
that of N, then those of x+ and x-, whose states give derivatives by A, and that of x0 last. Constraints enter by g'',
the central difference of g' along the motion, which is derived by A where the states follow from it.
"""

from __future__ import annotations

import numpy as np
from numba import types

from evolvent.algebra import sparse_lu
from evolvent.algebra.sparse import AT, BLOCK, COLUMN, COUNT, FIRST, SIZE, SPARSE, START, WIDTH
from evolvent.compiled.jit import INTEGERS, MATRIX, indirect, inlined
from evolvent.compiled.pointer import Struct, array, at_address
from evolvent.equations.implicit import residual, tangent
from evolvent.kernels import constraints
from evolvent.kernels.blocks import ROTATION, displace
from evolvent.kernels.rotations import cross
from evolvent.model import MODEL
from evolvent.solvers.sensitivity.transposed import LINEAR, multiply, transpose, turn_transposed
from evolvent.solvers.time.implicit.alpha_start import JERK, accelerations_at, find_second_rates
from evolvent.solvers.time.implicit.alpha_tangent import short_c_mass
from evolvent.solvers.time.implicit.workspace import WORKSPACE

_I = types.int64
#: Change of a coordinate by which g'' is differentiated, relative to its size.
MOVE = 1e-3
#: Rows of `Start.scratch`.
Z, N, MU, J, FREE, RIGHT, L, OUT, TURNED, N_ROWS = range(10)
_model_at = at_address(MODEL)


class Start(Struct):
    """A start, and scratch memory.

    Attributes
    ----------
    y : (ny,) float, state with which the run starts; A : (nv,) float; la : (nj,) float
    starts : (colours + 1,) int, columns : (n,) int, coordinates of each colour, of which no two are in one constraint
    first : (n + 1,) int, rows : (m,) int, unknowns of the multipliers of constraints of each of these columns
    near : (3, ny) float, states beside it, and scratch
    beside : (2, nv + nj) float, accelerations and multipliers there
    back : (values, nv) float, derivatives by A; jerk : (values, nv) float, by J
    scratch : (N_ROWS, nv + nj) float
    """

    y: np.ndarray = array(1)
    A: np.ndarray = array(1)
    la: np.ndarray = array(1)
    starts: np.ndarray = array(1, np.int64)
    columns: np.ndarray = array(1, np.int64)
    first: np.ndarray = array(1, np.int64)
    rows: np.ndarray = array(1, np.int64)
    near: np.ndarray = array(2)
    beside: np.ndarray = array(2)
    back: np.ndarray = array(2)
    jerk: np.ndarray = array(2)
    scratch: np.ndarray = array(2)


RUN_START = Start._numba_type_


@inlined
def _holds(t, k, model):
    return model.constraints[k].stiffness <= 0.0 and constraints.holds(t, model.constraints, k)


@inlined
def _equations(t, y, A, la, bends, model, work, moved, out):
    """R of a state, without g'' unless `bends`."""
    n_v = model.info.nv
    if bends:
        find_second_rates(t, y, A, model, work, moved, out)
    residual(t, y, A, la, 0.0, 1.0, model, work.r, work.powers[0])
    for i in range(work.r.size):
        if i < n_v or not _holds(t, i - n_v, model):
            out[i] = work.r[i]
        elif not bends:
            out[i] = 0.0


@inlined
def _add_rows(t, y, A, la, less, part, model, models, work, start, linear):
    """Evaluate R_p of each group into `linear.rows`; if `part`, g'' is that of A less that of `less`."""
    groups, rows, out, free = linear.sides.size, linear.rows, start.scratch[OUT], start.scratch[FREE]
    n_v, size = model.info.nv, start.scratch[OUT].size
    for g in range(groups):
        for side in range(3):
            if side == 1 and linear.sides[g] == 1:
                continue
            if side == 2 and linear.sides[g] == 2:
                continue
            own = model
            if side < 2:
                own = _model_at(models[2 * g + side])
            _equations(t, y, A, la, True, own, work, start.near[2], out)
            if part:
                find_second_rates(t, y, less, own, work, start.near[2], free)
                for i in range(n_v, size):
                    if _holds(t, i - n_v, model):
                        out[i] -= free[i]
            for i in range(size):
                if side == 0:
                    rows[g, i] = out[i]
                else:
                    rows[g, i] = 0.5 * (rows[g, i] - out[i]) if side == 1 else rows[g, i] - out[i]
        for i in range(size):
            if rows[g, i] != 0.0:
                linear.changes[g, i] = 1


@inlined
def _find_matrix(t, y, A, la, turned, model, work, room, matrix, linear):
    """H, scaled, into `linear.A`, and its factors, transposed if `turned`; returns 0 where it is not singular."""
    c_mass, n_v, A_values = short_c_mass(work.options), model.info.nv, linear.A
    scale = c_mass * work.options.mass
    residual(t, y, A, la, 0.0, 1.0, model, work.r, work.powers[0])
    model.info.compliance = 1.0 / scale
    tangent(t, y, la, 0.0, 0.0, scale, model, room)
    table, later, unknown = room.table, room.later, room.unknown
    for i in range(A_values.size):
        A_values[i] = 0.0
    for b in range(table.shape[0]):
        m, w, at, first = table[b, SIZE], table[b, WIDTH], table[b, AT], table[b, START]
        for r in range(m):
            for c in range(m):
                i, j = unknown[first + r], unknown[first + c]
                if j >= n_v or (i >= n_v and _holds(t, i - n_v, model)):
                    A_values[at + r * m + c] = room.values[at + r * m + c]
        for p in range(table[b, FIRST], table[b, FIRST] + table[b, COUNT]):
            other, column = table[later[p, BLOCK], START], later[p, COLUMN]
            for r in range(m):
                i, entry = unknown[first + r], at + m * m + r * w + column
                for c in range(table[later[p, BLOCK], SIZE]):
                    j = unknown[other + c]
                    if j >= n_v or (i >= n_v and _holds(t, i - n_v, model)):
                        A_values[entry + c] = room.values[entry + c]
                    if i >= n_v or (j >= n_v and _holds(t, j - n_v, model)):
                        A_values[entry + c + m * w] = room.values[entry + c + m * w]
    for k in range(linear.M.size):
        A_values[linear.places[k, 2]] += c_mass * linear.M[k]
    if turned:
        transpose(A_values, matrix)
    else:
        for i in range(A_values.size):
            matrix.values[i] = A_values[i]
    return sparse_lu.factor(matrix)


@inlined
def _pull(t, back, model, work, matrix, linear, start, found, q):
    """L of derivatives by accelerations, into `start.scratch[L]`; add its products with rows of groups to `found`."""
    n_v, x, groups = model.info.nv, start.scratch[L], linear.sides.size
    c_mass = short_c_mass(work.options)
    scale = c_mass * work.options.mass
    for i in range(x.size):
        x[i] = c_mass * back[i] if i < n_v else 0.0
    sparse_lu.solve(matrix, x)
    for i in range(n_v, x.size):
        x[i] *= scale / c_mass if _holds(t, i - n_v, model) else scale
    for g in range(groups):
        for i in range(x.size):
            found[q * groups + g, i] += x[i] * linear.rows[g, i]


@inlined
def _find_start(t, model, work, room, matrix, linear, start):
    """The states beside the start with their accelerations, and J, N and mu; 0 where no matrix is singular."""
    n_q, n_v, options, rows, y, A = model.info.nq, model.info.nv, work.options, start.scratch, start.y, start.A
    c_mass = short_c_mass(options)
    singular = _find_matrix(t, y, A, start.la, False, model, work, room, matrix, linear)
    if singular != 0:
        return singular
    d, shift = JERK * options.span, options.alpha_m - options.alpha_f
    for i in range(rows.shape[1]):
        rows[J, i] = 0.0
    for side in range(2):
        B, la = start.beside[side, :n_v], start.beside[side, n_v:]
        for i in range(n_v):
            work.dq[i], B[i] = d * y[n_q + i] + 0.5 * d * d * A[i], A[i]
        for k in range(la.size):
            la[k] = start.la[k]
        for i in range(y.size):
            start.near[side, i] = y[i]
        displace(y, work.dq, False, model, start.near[side])
        for i in range(n_v):
            start.near[side, n_q + i] += d * A[i]
        accelerations_at(t + d, start.near[side], -1.0, False, model, matrix, work, B, la)
        for i in range(n_v):
            rows[J, i] += B[i] / (2.0 * d)
        d = -d
    c, blocks, free = 1.0 / 6.0 - 0.5 * shift - options.beta, model.blocks, rows[FREE]
    for i in range(n_v):
        rows[Z, i] = c * rows[J, i]
    for k in range(blocks.size):
        if blocks[k].kind == ROTATION:
            q, at = blocks[k].iv, blocks[k].iv - n_q
            ux, uy, uz = cross(y[q], y[q + 1], y[q + 2], A[at], A[at + 1], A[at + 2])
            rows[Z, at] += ux / 12.0
            rows[Z, at + 1] += uy / 12.0
            rows[Z, at + 2] += uz / 12.0
    for i in range(free.size):
        free[i] = 0.0
    for k in range(linear.M.size):
        free[linear.places[k, 0]] += linear.M[k] * rows[Z, linear.places[k, 1]]
    sparse_lu.solve(matrix, free)
    for i in range(n_v):
        rows[N, i] = rows[Z, i] - c_mass * free[i]
    for k in range(start.la.size):
        rows[MU, k] = c_mass * options.mass * free[n_v + k]
    return 0


@inlined
def _pull_beside(t, side, d, model, models, work, room, matrix, linear, start, found):
    """Take derivatives by J back through the state beside the start, by the time d, to those by A."""
    n_q, n_v, n_values, rows = model.info.nq, model.info.nv, start.back.shape[0], start.scratch
    y, B, la = start.near[side], start.beside[side, :n_v], start.beside[side, n_v:]
    K, out, x, moved, right = linear.K, rows[OUT], rows[L], start.near[2], rows[RIGHT]
    _add_rows(t + d, y, B, la, B, False, model, models, work, start, linear)
    singular = _find_matrix(t + d, y, B, la, True, model, work, room, matrix, linear)
    if singular != 0:
        return singular
    for i in range(K.size):
        K[i] = room.values[i]
    if linear.rated.size > 0:
        tangent(t + d, y, la, 0.0, 1.0, 1.0, model, room)
        rates = room.values
        for i in range(K.size):
            linear.A[i] = rates[i]
        tangent(t + d, y, la, 0.0, 0.0, 1.0, model, room)
        for i in range(K.size):
            linear.A[i] -= room.values[i]
    for q in range(n_values):
        for i in range(n_v):
            right[i] = start.jerk[q, i] / (2.0 * d)
        _pull(t + d, right, model, work, matrix, linear, start, found, q)
        for i in range(x.size):
            right[i] = x[i] if i < n_v else 0.0
            if i >= n_v and not _holds(t + d, i - n_v, model):
                right[i] = 0.0
        multiply(K, room, right, out)
        for i in range(n_v):
            work.dq[i] = d * start.y[n_q + i] + 0.5 * d * d * start.A[i]
        turn_transposed(work.dq, False, model, out, rows[TURNED])
        for i in range(n_v):
            start.back[q, i] -= 0.5 * d * d * rows[TURNED, i]
        if linear.rated.size > 0:
            multiply(linear.A, room, right, out)
            for i in range(n_v):
                start.back[q, i] -= d * out[i]
        for k in range(start.starts.size - 1):
            for i in range(n_v):
                rows[TURNED, i] = 0.0
            for turn in range(2):
                side_of = 1.0 if turn == 0 else -1.0
                for p in range(start.starts[k], start.starts[k + 1]):
                    j = start.columns[p]
                    rows[TURNED, j] = side_of * MOVE * work.weight[j] / abs(d * work.loop.step)
                for i in range(n_v):
                    work.dq[i] = d * start.y[n_q + i] + 0.5 * d * d * (start.A[i] + rows[TURNED, i])
                for i in range(y.size):
                    y[i] = start.y[i]
                displace(start.y, work.dq, False, model, y)
                for i in range(n_v):
                    y[n_q + i] = start.y[n_q + i] + d * (start.A[i] + rows[TURNED, i])
                find_second_rates(t + d, y, B, model, work, moved, out)
                for p in range(start.starts[k], start.starts[k + 1]):
                    j = start.columns[p]
                    for e in range(start.first[p], start.first[p + 1]):
                        i = start.rows[e]
                        if _holds(t + d, i - n_v, model):
                            start.back[q, j] -= x[i] * out[i] / (2.0 * rows[TURNED, j])
    return 0


@indirect(_I(MODEL, INTEGERS, WORKSPACE, SPARSE, SPARSE, LINEAR, RUN_START, MATRIX, MATRIX))
def pull_back_start(model, models, work, room, matrix, linear, start, derivatives, found):
    """Take derivatives by the start of the first step back to parameters.

    Parameters
    ----------
    model : Model, as the run's before it starts
    models : (2 groups,) int, as of `recorded_steps.pull_back`
    work : Workspace, scratch, with the time and step of the start, and whether it resolves v'' (`LOOP.resolves`)
    room, matrix : SparseBlocks as the run's, scratch
    derivatives : (values, m) float, by (e, v, a, d)
    found : (values groups, nv + nj) float, to which products of solutions and the rows are added

    Returns
    -------
    int, 0; another number where a matrix is singular
    """
    n_q, n_v, t, h, options = model.info.nq, model.info.nv, work.loop.time, work.loop.step, work.options
    rows, y, A, blocks, shift = start.scratch, start.y, start.A, model.blocks, options.alpha_m - options.alpha_f
    n_values, resolves = derivatives.shape[0], work.loop.resolves > 0
    for q in range(n_values):
        for i in range(n_v):
            start.back[q, i] = derivatives[q, 2 * n_v + i] + derivatives[q, 3 * n_v + i]
            start.jerk[q, i] = shift * h * derivatives[q, 2 * n_v + i]
    if resolves:
        singular = _find_start(t, model, work, room, matrix, linear, start)
        if singular != 0:
            return singular
        singular = _find_matrix(t, y, A, start.la, True, model, work, room, matrix, linear)
        if singular != 0:
            return singular
        scale, c = short_c_mass(options) * options.mass, 1.0 / 6.0 - 0.5 * shift - options.beta
        for i in range(n_v):
            rows[N, i] = A[i] - rows[N, i]
        for k in range(start.la.size):
            rows[MU, k] += start.la[k]
        for i in range(n_v):
            rows[TURNED, i] = A[i] - rows[Z, i]
        if start.la.size > 0:
            _add_rows(
                t, y, rows[N, :n_v], rows[MU, : start.la.size], rows[TURNED, :n_v], True, model, models, work, start,
                linear,
            )  # fmt: skip
        for q in range(n_values if start.la.size > 0 else 0):
            right, x, out = rows[RIGHT], rows[L], rows[OUT]
            for i in range(n_v):
                right[i] = -h * h * derivatives[q, n_v + i]
                start.back[q, i] -= right[i]
            _pull(t, right, model, work, matrix, linear, start, found, q)
            for i in range(x.size):
                right[i] = 0.0
                if i >= n_v and _holds(t, i - n_v, model):
                    right[i] = -x[i] / scale
            multiply(linear.A, room, right, out)  # G^T of L
            for i in range(n_v):
                start.back[q, i] -= out[i]
                start.jerk[q, i] += c * out[i]
            for k in range(blocks.size):
                if blocks[k].kind == ROTATION:
                    p, at = blocks[k].iv, blocks[k].iv - n_q
                    ux, uy, uz = cross(out[at], out[at + 1], out[at + 2], y[p], y[p + 1], y[p + 2])
                    start.back[q, at] += ux / 12.0
                    start.back[q, at + 1] += uy / 12.0
                    start.back[q, at + 2] += uz / 12.0
        d = JERK * options.span
        for side in range(2):
            singular = _pull_beside(t, side, d, model, models, work, room, matrix, linear, start, found)
            if singular != 0:
                return singular
            d = -d
    _add_rows(t, y, A, start.la, A, False, model, models, work, start, linear)
    singular = _find_matrix(t, y, A, start.la, True, model, work, room, matrix, linear)
    if singular != 0:
        return singular
    for q in range(n_values):
        _pull(t, start.back[q], model, work, matrix, linear, start, found, q)
    return 0
