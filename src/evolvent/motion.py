"""Where everything is at every sample of a run, as data: lines, forces and the axes of bodies, in true size."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

Array = np.ndarray


@dataclasses.dataclass(frozen=True, kw_only=True)
class Strand:
    """A line through points that move.

    Attributes
    ----------
    name : str
    points : (nt, n, 3) float, m, inertial axes
    values : mapping, name with its unit in brackets -> (nt, n) float, of each point; NaN for none
    """

    name: str
    points: Array
    values: Mapping[str, Array]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Forces:
    """Forces and the points at which they act.

    Attributes
    ----------
    name : str, what acts on what
    points : (nt, k, 3) float, m, inertial axes
    vectors : (nt, k, 3) float, N, inertial axes
    """

    name: str
    points: Array
    vectors: Array


@dataclasses.dataclass(frozen=True, kw_only=True)
class Frame:
    """The axes of a body and lines that draw it.

    Attributes
    ----------
    name : str
    origin : (nt, 3) float, m, inertial axes
    attitude : (nt, 4) float, quaternion from body to inertial axes, scalar first
    outline : sequence of (k, 3) float, m, body axes
    """

    name: str
    origin: Array
    attitude: Array
    outline: Sequence[Array] = ()


@dataclasses.dataclass(frozen=True, kw_only=True)
class Motion:
    """The motion of a system; the first frame is that of its main body.

    Attributes
    ----------
    time : (nt,) float, s
    strands : sequence of Strand
    forces : sequence of Forces
    frames : sequence of Frame, at least one
    """

    time: Array
    strands: Sequence[Strand]
    forces: Sequence[Forces]
    frames: Sequence[Frame]

    @property
    def reach(self) -> float:
        """Largest distance of any point from the origin of the first frame, m."""
        origin = self.frames[0].origin[:, None]
        return max((float(np.nanmax(np.linalg.norm(s.points - origin, axis=-1))) for s in self.strands), default=1.0)

    def at(self, samples: Array) -> Motion:
        """The motion at some samples alone."""
        return Motion(
            time=self.time[samples],
            strands=[
                dataclasses.replace(
                    s, points=s.points[samples], values={name: v[samples] for name, v in s.values.items()}
                )
                for s in self.strands
            ],
            forces=[dataclasses.replace(f, points=f.points[samples], vectors=f.vectors[samples]) for f in self.forces],
            frames=[
                dataclasses.replace(f, origin=f.origin[samples], attitude=f.attitude[samples]) for f in self.frames
            ],
        )

    def in_body(self) -> Motion:
        """The motion as the first body sees it: in its axes, from its origin."""
        body = self.frames[0]
        back = body.attitude * np.array([1.0, -1.0, -1.0, -1.0])

        def seen(points: Array) -> Array:
            return turned(back, points - body.origin[:, None])

        return Motion(
            time=self.time,
            strands=[dataclasses.replace(s, points=seen(s.points)) for s in self.strands],
            forces=[
                dataclasses.replace(f, points=seen(f.points), vectors=turned(back, f.vectors)) for f in self.forces
            ],
            frames=[
                dataclasses.replace(f, origin=seen(f.origin[:, None])[:, 0], attitude=product(back, f.attitude))
                for f in self.frames
            ],
        )


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


def about_z(angle: Array) -> Array:
    """Quaternions (nt, 4) of turns by `angle`, rad, about z."""
    zero = np.zeros_like(angle)
    return np.stack([np.cos(0.5 * angle), zero, zero, np.sin(0.5 * angle)], axis=1)


def tilt_of(q: Array, angle: Array) -> Array:
    """What is left of attitudes q (nt, 4) once the turn by `angle` about z is taken out: (angle about z)^-1 q."""
    left = product(about_z(-angle), q)
    return np.where(left[:, :1] < 0.0, -left, left)


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
    """Quaternions (..., 4), scalar part first and not below zero, of rotation matrices (..., 3, 3)."""
    from scipy.spatial.transform import Rotation

    q = Rotation.from_matrix(rotation).as_quat()[..., [3, 0, 1, 2]]
    return np.asarray(q * np.where(q[..., :1] < 0.0, -1.0, 1.0))
