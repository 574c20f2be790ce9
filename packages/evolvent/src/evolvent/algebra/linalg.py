"""Small dense and banded symmetric positive definite systems, solved in place."""

import math

from evolvent.compiled.jit import inlined, kernel


@kernel
def cholesky(A, n):
    """Lower Cholesky factor of A[:n, :n] in place; returns False where A is not positive definite.

    Parameters
    ----------
    A : (m, m) float, m >= n; only the lower triangle is read and written
    n : int
    """
    for j in range(n):
        d = A[j, j]
        for k in range(j):
            d -= A[j, k] * A[j, k]
        if not d > 0.0:
            return False
        d = math.sqrt(d)
        A[j, j] = d
        for i in range(j + 1, n):
            s = A[i, j]
            for k in range(j):
                s -= A[i, k] * A[j, k]
            A[i, j] = s / d
    return True


@kernel
def cholesky_solve(L, n, x):
    """Solve L L^T x = b in place: x holds b on entry. L : (m, m), x : (m,)."""
    for i in range(n):
        s = x[i]
        for k in range(i):
            s -= L[i, k] * x[k]
        x[i] = s / L[i, i]
    for i in range(n - 1, -1, -1):
        s = x[i]
        for k in range(i + 1, n):
            s -= L[k, i] * x[k]
        x[i] = s / L[i, i]


@kernel
def banded_ldl(A, n, w):
    """L D L^T of a symmetric banded matrix in place; returns the first non-positive pivot's row, or -1.

    Parameters
    ----------
    A : (n, w + 1) float, A[i, k] = a(i, i - k), the band below the diagonal; overwritten by D (k = 0) and L
    n, w : int, size and half bandwidth

    Notes
    -----
    A pivot counts as non-positive below 1e-13 of its diagonal: the rows before it already imply that row.
    """
    for i in range(n):
        first = max(0, i - w)
        a_ii = A[i, 0]
        for j in range(first, i):
            s = A[i, i - j]
            for k in range(max(first, j - w), j):
                s -= A[i, i - k] * A[j, j - k] * A[k, 0]
            A[i, i - j] = s / A[j, 0]
        d = a_ii
        for k in range(first, i):
            d -= A[i, i - k] * A[i, i - k] * A[k, 0]
        if not d > 1e-13 * a_ii:
            return i
        A[i, 0] = d
    return -1


@kernel
def banded_ldl_solve(A, n, w, x):
    """Solve with the factors of `banded_ldl`: x : (n,) holds the right-hand side, then the solution."""
    for i in range(n):
        s = x[i]
        for k in range(max(0, i - w), i):
            s -= A[i, i - k] * x[k]
        x[i] = s
    for i in range(n):
        x[i] /= A[i, 0]
    for i in range(n - 1, -1, -1):
        s = x[i]
        for k in range(i + 1, min(n, i + w + 1)):
            s -= A[k, k - i] * x[k]
        x[i] = s


@inlined
def banded_solve_vectors(A, first, n, w, x, at):
    """Solve for n vectors of 3 components that stand one after the other in x from index `at`, in place.

    Parameters
    ----------
    A : (N, w + 1 or more) float, rows `first` to first + n: in column 0 the inverse of D, in column k the entry
        L[i, i - k] of L D L^T
    n, w : int, size and half bandwidth
    """
    for i in range(n):
        j = at + 3 * i
        a, b, c = x[j], x[j + 1], x[j + 2]
        for k in range(min(i, w), 0, -1):  # the latest result last, so that other products need not wait for it
            m, j = A[first + i, k], at + 3 * (i - k)
            a -= m * x[j]
            b -= m * x[j + 1]
            c -= m * x[j + 2]
        j = at + 3 * i
        x[j], x[j + 1], x[j + 2] = a, b, c
    for i in range(n - 1, -1, -1):
        j, d = at + 3 * i, A[first + i, 0]
        a, b, c = d * x[j], d * x[j + 1], d * x[j + 2]
        for k in range(min(n - 1 - i, w), 0, -1):
            m, j = A[first + i + k, k], at + 3 * (i + k)
            a -= m * x[j]
            b -= m * x[j + 1]
            c -= m * x[j + 2]
        j = at + 3 * i
        x[j], x[j + 1], x[j + 2] = a, b, c
