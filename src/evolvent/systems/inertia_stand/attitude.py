"""Quaternions, scalar part first, and rotation matrices."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation


def quaternion(rotation: np.ndarray) -> np.ndarray:
    """Quaternion (..., 4), scalar part first and positive, of rotation matrices (..., 3, 3)."""
    q = Rotation.from_matrix(rotation).as_quat()[..., [3, 0, 1, 2]]
    return np.asarray(q * np.where(q[..., :1] < 0.0, -1.0, 1.0))


def matrices(q: np.ndarray) -> np.ndarray:
    """Rotation matrices (..., 3, 3) of quaternions (..., 4), scalar part first, of any length."""
    return np.asarray(Rotation.from_quat(q[..., [1, 2, 3, 0]]).as_matrix())
