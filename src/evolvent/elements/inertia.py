"""Consistent mass matrices and load vectors, one entry for each nodal vector (the kernels spread them over x, y, z)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from evolvent.elements.forms import Array, gauss
from evolvent.elements.sections import CrossSection, Material


def axis_shape(length: float, xi: Any, *, order: int = 0) -> tuple[Any, Any, Any, Any]:
    """Shape functions of r_p, r_p,x, r_q, r_q,x on the axis (Hermite's), or their derivatives by x = length xi.

    Parameters
    ----------
    length : float, m
    xi : float or array of any shape
    order : {0, 1, 2}, of the derivative
    """
    if order == 0:
        return (
            1.0 - 3.0 * xi**2 + 2.0 * xi**3,
            length * (xi - 2.0 * xi**2 + xi**3),
            3.0 * xi**2 - 2.0 * xi**3,
            length * (xi**3 - xi**2),
        )
    if order == 1:
        return (
            (6.0 * xi**2 - 6.0 * xi) / length,
            1.0 - 4.0 * xi + 3.0 * xi**2,
            (6.0 * xi - 6.0 * xi**2) / length,
            3.0 * xi**2 - 2.0 * xi,
        )
    return (
        (12.0 * xi - 6.0) / length**2,
        (6.0 * xi - 4.0) / length,
        (6.0 - 12.0 * xi) / length**2,
        (6.0 * xi - 2.0) / length,
    )


def beam_mass(length: float, section: CrossSection, material: Material) -> Array:
    """M : (8, 8), kg and kg m2: int rho S^T S dV of the beam; section about its centroid and principal axes."""
    M = np.zeros((8, 8))
    for xi, weight in gauss(7):
        s = section.at(xi).properties(material.nu)
        p, px, q, qx = axis_shape(length, xi)
        axis = np.array([p, px, 0, 0, q, qx, 0, 0])
        y = np.array([0, 0, 1 - xi, 0, 0, 0, xi, 0])
        z = np.array([0, 0, 0, 1 - xi, 0, 0, 0, xi])
        here = s.area * np.outer(axis, axis) + s.Iz * np.outer(y, y) + s.Iy * np.outer(z, z)
        M += weight * length * material.density * here
    return M


def cable_mass(length: float, section: CrossSection, material: Material) -> Array:
    """M : (4, 4), kg and kg m2: int rho A S^T S dx of the cable."""
    M = np.zeros((4, 4))
    for xi, weight in gauss(6):
        S = np.array(axis_shape(length, xi))
        M += weight * length * material.density * section.at(xi).properties(material.nu).area * np.outer(S, S)
    return M


def load_vector(length: float, vectors: int, *, intensity: Callable[[float], float] = lambda xi: 1.0) -> Array:
    """Integral of intensity S dx : (vectors,), for a force per length on the axis that has one direction in space.

    Parameters
    ----------
    length : float, m
    vectors : {8, 4}, of a beam or of a cable
    intensity : callable, of xi = x/length; integrated exactly if it is a polynomial of degree 8 or less
    """
    S = sum(weight * length * intensity(xi) * np.array(axis_shape(length, xi)) for xi, weight in gauss(6))
    S = np.asarray(S)
    return S if vectors == 4 else np.array([S[0], S[1], 0.0, 0.0, S[2], S[3], 0.0, 0.0])


def gravity_vector(M: Array) -> Array:
    """Integral of rho S dV : (vectors,), kg and kg m, for an acceleration that is the same everywhere (weight)."""
    return M[:, 0] + M[:, M.shape[0] // 2]
