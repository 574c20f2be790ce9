"""The eigenproblem of M, C, K under constraints G u = 0: the slowest modes, or all of them."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse as sparse
from scipy.sparse.linalg import ArpackError, LinearOperator, eigs, eigsh, splu

from evolvent.base.errors import InputError
from evolvent.elements.dense import facing

Array = np.ndarray

#: Up to so many free directions modes are found by dense algebra; half as many where velocities count.
DENSE = 300
#: Asymmetry, beside the largest entries of rows, that is taken as round-off.
SYMMETRIC = 1e-12
#: Poles below this part of the shift are zero where zeros are double.
ZERO = 1e-6
#: What a square of a frequency may owe to round-off, in parts of the sum of all products behind it.
ROUND_OFF = 5e-14
#: Relative difference of squares of frequencies that count as equal.
EQUAL = 1e-8
#: Part of a rigid-body motion that modes of equal frequency must take for one of them to be turned into it.
EXCITED = 1e-6
#: Squares of frequencies above so many times the shift are found without it.
FAR = 1e8
#: Real part, beside the modulus, from which a pole grows; what round-off adds to eigenvalues of the shifted inverse,
#: beside its size; number of slowest motions that are examined where all are too many.
GROWS, SPLIT, LOOKED_AT = 1e-6, 1e-13, 20


#: Free directions up to which dense algebra replaces a Krylov method that fails.
MOST_DENSE = 3000
_ROUND_OFF_LEFT = (
    "the slowest modes are lost in round-off: the stiffness differs too much between directions, as of extremely thin "
    "strips; {size} free directions are more than the {most} of dense algebra; take fewer elements or a thicker section"
)


class Problem:
    """The eigenproblem of M, C, K under G u = 0."""

    def __init__(self, M: Any, C: Any, K: Any, G: Any, weight: Array, *, conservative: bool) -> None:
        self.M, self.C, self.K, self.n = M.tocsc(), C.tocsc(), K.tocsc(), K.shape[0]
        scale = abs(K).max(axis=1).toarray().ravel()
        size = G.shape[0]
        norms = np.sqrt(np.asarray(G.multiply(G).sum(axis=1)).ravel()) if size else np.zeros(0)
        typical = float(np.median(scale[scale > 0.0])) if np.any(scale) else 1.0
        self.G = sparse.diags(typical / norms) @ G if size else G
        self.size = self.n - size
        m = M.diagonal()
        self.fastest = float(np.max(np.abs(K.diagonal()) / m)) or 1.0  # of free bodies alone any shift serves
        off = abs(K - K.T)
        bound = sparse.diags(1.0 / np.maximum(scale, 1e-300))
        self.symmetric = C.nnz == 0 and (conservative or float((bound @ off).max()) <= SYMMETRIC)
        if self.symmetric:
            self.K = (0.5 * (K + K.T)).tocsc()
        self.weight = weight
        self.rng = np.random.default_rng(1)

    def inverse(self, s2: float, s: float = 0.0) -> Any:
        """Function f -> u of (K + s C + s2 M) u + G^T la = f, G u = 0."""
        A = self.K + s * self.C + s2 * self.M
        if self.G.shape[0]:
            A = sparse.bmat([[A, self.G.T], [self.G, None]])
        lu = splu(A.tocsc())
        n, extra = self.n, self.G.shape[0]

        def solve(f: Array) -> Array:
            whole = np.zeros((n + extra, *f.shape[1:]))
            whole[:n] = f
            x = lu.solve(whole)
            return (x + lu.solve(whole - A @ x))[:n]

        return solve

    def noise(self, V: Array) -> Array:
        """Squares of frequencies that round-off alone may give to shapes: (k,)."""
        size = np.abs(V)
        return ROUND_OFF * np.einsum("ij,ij->j", size, abs(self.K) @ size) / self._norms(V)

    def _norms(self, V: Array) -> Array:
        """v^H M v : (k,)."""
        return np.einsum("ij,ij->j", V.conj(), self.M @ V).real

    def shift(self, count: int) -> float:
        """A square near those of the modes that are wanted, rad2/s2, by subspace iteration."""
        p = min(count + 4, self.size)
        S = self.K if self.symmetric else 0.5 * (self.K + self.K.T)
        X = self.rng.standard_normal((self.n, p)) * self.weight[:, None]
        s2 = last = _regular_shift(self.fastest, self.K.diagonal() / self.M.diagonal())
        for _ in range(40):
            try:
                X = self.inverse(s2)(self.M @ X)
            except RuntimeError:  # nothing but round-off is left of it
                return last
            X /= np.linalg.norm(X / self.weight[:, None], axis=0)
            X = np.linalg.qr(X / self.weight[:, None])[0] * self.weight[:, None]
            values, v = scipy.linalg.eigh(X.T @ (S @ X), X.T @ (self.M @ X))
            X = X @ v
            noise = self.noise(X)
            order = np.argsort(np.maximum(np.abs(values), noise))
            target = float(np.abs(values[order[count - 1]]))
            if target <= 10.0 * noise[order[count - 1]]:  # zero; with a shift as small the inverse is round-off
                return s2
            if target > 0.2 * s2:
                return _regular_shift(target, values)
            last, s2 = s2, target
        return s2

    def solve(self, count: int) -> tuple[Array, Array]:
        """Poles and shapes."""
        s2 = self.shift(min(count, self.size))
        if self.symmetric:
            return self.undamped(min(count, self.size), s2)
        return self.general(count, s2)

    def undamped(self, count: int, s2: float) -> tuple[Array, Array]:
        """Poles and real shapes (count, n), u^T M u = 1, without velocities; s2: about the square of the last one."""
        inverse = self.inverse(s2)

        def by_dense_algebra() -> tuple[Array, Array]:
            Z = self.free()
            M = Z.T @ (self.M @ Z)
            L = np.linalg.cholesky(0.5 * (M + M.T))
            B = L.T @ (Z.T @ inverse(Z @ L))
            mu, v = scipy.linalg.eigh(0.5 * (B + B.T))
            keep = np.argsort(-np.abs(mu))[:count]
            return mu[keep], (Z @ scipy.linalg.solve_triangular(L.T, v))[:, keep]

        if self.size <= DENSE or count >= self.size - 1:
            mu, V = by_dense_algebra()
        else:
            operator = LinearOperator((self.n, self.n), matvec=lambda f: inverse(f.ravel()), dtype=float)

            def find() -> tuple[Array, Array]:
                v0 = inverse(self.M @ self.rng.standard_normal(self.n))
                found, v = eigsh(self.K, k=count, M=self.M, sigma=-s2, v0=v0, OPinv=operator)
                return 1.0 / (found + s2), v

            try:
                mu, V = _all_of(find, self.M)
            except ArpackError as error:
                if self.size > MOST_DENSE:
                    raise InputError(_ROUND_OFF_LEFT.format(size=self.size, most=MOST_DENSE)) from error
                mu, V = by_dense_algebra()
        squares = self._checked(1.0 / mu - s2, V, s2)
        order = np.argsort(squares, kind="stable")[:count]
        squares, V = squares[order], V[:, order]
        pole = np.where(squares >= 0.0, 1j, 1.0) * np.sqrt(np.abs(squares))
        V = self._orthonormal(squares, V)
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
            K = rest.T @ (self.K @ rest)
            squares[~near], w = scipy.linalg.eigh(0.5 * (K + K.T))
            V[:, ~near] = rest @ w
        squares = self._checked(squares, V, s2)
        order = np.argsort(squares, kind="stable")
        return squares[order], V[:, order]

    def _checked(self, squares: Array, V: Array, s2: float) -> Array:
        """Squares from the inverse with shift s2; by Rayleigh's quotient where that has less round-off; 0 below it."""
        noise = self.noise(V)
        quotient = np.einsum("ij,ij->j", V, self.K @ V) / self._norms(V)
        found = np.where(noise < ROUND_OFF * s2, quotient, squares)
        return np.where(np.abs(found) <= np.maximum(noise, ROUND_OFF * s2), 0.0, found)

    def _orthonormal(self, squares: Array, V: Array) -> Array:
        """V with V^T M V = 1; shapes of different frequency are orthogonal, to those of equal ones it is done here."""
        V = V / np.sqrt(self._norms(V))
        for first, last in equal(squares):
            L = np.linalg.cholesky(V[:, first:last].T @ (self.M @ V[:, first:last]))
            V[:, first:last] = scipy.linalg.solve_triangular(L, V[:, first:last].T, lower=True).T
        return V

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
            pole, _ = self.general(count, s2)
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
            pole, _ = self.general(2 * self.size, s2)
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

    def general(self, count: int, s2: float) -> tuple[Array, Array]:
        """Of [u, v/s]: with s the shift, u' = v; pairs of poles of which one is kept."""
        s = math.sqrt(s2)
        inverse = self.inverse(s2, s)
        n = self.n

        def apply(x: Array) -> Array:
            u, v = x[:n], s * x[n:]
            w = -inverse(self.C @ u + s * (self.M @ u) + self.M @ v)
            return np.concatenate([w, (u + s * w) / s])

        if 2 * self.size <= DENSE or 2 * count + 8 >= 2 * self.size - 2:
            Z = self.free()
            whole = scipy.linalg.block_diag(Z, Z)
            mu, v = np.linalg.eig(whole.T @ apply(whole))
            V = (whole @ v)[:n]
        else:
            operator = LinearOperator((2 * n, 2 * n), matvec=lambda f: apply(f.ravel()), dtype=float)

            def find() -> tuple[Array, Array]:
                u, v = inverse(self.M @ self.rng.standard_normal((n, 2))).T
                v0 = np.concatenate([u / np.linalg.norm(u), v / np.linalg.norm(v)])
                found: tuple[Array, Array] = eigs(operator, k=2 * count + 8, v0=v0, which="LM")
                return found

            mu, V = _all_of(find)
            V = V[:n]
        keep = np.abs(mu) > 1e-13 * np.abs(mu).max()
        mu, V = mu[keep], V[:, keep]
        pole = s + 1.0 / mu
        pole[np.abs(pole) <= np.maximum(np.sqrt(self.noise(V)), ZERO * s)] = 0.0
        keep = np.flatnonzero(pole.imag >= 0.0)
        zero = keep[pole[keep] == 0.0]
        keep = np.concatenate([zero[::2], keep[pole[keep] != 0.0]])  # zeros are double
        keep = keep[np.argsort(np.abs(pole[keep]), kind="stable")][:count]
        pole, V = pole[keep], V[:, keep]
        pole.imag[np.abs(pole.imag) <= 1e-9 * np.abs(pole)] = 0.0
        V = V / np.sqrt(self._norms(V))
        return pole, (V * facing((V / self.weight[:, None]).T)).T


def _regular_shift(s2: float, squares: Array) -> float:
    """A shift from s2 on that is not close to the negative of a square: K + s2 M would be singular."""
    while np.any(np.abs(squares + s2) < 0.05 * s2):
        s2 *= 1.2
    return s2


def _all_of(find: Callable[[], tuple[Array, Array]], M: Any = None) -> tuple[Array, Array]:
    """Eigenvalues and vectors of several calls of `find`, each from another start, until nothing is new.

    One start of a Krylov method sees one vector of a multiple eigenvalue, but for what round-off brings in. M, where
    given, is the inner product in which `find` returns orthonormal vectors.
    """
    values, vectors = find()
    for _ in range(8):
        added = False
        for value, x in zip(*(lambda e: (e[0], e[1].T))(find()), strict=True):
            same, rest = vectors[:, np.abs(values - value) <= 1e-6 * np.abs(value)], x
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
        found: Array = splu(H.tocsc()).solve(np.ascontiguousarray(f))
        return found
    size = abs(H).max(axis=1).toarray().ravel()
    typical = float(np.median(size[size > 0.0])) if np.any(size) else 1.0
    scale = typical / np.sqrt(np.asarray(A.multiply(A).sum(axis=1)).ravel())
    A = sparse.diags(scale) @ A
    lu = splu(sparse.bmat([[H, A.T], [A, None]]).tocsc())
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
