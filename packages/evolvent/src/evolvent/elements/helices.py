"""Beams wound on a cylinder as a helix without stretch.

All elements are alike but for a screw motion. Half a turn about the radius through its middle maps an element onto
itself: slopes and z directors lie in the tangent plane, and y directors point to the axis. Their sizes, and the
distance of the nodes from the axis, are those of least energy for the angle that an element spans.
"""

from __future__ import annotations

import functools
import math

import numpy as np
import scipy
from numpy.typing import NDArray

from evolvent.elements.materials import Material
from evolvent.elements.shape_functions import axis_shape
from evolvent.elements.shapes import CrossSection
from evolvent.elements.winding import _CABLES, _energy, _least
from evolvent_base.dense import product

Array = NDArray[np.float64]


def helix(
    formulation: str,
    count: int,
    length: float,
    section: CrossSection,
    material: Material,
    *,
    radius: float,
    pitch: float,
    points: int = 1,
) -> Array:
    """Nodes of a beam that is wound on a cylinder about z as a helix, from (radius, 0, 0) upwards, counterclockwise.

    Parameters
    ----------
    formulation : as of `evolvent.parts.Beam`
    count, length : elements, and the length of one of them without stress, m
    section : of the element that bends most easily
    radius : float, m, of the cylinder
    pitch : float, m, above 0, advance along z in one turn
    points : contact points of each element, evenly spaced, its second node included: none lies below the surface

    Returns
    -------
    (count + 1, 2 or 4, 3) float, m and 1
    """
    element, advance = (formulation, length, section, material), pitch / (2.0 * math.pi)
    shapes = axis_shape(length, np.arange(1, points + 1) / points, order=0)

    def nearest(angle: float) -> float:
        """Distance from the axis of the contact point that is nearest to it."""
        _, sizes = _bent_element(*element, radius, advance, angle)
        ends = np.concatenate([_node(s * angle, advance, sizes)[:2] for s in (-0.5, 0.5)])
        places = np.einsum("jk,ji->ki", shapes, ends)
        return float(np.hypot(places[:, 0], places[:, 1]).min())

    flat = length / math.hypot(radius, advance)
    angle = scipy.optimize.brentq(lambda a: nearest(a) - radius, 0.7 * flat, 1.3 * flat, xtol=1e-14)
    _, sizes = _bent_element(*element, radius, advance, angle)
    return np.stack([_node(k * angle, advance, sizes) for k in range(count + 1)])


def helix_stiffness_ratio(
    formulation: str, length: float, section: CrossSection, material: Material, radius: float, pitch: float
) -> float:
    """Strain energy of an element on a helix over that of a rod, (E I k^2 + G J t^2) l/2; a cable has no torsion t.

    Parameters
    ----------
    radius, pitch : float, m, of the helix, pitch above 0

    Notes
    -----
    With b = pitch/2 pi: curvature k = R/(R^2 + b^2), torsion t = b/(R^2 + b^2).
    """
    advance = pitch / (2.0 * math.pi)
    square = radius**2 + advance**2
    found = [section.at(xi).properties(material.nu) for xi in (0.0, 0.5, 1.0)]
    EI, GJ = (
        modulus * (values[0] + 4.0 * values[1] + values[2]) / 6.0
        for modulus, values in ((material.E, [p.Iz for p in found]), (material.shear_modulus, [p.J for p in found]))
    )
    energy = 0.5 * length * (EI * radius**2 + (0.0 if formulation in _CABLES else GJ * advance**2)) / square**2
    least, _ = _bent_element(formulation, length, section, material, radius, advance, length / math.sqrt(square))
    return least / energy


@functools.lru_cache(maxsize=256)
def _bent_element(
    formulation: str, length: float, section: CrossSection, material: Material, radius: float, advance: float,
    angle: float,
) -> tuple[float, Array]:  # fmt: skip
    """Least energy (J) of an element that spans an angle about the axis, and its sizes there, as `_node` takes them."""
    slope = math.atan2(advance, radius)
    cosine, sine = math.cos(slope), math.sin(slope)
    start = np.array([radius, cosine, sine, 1.0, cosine, sine])[: 3 if formulation in _CABLES else 6]
    zero = np.zeros(start.size)
    ends = (-0.5 * angle, 0.5 * angle)
    fixed = np.concatenate([_node(a, advance, zero).ravel() for a in ends])
    units = np.eye(start.size)
    by = np.stack([np.concatenate([_node(a, advance, e).ravel() for a in ends]) - fixed for e in units], axis=1)
    energy = _energy(formulation, length, section, material)
    return _least(lambda p: energy(product(by, p) + fixed), start)


def _node(angle: float, advance: float, sizes: Array) -> Array:
    """Vectors (2 or 4, 3) of the node at an angle about z.

    Parameters
    ----------
    sizes : (3,) or (6,) float
        Distance from the axis (m); parts of the slope across the axis and along it; of a beam length of the y
        director, and parts of the z director along the axis and against the sense of winding.
    """
    c, s = math.cos(angle), math.sin(angle)
    out, around, up = np.array([c, s, 0.0]), np.array([-s, c, 0.0]), np.array([0.0, 0.0, 1.0])
    vectors = [sizes[0] * out + advance * angle * up, sizes[1] * around + sizes[2] * up]
    if sizes.size > 3:
        vectors += [-sizes[3] * out, sizes[4] * up - sizes[5] * around]
    return np.stack(vectors)
