"""Newton's method for equilibria where pivots do not show the rank of the tangent: by singular values, rank kept.

Pivots of bodies that nothing but constraints and soft springs hold are differences of much larger numbers. Where free
motions or redundant constraints make them vanish they are round-off, which may lie on either side of any limit, and
with it the number of unknowns that are left out changes from one iteration to the next. Singular values of the scaled
tangent, [[K, G^T], [G, 0]], have a gap of many decades there. How many of them vanish is found in an equilibrium and
stays: away from one redundant constraints contradict one another and unbalanced forces turn with free motions, which
makes singular values of the size of the error.
"""

from __future__ import annotations

import math

import numpy as np
import scipy

from evolvent.algebra.singular import decomposed, null_vectors
from evolvent.assembly.families import has_symmetric_stiffness
from evolvent.solvers.common import redundancy
from evolvent.solvers.static import equilibrium as eq
from evolvent.solvers.static.work import MOST_DENSE, Work

Array = np.ndarray

#: Smallest singular values of a scaled tangent, beside the largest, that are zero; share of the forces that may act
#: along free motions.
HELD, BALANCED = 1e-10, 1e-8


def can_rank(work: Work) -> bool:
    """Whether a model is small enough for singular values of its tangent."""
    return work.n_v + work.n_j <= MOST_DENSE


class RankedNewton:
    """Newton's method whose corrections leave out as many singular values as vanish in the state that it begins in.

    Attributes
    ----------
    free : int, free motions along which no force acts, which are left out whatever their singular values become
    redundant : int, scalar constraints that others imply
    """

    def __init__(self, work: Work) -> None:
        self.work = work
        found = work.redundancy
        self.redundant = 0 if found is None else found.constraints - found.rank
        self.free = self._balanced_motions()

    def _balanced_motions(self) -> int:
        """Number of free motions of the state along which neither its own forces nor the whole load act."""
        w, b = self.work, self.work.balance
        X = self.free_motions(0.0)
        forces = []
        for factor in (0.0, 1.0):
            eq.unbalance(w.time, w.step, factor, 1.0, w.model, b, b.r)
            forces.append((w.copies * b.r)[: w.n_v])
        scale = max(float(np.abs(r * b.weight).max()) for r in forces)
        acts = any(float(np.abs(X.T @ r).max(initial=0.0)) > BALANCED * scale for r in forces)
        return 0 if acts else X.shape[1]

    def free_motions(self, factor: float) -> Array:
        """Velocities (nv, k) of independent motions that the tangent leaves free at a load factor."""
        w, b = self.work, self.work.balance
        w.model.info.compliance = 0.0
        eq.unbalance(w.time, w.step, factor, 1.0, w.model, b, b.r)
        X = null_vectors(w.whole_tangent(factor), HELD)[: w.n_v] / b.weight[:, None]
        if not X.size:
            return X
        u, s, _ = np.linalg.svd(X, full_matrices=False)
        # of redundant constraints the multipliers alone are free
        count = int(np.sum(s > redundancy.ZERO * s[0])) if X.shape[1] > self.redundant else 0
        return np.asarray(u[:, : min(count, X.shape[1] - self.redundant)] * b.weight[:, None])

    def balance(self, factor: float, share: float, tolerance: float, most: int) -> int:
        """Newton's method at one load factor; returns as `equilibrium.balance` does."""
        w, b = self.work, self.work.balance
        w.model.info.compliance = 0.0
        b.total[:] = 0.0
        largest, best, stalls = 0.0, math.inf, 0
        b.loop.loose = self.free
        for iteration in range(most):
            if not self._evaluate(iteration, factor, share):
                return eq.NOT_FINITE
            if iteration == 0:
                b.loop.first_unbalance = b.loop.unbalance
            largest = max(largest, float(b.loop.unbalance))
            K = w.whole_tangent(factor)
            if not np.all(np.isfinite(K.data)):
                return eq.SINGULAR
            b.x[:] = self._correction(K)
            b.d[:] = b.x[: w.n_v]
            norm = float(eq.move(1.0, w.model, b))
            if not math.isfinite(norm):
                return eq.NOT_FINITE
            self._reduce_multipliers(K)
            b.loop.correction = b.history[iteration, eq.CORRECTION] = norm
            b.loop.iterations += 1
            stalls += 1 if best <= norm < eq.ROUGH else 0
            best = min(best, norm)
            rough = stalls >= eq.STALLS and b.loop.unbalance <= eq.ROUND_OFF * b.loop.stiffest
            if norm <= tolerance or rough:
                self._evaluate(iteration + 1, factor, share)
                load = float(np.max(np.abs(w.model.P) * b.weight, initial=0.0))
                allowed = eq.CONSISTENT * max(largest, load) + eq.ROUND_OFF * b.loop.stiffest
                if b.loop.loose > 0 and b.loop.unbalance > allowed:
                    return eq.UNBALANCED
                b.loop.factor = factor
                return iteration + 1
        return eq.NO_CONVERGENCE

    def _evaluate(self, iteration: int, factor: float, share: float) -> bool:
        """Unbalance of the state into b.r and a row of the history; returns whether it is finite."""
        w, b = self.work, self.work.balance
        eq.unbalance(w.time, w.step, factor, share, w.model, b, b.r)
        force = np.abs(b.r[: w.n_v])
        moments = b.is_moment != 0
        b.loop.unbalance = float(np.max(force * b.weight))
        b.history[iteration] = force[~moments].max(initial=0.0), force[moments].max(initial=0.0), math.nan
        b.loop.noted = iteration + 1
        return bool(np.all(np.isfinite(b.r)))

    def _correction(self, K: scipy.sparse.csr_matrix) -> Array:
        """Least correction of the unknowns (nu,), as they are scaled, by the singular values that do not vanish."""
        w, b = self.work, self.work.balance
        b.loop.stiffest = float(np.max(np.abs(K.diagonal()[: w.n_v]) * b.weight**2))
        u, s, v, size = decomposed(K)
        rank = min(s.size - self.redundant - self.free, int(np.sum(s > HELD * s[0])))
        b.loop.loose = s.size - rank - self.redundant
        b.loop.quality = float(s[rank - 1] / s[0])
        b.loop.factorizations += 1
        return np.asarray(v[:rank].T @ ((u[:, :rank].T @ (-w.copies * b.r / size)) / s[:rank]) / size)

    def _reduce_multipliers(self, K: scipy.sparse.csr_matrix) -> None:
        """Take from the multipliers what makes no force: moments count as forces at the size of the system."""
        w, b, found = self.work, self.work.balance, self.work.redundancy
        if found is None:
            return
        G = K[w.n_v :, : w.n_v][found.held].toarray() * b.weight / found.sizes[:, None]
        U = np.linalg.svd(G, full_matrices=False)[0][:, : found.rank]
        b.la[found.held] = U @ (U.T @ (found.sizes * b.la[found.held])) / found.sizes


def for_free_motions(work: Work) -> RankedNewton | None:
    """Newton's method by singular values where free motions along which no force acts need it, else None."""
    if not can_rank(work) or not has_symmetric_stiffness(work.model) or np.any(work.balance.spin[:3]):
        return None
    found = RankedNewton(work)
    return found if found.free > 0 else None
