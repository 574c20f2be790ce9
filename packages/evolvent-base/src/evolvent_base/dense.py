"""Products, inverses and modes of small matrices, whose sums have one order: the same digits on every processor.

The `@` of NumPy and its linear algebra call BLAS and LAPACK, whose kernels differ in the order of their sums from one
make of processor to the next. The constants of elements and the states from which runs start do not depend on it.
"""

from __future__ import annotations

import math
from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from evolvent_base.columns import Column, columns_of, each, has_columns, stacked

Array = np.ndarray


def product(*factors: ArrayLike) -> Array:
    """Product of matrices, the last of which may be a vector; (..., n, n) of a stack of them.

    Where columns (`columns.Column`) are among their entries, it is an array of these.
    """
    if any(has_columns(factor) for factor in factors):
        return _product_of_columns([np.asarray(factor) for factor in factors])
    found = np.asarray(factors[-1])
    for factor in reversed(factors[:-1]):
        found = np.einsum("...ij,j" if found.ndim == 1 else "...ij,...jk", np.asarray(factor), found)
    return found


def _product_of_columns(factors: list[Array]) -> Array:
    """Products of the same matrices one by one, whose entries are columns."""
    is_vector, found = factors[-1].ndim == 1, factors[-1]
    for factor in reversed(factors[:-1]):
        count = next((stacked(one).shape[0] for one in (factor, found) if has_columns(one)), None)
        if count is None:
            found = product(factor, found)
            continue
        a, b = stacked(factor, count), stacked(found, count)
        found = columns_of(np.einsum("...ij,...j" if is_vector else "...ij,...jk", a, b))
    return found


def dot(a: Array, b: Array) -> float:
    """Inner product a . b of two real vectors; a column of such where columns are among their entries."""
    if has_columns(a) or has_columns(b):
        count = len(stacked(a if has_columns(a) else b))
        pairs = zip(stacked(a, count), stacked(b, count), strict=True)
        return cast(float, Column(np.array([dot(*pair) for pair in pairs])))
    return float(np.einsum("i,i", a, b))


def norm(a: Array) -> float:
    """Length |a| of a real vector."""
    return cast(float, each(math.sqrt, dot(a, a)))


def inverse(A: ArrayLike) -> Array:
    """Inverse of a symmetric positive definite matrix, by Gauss and Jordan; without pivots, which it does not need.

    (..., n, n) of a stack of them; with columns (`columns.Column`) among its entries it is an array of these.
    """
    if has_columns(A):
        return columns_of(inverse(stacked(A)))
    A = np.asarray(A)
    n = A.shape[-1]
    rows = np.concatenate([A, np.broadcast_to(np.eye(n), A.shape)], axis=-1)
    for k in range(n):
        rows[..., k, :] /= rows[..., k, k, None]
        others = np.arange(n) != k
        rows[..., others, :] -= rows[..., others, k, None] * rows[..., k, None, :]
    return rows[..., n:]


def modes(A: Array) -> tuple[Array, Array]:
    """Eigenvalues and eigenvectors (columns) of a symmetric matrix, by rotations of Jacobi; in no order."""
    A, V = np.array(A, dtype=float), np.eye(len(A))
    pairs = [(p, q) for q in range(len(A)) for p in range(q)]
    for _ in range(30):  # each squares what is left; six are enough
        left = [(p, q) for p, q in pairs if abs(A[p, q]) > 1e-17 * math.sqrt(abs(A[p, p] * A[q, q]))]
        if not left:
            break
        for p, q in left:
            if A[p, q] == 0.0:
                continue
            tau = 0.5 * (A[q, q] - A[p, p]) / A[p, q]
            t = math.copysign(1.0, tau) / (abs(tau) + math.hypot(1.0, tau))
            c = 1.0 / math.sqrt(1.0 + t * t)
            for matrix in (A.T, A, V.T):  # columns, rows
                matrix[[p, q]] = c * matrix[p] - c * t * matrix[q], c * t * matrix[p] + c * matrix[q]
            A[p, q] = A[q, p] = 0.0
    return np.diag(A).copy(), V


def legendre(n: int) -> tuple[Array, Array]:
    """Points and weights of Gauss's rule on [-1, 1]: the zeros of Legendre's polynomial, by Newton's method."""
    points, weights = np.zeros(n), np.zeros(n)
    for i in range(n):
        x = round(-math.cos(math.pi * (i + 0.75) / (n + 0.5)), 3)
        for _ in range(10):  # four are enough
            before, value = 1.0, x
            for k in range(2, n + 1):
                before, value = value, ((2 * k - 1) * x * value - (k - 1) * before) / k
            slope = n * (before - x * value) / (1.0 - x * x)
            x -= value / slope
        points[i], weights[i] = x, 2.0 / ((1.0 - x * x) * slope * slope)
    return points, weights


def facing(shapes: Array) -> Array:
    """Factors (...) of size 1 by which the largest components of mode shapes (..., n) become positive real numbers.

    Notes
    -----
    Which is the first of those that reach 99 % of the largest in size: of the equal ones of a symmetric structure
    round-off makes any the largest.
    """
    size = np.abs(shapes)
    first = np.argmax(size >= 0.99 * size.max(axis=-1, keepdims=True), axis=-1)
    lead = np.take_along_axis(shapes, first[..., None], axis=-1)[..., 0]
    found: Array = np.abs(lead) / np.where(lead == 0.0, 1.0, lead)
    return np.where(lead == 0.0, 1.0, found)
