"""What a `SparseBlocks` matrix has beside its blocks: deferred pivots and inner unknowns, and their dense corner."""

import math

from numba import types, void

from evolvent.algebra.sparse import (
    AT,
    BLOCK,
    COLUMN,
    COUNT,
    DEFERRED,
    FIRST,
    INNER,
    LOST,
    RANK,
    SINGULAR,
    SIZE,
    SPARSE,
    START,
    TINY_CORNER,
    WIDTH,
)
from evolvent.compiled.jit import VECTOR, indirect, inlined
from evolvent.compiled.views import matrix_view

_I = types.int64


@indirect(_I(SPARSE, _I, _I))
def loose_row(matrix, b, k):
    """Row of block b to go with the vanishing pivot k: one that others imply, never one that is needed.

    Notes
    -----
    The unknowns that move freely, v with v_k = 1 and U v = 0, are in a symmetric block also the rows' dependence.
    """
    m, start, v = matrix.table[b, SIZE], matrix.table[b, START], matrix.loose
    D = matrix_view(matrix.values, matrix.table[b, AT], m, m)
    v[k] = 1.0
    for r in range(k - 1, -1, -1):
        s = D[r, k]
        for c in range(r + 1, k):
            s += D[r, c] * v[c]
        v[r] = -s * D[r, r]
    found, largest = k, -1.0
    for p in range(k, m):
        row = _original(matrix, start, k, p)
        share = abs(v[row]) * math.sqrt(matrix.size[start + row]) if row <= k else 0.0
        if share > largest:
            found, largest = p, share
    return found


@inlined
def _original(matrix, start, k, row):
    """Row of a block that stood at an index before its first k interchanges."""
    for j in range(k - 1, -1, -1):
        if row == j:
            row = matrix.pivots[start + j]
        elif row == matrix.pivots[start + j]:
            row = j
    return row


@indirect(types.boolean(SPARSE, _I, _I))
def defer(matrix, b, k):
    """Raise the vanishing pivot k of block b and take its unknown to the corner; returns whether it is finite."""
    counts, start, m = matrix.counts, matrix.table[b, START], matrix.table[b, SIZE]
    D = matrix_view(matrix.values, matrix.table[b, AT], m, m)
    B, C, E = matrix.B, matrix.C, matrix.E
    pivot, size = D[k, k], matrix.size[start + k]
    if not math.isfinite(pivot) or not math.isfinite(size):
        return False
    d = size if size > 0.0 else 1.0
    if counts[DEFERRED] == matrix.deferred.size:
        if abs(pivot) > 1e-16 * size:
            matrix.quality[0] = min(matrix.quality[0], abs(pivot) / size)
        else:
            D[k, k] += d
            counts[LOST] += 1
        return True
    D[k, k] += d
    q = counts[INNER] + counts[DEFERRED]
    for r in range(B.shape[0]):
        B[r, q] = 0.0
        C[r, q] = 0.0
    for p in range(q):
        E[p, q] = 0.0
        E[q, p] = 0.0
    B[start + _original(matrix, start, k + 1, k), q] = -d
    C[start + k, q] = 1.0
    E[q, q] = -1.0
    matrix.deferred[counts[DEFERRED]] = matrix.unknown[start + k]
    counts[DEFERRED] += 1
    return True


@inlined
def _is_zero(X, first, m, width):
    for r in range(first, first + m):
        for q in range(width):
            if X[r, q] != 0.0:
                return False
    return True


@indirect(void(SPARSE, _I))
def eliminate_beside(matrix, b):
    """Eliminate block b from B, C and E: B = l^-1 P B, C = u^-T C, from later blocks Lt^T B and U^T C, from E C^T B."""
    table, later, B, C, E = matrix.table, matrix.later, matrix.B, matrix.C, matrix.E
    m, w, start = table[b, SIZE], table[b, WIDTH], table[b, START]
    width = matrix.counts[INNER] + matrix.counts[DEFERRED]
    right, left = not _is_zero(B, start, m, width), not _is_zero(C, start, m, width)
    if not right and not left:
        return
    D = matrix_view(matrix.values, table[b, AT], m, m)
    U = matrix_view(matrix.values, table[b, AT] + m * m, m, w)
    Lt = matrix_view(matrix.values, table[b, AT] + m * m + m * w, m, w)
    if right:
        for k in range(m):
            p = start + matrix.pivots[start + k]
            if p != start + k:
                for q in range(width):
                    B[start + k, q], B[p, q] = B[p, q], B[start + k, q]
        for r in range(1, m):
            for c in range(r):
                _subtract_row(B, start + r, D[r, c], start + c, width)
    if left:
        for r in range(m):
            for c in range(r):
                _subtract_row(C, start + r, D[c, r], start + c, width)
            for q in range(width):
                C[start + r, q] *= D[r, r]
    for i in range(table[b, FIRST], table[b, FIRST] + table[b, COUNT]):
        p, column = later[i, BLOCK], later[i, COLUMN]
        for r in range(table[p, SIZE]):
            for k in range(m):
                if right:
                    _subtract_row(B, table[p, START] + r, Lt[k, column + r], start + k, width)
                if left:
                    _subtract_row(C, table[p, START] + r, U[k, column + r], start + k, width)
    if left and right:
        for r in range(start, start + m):
            for p in range(width):
                f = C[r, p]
                if f != 0.0:
                    for q in range(width):
                        E[p, q] -= f * B[r, q]


@inlined
def _subtract_row(X, row, f, other, width):
    """Subtract f times another row."""
    for q in range(width):
        X[row, q] -= f * X[other, q]


@indirect(_I(SPARSE))
def factor_corner(matrix):
    """Scale the corner and factor it by complete pivoting; returns the number of redundant unknowns, or SINGULAR."""
    E, order, counts = matrix.E, matrix.order, matrix.counts
    width = counts[INNER] + counts[DEFERRED]
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
        if not largest > TINY_CORNER * first:
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
    for r in range(B.shape[0]):
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


@indirect(void(SPARSE, VECTOR))
def solve_corner(matrix, x):
    """Unknowns y of the corner from E y = -C^T x, and x - B y; x : (n,) float, by position, after its forward sweep."""
    B, C, E, order, scale, counts = matrix.B, matrix.C, matrix.E, matrix.order, matrix.scale, matrix.counts
    g, y = matrix.work[0], matrix.work[1]
    width, rank = counts[INNER] + counts[DEFERRED], counts[RANK]
    for p in range(width):
        y[p] = 0.0
    for r in range(x.size):
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
    for r in range(x.size):
        s = 0.0
        for p in range(width):
            s += B[r, p] * y[p]
        x[r] -= s
