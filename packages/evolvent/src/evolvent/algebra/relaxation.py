"""Modes of a structure that relaxes: s with (M s^2 + C s + K - sum of D/(1 + s tau)) u + G^T la = 0, G u = 0.

K is the instantaneous stiffness, D what relaxes with the time tau. The elastic modes of M, C, K span a small problem of
the same form, all of whose poles follow from a linear one with the states of relaxation. From each of these Newton's
method goes on in all directions.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import scipy

from evolvent.algebra.eigenproblem import DISTINCT, Eigenproblem
from evolvent_base.errors import InputError

Array = np.ndarray
#: What makes modes complex, beside what makes those of an `Eigenproblem` so.
RELAXATION = "relaxation"

#: Elastic modes beside those that are wanted, at first.
MORE = 4
#: Correction of a pole, beside its modulus, from which Newton's method has converged: the next one is of second order.
CONVERGED = 1e-9
#: Iterations of Newton's method, and its longest correction beside the modulus.
MOST_ITERATIONS, LONGEST = 25, 0.5
#: Agreement of shapes, by the norm of the mass matrix, below which Newton's method has gone to another mode.
ALIKE = 0.7
#: Imaginary part beside the modulus below which a pole is real, and below which a motion that decays is one of
#: relaxation, which a steady turn bends; relative difference of equal poles.
REAL, OSCILLATES, EQUAL = 1e-7, 0.1, 1e-8
#: States of the small problem.
MOST_STATES = 3000
_UNRESOLVED = (
    "modes with relaxation are not resolved: elastic modes do not describe them, since what relaxes changes their "
    "shapes too much; ask for fewer modes, or take fewer elements"
)


class RelaxingProblem:
    """The eigenproblem of a structure whose stiffness depends on the rate s of its motion.

    Parameters
    ----------
    problem : Eigenproblem, of the instantaneous stiffness
    times : (k,) float, s, relaxation times
    parts : k sparse (n, n), stiffness that relaxes with them
    left : float, share of the stiffness that is left of it after all relaxation, at least
    turned : function of poles and shapes of elastic modes to the shapes, those of equal poles combined as is wanted
    """

    def __init__(
        self, problem: Eigenproblem, times: Sequence[float], parts: Sequence[Any], left: float,
        turned: Callable[[Array, Array], Array],
    ) -> None:  # fmt: skip
        self.problem, self.times, self.left, self.turned = problem, np.array(times), left, turned
        symmetric = problem.symmetric
        self.parts = [(0.5 * (D + D.T) if symmetric else D).tocsc() for D in parts]

    def matrix(self, s: complex) -> Any:
        """Stiffness, damping and mass at a rate s: (n, n) sparse."""
        p = self.problem
        found = p.K + s * p.C + s * s * p.M
        for time, D in zip(self.times, self.parts, strict=True):
            found = found - D / (1.0 + s * time)
        return found

    def slope(self, s: complex, u: Array) -> Array:
        """Derivative of `matrix` by s, times u."""
        p = self.problem
        found = p.C @ u + 2.0 * s * (p.M @ u)
        for time, D in zip(self.times, self.parts, strict=True):
            found = found + time / (1.0 + s * time) ** 2 * (D @ u)
        return found

    def _solved(self, s: complex, f: Array) -> Array:
        """The solution u of `matrix` u + G^T la = f, G u = 0."""
        A, G, n = self.matrix(s), self.problem.G, f.size
        A = (scipy.sparse.bmat([[A, G.T], [G, None]]) if G.shape[0] else A).tocsc().astype(complex)
        lu, whole = scipy.sparse.linalg.splu(A), np.zeros(A.shape[0], dtype=complex)
        whole[:n] = f
        x = lu.solve(whole)
        return np.asarray((x + lu.solve(whole - A @ x))[:n])

    def solve(self, count: int) -> tuple[Array, Array]:
        """Poles (k,) and shapes (k, n) of the slowest motions that oscillate, grow or have no stiffness.

        Notes
        -----
        There are so many elastic modes that one which is not among them is faster than all that are given, even with
        the stiffness that is left after all relaxation.
        """
        wanted = count + MORE
        while True:
            pole, shape = self.problem.solve(min(wanted, self.problem.size))
            is_whole = len(pole) >= self.problem.size or len(pole) < wanted
            reach = math.inf if is_whole else math.sqrt(self.left) * float(np.abs(pole).max())
            still = pole == 0.0
            shape = self.turned(pole, shape)
            found, shapes, lost = self._found(shape[~still])
            known = np.abs(found) <= min(reach, lost)
            if int(np.sum(known) + np.sum(still)) >= count or (is_whole and lost == math.inf):
                pole = np.concatenate([pole[still], found[known]])
                return pole[:count], np.vstack([shape[still], shapes[known]])[:count]
            if is_whole:
                raise InputError(_UNRESOLVED)
            wanted *= 2

    def _found(self, elastic: Array) -> tuple[Array, Array, float]:
        """Poles, slowest first, and shapes (k, n) from elastic ones; modulus of the first that is not found."""
        guesses, start = self._guesses(_basis(elastic, self.problem.M))
        poles, shapes, lost = list[complex](), list[Array](), math.inf
        for s, u in zip(guesses, start, strict=True):
            found = self._newton(complex(s), u)
            if found is None or self._is_known(*found, poles, shapes):
                lost = min(lost, (1.0 - EQUAL) * abs(s))
                continue
            poles.append(found[0])
            shapes.append(found[1])
        order = np.argsort(np.abs(poles), kind="stable")
        pole, shape = np.array(poles, dtype=complex)[order], np.array(shapes).reshape(len(poles), self.problem.n)[order]
        pole.imag[np.abs(pole.imag) <= REAL * np.abs(pole)] = 0.0
        return pole, self.problem.unit(self._apart(pole, shape, elastic).T).T, lost

    def _guesses(self, V: Array) -> tuple[Array, Array]:
        """Poles of motions in the span of V (n, k) that oscillate or grow, slowest first, and their shapes."""
        p, k, N = self.problem, V.shape[1], len(self.times)
        if not k:
            return np.zeros(0, dtype=complex), np.zeros((0, p.n))
        if k * (2 + N) > MOST_STATES:
            raise InputError(_UNRESOLVED)
        K, C = V.T @ (p.K @ V), V.T @ (p.C @ V)
        D = [V.T @ (part @ V) for part in self.parts]
        one, none = np.eye(k), np.zeros((k, k))
        w = math.sqrt(float(np.abs(np.diag(K)).max(initial=0.0))) or 1.0  # velocities are taken over it
        A = np.block(
            [[none, w * one, *[none] * N], [-K / w, -C, *(part / w for part in D)]]
            + [
                [one / time, none, *(-one / time if i == j else none for j in range(N))]
                for i, time in enumerate(self.times)
            ]
        )
        s, x = np.linalg.eig(A)
        relaxed = K - sum(D, none)
        grows = np.any(np.linalg.eigvalsh(0.5 * (relaxed + relaxed.T)) < 0.0)
        real = np.abs(s.imag) <= REAL * np.abs(s)
        relaxes = (np.abs(s.imag) <= OSCILLATES * np.abs(s)) & (s.real < 0.0)
        keep = np.flatnonzero((~relaxes & (s.imag > 0.0)) | (real & (s.real > 0.0) & grows))
        keep = keep[np.argsort(np.abs(s[keep]), kind="stable")]
        s = np.where(real, s.real, s)[keep]
        return s, (V @ x[:k, keep]).T

    def _newton(self, s: complex, u: Array) -> tuple[complex, Array] | None:
        """Pole and shape from ones that are near; None where Newton's method does not lead to them."""
        p = self.problem
        u = u / math.sqrt(float((u.conj() @ (p.M @ u)).real))
        momentum = (p.M @ u).conj()
        limit = max(CONVERGED, 10.0 * float(p.noise(u[:, None])[0]) / abs(s) ** 2)
        for _ in range(MOST_ITERATIONS):
            try:
                x = self._solved(s, self.slope(s, u))
            except RuntimeError:  # singular to the last digit: s is the pole
                s *= 1.0 + 0.1 * CONVERGED
                continue
            along = complex(momentum @ x)
            if not (np.all(np.isfinite(x)) and abs(along) > 0.0):
                return None
            change, u = -1.0 / along, x / along
            if abs(change) > LONGEST * abs(s):
                return None
            s += change
            if abs(change) <= limit * abs(s):
                size = math.sqrt(float((u.conj() @ (p.M @ u)).real))
                return (s, u / size) if size * ALIKE <= 1.0 else None
        return None

    def _is_known(self, s: complex, u: Array, poles: list[complex], shapes: list[Array]) -> bool:
        """Whether a mode is among others."""
        near = [v for pole, v in zip(poles, shapes, strict=True) if abs(pole - s) <= 1e-6 * abs(s)]
        if not near:
            return False
        W = np.array(near).T
        rest = u - W @ np.linalg.lstsq(W, u, rcond=None)[0]
        return bool(np.linalg.norm(rest) <= math.sqrt(DISTINCT) * np.linalg.norm(u))

    def _apart(self, pole: Array, shape: Array, elastic: Array) -> Array:
        """Shapes of equal poles as near to elastic ones as these allow, which may lie in planes."""
        M, shape = self.problem.M, shape.copy()
        first = 0
        for last in range(1, len(pole) + 1):
            if last < len(pole) and abs(pole[last] - pole[last - 1]) <= EQUAL * abs(pole[last]):
                continue
            if last > first + 1:
                Q = shape[first:last].T
                part = np.linalg.solve(Q.conj().T @ (M @ Q), Q.conj().T @ (M @ elastic.T))
                size = np.sqrt(np.einsum("ij,ij->j", part.conj(), (Q.conj().T @ (M @ Q)) @ part).real)
                chosen = sorted(_independent(part, size, last - first))
                shape[first:last] = (Q @ part[:, chosen]).T
            first = last
        return shape


def _independent(part: Array, size: Array, count: int) -> list[int]:
    """Columns that span the others, `count` of them, the largest first; the first ones of those that are as large."""
    rest, chosen = part / np.max(size), list[int]()
    for _ in range(count):
        norms = np.linalg.norm(rest, axis=0)
        k = int(np.argmax(norms >= 0.99 * norms.max()))
        chosen.append(k)
        q = rest[:, k] / norms[k]
        rest = rest - np.outer(q, q.conj() @ rest)
    return chosen


def _basis(shapes: Array, M: Any) -> Array:
    """A basis (n, k) of the real and imaginary parts of shapes, V^T M V = 1."""
    V = shapes.T if not np.iscomplexobj(shapes) else np.hstack([shapes.T.real, shapes.T.imag])
    if not V.shape[1]:
        return V
    squares, v = np.linalg.eigh(V.T @ (M @ V))
    keep = squares > DISTINCT**2 * squares[-1]
    return np.asarray(V @ (v[:, keep] / np.sqrt(squares[keep])))
