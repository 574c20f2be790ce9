"""Write the model of a solar panel that the case `solar-array-flexible` uses: python tools/solar_panel.py.

A rectangular sandwich plate, thin (Kirchhoff) in bending and a plane-stress sheet in its plane, with rectangular
elements: 12-term polynomials for the deflection (Adini, Clough and Melosh; Zienkiewicz and Taylor, The Finite Element
Method, volume 2) and bilinear displacements in the plane. Two hinge lines are rigid, each the place of an interface
node in the middle of an edge; the rest is reduced by Craig and Bampton (1968). Axes: x from the inner to the outer
edge, y normal to the panel, from its centre.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.linalg

from evolvent.elements.reduced_files import SHIPPED, write_model
from evolvent.elements.reduced_models import ReducedModel

Array = np.ndarray


class Plate(NamedTuple):
    """Dimensions (m), mass (kg), moduli of a plate, and its mesh. `sheets` is the thickness of both faces together."""

    length: float = 1.0
    width: float = 1.5
    mass: float = 4.0
    young_modulus: float = 60e9
    poisson_ratio: float = 0.3
    sheets: float = 0.3e-3
    apart: float = 10e-3
    along: int = 8
    across: int = 12

    @property
    def bending(self) -> float:
        """Bending stiffness E t d^2/(4 (1 - nu^2)) of two faces at a distance d, N m."""
        return self.young_modulus * self.sheets * self.apart**2 / (4.0 * (1.0 - self.poisson_ratio**2))

    @property
    def stretching(self) -> float:
        """E t/(1 - nu^2), N/m."""
        return self.young_modulus * self.sheets / (1.0 - self.poisson_ratio**2)


#: Numbers of a node: u_x, u_z, w, dw/dx, dw/dz.
_NODE = 5
#: Powers of x and z of the deflection.
_POWERS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3), (3, 1), (1, 3))
#: Half of the length of a hinge line, m, and modes with the hinges held.
HINGE, MODES = 0.25, 10


def _terms(x: float, z: float, i: int, j: int) -> Array:
    """Derivatives of the terms, i times by x and j times by z: (12,)."""

    def power(s: float, p: int, k: int) -> float:
        return float(np.prod([p - q for q in range(k)], initial=1.0)) * s ** (p - k) if p >= k else 0.0

    return np.array([power(x, p, i) * power(z, q, j) for p, q in _POWERS])


def element(plate: Plate) -> tuple[Array, Array]:
    """Stiffness and mass (20, 20) of an element; corners (0, 0), (a, 0), (a, b), (0, b)."""
    a, b, nu = plate.length / plate.along, plate.width / plate.across, plate.poisson_ratio
    corners = ((0.0, 0.0), (a, 0.0), (a, b), (0.0, b))
    law = np.array([[1.0, nu, 0.0], [nu, 1.0, 0.0], [0.0, 0.0, 0.5 * (1.0 - nu)]])
    inverse = np.linalg.inv(np.array([_terms(*c, i, j) for c in corners for i, j in ((0, 0), (1, 0), (0, 1))]))
    K, M = np.zeros((20, 20)), np.zeros((20, 20))
    bent = [_NODE * c + k for c in range(4) for k in (2, 3, 4)]
    density = plate.mass / (plate.length * plate.width)
    points, weights = np.polynomial.legendre.leggauss(4)
    for s, ws in zip(points, weights, strict=True):
        for r, wr in zip(points, weights, strict=True):
            x, z, area = 0.5 * a * (1.0 + s), 0.5 * b * (1.0 + r), 0.25 * a * b * ws * wr
            B = np.array([_terms(x, z, 2, 0), _terms(x, z, 0, 2), 2.0 * _terms(x, z, 1, 1)]) @ inverse
            N = _terms(x, z, 0, 0) @ inverse
            K[np.ix_(bent, bent)] += area * plate.bending * B.T @ law @ B
            M[np.ix_(bent, bent)] += area * density * np.outer(N, N)
            signs = ((-1, -1), (1, -1), (1, 1), (-1, 1))
            flat, sheet = np.zeros((3, 20)), np.zeros((2, 20))
            for c, (p, q) in enumerate(signs):
                nx, nz = 0.5 * p * (1.0 + q * r) / a, 0.5 * q * (1.0 + p * s) / b
                flat[0, _NODE * c], flat[1, _NODE * c + 1] = nx, nz
                flat[2, _NODE * c], flat[2, _NODE * c + 1] = nz, nx
                sheet[0, _NODE * c] = sheet[1, _NODE * c + 1] = 0.25 * (1.0 + p * s) * (1.0 + q * r)
            K += area * plate.stretching * flat.T @ law @ flat
            M += area * density * sheet.T @ sheet
    return K, M


def assembled(plate: Plate) -> tuple[Array, Array, Array]:
    """Stiffness and mass of the free plate, and places x, z of its nodes (n, 2), m."""
    n, m = plate.along, plate.across
    x, z = np.linspace(-0.5, 0.5, n + 1) * plate.length, np.linspace(-0.5, 0.5, m + 1) * plate.width
    places = np.array([(s, r) for r in z for s in x])
    K, M = np.zeros((_NODE * len(places),) * 2), np.zeros((_NODE * len(places),) * 2)
    k, mass = element(plate)
    for j in range(m):
        for i in range(n):
            first = (n + 1) * j + i
            nodes = [first, first + 1, first + n + 2, first + n + 1]
            own = np.concatenate([_NODE * node + np.arange(_NODE) for node in nodes])
            K[np.ix_(own, own)] += k
            M[np.ix_(own, own)] += mass
    return K, M, places


def reduced(plate: Plate, modes: int = MODES) -> ReducedModel:
    """The plate by its two hinge lines and modes with these held."""
    K, M, places = assembled(plate)
    hinges = {"inner": -0.5 * plate.length, "outer": 0.5 * plate.length}
    tied = np.zeros(len(places), dtype=bool)
    T = np.zeros((len(K), 12))
    for h, x in enumerate(hinges.values()):
        for node in np.flatnonzero((np.abs(places[:, 0] - x) < 1e-9) & (np.abs(places[:, 1]) < HINGE + 1e-9)):
            tied[node], r, at = True, places[node, 1], 6 * h
            own = T[_NODE * node : _NODE * node + _NODE]
            own[0, at], own[0, at + 4] = 1.0, r  # U + theta x (0, 0, r), which lies on the line x = const
            own[1, at + 2] = 1.0
            own[2, at + 1], own[2, at + 3] = 1.0, -r
            own[3, at + 5], own[4, at + 3] = 1.0, -1.0
    free = np.repeat(~tied, _NODE)
    stiff = K[np.ix_(free, free)]
    T[free] = -np.linalg.solve(stiff, K[free] @ T)
    _, shapes = scipy.linalg.eigh(stiff, M[np.ix_(free, free)], subset_by_index=[0, modes - 1])
    whole = np.hstack([T, np.zeros((len(K), modes))])
    whole[np.ix_(free, 12 + np.arange(modes))] = shapes * np.sign(shapes[np.abs(shapes).argmax(axis=0), range(modes)])
    k, m = whole.T @ K @ whole, whole.T @ M @ whole
    positions = np.array([[x, 0.0, 0.0] for x in hinges.values()])
    return ReducedModel(0.5 * (k + k.T), 0.5 * (m + m.T), positions, tuple(hinges), np.zeros((0, len(k))))


if __name__ == "__main__":
    write_model(str(SHIPPED / "solar-panel.npz"), reduced(Plate()))
