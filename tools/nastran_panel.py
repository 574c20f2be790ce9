"""Write docs/how-to/panel.pch, a panel as Nastran writes an external superelement: python tools/nastran_panel.py.

A sandwich panel as a beam of 8 elements (Euler and Bernoulli, consistent masses), reduced by Craig and Bampton (1968)
to its two ends and four modes with the ends held, as DMIG entries KAAX and MAAX. Axes: x from the root to the tip, z
normal to the panel.
"""

from __future__ import annotations

import pathlib

import numpy as np
import scipy.linalg

LENGTH, WIDTH, FACE, CORE, AREAL = 1.2, 0.3, 0.3e-3, 20e-3, 2.5  # m, m, m, m, kg/m2
E, G = 70e9, 26e9  # Pa, of the faces
ELEMENTS, MODES = 8, 4
FILE = pathlib.Path(__file__).parents[1] / "docs" / "how-to" / "panel.pch"
Array = np.ndarray


def element(length: float) -> tuple[Array, Array]:
    """Stiffness and mass of an element along x, both (12, 12): three displacements and three rotations of each end."""
    K, M = np.zeros((12, 12)), np.zeros((12, 12))
    line, polar = AREAL * WIDTH, AREAL * WIDTH**3 / 12.0
    for at, stiffness, mass in (
        (0, 2.0 * E * FACE * WIDTH, line),
        (3, 2.0 * G * FACE * CORE**2 * WIDTH, polar),  # torsion of a closed flat box
    ):
        ends = np.ix_([at, at + 6], [at, at + 6])
        K[ends] += stiffness / length * np.array([[1.0, -1.0], [-1.0, 1.0]])
        M[ends] += mass * length / 6.0 * np.array([[2.0, 1.0], [1.0, 2.0]])
    cubic_K = np.array([[12.0, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]])
    cubic_M = np.array([[156.0, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]]) / 420.0
    for at, sign, bending in (
        ([1, 5, 7, 11], 1.0, E * 2.0 * FACE * WIDTH**3 / 12.0),
        ([2, 4, 8, 10], -1.0, E * FACE * CORE**2 / 2.0 * WIDTH),
    ):
        scale = np.array([1.0, sign * length, 1.0, sign * length])
        both = np.outer(scale, scale)
        K[np.ix_(at, at)] += bending / length**3 * cubic_K * both
        M[np.ix_(at, at)] += line * length * cubic_M * both
    return K, M


def matrices() -> tuple[Array, Array]:
    """Reduced stiffness and mass, (12 + MODES, 12 + MODES)."""
    n = 6 * (ELEMENTS + 1)
    K, M = np.zeros((n, n)), np.zeros((n, n))
    for k in range(ELEMENTS):
        here = slice(6 * k, 6 * k + 12)
        for whole, one in zip((K, M), element(LENGTH / ELEMENTS), strict=True):
            whole[here, here] += one
    held = [*range(6), *range(n - 6, n)]
    inner = np.arange(6, n - 6)
    inside = np.ix_(inner, inner)
    shapes = scipy.linalg.eigh(K[inside], M[inside], subset_by_index=(0, MODES - 1))[1]
    T = np.zeros((n, 12 + MODES))
    T[held, range(12)] = 1.0
    T[inner, :12] = -np.linalg.solve(K[inside], K[np.ix_(inner, held)])
    T[inner, 12:] = shapes
    return T.T @ K @ T, T.T @ M @ T


def cards(name: str, matrix: Array) -> list[str]:
    """DMIG entries of a symmetric matrix, one column after another, wide fields."""
    labels = [(grid, component) for grid in (1, 2) for component in range(1, 7)]
    labels += [(1001 + k, 0) for k in range(MODES)]
    lines = [f"DMIG    {name:<8}{0:>8}{6:>8}{2:>8}{0:>8}"]
    least = 1e-12 * np.abs(matrix).max()
    for j, (grid, component) in enumerate(labels):
        lines.append(f"DMIG*   {name:<16}{grid:>16}{component:>16}{'':16}*")
        for (row, part), value in zip(labels[j:], matrix[j:, j], strict=True):
            if abs(value) > least:
                lines.append(f"*       {row:>16}{part:>16}{f'{value:.9E}'.replace('E', 'D'):>16}")
    return lines


def text() -> str:
    """The file."""
    K, M = matrices()
    points = [f"GRID    {k + 1:>8}{'':8}{x:8.4f}{0.0:8.4f}{0.0:8.4f}" for k, x in enumerate((0.0, LENGTH))]
    about = "$ Sandwich panel, 1.2 m x 0.3 m, 0.9 kg: root is grid 1, tip is grid 2. SI units."
    scalar = f"SPOINT  {1001:>8}    THRU{1000 + MODES:>8}"
    return "\n".join([about, *points, scalar, *cards("KAAX", K), *cards("MAAX", M), ""])


if __name__ == "__main__":
    FILE.write_text(text())
