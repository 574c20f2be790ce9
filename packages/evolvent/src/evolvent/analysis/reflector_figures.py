"""Figures of a net as a reflector: views with cord tensions, and a map of the surface error."""

from __future__ import annotations

import numpy as np

from evolvent.nets.error import SurfaceError
from evolvent.nets.surface import WantedSurface
from evolvent_base.figures import Figure, Line, Map, Panel

Array = np.ndarray
#: Colours of tensions; points of the map across the aperture.
_COLORS, _POINTS = 10, 240


def views(x: Array, cords: Array, own: int, tension: Array) -> Figure:
    """Front and side view of a net, with cords coloured by tension.

    Parameters
    ----------
    x : (n, 3) float, m, nodes
    cords : (m, 2) int, nodes at the ends of the cords
    own : int, number of cords that the front view shows, counted from the first: those of the front net alone
    tension : (m,) float, N, of the cords
    """
    low, high = float(tension.min()), float(tension.max())
    place = np.clip((tension - low) / max(high - low, 1e-300) * _COLORS, 0, _COLORS - 1e-9).astype(int)
    panels = []
    for across, up, count, labels in ((0, 1, own, ("x, m", "y, m")), (0, 2, len(cords), ("x, m", "z, m"))):
        lines = []
        for color in range(_COLORS):
            ends = x[cords[:count][place[:count] == color]]
            if not len(ends):
                continue
            xy = _broken(ends)
            a, b = (low + (high - low) * (color + k) / _COLORS for k in (0, 1))
            label = f"{a:.3g} to {b:.3g} N" if up == 2 else ""
            lines.append(Line(x=xy[:, across], y=xy[:, up], color=color / (_COLORS - 1), width=0.7, label=label))
        panels.append(Panel(x_label=labels[0], y_label=labels[1], lines=lines, equal=True))
    return Figure(name="net", title="Net from the front and from the side, tensions", panels=panels, height=190.0)


def error_map(surface: WantedSurface, x: Array, cords: Array, facets: Array, error: SurfaceError) -> Figure:
    """Map of the axial error, mm, over the aperture, less the shift of the best fit.

    Parameters
    ----------
    x : (n, 3) float, m, nodes
    cords : (m, 2) int, nodes at the ends of the cords
    facets : (k, 3) int, nodes at the corners of the facets
    """
    radius = 0.5 * surface.diameter
    u = np.linspace(-radius, radius, _POINTS)
    X, Y = np.meshgrid(surface.offset + u, u, indexing="ij")
    z = _height_of_facets(x, facets, X, Y)
    values = 1e3 * (z - surface.height(X, Y) - error.fit.shift[2])
    largest = float(np.nanmax(np.abs(values)))
    drawn = Map(
        x=X[:, 0], y=Y[0], values=values, label="error along the axis, less the shift of the best fit, mm",
        limits=(-largest, largest), colors="RdBu_r",
    )  # fmt: skip
    xy = _broken(x[cords])
    lines = [Line(x=xy[:, 0], y=xy[:, 1], color="gray", width=0.3)]
    panel = Panel(x_label="x, m", y_label="y, m", lines=lines, equal=True, map=drawn)
    return Figure(name="surface_error", title="Error of the surface", panels=[panel], height=150.0)


def _broken(ends: Array) -> Array:
    """(3 m, 3) float, points of one line through all cords with ends (m, 2, 3), with a NaN after each cord."""
    return np.concatenate([ends, np.full((len(ends), 1, 3), np.nan)], axis=1).reshape(-1, 3)


def _height_of_facets(x: Array, facets: Array, X: Array, Y: Array) -> Array:
    """Heights, m, of plane facets at the points of a grid; NaN outside."""
    found = np.full(X.shape, np.nan)
    u, v = X[:, 0], Y[0]
    for corners in x[facets]:
        (i0, i1), (j0, j1) = (
            np.searchsorted(axis, [corners[:, k].min(), corners[:, k].max()]) for k, axis in ((0, u), (1, v))
        )
        if i0 == i1 or j0 == j1:
            continue
        T = np.column_stack([corners[1, :2] - corners[0, :2], corners[2, :2] - corners[0, :2]])
        d = np.stack([X[i0:i1, j0:j1] - corners[0, 0], Y[i0:i1, j0:j1] - corners[0, 1]])
        a, b = np.einsum("ij,jkl->ikl", np.linalg.inv(T), d)
        z = corners[0, 2] + a * (corners[1, 2] - corners[0, 2]) + b * (corners[2, 2] - corners[0, 2])
        inside = (a >= -1e-9) & (b >= -1e-9) & (a + b <= 1.0 + 1e-9)
        found[i0:i1, j0:j1] = np.where(inside, z, found[i0:i1, j0:j1])
    return found
