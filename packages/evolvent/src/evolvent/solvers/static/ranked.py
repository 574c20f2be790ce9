"""Newton's method for equilibria where pivots do not show the rank of the tangent: of independent constraints alone.

Pivots of bodies that nothing but constraints and soft springs hold are differences of much larger numbers. Where free
motions or redundant constraints make them vanish they are round-off, which may lie on either side of any limit, and
with it the number of unknowns that are left out changes from one iteration to the next. Here as many constraints as
are independent are solved for, with interchanges of rows; the others follow from them, and that they do is checked.
Free motions show as singular values of the scaled tangent, [[K, G^T], [G, 0]], with a gap of many decades. Those along
which no force acts are counted in an equilibrium, and their number stays: away from one unbalanced forces turn with
free motions, which makes singular values of the size of the error.
"""

from __future__ import annotations

import math

import numpy as np
import scipy

from evolvent.algebra.singular import Scaled
from evolvent.assembly.families import has_symmetric_stiffness
from evolvent.solvers.common import redundancy
from evolvent.solvers.static import equilibrium as eq
from evolvent.solvers.static.work import Work

Array = np.ndarray

#: Smallest singular values of a scaled tangent, beside the largest, that are zero; share of the forces that may act
#: along free motions.
HELD, BALANCED = 1e-10, 1e-8
#: Smallest singular value, beside the largest, below which the choice of independent constraints is made again.
POOR = 1e-9


class RankedNewton:
    """Newton's method with independent constraints, whose corrections leave out free motions.

    Attributes
    ----------
    free : int, free motions along which no force acts, which are left out whatever their singular values become
    kept : (n,) int, unknowns without the multipliers of the constraints that others imply
    """

    def __init__(self, work: Work) -> None:
        self.work = work
        self._evaluate_at(0.0)
        self.kept = self._independent(work.whole_tangent(0.0))
        self.free = self._balanced_motions()

    def _independent(self, K: scipy.sparse.csr_matrix) -> Array:
        """Unknowns without multipliers that others imply, by the gradients in a tangent."""
        w, found = self.work, self.work.redundancy
        if found is None:
            return np.arange(w.n_v + w.n_j)
        rows = redundancy.independent_rows(self._gradients(K), found.rank)
        return np.setdiff1d(np.arange(w.n_v + w.n_j), w.n_v + np.delete(found.held, rows))

    def _gradients(self, K: scipy.sparse.csr_matrix) -> scipy.sparse.csr_matrix:
        """Gradients of the constraints in a tangent, moments as forces at the size of the system."""
        w, found = self.work, self.work.redundancy
        assert found is not None
        rows, columns = scipy.sparse.diags(1.0 / found.sizes), scipy.sparse.diags(w.balance.weight)
        return rows @ K[w.n_v :, : w.n_v][found.held] @ columns

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

    def _evaluate_at(self, factor: float) -> None:
        w, b = self.work, self.work.balance
        w.model.info.compliance = 0.0
        eq.unbalance(w.time, w.step, factor, 1.0, w.model, b, b.r)

    def free_motions(self, factor: float) -> Array:
        """Velocities (nv, k) of independent motions that the tangent leaves free at a load factor."""
        w, weight = self.work, self.work.balance.weight
        self._evaluate_at(factor)
        K = Scaled(w.whole_tangent(factor)[self.kept][:, self.kept])
        X = (K.null(HELD)[0] / K.size[:, None])[: w.n_v] / weight[:, None]
        return np.asarray(np.linalg.qr(X)[0] * weight[:, None])

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
            b.loop.correction = b.history[iteration, eq.CORRECTION] = norm
            b.loop.iterations += 1
            stalls += 1 if best <= norm < eq.ROUGH else 0
            best = min(best, norm)
            rough = stalls >= eq.STALLS and b.loop.unbalance <= eq.ROUND_OFF * b.loop.stiffest
            if norm <= tolerance or rough:
                self._reduce_multipliers(K)
                self._evaluate(iteration + 1, factor, share)
                load = float(np.max(np.abs(w.model.P) * b.weight, initial=0.0))
                allowed = eq.CONSISTENT * max(largest, load) + eq.ROUND_OFF * b.loop.stiffest
                if b.loop.loose > 0 and b.loop.unbalance > allowed:
                    return eq.UNBALANCED
                if w.redundancy is not None and w.redundancy.contradiction(b.r[w.n_v :], w.time):
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
        scaled = Scaled(K[self.kept][:, self.kept])
        V, quality = scaled.null(HELD, self.free)
        if w.redundancy is not None and (quality < POOR or V.shape[1] > self.free):
            self.kept = self._independent(K)
            scaled = Scaled(K[self.kept][:, self.kept])
            V, quality = scaled.null(HELD, self.free)
        b.loop.loose, b.loop.quality = V.shape[1], quality
        b.loop.factorizations += 1
        x = np.zeros(w.n_v + w.n_j)
        x[self.kept] = scaled.solve(-(w.copies * b.r)[self.kept], V)
        return x

    def _reduce_multipliers(self, K: scipy.sparse.csr_matrix) -> None:
        """Take from the multipliers what makes no force: moments count as forces at the size of the system."""
        b, found = self.work.balance, self.work.redundancy
        if found is None:
            return
        G = self._gradients(K)
        chosen = np.isin(self.work.n_v + found.held, self.kept)
        own, others = G[chosen], G[~chosen]
        # rows that others imply, as sums of those: least squares, by the matrix that keeps their condition
        whole = scipy.sparse.bmat([[scipy.sparse.identity(G.shape[1]), own.T], [own, None]], format="csc")
        right = scipy.sparse.vstack([others.T, scipy.sparse.csr_matrix((own.shape[0], others.shape[0]))])
        idle = np.zeros((chosen.size, others.shape[0]))
        idle[chosen] = scipy.sparse.linalg.splu(whole).solve(right.toarray())[G.shape[1] :]
        idle[~chosen] = -np.eye(others.shape[0])
        Q = np.linalg.qr(idle)[0]
        scaled = found.sizes * b.la[found.held]
        b.la[found.held] = (scaled - Q @ (Q.T @ scaled)) / found.sizes


def for_free_motions(work: Work) -> RankedNewton | None:
    """Newton's method by singular values where free motions along which no force acts need it, else None."""
    if not has_symmetric_stiffness(work.model) or np.any(work.balance.spin[:3]):
        return None
    found = RankedNewton(work)
    return found if found.free > 0 else None
