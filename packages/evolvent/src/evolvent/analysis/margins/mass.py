"""The mass matrix of a position, and the norm by which motions without a stiffness are measured."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import scipy

Array = np.ndarray
#: Largest size of a dense mass matrix that is kept dense: below it the calls of sparse libraries take longer.
_SMALL = 60


class Mass:
    """A mass matrix M, and a root of it that is factored once.

    Parameters
    ----------
    matrix : (nv, nv), symmetric, sparse or not

    Notes
    -----
    M = P^T L L^T P, with an order P in which L has a narrow band: masses couple the ends of an element only. The norm
    of L^-1 P f is that of f by M^-1. For a small dense matrix P is the identity, and L^-1 is stored.
    """

    def __init__(self, matrix: Any) -> None:
        is_small = isinstance(matrix, np.ndarray) and len(matrix) <= _SMALL
        self.matrix = matrix if is_small else scipy.sparse.csr_matrix(matrix)

    def __matmul__(self, x: Array) -> Array:
        return np.asarray(self.matrix @ x)

    def diagonal(self) -> Array:
        """Diagonal, (nv,)."""
        return np.asarray(self.matrix.diagonal())

    @functools.cached_property
    def _factor(self) -> tuple[Array, Array]:
        """Order of the coordinates, (nv,), and the band of L, (bandwidth + 1, nv).

        Raises
        ------
        LinAlgError
            If a motion has no mass.
        """
        order = scipy.sparse.csgraph.reverse_cuthill_mckee(self.matrix, symmetric_mode=True)
        lower = scipy.sparse.tril(self.matrix[order][:, order]).tocoo()
        below = lower.row - lower.col
        band = np.zeros((int(below.max(initial=0)) + 1, order.size))
        band[below, lower.col] = lower.data
        return order, scipy.linalg.cholesky_banded(band, lower=True)

    @functools.cached_property
    def _inverse(self) -> Array | None:
        """L^-1, (nv, nv), of a small dense matrix; None of a sparse one.

        Raises
        ------
        LinAlgError
            If a motion has no mass.
        """
        if not isinstance(self.matrix, np.ndarray):
            return None
        masses = self.diagonal()
        if not np.all(masses > 0.0):
            raise np.linalg.LinAlgError("a mass is 0")
        scale = 1.0 / np.sqrt(masses)
        found: Array = np.linalg.inv(np.linalg.cholesky(scale[:, None] * self.matrix * scale)) * scale
        return found

    def half(self, f: Array) -> Array:
        """L^-1 P f of forces f, (nv,) or (nv, n)."""
        if self._inverse is not None:
            return np.asarray(self._inverse @ f)
        order, L = self._factor
        return _solved(L, f[order], "N")

    def back(self, w: Array) -> Array:
        """P^T L^-T w of what `half` gives, so that the energy of the motion is w.w/2: (nv,) or (nv, n)."""
        if self._inverse is not None:
            return np.asarray(self._inverse.T @ w)
        order, L = self._factor
        found = np.empty_like(w)
        found[order] = _solved(L, w, "T")
        return found


def _solved(L: Array, right: Array, trans: str) -> Array:
    """L x = right or L^T x = right, of a band L."""
    if not right.size:
        return np.zeros_like(right)
    found, info = scipy.linalg.lapack.dtbtrs(L, right.reshape(right.shape[0], -1), uplo="L", trans=trans)
    if info != 0:
        raise np.linalg.LinAlgError("a mass is 0")
    return np.asarray(found).reshape(right.shape)
