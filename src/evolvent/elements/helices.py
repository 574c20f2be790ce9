"""Beams wound on a cylinder as a helix without stretch."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from evolvent.elements.inertia import axis_shape
from evolvent.elements.sections import CrossSection, Material
from evolvent.elements.winding import _CABLES, _energy, _least

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

    Notes
    -----
    All elements are alike but for a screw motion. Half a turn about the radius through its middle maps an element onto
    itself: slopes and z directors lie in the tangent plane, and y directors point to the axis. Their sizes, and the
    distance of the nodes from the axis, are those of least energy for the angle that an
    element spans; that angle is such that the contact point nearest to the axis lies on the cylinder.
    """
    from scipy.optimize import brentq

    cosine = math.cos(math.atan(pitch / (2.0 * math.pi * radius)))
    sine = math.sqrt(1.0 - cosine * cosine)
    advance, energy = pitch / (2.0 * math.pi), _energy(formulation, length, section, material)
    vectors, sizes = (2, 3) if formulation in _CABLES else (4, 6)

    def node(angle: float) -> tuple[Array, Array]:
        """Derivatives of a node's vectors by the sizes (vectors, 3, sizes), and what does not depend on them."""
        c, s = math.cos(angle), math.sin(angle)
        out, around, up = np.array([c, s, 0.0]), np.array([-s, c, 0.0]), np.array([0.0, 0.0, 1.0])
        by = np.zeros((4, 3, 6))
        by[0, :, 0] = out
        by[1, :, 1], by[1, :, 2] = around, up
        by[2, :, 3] = -out
        by[3, :, 4], by[3, :, 5] = up, -around
        fixed = np.zeros((4, 3))
        fixed[0] = advance * angle * up
        return by[:vectors, :, :sizes], fixed[:vectors]

    def bent(angle: float) -> Array:
        """Sizes of least energy of an element that spans an angle."""
        ends = [node(-0.5 * angle), node(0.5 * angle)]
        by = np.concatenate([found[0] for found in ends]).reshape(-1, sizes)
        fixed = np.concatenate([found[1] for found in ends]).ravel()
        straight = np.array([radius, cosine, sine, 1.0, cosine, sine])[:sizes]
        return _least(lambda p: energy(by @ p + fixed), straight)[1]

    shapes = axis_shape(length, np.arange(1, points + 1) / points, order=0)

    def nearest(angle: float) -> float:
        """Distance from the axis of the contact point that is nearest to it."""
        p = bent(angle)
        ends = [by @ p + fixed for by, fixed in (node(-0.5 * angle), node(0.5 * angle))]
        places = np.einsum("jk,ji->ki", shapes, np.array([ends[0][0], ends[0][1], ends[1][0], ends[1][1]]))
        return float(np.hypot(places[:, 0], places[:, 1]).min())

    flat = length * cosine / radius
    angle = brentq(lambda a: nearest(a) - radius, 0.7 * flat, 1.3 * flat, xtol=1e-14)
    p = bent(angle)
    return np.stack([by @ p + fixed for by, fixed in (node(k * angle) for k in range(count + 1))])
