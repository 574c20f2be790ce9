"""Singular values of sparse matrices that are nearly symmetric, scaled so that all rows count alike."""

from __future__ import annotations

import numpy as np
import scipy

Array = np.ndarray


def decomposed(A: scipy.sparse.csr_matrix) -> tuple[Array, Array, Array, Array]:
    """Singular values and vectors of a matrix (n, n) divided by `size`, left and right.

    Returns
    -------
    u, s, v, size : (n, n), (n,), (n, n), (n,) float, A = diag(size) u diag(s) v diag(size)
    """
    size = np.sqrt(abs(A).max(axis=1).toarray().ravel())
    size[size == 0.0] = 1.0
    D = scipy.sparse.diags(1.0 / size)
    return *np.linalg.svd((D @ A @ D).toarray()), size


def null_vectors(A: scipy.sparse.csr_matrix, zero: float) -> Array:
    """Independent vectors (n, k) that A (n, n) takes to zero: singular values up to `zero` beside the largest."""
    _, s, v, size = decomposed(A)
    return np.asarray((v[int(np.sum(s > zero * s[0])) :] / size).T)
