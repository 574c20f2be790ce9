"""Matrices of an Euler-Bernoulli beam along x by textbook elements, and their reduction by Craig and Bampton."""

from __future__ import annotations

import numpy as np
import scipy.linalg

from evolvent.elements.reduced_models import ReducedModel

Array = np.ndarray
LENGTH, YOUNG, SHEAR, DENSITY, WIDTH, HEIGHT = 2.0, 70e9, 27e9, 2700.0, 0.05, 0.01
AREA = WIDTH * HEIGHT
MASS = DENSITY * AREA * LENGTH
#: Second moments for bending in x-y and in x-z, polar, and for torsion.
I_Z, I_Y = WIDTH * HEIGHT**3 / 12.0, HEIGHT * WIDTH**3 / 12.0
POLAR, TORSION = I_Y + I_Z, 0.3 * WIDTH * HEIGHT**3


def element(length: float) -> tuple[Array, Array]:
    """Stiffness and consistent mass (12, 12): displacements and rotations of both ends."""
    K, M, h = np.zeros((12, 12)), np.zeros((12, 12)), length
    for rows, stiffness, mass in (
        ([0, 6], YOUNG * AREA, DENSITY * AREA), ([3, 9], SHEAR * TORSION, DENSITY * POLAR)
    ):  # fmt: skip
        K[np.ix_(rows, rows)] += stiffness / h * np.array([[1.0, -1.0], [-1.0, 1.0]])
        M[np.ix_(rows, rows)] += mass * h / 6.0 * np.array([[2.0, 1.0], [1.0, 2.0]])
    k = np.array([[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h],
                  [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]])  # fmt: skip
    m = np.array([[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h],
                  [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h * h, -22 * h, 4 * h * h]])  # fmt: skip
    for moment, rows, sign in ((I_Z, [1, 5, 7, 11], 1.0), (I_Y, [2, 4, 8, 10], -1.0)):
        S = np.diag([1.0, sign, 1.0, sign])
        K[np.ix_(rows, rows)] += YOUNG * moment / h**3 * S @ k @ S
        M[np.ix_(rows, rows)] += DENSITY * AREA * h / 420.0 * S @ m @ S
    return K, M


def beam(n: int) -> tuple[Array, Array]:
    """Stiffness and mass of n equal elements."""
    K, M = np.zeros((6 * n + 6, 6 * n + 6)), np.zeros((6 * n + 6, 6 * n + 6))
    for i in range(n):
        own = slice(6 * i, 6 * i + 12)
        k, m = element(LENGTH / n)
        K[own, own] += k
        M[own, own] += m
    return K, M


def reduced(n: int = 12, modes: int = 10) -> ReducedModel:
    """The beam with both ends as interface nodes."""
    K, M = beam(n)
    bound = np.concatenate([np.arange(6), np.arange(6 * n, 6 * n + 6)])
    rest = np.arange(6, 6 * n)
    _, Phi = scipy.linalg.eigh(K[np.ix_(rest, rest)], M[np.ix_(rest, rest)], subset_by_index=[0, modes - 1])
    T = np.zeros((len(K), 12 + modes))
    T[bound, np.arange(12)] = 1.0
    T[rest, :12] = -np.linalg.solve(K[np.ix_(rest, rest)], K[np.ix_(rest, bound)])
    T[rest, 12:] = Phi
    k, _ = element(LENGTH / n)
    return ReducedModel(
        T.T @ K @ T, T.T @ M @ T, np.array([[0.0, 0.0, 0.0], [LENGTH, 0.0, 0.0]]), ("root", "tip"),
        (k @ T[:12])[[1, 5]], ("root shear", "root moment"), ("N", "N m"),
    )  # fmt: skip
