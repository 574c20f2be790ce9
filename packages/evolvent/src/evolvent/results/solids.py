"""Solids that draw a body: boxes and surfaces of revolution, and the meshes that viewers and files show of them."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

Array = np.ndarray
Triple = Sequence[float] | np.ndarray

#: Sectors of a surface of revolution.
SECTORS = 48
#: Most cells along an edge of a box or a piece of a profile.
_CELLS = 6


class Mesh(NamedTuple):
    """Faces of a solid.

    Attributes
    ----------
    vertices : (m, 3) float, m, axes and centre of the solid
    faces : (f, 4) int, counter-clockwise seen from outside; two vertices of a triangle coincide
    dark : (f,) bool, faces that are drawn darker, so that a turn about the axis is seen
    """

    vertices: Array
    faces: Array
    dark: Array


@dataclasses.dataclass(frozen=True, kw_only=True)
class Solid:
    """A box or a surface of revolution that is fixed in a frame, or turns about its axis there.

    Made by `box`, `revolution`, `cylinder` and `sphere`.

    Attributes
    ----------
    edges : (3,) float, m, of a box along the axes of the frame; None for a surface of revolution
    profile : sequence of (x, radius), m, with x increasing along the axis; discs close both ends
    centre : (3,) float, m, of a box, or where x is zero; axes of the frame
    axis : (3,) float, of a surface of revolution, axes of the frame
    turned : (nt,) float, rad, turn of a surface of revolution about its axis; None where it is fixed
    scale : (nt,) float, size relative to the stated one, 0 hides it; None where it is constant
    """

    edges: tuple[float, float, float] | None = None
    profile: tuple[tuple[float, float], ...] = ()
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    turned: Array | None = None
    scale: Array | None = None

    def __post_init__(self) -> None:
        if (self.edges is None) == (not self.profile):
            raise ValueError("a solid has either edges or a profile")
        if self.profile and (len(self.profile) < 2 or not np.linalg.norm(self.axis) > 0.0):
            raise ValueError("a surface of revolution takes two points of its profile or more, and an axis")

    @classmethod
    def box(cls, edges: Triple, *, centre: Triple = (0.0, 0.0, 0.0)) -> Solid:
        """A box with edges (3,) along the axes of the frame, m."""
        return cls(edges=_triple(edges), centre=_triple(centre))

    @classmethod
    def revolution(
        cls,
        profile: Sequence[tuple[float, float]],
        *,
        centre: Triple = (0.0, 0.0, 0.0),
        axis: Triple = (0.0, 0.0, 1.0),
        turned: Array | None = None,
    ) -> Solid:
        """A surface of revolution with a profile of (x, radius), m, x along the axis from `centre`."""
        points = tuple((float(x), float(r)) for x, r in profile)
        return cls(profile=points, centre=_triple(centre), axis=_triple(axis), turned=turned)

    @classmethod
    def cylinder(
        cls,
        radius: float,
        length: float,
        *,
        centre: Triple = (0.0, 0.0, 0.0),
        axis: Triple = (0.0, 0.0, 1.0),
        turned: Array | None = None,
    ) -> Solid:
        """A cylinder about `centre`, m."""
        ends = [(-0.5 * length, radius), (0.5 * length, radius)]
        return cls.revolution(ends, centre=centre, axis=axis, turned=turned)

    @classmethod
    def sphere(cls, radius: float, *, centre: Triple = (0.0, 0.0, 0.0)) -> Solid:
        """A sphere, m."""
        around = np.linspace(0.0, np.pi, 17)
        profile = [(-radius * float(np.cos(a)), radius * float(np.sin(a))) for a in around]
        return cls.revolution(profile, centre=centre)

    def enlarged(self, factor: float) -> Solid:
        """The solid with all lengths, that of its centre too, times a factor."""
        edges = None if self.edges is None else _triple(factor * np.array(self.edges))
        profile = tuple((factor * x, factor * r) for x, r in self.profile)
        return dataclasses.replace(self, edges=edges, profile=profile, centre=_triple(factor * np.array(self.centre)))

    @property
    def size(self) -> float:
        """Radius about `centre` that holds the whole solid, m."""
        if self.edges is not None:
            return 0.5 * float(np.linalg.norm(self.edges))
        return float(np.hypot(*np.array(self.profile).T).max())

    @property
    def basis(self) -> Array:
        """Rotation matrix (3, 3) from the axes of the solid to those of the frame."""
        if self.edges is not None:
            return np.eye(3)
        x = np.array(self.axis) / np.linalg.norm(self.axis)
        y = np.cross(x, np.eye(3)[int(np.argmin(np.abs(x)))])
        y /= np.linalg.norm(y)
        return np.stack([x, y, np.cross(x, y)], axis=1)

    def mesh(self, *, sectors: int = SECTORS, cells: int = _CELLS) -> Mesh:
        """Faces in the axes of the solid, in cells small enough to be drawn in the order of their distance.

        Parameters
        ----------
        sectors : int, of a surface of revolution
        cells : int, most cells along an edge of a box or a piece of a profile; 1 where the order does not matter
        """
        if self.edges is not None:
            return _box(self.edges, cells)
        return _revolution(self.profile, sectors, cells)

    def placed(self, vertices: Array, k: int) -> Array:
        """Vertices (m, 3) of a mesh at sample k, in the axes of the frame, m."""
        if self.turned is not None:
            c, s = np.cos(self.turned[k]), np.sin(self.turned[k])
            vertices = vertices @ np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])
        if self.scale is not None:
            vertices = vertices * self.scale[k]
        return np.asarray(vertices @ self.basis.T + self.centre)


def _triple(values: Triple) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in values)
    return x, y, z


def _box(edges: tuple[float, float, float], most: int) -> Mesh:
    """Six sides, each in cells that are about square, at most `most` along an edge."""
    counts = [int(np.clip(round(most * e / max(edges)), 1, most)) for e in edges]
    vertices: list[Array] = []
    faces: list[Array] = []
    for axis in range(3):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        u, v = np.meshgrid(*(np.linspace(-0.5, 0.5, counts[c] + 1) for c in (i, j)), indexing="ij")
        grid = np.arange(u.size).reshape(u.shape)
        cells = np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], axis=-1).reshape(-1, 4)
        for side in (-0.5, 0.5):
            corner = np.empty((u.size, 3))
            corner[:, axis], corner[:, i], corner[:, j] = side * edges[axis], u.ravel() * edges[i], v.ravel() * edges[j]
            faces.append((cells if side > 0.0 else cells[:, ::-1]) + sum(len(x) for x in vertices))
            vertices.append(corner)
    found = np.concatenate(faces)
    return Mesh(np.concatenate(vertices), found, np.zeros(len(found), dtype=bool))


def _revolution(profile: Sequence[tuple[float, float]], sectors: int, most: int) -> Mesh:
    """Rings along the profile and over the discs at its ends, each in sectors."""
    (first, r0), (last, r1) = profile[0], profile[-1]
    around = 2.0 * np.pi / sectors * max(r for _, r in profile)
    path = [(first, 0.0), *([(first, 0.5 * r0)] if r0 > 0.0 else [])]
    for (x0, a), (x1, b) in itertools.pairwise(profile):
        pieces = int(np.clip(np.hypot(x1 - x0, b - a) / around, 1, most))
        path += [(x0 + k / pieces * (x1 - x0), a + k / pieces * (b - a)) for k in range(pieces)]
    path += [(last, r1), *([(last, 0.5 * r1), (last, 0.0)] if r1 > 0.0 else [])]
    # a profile that starts on the axis has that point twice
    rings = np.array([p for k, p in enumerate(path) if k == 0 or p != path[k - 1]])
    angle = 2.0 * np.pi * np.arange(sectors) / sectors
    vertices = np.empty((len(rings), sectors, 3))
    vertices[..., 0] = rings[:, :1]
    vertices[..., 1], vertices[..., 2] = rings[:, 1:] * np.cos(angle), rings[:, 1:] * np.sin(angle)
    index = np.arange(vertices[..., 0].size).reshape(len(rings), sectors)
    ahead = np.roll(index, -1, axis=1)
    faces = np.stack([index[:-1], index[1:], ahead[1:], ahead[:-1]], axis=-1).reshape(-1, 4)[:, ::-1]
    dark = np.tile(np.arange(sectors) * 4 // sectors % 2 == 1, len(rings) - 1)
    return Mesh(vertices.reshape(-1, 3), faces, dark)
