"""Time series for ParaView: collections (.pvd) of polygonal data (.vtp): lines, surfaces, bodies, forces, marks, axes.

There is one file a sample for all lines, one for all bodies, and so on. Polygonal data are what ParaView's filter Tube
takes; it does not take unstructured grids.
"""

from __future__ import annotations

import os
import pathlib
import re
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent.exports import vtp
from evolvent.exports.request import Request, about, motion_of, samples_text, shown_size, size_of
from evolvent.results import unfinished
from evolvent.results.rotations import turned
from evolvent_base import progress
from evolvent_base.errors import InputError, reason_of
from evolvent_base.files import make_folder, writing

if TYPE_CHECKING:
    from evolvent.results.motion import Frame, Motion
    from evolvent.results.surfaces import Surface

#: Samples that are written unless more are asked for.
MOST = 300
_FOLDER = "data"
_TEXTS = {
    "lines": """lines{suffix}.pvd   {lines}; point data: {values} (filter Tube, for thickness);
             cell data: line (1, 2, ... in this order)
""",
    "strips": """strips{suffix}.pvd  {strips} with their width, as surfaces; data as above
""",
    "surfaces": """surfaces{suffix}.pvd {surfaces}; cell data: {cells}, and surface (1, 2, ... in this order);
             point data: the same, means of the cells around a point, and {moves}, normal (vectors), thickness [m]
""",
    "bodies": """bodies{suffix}.pvd  solids of {bodies}, as surfaces; cell data: body (1, 2, ... as in frames)
""",
    "symbols": """symbols{suffix}.pvd {symbols}, as surfaces; cell data: part (1, 2, ... in this order)
""",
    "forces": """forces{suffix}.pvd  {forces}; cell data: kind (1, 2, ... in this order); point data: {vectors},
             vectors (filter Glyph, orient and scale by them; scale factors that suit: {scale})
""",
    "marks": """marks{suffix}.pvd   {marks}; cell data: kind (1, 2, ... in this order); point data: size [m]
""",
    "frames": """frames{suffix}.pvd  axes of {frames} and what draws them; cell data: axis (0 x, 1 y, 2 z, -1 outline);
             point data: quaternion from body to the axes of this file (scalar, and x, y, z as a vector)
""",
}
_TEXT = """
Open the .pvd files in ParaView; they refer to those in {folder}/. Lengths in m, time in s, axes: {axes}.
{kept}.

"""
#: What point data of forces are called, by unit.
_VECTORS = {"N": "force [N]", "N m": "moment [N m]"}


def write(run: Any, path: str, request: Request) -> str:
    """Write the motion of a run into a folder; returns what was written.

    Raises
    ------
    InputError
        If the folder cannot be written into, or it would hold far too much.
    """
    count = run.sizes["time"]
    samples = request.samples(run, most=MOST)
    motion = motion_of(run).at(samples)
    if request.axes == "body":
        motion = motion.in_body()
    kinds = _kinds(motion)
    numbers = sum(make(motion, 0).numbers for make in kinds.values())
    request.allow(samples.size * (8.0 * numbers + 2000.0 * len(kinds)), f"{samples.size} frames")
    suffix = f"-{run.attrs['status']}" if unfinished(run) else ""
    data = os.path.join(path, _FOLDER)
    make_folder(path)
    make_folder(data)
    _clear(data)
    _clear(path)
    try:
        for kind, make in kinds.items():
            listed = []
            for k, time in enumerate(progress.track(motion.time, f"writing {kind}", motion.time.size)):
                name = os.path.join(data, f"{kind}-{k:05d}.vtp")
                make(motion, k).write(name)
                listed.append((float(time), name))
            vtp.write_collection(os.path.join(path, f"{kind}{suffix}.pvd"), listed)
    except OSError as error:
        _clear(data)
        _clear(path)
        raise InputError(f"cannot write into {path!r}: {reason_of(error)}") from None
    text = "".join(_TEXTS[kind] for kind in kinds) + _TEXT
    text = text.format(
        suffix=suffix,
        lines=", ".join(line.name for line in motion.lines),
        strips=", ".join(line.name for line in motion.lines if line.across is not None),
        surfaces=", ".join(surface.name for surface in motion.surfaces),
        cells=", ".join(dict.fromkeys(name for surface in motion.surfaces for name in _cell_values(surface))),
        moves=", ".join(dict.fromkeys(name for surface in motion.surfaces for name in surface.vectors)),
        bodies=", ".join(frame.name for frame in motion.frames if frame.solids),
        symbols=", ".join(_symbol_names(motion)),
        marks=", ".join(mark.name for mark in motion.marks),
        values=", ".join(motion.labels) or "none",
        forces=", ".join(force.name for force in motion.forces),
        vectors=", ".join(_VECTORS[unit] for unit in _units(motion)),
        scale=", ".join(f"{motion.arrow_scale(unit) or 1.0:.2g}" for unit in _units(motion)),
        frames=", ".join(frame.name for frame in motion.frames),
        folder=_FOLDER,
        axes="those of the main body" if request.axes == "body" else "inertial",
        kept=samples_text(samples, count),
    )
    with writing(os.path.join(path, "about.txt")) as temporary:
        header = "".join(f"{what}: {words}\n" for what, words in about(run))
        pathlib.Path(temporary).write_text(f"{text}{header}\ncase:\n{run.attrs['case']}", encoding="utf-8")
    names = ", ".join(f"{kind}{suffix}.pvd" for kind in kinds)
    return f"{names} in {path}: {samples_text(samples, count)}, {shown_size(size_of(path))}"


def _kinds(motion: Motion) -> dict[str, Callable[[Motion, int], Grid]]:
    """What makes the files of a sample, for all that a motion has."""
    has: dict[str, tuple[bool, Callable[[Motion, int], Grid]]] = {
        "lines": (bool(motion.lines), _lines),
        "strips": (any(line.across is not None for line in motion.lines), _strips),
        "surfaces": (bool(motion.surfaces), _surfaces),
        "bodies": (any(frame.solids for frame in motion.frames), _bodies),
        "symbols": (any(frame.solids for frame in motion.symbols), _symbols),
        "forces": (bool(motion.forces), _forces),
        "marks": (bool(motion.marks), _marks),
        "frames": (bool(motion.frames) or any(frame.outline for frame in motion.symbols), _frames),
    }
    return {kind: make for kind, (wanted, make) in has.items() if wanted}


def _units(motion: Motion) -> list[str]:
    """Units of forces, each once."""
    return list(dict.fromkeys(force.unit for force in motion.forces))


def _clear(folder: str) -> None:
    """Remove what an earlier export left, and nothing else."""
    for name in os.listdir(folder):
        if re.fullmatch(
            r"(lines|strips|surfaces|bodies|symbols|forces|marks|frames)(-\d{5,}\.vt[up]|(-failed|-interrupted)?\.pvd)",
            name,
        ):
            os.unlink(os.path.join(folder, name))


# ------------------------------------------------------------------------------------------------ grids


class Grid:
    """Points, cells of one sort through them, and data, as they are put together: lines, faces or single points."""

    def __init__(self, cells: str) -> None:
        self._cells = cells
        self._points: list[np.ndarray] = []
        self._corners: list[np.ndarray] = []
        self._sizes: list[np.ndarray] = []
        self._point_data: list[dict[str, Any]] = []
        self._cell_data: list[dict[str, np.ndarray]] = []
        self._count = 0

    @property
    def numbers(self) -> int:
        """How many numbers a file holds, about."""
        values = 3 + len({name for data in self._point_data for name in data})
        return self._count * values + 2 * sum(len(c) for c in self._corners)

    def add(
        self,
        points: np.ndarray,
        point_data: Mapping[str, np.ndarray],
        cell_data: Mapping[str, int | np.ndarray],
        *,
        faces: np.ndarray | None = None,
    ) -> None:
        """One line through points (n, 3), n single points, or faces (f, k) between them; data of each, or of all.

        Single points that are nowhere, as a mark of a joint that is released, are left out.
        """
        if self._cells == vtp.VERTS:
            known = np.isfinite(points).all(axis=1)
            points, point_data = points[known], {name: values[known] for name, values in point_data.items()}
        n = len(points)
        if faces is not None:
            sizes = np.full(len(faces), faces.shape[1])
        else:
            sizes = np.array([n]) if self._cells == vtp.LINES else np.ones(n, dtype=int)
        self._points.append(points)
        self._point_data.append(dict(point_data))
        self._corners.append(self._count + (np.arange(n) if faces is None else faces.ravel()))
        self._sizes.append(sizes)
        self._cell_data.append({name: np.resize(values, len(sizes)) for name, values in cell_data.items()})
        self._count += n

    def write(self, path: str) -> None:
        """Write the file `path`, which ends in .vtp."""
        none = np.zeros(0, dtype=int)
        vtp.write(
            path, np.concatenate([np.zeros((0, 3)), *self._points]), self._cells,
            np.concatenate([none, *self._corners]), np.concatenate([none, *self._sizes]),
            _joined(self._point_data, [len(points) for points in self._points]),
            _joined(self._cell_data, [len(sizes) for sizes in self._sizes]),
        )  # fmt: skip


def _joined(every: list[dict[str, Any]], counts: list[int]) -> dict[str, np.ndarray]:
    """Values of all pieces by name, NaN where one of so many entries has none."""
    found = {}
    for name in dict.fromkeys(name for data in every for name in data):
        like = next(data[name] for data in every if name in data)
        none = [np.full((n, *like.shape[1:]), np.nan) for n in counts]
        values = [data.get(name, missing) for data, missing in zip(every, none, strict=True)]
        found[name] = np.concatenate(values)
    return found


def _lines(motion: Motion, k: int) -> Grid:
    made = Grid(vtp.LINES)
    for number, line in enumerate(motion.lines, 1):
        made.add(line.points[k], {name: v[k] for name, v in line.values.items()}, {"line": number})
    return made


def _strips(motion: Motion, k: int) -> Grid:
    """A quadrilateral for each piece of a strip."""
    made = Grid(vtp.POLYS)
    for number, line in enumerate(motion.lines, 1):
        if line.across is None:
            continue
        size = np.linalg.norm(line.across[k], axis=1, keepdims=True)
        edge = 0.5 * (line.width or 0.0) * line.across[k] / np.where(size > 0.0, size, 1.0)
        n = np.arange(len(edge) - 1)
        faces = np.stack([n, n + 1, n + 1 + len(edge), n + len(edge)], axis=1)
        points = np.concatenate([line.points[k] + edge, line.points[k] - edge])
        made.add(points, {name: np.tile(v[k], 2) for name, v in line.values.items()}, {"line": number}, faces=faces)
    return made


def _surfaces(motion: Motion, k: int) -> Grid:
    """The quadrilaterals of all surfaces."""
    made = Grid(vtp.POLYS)
    for number, surface in enumerate(motion.surfaces, 1):
        cells = {name: values[k] for name, values in _cell_values(surface).items()}
        nodes = {name: surface.at_points(values) for name, values in cells.items()}
        nodes |= {name: values[k] for name, values in surface.vectors.items()}
        nodes |= {"normal": surface.normals[k], "thickness [m]": np.full(len(surface.points[k]), surface.thickness)}
        made.add(surface.points[k], nodes, {**cells, "surface": number}, faces=surface.faces)
    return made


def _cell_values(surface: Surface) -> dict[str, np.ndarray]:
    """Values (nt, f) of the quadrilaterals, by label."""
    return {**surface.values, **surface.data}


def _bodies(motion: Motion, k: int) -> Grid:
    made = Grid(vtp.POLYS)
    for number, frame in enumerate(motion.frames, 1):
        _add_solids(made, frame, k, {"body": number}, sectors=24)
    return made


def _add_solids(made: Grid, frame: Frame, k: int, cell_data: dict[str, int], *, sectors: int) -> None:
    """Faces of the solids of a frame at sample k, where it is shown."""
    for solid in frame.solids if frame.is_shown(k) else ():
        mesh = solid.mesh(sectors=sectors, cells=1)
        placed = turned(frame.attitude[k : k + 1], solid.placed(mesh.vertices, k)[None])[0]
        made.add(frame.origin[k] + placed, {}, cell_data, faces=mesh.faces)


def _symbol_names(motion: Motion) -> list[str]:
    """Names of the parts with symbols, each once."""
    return list(dict.fromkeys(frame.name for frame in motion.symbols))


def _symbols(motion: Motion, k: int) -> Grid:
    made, names = Grid(vtp.POLYS), _symbol_names(motion)
    for frame in motion.symbols:
        _add_solids(made, frame, k, {"part": 1 + names.index(frame.name)}, sectors=12)
    return made


def _forces(motion: Motion, k: int) -> Grid:
    made = Grid(vtp.VERTS)
    for number, force in enumerate(motion.forces, 1):
        size = f"size [{force.unit}]"
        data = {_VECTORS[force.unit]: force.vectors[k], size: np.linalg.norm(force.vectors[k], axis=1)}
        made.add(force.points[k], data, {"kind": number})
    return made


def _marks(motion: Motion, k: int) -> Grid:
    made = Grid(vtp.VERTS)
    for number, mark in enumerate(motion.marks, 1):
        made.add(mark.points[k], {"size [m]": np.full(len(mark.points[k]), mark.size or 0.0)}, {"kind": number})
    return made


def _frames(motion: Motion, k: int) -> Grid:
    made = Grid(vtp.LINES)
    length = 0.25 * motion.reach
    numbered = [*enumerate(motion.symbols, 1 + len(motion.frames)), *enumerate(motion.frames, 1)]
    for number, frame in numbered:
        q, origin = frame.attitude[k : k + 1], frame.origin[k]
        outlines = len(frame.outline) if frame.is_shown(k) else 0
        for axis in range(-outlines, 3 if number <= len(motion.frames) else 0):
            polygon = np.stack([np.zeros(3), length * np.eye(3)[axis]]) if axis >= 0 else frame.outline[axis]
            placed = origin + turned(q, polygon[None])[0]
            data = {
                "quaternion scalar": np.full(len(placed), q[0, 0]),
                "quaternion vector": np.repeat(q[:, 1:], len(placed), axis=0),
            }
            made.add(placed, data, {"axis": max(axis, -1), "body": number})
    return made
