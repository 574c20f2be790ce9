"""An animated model as one binary glTF file (.glb), for viewers, Blender and pages.

Every body is a node that moves; lines are rods and strips of straight pieces that follow their points; surfaces are
skins, whose joints are their points.
Source: glTF 2.0 specification, Khronos Group (binary glTF, accessors, animations).
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent.exports.request import Request, animation_of, samples_text, shown_size
from evolvent.results.motion import quantity
from evolvent.results.rotations import from_rotation_vectors, product, quaternions, turns_between
from evolvent.results.solids import Solid
from evolvent.view.animation import default_speed
from evolvent_base.files import write_file

if TYPE_CHECKING:
    from evolvent.results.motion import Frame, Line
    from evolvent.results.surfaces import Surface

Array = np.ndarray
#: Samples that are written unless more are asked for.
MOST = 1000
#: Radius of a line, of the reach; thickness of a strip, of its width.
_THIN, _FLAT = 2e-3, 0.02
#: Rounding of single precision, and how much of it is seen, of the reach.
_ROUNDED, _SEEN = 6e-8, 1e-4
#: Colours: name of the material, red, green, blue.
_COLORS = {"body": (0.55, 0.62, 0.72), "symbol": (0.85, 0.55, 0.25), "line": (0.2, 0.45, 0.7)}
#: Types of accessors: number of entries -> name; and numbers that are floats and unsigned integers, long and short.
_WIDTHS, _FLOAT, _UINT, _SHORT = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}, 5126, 5125, 5123
#: glTF has y up: what turns an axis that points up to y.
_UP = {
    "x": from_rotation_vectors(np.array([[0.0, 0.0, 0.5 * np.pi]]))[0],
    "y": np.array([1.0, 0.0, 0.0, 0.0]),
    "z": from_rotation_vectors(np.array([[-0.5 * np.pi, 0.0, 0.0]]))[0],
}


def write(run: Any, path: str, request: Request) -> str:
    """Write the animation; returns what was written.

    Raises
    ------
    InputError
        If the run holds too little, the file cannot be written, or it would be far too large.
    """
    whole = animation_of(run)
    samples = request.samples(run, most=MOST)
    samples = samples if samples.size > 1 else np.array([0, run.sizes["time"] - 1])
    seen = whole.in_body() if request.axes == "body" else whole
    motion, speed = seen.at(samples), request.speed or default_speed(whole)
    pieces = sum(line.points.shape[1] - 1 for line in motion.lines)
    pieces += sum(surface.points.shape[1] for surface in motion.surfaces)
    request.allow(40.0 * samples.size * (pieces + len(motion.frames)), f"{samples.size} samples")
    file = _File((motion.time - motion.time[0]) / speed)
    root = file.node(motion.title, rotation=_UP[motion.up])
    for frame, color in [*((f, "body") for f in motion.frames), *((f, "symbol") for f in motion.symbols)]:
        _add_frame(file, root, frame, color)
    for line in motion.lines:
        _add_line(file, root, line, _THIN * motion.reach)
    for surface in motion.surfaces:
        _add_surface(file, root, surface)
    content = file.content(motion.title)
    write_file(path, content)
    said = f"{path}: {samples_text(samples, run.sizes['time'])}, {speed:g} times real time, {shown_size(len(content))}"
    origins = [frame.origin for frame in motion.frames]
    for frame in seen.frames:
        if np.any(np.linalg.norm(turns_between(frame.attitude, samples), axis=1) > np.pi):
            said += (
                f"; {frame.name!r} turns by more than half a turn between samples, which is not seen: raise --frames"
            )
            break
    rounded = _ROUNDED * max(float(np.nanmax(np.abs(x), initial=0.0)) for x in (*motion.clouds, *origins))
    if rounded > _SEEN * motion.reach:
        said += f"; glTF has single precision, so positions are rounded to {quantity(rounded, 'm')}: take --axes body"
    return said


def _add_frame(file: _File, root: int, frame: Frame, color: str) -> None:
    """A node that moves with a frame, with a node for each of its solids; where it is not shown, it is a point."""
    if not frame.solids:
        return
    shown = None if frame.shown is None else np.repeat((frame.shown > 0.5)[:, None], 3, axis=1)
    body = file.node(frame.name, root, steps={"scale": shown}, translation=frame.origin, rotation=frame.attitude)
    for solid in frame.solids:
        scale = None if solid.scale is None else np.repeat(solid.scale[:, None], 3, axis=1)
        file.node(
            frame.name, body, mesh=file.solid(solid, color), translation=np.array(solid.centre),
            rotation=_turning(solid), scale=scale,
        )  # fmt: skip


def _turning(solid: Solid) -> Array:
    """Quaternion of a solid in its frame, at every sample where it turns about its axis."""
    still = quaternions(solid.basis)
    if solid.turned is None:
        return still
    about = from_rotation_vectors(solid.turned[:, None] * np.array([1.0, 0.0, 0.0]))
    return product(np.broadcast_to(still, about.shape), about)


def _add_line(file: _File, root: int, line: Line, thin: float) -> None:
    """A node for each straight piece of a line: a unit box or rod along x, turned and stretched."""
    node = file.node(line.name, root)
    width = line.width if line.width is not None and (line.kind == "rod" or line.across is not None) else 2.0 * thin
    high = _FLAT * width if line.across is not None else width
    mesh = file.unit(flat=line.across is not None)
    for k in range(line.points.shape[1] - 1):
        ends = line.points[:, k : k + 2]
        along = ends[:, 1] - ends[:, 0]
        length = np.linalg.norm(along, axis=1)
        known = np.isfinite(length) & (length > 0.0)
        x = np.where(known[:, None], along, [1.0, 0.0, 0.0]) / np.where(known, length, 1.0)[:, None]
        side = np.eye(3)[np.argmin(np.abs(x), axis=1)] if line.across is None else line.across[:, k]
        y = side - np.sum(side * x, axis=1, keepdims=True) * x
        size = np.linalg.norm(y, axis=1, keepdims=True)
        y = np.where(size > 0.0, y / np.where(size > 0.0, size, 1.0), np.cross(x, np.roll(x, 1, axis=1)))
        axes = np.stack([x, y, np.cross(x, y)], axis=-1)
        scale = np.where(known[:, None], np.stack([length, 0.0 * length + width, 0.0 * length + high], axis=1), 0.0)
        file.node(
            f"{line.name} {k + 1}", node, mesh=mesh, scale=scale, rotation=quaternions(axes),
            translation=np.where(known[:, None], ends.mean(axis=1), 0.0),
        )  # fmt: skip


def _add_surface(file: _File, root: int, surface: Surface) -> None:
    """A skin whose joints move as the points; where one is hidden, it stays."""
    node = file.node(surface.name, root)
    first, moves = surface.points[0], surface.points - surface.points[0]
    moves = np.where(np.isfinite(moves), moves, 0.0)
    joints = [file.node(f"{surface.name} {k + 1}", node, translation=moves[:, k]) for k in range(len(first))]
    file.skin(surface.name, node, np.nan_to_num(first), surface.faces, joints)


class _File:
    """Nodes, meshes and an animation as they are put together."""

    def __init__(self, time: Array) -> None:
        self._json: dict[str, list[Any]] = {
            name: []
            for name in ("nodes", "meshes", "materials", "accessors", "bufferViews", "skins", "channels", "samplers")
        }
        self._buffer = bytearray()
        self._units: dict[bool, int] = {}
        self._time = self._accessor(time, bounds=True)

    def node(
        self,
        name: str,
        parent: int | None = None,
        mesh: int | None = None,
        steps: Mapping[str, Array | None] | None = None,
        **moves: Array | None,
    ) -> int:
        """A node with what places it: of one sample, or of all, which is an animation; returns its number.

        Between samples `moves` are linear, and `steps` stay as they were at the last one.
        """
        number = len(self._json["nodes"])
        found: dict[str, Any] = {"name": name}
        self._json["nodes"].append(found)
        if mesh is not None:
            found["mesh"] = mesh
        if parent is not None:
            self._json["nodes"][parent].setdefault("children", []).append(number)
        placed = [("STEP", *one) for one in (steps or {}).items()] + [("LINEAR", *one) for one in moves.items()]
        for between, path, given in placed:
            if given is None:
                continue
            values = _shortest(given) if path == "rotation" else np.asarray(given, dtype=np.float32)
            first = values if values.ndim == 1 else values[0]
            found[path] = first.tolist()
            if values.ndim == 2 and np.any(values != first):
                sampler = {"input": self._time, "output": self._accessor(values), "interpolation": between}
                target = {"node": number, "path": path}
                self._json["channels"].append({"sampler": len(self._json["samplers"]), "target": target})
                self._json["samplers"].append(sampler)
        return number

    def solid(self, solid: Solid, color: str) -> int:
        """The mesh of a solid in its own axes; returns its number."""
        mesh = solid.mesh(sectors=32, cells=1)
        return self._mesh(mesh.vertices, mesh.faces, color)

    def unit(self, *, flat: bool) -> int:
        """The mesh of a box of 1 x 1 x 1, or a rod of length and diameter 1 along x; returns its number."""
        if flat not in self._units:
            shape = Solid.box((1.0, 1.0, 1.0)) if flat else Solid.cylinder(0.5, 1.0, axis=(1.0, 0.0, 0.0))
            mesh = shape.mesh(sectors=8, cells=1)
            self._units[flat] = self._mesh(mesh.vertices, mesh.faces, "line")
        return self._units[flat]

    def skin(self, name: str, parent: int, points: Array, faces: Array, joints: list[int]) -> None:
        """A mesh with a joint for each of its points, which is at the points where the joints are at the origin."""
        bones = np.zeros((len(points), 4), dtype=np.uint16)
        bones[:, 0] = np.arange(len(points))
        weights = np.zeros((len(points), 4))
        weights[:, 0] = 1.0
        more = {"JOINTS_0": self._accessor(bones), "WEIGHTS_0": self._accessor(weights)}
        mesh = self._mesh(points, faces, "line", more)
        self._json["skins"].append({"name": name, "joints": joints, "skeleton": parent})
        self._json["nodes"][self.node(name, parent, mesh=mesh)]["skin"] = len(self._json["skins"]) - 1

    def _mesh(self, vertices: Array, faces: Array, color: str, more: dict[str, int] | None = None) -> int:
        triangles = np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])
        corners = vertices[triangles]
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        used = triangles[area > 1e-9 * area.max()].ravel().astype(np.uint32)
        primitive = {
            "attributes": {"POSITION": self._accessor(vertices, bounds=True), **(more or {})},
            "indices": self._accessor(used),
            "material": self._material(color),
        }
        self._json["meshes"].append({"primitives": [primitive]})
        return len(self._json["meshes"]) - 1

    def _material(self, color: str) -> int:
        names = [one["name"] for one in self._json["materials"]]
        if color not in names:
            look = {"baseColorFactor": [*_COLORS[color], 1.0], "metallicFactor": 0.1, "roughnessFactor": 0.7}
            self._json["materials"].append({"name": color, "pbrMetallicRoughness": look, "doubleSided": True})
            return len(names)
        return names.index(color)

    def _accessor(self, values: Array, *, bounds: bool = False) -> int:
        kind = {"u2": _SHORT, "u4": _UINT}.get(values.dtype.str[1:], _FLOAT)
        data = np.ascontiguousarray(values, dtype={_SHORT: "<u2", _UINT: "<u4", _FLOAT: "<f4"}[kind])
        view = {"buffer": 0, "byteOffset": len(self._buffer), "byteLength": data.nbytes}
        self._buffer += data.tobytes()
        self._json["bufferViews"].append(view)
        width = data.shape[1] if data.ndim == 2 else 1
        found: dict[str, Any] = {"bufferView": len(self._json["bufferViews"]) - 1, "componentType": kind}
        found |= {"count": len(data), "type": _WIDTHS[width]}
        if bounds:
            columns = data.reshape(len(data), width)
            found |= {"min": columns.min(axis=0).tolist(), "max": columns.max(axis=0).tolist()}
        self._json["accessors"].append(found)
        return len(self._json["accessors"]) - 1

    def content(self, title: str) -> bytes:
        """The file."""
        animation = {"name": title, "channels": self._json.pop("channels"), "samplers": self._json.pop("samplers")}
        described: dict[str, Any] = {"asset": {"version": "2.0", "generator": "evolvent"}, "scene": 0}
        described["scenes"] = [{"nodes": [0]}]
        described |= {"buffers": [{"byteLength": len(self._buffer)}]}
        described |= {name: held for name, held in self._json.items() if held}
        described |= {"animations": [animation]} if animation["channels"] else {}
        text = json.dumps(described, allow_nan=False, separators=(",", ":")).encode()
        chunks = [(b"JSON", text + b" " * (-len(text) % 4)), (b"BIN\0", bytes(self._buffer))]
        body = b"".join(np.uint32(len(data)).tobytes() + kind + data for kind, data in chunks)
        return b"glTF" + np.array([2, 12 + len(body)], dtype="<u4").tobytes() + body


def _shortest(q: Array) -> Array:
    """Quaternions as glTF has them, scalar last, with signs by which each is nearest to the one before."""
    q = np.atleast_2d(q) / np.linalg.norm(np.atleast_2d(q), axis=1, keepdims=True)
    signs = np.where(np.sum(q[1:] * q[:-1], axis=1) < 0.0, -1.0, 1.0)
    found = q * np.concatenate([[1.0], np.cumprod(signs)])[:, None]
    return found[:, [1, 2, 3, 0]].astype(np.float32)
