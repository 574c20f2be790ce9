"""Measured modes beside those of a model: which is which, and the energy of each."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy

from evolvent_massprops.identification import IdentifiedModes
from evolvent_massprops.inertia.problem import mac
from evolvent_massprops.inertia.stand import Stand
from evolvent_massprops.inertia.vibration import NormalModes, spring_energies


def partners(
    frequency: np.ndarray,
    shapes: np.ndarray,
    modes: NormalModes,
    points: Any,
    directions: Any = (0.0, 1.0, 0.0),
    *,
    within: float = 0.05,
) -> dict[int, int]:
    """Number of the model's mode that each measured one is; those that are none of its modes are left out.

    Parameters
    ----------
    frequency : (m,) float, rad/s, measured, damped
    shapes : (m, s) float, amplitudes of each measured mode at the sensors, to any scale
    modes : NormalModes, of the model
    points, directions : (s, 3) float, m and level axes, of the sensors
    within : float, largest relative difference of the frequencies of a pair

    Notes
    -----
    The assignment of least sum of ``|log(frequency ratio)| + 1 - MAC``. A mode of the model that moves no sensor has no
    partner.
    """
    own = modes.at(points, directions)
    agreement = np.nan_to_num(mac(shapes[:, None], own[None]))
    apart = np.abs(np.log(frequency[:, None] / modes.frequency))
    moved = np.abs(own).max(axis=1)
    apart[:, moved < 1e-12 * moved.max()] = np.inf
    cost = np.where(apart < within, apart + 1.0 - agreement, 3.0)  # any true pair costs less than none
    row, column = scipy.optimize.linear_sum_assignment(cost)
    return {int(i): int(j) for i, j in zip(row, column, strict=True) if apart[i, j] < within}


def mode_energies(
    stand: Stand, modes: NormalModes, found: IdentifiedModes, pairs: Mapping[int, int], points: Any, directions: Any
) -> tuple[np.ndarray, np.ndarray]:
    """Energy of each identified mode, J, from its amplitudes, and its standard deviation; NaN for one without partner.

    Parameters
    ----------
    stand, modes : Stand, NormalModes, of the model
    found : evolvent_massprops.identification.IdentifiedModes, of displacements, m
    pairs : mapping, as of `partners`
    points, directions : (s, 3) float, m and level axes, of the sensors

    Notes
    -----
    With a vertical sensor at every spring E = sum k_i A_i^2 / 2, as in Belyakov (2002); else from the modal coordinate
    that fits the amplitudes best to the model's shape, omega^2 z^2 / 2.
    """
    A, s = found.amplitude, found.amplitude_std
    energy, std = np.full(found.order, np.nan), np.full(found.order, np.nan)
    if np.array_equal(points, stand.points) and not np.any(np.asarray(directions) - (0.0, 1.0, 0.0)):
        k, own = stand.stiffness, list(pairs)
        energy[own], std[own] = spring_energies(k, A[own]), np.sqrt(np.sum((k * A[own] * s[own]) ** 2, axis=1))
        return energy, std
    shapes, signed = modes.at(points, directions), found.mode_shapes().real
    for i, j in pairs.items():
        u, square = shapes[j], modes.natural_frequency[j] ** 2
        z, z_std = u @ signed[i] / (u @ u), np.sqrt(np.sum((u * s[i]) ** 2)) / (u @ u)
        energy[i], std[i] = 0.5 * square * z * z, square * abs(z) * z_std
    return energy, std
