"""The eigenproblem of M, C, K under constraints G u = 0: the slowest modes, or all of them."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import scipy

from evolvent.algebra.poles import SPLIT, SYMMETRIC, causes_of, is_round_off
from evolvent.algebra.subspaces import all_of, orthonormal, regular_shift
from evolvent_base.dense import facing
from evolvent_base.errors import InputError

Array = np.ndarray

#: Up to so many free directions modes are found by dense algebra; half as many where velocities count.
DENSE = 300
#: Poles below this part of the shift are zero where zeros are double.
ZERO = 1e-6
#: What a square of a frequency may owe to round-off, in parts of the sum of all products behind it.
ROUND_OFF = 5e-14
#: Row of a stiffness beside the largest, below which it is round-off.
EPSILON = 1e-16
#: How many times its round-off the square of a frequency must be below 0 for the motion to grow.
SURE = 10.0
#: Squares of frequencies above so many times the shift are found without it.
FAR = 1e8
#: Modes below this part of the shift (poles, of its root) are computed again: by Rayleigh and Ritz, by a lower shift.
SLOW_SQUARE, SLOW_POLE = 1e-6, 1e-4
#: Part of a shape, by the norm of the mass matrix, by which it must differ from others to count as another one.
DISTINCT = 1e-3
#: Part of the round-off of motions without stiffness that stays when it is taken out of K.
CLEANED = 1e-10
#: Singular values, beside the largest, of motions that constraints allow.
INDEPENDENT = 1e-9
#: Round-off, beside the slowest square that is none, below which what strains a part has balanced its stiffness.
CANCELLED = 1e-4
#: Residual of a mode beside its share of the shifted inverse, from which it is refused. Of symmetric matrices the error
#: of the square is of second order in it.
UNRESOLVED = 1e-4
#: Real part, beside the modulus, from which a pole grows; number of slowest motions that are examined where all are
#: too many.
GROWS, LOOKED_AT = 1e-6, 20
#: Free directions up to which dense algebra replaces a Krylov method that fails.
MOST_DENSE = 3000
_ROUND_OFF_LEFT = (
    "the slowest modes are lost in round-off: the stiffness differs too much between directions, as of extremely thin "
    "strips; {size} free directions are more than the {most} of dense algebra; take fewer elements or a thicker section"
)
_STRAINED = (
    "a mode of {part!r} is lost in round-off: it strains that part, but its stiffness is below the round-off of the "
    "stiffest directions; take fewer elements, a thicker section, a stiffer spring, or a Beam of formulation 'cable'"
)
_UNRESOLVED = (
    "mode {k}, which moves {where} most, is not resolved: its equations are off by {share:.1g} of their terms, since "
    "the stiffness differs too much between directions; take fewer elements or a thicker section there"
)


def _somewhere(shape: Array) -> str:
    return f"coordinate {int(np.argmax(np.abs(shape)))}"


class Eigenproblem:
    """The eigenproblem of M, C, K under G u = 0.

    Parameters
    ----------
    M, C, K : (n, n) sparse
    G : (m, n) sparse
    weight : (n,) float, size of each coordinate that counts as 1
    conservative : bool, whether K is symmetric but for round-off
    where : called with a shape (n,) beside `weight`; where it moves most, for messages
    strains : of shapes (n, k) without stiffness, what round-off may hide, and whether slow modes: the part strained
    rigid : (n, r) float, orthonormal beside `weight`, motions in whose span all motions without stiffness are; None
        where they are not known
    coarse : (n,) float, what adds to K where its round-off is judged; 0 if left out

    Notes
    -----
    The motions without stiffness that `rigid` and G leave, `still`, are found before the others: what round-off leaves
    of their stiffness, which may be more than that of slow modes, is taken out of K.
    """

    def __init__(
        self, M: Any, C: Any, K: Any, G: Any, weight: Array, *, conservative: bool,
        where: Callable[[Array], str] = _somewhere, strains: Callable[[Array, Array, Array], str] = lambda *_: "",
        rigid: Array | None = None, coarse: Array | None = None,
    ) -> None:  # fmt: skip
        self.where, self.strains = where, strains
        self.M, self.C, self.K, self.n = M.tocsc(), C.tocsc(), K.tocsc(), K.shape[0]
        scale, size = abs(K).max(axis=1).toarray().ravel(), G.shape[0]
        norms = np.sqrt(np.asarray(G.multiply(G).sum(axis=1)).ravel()) if size else np.zeros(0)
        # rows of bodies that constraints alone hold may have nothing but round-off
        self.typical = float(np.median(scale[scale > EPSILON * scale.max()])) if np.any(scale) else 1.0
        self.G = scipy.sparse.diags(self.typical / norms) @ G if size else G
        self.size = self.n - size
        m = M.diagonal()
        self.fastest = float(np.max(np.abs(K.diagonal()) / m)) or 1.0  # of free bodies alone any shift serves
        off = scipy.sparse.diags(1.0 / np.maximum(scale, 1e-300)) @ abs(K - K.T)
        reciprocal = conservative or float(off.max()) <= SYMMETRIC
        self.symmetric = C.nnz == 0 and reciprocal
        self.causes = causes_of(C, reciprocal)
        if self.symmetric:
            self.K = (0.5 * (K + K.T)).tocsc()
        self.weight = weight
        self.rng = np.random.default_rng(1)
        self.symmetric_part = self.K if self.symmetric else (0.5 * (self.K + self.K.T)).tocsc()
        self.sizes = abs(self.K) if coarse is None else (abs(self.K) + scipy.sparse.diags(coarse)).tocsc()
        self.still = self.momenta = np.zeros((self.n, 0))
        if rigid is not None:
            self.still = self._without_stiffness(rigid)
            self.momenta = self.M @ self.still

    def inverse(self, s2: float, s: float = 0.0) -> Any:
        """Function f -> u of (K + s C + s2 M) u + G^T la = f, G u = 0."""
        A, n, W = self.K + s * self.C + s2 * self.M, self.n, self.still
        borders = [
            self.G,
            scipy.sparse.csr_matrix(self.typical * (self.momenta / np.linalg.norm(self.momenta, axis=0)).T),
        ]
        G = (
            scipy.sparse.vstack([border for border in borders if border.shape[0]])
            if self.G.shape[0] or W.size
            else None
        )
        if G is not None:
            A = scipy.sparse.bmat([[A, G.T], [G, None]])
        A = A.tocsc()
        lu = scipy.sparse.linalg.splu(A)
        across = s * (self.C @ W)
        own = s * (W.T @ (self.C @ W)) + s2 * np.eye(W.shape[1])

        def held(f: Array) -> Array:
            whole = np.zeros((A.shape[0], *f.shape[1:]))
            whole[:n] = f
            x = lu.solve(whole)
            return (x + lu.solve(whole - A @ x))[:n]

        if not W.size:
            return held
        answer = held(across)  # u = u' + W a, W^T M u' = 0: held(f - across a) and the rows of W of the equations
        own = own - s * ((self.C.T @ W).T @ answer)

        def solve(f: Array) -> Array:
            u = held(f)
            a = np.linalg.solve(own, W.T @ f - s * ((self.C.T @ W).T @ u))
            return u - answer @ a + W @ a

        return solve

    def stiffness(self, V: Array) -> Array:
        """The symmetric part of K times real V, without what round-off leaves of the motions without stiffness."""
        X = self.symmetric_part @ (V - self.still @ (self.momenta.T @ V))
        return X - self.momenta @ (self.still.T @ X)

    def _without_stiffness(self, rigid: Array) -> Array:
        """Motions without stiffness, u^T M u = 1, in the span of `rigid` (n, r) that the constraints allow: (n, k)."""
        R = rigid
        if self.G.shape[0]:
            across = (self.G @ R) / self.typical
            if across.shape[0] > across.shape[1]:
                across = np.linalg.qr(across, mode="r")
            R = R @ scipy.linalg.null_space(across, rcond=INDEPENDENT) if np.any(across) else R
        if not R.shape[1]:
            return np.zeros((self.n, 0))
        squares, R = self._by_ritz(R / np.sqrt(self._norms(R)))
        W = R[:, np.abs(squares) <= self.noise(R)]
        if not W.shape[1]:
            return W
        self.still, self.momenta = W, self.M @ W
        # what forces onto the rest would yield
        moved = self.inverse(self.shift(1))(self.K @ W)
        drop = np.einsum("ij,ij->j", self.K.T @ W, moved - W @ (self.momenta.T @ moved))
        return W[:, np.abs(drop) <= self.noise(W, whole=True)]

    def noise(self, V: Array, *, whole: bool = False) -> Array:
        """Squares of frequencies, (k,), that round-off may give to shapes without `still`, or to them `whole`."""
        found = self._products(V)
        if self.still.size and not whole:
            found = self._products(V - self.still @ (self.momenta.T @ V)) + CLEANED * found
        return ROUND_OFF * found / self._norms(V)

    def _products(self, V: Array) -> Array:
        """|v|^T |K| |v| : (k,)."""
        return np.asarray(np.einsum("ij,ij->j", np.abs(V), self.sizes @ np.abs(V)))

    def _norms(self, V: Array) -> Array:
        """v^H M v : (k,)."""
        return np.einsum("ij,ij->j", V.conj(), self.M @ V).real

    def shift(self, count: int) -> float:
        """A square near those of the modes that are wanted, rad2/s2, by subspace iteration without `still`."""
        left = self.size - self.still.shape[1]
        count = min(max(count - self.still.shape[1], 1), left)
        p = min(count + 4, left)
        X = self.rng.standard_normal((self.n, p)) * self.weight[:, None]
        s2 = last = shift = regular_shift(self.fastest, self.K.diagonal() / self.M.diagonal())
        found = math.inf  # target of the last shift that was close to it
        for _ in range(40 if left else 0):
            X = X - self.still @ (self.momenta.T @ X)
            try:
                X = self.inverse(s2)(self.M @ X)
            except RuntimeError:  # nothing but round-off is left of it
                return last if math.isinf(found) else shift
            X /= np.linalg.norm(X / self.weight[:, None], axis=0)
            X = np.linalg.qr(X / self.weight[:, None])[0] * self.weight[:, None]
            values, v = scipy.linalg.eigh(X.T @ self.stiffness(X), X.T @ (self.M @ X))
            X = X @ v
            noise = self.noise(X)
            order = np.argsort(np.maximum(np.abs(values), noise))
            target = float(np.abs(values[order[count - 1]]))
            if target <= 10.0 * noise[order[count - 1]]:  # zero; with a shift as small the inverse is round-off
                return s2 if math.isinf(found) else shift
            if target > 0.2 * s2:
                if target > 0.5 * found:
                    return shift
                # many modes may be below s2, and the shapes mixtures of them
                found, shift, target = target, regular_shift(target, values), 0.1 * target
            last, s2 = s2, target
        return s2

    def solve(self, count: int) -> tuple[Array, Array]:
        """Poles and shapes."""
        if self.size == 0:
            return np.zeros(0, dtype=complex), np.zeros((0, self.n))
        s2 = self.shift(min(count, self.size))
        if self.symmetric:
            return self.undamped(min(count, self.size), s2)
        pole, shape = self.general(count, s2)
        self._check_zeros(shape[pole == 0.0].real.T, np.abs(pole) ** 2)
        return pole, shape

    def undamped(self, count: int, s2: float) -> tuple[Array, Array]:
        """Poles and real shapes (count, n), u^T M u = 1, without velocities; s2: about the square of the last one."""
        inverse, wanted = self.inverse(s2), min(count + 4, self.size)

        def by_dense_algebra() -> tuple[Array, Array]:
            Z = self.free()
            M = Z.T @ (self.M @ Z)
            L = np.linalg.cholesky(0.5 * (M + M.T))
            B = L.T @ (Z.T @ inverse(Z @ L))
            mu, v = scipy.linalg.eigh(0.5 * (B + B.T))
            keep = np.argsort(-np.abs(mu))[:wanted]
            return mu[keep], (Z @ scipy.linalg.solve_triangular(L.T, v))[:, keep]

        if self.size <= DENSE or wanted >= self.size - 1:
            mu, V = by_dense_algebra()
        else:
            operator = scipy.sparse.linalg.LinearOperator(
                (self.n, self.n), matvec=lambda f: inverse(f.ravel()), dtype=float
            )

            def find() -> tuple[Array, Array]:
                v0 = inverse(self.M @ self.rng.standard_normal(self.n))
                found, v = scipy.sparse.linalg.eigsh(self.K, k=wanted, M=self.M, sigma=-s2, v0=v0, OPinv=operator)
                return 1.0 / (found + s2), v

            try:
                mu, V = all_of(find, self.M)
            except scipy.sparse.linalg.ArpackError as error:
                if self.size > MOST_DENSE:
                    raise InputError(_ROUND_OFF_LEFT.format(size=self.size, most=MOST_DENSE)) from error
                mu, V = by_dense_algebra()
        squares, V = self._checked(1.0 / mu - s2, V, s2)
        self._check_zeros(V[:, squares == 0.0], squares)
        order = np.argsort(squares, kind="stable")[:count]
        squares, V = squares[order], V[:, order]
        self._check_residuals(inverse(self.M @ V) - V / (squares + s2), V, 1.0 / (squares + s2), squares == 0.0)
        pole = np.where(squares >= 0.0, 1j, 1.0) * np.sqrt(np.abs(squares))
        V = orthonormal(squares, V / np.sqrt(self._norms(V)), self.M)
        return pole, (V * facing((V / self.weight[:, None]).T)).T

    def everything(self) -> tuple[Array, Array]:
        """Squares (size,) rad2/s2, ascending, and real shapes (n, size), u^T M u = 1, of all modes without velocities.

        Notes
        -----
        Those that are not far above the slowest come from the shifted inverse, the others from what is orthogonal to
        them: K itself has round-off beside its largest entries, the inverse beside those of the slowest.
        """
        if self.size == 0:
            return np.zeros(0), np.zeros((self.n, 0))
        Z, s2 = self.free(), self.shift(min(10, self.size))
        M = Z.T @ (self.M @ Z)
        L = np.linalg.cholesky(0.5 * (M + M.T))
        B = L.T @ (Z.T @ self.inverse(s2)(Z @ L))
        mu, v = scipy.linalg.eigh(0.5 * (B + B.T))
        near = np.abs(mu) > np.abs(mu).max() / FAR
        V = Z @ scipy.linalg.solve_triangular(L.T, v)
        squares = np.empty(self.size)
        squares[near] = 1.0 / mu[near] - s2
        if not np.all(near):
            rest = V[:, ~near]
            K = rest.T @ self.stiffness(rest)
            squares[~near], w = scipy.linalg.eigh(0.5 * (K + K.T))
            V[:, ~near] = rest @ w
        squares, V = self._checked(squares, V, s2)
        self._check_zeros(V[:, squares == 0.0], squares)
        order = np.argsort(squares, kind="stable")
        return squares[order], V[:, order]

    def _checked(self, squares: Array, V: Array, s2: float) -> tuple[Array, Array]:
        """Squares from the inverse with shift s2, and shapes; far below it by Rayleigh and Ritz; 0 for round-off.

        The inverse does not separate shapes whose squares are equal beside the shift.
        """
        slow = np.abs(squares) <= SLOW_SQUARE * s2
        if np.any(slow):
            V = V.copy()
            squares[slow], V[:, slow] = self._by_ritz(V[:, slow])
        noise = self.noise(V)
        quotient = np.einsum("ij,ij->j", V, self.stiffness(V)) / self._norms(V)
        found = np.where(slow | (noise < ROUND_OFF * s2), quotient, squares)
        least = np.where(slow, noise, np.maximum(noise, ROUND_OFF * s2))
        return np.where((found <= least) & (found >= -SURE * least), 0.0, found), V

    def _by_ritz(self, V: Array) -> tuple[Array, Array]:
        """Squares by the symmetric stiffness, ascending, and shapes, u^T M u = 1, within the span of independent V."""
        M, K = V.T @ (self.M @ V), V.T @ self.stiffness(V)
        squares, v = scipy.linalg.eigh(0.5 * (K + K.T), 0.5 * (M + M.T))
        return squares, V @ v

    def _check_zeros(self, V: Array, squares: Array) -> None:
        """Refuse motions without stiffness, (n, k), that strain a part: their stiffness is lost in round-off."""
        noise, others = self.noise(V, whole=True), np.abs(squares[squares != 0.0])
        part = self.strains(V, noise, noise >= CANCELLED * np.min(others, initial=np.inf if others.size else 0.0))
        if part:
            raise InputError(_STRAINED.format(part=part))

    def _check_residuals(self, residual: Array, V: Array, mu: Array, zero: Array) -> None:
        """Refuse modes that the shifted inverse does not keep but for its factor mu; those that are `zero` aside."""
        share = np.sqrt(self._norms(residual) / self._norms(V)) / np.abs(mu)
        share[zero] = 0.0
        if not np.all(share <= UNRESOLVED):
            k = int(np.argmax(np.where(np.isfinite(share), share, np.inf)))
            raise InputError(_UNRESOLVED.format(k=k, where=self.where(V[:, k] / self.weight), share=share[k]))

    def growing(self) -> Array | None:
        """Poles of the motions that grow, fastest first, those of a pair above the real axis; None where unknown.

        All motions are examined, of large systems the slowest: of those it is unknown whether another one grows. An
        eigenvalue with the left and right vectors y and x of length 1 has the error of the matrix over y . x.
        """
        if self.size == 0:
            return np.zeros(0, dtype=complex)
        count, limit = min(LOOKED_AT, self.size), DENSE if self.C.nnz == 0 else DENSE // 2
        s2 = self.shift(count)
        if self.size > limit:
            pole, _ = self.general(count, s2, checked=False)
            split = np.zeros(pole.size)
        elif self.C.nnz == 0:
            Z = self.free()
            M = Z.T @ (self.M @ Z)
            L = np.linalg.cholesky(0.5 * (M + M.T))
            B = L.T @ (Z.T @ self.inverse(s2)(Z @ L))
            mu, left, right = scipy.linalg.eig(B, left=True)
            alike = np.abs(np.einsum("ij,ij->j", left.conj(), right))
            error = SPLIT * np.linalg.norm(B, 2) / np.maximum(alike, SPLIT)
            keep = np.abs(mu) > error
            mu, V, split = mu[keep], Z @ scipy.linalg.solve_triangular(L.T, right[:, keep]), (error / np.abs(mu))[keep]
            squares = 1.0 / mu - s2
            squares[np.abs(squares) <= np.maximum(self.noise(V), ROUND_OFF * s2)] = 0.0
            pole = np.sqrt(-squares.astype(complex))
            pole[pole.real < 0.0] *= -1.0
        else:
            pole, _ = self.general(2 * self.size, s2, checked=False)
            split = np.sqrt(SPLIT * (1.0 + np.abs(pole) / math.sqrt(s2)))
        found = pole[(pole.imag >= 0.0) & (pole.real > (GROWS + split) * np.abs(pole))]
        if self.size > limit and not found.size:
            return None
        return np.asarray(found[np.argsort(-found.real)])

    def slowest(self, elastic: int | None) -> tuple[Array, Array]:
        """Squares and shapes, as of `everything`, of all modes that do not oscillate and so many that do; None: all."""
        if elastic is None or self.size <= DENSE:
            squares, V = self.everything()
            keep = self.size if elastic is None else min(int(np.sum(squares <= 0.0)) + elastic, self.size)
            return squares[:keep], V[:, :keep]
        count = elastic + 6
        while count < self.size:
            pole, shape = self.undamped(count, self.shift(count))
            squares = -(pole**2).real
            loose = int(np.sum(squares <= 0.0))
            if loose + elastic <= count:
                return squares[: loose + elastic], shape.T[:, : loose + elastic]
            count = loose + elastic
        return self.slowest(None)

    def free(self) -> Array:
        """Orthonormal basis of the directions that the constraints leave: (n, size)."""
        if not self.G.shape[0]:
            return np.eye(self.n)
        Q, _ = np.linalg.qr(self.G.toarray().T, mode="complete")
        return Q[:, self.G.shape[0] :]

    def general(self, count: int, s2: float, *, checked: bool = True) -> tuple[Array, Array]:
        """Poles and shapes (count, n), slowest first, of pairs of poles one; s2: about the square of the last one.

        Those that are not resolved are refused where they are `checked`.

        Notes
        -----
        A motion without stiffness is given once, though it may drift, which is a double pole 0. Poles that are far
        below the shift are found again with a lower one.
        """
        s = math.sqrt(s2)
        pole, V = self._nearest(count, s2)
        lost = np.abs(pole) <= np.maximum(np.sqrt(self.noise(V)), ZERO * s)
        some = V[:, lost if int(np.sum(lost)) > self.still.shape[1] else slice(0)]
        still, W = self._zeros(some, (ZERO * s) ** 2)
        loose = int(np.sum(still))
        keep = np.argsort(np.abs(pole), kind="stable")
        keep = keep[((pole.imag >= 0.0) & ~lost)[keep]]
        size = np.abs(pole[keep])
        slow = int(np.sum(size <= SLOW_POLE * s))
        while 0 < slow < keep.size and size[slow] - size[slow - 1] <= DISTINCT * size[slow]:
            slow -= 1
        below = still.size + slow
        if below > loose and (low := self.shift(min(below, self.size))) < 0.01 * s2:
            at_low, shape = self.general(min(below, self.size), low, checked=checked)
            bound = math.sqrt(size[slow - 1] * size[slow]) if 0 < slow < keep.size else SLOW_POLE * s
            at_low, shape = (found[np.abs(at_low) <= bound] for found in (at_low, shape))
            rest = keep[size > bound]
            pole, V = np.concatenate([at_low, pole[rest]]), np.column_stack([shape.T, self.unit(V[:, rest])])
            return pole[:count], V[:, :count].T
        if checked and not np.all(still) and self._drift_off(W[:, ~still], W[:, still], s2):
            where = self.where(W[:, int(np.argmin(still))] / self.weight)
            raise InputError(_UNRESOLVED.format(k=loose, where=where, share=ZERO))
        pole = np.concatenate([np.zeros(loose), pole[keep]])[:count]
        V = np.column_stack([W[:, still], V[:, keep]])[:, :count]
        pole.imag[np.abs(pole.imag) <= 1e-9 * np.abs(pole)] = 0.0
        x, mu = np.vstack([V, V * (pole / s)]), 1.0 / (pole - s)
        if checked:
            self._check_residuals((self._apply(s2)(x) - mu * x)[: self.n], V, mu, pole == 0.0)
        return pole, self.unit(V).T

    def unit(self, V: Array) -> Array:
        """V with V^H M V = 1, signs and phases as of `facing`."""
        V = V / np.sqrt(self._norms(V))
        return V * facing((V / self.weight[:, None]).T)

    def _drift_off(self, V: Array, still: Array, s2: float) -> bool:
        """Whether the stiffness of one of V (n, k) is not balanced by forces of a drift along `still` (n, r)."""
        solve = self.inverse(s2, math.sqrt(s2))
        f, carried = solve(self.K @ V), solve(self.C @ still)
        rest = f - carried @ np.linalg.lstsq(carried, f, rcond=1e-9)[0] if still.shape[1] else f
        return bool(np.any(self._norms(rest) > DISTINCT**2 * self._norms(f)))

    def _zeros(self, V: Array, least: float) -> tuple[Array, Array]:
        """Whether motions in the span of V and `still` have squares of at most round-off or `least`: (k,); shapes."""
        W = self.still
        for x, size in zip(np.hstack([V.real, V.imag]).T, np.tile(np.sqrt(self._norms(V)), 2), strict=True):
            for _ in range(2):
                x = x - W @ (W.T @ (self.M @ x))
            rest = math.sqrt(max(float(x @ (self.M @ x)), 0.0))
            if size > 0.0 and rest > DISTINCT * size:
                W = np.column_stack([W, x / rest])
        if not W.shape[1]:
            return np.zeros(0, dtype=bool), W
        squares, W = self._by_ritz(W)
        return np.abs(squares) <= np.maximum(self.noise(W), least), W

    def _apply(self, s2: float) -> Callable[[Array], Array]:
        """(A - s)^-1 of x = [u, v/s], u' = v, by the shift s."""
        s, n = math.sqrt(s2), self.n
        inverse = self.inverse(s2, s)

        def apply(x: Array) -> Array:
            u, v = x[:n], s * x[n:]
            f = self.C @ u + s * (self.M @ u) + self.M @ v
            w = -(inverse(f.real) + 1j * inverse(f.imag)) if np.iscomplexobj(f) else -inverse(f)
            return np.concatenate([w, (u + s * w) / s])

        return apply

    def _nearest(self, count: int, s2: float) -> tuple[Array, Array]:
        """Poles nearest to the shift, of conjugate pairs both, and shapes (n, k).

        Displacements are taken without those of `still`, on which nothing depends: so their poles 0 are single.
        """
        s, n, solve = math.sqrt(s2), self.n, self._apply(s2)

        def apply(x: Array) -> Array:
            found = solve(x)
            found[:n] -= self.still @ (self.momenta.T @ found[:n])
            return found

        def by_dense_algebra() -> tuple[Array, Array]:
            Z = self.free()
            whole = scipy.linalg.block_diag(Z, Z)
            mu, v = np.linalg.eig(whole.T @ apply(whole))
            return mu, whole @ v

        if self.size <= DENSE or 2 * count + 8 >= 2 * self.size - 2:
            mu, V = by_dense_algebra()
        else:
            D = np.sqrt(np.tile(self.M.diagonal(), 2))  # light directions are not to dominate
            operator = scipy.sparse.linalg.LinearOperator(
                (2 * n, 2 * n), matvec=lambda f: D * apply(f.ravel() / D), dtype=float
            )

            def find() -> tuple[Array, Array]:
                u, v = self.inverse(s2, s)(self.M @ self.rng.standard_normal((n, 2))).T
                v0 = D * np.concatenate([u / np.linalg.norm(u), v / np.linalg.norm(v)])
                found: tuple[Array, Array] = scipy.sparse.linalg.eigs(operator, k=2 * count + 8, v0=v0, which="LM")
                return found

            try:
                mu, V = all_of(find)
                V = V / D[:, None]
            except scipy.sparse.linalg.ArpackError as error:
                if 2 * self.size > MOST_DENSE:
                    raise InputError(_ROUND_OFF_LEFT.format(size=self.size, most=MOST_DENSE // 2)) from error
                mu, V = by_dense_algebra()
        keep = np.abs(mu) > 1e-13 * np.abs(mu).max()
        mu, V = mu[keep].astype(complex), V[:, keep].astype(complex)
        pole = s + 1.0 / mu
        pole.real[is_round_off(pole, np.abs(mu).max() / np.abs(mu) ** 2)] = 0.0
        own = self.momenta.T @ V[n:] * (s / np.where(np.abs(pole) > ZERO * s, pole, s))
        return pole, V[:n] + self.still @ own
