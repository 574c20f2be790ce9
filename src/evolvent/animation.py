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
