"""Stiffness of a mechanism at a position, and the moves that follow from it."""

from __future__ import annotations

import dataclasses
import functools
from typing import Any

import numpy as np
import scipy

from evolvent.analysis.margins.mass import Mass

Array = np.ndarray

#: Rank of constraints; least stiffness of a scale beside the median.
_RANK, _SOFTEST = 1e-10, 1e-6
#: Gap of constraints and correction at the end, and the correction that may be round-off where it no longer falls.
_REACHED, _SETTLED, _ROUGH = 1e-11, 1e-11, 1e-8
#: Largest move of an iteration beside the size of the system.
LARGEST = 0.3


@dataclasses.dataclass(frozen=True)
class Stiffness:
    """Stiffness of a position along the motions that constraints and held coordinates leave free.

    Attributes
    ----------
    K : (nv, nv) float, tangent, sparse; M : mass.Mass
    A : (n, nv) float, gradients of what holds, and rows : (m,) int, those of them that are independent
    F : (nv,) float, forces on the left of the equations
    scale : (nv,) float, D
    free : (nv, j) float, motions that nothing resists
    lowest : float, lowest eigenvalue of S, or 0
    """

    K: Any
    M: Mass
    A: Array
    rows: Array
    F: Array
    scale: Array
    free: Array
    lowest: float

    @functools.cached_property
    def _decomposed(self) -> Any:
        """The stiffness, bordered by what holds and by the free motions, decomposed."""
        A, X, D = self.A[self.rows], self.free, self.scale
        MX, norms = self.M @ X, np.linalg.norm(A * D, axis=1)
        C = np.vstack([A * D / norms[:, None], (MX * D[:, None]).T / np.linalg.norm(MX * D[:, None], axis=0)[:, None]])
        C, D = scipy.sparse.csc_matrix(C), scipy.sparse.diags(D)
        return scipy.sparse.linalg.splu(scipy.sparse.bmat([[D @ self.K @ D, C.T], [C, None]], format="csc"))

    def move(self, b: Array, F: Array) -> tuple[Array, Array]:
        """The move d that fulfils the constraints A d = b, with the forces F + K d in balance.

        Returns
        -------
        d : (nv,) float; free : (nv, j) float, the free motions, of K and A, where those of `free` are not quite
        """
        A, X, D = self.A[self.rows], self.free, self.scale
        norms, n, j = np.linalg.norm(A * D, axis=1), D.size, X.shape[1]
        MX, lu = self.M @ X, self._decomposed
        bounds = np.zeros((norms.size + j, 1 + j))
        if j:  # the bordered matrix is regular: of all moves across the former free motions these are free
            bounds[: norms.size, 1:] = -(A @ X) / norms[:, None]
            right = np.vstack([-D[:, None] * (self.K @ X), bounds[:, 1:]])
            X = X + D[:, None] * lu.solve(right)[:n]
            MX = self.M @ X
            F = F - MX @ np.linalg.solve(X.T @ MX, X.T @ F)
        bounds[: norms.size, 0] = b[self.rows] / norms
        return D * lu.solve(np.concatenate([-D * F, bounds[:, 0]]))[:n], X


def scale_of(K: Any, weight: Array) -> Array:
    """Scales D (nv,) by which the stiffness of every coordinate is near 1; `weight` (nv,) are sizes of moves."""
    energy = np.abs(K.diagonal()) * weight**2
    least = _SOFTEST * float(np.median(energy[energy > 0.0])) if np.any(energy) else 1.0
    return np.asarray(weight / np.sqrt(np.maximum(energy, least)))


def independent(B: Array, *, mode: str = "full") -> tuple[Array, Array]:
    """Rows of B (n, nv) that are independent, in order, and the moves (nv, nv - m) that B does not hold.

    The latter are empty where the `mode` is "r".
    """
    norms = np.linalg.norm(B, axis=1)
    columns = (B / np.where(norms > 0.0, norms, 1.0)[:, None]).T
    if mode == "r":
        columns = columns[np.any(columns, axis=1)]
    *Q, R, order = scipy.linalg.qr(columns, pivoting=True, mode=mode)
    pivots = np.abs(np.diagonal(R))
    rank = int(np.sum(pivots > _RANK * pivots.max(initial=0.0)))
    return np.sort(order[:rank]), Q[0][:, rank:] if Q else np.zeros((B.shape[1], 0))


def fulfils(off: float) -> bool:
    """Whether gaps of constraints and coordinates, rad or m, are round-off."""
    return off <= _REACHED


def is_settled(off: float, size: float, before: float) -> bool:
    """Whether an iteration has ended: by its gaps, its move, and the move before, beside the size of the system."""
    return fulfils(off) and (size <= _SETTLED or (size <= _ROUGH and size >= 0.5 * before))
