"""Elements in plain NumPy, and a small dense Newton that brings chains of them into equilibrium."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from evolvent.elements import Form, beam_form, cable_form
from evolvent.families.beams import cable
from evolvent.kernels import ancf

Array = np.ndarray
WORK, CHANGES = np.zeros(ancf.WORK), np.zeros(2 * ancf.PRODUCTS)


def is_beam(form: Form) -> bool:
    return len(form.h) == ancf.PRODUCTS


def vectors(form: Form) -> int:
    """Number of the nodal vectors of an element."""
    return ancf.N if is_beam(form) else cable.N


def energy(form: Form, e: Array) -> float:
    return float(ancf.energy_of(e, form.H, form.h, form.U0, vectors(form), WORK))


def damped_force(form: Form, e: Array, u: Array, b: float, f: Array, interval: tuple = ancf.STATE) -> float:
    """Add the force with damping, of a cable without that of its bending; returns the power that it takes."""
    return float(ancf.force_of(e, u, interval, b, form.H, form.h, vectors(form), CHANGES, WORK, f))


def damped_tangent(form: Form, e: Array, u: Array, b: float, c: float, interval: tuple = ancf.STATE) -> Array:
    K = np.full((e.size, e.size), np.nan)
    ancf.tangent_of(e, u, interval, b, c, form.H, form.h, vectors(form), CHANGES, WORK, K)
    return K


def force(form: Form, e: Array) -> Array:
    f = np.zeros(e.size)
    damped_force(form, e, np.zeros(e.size), 0.0, f)
    return f


def tangent(form: Form, e: Array) -> Array:
    return damped_tangent(form, e, np.zeros(e.size), 0.0, 0.0)


def difference(function: Callable[[Array], Array | float], x: Array, step: float) -> Array:
    """Central differences of fourth order: exact for polynomials up to the fourth degree, however large the step."""
    columns = []
    for k in range(x.size):
        d = np.zeros(x.size)
        d[k] = step
        near = np.asarray(function(x + d)) - np.asarray(function(x - d))
        far = np.asarray(function(x + 2 * d)) - np.asarray(function(x - 2 * d))
        columns.append((8.0 * near - far) / (12.0 * step))
    return np.stack(columns, axis=-1)


def turn(e: Array, rotation: Array, shift: Array | None = None) -> Array:
    """Coordinates (or forces) turned, and moved if they are those of a shape."""
    x = e.reshape(-1, 3) @ rotation.T
    if shift is not None:
        x[0] += shift
        x[len(x) // 2] += shift
    return x.ravel()


def rotation_by(vector: Array) -> Array:
    angle = np.linalg.norm(vector)
    k = skew(vector / angle)
    return np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * k @ k


def skew(a: Array) -> Array:
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


# ------------------------------------------------------------------------------------------------ chains


class Chain:
    """A straight row of elements along x; q : (nodes, vectors, 3), a node's vectors r, r,x and of a beam r,y, r,z."""

    def __init__(self, forms: list[Form], length: float) -> None:
        self.forms, count = forms, len(forms)
        vectors = 4 if is_beam(forms[0]) else 2
        self.q = np.zeros((count + 1, vectors, 3))
        self.q[:, 0, 0] = np.linspace(0.0, length, count + 1)
        for k in range(1, vectors):
            self.q[:, k, k - 1] = 1.0

    def force(self, q: Array) -> Array:
        f = np.zeros_like(q)
        for k, form in enumerate(self.forms):
            f[k : k + 2] += force(form, q[k : k + 2].ravel()).reshape(q[:2].shape)
        return f

    def tangent(self, q: Array) -> Array:
        m = q[0].size
        K = np.zeros((q.size, q.size))
        for k, form in enumerate(self.forms):
            here = slice(k * m, (k + 2) * m)
            K[here, here] += tangent(form, q[k : k + 2].ravel())
        return K

    def solve(
        self,
        q: Array,
        free: Array,
        load: Array | None = None,
        moment: tuple[int, float] | None = None,
        tolerance: float = 1e-10,
        limit: int = 60,
    ) -> Array:
        """Equilibrium under a dead load and a moment about z at the last node, which acts on one of its vectors."""
        q, free = q.copy(), free.ravel()
        for _ in range(limit):
            f, K = self.force(q), self.tangent(q)
            if load is not None:
                f -= load
            if moment is not None:
                vector, M = moment
                t, turned = q[-1, vector], np.cross([0.0, 0.0, 1.0], q[-1, vector])
                tt = t @ t
                f[-1, vector] -= M * turned / tt
                here = slice(q.size - q[0].size + 3 * vector, q.size - q[0].size + 3 * vector + 3)
                K[here, here] -= M * (skew(np.array([0.0, 0.0, 1.0])) / tt - 2.0 * np.outer(turned, t) / tt**2)
            step = np.zeros(q.size)
            step[free] = -np.linalg.solve(K[np.ix_(free, free)], f.ravel()[free])
            q += step.reshape(q.shape)
            if np.abs(step).max() < tolerance * np.abs(q).max():
                return q
        raise AssertionError(f"no equilibrium after {limit} iterations; last step {np.abs(step).max():.2e}")

    def clamped(self) -> Array:
        free = np.ones(self.q.shape, dtype=bool)
        free[0] = False
        return free


def chain(formulation: str, count: int, length: float, section, material) -> Chain:
    """Of beams, or of cables for the formulation `cable`."""
    if formulation == "cable":
        return Chain([cable_form(length / count, section, material)] * count, length)
    return Chain([beam_form(formulation, length / count, section, material)] * count, length)


# ------------------------------------------------------------------------------------------------ the continuum


class Gradients(NamedTuple):
    """Columns r,x; r,y; r,z at a point."""

    x: Array
    y: Array
    z: Array


def shape_gradients(length: float, x: float, y: float, z: float) -> tuple[Array, Array, Array]:
    """S,x; S,y; S,z : (8,) of S1 = 1 - 3 xi2 + 2 xi3, S2 = l (xi - 2 xi2 + xi3), S3 = l (eta - xi eta), ..."""
    xi, eta, zeta = x / length, y / length, z / length
    Sx = [
        (-6 * xi + 6 * xi**2) / length, 1 - 4 * xi + 3 * xi**2, -eta, -zeta,
        (6 * xi - 6 * xi**2) / length, -2 * xi + 3 * xi**2, eta, zeta,
    ]  # fmt: skip
    Sy = [0, 0, 1 - xi, 0, 0, 0, xi, 0]
    Sz = [0, 0, 0, 1 - xi, 0, 0, 0, xi]
    return np.array(Sx), np.array(Sy, dtype=float), np.array(Sz, dtype=float)


def gradients(e: Array, length: float, x: float, y: float, z: float) -> Gradients:
    return Gradients(*(S @ e.reshape(8, 3) for S in shape_gradients(length, x, y, z)))


def points(count: int, low: float, high: float) -> list[tuple[float, float]]:
    """Gauss's points and weights between low and high."""
    at, weight = np.polynomial.legendre.leggauss(count)
    half = 0.5 * (high - low)
    return [(low + half * (1.0 + a), half * w) for a, w in zip(at, weight, strict=True)]


def green(r: Gradients) -> Array:
    """E = 1/2 (F^T F - 1)."""
    F = np.column_stack(r)
    return 0.5 * (F.T @ F - np.eye(3))
