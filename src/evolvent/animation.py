"""A 3-D animation as one HTML page that needs nothing else: no network, no library."""

from __future__ import annotations

import base64
import html
import json
import os
import pathlib
from typing import Any

import numpy as np

from evolvent.figures import Scene
from evolvent.results import writing

#: Size that a page may reach, bytes; frames are left out until it fits.
LARGEST = 2_000_000
#: Most frames that a page holds.
MOST_FRAMES = 600
#: Size that the points of a packed scene may reach, bytes.
LARGEST_PACK = 60_000_000
_TEMPLATE = pathlib.Path(__file__).with_name("animation.html")
#: Where the scene is seen from at first, radians, and from how far, over its reach.
AZIMUTH, ELEVATION, FAR = -1.1, 0.6, 6.0
_NONE = -32768  # a value that is missing


def write(scene: Scene, path: str | os.PathLike[str]) -> str:
    """Write the page; returns its path.

    Parameters
    ----------
    scene : Scene
    path : str

    Raises
    ------
    InputError
        If the file cannot be written.

    Notes
    -----
    Positions are kept as 16-bit integers, to 1 / 32767 of the farthest point.
    """
    with writing(path) as temporary:
        pathlib.Path(temporary).write_bytes(page(scene)[0])
    return os.fspath(path)


def page(
    scene: Scene, *, frames: int = MOST_FRAMES, speed: float | None = None, playing: bool = True
) -> tuple[bytes, int]:
    """The page, and the number of frames that it holds: at most `frames`, and no more than `LARGEST` bytes hold.

    Parameters
    ----------
    scene : Scene
    frames : int
    speed : float, optional
        Time of the run over time of the clock at the start; left out, what shows the run in about 25 s.
    playing : bool, whether it moves at once
    """
    frames = min(scene.time.size, frames)
    made = _page(scene, frames, speed, playing)
    while len(made) > LARGEST and frames > 2:
        frames = max(2, int(0.9 * frames * LARGEST / len(made)))
        made = _page(scene, frames, speed, playing)
    return made, frames


def _page(scene: Scene, frames: int, speed: float | None, playing: bool) -> bytes:
    """The page with so many frames, evenly spread."""
    kept = np.unique(np.linspace(0, scene.time.size - 1, frames).round().astype(int))
    points, value = scene.points[kept], scene.value[kept]
    reach, wide, tall = extent(scene)
    farthest = float(np.abs(points).max(initial=1e-9))
    finite = value[np.isfinite(value)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    low = min(low, 0.0)
    largest = max(abs(low), abs(high), 1e-300)
    whole = np.where(np.isfinite(value), np.round(np.nan_to_num(value) / largest * 32767), _NONE)
    data: dict[str, Any] = {
        "shape": [int(n) for n in points.shape[:3]],
        "time": _rounded(scene.time[kept]),
        "points": _packed(np.round(points / farthest * 32767)),
        "unit": farthest / 32767,
        "values": _packed(whole),
        "value_unit": largest / 32767,
        "value_label": scene.value_label,
        "low": low,
        "high": high,
        "reach": reach,
        "wide": wide,
        "tall": tall,
        "ring": ring(reach),
        "origin": _rounded(scene.origin[kept]),
        "angle": _rounded(scene.angle[kept]),
        "tilt": _rounded(scene.tilt[kept]),
        "body": [_rounded(polygon) for polygon in scene.body],
        "numbers": [[name, _rounded(values[kept])] for name, values in scene.numbers.items()],
        "speed": speed,
        "playing": playing,
    }
    text = _TEMPLATE.read_text(encoding="utf-8")
    text = text.replace("@TITLE@", html.escape(scene.title))
    # "<" cannot close the script then
    return text.replace("@DATA@", json.dumps(data, separators=(",", ":")).replace("<", "\\u003c")).encode()


def seen(points: np.ndarray, reach: float) -> np.ndarray:
    """Places (..., 2) of points (..., 3) on a picture, in perspective; at the origin it has the scale 1."""
    ca, sa, ce, se = np.cos(AZIMUTH), np.sin(AZIMUTH), np.cos(ELEVATION), np.sin(ELEVATION)
    x = points[..., 0] * ca + points[..., 1] * sa
    y = -points[..., 0] * sa + points[..., 1] * ca
    far = FAR * reach
    size = far / (far + y * ce - points[..., 2] * se)
    return np.stack([size * x, size * (y * se + points[..., 2] * ce)], axis=-1)


def extent(scene: Scene) -> tuple[float, float, float]:
    """Reach of a scene from its axis, and half the width and height of what is seen of it at first, m."""
    reach = float(np.nanmax(np.linalg.norm(scene.points[..., :2], axis=-1), initial=1e-9))
    around = np.linspace(0.0, 2.0 * np.pi, 73)
    circle = reach * np.stack([np.cos(around), np.sin(around), np.zeros_like(around)], axis=1)
    every = [circle, scene.points.reshape(-1, 3), *scene.body]
    sizes = np.max([np.nanmax(np.abs(seen(points, reach)), axis=0) for points in every], axis=0)
    return reach, float(sizes[0]), float(sizes[1])


def pack(scene: Scene, *, most: int = 4000) -> bytes:
    """A scene as bytes, for a program that draws it: all key frames at once.

    Parameters
    ----------
    most : int, of frames; more are thinned evenly, as are those that would make the points larger than `LARGEST_PACK`

    Returns
    -------
    bytes
        Length of the header (uint32), the header (JSON, padded with blanks to a multiple of 4 bytes), then the blocks
        that it lists under "blocks" (name and shape of float32), little-endian, in that order.
    """
    count = scene.time.size
    most = max(2, min(most, LARGEST_PACK // (4 * max(scene.points[0].size, 1))))
    kept = np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(int))
    colors = {scene.value_label: scene.value, **scene.others}
    arrays = {
        "time": scene.time,
        "points": scene.points,
        "origin": scene.origin,
        "angle": scene.angle,
        "tilt": scene.tilt,
        **{f"color {k}": values for k, values in enumerate(colors.values())},
        **{f"number {k}": values for k, values in enumerate(scene.numbers.values())},
    }
    arrays |= {f"turned {k}": s.turned for k, s in enumerate(scene.solids) if s.turned is not None}
    if scene.arrows is not None:
        arrays |= {"at": scene.arrows.at, "force": scene.arrows.force}
    blocks = {name: np.ascontiguousarray(values[kept], dtype="<f4") for name, values in arrays.items()}
    reach = float(np.nanmax(np.linalg.norm(scene.points[..., :2], axis=-1), initial=1e-9))
    header: dict[str, Any] = {
        "title": scene.title,
        "reach": reach,
        "ring": ring(reach),
        "colors": [{"label": name, **_range(values[kept])} for name, values in colors.items()],
        "numbers": list(scene.numbers),
        "coils": scene.coils,
        "body": [_rounded(polygon) for polygon in scene.body],
        "solids": [{"kind": s.kind, "centre": s.centre, "size": s.size, "axis": s.axis} for s in scene.solids],
        "arrows": None,
        "blocks": [{"name": name, "shape": values.shape} for name, values in blocks.items()],
    }
    if scene.arrows is not None:
        largest = float(np.nanmax(np.linalg.norm(blocks["force"], axis=-1), initial=0.0))
        header["arrows"] = {"label": scene.arrows.label, "longest": scene.arrows.longest, "largest": largest}
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    return b"".join([len(text).to_bytes(4, "little"), text, *(values.tobytes() for values in blocks.values())])


def _range(values: np.ndarray) -> dict[str, float]:
    """Ends of the scale of a color; single large values are beyond it."""
    finite = values[np.isfinite(values)]
    if not finite.size:
        return {"low": 0.0, "high": 1.0}
    low, high = (float(x) for x in np.percentile(finite, (0.2, 99.8)))
    low = min(low, 0.0) if low < 0.5 * high else low
    return {"low": low, "high": high if high > low else low + 1.0}


def _packed(values: np.ndarray) -> str:
    """Integers as base64 of little-endian 16-bit ones."""
    return base64.b64encode(values.astype("<i2").tobytes()).decode()


def _rounded(values: np.ndarray) -> Any:
    """Nested lists of floats with six digits; None for NaN."""
    if values.ndim > 1:
        return [_rounded(row) for row in values]
    return [float(f"{x:.7g}") if np.isfinite(x) else None for x in values]


def ring(reach: float) -> float:
    """Distance between rings, m: 1, 2 or 5 times a power of ten, three to seven of them."""
    power = 10.0 ** np.floor(np.log10(reach))
    for factor in (0.2, 0.5, 1.0):
        if reach / (factor * power) <= 7.0:
            return float(factor * power)
    return float(2.0 * power)
