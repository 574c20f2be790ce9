"""Statics of a body on springs: energy, forces and stiffness at a pose, and the pose at rest."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy

from evolvent_base.errors import InputError
from evolvent_massprops.inertia.stand import Body, Setup, Stand, array, setup

Y, Z = np.eye(3)[1:]
ONE = np.eye(3)
LEVEL = ONE - np.outer(Y, Y)  # onto the horizontal plane
SIDEWAYS = np.array([1.0, 0.0, 1.0])
NEXT, LAST = np.array([1, 2, 0]), np.array([2, 0, 1])
#: Rotation vectors up to which their matrices are formed one by one, which takes less than SciPy's call.
FEW = 8


@dataclasses.dataclass(frozen=True)
class Pose:
    """Where a body is.

    Attributes
    ----------
    position : (..., 3) float, m
        Of the centre of mass in the frame of the level, unloaded stand (there it is at `body.centre`).
    origin : (..., 3) float, m
        Of the stiffness centre of the attachment plane, from where it is on the level, unloaded stand.
    rotation : (..., 3, 3) float, body to level frame
    reaction : (..., 3) float, N and N m
        Of the guides: force along x, force along z, and multiplier of (R e_x) . Z; zero where the body is free.
    """

    position: np.ndarray
    origin: np.ndarray
    rotation: np.ndarray
    reaction: np.ndarray

    @property
    def tilt(self) -> np.ndarray:
        """(...) float, rad, angle between the body's y axis and the vertical."""
        return np.arctan2(np.hypot(self.rotation[..., 0, 1], self.rotation[..., 2, 1]), self.rotation[..., 1, 1])


def skew(r: np.ndarray) -> np.ndarray:
    """(..., 3, 3) matrix S with S v = r x v."""
    S = np.zeros((*r.shape, 3))
    S[..., 0, 1], S[..., 0, 2] = -r[..., 2], r[..., 1]
    S[..., 1, 0], S[..., 1, 2] = r[..., 2], -r[..., 0]
    S[..., 2, 0], S[..., 2, 1] = -r[..., 1], r[..., 0]
    return S


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Vector product over the last axis; several times as fast as NumPy's on few rows."""
    found: np.ndarray = a.take(NEXT, -1) * b.take(LAST, -1) - a.take(LAST, -1) * b.take(NEXT, -1)
    return found


def rotation_matrix(theta: np.ndarray) -> np.ndarray:
    """(..., 3, 3) rotation by the vector `theta` (..., 3), rad."""
    rows = np.array(theta, dtype=float).reshape(-1, 3)
    if len(rows) <= FEW:
        return np.array([_rotation(*row) for row in rows.tolist()]).reshape(*np.shape(theta), 3)
    matrices: np.ndarray = scipy.spatial.transform.Rotation.from_rotvec(rows).as_matrix()
    return matrices.reshape(*np.shape(theta), 3)


def _rotation(x: float, y: float, z: float) -> tuple[tuple[float, float, float], ...]:
    """Rotation matrix of one rotation vector by its quaternion, with the operations of SciPy in their order."""
    square = x * x + y * y + z * z
    angle = math.sqrt(square)
    small = angle <= 1e-3
    scale = 0.5 - square / 48.0 + square * square / 3840.0 if small else math.sin(angle / 2.0) / angle
    x, y, z, w = scale * x, scale * y, scale * z, math.cos(angle / 2.0)
    xx, yy, zz, ww = x * x, y * y, z * z, w * w
    return (
        (xx - yy - zz + ww, 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)),
        (2.0 * (x * y + z * w), -xx + yy - zz + ww, 2.0 * (y * z - x * w)),
        (2.0 * (x * z - y * w), 2.0 * (y * z + x * w), -xx - yy + zz + ww),
    )


def turning(f: np.ndarray, r: np.ndarray) -> np.ndarray:
    """(..., 3, 3) symmetric matrix H with theta.H theta / 2 = f . (theta x (theta x r)) / 2."""
    outer = f[..., :, None] * r[..., None, :]
    return 0.5 * (outer + np.swapaxes(outer, -1, -2)) - np.einsum("...i,...i", f, r)[..., None, None] * ONE


def spring_state(s: Setup, position: np.ndarray, rotation: np.ndarray) -> tuple[np.ndarray, ...]:
    """Lever arms r (..., n, 3), directions e (..., n, 3), lengths l (..., n), forces on the body f (..., n, 3)."""
    r = (s.points - s.centre[..., None, :]) @ np.swapaxes(rotation, -1, -2)
    d = position[..., None, :] + r - s.ground
    length = np.sqrt(np.sum(d * d, axis=-1))
    e = d / length[..., None]
    w = (d - s.points + s.ground) * SIDEWAYS
    f = -(s.stiffness * (length - s.length))[..., None] * e - s.lateral_stiffness[..., None] * w
    return r, e, length, f


def jacobian(r: np.ndarray) -> np.ndarray:
    """(..., 3, 6) displacement of points at lever arms r from the centre of mass, of (translation, rotation)."""
    J = np.zeros((*r.shape, 6))
    J[..., :3], J[..., 3:] = ONE, -skew(r)
    return J


def energy(stand: Stand, body: Body, position: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Potential energy of springs and gravity, J.

    Parameters
    ----------
    stand, body : Stand, Body
    position : (..., 3) float, m, of the centre of mass, level frame
    rotation : (..., 3, 3) float, body to level frame
    """
    s = setup(stand, body)
    r = (s.points - s.centre[..., None, :]) @ np.swapaxes(rotation, -1, -2)
    d = position[..., None, :] + r - s.ground
    w = (d - s.points + s.ground) * (1.0, 0.0, 1.0)
    stretch = np.linalg.norm(d, axis=-1) - s.length
    springs = 0.5 * s.stiffness * stretch**2 + 0.5 * s.lateral_stiffness * np.sum(w * w, axis=-1)
    return np.sum(springs, axis=-1) + s.mass * s.gravity * position[..., 1]


def wrench(stand: Stand, body: Body, position: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Force and moment about the centre of mass, of springs and gravity on a resting body.

    Returns
    -------
    (..., 6) float, N and N m, level axes
    """
    return -gradient(setup(stand, body), position, rotation)[0]


def gradient(s: Setup, position: np.ndarray, rotation: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Gradient (..., 6) and Hessian (..., 6, 6) of the potential energy in (translation, rotation vector)."""
    r, e, length, f = spring_state(s, position, rotation)
    g = -np.concatenate([f.sum(axis=-2), cross(r, f).sum(axis=-2)], axis=-1)
    g[..., 1] += s.mass * s.gravity
    tension = s.stiffness * (length - s.length) / length
    ee = e[..., :, None] * e[..., None, :]
    A = (s.stiffness - tension)[..., None, None] * ee + tension[..., None, None] * ONE
    A = A + s.lateral_stiffness[..., None, None] * LEVEL
    J = jacobian(r)
    H = (np.swapaxes(J, -1, -2) @ A @ J).sum(axis=-3)
    H[..., 3:, 3:] -= turning(f, r).sum(axis=-3)
    return g, H


def guides(s: Setup, rotation: np.ndarray) -> np.ndarray:
    """Jacobian (..., c, 6) of the guides: x and z of the centre of mass, yaw; no rows where the body is free."""
    e = rotation[..., :, 0]
    if not s.guided:
        return np.zeros((*e.shape[:-1], 0, 6))
    C = np.zeros((*e.shape[:-1], 3, 6))
    C[..., 0, 0] = C[..., 1, 2] = 1.0
    C[..., 2, 3:] = cross(e, Z)
    return C


def equilibrium(stand: Stand, body: Body, *, force: Any = (0.0, 0.0, 0.0), point: Any = (0.0, 0.0, 0.0)) -> Pose:
    """The pose in which a body rests, in full geometry.

    Parameters
    ----------
    stand, body : Stand, Body
    force : (3,) float, N, level axes
        A constant force on the body besides gravity.
    point : (3,) float, m
        Where it acts: body axes, from the stiffness centre of the attachment plane.

    Raises
    ------
    InputError
        Where no equilibrium is found.

    Notes
    -----
    Newton's method on the gradient of the potential energy in translation and rotation vector, with multipliers for
    the guides; from level, at the height where gravity and springs balance.
    """
    return equilibrium_pose(setup(stand, body), [(array("force", force, (3,)), array("point", point, (3,)))])


def equilibrium_pose(s: Setup, loads: Sequence[tuple[np.ndarray, np.ndarray]] = ()) -> Pose:
    """`equilibrium` of a Setup under forces (..., 3), each at its point (..., 3)."""
    batch, weight = s.batch, s.mass * s.gravity
    for force, point in loads:
        batch, weight = np.broadcast_shapes(batch, force.shape[:-1], point.shape[:-1]), weight - force[..., 1]
    position = np.broadcast_to(s.centre, (*batch, 3)).copy()
    position[..., 1] -= weight / s.stiffness.sum(axis=-1)
    rotation = np.broadcast_to(np.eye(3), (*batch, 3, 3))
    c = 3 if s.guided else 0
    reaction = np.zeros((*batch, c))
    size = np.max(np.linalg.norm(s.points - s.centre[..., None, :], axis=-1)) + np.max(s.length)
    scale = np.array([1.0] * 3 + [size] * 3)
    for _ in range(100):
        g, H = gradient(s, position, rotation)
        for force, point in loads:
            r = np.einsum("...ij,...j", rotation, point - s.centre)
            g = g - np.concatenate(np.broadcast_arrays(force, cross(r, force)), axis=-1)
            H[..., 3:, 3:] -= turning(np.broadcast_to(force, r.shape), r)
        A = np.zeros((*batch, 6 + c, 6 + c))
        b = np.zeros((*batch, 6 + c))
        if c:
            C, e = guides(s, rotation), rotation[..., :, 0]
            H[..., 3:, 3:] -= reaction[..., 2, None, None] * turning(np.broadcast_to(Z, e.shape), e)
            A[..., :6, 6:], A[..., 6:, :6] = -np.swapaxes(C, -1, -2), C
            b[..., 6:] = np.stack(
                [position[..., 0] - s.centre[..., 0], position[..., 2] - s.centre[..., 2], e[..., 2]], axis=-1
            )
            g = g - np.einsum("...ci,...c", C, reaction)
        A[..., :6, :6] = H
        b[..., :6] = g
        try:
            step = -np.linalg.solve(A, b[..., None])[..., 0]
        except np.linalg.LinAlgError:
            raise InputError(
                "the springs leave the body a motion without any stiffness; it has no unique equilibrium"
            ) from None
        longest = np.max(np.abs(step[..., :6] * scale), axis=-1)
        if not np.all(np.isfinite(longest)):
            break
        short = np.minimum(1.0, 0.2 * size / np.maximum(longest, 1e-300))[..., None]
        position = position + short * step[..., :3]
        rotation = rotation_matrix(short * step[..., 3:6]) @ rotation
        reaction = reaction + short * step[..., 6:]
        if np.all(longest < 1e-9 * size):
            origin = position - np.einsum("...ij,...j", rotation, s.centre)
            return Pose(position, origin, rotation, reaction if c else np.zeros((*batch, 3)))
    raise InputError(
        "no equilibrium was found near the level position; springs, mass and centre of mass do not belong together"
    )
