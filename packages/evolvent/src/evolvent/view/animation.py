"""A motion as one HTML page that needs nothing else (no network, no library), and as bytes for the studio's viewer.

Both hold the same description: positions in the axes of the main frame, in which points of a spinning craft can be
interpolated, and the pose of that frame. `viewer/` draws it.
"""

from __future__ import annotations

import base64
import dataclasses
import functools
import json
import os
import pathlib
import re
from typing import TYPE_CHECKING, Any

import numpy as np
from markupsafe import Markup

from evolvent import cases
from evolvent.results import unfinished
from evolvent.results.motion import Frame, Line, Motion, name_and_unit
from evolvent.results.rotations import turns_between
from evolvent.results.solids import SECTORS, Solid
from evolvent.view.views import views
from evolvent_base import pages
from evolvent_base.errors import InputError
from evolvent_base.files import write_file

if TYPE_CHECKING:
    from markupsafe import Markup

#: Size that a page may reach, bytes; frames are left out until it fits.
LARGEST = 2_000_000
#: Most frames that a page holds.
MOST_FRAMES = 600
#: Size that a packed motion may reach, bytes.
LARGEST_PACK = 60_000_000
#: Most points of all lines in a page, and for the studio; lines are thinned evenly beyond.
MOST_POINTS, MOST_POINTS_PACKED = 1200, 4000
#: Time in which a run is shown unless a speed is asked for, s.
SHOWN = 15.0
#: The same of a period that repeats, s.
SHOWN_PERIOD = 2.0
_HERE = pathlib.Path(__file__).parent
#: The parts of the viewer, in the order in which they refer to those before.
VIEWER = tuple(_HERE / "viewer" / f"{name}.js" for name in ("motion", "picture", "viewer"))
#: Share of the reach below which a solid has fewer sectors, and number of solids above which it has still fewer.
_SMALL, _MANY = 0.02, 24


def of_run(run: Any) -> Motion | None:
    """The motion of a run, labelled if the run did not end as it should; None if it holds too little to move."""
    motion: Motion | None = cases.presenter(run).motion(run)
    return None if motion is None or motion.time.size < 2 else motion.labelled(unfinished(run))


def write(motion: Motion, path: str | os.PathLike[str]) -> str:
    """Write the page; returns its path.

    Parameters
    ----------
    motion : Motion
    path : str

    Raises
    ------
    InputError
        If the file cannot be written, or its name does not end with .html.
    """
    if not os.fspath(path).lower().endswith((".html", ".htm")):
        raise InputError(
            f"cannot write {os.fspath(path)!r}: an animation is a page, whose file ends with .html; "
            f"`evolvent export RUN.NC --to gif` or mp4 writes films"
        )
    write_file(path, page(motion)[0])
    return os.fspath(path)


def page(
    motion: Motion, *, frames: int = MOST_FRAMES, speed: float | None = None, playing: bool = False
) -> tuple[bytes, int]:
    """The page, and the number of frames that it holds: at most `frames`, and no more than `LARGEST` bytes hold.

    Parameters
    ----------
    motion : Motion
    frames : int
    speed : float, optional
        Time of the run over time of the clock at the start; left out, what shows the run in `SHOWN` seconds.
    playing : bool, whether it plays when it is opened, once unless it repeats; else it shows the first frame until
        the button or the space bar starts it

    Notes
    -----
    Positions and values are kept as 16-bit integers, to 1 / 32767 of the largest of a line.
    """
    frames = min(motion.time.size, frames)
    made = _page(motion, frames, speed, playing)
    while len(made) > LARGEST and frames > 2:
        frames = max(2, int(0.95 * frames * LARGEST / len(made)))
        made = _page(motion, frames, speed, playing)
    return made, frames


def pack(motion: Motion, *, most: int = 4000) -> bytes:
    """A motion as bytes, for the viewer of the studio: all frames at once, in full single precision.

    Parameters
    ----------
    motion : Motion
    most : int, of frames; more are thinned evenly, as are those that would make it larger than `LARGEST_PACK`

    Returns
    -------
    bytes
        Length of the header (uint32), the header (JSON, padded with blanks to a multiple of 4 bytes), then the blocks
        that it lists under "blocks" (name, shape and type), little-endian, in that order.
    """
    points = sum(line.points.shape[1] for line in motion.lines)
    numbers = sum(
        line.points.shape[1] * (3 + 3 * (line.across is not None) + len(line.values)) for line in motion.lines
    ) * min(1.0, MOST_POINTS_PACKED / max(points, 1))
    surfaces = motion.at(np.zeros(1, dtype=int)).refined().surfaces
    numbers += sum(6 * x.points.shape[1] + len(x.values) * len(x.faces) // x.each for x in surfaces)
    numbers += (
        sum(2 * force.points[0].size for force in motion.forces) + 20 * (len(motion.frames) + len(motion.symbols)) + 1
    )
    header, blocks = described(motion, min(most, int(LARGEST_PACK / (4 * numbers))), points=MOST_POINTS_PACKED)
    exact = {
        name: np.ascontiguousarray(values, dtype="<f8" if name in _EXACT else "<f4") for name, values in blocks.items()
    }
    header["blocks"] = [
        {"name": name, "shape": values.shape, "type": values.dtype.str[1:]} for name, values in exact.items()
    ]
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    return b"".join([len(text).to_bytes(4, "little"), text, *(values.tobytes() for values in exact.values())])


def thinned(motion: Motion, most: int) -> Motion:
    """The motion with at most about `most` points in its lines, evenly spread, the ends of each kept."""
    total = sum(line.points.shape[1] for line in motion.lines)
    if total <= most:
        return motion

    def thin(line: Line) -> Line:
        n = line.points.shape[1]
        kept = np.unique(np.linspace(0, n - 1, max(round(n * most / total), 5)).round().astype(int))
        tip = None if line.tip is None else int(np.argmin(np.abs(kept - line.tip % n)))
        return dataclasses.replace(
            line,
            points=line.points[:, kept],
            values={label: values[:, kept] for label, values in line.values.items()},
            across=None if line.across is None else line.across[:, kept],
            tip=tip,
        )

    return dataclasses.replace(motion, lines=[thin(line) for line in motion.lines])


def default_speed(motion: Motion) -> float:
    """Time of the run over time of the clock that shows the run in `SHOWN` seconds, or a period in `SHOWN_PERIOD`."""
    span = float(motion.time[-1] - motion.time[0])
    return float(f"{span / (SHOWN_PERIOD if motion.repeats else SHOWN):.3g}") if span > 0.0 else 1.0


#: Beginnings of the names of blocks that a page keeps as 16-bit integers.
_SHORT = ("line", "value", "surface", "tint", "mark", "force")
#: Blocks in double precision: a time or a position may be large beside its changes.
_EXACT = ("time", "origin")


def described(motion: Motion, most: int, *, points: int) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """What a viewer draws: names, sizes and scales, and arrays by name with one row a frame.

    Parameters
    ----------
    motion : Motion
    most : int, of frames, evenly spread
    points : int, most of all lines

    Notes
    -----
    Scales of colours and arrows are those of all samples and points, whatever is left out.
    """
    factor, motion = motion.magnification, motion.magnified()
    count, body = motion.time.size, motion.body
    kept = np.unique(np.linspace(0, count - 1, min(count, max(2, most))).round().astype(int))
    seen = thinned(motion.in_body(), points)
    small = seen.at(kept).refined()
    ranges = {label: motion.value_range(label) for label in motion.labels}
    header: dict[str, Any] = {
        "title": motion.title,
        "magnification": factor,
        "up": motion.up,
        "main": None if body is None else body.name,
        "views": [view._asdict() for view in views(motion)],
        "speed": default_speed(motion),
        "repeats": motion.repeats,
        "grid": grid_step(motion.reach),
        "colors": [
            dict(
                zip(
                    ("name", "unit", "low", "high", "below", "above"),
                    (*name_and_unit(label), *ends, *motion.clipped(label)),
                    strict=True,
                )
            )
            for label, ends in ranges.items()
        ],
        "numbers": [name_and_unit(label) for label in motion.numbers],
        "lines": [],
        "surfaces": [],
        "frames": [],
        "meshes": [],
        "marks": [],
        "forces": [],
        "symbols": [],
    }
    blocks = {"time": small.time, **{f"number {k}": v for k, v in enumerate(small.numbers.values())}}
    if body is not None:
        blocks |= {"origin": body.origin[kept], "attitude": body.attitude[kept]}
        blocks["turn"] = turns_between(body.attitude, kept)
    for k, line in enumerate(small.lines):
        color = {motion.labels.index(label): f"value {k} {label}" for label in line.values}
        header["lines"].append(
            {
                "name": line.name,
                "kind": line.kind,
                "count": line.points.shape[1],
                "width": line.width,
                "strip": line.across is not None,
                "tip": line.tip if line.tip is None else line.tip % line.points.shape[1],
                "values": color,
            }
        )
        blocks[f"line {k}"] = line.points
        if line.across is not None:
            blocks[f"across {k}"] = line.across
        blocks |= {f"value {k} {label}": values for label, values in line.values.items()}
    _describe_surfaces(small, header, blocks)
    _describe_frames(seen, kept, header, blocks)
    for k, mark in enumerate(small.marks):
        header["marks"].append({"name": mark.name, "count": mark.points.shape[1], "size": mark.size})
        blocks[f"mark {k}"] = mark.points
    for k, force in enumerate(small.forces):
        scale = motion.arrow_scale(force.unit)
        header["forces"].append(
            {"name": force.name, "count": force.points.shape[1], "unit": force.unit, "scale": scale}
        )
        blocks |= {f"force {k} at": force.points, f"force {k}": force.vectors * scale}
    return header, blocks


def _describe_surfaces(small: Motion, header: dict[str, Any], blocks: dict[str, np.ndarray]) -> None:
    """Surfaces, with the colours by which they are known to the header."""
    for k, surface in enumerate(small.surfaces):
        header["surfaces"].append(
            {
                "name": surface.name,
                "count": surface.points.shape[1],
                "thickness": surface.thickness,
                "faces": surface.faces.ravel().tolist(),
                "each": surface.each,
                "rim": surface.rim.ravel().tolist(),
                "values": {small.labels.index(label): f"tint {k} {label}" for label in surface.values},
            }
        )
        blocks |= {f"surface {k}": surface.points, f"normal {k}": surface.normals}
        blocks |= {f"tint {k} {label}": values for label, values in surface.values.items()}


def _describe_frames(seen: Motion, kept: np.ndarray, header: dict[str, Any], blocks: dict[str, np.ndarray]) -> None:
    """Frames and symbols with their outlines and solids; each mesh once."""
    meshes: dict[tuple[Any, ...], int] = {}
    reach = seen.reach

    coarse = 3 if sum(len(frame.solids) for frame in seen.frames) > _MANY else 2

    def mesh_of(solid: Solid) -> int:
        sectors = SECTORS if solid.size > _SMALL * reach else SECTORS // coarse
        key = (solid.edges, solid.profile, sectors, solid.turned is None)
        if key not in meshes:
            meshes[key] = len(meshes)
            mesh = solid.mesh(sectors=sectors)
            dark = mesh.dark if solid.turned is not None else np.zeros_like(mesh.dark)
            header["meshes"].append(
                {"vertices": _rounded(mesh.vertices.ravel()), "faces": mesh.faces.ravel().tolist(),
                 "dark": dark.astype(int).tolist()}
            )  # fmt: skip
        return meshes[key]

    both = [("frame", frame) for frame in seen.frames] + [("symbol", frame) for frame in seen.symbols]
    for number, (what, frame) in enumerate(both):
        k = number if what == "frame" else number - len(seen.frames)
        solids = []
        for j, solid in enumerate(frame.solids):
            solids.append(
                {
                    "mesh": mesh_of(solid),
                    "centre": solid.centre,
                    "basis": _rounded(solid.basis.ravel()),
                    "size": solid.size,
                    "turned": solid.turned is not None,
                    "scaled": solid.scale is not None,
                }
            )
            if solid.turned is not None:
                blocks[f"{what} {k} turned {j}"] = solid.turned[kept]
            if solid.scale is not None:
                blocks[f"{what} {k} scaled {j}"] = solid.scale[kept]
        if frame.marked is not None:
            blocks[f"{what} {k} marked"] = frame.marked[kept]
        if frame.shown is not None:
            blocks[f"{what} {k} shown"] = frame.shown[kept].astype(float)
        still = _is_still(frame)
        header[f"{what}s"].append(
            {
                "name": frame.name,
                "lift": frame.lift,
                "outline": [_rounded(polyline.ravel()) for polyline in frame.outline],
                "solids": solids,
                "still": still,
            }
        )
        if not still:
            blocks |= {f"{what} {k} origin": frame.origin[kept], f"{what} {k} attitude": frame.attitude[kept]}
            blocks[f"{what} {k} turn"] = turns_between(frame.attitude, kept)


def _is_still(frame: Frame) -> bool:
    """Whether a frame is at rest in the main one, and coincides with it."""
    return bool(np.abs(frame.origin).max() < 1e-12 and np.abs(np.abs(frame.attitude[:, 0]) - 1.0).max() < 1e-15)


# ------------------------------------------------------------------------------------------------ the page


def _page(motion: Motion, frames: int, speed: float | None, playing: bool) -> bytes:
    """The page with so many frames."""
    header, blocks = described(motion, frames, points=MOST_POINTS)
    header |= {"speed": speed or header["speed"], "playing": playing}
    header["blocks"] = [_encoded(name, values) for name, values in blocks.items()]
    return pages.render("animation.html", title=header["title"], data=header, viewer=_viewer()).encode()


@functools.cache
def _viewer() -> Markup:
    """The viewer as one script, in which nothing is imported or exported."""
    script = "".join(path.read_text(encoding="utf-8") for path in VIEWER)
    return Markup(re.sub(r"^import .*\n|^export ", "", script, flags=re.MULTILINE))


def _encoded(name: str, values: np.ndarray) -> dict[str, Any]:
    """An array as base64 of integers with a scale where that is exact enough, else of floats."""
    found: dict[str, Any] = {"name": name, "shape": values.shape}
    bits = 8 if name.startswith(("across", "normal")) else 16 if name.startswith(_SHORT) else 0
    if not bits:
        kind = "f8" if name in _EXACT else "f4"
        return found | {"type": kind, "data": base64.b64encode(values.astype(f"<{kind}").tobytes()).decode()}
    most = 2 ** (bits - 1) - 1
    finite = np.isfinite(values)
    largest = float(np.abs(values[finite]).max(initial=0.0)) or 1.0
    # the least integer is a value that is missing
    whole = np.where(finite, np.round(np.where(finite, values, 0.0) / largest * most), -most - 1)
    kind = f"i{bits // 8}"
    data = base64.b64encode(whole.astype(f"<{kind}").tobytes()).decode()
    return found | {"type": kind, "scale": largest / most, "data": data}


def _rounded(values: np.ndarray) -> list[float]:
    """Floats with six digits, whole ones without a point."""
    return [int(x) if x == int(x) else float(f"{x:.6g}") for x in values.tolist()]


def grid_step(reach: float) -> float:
    """Distance between lines of the floor, m: 1, 2 or 5 times a power of ten, three to seven of them in a reach."""
    power = 10.0 ** np.floor(np.log10(reach))
    for factor in (0.2, 0.5, 1.0):
        if reach / (factor * power) <= 7.0:
            return float(factor * power)
    return float(2.0 * power)
