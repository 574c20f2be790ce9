"""What several systems do alike: times of samples, refusing laws, attitudes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from evolvent.errors import InputError

#: Largest number of values of the state that a run may keep.
MOST_VALUES = 200_000_000


def sample_times(every: float, end: float, *, values: int) -> np.ndarray:
    """Multiples of `every` from 0, and `end`, s.

    Parameters
    ----------
    every, end : float, s
    values : int, that are kept of each sample

    Raises
    ------
    InputError
        If a run would keep more than `MOST_VALUES`.
    """
    count = end / every
    if count * values > MOST_VALUES:
        raise InputError(f"output.every is {every:g} s; that makes {count:.3g} samples over {end:g} s, too many")
    samples = every * np.arange(int(count + 1e-9) + 1)
    if samples.size == 1 or end - samples[-1] > 1e-6 * every:
        return np.append(samples, end)
    samples[-1] = end
    return samples


def refuse_laws(laws: Mapping[str, Any] | None, system: str) -> None:
    """Refuse laws of the user's, of which a system places none.

    Raises
    ------
    InputError
        If there is one.
    """
    if laws:
        raise InputError(f"laws are given ({', '.join(laws)}), but {system} places no law of the user's")


def rotation_matrices(q: np.ndarray) -> np.ndarray:
    """Rotation matrices (..., 3, 3), body to inertial, of quaternions (..., 4), scalar part first, of any length."""
    q = np.asarray(q, dtype=float)
    w, x, y, z = np.moveaxis(q * (2.0 / np.einsum("...i,...i->...", q, q)[..., None]) ** 0.5, -1, 0)
    rows = [
        [1 - (y * y + z * z), x * y - w * z, x * z + w * y],
        [x * y + w * z, 1 - (x * x + z * z), y * z - w * x],
        [x * z - w * y, y * z + w * x, 1 - (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def quaternions(rotation: np.ndarray) -> np.ndarray:
    """Quaternions (..., 4), scalar part first and not below zero, of rotation matrices (..., 3, 3)."""
    from scipy.spatial.transform import Rotation

    q = Rotation.from_matrix(rotation).as_quat()[..., [3, 0, 1, 2]]
    return np.asarray(q * np.where(q[..., :1] < 0.0, -1.0, 1.0))


def tilt_of(q: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """What is left of attitudes q (nt, 4) once the turn by `angle` about z is taken out: (angle about z)^-1 q."""
    c, s = np.cos(0.5 * angle), -np.sin(0.5 * angle)
    left = [c * q[:, 0] - s * q[:, 3], c * q[:, 1] - s * q[:, 2], c * q[:, 2] + s * q[:, 1], c * q[:, 3] + s * q[:, 0]]
    turned = np.stack(left, axis=1)
    return np.where(turned[:, :1] < 0.0, -turned, turned)
