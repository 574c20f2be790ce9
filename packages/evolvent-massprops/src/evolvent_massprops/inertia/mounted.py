"""What moves on a stand besides the body: the body's attitude and position on it, tare, and air that moves along."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from evolvent_massprops.inertia.stand import CENTRE, MOMENTS, Mounting, Setup
from evolvent_massprops.inertia.statics import rotation_matrix, skew

_NAME = re.compile(
    rf"tare([1-9]\d*)_(mass|{'|'.join((*CENTRE, *MOMENTS))})|position_([xyz])|turn_([xyz])|air_(density)|"
    r"air_factor([1-9]\d*)"
)


def is_name(name: str) -> bool:
    """Whether a name is that of a number of a `Mounting`.

    Notes
    -----
    tare1_mass, tare1_ex, tare1_h, tare1_ez, tare1_Ixx, ... of the first tare; position_x, position_y, position_z;
    turn_x, turn_y, turn_z; air_density; air_factor1 of the first shape.
    """
    return _NAME.fullmatch(name) is not None


def value_of(m: Mounting, name: str) -> np.ndarray:
    """The number behind a name."""
    field, place, sign = _place(name)
    at: Any = (..., *place)
    return sign * np.asarray(getattr(m, field))[at]


def assign(m: Mounting, values: Mapping[str, np.ndarray], batch: tuple[int, ...]) -> Mounting:
    """`m` with named numbers replaced, each of the leading axes `batch`."""
    fresh: dict[str, Any] = {}
    trailing = {"tare_mass": 1, "tare_centre": 2, "tare_inertia": 3, "air_density": 0}
    for name, value in values.items():
        field, place, sign = _place(name)
        if field not in fresh:
            old = np.asarray(getattr(m, field))
            n = old.ndim - trailing.get(field, 1)
            fresh[field] = np.broadcast_to(old, (*np.broadcast_shapes(batch, old.shape[:n]), *old.shape[n:])).copy()
        at: Any = (..., *place)
        fresh[field][at] = sign * value
        if field == "tare_inertia":
            mirrored: Any = (..., place[0], *place[:0:-1])
            fresh[field][mirrored] = value
    return m._replace(**fresh)


def _place(name: str) -> tuple[str, tuple[int, ...], float]:
    """Field, index of the trailing axes, and sign of a named number."""
    match = _NAME.fullmatch(name)
    assert match is not None
    tare, what, position, turn, density, factor = match.groups()
    if tare is not None:
        k = int(tare) - 1
        if what in CENTRE:
            axis, sign = CENTRE[what]
            return "tare_centre", (k, axis), sign
        return ("tare_mass", (k,), 1.0) if what == "mass" else ("tare_inertia", (k, *MOMENTS[what]), 1.0)
    if density is not None:
        return "air_density", (), 1.0
    if factor is not None:
        return "air_factor", (int(factor) - 1,), 1.0
    return ("position", ("xyz".index(position),), 1.0) if position else ("turn", ("xyz".index(turn),), 1.0)


def whole(s: Setup) -> Setup:
    """All that moves on the stand as one body, in the stand's axes, without a mounting.

    Notes
    -----
    Masses add, and moments about the common centre of mass by the parallel-axis theorem. Air of the added mass A
    (3, 3) and the added moments J (3, 3) at a point r from that centre adds T^T diag(A, J) T to the matrix of inertia,
    T = [[1, -r x], [0, 1]]; it has no weight.
    """
    m = s.mounting
    if m is None:
        return s
    R = rotation_matrix(m.turn) @ m.rotation if np.any(m.turn) else np.asarray(m.rotation)
    mass, centre, inertia = np.asarray(m.tare_mass), np.asarray(m.tare_centre), np.asarray(m.tare_inertia)
    if m.occupied:
        own = np.asarray(m.position) + np.einsum("...ij,...j", R, s.centre)
        mass = _joined(mass, np.asarray(s.mass)[..., None], 1)
        centre = _joined(centre, own[..., None, :], 2)
        inertia = _joined(inertia, (R @ s.inertia @ np.swapaxes(R, -1, -2))[..., None, :, :], 3)
    total = mass.sum(axis=-1)
    middle = np.sum(mass[..., None] * centre, axis=-2) / total[..., None]
    d = centre - middle[..., None, :]
    square = np.einsum("...i,...i", d, d)[..., None, None] * np.eye(3) - d[..., :, None] * d[..., None, :]
    tensor = np.sum(inertia + mass[..., None, None] * square, axis=-3)
    added = None
    for k, on_body in enumerate(m.air_on_body):
        if on_body and not m.occupied:
            continue
        T = R if on_body else np.eye(3)
        r = np.einsum("...ij,...j", T, m.air_centre[k])
        r = (np.asarray(m.position) + r if on_body else r) - middle
        size = (np.asarray(m.air_density) * np.asarray(m.air_factor)[..., k])[..., None, None]
        one = size * _inertia_of_air(T @ m.air_mass[k] @ np.swapaxes(T, -1, -2),
                                     T @ m.air_inertia[k] @ np.swapaxes(T, -1, -2), r)  # fmt: skip
        added = one if added is None else added + one
    return s._replace(mass=total, centre=middle, inertia=tensor, added=added, mounting=None)


def turned(M: np.ndarray, R: np.ndarray) -> np.ndarray:
    """(..., 6, 6) matrix of inertia M in other axes, R (..., 3, 3) from its own to them."""
    B = np.zeros((*R.shape[:-2], 6, 6))
    B[..., :3, :3] = B[..., 3:, 3:] = R
    found: np.ndarray = B @ M @ np.swapaxes(B, -1, -2)
    return found


def _joined(one: np.ndarray, other: np.ndarray, trailing: int) -> np.ndarray:
    """Both along the first of the trailing axes, leading axes broadcast."""
    batch = np.broadcast_shapes(one.shape[: one.ndim - trailing], other.shape[: other.ndim - trailing])
    parts = [np.broadcast_to(x, (*batch, *x.shape[x.ndim - trailing :])) for x in (one, other)]
    return np.concatenate(parts, axis=-trailing)


def _inertia_of_air(A: np.ndarray, J: np.ndarray, r: np.ndarray) -> np.ndarray:
    """(..., 6, 6) matrix of inertia of added mass and moments at a point r from the centre of mass."""
    batch = np.broadcast_shapes(A.shape[:-2], r.shape[:-1])
    M, S = np.zeros((*batch, 6, 6)), skew(r)
    M[..., :3, :3], M[..., :3, 3:], M[..., 3:, :3] = A, -A @ S, S @ A
    M[..., 3:, 3:] = J - S @ A @ S
    return M
