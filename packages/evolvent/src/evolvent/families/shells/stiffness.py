"""Stiffness of an element of a shell: stress resultants that are assumed in it, and the section's 8 x 8 matrix.

Hellinger and Reissner: with resultants P beta, beta (14,), the energy of an element is G . H^-1 G/2, H the integral of
P^T C^-1 P and G that of P^T E. Membrane forces and moments have, in axes of the element, the terms of Pian and Sumihara:
constants and one linear term along each side; transverse shear forces constants and a linear term each. G is linear in
the 15 measures of `shell_strains`, so that the stiffness of the element by these is constant.

In the plane the field of the membrane strains is found from the five measures as in a flat element, of which x_3 is
c_1 x_1 + c_2 x_2: the strain of x_3 by itself is then (c_1 T_1 + c_2 T_2 - c_1^2 M_1 - c_2^2 M_2 - c_1 c_2 S)/(1 - c_1^2
- c_2^2), so that patch tests are exact on any mesh.

Literature: Pian & Sumihara 1984; Gruttmann & Wagner 2005 (mixed shell elements).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from evolvent.families.shells.shell_strains import MEASURES, SIGNS, STRAIN, STRAINS, measure_vectors
from evolvent_base.errors import InputError

Array = np.ndarray
_SIGNS = np.array(SIGNS)
_ROOT = 1.0 / np.sqrt(3.0)
_POINTS = tuple((float(xi), float(eta)) for xi, eta in _ROOT * _SIGNS[1:3].T)


class Constants(NamedTuple):
    """What an element has by its shape without stress.

    Attributes
    ----------
    stiffness : (15, 15) float, of the measures; resultants : (8, 15) float, forces N11, N22, N12 (N/m), moments M11,
        M22, M12 (N) and shear forces Q1, Q2 (N/m) in its middle by the measures
    rest : (15,) float, measures without stress
    slopes : (8, 4) float, 1/m, derivatives along the axes 1 and 2 of each node by the nodes' positions
    untwisted : (4,) float, drilling strains without stress
    area : float, m2; axes : (3, 3) float, of the resultants, in rows
    """

    stiffness: Array
    resultants: Array
    rest: Array
    slopes: Array
    untwisted: Array
    area: float
    axes: Array


def _strain_rows(xi: float, eta: float, c1: float, c2: float) -> Array:
    """Strains at a point along the sides of the element, (8, 15) by the measures."""
    L = np.zeros((8, STRAINS))
    of_x3 = np.array([-c1 * c1, -c2 * c2, -c1 * c2, c1, c2]) / (1.0 - c1 * c1 - c2 * c2)
    L[0, 0], L[0, 3], L[1, 1], L[1, 4] = 1.0, eta, 1.0, xi
    L[2, 2:5] = 1.0, xi, eta
    L[0, :5] += (eta * eta - 1.0) * of_x3
    L[1, :5] += (xi * xi - 1.0) * of_x3
    L[2, :5] += 2.0 * xi * eta * of_x3
    L[3, [5, 8, 10]] = 1.0, eta, eta * eta
    L[4, [6, 9, 10]] = 1.0, xi, xi * xi
    L[5, 7:11] = 1.0, xi, eta, 2.0 * xi * eta
    L[6, 11:13] = 1.0, eta
    L[7, 13:15] = 1.0, xi
    return L


def _turned(J: Array) -> Array:
    """Cartesian components (11, 22, 12) of tensors whose components along the rows of J (2, 2) are given: (3, 3)."""
    T = np.empty((3, 3))
    for k, (a, b) in enumerate(((0, 0), (1, 1), (0, 1))):
        M = np.outer(J[a], J[b])
        T[:, k] = (M[0, 0], M[1, 1], M[0, 1]) if a == b else (2.0 * M[0, 0], 2.0 * M[1, 1], M[0, 1] + M[1, 0])
    return T


def _onto(a: Array, b: Array) -> Array:
    """Smallest rotation that turns the unit vector a into b."""
    v = np.cross(a, b)
    K = np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
    return np.asarray(np.eye(3) + K + K @ K / (1.0 + a @ b))


def element_constants(name: str, x: Array, R: Array, along: Array, C: Array) -> Constants:
    """Constants of an element.

    Parameters
    ----------
    name : str, of the element, for messages
    x : (4, 3) float, m, nodes without stress, in turn; R : (4, 3, 3) float, their axes, the third the director
    along : (3,) float, direction of axis 1 of the section; C : (8, 8) float, stiffness of the section

    Raises
    ------
    InputError
        If the element is degenerate.
    """
    m = 0.25 * _SIGNS @ x
    normal = np.cross(m[1], m[2])
    size = float(np.linalg.norm(normal))
    if not size > 1e-10 * float(m[1] @ m[1] + m[2] @ m[2]):
        raise InputError(f"{name} has no area; its nodes must be corners of a quadrilateral")
    normal = normal / size
    one = along - (along @ normal) * normal
    one = one / np.linalg.norm(one)
    axes = np.array([one, np.cross(normal, one), normal])

    def sides(xi: float, eta: float) -> Array:
        a, b = m[1] + eta * m[3], m[2] + xi * m[3]
        n = np.cross(a, b)
        own = axes @ _onto(normal, n / np.linalg.norm(n)).T
        return np.array([[a @ own[0], a @ own[1]], [b @ own[0], b @ own[1]]])

    c1, c2 = np.linalg.solve(m[1:3] @ m[1:3].T, m[1:3] @ m[3])
    rest = rest_measures(x, R)

    def along_arcs(xi: float, eta: float) -> Array:
        J, E = sides(xi, eta), _strain_rows(xi, eta, c1, c2)[:3] @ rest
        metric = np.linalg.solve(J, np.linalg.solve(J, np.array([[2.0 * E[0], E[2]], [E[2], 2.0 * E[1]]])).T)
        w, Q = np.linalg.eigh(metric)
        return np.asarray(J @ (Q * np.sqrt(w)) @ Q.T)

    middle, J = along_arcs(0.0, 0.0), [along_arcs(*point) for point in _POINTS]
    weights = np.array([np.linalg.det(one) for one in J])
    if np.any(weights <= 0.0) or any(float(np.cross(m[1] + s * m[3], m[2] + r * m[3]) @ normal) <= 0.0 for r in (-1, 1)
                                     for s in (-1, 1)):  # fmt: skip
        raise InputError(f"{name} is not convex; its inner angles must be below 180 deg")
    area = float(weights.sum())
    xi0, eta0 = weights @ np.array(_POINTS) / area
    stress_axes, inverse = _turned(middle), np.linalg.inv(C)
    H, L = np.zeros((14, 14)), np.zeros((14, STRAINS))

    def resultants(xi: float, eta: float) -> Array:
        P = np.zeros((8, 14))
        for row, column in ((0, 0), (3, 5)):
            P[row : row + 3, column : column + 3] = np.eye(3)
            P[row : row + 3, column + 3] = stress_axes[:, 0] * (eta - eta0)
            P[row : row + 3, column + 4] = stress_axes[:, 1] * (xi - xi0)
        P[6:, 10:12] = np.eye(2)
        P[6:, 12], P[6:, 13] = middle[0] * (eta - eta0), middle[1] * (xi - xi0)
        return P

    for point, own, weight in zip(_POINTS, J, weights, strict=True):
        P, E = resultants(*point), _strain_rows(*point, c1, c2)
        plane = np.linalg.inv(_turned(own).T)
        E[:3], E[3:6], E[6:] = plane @ E[:3], plane @ E[3:6], np.linalg.solve(own, E[6:])
        H += weight * P.T @ inverse @ P
        L += weight * P.T @ E
    by_measures = np.linalg.solve(H, L)
    K = L.T @ by_measures
    slopes, untwisted = drilling(x, R)
    return Constants(
        0.5 * (K + K.T), resultants(0.0, 0.0) @ by_measures, rest, slopes, untwisted, area, axes,
    )  # fmt: skip


def rest_measures(x: Array, R: Array) -> Array:
    """The 15 measures of an element with the nodes x (4, 3), m, and axes R (4, 3, 3)."""
    V = np.concatenate([0.25 * _SIGNS[1:] @ x, 0.25 * _SIGNS @ R[:, :, 2]])
    found = np.zeros(MEASURES)
    measure_vectors(V, found)
    return found[STRAIN : STRAIN + STRAINS]


def drilling(x: Array, R: Array) -> tuple[Array, Array]:
    """Slopes (8, 4) and drilling strains (4,) of an element with the nodes x and axes R."""
    slopes, strain = np.zeros((8, 4)), np.zeros(4)
    xi, eta = _SIGNS[1], _SIGNS[2]
    for a in range(4):
        N = 0.25 * np.array([xi * (1.0 + eta * eta[a]), eta * (1.0 + xi * xi[a])])
        own = np.linalg.solve((N @ x) @ R[a, :, :2], N)
        U = own @ x
        slopes[2 * a : 2 * a + 2] = own
        strain[a] = 0.5 * (U[0] @ R[a, :, 1] - U[1] @ R[a, :, 0])
    return slopes, strain
