"""Subspaces of an eigenproblem: multiple eigenvalues, shapes along axes, constraints."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import scipy

Array = np.ndarray

#: Relative difference of squares of frequencies that count as equal.
EQUAL = 1e-8
#: Part of a rigid-body motion that modes of equal frequency must take for one of them to be turned into it.
EXCITED = 1e-6


def regular_shift(s2: float, squares: Array) -> float:
    """A shift from s2 on that is not close to the negative of a square: K + s2 M would be singular."""
    while np.any(np.abs(squares + s2) < 0.05 * s2):
        s2 *= 1.2
    return s2


def all_of(find: Callable[[], tuple[Array, Array]], M: Any = None) -> tuple[Array, Array]:
    """Eigenvalues and vectors of several calls of `find`, each from another start, until nothing is new.

    One start of a Krylov method sees one vector of a multiple eigenvalue, but for what round-off brings in. M, where
    given, is the inner product in which `find` returns orthonormal vectors.
    """
    values, vectors = find()
    for _ in range(8):
        added = False
        for value, x in zip(*(lambda e: (e[0], e[1].T))(find()), strict=True):
            near = 1e-2 if M is not None else 1e-3  # what round-off splits; other vectors have own directions
            same, rest = vectors[:, np.abs(values - value) <= near * np.abs(value)], x
            if M is None:
                if same.shape[1]:
                    rest = x - same @ np.linalg.lstsq(same, x, rcond=None)[0]
                size = float(np.linalg.norm(rest))
                new = size > 1e-3 * float(np.linalg.norm(x))
            else:
                for _ in range(2):
                    rest = rest - same @ (same.T @ (M @ rest))
                size = math.sqrt(max(float(rest @ (M @ rest)), 0.0))
                new = size > 1e-3
            if new:
                values = np.append(values, value)
                vectors = np.column_stack([vectors, rest / size])
                added = True
        if not added:
            break
    return values, vectors


def constrained(H: Any, A: Any, f: Array, g: Array) -> Array:
    """The solution u (n, k) of H u + A^T mu = f, A u = g; A's rows must be independent, H regular where they leave it.

    Parameters
    ----------
    H : (n, n) sparse
    A : (m, n) sparse
    f, g : (n, k) and (m, k) float
    """
    n, m = H.shape[0], A.shape[0]
    if m == 0:
        found: Array = scipy.sparse.linalg.splu(H.tocsc()).solve(np.ascontiguousarray(f))
        return found
    size = abs(H).max(axis=1).toarray().ravel()
    typical = float(np.median(size[size > 0.0])) if np.any(size) else 1.0
    scale = typical / np.sqrt(np.asarray(A.multiply(A).sum(axis=1)).ravel())
    A = scipy.sparse.diags(scale) @ A
    lu = scipy.sparse.linalg.splu(scipy.sparse.bmat([[H, A.T], [A, None]]).tocsc())
    whole: Array = lu.solve(np.vstack([f, scale[:, None] * g]))
    return whole[:n]


def equal(squares: Array) -> list[tuple[int, int]]:
    """Ranges (first, last + 1) of squares of frequencies, ascending, that are equal; single ones are left out."""
    found, first = [], 0
    for last in range(1, len(squares) + 1):
        if last == len(squares) or squares[last] - squares[last - 1] > EQUAL * abs(squares[last]):
            if last > first + 1:
                found.append((first, last))
            first = last
    return found


def orthonormal(squares: Array, V: Array, M: Any) -> Array:
    """V (n, k) with V^T M V = 1, of shapes with u^T M u = 1, which are orthogonal where squares differ."""
    V = V.copy()
    for first, last in equal(squares):
        L = np.linalg.cholesky(V[:, first:last].T @ (M @ V[:, first:last]))
        V[:, first:last] = scipy.linalg.solve_triangular(L, V[:, first:last].T, lower=True).T
    return V


def along_axes(squares: Array, shape: Array, M: Any, r: Array) -> Array:
    """Real shapes (k, n), those of equal frequency turned so that each is excited by another rigid-body motion.

    Parameters
    ----------
    squares : (k,) float, rad2/s2, ascending
    shape : (k, n) float, u^T M u = 1
    M : (n, n) sparse
    r : (n, 6) float, rigid-body motions, in the order in which they are tried
    """
    found, momenta = shape.copy(), M @ r
    size = np.sqrt(np.einsum("ij,ij->j", r, momenta))
    for first, last in equal(squares):
        count = last - first
        turn = np.zeros((count, 0))
        for column, whole in zip((shape[first:last] @ momenta).T, size, strict=True):
            rest = column - turn @ (turn.T @ column)
            if np.linalg.norm(rest) > EXCITED * whole and turn.shape[1] < count:
                rest = rest - turn @ (turn.T @ rest)
                turn = np.column_stack([turn, rest / np.linalg.norm(rest)])
        if turn.shape[1] < count:
            turn = np.column_stack([turn, scipy.linalg.null_space(turn.T)])
        found[first:last] = turn.T @ shape[first:last]
    return found
