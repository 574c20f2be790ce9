"""Sparse matrices that may be singular: null vectors, and solutions that leave them out.

Factors of a matrix with rows and columns interchanged show its smallest singular values by inverse iteration, however
small they are beside the others; its pivots alone do not.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy

Array = np.ndarray

#: Vectors that the iteration begins with, and how often they are multiplied by the inverse.
_FIRST, _ROUNDS = 6, 3
#: What is added to a scaled matrix beside its norm, so that its inverse multiplies all null vectors alike.
_SHIFT = 1e-15


class Scaled:
    """A sparse matrix (n, n) that is nearly symmetric, divided by sizes of its rows and columns, so that all count.

    Attributes
    ----------
    B : scaled matrix, A = diag(size) B diag(size)
    size : (n,) float
    norm : float, bound of the largest singular value of B
    """

    def __init__(self, A: scipy.sparse.csr_matrix) -> None:
        self.size = np.sqrt(abs(A).max(axis=1).toarray().ravel()) if A.shape[0] else np.zeros(0)
        self.size[self.size == 0.0] = 1.0
        D = scipy.sparse.diags(1.0 / self.size)
        self.B = scipy.sparse.csc_matrix(D @ A @ D)
        norms = (float(abs(self.B).sum(axis=axis).max()) if A.shape[0] else 0.0 for axis in (0, 1))
        self.norm = float(np.sqrt(np.prod(list(norms)))) or 1.0
        self._shifted: Any = None

    @property
    def shifted(self) -> Any:
        """Factors of B with a shift."""
        if self._shifted is None:
            shift = _SHIFT * self.norm * scipy.sparse.identity(self.size.size, format="csc")
            self._shifted = scipy.sparse.linalg.splu(self.B + shift)
        return self._shifted

    def null(self, zero: float, least: int = 0, *, left: bool = False) -> tuple[Array, float]:
        """Vectors that B, or its transpose, takes to zero, and the smallest singular value that is not, beside `norm`.

        Parameters
        ----------
        zero : float, singular values up to this, beside `norm`, are zero
        least : int, number of vectors that are taken at least, those of the smallest singular values
        left : bool, whether of the transpose

        Returns
        -------
        V, smallest : (n, k) float, orthonormal, and float
        """
        n, count = self.size.size, least + _FIRST
        B = self.B.T if left else self.B
        first, second = ("N", "T") if left else ("T", "N")
        while True:
            V = np.random.default_rng(0).standard_normal((n, min(count, n)))
            for _ in range(_ROUNDS):
                V = np.linalg.qr(self.shifted.solve(V, trans=first))[0]
                V = np.linalg.qr(self.shifted.solve(V, trans=second))[0]
            _, s, w = np.linalg.svd(B @ V, full_matrices=False)
            found = max(int(np.sum(s <= zero * self.norm)), least)
            if found < V.shape[1] or V.shape[1] == n:
                V = (V @ w.T)[:, ::-1][:, :found]
                return V, float(s[::-1][found] / self.norm) if found < s.size else 0.0
            count *= 2

    def solve(self, r: Array, V: Array) -> Array:
        """Solution of A x = r (n,), least in the scaled unknowns, without the singular vectors V (n, k)."""
        scaled = r / self.size
        if not V.shape[1]:
            return np.asarray(scipy.sparse.linalg.splu(self.B).solve(scaled)) / self.size
        U = self.null(0.0, V.shape[1], left=True)[0]
        bordered = scipy.sparse.bmat([[self.B, U], [V.T, None]], format="csc")
        found = scipy.sparse.linalg.splu(bordered).solve(np.append(scaled, np.zeros(V.shape[1])))
        return np.asarray(found[: r.size]) / self.size


def null_vectors(A: scipy.sparse.csr_matrix, zero: float) -> Array:
    """Independent vectors (n, k) that A (n, n) takes to zero: singular values up to `zero` beside the largest."""
    scaled = Scaled(A)
    return np.asarray(scaled.null(zero)[0] / scaled.size[:, None])
