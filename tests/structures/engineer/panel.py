"""A sandwich panel by finite elements of one's own: a grillage of beams, reduced, as a punch file of Nastran."""

from __future__ import annotations

import pathlib

import numpy as np
import scipy.linalg

LENGTH, WIDTH, MASS_PER_AREA = 1.2, 0.9, 2.5  # m, m, kg/m2
ALONG, ACROSS, MODES = 6, 5, 8  # nodes, nodes, fixed-interface modes
YOUNG, SHEAR, SHEET, HEIGHT = 70e9, 26e9, 0.3e-3, 20e-3  # Pa, Pa, m of each face, m between the faces
#: Grid points of the punch file: two towards the satellite and two towards the next panel, by row and column.
GRIDS = {1: (0, 1), 2: (0, 3), 3: (ALONG - 1, 1), 4: (ALONG - 1, 3)}


def _beam(length: float, axis: int, width: float) -> np.ndarray:
    """Stiffness (12, 12) of a strip of the panel along x (axis 0) or y (axis 1)."""
    bending, area = 0.5 * SHEET * HEIGHT**2 * width, 2 * SHEET * width
    flat, torsion = SHEET * width**3 / 6, 0.5 * SHEET * HEIGHT**2 * width
    k = np.zeros((12, 12))
    for at, stiffness in ((0, YOUNG * area / length), (3, SHEAR * torsion / length)):
        k[np.ix_([at, at + 6], [at, at + 6])] += stiffness * np.array([[1, -1], [-1, 1]])
    for at, inertia, sign in (((1, 5, 7, 11), flat, 1.0), ((2, 4, 8, 10), bending, -1.0)):
        a, b = sign * 6 * length, 2 * length**2
        rows = [[12, a, -12, a], [a, 2 * b, -a, b], [-12, -a, 12, -a], [a, b, -a, 2 * b]]
        k[np.ix_(at, at)] += YOUNG * inertia / length**3 * np.array(rows)
    turned = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1]]) if axis == 0 else np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    T = np.kron(np.eye(4), turned)
    return np.asarray(T.T @ k @ T)


def whole() -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and mass (6 n, 6 n) of the panel."""
    size = 6 * ALONG * ACROSS
    K, M = np.zeros((size, size)), np.zeros((size, size))
    steps = LENGTH / (ALONG - 1), WIDTH / (ACROSS - 1)

    def freedoms(i: int, j: int) -> np.ndarray:
        return 6 * (i * ACROSS + j) + np.arange(6)

    def share(k: int, count: int) -> float:
        return 0.5 if k in (0, count - 1) else 1.0

    for i in range(ALONG):
        for j in range(ACROSS):
            here, parts = freedoms(i, j), share(i, ALONG) * share(j, ACROSS)
            M[here[:3], here[:3]] += MASS_PER_AREA * steps[0] * steps[1] * parts
            M[here[3:], here[3:]] += MASS_PER_AREA * steps[0] * steps[1] * parts * 1e-3
            for axis, other, width in (
                (0, (i + 1, j), steps[1] * share(j, ACROSS)),
                (1, (i, j + 1), steps[0] * share(i, ALONG)),
            ):
                if other[0] < ALONG and other[1] < ACROSS:
                    both = np.concatenate([here, freedoms(*other)])
                    K[np.ix_(both, both)] += _beam(steps[axis], axis, width)
    return K, M


def reduced() -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and mass on the grids and the modes of the panel that they hold (Craig and Bampton)."""
    K, M = whole()
    held = np.concatenate([6 * (i * ACROSS + j) + np.arange(6) for i, j in GRIDS.values()])
    inner = np.setdiff1d(np.arange(len(K)), held)
    _, shapes = scipy.linalg.eigh(K[np.ix_(inner, inner)], M[np.ix_(inner, inner)], subset_by_index=[0, MODES - 1])
    T = np.zeros((len(K), held.size + MODES))
    T[held, np.arange(held.size)] = 1.0
    T[inner, : held.size] = -np.linalg.solve(K[np.ix_(inner, inner)], K[np.ix_(inner, held)])
    T[inner, held.size :] = shapes
    return T.T @ K @ T, T.T @ M @ T


def frequencies(K: np.ndarray, M: np.ndarray, count: int) -> np.ndarray:
    """Of the free panel without its six rigid motions, Hz."""
    found = scipy.linalg.eigh(K, M, eigvals_only=True, subset_by_index=[6, 5 + count])
    return np.sqrt(found) / (2 * np.pi)


def write(path: pathlib.Path) -> None:
    """Grids, scalar points and matrices as Nastran punches them."""
    lines = []
    for grid, (i, j) in GRIDS.items():
        x, y = LENGTH * i / (ALONG - 1), WIDTH * (j / (ACROSS - 1) - 0.5)
        lines.append(f"GRID    {grid:>8}{'':8}{x:8.4f}{y:8.4f}{0.0:8.4f}")
    lines.append(f"SPOINT  {1000:>8}    THRU{999 + MODES:>8}")
    places = [(grid, component) for grid in GRIDS for component in range(1, 7)] + [(1000 + k, 0) for k in range(MODES)]
    for name, matrix in zip(("KAAX", "MAAX"), reduced(), strict=True):
        lines.append(f"DMIG    {name:<8}{0:>8}{6:>8}{2:>8}{0:>8}")
        for j, (grid, component) in enumerate(places):
            lines.append(f"DMIG*   {name:<16}{grid:>16}{component:>16}{'':16}*")
            for i, place in enumerate(places[j:], j):
                value = f"{matrix[i, j]:>16.9E}".replace("E", "D")
                lines.append(f"*       {place[0]:>16}{place[1]:>16}{value}")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
