"""Stiffness of an element of a shell: stress resultants that are assumed in it, and the section's 8 x 8 matrix.

Hellinger and Reissner: with resultants P beta, beta (14,), the energy of an element is G . H^-1 G/2, H the integral of
P^T C^-1 P and G that of P^T E. In axes of the element membrane forces and moments have the terms of Pian and Sumihara,
constants and one linear term along each side; transverse shear forces have constants and a linear term each. G is
linear in the 15 measures of `shell_strains`, so that the stiffness of the element by these is constant.
Of a part C_m of the section's stiffness, such as that of the plies which relax, the energy is the integral of
S . C_m S/2 with the strains S = C^-1 P H^-1 G that belong to these resultants: the parts of C make up the whole.

In the plane the field of the membrane strains is found from the five measures as in a flat element, of which x_3 is
c_1 x_1 + c_2 x_2: the strain of x_3 by itself is then (c_1 T_1 + c_2 T_2 - c_1^2 M_1 - c_2^2 M_2 - c_1 c_2 S) over
1 - c_1^2 - c_2^2, so that patch tests are exact on any mesh. The metric without stress is that of the measures, so that
the sides of a curved element have the lengths of arcs.

Literature: Pian & Sumihara 1984; Gruttmann & Wagner 2005 (mixed shell elements).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from evolvent.families.shells.shell_strains import MEASURES, SIGNS, STRAIN, STRAINS, measure_vectors
from evolvent.kernels.free_strains import SHELL_AMPLITUDES
from evolvent_base.errors import InputError

Array = np.ndarray
#: Largest angle between the directors of an element's nodes, degrees.
LARGEST_TURN = 90.0
_SIGNS = np.array(SIGNS)
_ROOT = 1.0 / np.sqrt(3.0)
_POINTS = tuple((float(xi), float(eta)) for xi, eta in _ROOT * _SIGNS[1:3].T)


class Constants(NamedTuple):
    """What n elements have by their shape without stress.

    Attributes
    ----------
    stiffness : (n, 15, 15) float, of the measures; resultants : (n, 8, 15) float, forces N11, N22, N12 (N/m), moments
        M11, M22, M12 (N) and shear forces Q1, Q2 (N/m) in the middle by the measures
    rest : (n, 15) float, measures without stress
    slopes : (n, 8, 4) float, 1/m, derivatives along the axes 1 and 2 of each node by the nodes' positions
    untwisted : (n, 4) float, drilling strains without stress
    area : (n,) float, m2
    free : (n, 4, 15) float, measures that the element takes without stress, by amplitudes of a load
    parts : of each part of the section's stiffness that was given, `stiffness` and `resultants` of it alone
    """

    stiffness: Array
    resultants: Array
    rest: Array
    slopes: Array
    untwisted: Array
    area: Array
    free: Array
    parts: tuple[tuple[Array, Array], ...]


def _strain_rows(xi: float, eta: float, c: Array) -> Array:
    """Strains at a point along the sides of elements, (n, 8, 15) by the measures; c : (n, 2)."""
    L = np.zeros((len(c), 8, STRAINS))
    one, two = c.T
    of_x3 = np.stack([-one * one, -two * two, -one * two, one, two]) / (1.0 - one * one - two * two)
    L[:, 0, 0] = L[:, 1, 1] = 1.0
    L[:, 0, 3], L[:, 1, 4] = eta, xi
    L[:, 2, 2:5] = 1.0, xi, eta
    for row, factor in enumerate((eta * eta - 1.0, xi * xi - 1.0, 2.0 * xi * eta)):
        L[:, row, :5] += factor * of_x3.T
    L[:, 3, [5, 8, 10]] = 1.0, eta, eta * eta
    L[:, 4, [6, 9, 10]] = 1.0, xi, xi * xi
    L[:, 5, 7:11] = 1.0, xi, eta, 2.0 * xi * eta
    L[:, 6, 11:13] = 1.0, eta
    L[:, 7, 13:15] = 1.0, xi
    return L


def _turned(J: Array) -> Array:
    """Cartesian components (11, 22, 12) of tensors whose components along the rows of J (n, 2, 2) are given."""
    a, b = J[:, 0], J[:, 1]
    columns = [
        [a[:, 0] * a[:, 0], b[:, 0] * b[:, 0], 2.0 * a[:, 0] * b[:, 0]],
        [a[:, 1] * a[:, 1], b[:, 1] * b[:, 1], 2.0 * a[:, 1] * b[:, 1]],
        [a[:, 0] * a[:, 1], b[:, 0] * b[:, 1], a[:, 0] * b[:, 1] + a[:, 1] * b[:, 0]],
    ]
    return np.moveaxis(np.array(columns), -1, 0)


def _unit(v: Array) -> Array:
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))


def _onto(a: Array, b: Array, v: Array) -> Array:
    """Vectors v turned by the smallest rotations that turn the unit vectors a into b; (n, 3) each."""
    axis, cosine = np.cross(a, b), np.sum(a * b, axis=1, keepdims=True)
    once = np.cross(axis, v)
    return np.asarray(v + once + np.cross(axis, once) / (1.0 + cosine))


class _Sides:
    """Sides of elements: axes in their middles, and derivatives of the position along the sides in these axes."""

    def __init__(self, name: str, x: Array, R: Array, along: Array) -> None:
        self.m = _interpolation(x)
        normal = np.cross(self.m[:, 1], self.m[:, 2])
        size, scale = np.linalg.norm(normal, axis=1), np.sum(self.m[:, 1:3] ** 2, axis=(1, 2))
        flat = ~(size > 1e-10 * scale)
        if np.any(flat):
            raise InputError(f"element {int(flat.argmax())} of {name} has no area; its nodes must be corners of a face")
        self.normal = normal / size[:, None]
        for s in (-1.0, 1.0):
            for r in (-1.0, 1.0):
                a, b = self.at(s, r)
                bad = np.sum(np.cross(a, b) * self.normal, axis=1) <= 0.0
                if np.any(bad):
                    raise InputError(
                        f"element {int(bad.argmax())} of {name} is not convex; its inner angles must be below 180 deg"
                    )
        one = _unit(along - np.sum(along * self.normal, axis=1, keepdims=True) * self.normal)
        self.axes = one, np.cross(self.normal, one)
        gram = np.einsum("nic,njc->nij", self.m[:, 1:3], self.m[:, 1:3])
        by = np.einsum("nic,nc->ni", self.m[:, 1:3], self.m[:, 3])
        self.c = np.linalg.solve(gram, by[..., None])[..., 0]
        self.rest = measures(x, R)

    def at(self, xi: float, eta: float) -> tuple[Array, Array]:
        """Derivatives of the position by xi and eta."""
        return self.m[:, 1] + eta * self.m[:, 3], self.m[:, 2] + xi * self.m[:, 3]

    def jacobian(self, xi: float, eta: float) -> Array:
        """Derivatives along both sides (rows) in axes of the surface, (n, 2, 2), of the lengths of arcs."""
        a, b = self.at(xi, eta)
        n = _unit(np.cross(a, b))
        own = [_onto(self.normal, n, axis) for axis in self.axes]
        J = np.stack([np.stack([np.sum(g * axis, axis=1) for axis in own], axis=1) for g in (a, b)], axis=1)
        E = np.einsum("nij,nj->ni", _strain_rows(xi, eta, self.c)[:, :3], self.rest)
        metric = np.stack([np.stack([2.0 * E[:, 0], E[:, 2]], axis=1), np.stack([E[:, 2], 2.0 * E[:, 1]], axis=1)], 1)
        square = np.linalg.solve(J, np.swapaxes(np.linalg.solve(J, metric), 1, 2))
        w, Q = np.linalg.eigh(0.5 * (square + np.swapaxes(square, 1, 2)))
        return np.asarray(J @ (Q * np.sqrt(w)[:, None, :]) @ np.swapaxes(Q, 1, 2))


def _free_strains(rest: Array, expansion: Array) -> Array:
    """Free strains (n, 8, 4) of a temperature at a point, by T, T^2, G and G T; expansion : (8, 2), by T and G.

    Parameters
    ----------
    rest : (n, 3) float, 1/m, curvatures there without stress: 11, 22 and twice 12

    Notes
    -----
    The surface stretches by I + e T, so that Green's strain is e T + e^2 T^2/2, and curvatures, which count per length
    without stress, are (I + e T)(b + k), symmetric, of the curvatures b without stress and those k of plies.
    """
    e, by_heat, by_gradient = (_tensor(column) for column in (expansion[:3, 0], expansion[3:6, 0], expansion[3:6, 1]))
    found, b = np.zeros((len(rest), 8, SHELL_AMPLITUDES)), np.stack([_tensor(one) for one in rest])
    found[:, :3, 0], found[:, :3, 1] = expansion[:3, 0], 0.5 * _vector(e @ e)
    found[:, :3, 2] = expansion[:3, 1]
    found[:, 3:6, 0] = expansion[3:6, 0] + _vector(e @ b)
    found[:, 3:6, 1], found[:, 3:6, 2], found[:, 3:6, 3] = (
        _vector(e @ by_heat),
        expansion[3:6, 1],
        _vector(e @ by_gradient),
    )
    return found


def _tensor(strain: Array) -> Array:
    """(2, 2) of the components 11, 22 and twice 12."""
    return np.array([[strain[0], 0.5 * strain[2]], [0.5 * strain[2], strain[1]]])


def _vector(tensor: Array) -> Array:
    """Components 11, 22 and twice 12 of the symmetric part of tensors (.., 2, 2)."""
    return np.stack([tensor[..., 0, 0], tensor[..., 1, 1], tensor[..., 0, 1] + tensor[..., 1, 0]], axis=-1)


def constants(name: str, x: Array, R: Array, along: Array, C: Array, expansion: Array | None = None,
              parts: Sequence[Array] = ()) -> Constants:  # fmt: skip
    """Constants of n elements.

    Parameters
    ----------
    name : str, of the shell, for messages
    x : (n, 4, 3) float, m, nodes without stress, in turn; R : (n, 4, 3, 3) float, their axes, the third the director
    along : (n, 3) float, direction of axis 1 of the section; C : (8, 8) float, stiffness of the section
    expansion : (8, 2) float, strains of the section without stress by temperature, 1/K, and gradient, m/K; 0 if None
    parts : (8, 8) float each, parts of C

    Raises
    ------
    InputError
        If an element is degenerate; the message names it.
    """
    sides, n = _Sides(name, x, R, along), len(x)
    middle, J = sides.jacobian(0.0, 0.0), [sides.jacobian(*point) for point in _POINTS]
    weights = np.array([np.linalg.det(one) for one in J])
    area = weights.sum(axis=0)
    xi0, eta0 = (np.einsum("kn,k->n", weights, np.array(_POINTS)[:, i]) / area for i in (0, 1))
    stress_axes, inverse = _turned(middle), np.linalg.inv(C)

    def resultants(xi: float, eta: float) -> Array:
        P = np.zeros((n, 8, 14))
        for row, column in ((0, 0), (3, 5)):
            P[:, row : row + 3, column : column + 3] = np.eye(3)
            P[:, row : row + 3, column + 3] = stress_axes[:, :, 0] * (eta - eta0)[:, None]
            P[:, row : row + 3, column + 4] = stress_axes[:, :, 1] * (xi - xi0)[:, None]
        P[:, 6:, 10:12] = np.eye(2)
        P[:, 6:, 12], P[:, 6:, 13] = middle[:, 0] * (eta - eta0)[:, None], middle[:, 1] * (xi - xi0)[:, None]
        return P

    H, L, F = np.zeros((n, 14, 14)), np.zeros((n, 14, STRAINS)), np.zeros((n, 14, SHELL_AMPLITUDES))
    for point, own, weight in zip(_POINTS, J, weights, strict=True):
        P, E = resultants(*point), _strain_rows(*point, sides.c)
        plane = np.swapaxes(_turned(own), 1, 2)
        E[:, :3], E[:, 3:6] = np.linalg.solve(plane, E[:, :3]), np.linalg.solve(plane, E[:, 3:6])
        E[:, 6:] = np.linalg.solve(own, E[:, 6:])
        weighted = weight[:, None, None] * np.swapaxes(P, 1, 2)
        H += weighted @ inverse @ P
        L += weighted @ E
        if expansion is not None:
            F += weighted @ _free_strains(np.einsum("nij,nj->ni", E[:, 3:6], sides.rest), expansion)
    by_measures = np.linalg.solve(H, L)
    K = _symmetric(np.swapaxes(L, 1, 2) @ by_measures)
    slopes, untwisted = drilling(x, R)
    free = np.zeros((n, SHELL_AMPLITUDES, STRAINS)) if expansion is None else np.swapaxes(_least(L, F), 1, 2)
    in_middle, found = resultants(0.0, 0.0) @ by_measures, list[tuple[Array, Array]]()
    strains = [inverse @ resultants(*point) @ by_measures for point in _POINTS] if parts else []
    for part in parts:
        shares = [w[:, None, None] * (np.swapaxes(S, 1, 2) @ part @ S) for w, S in zip(weights, strains, strict=True)]
        found.append((_symmetric(sum(shares, np.zeros_like(K))), part @ inverse @ in_middle))
    return Constants(K, in_middle, sides.rest, slopes, untwisted, area, free, tuple(found))


def _least(L: Array, F: Array) -> Array:
    """Smallest measures x (n, 15, k) with L x = F; L has as many independent rows as the resultants."""
    rows = 1.0 / np.linalg.norm(L, axis=2, keepdims=True)
    columns = 1.0 / np.linalg.norm(rows * L, axis=1, keepdims=True)
    return np.asarray(np.swapaxes(columns, 1, 2) * (np.linalg.pinv(rows * L * columns) @ (rows * F)))


def largest_turns(directors: Array) -> Array:
    """Largest angles between the directors (n, 4, 3) of elements, degrees."""
    cosines = np.einsum("nac,nbc->nab", directors, directors).min(axis=(1, 2))
    return np.asarray(np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0))))


def _symmetric(K: Array) -> Array:
    return np.asarray(0.5 * (K + np.swapaxes(K, 1, 2)))


def _interpolation(v: Array) -> Array:
    """Coefficients (n, 4, 3) of 1, xi, eta and xi eta of vectors v (n, 4, 3) of the nodes."""
    return np.asarray(0.25 * np.einsum("ia,nac->nic", _SIGNS, v))


def measures(x: Array, R: Array) -> Array:
    """Measures (n, 15) of elements with the nodes x (n, 4, 3), m, and their axes R (n, 4, 3, 3)."""
    V = np.concatenate([_interpolation(x)[:, 1:], _interpolation(R[..., 2])], axis=1)
    found = np.zeros((len(x), MEASURES))
    for vectors, out in zip(V, found, strict=True):
        measure_vectors(vectors, out)
    return found[:, STRAIN : STRAIN + STRAINS]


def drilling(x: Array, R: Array) -> tuple[Array, Array]:
    """Slopes (n, 8, 4) and drilling strains (n, 4) of elements with the nodes x and axes R."""
    slopes, strain = np.zeros((len(x), 8, 4)), np.zeros((len(x), 4))
    xi, eta = _SIGNS[1], _SIGNS[2]
    for a in range(4):
        N = 0.25 * np.array([xi * (1.0 + eta * eta[a]), eta * (1.0 + xi * xi[a])])
        own = np.linalg.solve(N @ x @ R[:, a, :, :2], np.broadcast_to(N, (len(x), 2, 4)))
        U = own @ x
        slopes[:, 2 * a : 2 * a + 2] = own
        strain[:, a] = 0.5 * np.sum(U[:, 0] * R[:, a, :, 1] - U[:, 1] * R[:, a, :, 0], axis=1)
    return slopes, strain
