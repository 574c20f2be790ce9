"""The mass matrix of a position, and the norm by which motions without a stiffness are measured."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import scipy

Array = np.ndarray


class Mass:
    """A mass matrix M, and a root of it that is factored once.

    Parameters
    ----------
    matrix : (nv, nv), symmetric, sparse or not

    Notes
    -----
    M = P^T L L^T P, with an order P in which L has a narrow band: masses couple the ends of an element only. The norm
    of L^-1 P f is that of f by M^-1.
    """

    def __init__(self, matrix: Any) -> None:
        self.matrix = scipy.sparse.csr_matrix(matrix)

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

    def half(self, f: Array) -> Array:
        """L^-1 P f of forces f, (nv,) or (nv, n)."""
        order, L = self._factor
        return _solved(L, f[order], "N")

    def back(self, w: Array) -> Array:
        """P^T L^-T w of what `half` gives, so that the energy of the motion is w.w/2: (nv,) or (nv, n)."""
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
