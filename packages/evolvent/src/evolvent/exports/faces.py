"""Faces and pieces of lines of a motion at a moment, the farthest first; as `viewer/picture.js` draws them."""

from __future__ import annotations

import dataclasses
import itertools
import math
from typing import NamedTuple

import numpy as np

from evolvent.results.motion import Forces, Frame, Line, Motion
from evolvent.results.rotations import turned
from evolvent.results.solids import Mesh
from evolvent.results.surfaces import Surface
from evolvent.view.views import OBLIQUE

Array = np.ndarray

_BODIES = np.array([[188, 198, 209], [214, 197, 166], [178, 203, 176], [204, 181, 198], [170, 194, 219]]) / 255.0
_SYMBOL, _PLUME, _MARKED = np.array([[104, 116, 150], [245, 150, 50], [226, 96, 84]]) / 255.0
_INK, _FORCE, _NONE = np.array([[48, 54, 61], [197, 40, 28], [165, 172, 180]]) / 255.0
_LIGHT = np.array([-0.35, 0.6, -0.72])  # right, up, away from the eye
#: Camera's distance from the middle, of the radius of what is seen.
_FAR = 6.0
#: Sample times at which the size of the picture is measured.
_MEASURED = 60
_TURNS, _STEPS = 9, 14
#: Shade of the side of a surface that its normals leave.
_BACK = 0.88
#: Pixels of an element, about, from which lines are drawn around it.
_MESH = 14.0


class Faces(NamedTuple):
    """Quadrilaterals on a picture, in the order in which they are drawn; a piece of a line has two corners twice.

    Attributes
    ----------
    corners : (n, 4, 2) float, pixels from the middle of the picture, y up
    fill, line : (n, 4) float, colours with opacity
    width : (n,) float, pixels, of their lines
    depth : (n,) float, m, away from the eye
    """

    corners: Array
    fill: Array
    line: Array
    width: Array
    depth: Array

    def sorted(self) -> Faces:
        """The farthest first."""
        order = np.argsort(-self.depth, kind="stable")
        return Faces(*(x[order] for x in self))


def join(parts: list[Faces]) -> Faces:
    """Faces of several parts."""
    if not parts:
        return Faces(np.empty((0, 4, 2)), np.empty((0, 4)), np.empty((0, 4)), np.empty(0), np.empty(0))
    return Faces(*(np.concatenate(x) for x in zip(*parts, strict=True)))


@dataclasses.dataclass(frozen=True, kw_only=True)
class Camera:
    """Where a motion is seen from.

    Attributes
    ----------
    axes : (3, 3) float, rows right, up and away, of the axes that are drawn
    target : (3,) float, m, what is in the middle of the picture, from the main frame's origin if `follows`
    radius : float, m, of what is seen
    scale : float, pixels per m at the target
    follows : bool, whether the target moves with the main frame
    """

    axes: Array
    target: Array
    radius: float
    scale: float
    follows: bool

    @classmethod
    def of(cls, motion: Motion, size: tuple[int, int]) -> Camera:
        """A camera that sees all of a motion, or all around its main frame where that travels far."""
        azimuth, elevation = OBLIQUE
        ca, sa, ce, se = math.cos(azimuth), math.sin(azimuth), math.cos(elevation), math.sin(elevation)
        up = {"x": np.eye(3)[[1, 2, 0]], "y": np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]), "z": np.eye(3)}[motion.up]
        axes = np.array([[ca, sa, 0.0], [-sa * se, ca * se, ce], [-sa * ce, ca * ce, -se]]) @ up
        some = motion.at(
            np.unique(np.linspace(0, motion.time.size - 1, _MEASURED).round().astype(int).clip(0, motion.time.size - 1))
        )
        clouds = _clouds(some)
        origin = None if some.body is None else some.body.origin[:, None]
        middle, half = _extent(clouds, axes)
        follows = False
        if origin is not None:
            near = _extent([c - origin for c in clouds], axes)
            own = _extent(_clouds(some.in_body()), axes)[1]
            follows = bool(np.linalg.norm(half) > 3.0 * np.linalg.norm(own))
            middle, half = near if follows else (middle, half)
        radius = float(np.linalg.norm(half)) or 1.0
        width, height = size
        scale = min(
            0.42 * width / max(half[0], 1e-9), 0.38 * height / max(half[1], 1e-9), 2.0 * max(width, height) / radius
        )
        return cls(axes=axes, target=axes.T @ middle, radius=radius, scale=scale, follows=follows)

    def at(self, motion: Motion, k: int) -> Camera:
        """The camera at sample k."""
        if not self.follows or motion.body is None:
            return self
        return dataclasses.replace(self, target=self.target + motion.body.origin[k])

    def view(self, points: Array) -> Array:
        """Right, up and away (..., 3), m, of points (..., 3)."""
        return np.asarray((points - self.target) @ self.axes.T)

    def screen(self, view: Array) -> tuple[Array, Array]:
        """Positions (..., 2) on the picture of views (..., 3), and pixels per m there (...)."""
        far = _FAR * self.radius
        scale = self.scale * far / np.maximum(far + view[..., 2], 0.02 * far)
        return scale[..., None] * view[..., :2], scale


def _clouds(motion: Motion) -> list[Array]:
    """All points (nt, n, 3) of a motion: lines, marks, outlines and the boxes around solids."""
    found = motion.clouds
    for frame in motion.frames:
        own = [np.asarray(polyline) for polyline in frame.outline]
        for solid in frame.solids:
            vertices = solid.mesh(sectors=12).vertices
            low, high = vertices.min(axis=0), vertices.max(axis=0)
            box = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T
            own.append(box @ solid.basis.T + solid.centre)
        if own:
            points = np.concatenate(own)
            held = np.broadcast_to(points, (motion.time.size, *points.shape))
            found.append(frame.origin[:, None] + turned(frame.attitude, held))
    return found


def _extent(clouds: list[Array], axes: Array) -> tuple[Array, Array]:
    """Middle and half the size (3,) of points along axes."""
    seen = np.concatenate([np.zeros((0, 3)), *((c @ axes.T).reshape(-1, 3) for c in clouds)])
    seen = seen[np.isfinite(seen).all(axis=1)]
    low, high = (seen.min(axis=0), seen.max(axis=0)) if len(seen) else (-np.ones(3), np.ones(3))
    return 0.5 * (low + high), 0.5 * (high - low)


class Drawer:
    """Faces of a motion, sample by sample.

    Parameters
    ----------
    motion : Motion, in the axes that are drawn
    camera : Camera
    scales : mapping of the units of forces to the length of an arrow, m per unit
    colors : (256, 3) float, of values from the low to the high end of `ends`
    label : str, of the values that are shown, or None
    ends : (2,) float
    pixel : float, pixels of a line of width 1
    """

    def __init__(
        self,
        motion: Motion,
        camera: Camera,
        *,
        scales: dict[str, float],
        colors: Array,
        label: str | None,
        ends: tuple[float, float],
        pixel: float,
    ) -> None:
        self._motion, self._camera, self._scales = motion, camera, scales
        self._colors, self._label, self._ends, self._pixel = colors, label, ends, pixel
        self._meshes = [[solid.mesh() for solid in frame.solids] for frame in motion.frames]
        self._symbol_meshes = [[solid.mesh(sectors=16) for solid in frame.solids] for frame in motion.symbols]
        self._rims = [surface.rim for surface in motion.surfaces]
        self._rest = {
            line.name: float(np.nanmax(np.linalg.norm(line.points[:, -1] - line.points[:, 0], axis=-1)))
            for line in motion.lines
            if line.kind == "spring"
        }

    def faces(self, k: int) -> Faces:
        """Everything at sample k."""
        camera = self._camera.at(self._motion, k)
        parts = []
        for number, (frame, meshes) in enumerate(zip(self._motion.frames, self._meshes, strict=True)):
            parts += self._body(camera, frame, meshes, k, _BODIES[0 if frame is self._motion.body else number % 5])
        for frame, meshes in zip(self._motion.symbols, self._symbol_meshes, strict=True):
            if not frame.is_shown(k):
                continue
            for faces in self._body(camera, frame, meshes, k, _SYMBOL):
                parts.append(faces._replace(depth=faces.depth - frame.lift - 1e-3 * camera.radius))
        for line in self._motion.lines:
            parts += self._spring(camera, line, k) if line.kind == "spring" else self._line(camera, line, k)
        for surface, rim in zip(self._motion.surfaces, self._rims, strict=True):
            parts += self._surface(camera, surface, rim, k)
        for mark in self._motion.marks:
            view = camera.view(mark.points[k][np.isfinite(mark.points[k]).all(axis=1)])
            at, scale = camera.screen(view)
            depth = view[:, 2] - (mark.size or 0.0) - 4e-3 * camera.radius
            parts += _dots(at, np.maximum(3.2 * self._pixel, 0.5 * (mark.size or 0.0) * scale), depth)
        for force in self._motion.forces:
            parts += self._arrows(camera, force, k)
        return join(parts).sorted()

    def _body(self, camera: Camera, frame: Frame, meshes: list[Mesh], k: int, color: Array) -> list[Faces]:
        """Solids of a frame, seen from outside, and its outline."""
        q, origin, parts = frame.attitude[k : k + 1], frame.origin[k], []
        color = _MARKED if frame.marked is not None and frame.marked[k] > 0.5 else color
        for solid, mesh in zip(frame.solids, meshes, strict=True):
            view = camera.view(origin + turned(q, solid.placed(mesh.vertices, k)[None])[0])
            at = camera.screen(view)[0][mesh.faces]
            corner = view[mesh.faces]
            a, b = at[:, 2] - at[:, 0], at[:, 3] - at[:, 1]
            front = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0] > 0.0
            normal = np.cross(corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1])[front]
            # "away" makes the view's axes left-handed, so the product points inwards
            lit = np.maximum(0.0, -normal @ _LIGHT / np.maximum(np.linalg.norm(normal, axis=1), 1e-300))
            shade = 0.6 + 0.48 * lit
            if solid.turned is not None:
                shade = shade * np.where(mesh.dark[front], 0.75, 1.0)
            own = color if solid.scale is None else _PLUME
            fill = _opaque(np.minimum(1.0, shade[:, None] * own))
            width = np.full(len(fill), 0.5 * self._pixel)
            parts.append(Faces(at[front], fill, fill, width, corner[front][:, :, 2].max(axis=1)))
        for polyline in frame.outline:
            placed = origin + turned(q, np.asarray(polyline)[None])[0]
            share = np.linspace(0.0, 1.0, 9)[:, None]
            fine = np.concatenate([a + share[:-1] * (b - a) for a, b in itertools.pairwise(placed)])
            view = camera.view(np.concatenate([fine, placed[-1:]]))
            at, depth = camera.screen(view)[0], 0.5 * (view[1:, 2] + view[:-1, 2]) - 4e-3 * camera.radius
            parts.append(_pieces(at[:-1], at[1:], depth, _INK, 1.3 * self._pixel))
        return parts

    def _tints(self, line: Line, k: int) -> Array:
        """Colours (n - 1, 3) of the pieces of a line, each by the mean of its ends."""
        mean = np.full(line.points.shape[1] - 1, np.nan)
        if self._label is not None and self._label in line.values:
            a, b = line.values[self._label][k, :-1], line.values[self._label][k, 1:]
            mean = np.where(np.isnan(a), b, np.where(np.isnan(b), a, 0.5 * (a + b)))
        return self._colored(mean)

    def _colored(self, values: Array) -> Array:
        """Colours (n, 3) of values (n,), that of none where they are NaN."""
        found = np.tile(_NONE, (len(values), 1))
        known = np.isfinite(values)
        low, high = self._ends
        share = np.clip((values[known] - low) / (high - low), 0.0, 1.0)
        found[known] = self._colors[np.round(255.0 * share).astype(int)]
        return found

    def _surface(self, camera: Camera, surface: Surface, rim: Array, k: int) -> list[Faces]:
        """Quadrilaterals on the side from which each is seen, and the edge all around."""
        upper, lower = (camera.view(side) for side in surface.sides(k))
        above, below = camera.screen(upper)[0], camera.screen(lower)[0]
        faces = surface.faces
        a, b = above[faces[:, 2]] - above[faces[:, 0]], above[faces[:, 3]] - above[faces[:, 1]]
        front = (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0] > 0.0)[:, None, None]
        at, corner = np.where(front, above[faces], below[faces]), np.where(front, upper[faces], lower[faces])
        normal = np.cross(corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1])
        normal = np.where(front[:, 0], normal, -normal)
        lit = np.maximum(0.0, -normal @ _LIGHT / np.maximum(np.linalg.norm(normal, axis=1), 1e-300))
        values = surface.values.get(self._label or "")
        each = np.full(len(faces) // surface.each, np.nan) if values is None else values[k]
        color = np.repeat(self._colored(each), surface.each, axis=0)
        fill = _opaque(np.minimum(1.0, (0.76 + 0.28 * lit)[:, None] * np.where(front[:, 0], color, _BACK * color)))
        depth = corner[:, :, 2].mean(axis=1)
        parts = [Faces(at, fill, fill, np.full(len(faces), 0.9 * self._pixel), depth)]
        large = surface.each * np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) > (_MESH * self._pixel) ** 2
        for side, outer in enumerate(surface.outer):  # over what is drawn of the element
            shown = outer & large
            ends = at[shown, side], at[shown, (side + 1) % 4]
            parts.append(_pieces(*ends, depth[shown] - 1e-9, 0.82 * fill[shown, :3], 0.8 * self._pixel))
        one, two = rim.T
        edge = np.stack([above[one], above[two], below[two], below[one]], axis=1)
        depth = 0.25 * (upper[one] + upper[two] + lower[one] + lower[two])[:, 2] - 1e-3 * camera.radius
        ink = _opaque(np.tile(0.55 * _NONE, (len(rim), 1)))
        parts.append(Faces(edge, ink, ink, np.full(len(rim), self._pixel), depth))
        return [Faces(*(x[np.isfinite(part.depth)] for x in part)) for part in parts]

    def _line(self, camera: Camera, line: Line, k: int) -> list[Faces]:
        """A line, a rod, or a strip."""
        view = camera.view(line.points[k])
        at, scale = camera.screen(view)
        color = self._tints(line, k)
        shown = np.isfinite(view[1:, 0]) & np.isfinite(view[:-1, 0])
        depth = 0.5 * (view[1:, 2] + view[:-1, 2]) - 2e-3 * camera.radius
        thin, size = 2.4 * self._pixel, (line.width or 0.0) * 0.5 * (scale[1:] + scale[:-1])
        if line.across is None:
            width = np.maximum(thin, size) if line.kind == "rod" else np.full(len(depth), thin)
            parts = [_pieces(at[:-1], at[1:], depth, color, width)]
            if line.kind == "rod":
                light = _pieces(at[:-1], at[1:], depth - 1e-9, np.minimum(1.0, 1.12 * color), 0.4 * width)
                parts.append(light)
            return [Faces(*(x[shown] for x in part)) for part in parts]
        across = line.across[k] @ camera.axes.T
        across = across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-300)
        edge = 0.5 * (line.width or 0.0) * across
        left, right = camera.screen(view + edge)[0], camera.screen(view - edge)[0]
        corners = np.stack([left[:-1], left[1:], right[1:], right[:-1]], axis=1)
        normal = np.cross(view[1:] - view[:-1], across[:-1])
        lit = np.abs(normal[:, 2]) / np.maximum(np.linalg.norm(normal, axis=1), 1e-300)
        fill = _opaque(np.minimum(1.0, (0.72 + 0.32 * lit)[:, None] * color))
        strip = Faces(corners, fill, fill, np.full(len(fill), 0.5 * self._pixel), depth)
        # seen on edge, or from far away, a strip is a line
        narrow = lit * size < thin
        middle = _pieces(at[:-1], at[1:], depth - 1e-9, fill[:, :3], np.maximum(thin - 0.6 * lit * size, 0.1))
        return [Faces(*(x[shown] for x in strip)), Faces(*(x[shown & narrow] for x in middle))]

    def _spring(self, camera: Camera, line: Line, k: int) -> list[Faces]:
        """A coil from the first point to the last."""
        p, q = line.points[k, 0], line.points[k, -1]
        if not np.isfinite(p + q).all():
            return []
        length = float(np.linalg.norm(q - p)) or 1e-9
        z = (q - p) / length
        x = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
        x /= np.linalg.norm(x)
        radius = 0.5 * line.width if line.width else 0.07 * self._rest[line.name]
        share = np.linspace(0.0, 1.0, _TURNS * _STEPS + 1)[:, None]
        angle = 2.0 * np.pi * _TURNS * share
        coil = p + z * length * (0.12 + 0.76 * share) + radius * (x * np.cos(angle) + np.cross(z, x) * np.sin(angle))
        view = camera.view(np.concatenate([p[None], coil, q[None]]))
        at = camera.screen(view)[0]
        color = self._tints(line, k)[0]
        return [_pieces(at[:-1], at[1:], 0.5 * (view[1:, 2] + view[:-1, 2]), color, 2.0 * self._pixel)]

    def _arrows(self, camera: Camera, force: Forces, k: int) -> list[Faces]:
        """Arrows of forces, with two heads of moments."""
        along = self._scales[force.unit] * force.vectors[k]
        shown = (np.linalg.norm(along, axis=1) > 3e-3 * camera.radius) & np.isfinite(force.points[k]).all(axis=1)
        start, end = camera.view(force.points[k][shown]), camera.view((force.points[k] + along)[shown])
        depth = 0.5 * (start[:, 2] + end[:, 2]) - 5e-3 * camera.radius
        return arrows(camera.screen(start)[0], camera.screen(end)[0], depth, self._pixel, twice=force.unit == "N m")


def arrows(start: Array, end: Array, depth: Array, pixel: float, *, twice: bool) -> list[Faces]:
    """Arrows between points (n, 2), with two heads if `twice`."""
    length = np.linalg.norm(end - start, axis=1, keepdims=True)
    way = (end - start) / np.maximum(length, 1e-300)
    head = np.minimum(9.0 * pixel, 0.6 * length)
    side = 0.4 * head * np.stack([-way[:, 1], way[:, 0]], axis=1)
    parts = [_pieces(start, end - head * way, depth, _FORCE, 1.8 * pixel)]
    for tip in (end, end - head * way)[: 2 if twice else 1]:
        back = tip - head * way
        fill = _opaque(np.tile(_FORCE, (len(tip), 1)))
        corners = np.stack([tip, back + side, back - side, back - side], axis=1)
        parts.append(Faces(corners, fill, fill, np.full(len(tip), 0.3), depth))
    return parts


def _dots(at: Array, radius: Array, depth: Array) -> list[Faces]:
    """Dots at points (n, 2), as polygons of 16 corners."""
    angle = 2.0 * np.pi * np.arange(16) / 16
    edge = at[:, None] + radius[:, None, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    fill = _opaque(np.tile(_INK, (len(at), 1)))
    fan = [[0, k, k + 1, k + 2] for k in range(1, 14, 2)]
    return [Faces(edge[:, corners], fill, fill, np.full(len(at), 0.3), depth) for corners in fan]


def _pieces(start: Array, end: Array, depth: Array, color: Array, width: Array | float) -> Faces:
    """Straight pieces of lines between points (n, 2)."""
    count = len(start)
    line = _opaque(np.broadcast_to(color, (count, 3)))
    corners = np.stack([start, end, end, start], axis=1)
    return Faces(corners, np.zeros((count, 4)), line, np.broadcast_to(width, (count,)).astype(float), depth)


def _opaque(color: Array) -> Array:
    return np.concatenate([color, np.ones((len(color), 1))], axis=1)
