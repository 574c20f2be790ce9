"""LU of a `SparseBlocks` matrix in place, and solutions with the factors."""

from evolvent.jit import inlined, kernel, matrix_view
from evolvent.kernels.sparse import (
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
    START,
    TARGET,
    TINY_PIVOT,
    WIDTH,
)
from evolvent.kernels.sparse_corner import defer, eliminate_beside, factor_corner, loose_row, solve_corner


@kernel
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
    for b in range(table.shape[0]):
        m = table[b, SIZE]
        if m == 6:
            _measure(matrix, b, 6)
        else:
            _measure(matrix, b, m)
    for b in range(table.shape[0]):
        # the size usual for beams and bodies is compiled with its loops unrolled
        done = _factor_diagonal(matrix, b, 6) if table[b, SIZE] == 6 else _factor_diagonal(matrix, b, table[b, SIZE])
        if not done:
            return SINGULAR
        if table[b, SIZE] == 6 and table[b, WIDTH] == 6 and table[b, COUNT] == 1:
            _eliminate_six(matrix, b)
        elif table[b, COUNT] > 0:
            _eliminate(matrix, b)
        if counts[INNER] + counts[DEFERRED] > 0:
            eliminate_beside(matrix, b)
    redundant = factor_corner(matrix)
    if counts[LOST] > 0 and redundant == 0:
        return SINGULAR
    return redundant + counts[LOST] if redundant >= 0 else SINGULAR


@inlined
def _measure(matrix, b, m):
    """Sizes of the columns of block b: the largest entry of its diagonal part, as assembled."""
    table, size = matrix.table, matrix.size
    start = table[b, START]
    D = matrix_view(matrix.values, table[b, AT], m, m)
    column = matrix_view(size, start, 1, m)
    for c in range(m):
        column[0, c] = 0.0
    for r in range(m):
        for c in range(m):
            s = abs(D[r, c])
            if s > column[0, c]:
                column[0, c] = s
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


@inlined
def _eliminate_six(matrix, b):
    """`_eliminate` of a block of 6 unknowns that couples to one of 6 more."""
    values, at, first = matrix.values, matrix.table[b, AT], matrix.table[b, FIRST]
    D = matrix_view(values, at, 6, 6)
    _substitute(values, D, at + 36, 6, 6, False)
    _substitute(values, D, at + 72, 6, 6, True)
    if matrix.table[matrix.later[first, BLOCK], MULTIPLIERS] > 0:
        _add_terms(matrix, b, first)
    _subtract(values, matrix.target[matrix.table[b, TARGET]], 6, at + 72, at + 36, 6, 6, 6, 6)


@kernel
def _eliminate(matrix, b):
    """U = l^-1 U and Lt = u^-T Lt of block b, and their products from the blocks that it couples to."""
    table, later, target, values = matrix.table, matrix.later, matrix.target, matrix.values
    m, w, at = table[b, SIZE], table[b, WIDTH], table[b, AT]
    D = matrix_view(values, at, m, m)
    U, Lt = at + m * m, at + m * m + m * w
    _substitute(values, D, U, m, w, False)
    _substitute(values, D, Lt, m, w, True)
    first, last, pair = table[b, FIRST], table[b, FIRST] + table[b, COUNT], table[b, TARGET]
    for i in range(first, last):
        p, x = later[i, BLOCK], later[i, COLUMN]
        if table[p, MULTIPLIERS] > 0:
            _add_terms(matrix, b, i)
        s, wide = table[p, SIZE], table[p, WIDTH]
        _subtract(values, target[pair], s, Lt + x, U + x, w, m, s, s)
        pair += 1
        for j in range(i + 1, last):
            y, t = later[j, COLUMN], table[later[j, BLOCK], SIZE]
            for side in range(2):  # U and then Lt of p
                left, right = (Lt, U) if side == 0 else (U, Lt)
                _subtract(values, target[pair] + side * s * wide, wide, left + x, right + y, w, m, s, t)
            pair += 1


@inlined
def _subtract(values, to, wide, x, y, w, m, s, t):
    """T[r, c] -= sum over k of X[k, r] Y[k, c], for s rows and t columns.

    T, X and Y begin at places `to`, x and y of the values; rows of T are `wide` apart, those of X and Y w. Sums for six
    columns at a time stay in registers.
    """
    c = 0
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


@inlined
def _substitute(values, D, at, m, w, upper):
    """X = l^-1 X, or u^-T X where `upper`; l and u as `_factor_diagonal` leaves them in D, X (m, w) at a place."""
    c = 0
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


@kernel
def solve(matrix, b):
    """Solve with the factors; b : (n,) holds the right-hand side, then the solution, in the order of the unknowns."""
    table, place, x = matrix.table, matrix.place, matrix.x
    n = table.shape[0]
    for i in range(x.size):
        x[place[i]] = b[i]
    for i in range(n):
        if table[i, SIZE] == 6 and table[i, WIDTH] == 6 and table[i, COUNT] == 1:
            _forward(matrix, x, i, 6, 6)
        else:
            _forward(matrix, x, i, table[i, SIZE], 0)
    if matrix.counts[INNER] + matrix.counts[DEFERRED] > 0:
        solve_corner(matrix, x)
    for i in range(n - 1, -1, -1):
        if table[i, SIZE] == 6 and table[i, WIDTH] == 6 and table[i, COUNT] == 1:
            _backward(matrix, x, i, 6, 6)
        else:
            _backward(matrix, x, i, table[i, SIZE], 0)
    for i in range(x.size):
        b[i] = x[place[i]]


@inlined
def _forward(matrix, x, b, m, only):
    """Block b of x = l^-1 P x, and its part subtracted from later blocks; `only` is the size of a single one, or 0."""
    table, later, start, first = matrix.table, matrix.later, matrix.table[b, START], matrix.table[b, FIRST]
    w = only if only > 0 else table[b, WIDTH]
    D, at = matrix_view(matrix.values, table[b, AT], m, m), table[b, AT] + m * m + m * w
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
    if only > 0:
        _subtract_rows(matrix, x, at, own, later[first, BLOCK], m, w, only)
        return
    for i in range(first, first + table[b, COUNT]):
        p = later[i, BLOCK]
        _subtract_rows(matrix, x, at + later[i, COLUMN], own, p, m, w, table[p, SIZE])


@inlined
def _subtract_rows(matrix, x, at, own, p, m, w, t):
    """Subtract Lt^T x of the block `own` from block p, of t entries; its columns of Lt begin at a place."""
    start, c = matrix.table[p, START], 0
    while c + 6 <= t:
        y, Lt = matrix_view(x, start + c, 1, 6), matrix_view(matrix.values, at + c, m, w)
        a0, a1, a2, a3, a4, a5 = y[0, 0], y[0, 1], y[0, 2], y[0, 3], y[0, 4], y[0, 5]
        for k in range(m):
            f = own[0, k]
            a0 -= f * Lt[k, 0]
            a1 -= f * Lt[k, 1]
            a2 -= f * Lt[k, 2]
            a3 -= f * Lt[k, 3]
            a4 -= f * Lt[k, 4]
            a5 -= f * Lt[k, 5]
        y[0, 0], y[0, 1], y[0, 2], y[0, 3], y[0, 4], y[0, 5] = a0, a1, a2, a3, a4, a5
        c += 6
    while c < t:
        y, Lt = matrix_view(x, start + c, 1, 1), matrix_view(matrix.values, at + c, m, w)
        a0 = y[0, 0]
        for k in range(m):
            a0 -= Lt[k, 0] * own[0, k]
        y[0, 0] = a0
        c += 1


@inlined
def _backward(matrix, x, b, m, only):
    """Block b of x = u^-1 (x - U x'); `only` as in `_forward`."""
    table, later, first = matrix.table, matrix.later, matrix.table[b, FIRST]
    w = only if only > 0 else table[b, WIDTH]
    D, at = matrix_view(matrix.values, table[b, AT], m, m), table[b, AT] + m * m
    own = matrix_view(x, table[b, START], 1, m)
    if only > 0:
        _subtract_columns(matrix, x, at, own, later[first, BLOCK], m, w, only)
    else:
        for i in range(first, first + table[b, COUNT]):
            p = later[i, BLOCK]
            _subtract_columns(matrix, x, at + later[i, COLUMN], own, p, m, w, table[p, SIZE])
    for r in range(m - 1, -1, -1):
        s = own[0, r]
        for c in range(r + 1, m):
            s -= D[r, c] * own[0, c]
        own[0, r] = s * D[r, r]


@inlined
def _subtract_columns(matrix, x, at, own, p, m, w, t):
    """Subtract U x of block p, of t entries, from the block `own`; its columns of U begin at a place."""
    start, c = matrix.table[p, START], 0
    while c + 6 <= t:
        y, U = matrix_view(x, start + c, 1, 6), matrix_view(matrix.values, at + c, m, w)
        y0, y1, y2, y3, y4, y5 = y[0, 0], y[0, 1], y[0, 2], y[0, 3], y[0, 4], y[0, 5]
        for r in range(m):
            s = U[r, 0] * y0 + U[r, 1] * y1 + U[r, 2] * y2
            own[0, r] -= s + (U[r, 3] * y3 + U[r, 4] * y4 + U[r, 5] * y5)
        c += 6
    while c < t:
        f, U = x[start + c], matrix_view(matrix.values, at + c, m, w)
        for r in range(m):
            own[0, r] -= U[r, 0] * f
        c += 1
