"""LU of a `SparseBlocks` matrix in place, and solutions with the factors."""

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
    MULTIPLIERS,
    SINGULAR,
    SIZE,
    SPARSE,
    START,
    TARGET,
    TINY_PIVOT,
    WIDTH,
)
from evolvent.algebra.sparse_corner import defer, eliminate_beside, factor_corner, loose_row, solve_corner
from evolvent.compiled.jit import VECTOR, indirect, inlined, kernel
from evolvent.compiled.views import matrix_view

_I = types.int64


@indirect(types.int64(SPARSE))
def factor(matrix):
    """LU in place; returns the number of unknowns that stay undetermined (redundant constraints), or SINGULAR.

    Notes
    -----
    Block after block: D = P^T l u by partial pivoting, U = l^-1 P U, Lt = u^-T Lt, and A_pq -= Lt_p^T U_q for all later
    blocks p and q that it couples to. A pivot p that vanishes is raised by d, and the unknown z = x_p joins the corner
    with A x - d z e_p = f. The corner is factored last, by complete pivoting after scaling; `solve` sets redundant z to
    zero.
    """
    table, counts = matrix.table, matrix.counts
    counts[DEFERRED] = 0
    counts[LOST] = 0
    matrix.quality[0] = 1.0
    # the size usual for beams and bodies is compiled with its loops unrolled
    for b in range(table.shape[0]):
        if table[b, SIZE] == 6:
            _measure(matrix, b, 6)
        else:
            _measure(matrix, b, table[b, SIZE])
    for b in range(table.shape[0]):
        done = _factor_diagonal(matrix, b, 6) if table[b, SIZE] == 6 else _factor_diagonal(matrix, b, table[b, SIZE])
        if not done:
            return SINGULAR
        if table[b, COUNT] > 0:
            _eliminate(matrix, b)
        if counts[INNER] + counts[DEFERRED] > 0:
            eliminate_beside(matrix, b)
    redundant = factor_corner(matrix)
    if counts[LOST] > 0 and redundant == 0:
        return SINGULAR
    return redundant + counts[LOST] if redundant >= 0 else SINGULAR


@inlined
def _measure(matrix, b, m):
    """Sizes of the columns of block b: the largest entry of column and row in its diagonal part, as assembled.

    The row counts because that of a body which turns freely about an axis may be all that differs from round-off.
    """
    table, size = matrix.table, matrix.size
    start = table[b, START]
    D = matrix_view(matrix.values, table[b, AT], m, m)
    column = matrix_view(size, start, 1, m)
    for c in range(m):
        largest = 0.0
        for r in range(m):
            largest = max(largest, abs(D[r, c]), abs(D[c, r]))
        column[0, c] = largest
    for r in range(m - table[b, MULTIPLIERS], m):
        matrix.terms[start + r] = abs(D[r, r])


@inlined
def _factor_diagonal(matrix, b, m):
    """LU of the diagonal part of block b, rows of U interchanged with its own; returns whether it is finite."""
    table, quality = matrix.table, matrix.quality
    start, w = table[b, START], table[b, WIDTH]
    D = matrix_view(matrix.values, table[b, AT], m, m)
    U = matrix_view(matrix.values, table[b, AT] + m * m, m, w)
    column, pivots = matrix_view(matrix.size, start, 1, m), matrix_view(matrix.pivots, start, 1, m)
    first_multiplier = m - table[b, MULTIPLIERS]
    for k in range(m):
        p = k
        largest = abs(D[k, k])
        for r in range(k + 1, m):
            size = abs(D[r, k])
            if size > largest:
                largest = size
                p = r
        if k >= first_multiplier:
            column[0, k] = _multiplier_size(D, k, matrix.terms[start + k])
        vanishes = not largest > TINY_PIVOT * column[0, k]
        if vanishes and matrix.counts[DEFERRED] < matrix.deferred.size:
            p = loose_row(matrix, b, k)
        pivots[0, k] = p
        if p != k:
            for c in range(m):
                D[k, c], D[p, c] = D[p, c], D[k, c]
            for c in range(w):
                U[k, c], U[p, c] = U[p, c], U[k, c]
        if vanishes:
            if not defer(matrix, b, k):
                return False
        elif largest < quality[0] * column[0, k]:
            quality[0] = largest / column[0, k]
        d = 1.0 / D[k, k]
        D[k, k] = d
        for r in range(k + 1, m):
            f = D[r, k] * d
            D[r, k] = f
            for c in range(k + 1, m):
                D[r, c] -= f * D[k, c]
    return True


@kernel
def _multiplier_size(D, k, terms):
    """Size of a multiplier's column before its pivot k: sum of the absolute terms that make up its largest entry."""
    largest = terms
    for r in range(k, D.shape[0]):
        s = abs(D[r, k])
        for j in range(k):
            s += abs(D[r, j] * D[j, k])
        largest = max(largest, s)
    return largest


@indirect(void(SPARSE, types.int64))
def _eliminate(matrix, b):
    """U = l^-1 U and Lt = u^-T Lt of block b, and their products from the blocks that it couples to."""
    table, later, target = matrix.table, matrix.later, matrix.target
    m, w, at = table[b, SIZE], table[b, WIDTH], table[b, AT]
    U, Lt = at + m * m, at + m * m + m * w
    _substitute(matrix, at, U, m, w, False)
    _substitute(matrix, at, Lt, m, w, True)
    first, last, pair = table[b, FIRST], table[b, FIRST] + table[b, COUNT], table[b, TARGET]
    for i in range(first, last):
        p, x = later[i, BLOCK], later[i, COLUMN]
        if table[p, MULTIPLIERS] > 0:
            _add_terms(matrix, b, i)
        s, wide = table[p, SIZE], table[p, WIDTH]
        _subtract(matrix, target[pair], s, Lt + x, U + x, w, m, s, s)
        pair += 1
        for j in range(i + 1, last):
            y, t = later[j, COLUMN], table[later[j, BLOCK], SIZE]
            for side in range(2):  # U and then Lt of p
                left, right = (Lt, U) if side == 0 else (U, Lt)
                _subtract(matrix, target[pair] + side * s * wide, wide, left + x, right + y, w, m, s, t)
            pair += 1


@indirect(void(SPARSE, _I, _I, _I, _I, _I, _I, _I, _I))
def _subtract(matrix, to, wide, x, y, w, m, s, t):
    """T[r, c] -= sum over k of X[k, r] Y[k, c], for s rows and t columns.

    T, X and Y begin at indices `to`, x and y of the values; rows of T are `wide` apart, those of X and Y w. Sums for
    six columns at a time stay in registers.
    """
    values, c = matrix.values, 0
    while c + 6 <= t:
        Y = matrix_view(values, y + c, m, w)
        for r in range(s):
            T, X = matrix_view(values, to + r * wide + c, 1, 6), matrix_view(values, x + r, m, w)
            a0, a1, a2, a3, a4, a5 = T[0, 0], T[0, 1], T[0, 2], T[0, 3], T[0, 4], T[0, 5]
            for k in range(m):
                f = X[k, 0]
                a0 -= f * Y[k, 0]
                a1 -= f * Y[k, 1]
                a2 -= f * Y[k, 2]
                a3 -= f * Y[k, 3]
                a4 -= f * Y[k, 4]
                a5 -= f * Y[k, 5]
            T[0, 0], T[0, 1], T[0, 2], T[0, 3], T[0, 4], T[0, 5] = a0, a1, a2, a3, a4, a5
        c += 6
    while c < t:
        Y = matrix_view(values, y + c, m, w)
        for r in range(s):
            T, X = matrix_view(values, to + r * wide + c, 1, 1), matrix_view(values, x + r, m, w)
            a0 = T[0, 0]
            for k in range(m):
                a0 -= X[k, 0] * Y[k, 0]
            T[0, 0] = a0
        c += 1


@indirect(void(SPARSE, _I, _I, _I, _I, types.boolean))
def _substitute(matrix, d, at, m, w, upper):
    """X = l^-1 X, or u^-T X where `upper`; l and u as `_factor_diagonal` leaves them in D, X (m, w) at an index."""
    values, c = matrix.values, 0
    D = matrix_view(values, d, m, m)
    while c + 6 <= w:
        X = matrix_view(values, at + c, m, w)
        for r in range(m):
            a0, a1, a2, a3, a4, a5 = X[r, 0], X[r, 1], X[r, 2], X[r, 3], X[r, 4], X[r, 5]
            for k in range(r):
                f = D[k, r] if upper else D[r, k]
                a0 -= f * X[k, 0]
                a1 -= f * X[k, 1]
                a2 -= f * X[k, 2]
                a3 -= f * X[k, 3]
                a4 -= f * X[k, 4]
                a5 -= f * X[k, 5]
            d = D[r, r] if upper else 1.0
            X[r, 0], X[r, 1], X[r, 2], X[r, 3], X[r, 4], X[r, 5] = d * a0, d * a1, d * a2, d * a3, d * a4, d * a5
        c += 6
    while c < w:
        X = matrix_view(values, at + c, m, w)
        for r in range(m):
            a0 = X[r, 0]
            for k in range(r):
                a0 -= (D[k, r] if upper else D[r, k]) * X[k, 0]
            X[r, 0] = a0 * D[r, r] if upper else a0
        c += 1


@inlined
def _add_terms(matrix, b, i):
    """Add the absolute products that block b subtracts from the diagonal of the multipliers of its later block i."""
    table, p = matrix.table, matrix.later[i, BLOCK]
    m, w = table[b, SIZE], table[b, WIDTH]
    U = matrix_view(matrix.values, table[b, AT] + m * m, m, w)
    Lt = matrix_view(matrix.values, table[b, AT] + m * m + m * w, m, w)
    s = table[p, SIZE]
    for r in range(s - table[p, MULTIPLIERS], s):
        c, sum_ = matrix.later[i, COLUMN] + r, 0.0
        for k in range(m):
            sum_ += abs(Lt[k, c] * U[k, c])
        matrix.terms[table[p, START] + r] += sum_


# ---------------------------------------------------------------------------------------------- solution


@indirect(void(SPARSE, VECTOR))
def solve(matrix, b):
    """Solve with the factors; b : (n,) holds the right-hand side, then the solution, in the order of the unknowns."""
    table, place, x = matrix.table, matrix.place, matrix.x
    n = table.shape[0]
    for i in range(x.size):
        x[place[i]] = b[i]
    for i in range(n):
        if table[i, SIZE] == 6 and table[i, WIDTH] == 6:
            _forward(matrix, x, i, 6, 6)
        else:
            _forward(matrix, x, i, table[i, SIZE], table[i, WIDTH])
    if matrix.counts[INNER] + matrix.counts[DEFERRED] > 0:
        solve_corner(matrix, x)
    for i in range(n - 1, -1, -1):
        if table[i, SIZE] == 6 and table[i, WIDTH] == 6:
            _backward(matrix, x, i, 6, 6)
        else:
            _backward(matrix, x, i, table[i, SIZE], table[i, WIDTH])
    for i in range(x.size):
        b[i] = x[place[i]]


@inlined
def _forward(matrix, x, b, m, w):
    """Block b of x = l^-1 P x, and Lt^T times it subtracted from the blocks that it couples to."""
    table, later, start = matrix.table, matrix.later, matrix.table[b, START]
    at = table[b, AT]
    D, lower = matrix_view(matrix.values, at, m, m), at + m * m + m * w
    own, pivots = matrix_view(x, start, 1, m), matrix_view(matrix.pivots, start, 1, m)
    for k in range(m):
        p = pivots[0, k]
        if p != k:
            own[0, k], own[0, p] = own[0, p], own[0, k]
    for r in range(1, m):
        s = own[0, r]
        for c in range(r):
            s -= D[r, c] * own[0, c]
        own[0, r] = s
    for i in range(table[b, FIRST], table[b, FIRST] + table[b, COUNT]):
        p = later[i, BLOCK]
        X = matrix_view(matrix.values, lower + later[i, COLUMN], m, w)
        to = matrix_view(x, table[p, START], 1, table[p, SIZE])
        if table[p, SIZE] == 6:  # sums that stay in registers; a vector in memory would stall what reads it
            a0 = a1 = a2 = a3 = a4 = a5 = 0.0
            for k in range(m):
                f = own[0, k]
                a0 += X[k, 0] * f
                a1 += X[k, 1] * f
                a2 += X[k, 2] * f
                a3 += X[k, 3] * f
                a4 += X[k, 4] * f
                a5 += X[k, 5] * f
            a0, a1, a2 = to[0, 0] - a0, to[0, 1] - a1, to[0, 2] - a2
            a3, a4, a5 = to[0, 3] - a3, to[0, 4] - a4, to[0, 5] - a5
            to[0, 0], to[0, 1], to[0, 2], to[0, 3], to[0, 4], to[0, 5] = a0, a1, a2, a3, a4, a5
        else:
            for c in range(table[p, SIZE]):
                a0 = 0.0
                for k in range(m):
                    a0 += X[k, c] * own[0, k]
                to[0, c] -= a0


@inlined
def _backward(matrix, x, b, m, w):
    """Block b of x = u^-1 (x - U x'), x' that of the blocks that it couples to."""
    table, later = matrix.table, matrix.later
    at = table[b, AT]
    D, own = matrix_view(matrix.values, at, m, m), matrix_view(x, table[b, START], 1, m)
    for i in range(table[b, FIRST], table[b, FIRST] + table[b, COUNT]):
        p = later[i, BLOCK]
        U = matrix_view(matrix.values, at + m * m + later[i, COLUMN], m, w)
        of = matrix_view(x, table[p, START], 1, table[p, SIZE])
        if table[p, SIZE] == 6:
            a0, a1, a2, a3, a4, a5 = of[0, 0], of[0, 1], of[0, 2], of[0, 3], of[0, 4], of[0, 5]
            for r in range(m):
                s = own[0, r]
                s = s - U[r, 0] * a0 - U[r, 1] * a1 - U[r, 2] * a2 - U[r, 3] * a3 - U[r, 4] * a4 - U[r, 5] * a5
                own[0, r] = s
        else:
            for r in range(m):
                s = own[0, r]
                for c in range(table[p, SIZE]):
                    s -= U[r, c] * of[0, c]
                own[0, r] = s
    for r in range(m - 1, -1, -1):
        s = own[0, r]
        for c in range(m - 1, r, -1):  # what is found last comes last: the others are not held up by it
            s -= D[r, c] * own[0, c]
        own[0, r] = s * D[r, r]
