"""Rotations over time as quaternions (scalar part first), rotation vectors and matrices, with one row a sample."""

from __future__ import annotations

import numpy as np

Array = np.ndarray


def turned(q: Array, x: Array) -> Array:
    """Vectors x (nt, n, 3) turned by the attitudes q (nt, 4): from body to inertial axes."""
    w, v = q[:, None, :1], np.broadcast_to(q[:, None, 1:], x.shape)
    across = 2.0 * np.cross(v, x)
    found: Array = x + w * across + np.cross(v, across)
    return found


def product(p: Array, q: Array) -> Array:
    """Quaternions p q (nt, 4), scalar first: q first, then p."""
    found = np.empty(np.broadcast_shapes(p.shape, q.shape))
    found[:, 0] = p[:, 0] * q[:, 0] - np.sum(p[:, 1:] * q[:, 1:], axis=1)
    found[:, 1:] = p[:, :1] * q[:, 1:] + q[:, :1] * p[:, 1:] + np.cross(p[:, 1:], q[:, 1:])
    return found


def conjugate(q: Array) -> Array:
    """Quaternions (nt, 4) of the opposite rotations."""
    return q * np.array([1.0, -1.0, -1.0, -1.0])


def rotation_vectors(q: Array) -> Array:
    """Rotation vectors (nt, 3), rad, no longer than pi, of unit quaternions (nt, 4)."""
    q = np.where(q[:, :1] < 0.0, -q, q)
    sine = np.linalg.norm(q[:, 1:], axis=1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, q[:, :1])
    return np.asarray(q[:, 1:] * np.where(sine > 1e-12, angle / np.where(sine > 1e-12, sine, 1.0), 2.0))


def from_rotation_vectors(v: Array) -> Array:
    """Unit quaternions (nt, 4) of rotation vectors (nt, 3), rad."""
    half = 0.5 * np.linalg.norm(v, axis=1, keepdims=True)
    return np.concatenate([np.cos(half), 0.5 * v * np.sinc(half / np.pi)], axis=1)


def turns_between(q: Array, kept: Array) -> Array:
    """Rotation vectors (nk, 3), rad, from each kept sample to the next, in the axes of the first of both.

    Notes
    -----
    They may be longer than pi: whole turns are counted by adding up the rotations of all samples between. The last is
    zero.
    """
    steps = rotation_vectors(product(conjugate(q[:-1]), q[1:]))
    path = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    long = np.diff(path[kept], axis=0)
    short = rotation_vectors(product(conjugate(q[kept[:-1]]), q[kept[1:]]))
    angle = np.linalg.norm(short, axis=1, keepdims=True)
    axis = np.where(angle > 1e-9, short / np.where(angle > 1e-9, angle, 1.0), long)
    axis = axis / np.maximum(np.linalg.norm(axis, axis=1, keepdims=True), 1e-300)
    whole = np.round((np.sum(long * axis, axis=1, keepdims=True) - angle) / (2.0 * np.pi))
    return np.concatenate([axis * (angle + 2.0 * np.pi * whole), np.zeros((1, 3))])


def about_z(angle: Array) -> Array:
    """Quaternions (nt, 4) of turns by `angle`, rad, about z."""
    zero = np.zeros_like(angle)
    return np.stack([np.cos(0.5 * angle), zero, zero, np.sin(0.5 * angle)], axis=1)


def rotation_matrices(q: Array) -> Array:
    """Rotation matrices (..., 3, 3), body to inertial, of quaternions (..., 4), scalar part first, of any length."""
    q = np.asarray(q, dtype=float)
    w, x, y, z = np.moveaxis(q * (2.0 / np.einsum("...i,...i->...", q, q)[..., None]) ** 0.5, -1, 0)
    rows = [
        [1 - (y * y + z * z), x * y - w * z, x * z + w * y],
        [x * y + w * z, 1 - (x * x + z * z), y * z - w * x],
        [x * z - w * y, y * z + w * x, 1 - (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def quaternions(rotation: Array) -> Array:
    """Quaternions (..., 4), scalar part first and not below zero, of rotation matrices (..., 3, 3).

    Notes
    -----
    The matrix K = 4 q q^T has entries that are linear in those of R; its row with the largest diagonal entry is taken.
    """
    R = np.asarray(rotation, dtype=float)
    (a, b, c), (d, e, f), (g, h, i) = np.moveaxis(R, (-2, -1), (0, 1))
    rows = [
        [1 + a + e + i, h - f, c - g, d - b],
        [h - f, 1 + a - e - i, b + d, c + g],
        [c - g, b + d, 1 - a + e - i, f + h],
        [d - b, c + g, f + h, 1 - a - e + i],
    ]
    K = np.moveaxis(np.array(rows), (0, 1), (-2, -1))
    largest = np.argmax(np.diagonal(K, axis1=-2, axis2=-1), axis=-1)
    q = np.take_along_axis(K, largest[..., None, None], axis=-2)[..., 0, :]
    q = q / np.sqrt(np.einsum("...i,...i->...", q, q))[..., None]
    return np.asarray(q * np.where(q[..., :1] < 0.0, -1.0, 1.0))
