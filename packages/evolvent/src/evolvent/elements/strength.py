"""Strength of walls of plies: stresses at faces of plies by the strains of the wall, and how near they are to failure.

Plies are in plane stress, strains linear through the thickness. The criterion is that of Tsai and Hill with strengths
by the signs of the stresses, (s1/X)^2 - s1 s2/X^2 + (s2/Y)^2 + (s12/S)^2 = 1; with X = Y and S = X/sqrt(3) it is that
of von Mises. Its square root grows with the loads: 1 over it is the factor by which all stresses may grow.

Literature: Jones 1999, Mechanics of Composite Materials (2.9.3 Tsai-Hill).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from evolvent.elements.laminates import Ply, plane_stiffness, turned_strains
from evolvent.elements.materials import Material

Array = np.ndarray


def faces(plies: Sequence[Ply]) -> Array:
    """Distances (n, 2) of the bottom and top of each ply from the middle of the wall, along the normal, m."""
    tops = np.cumsum([ply.thickness for ply in plies])
    tops = tops - 0.5 * tops[-1]
    return np.stack([tops - [ply.thickness for ply in plies], tops], axis=1)


def ply_stresses(plies: Sequence[Ply], strains: Array, free: Array | None = None) -> Array:
    """Stresses (.., n, 2, 3), Pa, at bottom and top of each ply along and across its fibres, and of shear.

    Parameters
    ----------
    strains : (.., 6) float, membrane strains 11, 22 and twice 12, and changes of curvature alike, 1/m
    free : (.., n, 6) float, those of each ply without stress: of its thermal expansion, and of its relaxation
    """
    by_strains = np.stack([plane_stiffness(ply.material) @ turned_strains(ply.angle) for ply in plies])
    held = strains[..., None, :] if free is None else strains[..., None, :] - free
    at = held[..., None, :3] + faces(plies)[..., None] * held[..., None, 3:]
    return np.einsum("nij,...nfj->...nfi", by_strains, at)


def failure_index(material: Material, stress: Array) -> Array:
    """Square root (..) of the criterion of Tsai and Hill, 1 at failure, for stresses (.., 3) in a ply's axes, Pa."""
    assert material.tensile_strength is not None
    tension = material.tensile_strength
    compression = material.compressive_strength or tension
    across = material.tensile_strength_2 or tension
    pressed = material.compressive_strength_2 or material.tensile_strength_2 or compression
    shear = material.shear_strength or tension / math.sqrt(3.0)
    one, two, both = np.moveaxis(stress, -1, 0)
    X, Y = np.where(one < 0.0, compression, tension), np.where(two < 0.0, pressed, across)
    squares = (one / X) ** 2 - one * two / X**2 + (two / Y) ** 2 + (both / shear) ** 2
    return np.asarray(np.sqrt(np.maximum(squares, 0.0)))
