"""Time series for ParaView: collections (.pvd) of polygonal data (.vtp) of lines, forces and axes of bodies.

`pyevtk` writes the files: it is pure Python on NumPy alone and permissive, where VTK's own writers weigh half a
gigabyte. Polygonal data are what ParaView's filter Tube takes; it does not take unstructured grids.
"""

from __future__ import annotations

import os
import pathlib
import re
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent import cases
from evolvent.errors import InputError
from evolvent.exports.request import Request, about, kept, shown_size, size_of
from evolvent.motion import turned
from evolvent.results import make_folder, unfinished, writing

if TYPE_CHECKING:
    import xarray as xr

    from evolvent.motion import Motion

#: Samples that are written unless more are asked for.
MOST = 300
_POINTS, _LINES = "Verts", "Lines"
_FOLDER = "data"
_TEXT = """\
lines{suffix}.pvd   {lines}; point data: {values} (filter Tube, for thickness);
             cell data: line (1, 2, ... in this order)
forces{suffix}.pvd  {forces}; cell data: kind (1, 2, ... in this order); point data: force [N],
             a vector (filter Glyph, orient and scale by it; a scale factor of {scale} suits most moments)
frames{suffix}.pvd  axes of {frames} and its outline; cell data: axis (0 x, 1 y, 2 z, -1 outline);
             point data: quaternion from body to the axes of this file (scalar, and x, y, z as a vector)

Open the .pvd files in ParaView; they refer to those in {folder}/. Lengths in m, time in s, axes: {axes}.
{kept}.

"""


def write(run: xr.Dataset, path: str, request: Request) -> str:
    """Write the motion of a run into a folder; returns what was written.

    Raises
    ------
    InputError
        If the library is missing, the folder cannot be written into, or it would hold far too much.
    """
    file, group = _library()
    count = run.sizes["time"]
    samples = request.samples(count, most=MOST)
    motion: Motion = cases.system(run.attrs["system"]).motion(run).at(samples)
    if request.axes == "body":
        motion = motion.in_body()
    numbers = sum(s.points.shape[1] * (5 + len(s.values)) for s in motion.strands)
    numbers += sum(f.points.shape[1] * 9 for f in motion.forces)
    request.allow(samples.size * (8.0 * numbers + 8000.0), f"{samples.size} frames")
    suffix = f"-{run.attrs['status']}" if unfinished(run) else ""
    kinds: dict[str, Callable[[Motion, int], Grid]] = {"lines": _lines, "forces": _forces, "frames": _frames}
    if not motion.forces:
        del kinds["forces"]
    data = os.path.join(path, _FOLDER)
    make_folder(path)
    make_folder(data)
    _clear(data)
    _clear(path)
    try:
        for kind, make in kinds.items():
            collection = group(os.path.join(path, f"{kind}{suffix}"))
            for k, time in enumerate(motion.time):
                name = os.path.join(data, f"{kind}-{k:05d}.vtp")
                make(motion, k).write(file, name)
                collection.addFile(os.path.abspath(name), float(time))
            collection.save()
    except OSError as error:
        raise InputError(f"cannot write into {path!r}: {(error.strerror or str(error)).lower()}") from None
    first = motion.strands[0]
    text = _TEXT.format(
        suffix=suffix,
        lines=", ".join(s.name for s in motion.strands),
        values=", ".join(first.values),
        forces=", ".join(f.name for f in motion.forces) or "none",
        scale=f"{_scale(motion):.2g}",
        frames=", ".join(f.name for f in motion.frames),
        folder=_FOLDER,
        axes="those of the first body" if request.axes == "body" else "inertial",
        kept=kept(samples, count),
    )
    with writing(os.path.join(path, "about.txt")) as temporary:
        told = "".join(f"{what}: {words}\n" for what, words in about(run))
        pathlib.Path(temporary).write_text(f"{text}{told}\ncase:\n{run.attrs['case']}", encoding="utf-8")
    names = ", ".join(f"{kind}{suffix}.pvd" for kind in kinds)
    return f"{names} in {path}: {kept(samples, count)}, {shown_size(size_of(path))}"


def _library() -> tuple[Callable[[str], Any], Any]:
    """What begins a file of polygonal data, named without its ending .vtp, and what collects files."""
    try:
        from pyevtk.vtk import VtkFile, VtkGroup, VtkPolyData
    except ImportError:
        raise InputError("--to vtk needs the package pyevtk; pip install 'evolvent[export]' brings it") from None
    return lambda name: VtkFile(name, VtkPolyData), VtkGroup


def _scale(motion: Motion) -> float:
    """Length over force, m/N, that draws the largest force of a usual moment a quarter as long as the lines reach."""
    if not motion.forces:
        return 1.0
    sizes = np.concatenate([np.linalg.norm(f.vectors, axis=-1) for f in motion.forces], axis=1)
    largest = np.nan_to_num(sizes).max(axis=1)
    return 0.25 * motion.reach / float(np.median(largest[largest > 0.0])) if np.any(largest > 0.0) else 1.0


def _clear(folder: str) -> None:
    """Remove what an earlier export left, and nothing else."""
    for name in os.listdir(folder):
        if re.fullmatch(r"(lines|forces|frames)(-\d{5,}\.vt[up]|(-failed|-interrupted)?\.pvd)", name):
            os.unlink(os.path.join(folder, name))


# ------------------------------------------------------------------------------------------------ grids


class Grid:
    """Points, cells through them in order, and data, as they are put together: lines, or single points."""

    def __init__(self, cells: str) -> None:
        self._cells = cells
        self._points: list[np.ndarray] = []
        self._ends: list[int] = []
        self._point_data: list[dict[str, Any]] = []
        self._cell_data: list[dict[str, int]] = []
        self._count = 0

    def add(self, points: np.ndarray, point_data: Mapping[str, np.ndarray], cell_data: dict[str, int]) -> None:
        """One line through points (n, 3), or n single points."""
        n = len(points)
        self._points.append(points)
        self._point_data.append(dict(point_data))
        for size in [n] if self._cells == _LINES else [1] * n:
            self._count += size
            self._ends.append(self._count)
            self._cell_data.append(cell_data)

    def write(self, begin: Callable[[str], Any], path: str) -> None:
        """Write the file `path`, which ends in .vtp."""
        points = _columns(np.concatenate(self._points))
        cells = {
            "connectivity": np.arange(self._count, dtype=np.int64),
            "offsets": np.array(self._ends, dtype=np.int64),
        }
        names = list(dict.fromkeys(name for data in self._point_data for name in data))
        point_data = {name: self._at_points(name) for name in names}
        cell_data = {
            name: np.array([data[name] for data in self._cell_data], dtype=np.int32) for name in self._cell_data[0]
        }
        file = begin(path.removesuffix(".vtp"))
        file.openGrid()
        count = {_POINTS: "nverts", _LINES: "nlines"}[self._cells]
        file.openPiece(npoints=self._count, **{count: len(self._ends)})
        for where, data in (("Points", {"points": points}), (self._cells, cells)):
            file.openElement(where)
            for name, values in data.items():
                file.addData(name, values)
            file.closeElement(where)
        for where, data in (("Point", point_data), ("Cell", cell_data)):
            vector, scalar = (
                next((n for n, v in data.items() if isinstance(v, kind)), None) for kind in (tuple, np.ndarray)
            )
            file.openData(where, scalars=scalar, vectors=vector)
            for name, values in data.items():
                file.addData(name, values)
            file.closeData(where)
        file.closePiece()
        file.closeGrid()
        for values in (points, *cells.values(), *point_data.values(), *cell_data.values()):
            file.appendData(values)
        file.save()

    def _at_points(self, name: str) -> Any:
        """Values at all points, NaN where a line has none."""
        like = next(data[name] for data in self._point_data if name in data)
        pieces = [
            data.get(name, np.full((len(p), *like.shape[1:]), np.nan))
            for p, data in zip(self._points, self._point_data, strict=True)
        ]
        return _columns(np.concatenate(pieces))


def _columns(values: np.ndarray) -> Any:
    """Scalars as an array, vectors as a tuple of three."""
    values = np.asarray(values, dtype=float)
    if values.ndim == 1:
        return np.ascontiguousarray(values)
    return tuple(np.ascontiguousarray(values[:, c]) for c in range(3))


def _lines(motion: Motion, k: int) -> Grid:
    made = Grid(_LINES)
    for number, strand in enumerate(motion.strands, 1):
        made.add(strand.points[k], {name: v[k] for name, v in strand.values.items()}, {"line": number})
    return made


def _forces(motion: Motion, k: int) -> Grid:
    made = Grid(_POINTS)
    for number, force in enumerate(motion.forces, 1):
        data = {"force [N]": force.vectors[k], "size [N]": np.linalg.norm(force.vectors[k], axis=1)}
        made.add(force.points[k], data, {"kind": number})
    return made


def _frames(motion: Motion, k: int) -> Grid:
    made = Grid(_LINES)
    length = 0.25 * motion.reach
    for number, frame in enumerate(motion.frames, 1):
        q, origin = frame.attitude[k : k + 1], frame.origin[k]
        for axis in range(-len(frame.outline), 3):
            polygon = np.stack([np.zeros(3), length * np.eye(3)[axis]]) if axis >= 0 else frame.outline[axis]
            placed = origin + turned(q, polygon[None])[0]
            data = {
                "quaternion scalar": np.full(len(placed), q[0, 0]),
                "quaternion vector": np.repeat(q[:, 1:], len(placed), axis=0),
            }
            made.add(placed, data, {"axis": max(axis, -1), "body": number})
    return made
