"""Error of a faceted surface against a wanted one, its best fit, and the loss of gain.

Facets are plane triangles. Their error is integrated over the aperture by a rule that is exact up to polynomials of
the degree 6, so that the square of a parabola's is exact. Three measures of it are kept: the axial error along z;
the normal one, times the cosine of the angle between the normal and z; and half of the change of the path of a ray that
comes along z, times the square of that cosine (Ruze 1966, "Antenna tolerance theory").
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy

from evolvent.nets.surface import Surface
from evolvent_base.errors import InputError

Array = np.ndarray
#: Speed of light, m/s.
LIGHT = 299792458.0
#: Parameters of a best fit, and the singular value beside the largest one below which nothing determines them; share of
#: a parameter in such a direction that counts.
PARAMETERS = ("shift along x", "shift along y", "shift along z", "tilt about x", "tilt about y", "scale of heights")
_UNDETERMINED, _COUNTS = 1e-9, 0.05


def _rule() -> tuple[Array, Array]:
    """Barycentric points (12, 3) and weights (12,) on a triangle, exact up to the degree 6 (Dunavant 1985)."""
    points, weights = [], []
    for a, w in ((0.249286745170910, 0.116786275726379), (0.063089014491502, 0.050844906370207)):
        points += [(1.0 - 2.0 * a, a, a), (a, 1.0 - 2.0 * a, a), (a, a, 1.0 - 2.0 * a)]
        weights += [w] * 3
    a, b, w = 0.310352451033784, 0.636502499121399, 0.082851075618374
    c = 1.0 - a - b
    points += [(a, b, c), (a, c, b), (b, a, c), (b, c, a), (c, a, b), (c, b, a)]
    weights += [w] * 6
    found = np.array(weights)
    return np.array(points), found / found.sum()


POINTS, WEIGHTS = _rule()


class Fit(NamedTuple):
    """The wanted surface where it fits best.

    Attributes
    ----------
    shift : (3,) float, m; turn : (2,) float, rad, about x and y; scale : float, of the heights: of a paraboloid its
        wanted focal length over the fitted one
    rms : float, m, what is left of the half path error
    undetermined : names of `PARAMETERS` that may change without a change of the error, to first order: their
        values say nothing
    """

    shift: Array
    turn: Array
    scale: float
    rms: float
    undetermined: tuple[str, ...] = ()


class SurfaceError(NamedTuple):
    """Error of a faceted surface; all areas are those of the aperture, in the plane x, y.

    Attributes
    ----------
    area : float, m2, of the facets in the plane
    axial, normal, half_path : float, m, rms
    mean : float, m, of the axial error
    at_nodes : float, m, rms of the axial error of the nodes
    facets : (k,) float, m, mean axial error of each facet
    fit : Fit
    """

    area: float
    axial: float
    normal: float
    half_path: float
    mean: float
    at_nodes: float
    facets: Array
    fit: Fit


def ruze(error: float, frequency: float) -> float:
    """Loss of gain, dB, of the rms half path error, m, at a frequency, Hz (Ruze 1966, eq. 9)."""
    return float(10.0 / np.log(10.0) * (4.0 * np.pi * error * frequency / LIGHT) ** 2)


def quadrature(x: Array, facets: Array) -> tuple[Array, Array]:
    """Points (12 k, 3), m, on plane facets, and their areas in the plane x, y, m2."""
    points = np.einsum("pc,kcd->kpd", POINTS, x[facets])
    return points.reshape(-1, 3), (np.abs(signed_areas(x, facets))[:, None] * WEIGHTS).ravel()


def signed_areas(x: Array, facets: Array) -> Array:
    """Areas (k,), m2, of facets in the plane x, y, above zero where their corners are counterclockwise."""
    one, two = x[facets[:, 1]] - x[facets[:, 0]], x[facets[:, 2]] - x[facets[:, 0]]
    return np.asarray(0.5 * (one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]))


def slant(surface: Surface, x: Array, y: Array) -> Array:
    """Square of the cosine of the angle between the normal and z."""
    one, two = surface.slopes(x, y)
    return np.asarray(1.0 / (1.0 + one * one + two * two))


def surface_error(x: Array, facets: Array, surface: Surface, nodes: Array | None = None) -> SurfaceError:
    """Error of the surface of plane facets.

    Parameters
    ----------
    x : (n, 3) float, m; facets : (k, 3) int
    nodes : int, those that count among the nodes; all that have facets if left out
    """
    points, weights = quadrature(x, facets)
    own = np.unique(facets) if nodes is None else nodes
    off = points[:, 2] - surface.height(points[:, 0], points[:, 1])
    cosines = slant(surface, points[:, 0], points[:, 1])
    area = float(weights.sum())

    def rms(error: Array) -> float:
        return float(np.sqrt(weights @ error**2 / area))

    of_nodes = x[own, 2] - surface.height(x[own, 0], x[own, 1])
    return SurfaceError(
        area, rms(off), rms(off * np.sqrt(cosines)), rms(off * cosines), float(weights @ off / area),
        float(np.sqrt(np.mean(of_nodes**2))), off.reshape(-1, len(WEIGHTS)) @ WEIGHTS,
        best_fit(points, weights, surface),
    )  # fmt: skip


def best_fit(points: Array, weights: Array, surface: Surface) -> Fit:
    """The place, attitude and scale of a surface that fit points best, by the half path error.

    Parameters
    ----------
    points : (p, 3) float, m; weights : (p,) float

    Raises
    ------
    InputError
        If no fit is found.

    Notes
    -----
    The squares of cosines are those of the wanted surface at the points, which the fit does not change: far from the
    vertex of a paraboloid they vanish, so that with those of the fitted surface a dish that is shifted to infinity
    would leave no error of any points.
    """
    share = np.sqrt(weights / weights.sum()) * slant(surface, points[:, 0], points[:, 1])
    size = 0.5 * surface.diameter

    def left(p: Array) -> Array:
        shifted = points - size * p[:3]
        own = shifted @ scipy.spatial.transform.Rotation.from_rotvec([p[3], p[4], 0.0]).as_matrix()
        return np.asarray(share * (own[:, 2] - (1.0 + p[5]) * surface.height(own[:, 0], own[:, 1])) / size)

    found = scipy.optimize.least_squares(
        left, np.zeros(6), jac="3-point", method="trf", x_scale=1.0, xtol=1e-15, ftol=1e-15, gtol=1e-15
    )
    p = found.x
    if not found.success:
        raise InputError(f"no best fit of the surface to its {len(points)} points is found in {found.nfev} iterations")
    _, sizes, directions = np.linalg.svd(found.jac, full_matrices=len(points) < len(p))
    sizes = np.concatenate([sizes, np.zeros(len(p) - sizes.size)])
    open_ = np.linalg.norm(directions[sizes <= _UNDETERMINED * sizes.max()], axis=0) > _COUNTS
    names = tuple(name for name, one in zip(PARAMETERS, open_, strict=True) if one)
    return Fit(size * p[:3], p[3:5], 1.0 + float(p[5]), size * float(np.linalg.norm(found.fun)), names)


def mean_square_slope(x: Array, facets: Array, surface: Surface) -> tuple[float, Array]:
    """Mean square of the half path error, m2, and its derivatives (n, 3) by the places of the nodes.

    Parameters
    ----------
    x : (n, 3) float, m; facets : (k, 3) int

    Notes
    -----
    On a facet the error is linear in the heights of the corners, and depends on their places in the plane through the
    points of the rule and its weights. All are differentiated.
    """
    points, weights = quadrature(x, facets)
    px, py = points[:, 0], points[:, 1]
    off, cosine = points[:, 2] - surface.height(px, py), slant(surface, px, py)
    error, (sx, sy) = off * cosine, surface.slopes(px, py)
    h = 1e-5 * surface.diameter
    cx = (slant(surface, px + h, py) - slant(surface, px - h, py)) / (2.0 * h)
    cy = (slant(surface, px, py + h) - slant(surface, px, py - h)) / (2.0 * h)
    by_point = np.stack([-sx * cosine + off * cx, -sy * cosine + off * cy, cosine], axis=1)
    whole = weights.sum()
    mean = float(weights @ error**2 / whole)
    share = (2.0 * weights * error / whole)[:, None] * by_point
    local = np.einsum("pc,kpd->kcd", POINTS, share.reshape(len(facets), len(WEIGHTS), 3))
    excess = (error.reshape(len(facets), -1) ** 2 @ WEIGHTS - mean) / whole * np.sign(signed_areas(x, facets))
    plan = x[facets, :2]
    for c in range(3):  # derivatives of the signed areas by the corners
        a, b = plan[:, (c + 1) % 3], plan[:, (c + 2) % 3]
        local[:, c, 0] += excess * 0.5 * (a[:, 1] - b[:, 1])
        local[:, c, 1] += excess * 0.5 * (b[:, 0] - a[:, 0])
    found = np.zeros(x.shape)
    np.add.at(found, facets, local)
    return mean, found
