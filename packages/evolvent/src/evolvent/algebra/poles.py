"""Poles of linear motions: what makes modes complex, and what of poles is round-off."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

Array = np.ndarray

#: Asymmetry, beside the largest entries of rows, that is taken as round-off.
SYMMETRIC = 1e-12
#: What round-off adds to eigenvalues of the shifted inverse, beside its size.
SPLIT = 1e-13
#: Distance of poles, beside their size, up to which they may be equal; error of their mean beside that of one of them.
ALIKE, TOGETHER = 1e-5, 10.0
#: What makes modes complex: the skew-symmetric part of C, its symmetric part, and the skew-symmetric part of K.
GYROSCOPIC, DAMPING, WITHOUT_POTENTIAL = "gyroscopic forces", "damping", "forces without a potential"


def causes_of(C: Any, reciprocal: bool) -> tuple[str, ...]:
    """What makes modes complex: the matrix C of velocities, and a stiffness that is not `reciprocal`, so symmetric."""
    size = SYMMETRIC * abs(C).max() if C.nnz else 0.0
    found = {
        GYROSCOPIC: bool(C.nnz) and abs(C - C.T).max() > size,
        DAMPING: bool(C.nnz) and abs(C + C.T).max() > size,
        WITHOUT_POTENTIAL: not reciprocal,
    }
    return tuple(cause for cause, acts in found.items() if acts)


def is_round_off(pole: Array, change: Array) -> Array:
    """Whether the real parts of poles (k,) are round-off; `change` is what one of its size in the inverse changes.

    Equal poles move apart by the root of round-off, in opposite directions: their mean is as exact as a single pole.
    """
    apart = math.sqrt(SPLIT) * change
    found: Array = np.abs(pole.real) <= SPLIT * change
    for k in np.flatnonzero(~found & (np.abs(pole.real) <= apart)):
        near = np.abs(pole - pole[k]) <= min(float(apart[k]), ALIKE * abs(pole[k]))
        found[k] = abs(np.mean(pole.real[near])) <= TOGETHER * SPLIT * change[k]
    return found
