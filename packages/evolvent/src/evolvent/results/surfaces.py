"""Surfaces of quadrilaterals between points that move, as pictures and files show them."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np

from evolvent.elements.shape_functions import axis_shape

Array = np.ndarray
#: Most quadrilaterals into which those of a coarse surface are divided in pictures.
MOST_FACES = 600


@dataclasses.dataclass(frozen=True, kw_only=True)
class Surface:
    """A surface of quadrilaterals between points that move.

    Attributes
    ----------
    name : str
    points : (nt, n, 3) float, m, inertial axes; NaN hides
    faces : (f, 4) int, points of each quadrilateral, counter-clockwise seen from where the normals point
    each : int, number of quadrilaterals, one after the other, that share a value
    normals : (nt, n, 3) float, unit vectors at the points, inertial axes
    thickness : float, m, half of it on either side of the points
    values : mapping, label with its unit in brackets -> (nt, f / each) float, for the colour
    data : mapping, the same, of what is written into files and not shown
    vectors : mapping, label with its unit in brackets -> (nt, n, 3) float, of each point, inertial axes, for files
    """

    name: str
    points: Array
    faces: Array
    normals: Array
    thickness: float = 0.0
    each: int = 1
    values: Mapping[str, Array] = dataclasses.field(default_factory=dict)
    data: Mapping[str, Array] = dataclasses.field(default_factory=dict)
    vectors: Mapping[str, Array] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        count = self.points.shape[1] if self.points.ndim == 3 else 0
        if self.faces.ndim != 2 or self.faces.shape[1] != 4 or not 0 <= self.faces.min() <= self.faces.max() < count:
            raise ValueError(f"surface {self.name!r}: faces are no quadrilaterals between its {count} points")
        for label, values in {"normals": self.normals, **self.vectors}.items():
            if values.shape != self.points.shape:
                raise ValueError(f"surface {self.name!r}: {label!r} has shape {values.shape}, not {self.points.shape}")
        wanted = (len(self.points), len(self.faces) // self.each)
        for label, values in {**self.values, **self.data}.items():
            if values.shape != wanted:
                raise ValueError(f"surface {self.name!r}: {label!r} has shape {values.shape}, not {wanted}")

    @property
    def rim(self) -> Array:
        """Edges (r, 2) int of one quadrilateral alone, each in its direction around it."""
        edges = np.stack([self.faces, np.roll(self.faces, -1, axis=1)], axis=-1).reshape(-1, 2)
        _, first, counts = np.unique(np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True)
        return np.asarray(edges[np.sort(first[counts == 1])])

    @property
    def outer(self) -> Array:
        """(4, f) bool, whether the edge from each corner to the next one is between quadrilaterals of other values."""
        count = round(self.each**0.5)
        i, j = np.divmod(np.arange(len(self.faces)) % self.each, count)
        return np.stack([j == 0, i == count - 1, j == count - 1, i == 0])

    def sides(self, k: int) -> tuple[Array, Array]:
        """Points (n, 3) of the side where the normals point, and of the other one, at sample k, m."""
        half = 0.5 * self.thickness * self.normals[k]
        return self.points[k] + half, self.points[k] - half

    def at_points(self, values: Array) -> Array:
        """Means (n,) of the values (f / each,) of the quadrilaterals around each point; NaN where there is none."""
        corners = self.faces.ravel()
        count = np.bincount(corners, minlength=self.points.shape[1]).astype(float)
        sums = np.bincount(corners, weights=np.repeat(values, 4 * self.each), minlength=count.size)
        return np.divide(sums, count, out=np.full_like(sums, np.nan), where=count > 0.0)

    def refined(self, most: int = MOST_FACES) -> Surface:
        """The surface with each quadrilateral in `each` smaller ones, as far as there are at most `most` of them.

        Notes
        -----
        Edges are Hermite's cubics that are perpendicular to the normals at both ends, the inside is a Coons patch.
        """
        count = int(np.sqrt(most / len(self.faces)))
        if count < 2:
            return self
        u = np.linspace(0.0, 1.0, count + 1)
        kept, faces = _divided(self.faces, count)
        return dataclasses.replace(
            self, points=_patches(self.points, self.normals, self.faces, u)[:, kept],
            normals=_unit(_bilinear(self.normals[:, self.faces], u)[:, kept]), faces=faces, each=count**2, vectors={},
        )  # fmt: skip


def _unit(vectors: Array) -> Array:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300)


def _divided(faces: Array, count: int) -> tuple[Array, Array]:
    """Which points of all patches, (count + 1)^2 each, are kept so that each is there once, and the faces between them.

    Parameters
    ----------
    faces : (f, 4) int
    """
    grid = np.arange((count + 1) ** 2).reshape(count + 1, count + 1)
    edges = [grid[:, 0], grid[-1], grid[::-1, -1], grid[0, ::-1]]  # of corners 0 to 1, 1 to 2 and so on
    known: dict[tuple[int, ...], int] = {}
    number = np.arange(len(faces) * grid.size).reshape(len(faces), -1)
    for face, own in zip(faces.tolist(), number, strict=True):
        for k, edge in enumerate(edges):
            a, b = face[k], face[(k + 1) % 4]
            for i, place in enumerate(edge):
                key = (a,) if i == 0 else (b,) if i == count else (a, b, i) if a < b else (b, a, count - i)
                own[place] = known.setdefault(key, int(own[place]))
    quads = np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], axis=-1).reshape(-1, 4)
    kept, found = np.unique(number[:, quads].reshape(-1, 4), return_inverse=True)
    return kept, found.reshape(-1, 4)


def _bilinear(corners: Array, u: Array) -> Array:
    """Values (nt, f (m + 1)^2, 3) between those at the corners (nt, f, 4, 3) of patches, at u (m + 1,) both ways."""
    a, b, c, d = (corners[:, :, k, None, None] for k in range(4))
    x, y = u[:, None, None], u[None, :, None]
    found = (1.0 - y) * ((1.0 - x) * a + x * b) + y * ((1.0 - x) * d + x * c)
    return np.asarray(found.reshape(len(corners), -1, 3))


def _patches(points: Array, normals: Array, faces: Array, u: Array) -> Array:
    """Points (nt, f (m + 1)^2, 3) of Coons patches over all faces, at u (m + 1,) both ways."""

    def edge(one: int, two: int) -> Array:
        """Points (nt, f, m + 1, 3) of the cubics between two corners."""
        a, b = points[:, faces[:, one]], points[:, faces[:, two]]
        chord = b - a
        size = np.linalg.norm(chord, axis=-1, keepdims=True)
        p, q = (
            size * _unit(chord - np.sum(chord * n, axis=-1, keepdims=True) * n)
            for n in (normals[:, faces[:, one]], normals[:, faces[:, two]])
        )
        shape = axis_shape(1.0, u)
        return np.asarray(sum(np.asarray(f)[:, None] * x[:, :, None] for f, x in zip(shape, (a, p, b, q), strict=True)))

    x, y = u[:, None, None], u[None, :, None]
    low, high, left, right = edge(0, 1), edge(3, 2), edge(0, 3), edge(1, 2)
    found = (1.0 - y) * low[:, :, :, None] + y * high[:, :, :, None]
    found += (1.0 - x) * left[:, :, None] + x * right[:, :, None]
    return np.asarray(found.reshape(len(points), -1, 3) - _bilinear(points[:, faces], u))
