"""Transposed solutions of steps: the matrices of a step, and factors that serve many steps.

The matrix of a step of the run, A = K T + c_rate C + c_mass M, differs little from that of the next step, which the
pass back has solved before, and so does the solution. The solution is therefore extrapolated from those of the next
steps, and corrected iteratively by the transposed factors of a later step, until corrections are round-off. A is not
assembled for this: its product follows from those of K, C and M. A step is factored again where that takes less work
than the corrections have taken.
"""

from __future__ import annotations

import math

import numpy as np

from evolvent.algebra import sparse, sparse_lu
from evolvent.algebra.sparse import AT, BLOCK, COLUMN, COUNT, FIRST, SIZE, START, WIDTH
from evolvent.compiled.jit import inlined
from evolvent.compiled.pointer import Struct, array
from evolvent.kernels.blocks import ROTATION
from evolvent.kernels.rotations import cross
from evolvent.solvers.sensitivity.windows import multiply_columns

#: Corrections of a solution at most, where they have converged, and below which they may be round-off.
MOST, CONVERGED, ROUNDED = 16, 1e-11, 1e-9
#: Steps after which the contraction rate of the corrections is measured again; and weights of the solutions of the next
#: steps, the nearest first, by which the solution of a step is extrapolated from one, two or three of them.
REMEASURE, PREDICTION = 16, ((1.0, 0.0, 0.0), (2.0, -1.0, 0.0), (3.0, -3.0, 1.0))
#: What the next correction may leave beside what the rate of the last two says.
SAFE = 10.0
#: `Linear.pace`: work of a factorisation, in corrections; those that fresh factors take, of one value; those of the
#: steps since, beyond these; steps since, 0 where there are no factors; steps for which each is factored; contraction
#: rate of the corrections; steps since it was measured; and number of the next steps whose solutions are known.
FACTOR, FRESH, BEYOND, SINCE, EACH, CONTRACTION, RATE_AGE, N_BEFORE, N_PACE = 0, 1, 2, 3, 4, 5, 6, 7, 8
#: Rows of `Linear.parts`.
BY_STATE, BY_RATE, BY_MASS, RESIDUAL, PRODUCT, TURNED, N_PARTS = 0, 1, 2, 3, 4, 5, 6
#: Flops of a factorisation, done in long sums, in the time of one of a solution; time of one block beside its flops, in
#: these: of a factorisation by the square of its size, and of a correction.
FASTER, BY_SQUARE, BY_BLOCK = 1.5, 55.0, 130.0
#: Steps that are each factored before corrections are tried again.
TRIED_AGAIN = 64.0


class Linear(Struct):
    """A step as a linear map, and scratch memory.

    Attributes
    ----------
    A, K : (nz,) float, values of the matrix of the step, and of the derivatives by coordinates, constraints times their
        scale
    M : (n,) float, entries of the mass matrix, and places : (n, 3) int, their rows, columns and indices in the values
    turned : (n, 5) int, columns of K by turns of a body, entry after entry: first coordinate of the turn, index of the
        first entry, from one column to the next, from one entry to the next, and number of entries
    steady, rated : (n,) int, slots of tangents without and with derivatives by rates
    rows : (groups + 1, nv + nj) float, the residual of neighbours of each group of parameters less that of the run, or
        half the difference of both sides; and the derivative by the time last
    changes : (groups, nv + nj) int, 1 where rows have been other than 0
    sides : (groups,) int, how many neighbours are evaluated
    r, right : (nv + nj,) float; W : (values, nv + nj) float, solutions
    before : (3, values, nv + nj) float, solutions of the next steps, the nearest first
    parts : (N_PARTS, nv + nj) float, products of the transposes of K, C and M with the solution, residual of the
        solution, and scratch
    pace : (N_PACE,) float
    """

    A: np.ndarray = array(1)
    K: np.ndarray = array(1)
    M: np.ndarray = array(1)
    places: np.ndarray = array(2, np.int64)
    turned: np.ndarray = array(2, np.int64)
    steady: np.ndarray = array(1, np.int64)
    rated: np.ndarray = array(1, np.int64)
    rows: np.ndarray = array(2)
    changes: np.ndarray = array(2, np.int64)
    sides: np.ndarray = array(1, np.int64)
    r: np.ndarray = array(1)
    right: np.ndarray = array(1)
    W: np.ndarray = array(2)
    before: np.ndarray = array(3)
    parts: np.ndarray = array(2)
    pace: np.ndarray = array(1)


LINEAR = Linear._numba_type_


def work_of_factors(matrix):
    """Work of a factorisation beside that of a correction, of a solution and a product."""
    m, w = (matrix.table[:, column].astype(float) for column in (SIZE, WIDTH))
    factors = np.sum((2.0 / 3.0 * m**3 + 2.0 * m * m * w + 2.0 * m * w * w) / FASTER + BY_SQUARE * m * m)
    return float(factors / np.sum(4.0 * (m * m + 2.0 * m * w) + BY_BLOCK))


def entries_of(values, matrix):
    """Entries other than zero of a matrix, by its values: (n,) float; and (n, 3) int, rows, columns and indices."""
    rows, columns = (np.zeros(values.size, dtype=np.int64) for _ in range(2))
    for row in matrix.table:
        m, w, at = row[SIZE], row[WIDTH], row[AT]
        own = matrix.unknown[row[START] : row[START] + m]
        beside = matrix.later[row[FIRST] : row[FIRST] + row[COUNT], BLOCK]
        others = [matrix.unknown[one[START] : one[START] + one[SIZE]] for one in matrix.table[beside]]
        later = np.concatenate([*others, np.zeros(0, dtype=np.int64)])
        rows[at : at + m * m], columns[at : at + m * m] = np.repeat(own, m), np.tile(own, m)
        upper, lower = slice(at + m * m, at + m * m + m * w), slice(at + m * m + m * w, at + m * m + 2 * m * w)
        rows[upper] = columns[lower] = np.repeat(own, w)
        columns[upper] = rows[lower] = np.tile(later, m)
    found = np.flatnonzero(values)
    return values[found], np.stack([rows[found], columns[found], found], axis=1)


def columns_of(equations, matrix):
    """Possible entries of a matrix by columns (compressed sparse columns).

    Parameters
    ----------
    equations : (n,) list of (m,) int, equations in which each unknown occurs
    matrix : SparseBlocks

    Returns
    -------
    first : (n + 1,) int, first entry of each column
    rows, places : (nk,) int, row of each entry, and its index in the values of the matrix
    """
    _, places = entries_of(np.ones(matrix.values.size), matrix)
    n = len(equations)
    known = np.concatenate([*(own * n + j for j, own in enumerate(equations)), np.zeros(0, dtype=np.int64)])
    places = places[np.isin(places[:, 0] * n + places[:, 1], known)]
    places = places[np.lexsort((places[:, 0], places[:, 1]))]
    first = np.searchsorted(places[:, 1], np.arange(n + 1))
    return first, np.ascontiguousarray(places[:, 0]), np.ascontiguousarray(places[:, 2])


def turned_of(model, matrix):
    """Columns of a matrix by turns of bodies, as of `Linear.turned`: (n, 5) int."""
    found, table = [], matrix.table
    for at in (model.blocks["iv"][model.blocks["kind"] == ROTATION] - int(model.info.nq)).tolist():
        places = matrix.place[at : at + 3]
        b = int(matrix.block[places[0]])
        m, w, first = table[b, SIZE], table[b, WIDTH], places[0] - table[b, START]
        if np.any(np.diff(places) != 1) or first + 3 > m:
            raise ValueError("turns of a body are not next to one another in a block of the matrix")
        found.append((at, table[b, AT] + first, 1, m, m))
        found.append((at, table[b, AT] + m * m + m * w + first * w, w, 1, w))
        for before in np.flatnonzero(table[:b, COUNT]):
            row = table[before]
            entries = matrix.later[row[FIRST] : row[FIRST] + row[COUNT]]
            for column in entries[entries[:, BLOCK] == b, COLUMN]:
                start = row[AT] + row[SIZE] ** 2 + column + first
                found.append((at, start, 1, row[WIDTH], row[SIZE]))
    return np.array(found, dtype=np.int64).reshape(-1, 5)


@inlined
def transpose(S, matrix):
    """The transpose of a matrix, by its values, into a matrix."""
    sparse.clear(matrix)
    table, values = matrix.table, matrix.values
    for b in range(table.shape[0]):
        m, w, at = table[b, SIZE], table[b, WIDTH], table[b, AT]
        for r in range(m):
            for c in range(m):
                values[at + r * m + c] = S[at + c * m + r]
        upper, lower = at + m * m, at + m * m + m * w
        for i in range(m * w):
            values[upper + i], values[lower + i] = S[lower + i], S[upper + i]


@inlined
def multiply(S, matrix, x, out):
    """Out = product of the transpose of a matrix, by its values, with x, by unknowns."""
    table, later, unknown = matrix.table, matrix.later, matrix.unknown
    for i in range(x.size):
        out[i] = 0.0
    for b in range(table.shape[0]):
        m, w, at, start = table[b, SIZE], table[b, WIDTH], table[b, AT], table[b, START]
        for c in range(m):
            total = 0.0
            for r in range(m):
                total += S[at + r * m + c] * x[unknown[start + r]]
            out[unknown[start + c]] += total
        for p in range(table[b, FIRST], table[b, FIRST] + table[b, COUNT]):
            first, column = table[later[p, BLOCK], START], later[p, COLUMN]
            for r in range(m):
                i = unknown[start + r]
                xi, total, entry = x[i], 0.0, at + m * m + r * w + column
                for c in range(table[later[p, BLOCK], SIZE]):
                    j = unknown[first + c]
                    out[j] += S[entry] * xi
                    total += S[entry + m * w] * x[j]
                    entry += 1
                out[i] += total


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
def apply_rotation(at, p, kept, first, second, x, out):
    """Write kept x + first p x x + second p x (p x x) to out, for the three coordinates from index `at` on."""
    a, b, c = p
    ux, uy, uz = cross(a, b, c, x[at], x[at + 1], x[at + 2])
    wx, wy, wz = cross(a, b, c, ux, uy, uz)
    out[at] = kept * x[at] + first * ux + second * wx
    out[at + 1] = kept * x[at + 1] + first * uy + second * wy
    out[at + 2] = kept * x[at + 2] + first * uz + second * wz


@inlined
def turn_transposed(dq, moves, model, x, out):
    """Out = T^T x, or E^T x if `moves`: of turns by dq, the same for all other coordinates."""
    blocks, n_q = model.blocks, model.info.nq
    for i in range(dq.size):
        out[i] = x[i]
    for k in range(blocks.size):
        if blocks[k].kind == ROTATION:
            at = blocks[k].iv - n_q
            d = dq[at], dq[at + 1], dq[at + 2]
            by_turn, by_square, by_sine = _turn_factors(*d)
            apply_rotation(at, d, 1.0, by_sine if moves else by_turn, by_turn if moves else by_square, x, out)


@inlined
def add_mass_and_turns(dq, c_mass, linear):
    """Add K (T - 1) and c_mass M to A, of turns by dq."""
    A, K, turned = linear.A, linear.K, linear.turned
    before, xx, xy, xz, yx, yy, yz, zx, zy, zz = -1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(turned.shape[0]):
        at, first, beside, step, count = turned[k, 0], turned[k, 1], turned[k, 2], turned[k, 3], turned[k, 4]
        if at != before:
            a, b, c = dq[at], dq[at + 1], dq[at + 2]
            by_turn, by_square, _ = _turn_factors(a, b, c)
            xx, yy, zz = -by_square * (b * b + c * c), -by_square * (a * a + c * c), -by_square * (a * a + b * b)
            xy, yx = by_square * a * b + by_turn * c, by_square * a * b - by_turn * c
            xz, zx = by_square * a * c - by_turn * b, by_square * a * c + by_turn * b
            yz, zy = by_square * b * c + by_turn * a, by_square * b * c - by_turn * a
            before = at
        for n in range(count):
            i = first + n * step
            x, y, z = K[i], K[i + beside], K[i + 2 * beside]
            A[i] += x * xx + y * yx + z * zx
            A[i + beside] += x * xy + y * yy + z * zy
            A[i + 2 * beside] += x * xz + y * yz + z * zz
    for k in range(linear.M.size):
        A[linear.places[k, 2]] += c_mass * linear.M[k]


@inlined
def multiply_mass(linear, x, out):
    """Out = transpose of the mass matrix times x."""
    for i in range(x.size):
        out[i] = 0.0
    for k in range(linear.M.size):
        out[linear.places[k, 1]] += linear.M[k] * x[linear.places[k, 0]]


@inlined
def prepare(dq, c_mass, row, linear, windows, matrix):
    """Factor the matrix of a step unless the present factors are to be used; returns whether it is regular."""
    pace = linear.pace
    if pace[SINCE] > 0.0:
        if pace[EACH] <= 0.0:
            return True
        pace[EACH] -= 1.0
    return factor_again(dq, c_mass, row, linear, windows, matrix)


@inlined
def factor_again(dq, c_mass, row, linear, windows, matrix):
    """Factor the matrix of a step by dq from K and C in `row` of the windows; returns whether it is regular."""
    A, K, w = linear.A, linear.K, windows
    for i in range(A.size):
        A[i] = K[i] = 0.0
    for k in range(w.K_first[w.K_first.size - 1]):
        A[w.K_place[k]] = K[w.K_place[k]] = w.K[row, k]
    for k in range(w.C_first[w.C_first.size - 1] if linear.rated.size > 0 else 0):
        A[w.C_place[k]] += w.C[row, k]
    add_mass_and_turns(dq, c_mass, linear)
    linear.pace[SINCE], linear.pace[BEYOND], linear.pace[RATE_AGE] = 0.0, 0.0, REMEASURE
    transpose(A, matrix)
    return sparse_lu.factor(matrix) == 0


@inlined
def note_corrections(count, values, linear):
    """Note the corrections of all values of a step, and whether the next one is to be factored."""
    pace, fresh = linear.pace, linear.pace[SINCE] == 0.0
    pace[SINCE] += 1.0
    if fresh:
        pace[FRESH] = count / values
        return
    beyond = count - pace[FRESH] * values
    mean = (pace[FACTOR] + pace[BEYOND]) / pace[SINCE]
    pace[BEYOND] += beyond
    if beyond > mean:
        if pace[SINCE] <= 2.0:  # which is not worth it
            pace[EACH] = TRIED_AGAIN
        pace[SINCE] = 0.0


@inlined
def _subtract_product(dq, c_mass, x, row, linear, windows, model):
    """Subtract A^T x from the residual; K^T x, C^T x and M^T x are added to `parts`."""
    parts, w, n_v = linear.parts, windows, model.info.nv
    r, of, turned = parts[RESIDUAL], parts[PRODUCT], parts[TURNED]
    multiply_columns(w.K_first, w.K_entry, w.K[row], x, of)
    for j in range(x.size):
        parts[BY_STATE, j] += of[j]
    if linear.turned.shape[0] > 0:
        turn_transposed(dq, False, model, of, turned)
        for j in range(n_v):
            r[j] -= turned[j]
        for j in range(n_v, x.size):
            r[j] -= of[j]
    else:
        for j in range(x.size):
            r[j] -= of[j]
    if linear.rated.size > 0:
        multiply_columns(w.C_first, w.C_entry, w.C[row], x, of)
        for j in range(x.size):
            parts[BY_RATE, j] += of[j]
            r[j] -= of[j]
    multiply_mass(linear, x, of)
    for j in range(x.size):
        parts[BY_MASS, j] += of[j]
        r[j] -= c_mass * of[j]


@inlined
def _predict(dq, c_mass, q, row, linear, windows, model):
    """Extrapolated solution and its residual; zero if the residual is not smaller than the right side."""
    right, parts, W = linear.right, linear.parts, linear.W[q]
    known = int(linear.pace[N_BEFORE])
    for k in range(RESIDUAL):
        for i in range(W.size):
            parts[k, i] = 0.0
    for i in range(W.size):
        parts[RESIDUAL, i] = right[i]
    if known > 0:
        a, b, c = PREDICTION[known - 1]
        for i in range(W.size):
            W[i] = a * linear.before[0, q, i] + b * linear.before[1, q, i] + c * linear.before[2, q, i]
        _subtract_product(dq, c_mass, W, row, linear, windows, model)
        largest = left = 0.0
        for i in range(W.size):
            largest, left = max(largest, abs(right[i])), max(left, abs(parts[RESIDUAL, i]))
        if left < largest:
            return
    for k in range(RESIDUAL):
        for i in range(W.size):
            parts[k, i] = 0.0
    for i in range(W.size):
        parts[RESIDUAL, i], W[i] = right[i], 0.0


@inlined
def solve_transposed(dq, c_mass, q, row, linear, windows, matrix, model):
    """Solve A^T W = right for value q; returns how many corrections that takes, 0 where it does not converge.

    Then `parts` are K^T W, C^T W and M^T W, C times its rate.
    """
    W, x, parts, pace, size = linear.W[q], linear.r, linear.parts, linear.pace, linear.right.size
    _predict(dq, c_mass, q, row, linear, windows, model)
    fresh, count, last, worst = pace[SINCE] == 0.0, 0, math.inf, 0.0
    while True:
        before = after = largest = change = 0.0
        for i in range(size):
            x[i] = parts[RESIDUAL, i]
            before = max(before, abs(x[i]))
        sparse_lu.solve(matrix, x)
        for i in range(size):
            W[i] += x[i]
            change, largest = max(change, abs(x[i])), max(largest, abs(W[i]))
        _subtract_product(dq, c_mass, x, row, linear, windows, model)
        count += 1
        if not math.isfinite(change) or count > MOST:
            return 0
        rate = 1.0
        if last < math.inf and last > 0.0:
            rate = change / last
            worst = max(worst, rate)
        elif pace[RATE_AGE] < REMEASURE:  # the rate measured before, unless the equations have changed
            for i in range(size):
                after = max(after, abs(parts[RESIDUAL, i]))
            rate = max(pace[CONTRACTION], after / before if before > 0.0 else 0.0)
        left = change * min(1.0, SAFE * rate)
        if fresh or left <= CONVERGED * largest or (change > 0.5 * last and change <= ROUNDED * largest):
            break
        last = change
    for i in range(model.info.nv):  # the residual is attributed to M, so that K, C and M sum to the right side
        parts[BY_MASS, i] += parts[RESIDUAL, i] / c_mass
    if count > 1:
        pace[CONTRACTION], pace[RATE_AGE] = worst, 0.0
    pace[RATE_AGE] += 1.0
    return count


@inlined
def keep_solutions(linear):
    """Store the solutions of a step for the extrapolation of those of the steps before it."""
    before, W, pace = linear.before, linear.W, linear.pace
    for q in range(W.shape[0]):
        for i in range(W.shape[1]):
            before[2, q, i], before[1, q, i], before[0, q, i] = before[1, q, i], before[0, q, i], W[q, i]
    pace[N_BEFORE] = min(pace[N_BEFORE] + 1.0, float(len(PREDICTION)))
