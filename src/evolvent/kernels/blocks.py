"""Block-tridiagonal matrices with a border: LU in place, and solutions.

The system is ``[[A, B], [C^T, E]]`` with n dense blocks of m unknowns, each coupled to its two neighbours, and k border
unknowns (a hub's coordinates, multipliers) coupled to anything. Blocks are eliminated from the last to the first, so
border entries at the first blocks only, such as the joint at the root of a rib, cost next to nothing.

Inner unknowns z of the border stand for a product that lies outside the blocks: A x + B z = f with C^T x - z = 0 is
(A + B C^T) x = f, and the solution leaves them out.
"""

import math
from typing import Any

import numpy as np
from numba import types, void

from evolvent.jit import ADDRESSES, VECTOR, indirect, inlined
from evolvent.pointer import Struct, array, shared

#: What `factor` returns where a block is singular or not finite.
SINGULAR = -1
#: A pivot below this part of its column's largest entry is round-off: it goes to the border.
TINY_PIVOT = 1e-12
#: A border pivot below this part of the largest one, after scaling, stands for a redundant row.
TINY_BORDER = 1e-10
# places in Bordered.counts
BORDER, DEFERRED, RANK, ROWS, INNER = range(5)


class Bordered(Struct):
    """The matrix before, and its factors after `factor`.

    Attributes
    ----------
    A : (n, m, 3 m) float, row r of block i: its entries in the columns of blocks i - 1, i and i + 1
    B : (n m, k + spare) float, columns of the border
    C : (n m, k + spare) float, rows of the border, transposed
    E : (k + spare, k + spare) float, corner; only its leading (k, k) is given
    pivots : (n, m) int, row interchanged with each row
    order : (2, k + spare) int, rows and columns of the corner in the order of its pivots
    scale : (2, k + spare) float, factors of the corner's rows and columns
    work : (2, k + spare) float, scratch
    column, loose : (m,) float, scratch
    deferred : (spare,) int, unknowns whose pivots went to the border
    counts : (5,) int, k, deferred pivots, rank of the corner, rows that the border reaches, inner unknowns
    quality : (1,) float, smallest pivot beside the largest entry of its column
    addresses : of functions that compiled code calls by address
    """

    A: np.ndarray = array(3)
    B: np.ndarray = array(2)
    C: np.ndarray = array(2)
    E: np.ndarray = array(2)
    pivots: np.ndarray = array(2, np.int64)
    order: np.ndarray = array(2, np.int64)
    scale: np.ndarray = array(2)
    work: np.ndarray = array(2)
    column: np.ndarray = array(1)
    loose: np.ndarray = array(1)
    deferred: np.ndarray = array(1, np.int64)
    counts: np.ndarray = array(1, np.int64)
    quality: np.ndarray = array(1)
    addresses: np.ndarray = shared(ADDRESSES)


#: The type of a matrix in signatures of compiled functions.
BORDERED = Bordered._numba_type_


def bordered(n: int, m: int, k: int, *, spare: int = 0, inner: int = 0) -> Bordered:
    """Zero matrix of `n` blocks of `m` unknowns with `k` border unknowns.

    `spare` is how many pivots may be deferred to the border where the blocks by themselves are singular: statics of a
    beam that only its joints hold need 6; the matrix of a time step, which has masses, needs none. `inner` is how many
    inner unknowns there may be.
    """
    size = k + inner + spare
    return Bordered(
        A=np.zeros((n, m, 3 * m)),
        B=np.zeros((n * m, size)),
        C=np.zeros((n * m, size)),
        E=np.zeros((size, size)),
        pivots=np.zeros((n, m), dtype=np.int64),
        order=np.zeros((2, size), dtype=np.int64),
        scale=np.zeros((2, size)),
        work=np.zeros((2, size)),
        column=np.zeros(m),
        loose=np.zeros(m),
        deferred=np.zeros(spare, dtype=np.int64),
        counts=np.array([k, 0, k, n * m, 0]),
        quality=np.ones(1),
    )


@indirect(void(BORDERED))
def clear(matrix):
    """Set all entries to zero."""
    A, B, C, E = matrix.A, matrix.B, matrix.C, matrix.E
    matrix.counts[INNER] = 0
    for i in range(A.shape[0]):
        for r in range(A.shape[1]):
            for c in range(A.shape[2]):
                A[i, r, c] = 0.0
    for r in range(B.shape[0]):
        for q in range(B.shape[1]):
            B[r, q] = 0.0
            C[r, q] = 0.0
    for p in range(E.shape[0]):
        for q in range(E.shape[1]):
            E[p, q] = 0.0


@inlined
def inner(matrix, count):
    """The first of `count` new inner unknowns, whose columns B and C the caller fills."""
    q = matrix.counts[BORDER] + matrix.counts[INNER]
    matrix.counts[INNER] += count
    for p in range(q, q + count):
        matrix.E[p, p] = -1.0
    return q


def functions() -> list[Any]:
    """Functions that are called by address."""
    return [clear, factor, solve, _loose_row, _defer, _border, _factor_corner, _solve_corner]


@inlined
def _width(matrix):
    """Unknowns of the border: given, inner and deferred ones."""
    return matrix.counts[BORDER] + matrix.counts[INNER] + matrix.counts[DEFERRED]


@indirect(types.int64(BORDERED))
def factor(matrix):
    """LU of a `Bordered` matrix in place; returns the number of redundant border unknowns, or SINGULAR.

    Notes
    -----
    With D, L, U the blocks of a row: D = P^T l u by partial pivoting, W = l^-1 P L, V = U' u^-1 of the row above, and
    that row's D becomes D' - V W. The border follows as rows and columns of the same elimination, and its corner is
    factored by complete pivoting after scaling. Redundant unknowns are the last of `matrix.order`; `solve` sets them to
    zero. A pivot p that vanishes is raised by d, and the unknown z = x_p joins the border with A x - d z e_p = f.
    """
    counts, quality = matrix.counts, matrix.quality
    counts[DEFERRED] = 0
    counts[ROWS] = 0
    quality[0] = 1.0
    n, m = matrix.A.shape[0], matrix.A.shape[1]
    _clear_spare(matrix)
    for i in range(n - 1, -1, -1):
        # the sizes usual for beams are compiled with their loops unrolled (2.4 times faster for 6, 1.2 for 12)
        if m == 6:
            done = _eliminate(matrix, i, 6)
        elif m == 12:
            done = _eliminate(matrix, i, 12)
        else:
            done = _eliminate(matrix, i, m)
        if not done:
            return SINGULAR
        if _width(matrix) > 0:
            _border(matrix, i)
    return _factor_corner(matrix)


@inlined
def _clear_spare(matrix):
    B, C, E, k = matrix.B, matrix.C, matrix.E, matrix.counts[BORDER] + matrix.counts[INNER]
    for q in range(k, E.shape[0]):
        for p in range(E.shape[0]):
            E[p, q] = 0.0
            E[q, p] = 0.0
        for r in range(B.shape[0]):
            B[r, q] = 0.0
            C[r, q] = 0.0


@inlined
def _eliminate(matrix, i, m):
    """LU of block i, and its elimination from block i - 1; returns False where it is singular or not finite."""
    X, pivots, column = matrix.A[i], matrix.pivots[i], matrix.column
    if i == matrix.A.shape[0] - 1:
        _column_sizes(X, column, m)
    for k in range(m):
        p = k
        largest = abs(X[k, m + k])
        for r in range(k + 1, m):
            size = abs(X[r, m + k])
            if size > largest:
                largest = size
                p = r
        vanishes = not largest > TINY_PIVOT * column[k]
        if vanishes and matrix.counts[DEFERRED] < matrix.deferred.size:
            p = _loose_row(matrix, i, k, m)
        pivots[k] = p
        if p != k:
            for c in range(3 * m):
                X[k, c], X[p, c] = X[p, c], X[k, c]
        if vanishes:
            if not _defer(matrix, i, k, m):
                return False
        elif largest < matrix.quality[0] * column[k]:
            matrix.quality[0] = largest / column[k]
        d = 1.0 / X[k, m + k]
        X[k, m + k] = d
        for r in range(k + 1, m):
            f = X[r, m + k] * d
            X[r, m + k] = f
            for c in range(m):
                X[r, c] -= f * X[k, c]
            for c in range(m + k + 1, 2 * m):
                X[r, c] -= f * X[k, c]
    if i > 0:
        Y = matrix.A[i - 1]
        _column_sizes(Y, column, m)
        for r in range(m):
            for k in range(m):
                f = Y[r, 2 * m + k] * X[k, m + k]
                Y[r, 2 * m + k] = f
                for c in range(k + 1, m):
                    Y[r, 2 * m + c] -= f * X[k, m + c]
            for k in range(m):
                f = Y[r, 2 * m + k]
                for c in range(m):
                    Y[r, m + c] -= f * X[k, c]
    return True


@inlined
def _column_sizes(X, column, m):
    """Largest entries of the columns of a diagonal block."""
    for c in range(m):
        column[c] = 0.0
        for r in range(m):
            column[c] = max(column[c], abs(X[r, m + c]))


@indirect(types.int64(BORDERED, types.int64, types.int64, types.int64))
def _loose_row(matrix, i, k, m):
    """Place of the row of block i to go with the vanishing pivot k: one that others imply, never one that is needed.

    Notes
    -----
    The unknowns that move freely, v with v_k = 1 and U v = 0, are in a symmetric block also the rows' dependence.
    """
    X, v, column = matrix.A[i], matrix.loose, matrix.column
    v[k] = 1.0
    for r in range(k - 1, -1, -1):
        s = X[r, m + k]
        for c in range(r + 1, k):
            s += X[r, m + c] * v[c]
        v[r] = -s * X[r, m + r]
    found, largest = k, -1.0
    for p in range(k, m):
        row = _original(matrix, i, k, p)
        share = abs(v[row]) * math.sqrt(column[row]) if row <= k else 0.0
        if share > largest:
            found, largest = p, share
    return found


@inlined
def _original(matrix, i, k, row):
    """Row of block i that stood in a place before its first k interchanges."""
    for j in range(k - 1, -1, -1):
        if row == j:
            row = matrix.pivots[i, j]
        elif row == matrix.pivots[i, j]:
            row = j
    return row


@indirect(types.boolean(BORDERED, types.int64, types.int64, types.int64))
def _defer(matrix, i, k, m):
    """Raise the vanishing pivot k of block i and take its unknown to the border; returns False where that is full."""
    X, counts = matrix.A[i], matrix.counts
    pivot, size = X[k, m + k], matrix.column[k]
    if not math.isfinite(pivot) or not math.isfinite(size):
        return False
    if counts[DEFERRED] == matrix.deferred.size:
        if abs(pivot) <= 1e-16 * size:
            return False
        matrix.quality[0] = min(matrix.quality[0], abs(pivot) / size)
        return True
    d = size if size > 0.0 else 1.0
    X[k, m + k] += d
    row = _original(matrix, i, k + 1, k)
    q = _width(matrix)
    matrix.B[i * m + row, q] = -d
    matrix.C[i * m + k, q] = 1.0
    matrix.E[q, q] = -1.0
    matrix.deferred[counts[DEFERRED]] = i * m + k
    counts[DEFERRED] += 1
    return True


@inlined
def _is_zero(X, first, last, width):
    for r in range(first, last):
        for q in range(width):
            if X[r, q] != 0.0:
                return False
    return True


@indirect(void(BORDERED, types.int64))
def _border(matrix, i):
    """Eliminate block i from the border: B = l^-1 P (B - V B'), C = u^-T (C - W'^T C'), E = E - C^T B."""
    A, B, C, E = matrix.A, matrix.B, matrix.C, matrix.E
    m = A.shape[1]
    width = _width(matrix)
    X, first, last = A[i], i * m, i * m + m
    rows = matrix.counts[ROWS]
    if rows == 0:
        if _is_zero(B, first, last, width) and _is_zero(C, first, last, width):
            return
        matrix.counts[ROWS] = last
    for k in range(m):
        p = matrix.pivots[i, k]
        if p != k:
            for q in range(width):
                B[first + k, q], B[first + p, q] = B[first + p, q], B[first + k, q]
    if rows > 0:
        if not _is_zero(B, last, last + m, width):
            for r in range(m):
                for c in range(m):
                    f = X[r, 2 * m + c]
                    for q in range(width):
                        B[first + r, q] -= f * B[last + c, q]
        if not _is_zero(C, last, last + m, width):
            W = A[i + 1]
            for r in range(m):
                for c in range(m):
                    f = W[c, r]
                    for q in range(width):
                        C[first + r, q] -= f * C[last + c, q]
    left, right = not _is_zero(C, first, last, width), not _is_zero(B, first, last, width)
    if right:
        for r in range(1, m):
            for c in range(r):
                f = X[r, m + c]
                for q in range(width):
                    B[first + r, q] -= f * B[first + c, q]
    if left:
        for r in range(m):
            for c in range(r):
                f = X[c, m + r]
                for q in range(width):
                    C[first + r, q] -= f * C[first + c, q]
            for q in range(width):
                C[first + r, q] *= X[r, m + r]
    if left and right:
        for r in range(first, last):
            for p in range(width):
                f = C[r, p]
                if f != 0.0:
                    for q in range(width):
                        E[p, q] -= f * B[r, q]


@indirect(types.int64(BORDERED))
def _factor_corner(matrix):
    """Scale the corner and factor it by complete pivoting; returns the number of redundant unknowns, or SINGULAR."""
    E, order, counts = matrix.E, matrix.order, matrix.counts
    width = _width(matrix)
    counts[RANK] = width
    if width == 0:
        return 0
    if not _equilibrate(matrix, width):
        return SINGULAR
    first = 0.0
    for k in range(width):
        largest, p, s = -1.0, k, k
        for r in range(k, width):
            for c in range(k, width):
                if abs(E[r, c]) > largest:
                    largest, p, s = abs(E[r, c]), r, c
        if k == 0:
            first = largest
        if not largest > TINY_BORDER * first:
            counts[RANK] = k
            return width - k
        matrix.quality[0] = min(matrix.quality[0], largest / first)
        if p != k:
            order[0, k], order[0, p] = order[0, p], order[0, k]
            for c in range(width):
                E[k, c], E[p, c] = E[p, c], E[k, c]
        if s != k:
            order[1, k], order[1, s] = order[1, s], order[1, k]
            for r in range(width):
                E[r, k], E[r, s] = E[r, s], E[r, k]
        d = 1.0 / E[k, k]
        E[k, k] = d
        for r in range(k + 1, width):
            f = E[r, k] * d
            E[r, k] = f
            for c in range(k + 1, width):
                E[r, c] -= f * E[k, c]
    return 0


@inlined
def _equilibrate(matrix, width):
    """Drop what is round-off of the elimination, then bring all rows and columns of the corner near 1 (Ruiz, 2001)."""
    B, C, E, scale, work = matrix.B, matrix.C, matrix.E, matrix.scale, matrix.work
    for p in range(width):
        matrix.order[0, p] = p
        matrix.order[1, p] = p
        scale[0, p] = 1.0
        scale[1, p] = 1.0
        work[0, p] = abs(E[p, p])
    for r in range(matrix.counts[ROWS]):
        for p in range(width):
            work[0, p] += abs(C[r, p] * B[r, p])
    for p in range(width):
        for q in range(width):
            if not math.isfinite(E[p, q]):
                return False
            if abs(E[p, q]) <= 1e-13 * math.sqrt(work[0, p] * work[0, q]):
                E[p, q] = 0.0
    for _ in range(4):
        for p in range(width):
            work[0, p] = 0.0
            work[1, p] = 0.0
        for p in range(width):
            for q in range(width):
                work[0, p] = max(work[0, p], abs(E[p, q]))
                work[1, q] = max(work[1, q], abs(E[p, q]))
        for side in range(2):
            for p in range(width):
                work[side, p] = 1.0 / math.sqrt(work[side, p]) if work[side, p] > 0.0 else 1.0
                scale[side, p] *= work[side, p]
        for p in range(width):
            for q in range(width):
                E[p, q] *= work[0, p] * work[1, q]
    return True


@indirect(void(BORDERED, VECTOR))
def solve(matrix, x):
    """Solve with the factors: x : (n m + k,) holds the right-hand side, then the solution; redundant unknowns are 0."""
    m = matrix.A.shape[1]
    if m == 6:
        _forward(matrix.A, matrix.pivots, x, 6)
    elif m == 12:
        _forward(matrix.A, matrix.pivots, x, 12)
    else:
        _forward(matrix.A, matrix.pivots, x, m)
    if _width(matrix) > 0:
        _solve_corner(matrix, x)
    if m == 6:
        _backward(matrix.A, x, 6)
    elif m == 12:
        _backward(matrix.A, x, 12)
    else:
        _backward(matrix.A, x, m)


@inlined
def _forward(A, pivots, x, m):
    """X = l^-1 P (x - V x'), from the last block to the first."""
    n = A.shape[0]
    for i in range(n - 1, -1, -1):
        X = A[i]
        b = x[i * m : i * m + m]
        for k in range(m):
            p = pivots[i, k]
            if p != k:
                b[k], b[p] = b[p], b[k]
        if i < n - 1:
            e = x[i * m + m : i * m + 2 * m]
            for r in range(m):
                s = b[r]
                for c in range(m):
                    s -= X[r, 2 * m + c] * e[c]
                b[r] = s
        for r in range(1, m):
            s = b[r]
            for c in range(r):
                s -= X[r, m + c] * b[c]
            b[r] = s


@inlined
def _backward(A, x, m):
    """X = u^-1 (x - W x'), from the first block to the last."""
    for i in range(A.shape[0]):
        X = A[i]
        b = x[i * m : i * m + m]
        if i > 0:
            e = x[i * m - m : i * m]
            for r in range(m):
                s = b[r]
                for c in range(m):
                    s -= X[r, c] * e[c]
                b[r] = s
        for r in range(m - 1, -1, -1):
            s = b[r]
            for c in range(r + 1, m):
                s -= X[r, m + c] * b[c]
            b[r] = s * X[r, m + r]


@indirect(void(BORDERED, VECTOR))
def _solve_corner(matrix, x):
    """Border unknowns y from E y = g - C^T x, and x - B y."""
    B, C, E, order, scale, counts = matrix.B, matrix.C, matrix.E, matrix.order, matrix.scale, matrix.counts
    g, y = matrix.work[0], matrix.work[1]
    k, width, rank = counts[BORDER], _width(matrix), counts[RANK]
    n, rows = B.shape[0], counts[ROWS]
    for p in range(width):
        y[p] = x[n + p] if p < k else 0.0
    for r in range(rows):
        f = x[r]
        for p in range(width):
            y[p] -= C[r, p] * f
    for p in range(rank):
        row = order[0, p]
        s = y[row] * scale[0, row]
        for q in range(p):
            s -= E[p, q] * g[q]
        g[p] = s
    for p in range(rank - 1, -1, -1):
        s = g[p]
        for q in range(p + 1, rank):
            s -= E[p, q] * g[q]
        g[p] = s * E[p, p]
    for p in range(width):
        column = order[1, p]
        y[column] = g[p] * scale[1, column] if p < rank else 0.0
    for r in range(rows):
        s = 0.0
        for p in range(width):
            s += B[r, p] * y[p]
        x[r] -= s
    for p in range(k):
        x[n + p] = y[p]
