"""Bodies and shells along a run, as clearances take them: where they are, how fast, and their geometries in coal."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from evolvent.parts.shapes import Box, Capsule, Cylinder, Sphere
from evolvent.results import variables
from evolvent.results.rotations import rotation_matrices
from evolvent.results.solids import Solid
from evolvent_base.errors import InputError

Array = np.ndarray


class Body(NamedTuple):
    """A body with a shape along a run.

    Attributes
    ----------
    name : str
    shape : Box, Cylinder, Sphere or Capsule
    x, v : (nt, 3) float, m and m/s, centre and its velocity, inertial axes
    R : (nt, 3, 3) float, rotation matrices from the axes of its geometry to inertial axes
    w : (nt, 3) float, rad/s, angular velocity, inertial axes
    radius : float, m, of the sphere about the centre that holds the body
    """

    name: str
    shape: Any
    x: Array
    v: Array
    R: Array
    w: Array
    radius: float

    @property
    def half(self) -> float:
        """Half of the thickness beside the geometry, m."""
        return 0.0

    def placed(self, coal: Any, k: int) -> tuple[Any, Any]:
        """Geometry and its place at sample k."""
        return _geometry(coal, self.shape), coal.Transform3s(self.R[k], self.x[k])

    def facets(self, coal: Any, k: int) -> Iterator[tuple[Any, Any]]:
        """Convex pieces."""
        yield self.placed(coal, k)

    def speed_of(self, other: Body | Surface) -> Array:
        """Bound (nt,) of the velocity of points of another one in the axes of this one, m/s."""
        return other.speed_beside(self.x, self.v, self.w)

    def speed_beside(self, x: Array, v: Array, w: Array) -> Array:
        """Bound (nt,) of the velocity of its points in axes at x that move with v and turn with w, m/s."""
        centre = self.v - v - np.cross(w, self.x - x)
        found: Array = np.linalg.norm(centre, axis=1) + np.linalg.norm(self.w - w, axis=1) * self.radius
        return found


class Surface(NamedTuple):
    """A shell along a run, of flat triangles.

    Attributes
    ----------
    name : str
    vertices, rates : (nt, n, 3) float, m and m/s, positions and velocities, inertial axes
    triangles : (m, 3) int, vertices
    half : float, m, half of its thickness
    x : (nt, 3) float, m, middle of the vertices
    radius : (nt,) float, m, of the sphere about it that holds the shell
    """

    name: str
    vertices: Array
    rates: Array
    triangles: Array
    half: float
    x: Array
    radius: Array

    def placed(self, coal: Any, k: int) -> tuple[Any, Any]:
        """Geometry and its place at sample k."""
        return _mesh(coal, self.vertices[k], self.triangles)

    def facets(self, coal: Any, k: int) -> Iterator[tuple[Any, Any]]:
        """Triangles."""
        for corners in self.vertices[k][self.triangles]:
            yield _mesh(coal, corners, np.arange(3, dtype=np.int64)[None])

    def speed_of(self, other: Body | Surface) -> Array:
        """Bound (nt,) of the velocity of points of another one beside those of this one, m/s."""
        zero = np.zeros_like(self.x)
        return other.speed_beside(zero, zero, zero) + self.speed_beside(zero, zero, zero)

    def speed_beside(self, x: Array, v: Array, w: Array) -> Array:
        """Bound (nt,) of the velocity of its points in axes at x that move with v and turn with w, m/s."""
        seen = self.rates - v[:, None] - np.cross(w[:, None], self.vertices - x[:, None])
        found: Array = np.linalg.norm(seen, axis=2).max(axis=1)
        return found


def body(run: xr.DataTree, name: str, shape: Any) -> Body:
    """Poses and rates of a body at the samples."""
    x, q, v, own = (variables.get(run, f"{name}.{key}").values for key in ("position", "attitude", "velocity", "rate"))
    R = rotation_matrices(q)
    w = np.einsum("tij,tj->ti", R, own)
    solid = _solid(shape)
    return Body(name, shape, x, v, R if isinstance(shape, Box) else R @ solid.basis[:, [1, 2, 0]], w, solid.size)


def surface(run: xr.DataTree, name: str, part: Any) -> Surface:
    """Nodes of a shell at the samples."""
    x, v = (variables.get(run, f"{name}.{key}").values for key in ("position", "velocity"))
    own: Any = run[name]
    quads, wall = own["element_nodes"].values, part.wall(name)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]).astype(np.int64)
    middle = x.mean(axis=1)
    half = 0.5 * float(np.sqrt(12.0 * wall.inertia / wall.mass))
    radius = np.linalg.norm(x - middle[:, None], axis=2).max(axis=1) + half
    return Surface(name, np.ascontiguousarray(x), v, triangles, half, middle, radius)


def _mesh(coal: Any, nodes: Array, triangles: Array) -> tuple[Any, Any]:
    """Triangles (m, 3) of nodes (n, 3), m, inertial axes, and their place."""
    found = coal.BVHModelOBBRSS()
    found.beginModel(len(triangles), len(nodes))
    found.addVertices(nodes)
    found.addTriangles(triangles)
    found.endModel()
    return found, coal.Transform3s(np.eye(3), np.zeros(3))


def _solid(shape: Any) -> Solid:
    """The solid of a shape, which has its axes and its radius."""
    match shape:
        case Box():
            return Solid.box(shape.size)
        case Cylinder():
            return Solid.cylinder(shape.radius, shape.span, axis=shape.axis)
        case Capsule():
            half = 0.5 * shape.length + shape.radius
            return Solid.revolution([(-half, 0.0), (half, 0.0)], axis=shape.axis)
        case Sphere():
            return Solid.sphere(shape.radius)
    raise InputError(f"a shape is {type(shape).__name__}; clearances take boxes, cylinders, spheres and capsules")


def _geometry(coal: Any, shape: Any) -> Any:
    """A shape as coal has it, its axis along z.

    A sphere is a capsule without length: the closed form of coal 3.0.3 for the depth of a sphere in a cylinder takes
    the wrong way out where the centre of the sphere is inside.
    """
    match shape:
        case Box():
            return coal.Box(*shape.size)
        case Cylinder():
            return coal.Cylinder(shape.radius, shape.span)
    return coal.Capsule(shape.radius, getattr(shape, "length", 0.0))
