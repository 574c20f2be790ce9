"""Bases of linear models: all modes, the slowest modes, or the modes of Craig and Bampton."""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import numpy as np
import scipy

from evolvent.algebra.eigenproblem import Eigenproblem
from evolvent.algebra.subspaces import constrained
from evolvent.solvers.modal.resolution import Naming
from evolvent_base.errors import InputError

Array = np.ndarray

FULL, MODAL, CRAIG_BAMPTON = "full", "modal", "craig-bampton"
METHODS = (MODAL, CRAIG_BAMPTON)
#: Free directions up to which all modes are taken.
MOST = 3000
#: Boundary coordinates whose share beside the others and the constraints is below this are implied by them.
IMPLIED = 1e-10


@dataclasses.dataclass(frozen=True)
class Structure:
    """M u'' + C u' + K u + G^T la = f, G u = 0, about an equilibrium.

    Attributes
    ----------
    M, C, K : (nv, nv) sparse
    G : (nc, nv) sparse
    weight : (nv,) float, size of each coordinate that counts as 1
    naming : names of what moves, for messages
    """

    M: scipy.sparse.csr_matrix
    C: scipy.sparse.csr_matrix
    K: scipy.sparse.csr_matrix
    G: scipy.sparse.csr_matrix
    weight: Array
    naming: Naming

    def problem(self, more: Array | None = None) -> Eigenproblem:
        """The eigenproblem of M and the symmetric part of K; `more` (n, nv) are rows that are held too."""
        n = self.M.shape[0]
        G = self.G if more is None else scipy.sparse.vstack([self.G, scipy.sparse.csr_matrix(more)]).tocsr()
        K = (0.5 * (self.K + self.K.T)).tocsr()
        return Eigenproblem(
            self.M, scipy.sparse.csr_matrix((n, n)), K, G, self.weight, conservative=True,
            where=self.naming.where, strains=self.naming.strains, rigid=self.naming.rigid(self.weight),
        )  # fmt: skip


class Basis(NamedTuple):
    """Shapes V, V^T M V = 1, and squares of their frequencies by the symmetric stiffness.

    Attributes
    ----------
    V : (nv, m) float
    square : (m,) float, rad2/s2, ascending; 0 of rigid-body modes
    """

    V: Array
    square: Array


def modal_basis(structure: Structure, elastic: int | None) -> Basis:
    """All modes that do not oscillate, and `elastic` that do; None for all."""
    problem = structure.problem()
    if elastic is None and problem.size > MOST:
        raise InputError(
            f"the structure has {problem.size} free directions, too many for a model of all modes; give `modes`"
        )
    square, V = problem.slowest(elastic)
    return Basis(V, square)


def craig_bampton_basis(structure: Structure, rows: Array, fixed: int) -> Basis:
    """Constraint modes of the boundary coordinates, and `fixed` modes with these held, made orthogonal.

    Parameters
    ----------
    structure : Structure
    rows : (nb, nv) float, boundary coordinates, linear in the velocities' coordinates
    fixed : int, how many elastic modes with the boundary held; those that do not oscillate are kept besides

    Notes
    -----
    Craig and Bampton (1968), Coupling of substructures for dynamic analyses, AIAA Journal 6, 1313-1319: u = Psi u_b +
    Phi eta; columns of Psi are static, K Psi + A^T mu = 0 with the boundary moved by 1, columns of Phi are modes with
    the boundary at rest. Where the boundary does not hold the structure, Psi is the solution orthogonal by M to the
    motions that it leaves free. The basis returned is that of the modes of the reduced model.
    """
    rows = _independent(structure, rows)
    problem = structure.problem(rows)
    square, Phi = problem.slowest(fixed)
    loose = Phi[:, square <= 0.0]
    A = scipy.sparse.vstack(
        [structure.G, scipy.sparse.csr_matrix(rows), scipy.sparse.csr_matrix((structure.M @ loose).T)]
    ).tocsr()
    n_c, n_b = structure.G.shape[0], len(rows)
    g = np.zeros((A.shape[0], n_b))
    g[n_c : n_c + n_b] = np.eye(n_b)
    K = (0.5 * (structure.K + structure.K.T)).tocsr()
    Psi = constrained(K, A, np.zeros((structure.M.shape[0], n_b)), g)
    whole = np.hstack([Psi, Phi])
    whole /= np.sqrt(np.einsum("ij,ij->j", whole, structure.M @ whole))
    M = whole.T @ (structure.M @ whole)
    still = _still(structure, whole, M)
    Z = scipy.linalg.null_space(still.T @ (structure.M @ whole)) if still.shape[1] else np.eye(len(M))
    M = Z.T @ M @ Z
    square, w = scipy.linalg.eigh(Z.T @ (whole.T @ (K @ whole)) @ Z, 0.5 * (M + M.T))
    V = whole @ (Z @ w)
    square[np.abs(square) <= problem.noise(V)] = 0.0
    return Basis(np.hstack([still, V]), np.concatenate([np.zeros(still.shape[1]), square]))


def _still(structure: Structure, whole: Array, M: Array) -> Array:
    """Motions without stiffness (nv, k) in the span of a basis (nv, m) with masses M (m, m); none where it lacks one.

    The basis has shapes of high stiffness, in whose round-off their squares are lost.
    """
    still = structure.problem().still
    left = still - whole @ np.linalg.lstsq(M, whole.T @ (structure.M @ still), rcond=None)[0]
    size = np.einsum("ij,ij->j", left, structure.M @ left)
    return still if np.all(size < IMPLIED) else still[:, :0]


def _independent(structure: Structure, rows: Array) -> Array:
    """Combinations of boundary coordinates that the constraints leave free and independent: (r, nv)."""
    n = structure.M.shape[0]
    rows = rows[np.any(rows != 0.0, axis=1)]  # a cable has no twist
    X = constrained(structure.M, structure.G, rows.T, np.zeros((structure.G.shape[0], len(rows))))
    H = rows @ X
    # beside what they would be without constraints
    free = constrained(structure.M, scipy.sparse.csr_matrix((0, n)), rows.T, np.zeros((0, len(rows))))
    size = np.sqrt(np.einsum("ij,ji->i", rows, free))
    H = 0.5 * (H + H.T) / np.outer(size, size)
    values, w = np.linalg.eigh(H)
    keep = values > IMPLIED
    if not np.any(keep):
        raise InputError("no coordinate of the boundary can move; name other parts, or use method='modal'")
    return (w[:, keep] / np.sqrt(values[keep])).T @ (rows / size[:, None])


def residual_flexibility(structure: Structure, basis: Basis, forces: Array) -> Array:
    """Static displacements (nv, k) by forces (nv, k), without what the modes of the basis take of them.

    Notes
    -----
    K u + G^T la + M V mu = f with G u = 0 and V^T M u = 0: the sum of shape shape^T f / w^2 over the modes that the
    basis leaves out.
    """
    A = scipy.sparse.vstack([structure.G, scipy.sparse.csr_matrix((structure.M @ basis.V).T)]).tocsr()
    return constrained(structure.K, A, forces, np.zeros((A.shape[0], forces.shape[1])))
