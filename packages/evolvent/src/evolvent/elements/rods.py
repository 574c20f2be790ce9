"""Constants and strains of the elements of geometrically exact rods (`families.rods.rod_strains`), in NumPy."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import scipy

from evolvent.elements.inertia import OWN_INERTIA, SectionInertia
from evolvent.elements.materials import Material
from evolvent.elements.sections import SectionStiffness, TapeSection
from evolvent.elements.shapes import CrossSection, Strip
from evolvent_base.dense import inverse, legendre, norm, product

Array = np.ndarray
#: Gauss's four points of an element and their weights.
_AT, _WEIGHT = legendre(4)
#: Off-diagonal entries K_ij that are round-off, relative to sqrt(K_ii K_jj).
_ROUND_OFF = 1e-13


class Lumped(NamedTuple):
    """Mass (kg), inertia (3, 3), axes of the section (kg m2), and first moment along the rod from the node (kg m).

    Of an element's share of a node.
    """

    mass: float
    inertia: Array
    moment: float


def section_stiffness(section: CrossSection, material: Material | None, at: float = 0.5) -> Array:
    """(6, 6): forces (N, Q_y, Q_z) and moments (M_x, M_y, M_z) by the strains Gamma and K; N, N m and N m2.

    Notes
    -----
    The strain along the axis is Gamma_x + z K_y - y K_z, which Iyz = int y z dA couples; shear is that of the shear
    centre, about which the section twists.
    """
    if isinstance(section, SectionStiffness):
        C = np.array(section.matrix)
        return 0.5 * (C + C.T)
    assert material is not None
    s, G, E = section.at(at).properties(material.nu), material.shear_modulus, material.E
    own = np.diag([E * s.area, s.shear_y * G * s.area, s.shear_z * G * s.area, G * s.J, E * s.Iy, E * s.Iz])
    own[4, 5] = own[5, 4] = -E * s.Iyz
    at_centre = np.eye(6)
    at_centre[1, 3], at_centre[2, 3] = -s.centre_z, s.centre_y
    return product(at_centre.T, own, at_centre)


def section_compliance(section: CrossSection, material: Material | None, at: float = 0.5) -> Array:
    """Inverse (6, 6) of `section_stiffness`, 0 for bending about z of a section that flattens."""
    found = inverse(section_stiffness(section, material, at))
    if isinstance(section, TapeSection):
        found[5], found[:, 5] = 0.0, 0.0
    return found


def element_stiffness(
    length: float, section: CrossSection, material: Material | None, rest: Array, *, taut: bool = False
) -> Array:
    """Stiffness (6, 6) of an element per length, by the strains of the helix through its ends.

    Parameters
    ----------
    rest : (6,) float, strains Gamma_0 and K_0 without stress
    taut : bool, without residual bending flexibility, as of a strip

    Notes
    -----
    Without loads along it an element's forces and moments S = (n, m) in the axes of its sections follow from those of
    its middle: n' = -K_0 x n, m' = -K_0 x m - Gamma_0 x n, S(x) = exp(x A) S_m. With the mean T of exp(x A) the strains
    of the helix are conjugate to T S_m, so that the compliance is T^-T (mean of exp(x A)^T C^-1 exp(x A)) T^-1. Of a
    straight uniform element that of shear is 1/(k G A) + L^2/(12 E I) (residual bending flexibility, MacNeal 1978).
    Elements with it are exact at their nodes in linear statics and do not lock. Under a tension above 12 E I/L^2 they
    are unstable: so a strip has the stiffness of the section in its middle, with which its chord keeps the mean
    direction of its ends. Bending about z of a section that flattens (`families.rods.tape`) is left out, row, column
    and residual flexibility.
    """
    if taut or isinstance(section, Strip):
        return section_stiffness(section, material)
    A = np.zeros((6, 6))
    A[:3, :3] = A[3:, 3:] = -skew(rest[3:])
    A[3:, :3] = -skew(rest[:3])
    found, mean = np.zeros((6, 6)), np.zeros((6, 6))
    for x, weight in zip(0.5 * _AT, 0.5 * _WEIGHT, strict=True):
        carry = term = np.eye(6)
        for k in range(1, 13):
            term = product(term, A) * (x * length / k)
            carry = carry + term
        found = found + weight * product(carry.T, section_compliance(section, material, 0.5 + x), carry)
        mean = mean + weight * carry
    if isinstance(section, TapeSection):
        found[5, 5] = 1.0
        stiffness = product(mean, inverse(found), mean.T)
        stiffness[5], stiffness[:, 5] = 0.0, 0.0
        return 0.5 * (stiffness + stiffness.T)
    stiffness = product(mean, inverse(found), mean.T)
    return 0.5 * (stiffness + stiffness.T)


def is_diagonal(stiffness: Array) -> bool:
    """Whether the off-diagonal entries of a stiffness matrix are round-off."""
    sizes = np.sqrt(np.maximum(np.diag(stiffness), 0.0))
    off_diagonal = np.abs(stiffness - np.diag(np.diag(stiffness)))
    return bool(np.all(off_diagonal <= _ROUND_OFF * np.outer(sizes, sizes)))


def element_inertia(
    length: float, section: CrossSection, material: Material | None, own: SectionInertia = OWN_INERTIA
) -> tuple[Lumped, Lumped]:
    """Mass, and rotary inertia about the mass centre, that an element gives to its first and its last node.

    Notes
    -----
    Masses and first moments are those that the shapes of bending give to displacement and rotation of the nodes: of a
    uniform element half of the mass, a sixth of the length from the node; of a tapered one see `_bending_shares`.
    """
    shares, uniform = [], section.between(0.0, 0.5) is section
    for side in range(2):
        mass, inertia, moment = 0.0, np.zeros((3, 3)), 0.0
        for x, weight in zip(0.5 + 0.5 * _AT, 0.5 * _WEIGHT, strict=True):
            m, about_y, about_z, product = own.values(section.at(x), material)
            polar = own.polar(section.at(x), material)
            part = length * weight * (x if side else 1.0 - x)
            mass += part * m
            moment += (1.0 - 2.0 * side) * length * part * m / 6.0
            inertia = inertia + part * np.array([[polar, 0, 0], [0, about_y, -product], [0, -product, about_z]])
        shares.append(Lumped(mass, inertia, moment))
    if not uniform:
        whole, given = shares[0].mass + shares[1].mass, _bending_shares(length, section, material, own)
        for side, (mass, moment) in enumerate(given):
            total = shares[0].inertia + shares[1].inertia
            shares[side] = Lumped(mass, mass / whole * total, moment)
    return shares[0], shares[1]


def _bending_shares(
    length: float, section: CrossSection, material: Material | None, own: SectionInertia
) -> list[tuple[float, float]]:
    """Masses and first moments of an element at both nodes, by the shapes that displacement and rotation of these bend.

    Notes
    -----
    A shape has w'' = c (a + b x), c the compliance of bending at the points of `element_stiffness`. The mass of a node
    is the integral of m w by the shape of its displacement, the first moment that by the shape of its rotation.
    """
    x, weight = 0.5 + 0.5 * _AT, 0.5 * _WEIGHT
    beyond = np.zeros(len(x))  # integrals of m (s - x) from x on
    whole, first = 0.0, 0.0
    for start, at in ((0.0, -1), *zip(x, range(len(x)), strict=True)):
        for s, part in zip(start + (1.0 - start) * x, (1.0 - start) * weight, strict=True):
            m = part * own.values(section.at(s), material)[0]
            if at < 0:
                whole, first = whole + m, first + m * s
            else:
                beyond[at] += m * (s - start)
    compliance = np.array([np.trace(section_compliance(section, material, float(at))[4:, 4:]) for at in x])
    basis = (weight * compliance) * np.array([np.ones_like(x), x])  # of w'' by a and b
    ends = np.stack([basis @ (1.0 - x), basis.sum(axis=1)])  # w and w' at 1 of w = w' = 0 at 0
    masses = basis @ beyond
    # by displacement of node 1, rotation of node 1, and rotation of node 0
    one, turn, root = (masses @ np.linalg.solve(ends, end) for end in ((1.0, 0.0), (0.0, 1.0), (-1.0, -1.0)))
    return [(length * (whole - one), length**2 * (first + root)), (length * one, length**2 * turn)]


def strains(x: Array, R: Array, length: Array | float) -> Array:
    """Strains Gamma and K of the elements between nodes, as of `rod_strains.measure_element` without those of rest.

    Parameters
    ----------
    x, R : (..., n + 1, 3) float, m, and (..., n + 1, 3, 3) float, positions and axes (columns) of the nodes
    length : (n,) float, m, of the elements, or one of all

    Returns
    -------
    (..., n, 6) float; Gamma without unit, (1, 0, 0) without stress, K in 1/m
    """
    A, B, lengths = R[..., :-1, :, :], R[..., 1:, :, :], np.asarray(length)[..., None]
    T = product(np.swapaxes(A, -1, -2), B)
    s = 0.5 * np.stack([T[..., 2, 1] - T[..., 1, 2], T[..., 0, 2] - T[..., 2, 0], T[..., 1, 0] - T[..., 0, 1]], axis=-1)
    c = 0.5 * (np.trace(T, axis1=-2, axis2=-1) - 1.0)
    v = 0.5 / lengths * np.einsum("...ji,...j->...i", A + B, np.diff(x, axis=-2))
    square = np.einsum("...i,...i->...", s, s)
    angle, near = np.arctan2(np.sqrt(square), c), square < 1e-6
    safe = np.where(near, 1.0, square)
    phi = np.where(near & (c > 0.0), 1.0 + (1.0 - c) / 3.0 * (1.0 + 0.4 * (1.0 - c)), angle / np.sqrt(safe))
    psi = np.where(near & (c > 0.0), -1.0 / 6.0 - 7.0 / 60.0 * (1.0 - c), (1.0 - phi) / safe)
    along = np.einsum("...i,...i->...", s, v)
    gamma = phi[..., None] * v + (psi * along)[..., None] * s
    return np.concatenate([gamma, phi[..., None] * s / lengths], axis=-1)


def rotation(vector: Array) -> Array:
    """Rotation matrix of a rotation vector (3,), rad."""
    found: Array = scipy.spatial.transform.Rotation.from_rotvec(np.array(vector, dtype=float)).as_matrix()
    return found


def advanced(curvature: Array, length: float) -> tuple[Array, Array]:
    """Position (3,) and axes (3, 3) at the end of a curve of constant curvature (3,), 1/m, in the axes of its start."""
    turn = np.asarray(curvature, dtype=float) * length
    angle, K = norm(turn), skew(turn)
    b = 0.5 if angle < 1e-4 else (1.0 - math.cos(angle)) / angle**2
    c = 1.0 / 6.0 if angle < 1e-4 else (angle - math.sin(angle)) / angle**3
    return length * (np.eye(3) + b * K + c * product(K, K))[:, 0], rotation(turn)


def skew(a: Array) -> Array:
    """[a]x."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def quaternion(R: Array) -> Array:
    """Quaternions (..., 4), scalar part first and not below zero, of rotation matrices (..., 3, 3)."""
    found: Array = scipy.spatial.transform.Rotation.from_matrix(np.array(R)).as_quat(canonical=True, scalar_first=True)
    return found
