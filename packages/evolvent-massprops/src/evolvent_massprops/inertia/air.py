"""Added mass of the air that a body moves: closed forms, and potential flow about a rectangular plate."""

from __future__ import annotations

import functools

import numpy as np

from evolvent_massprops.inertia.stand import array

#: Panels along a side of a plate, coarse and fine, between which the result is extrapolated.
PANELS = (8, 16)


def axes_of(axis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Projections (3, 3) onto an axis, and onto the plane across it."""
    e = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    along = np.outer(e, e)
    return along, np.eye(3) - along


def sphere(radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Added mass and moments (3, 3), per density, of a sphere: half of the air that it displaces, 2 pi r^3/3.

    Notes
    -----
    Lamb (1932), Hydrodynamics, 6th ed., art. 92.
    """
    return 2.0 / 3.0 * np.pi * radius**3 * np.eye(3), np.zeros((3, 3))


def disc(radius: float, axis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Added mass and moments (3, 3), per density, of a thin disc: 8 r^3/3 along its axis, 16 r^5/45 about a diameter.

    Notes
    -----
    Lamb (1932), art. 102 and 115, as the limit of a flat ellipsoid.
    """
    along, across = axes_of(axis)
    return 8.0 / 3.0 * radius**3 * along, 16.0 / 45.0 * radius**5 * across


def cylinder(radius: float, length: float, axis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Added mass and moments (3, 3), per density, of a long cylinder: strips of pi r^2 per length across its axis.

    Notes
    -----
    Lamb (1932), art. 68. Nothing along and about the axis; the flow around the ends is left out, which makes a short
    cylinder's too large.
    """
    _, across = axes_of(axis)
    strip = np.pi * radius**2
    return strip * length * across, strip * length**3 / 12.0 * across


def plate(length: float, width: float, axis: np.ndarray, along: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Added mass and moments (3, 3), per density, of a thin rectangular plate.

    Parameters
    ----------
    length, width : float, m
    axis : (3,) float, normal of the plate
    along : (3,) float, direction of its length

    Notes
    -----
    Potential flow about a plate of constant panels (`potential_flow`). A long strip has pi w^2/4 per length, and
    pi w^4/128 about its middle line (Lamb 1932, art. 71).
    """
    n = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    u = np.asarray(along, dtype=float)
    u = (u - (u @ n) * n) / np.linalg.norm(u - (u @ n) * n)
    heave, about_length, about_width = potential_flow(float(length), float(width))
    v = np.cross(n, u)
    return heave * np.outer(n, n), about_length * np.outer(u, u) + about_width * np.outer(v, v)


@functools.lru_cache(maxsize=64)
def potential_flow(length: float, width: float) -> tuple[float, float, float]:
    """Added mass, m3, and moments about the lines along length and width, m5, of a rectangular plate, per density.

    Notes
    -----
    The jump of the potential is constant in each panel, its normal velocity w is met at the panels' centres; the
    kinetic energy is the sum of jump, w and area over 2. The error falls as the size of the panels; it is extrapolated
    from two sizes.
    """
    first, second = (np.array(_panels(length, width, n)) for n in PANELS)
    ratio = PANELS[1] / PANELS[0]
    return tuple(((ratio * second - first) / (ratio - 1.0)).tolist())


def _panels(length: float, width: float, n: int) -> tuple[float, float, float]:
    """`potential_flow` with n panels along a side, narrow ones at the edges."""
    edges = 0.5 * np.sin(np.linspace(-0.5, 0.5, n + 1) * np.pi)
    x, z = (side * edges for side in (length, width))
    cx, cz = (0.5 * (e[1:] + e[:-1]) for e in (x, z))
    X, Z = (c.ravel() for c in np.meshgrid(cx, cz, indexing="ij"))
    area = np.outer(np.diff(x), np.diff(z)).ravel()
    x0, x1 = (np.repeat(e, n) for e in (x[:-1], x[1:]))
    z0, z1 = (np.tile(e, n) for e in (z[:-1], z[1:]))
    # normal velocity of a rectangle with the jump 1, from the primitive of 1/(4 pi r^3)
    A = np.zeros((n * n, n * n))
    for a, sx in ((x0, -1.0), (x1, 1.0)):
        for b, sz in ((z0, -1.0), (z1, 1.0)):
            dx, dz = a - X[:, None], b - Z[:, None]
            A -= sx * sz * np.hypot(dx, dz) / (4.0 * np.pi * dx * dz)
    velocity = np.column_stack([np.ones(n * n), Z, X])
    jump = np.linalg.solve(A, velocity)
    found = np.abs(np.einsum("kj,kj,k->j", jump, velocity, area))
    return float(found[0]), float(found[1]), float(found[2])


def given(mass: object, moments: object) -> tuple[np.ndarray, np.ndarray]:
    """Added mass and moments (3, 3) along and about x, y, z as stated."""
    return np.diag(array("mass", mass, (3,))), np.diag(array("moments", moments, (3,)))
