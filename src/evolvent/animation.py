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
    frames = min(scene.time.size, MOST_FRAMES)
    page = _page(scene, frames)
    while len(page) > LARGEST and frames > 2:
        frames = max(2, int(0.9 * frames * LARGEST / len(page)))
        page = _page(scene, frames)
    with writing(path) as temporary:
        pathlib.Path(temporary).write_bytes(page)
    return os.fspath(path)


def _page(scene: Scene, frames: int) -> bytes:
    """The page with so many frames, evenly spread."""
    kept = np.unique(np.linspace(0, scene.time.size - 1, frames).round().astype(int))
    points, value = scene.points[kept], scene.value[kept]
    reach = float(np.nanmax(np.linalg.norm(scene.points[..., :2], axis=-1), initial=1e-9))
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
        "ring": _ring(reach),
        "origin": _rounded(scene.origin[kept]),
        "angle": _rounded(scene.angle[kept]),
        "tilt": _rounded(scene.tilt[kept]),
        "body": [_rounded(polygon) for polygon in scene.body],
        "numbers": [[name, _rounded(values[kept])] for name, values in scene.numbers.items()],
    }
    text = _TEMPLATE.read_text(encoding="utf-8")
    text = text.replace("@TITLE@", html.escape(scene.title))
    # "<" cannot close the script then
    return text.replace("@DATA@", json.dumps(data, separators=(",", ":")).replace("<", "\\u003c")).encode()


def _packed(values: np.ndarray) -> str:
    """Integers as base64 of little-endian 16-bit ones."""
    return base64.b64encode(values.astype("<i2").tobytes()).decode()


def _rounded(values: np.ndarray) -> Any:
    """Nested lists of floats with six digits; None for NaN."""
    if values.ndim > 1:
        return [_rounded(row) for row in values]
    return [float(f"{x:.7g}") if np.isfinite(x) else None for x in values]


def _ring(reach: float) -> float:
    """Distance between rings, m: 1, 2 or 5 times a power of ten, three to seven of them."""
    power = 10.0 ** np.floor(np.log10(reach))
    for factor in (0.2, 0.5, 1.0):
        if reach / (factor * power) <= 7.0:
            return float(factor * power)
    return float(2.0 * power)
