"""Beams wound on a cylinder: stiffness of bent elements, coils without stretch, and nodes on another mesh.

An element whose nodes point along an arc takes the chord and the lengths of its slopes and directors at which its
energy is least. Where a formulation locks, that energy is larger than EI l / (2 R^2).
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from evolvent.elements.forms import beam_form, cable_form, cable_stretch_energy, cable_stretch_form
from evolvent.elements.materials import Material
from evolvent.elements.shape_functions import axis_shape
from evolvent.elements.shapes import CrossSection
from evolvent_base.dense import modes, product

Array = NDArray[np.float64]
_CABLES = ("cable", "cable_stretch")


@functools.lru_cache(maxsize=256)
def bent_element(
    formulation: str,
    length: float,
    section: CrossSection,
    material: Material,
    angle: float,
    rest: tuple[float, ...] | None = None,
) -> tuple[float, Array]:
    """Least energy (J) of an element whose ends' directions differ by `angle` about its z axis, and its sizes there.

    Parameters
    ----------
    formulation : as of `evolvent.parts.Beam`
    length : float, m, of the element without stress
    angle : float, rad, above 0
    rest : (24,) float, optional, coordinates of a beam's shape without stress; straight if left out

    Returns
    -------
    energy : float
    sizes : (2,) or (4,) float
        Chord (m), length of both slopes, and of a beam those of both y and of both z directors; not writeable.
    """
    c, s = math.cos(0.5 * angle), math.sin(0.5 * angle)
    every = np.zeros((8, 3, 4))  # of nodal vectors, coordinates and sizes
    every[4, 0, 0] = 1.0
    every[1, :2, 1], every[5, :2, 1] = (c, -s), (c, s)
    every[2, :2, 2], every[6, :2, 2] = (s, c), (-s, c)
    every[3, 2, 3] = every[7, 2, 3] = 1.0
    B = every[[0, 1, 4, 5], :, :2].reshape(12, 2) if formulation in _CABLES else every.reshape(24, 4)
    energy = _energy(formulation, length, section, material, rest)
    return _least(lambda p: energy(product(B, p)), np.array([length * s / (0.5 * angle), *np.ones(B.shape[1] - 1)]))


def bending_stiffness_ratio(
    formulation: str, length: float, section: CrossSection, material: Material, radius: float
) -> float:
    """Effective over true bending stiffness of an element that is bent to a radius; true is EI l / (2 R^2)."""
    moments = [section.at(xi).properties(material.nu).Iz for xi in (0.0, 0.5, 1.0)]
    EI = material.E * (moments[0] + 4.0 * moments[1] + moments[2]) / 6.0
    energy, _ = bent_element(formulation, length, section, material, length / radius)
    return float(energy / (0.5 * EI * length / radius**2))


@functools.lru_cache(maxsize=8)
def _energy(
    formulation: str,
    length: float,
    section: CrossSection,
    material: Material,
    rest: tuple[float, ...] | None = None,
) -> Callable[[Array], Any]:
    """Strain energy of an element as an analytic function of its coordinates."""
    if formulation == "cable_stretch":
        return functools.partial(cable_stretch_energy, cable_stretch_form(length, section, material))
    if formulation == "cable":
        return cable_form(length, section, material).energy
    unloaded = None if rest is None else np.array(rest)
    return beam_form(formulation, length, section, material, rest=unloaded).energy


def _least(energy: Callable[[Array], Any], p: Array) -> tuple[float, Array]:
    """Least value of an analytic function of p, and where it is: Newton's method, steps that always descend.

    Slopes are found by complex steps, without round-off, and second derivatives by their differences.
    """

    def slope_at(p: Array) -> Array:
        return np.array([1e30 * energy(p + 1e-30j * e).imag for e in np.eye(p.size)])

    for _ in range(100):
        slope, step = slope_at(p), 1e-6 * np.diag(np.abs(p))
        K = np.array([(slope_at(p + h) - slope_at(p - h)) / (2.0 * h.sum()) for h in step])
        values, vectors = modes(0.5 * (K + K.T) * np.outer(p, p))  # of relative changes
        change = -p * product(vectors, product(vectors.T, p * slope) / np.abs(values))
        while np.abs(change / p).max() > 1e-6 and energy(p + change) > energy(p):  # smaller ones: below round-off
            change *= 0.5
        p = p + change
        if np.abs(change / p).max() < 1e-13:
            break
    p.setflags(write=False)
    return float(energy(p)), p


# ------------------------------------------------------------------------------------------------ nodes


def nodal(positions: Array, slopes: Array, z: Array, across: float = 1.0, along: float = 1.0, *, vectors: int) -> Array:
    """Nodes (n, vectors, 3) from positions and slopes (n, 3); directors of the lengths `across` (y) and `along` (z).

    Parameters
    ----------
    z : (3,) float, unit vector across all slopes, of the sections' z
    vectors : 2 of a cable, 4 of a beam
    """
    if vectors == 2:
        return np.stack([positions, slopes], axis=1)
    e1 = slopes / np.linalg.norm(slopes, axis=1)[:, None]
    return np.stack([positions, slopes, across * np.cross(z, e1), along * np.broadcast_to(z, e1.shape)], axis=1)


def coil(
    formulation: str,
    count: int,
    length: float,
    section: CrossSection,
    material: Material,
    *,
    radius: float,
    points: int = 1,
    thickness: float = 0.0,
    beams: int = 1,
    rest: Array | None = None,
) -> Array:
    """Nodes of a beam that is wound on a cylinder about z without stretch, from (radius, 0, 0), counterclockwise.

    Parameters
    ----------
    formulation : as of `evolvent.parts.Beam`
    count, length : elements, and the length of one of them without stress, m
    section : of the element that bends most easily
    radius : float, m, of the cylinder
    points : contact points of each element, evenly spaced, its second node included: none lies below the surface
    thickness : float, m, by which each turn lies above the one below; 0: all turns at the same radius
    beams : number of beams that are wound side by side, evenly spaced
    rest : (count + 1, 4, 3) float, optional, nodes of the shape without stress; straight if left out

    Returns
    -------
    (count + 1, 2 or 4, 3) float, m and 1

    Notes
    -----
    Chord and slopes of an element are those of least energy when bent by its angle; the angle is such that the contact
    point nearest to the axis lies on the cylinder. With a thickness a spiral: the first turn leaves the cylinder until
    it meets the root below, its own or the next beam's. Of a curved shape without stress every element has its own
    chord, and a node the mean of the slopes and directors of both of its elements, turned as that shape's: where its
    curvature changes, an element's ends do not lie symmetrically about its chord, which counts as shear.
    """

    def distances_and_sizes(angle: float, xi: Array) -> tuple[Array, Array]:
        """Distances of points of an element from the axis, and the element's sizes."""
        _, sizes = bent_element(formulation, length, section, material, angle)
        (chord, slope), half = sizes[:2], 0.5 * angle
        # Hermite's cubic from (-chord/2, 0) to (chord/2, 0), the axis at (0, -chord / (2 tan(half)))
        x = chord * (3.0 * xi**2 - 2.0 * xi**3 - 0.5)
        x += length * slope * math.cos(half) * (xi - 3.0 * xi**2 + 2.0 * xi**3)
        y = length * slope * math.sin(half) * (xi - xi**2)
        return np.hypot(x, y + 0.5 * chord / math.tan(half)), sizes

    touching, flat = np.arange(1, points + 1) / points, length / radius
    angle = scipy.optimize.brentq(
        lambda a: distances_and_sizes(a, touching)[0].min() - radius, 0.5 * flat, 1.5 * flat, xtol=1e-15
    )
    distance, (chord, slope, *directors) = distances_and_sizes(angle, np.linspace(0.0, 1.0, 41))
    rate, growth = 0.0, 0.0  # of the chord with the angle; of the radius with the angle wound
    if thickness > 0.0:
        rate = (chord - bent_element(formulation, length, section, material, 0.99 * angle)[1][0]) / (0.01 * angle)
        growth = (thickness + float(np.ptp(distance))) * beams / (2.0 * math.pi)
    start = 0.5 * chord / math.sin(0.5 * angle)
    sizes, leads = np.tile([chord, slope, *directors], (count, 1)), np.zeros(count)
    if rest is not None:
        leads = _leads(rest)
        element = (formulation, length, section, material, angle)
        sizes = np.array([bent_element(*element, tuple(rest[k : k + 2].ravel()))[1] for k in range(count)])
    at_nodes, lead = _at_nodes(sizes), _at_nodes(leads)

    def node(phi: Any) -> tuple[Array, Any]:
        """Position at the angle phi, and the direction there."""
        r = start + growth * phi
        return np.stack([r * np.cos(phi), r * np.sin(phi), 0.0 * phi]), phi + 0.5 * math.pi - np.arctan2(growth, r)

    def excess(phi: float, before: float, chord: float) -> float:
        (at, facing), (place, direction) = node(phi), node(before)
        return math.dist(at, place) - (chord + rate * (facing - direction - angle))

    angles = [0.0]
    for k in range(count):
        low, high = angles[-1] + 0.5 * angle, angles[-1] + 1.5 * angle
        if growth:
            angles.append(scipy.optimize.brentq(excess, low, high, args=(angles[-1], sizes[k, 0]), xtol=1e-15))
        else:
            turn = angle if rest is None else 2.0 * math.asin(0.5 * sizes[k, 0] / start)
            angles.append(angles[-1] + turn)
    positions, faced = node(np.array(angles))
    faced = faced + lead
    slopes = np.stack([np.cos(faced), np.sin(faced), 0.0 * faced], axis=1)
    found = nodal(positions.T, slopes, np.array([0.0, 0.0, 1.0]), vectors=2 + len(directors))
    found[:, 1:] *= at_nodes[:, 1:, None]
    return found


def _at_nodes(values: Array) -> Array:
    """Means of both elements of each node, (n + 1, ...), of values (n, ...) of elements."""
    found: Array = 0.5 * (np.concatenate([values[:1], values]) + np.concatenate([values, values[-1:]]))
    return found


def _leads(nodes: Array) -> Array:
    """Angle about z from each element's chord to the mean direction of its ends, (n,), rad, of nodes (n + 1, 4, 3)."""
    along, chords = np.unwrap(np.arctan2(nodes[:, 1, 1], nodes[:, 1, 0])), np.diff(nodes[:, 0], axis=0)
    mean = 0.5 * (along[1:] + along[:-1])
    off = mean - np.arctan2(chords[:, 1], chords[:, 0])
    found: Array = (off + np.pi) % (2.0 * np.pi) - np.pi
    return found


def resampled(nodes: Array, rates: Array, length: float, count: int, *, vectors: int, z: Array) -> tuple[Array, Array]:
    """Nodes and rates of a beam on another mesh, or for another formulation.

    Parameters
    ----------
    nodes, rates : (n + 1, 2 or 4, 3) float
    length : float, m, of the whole beam without stress
    count, vectors : elements and vectors of a node of the new mesh
    z : (3,) float, direction near which z directors point, where the new nodes need them and the old ones lack them

    Returns
    -------
    (count + 1, vectors, 3) float, both
    """
    old = nodes.shape[0] - 1
    at = np.linspace(0.0, old, count + 1)
    cell = np.minimum(at.astype(int), old - 1)
    xi = at - cell
    found = []
    for e in (nodes, rates):
        ends = np.stack([e[cell, 0], e[cell, 1], e[cell + 1, 0], e[cell + 1, 1]])
        own = [np.einsum("jk,jki->ki", axis_shape(length / old, xi, order=order), ends) for order in (0, 1)]
        if nodes.shape[1] == vectors == 4:
            own += [(1.0 - xi)[:, None] * e[cell, i] + xi[:, None] * e[cell + 1, i] for i in (2, 3)]
        found.append(own)
    if vectors > len(found[0]):
        slope, turning = found[0][1], found[1][1]
        size = np.linalg.norm(slope, axis=1)[:, None]
        e1 = slope / size
        e3 = z - product(e1, z)[:, None] * e1
        e3 /= np.linalg.norm(e3, axis=1)[:, None]
        e2, w = np.cross(e3, e1), np.cross(e1, turning) / size
        found[0] += [e2, e3]
        found[1] += [np.cross(w, e2), np.cross(w, e3)]
    return np.stack(found[0], axis=1), np.stack(found[1], axis=1)
