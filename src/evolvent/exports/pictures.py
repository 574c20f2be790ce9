"""Pictures of a moving scene, one after the other, as the HTML animation draws it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent.animation import extent, ring, seen
from evolvent.figures import Scene
from evolvent.motion import about_z, product, turned


def at(scene: Scene, time: np.ndarray) -> dict[str, np.ndarray]:
    """What is drawn, linear between samples, at each `time`: points, value, origin, attitude and numbers."""
    high = np.clip(np.searchsorted(scene.time, time, side="right"), 1, scene.time.size - 1)
    low = high - 1
    share = np.clip((time - scene.time[low]) / (scene.time[high] - scene.time[low]), 0.0, 1.0)

    def mixed(values: np.ndarray) -> np.ndarray:
        f = share.reshape(-1, *[1] * (values.ndim - 1))
        return np.where(
            f == 0.0, values[low], np.where(f == 1.0, values[high], (1 - f) * values[low] + f * values[high])
        )

    tilt = mixed(scene.tilt)
    tilt = tilt / np.linalg.norm(tilt, axis=1, keepdims=True)
    found = {name: mixed(values) for name, values in scene.numbers.items()}
    return {
        "points": mixed(scene.points),
        "value": scene.value[np.where(share < 1.0, low, high)],
        "origin": mixed(scene.origin),
        "attitude": product(about_z(mixed(scene.angle)), tilt),
        **{f"number {name}": values for name, values in found.items()},
    }


def pictures(
    scene: Scene, time: np.ndarray, *, size: tuple[int, int], inertial: bool, label: str
) -> Iterator[np.ndarray]:
    """Pictures (height, width, 4) uint8 of a scene, one at each `time`.

    Parameters
    ----------
    scene : Scene
    time : (k,) float, s
    size : (2,) int, pixels, width and height
    inertial : bool, whether inertial axes are drawn or those of the body
    label : str, written large where it is not empty
    """
    drawn = at(scene, time)
    stage = _Stage(scene, size, label)
    still = np.array([[1.0, 0.0, 0.0, 0.0]])
    for k, t in enumerate(time):
        q = drawn["attitude"][k : k + 1] if inertial else still
        origin = drawn["origin"][k] if inertial else np.zeros(3)
        lines = np.stack([origin + turned(q, line[None])[0] for line in drawn["points"][k]])
        body = [origin + turned(q, polygon[None])[0] for polygon in scene.body]
        text = f"time  {t:.2f} s"
        for name in scene.numbers:
            value = drawn[f"number {name}"][k]
            text += f"\n{name}  {value:.4g}" if np.isfinite(value) else ""
        yield stage.draw(lines, drawn["value"][k], body, text)


class _Stage:
    """A sheet on which what stands still is drawn once."""

    def __init__(self, scene: Scene, size: tuple[int, int], label: str) -> None:
        import matplotlib as mpl
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.collections import LineCollection
        from matplotlib.figure import Figure

        width, height = size
        font = max(7.0, height / 60.0)
        with mpl.rc_context({"font.size": font}):
            sheet = Figure(figsize=(width / 100.0, height / 100.0), dpi=100)
            self._canvas = FigureCanvasAgg(sheet)
            axes = sheet.add_axes((0.0, 0.0, 1.0, 1.0))
            axes.set_axis_off()
            axes.set_xlim(-0.5 * width, 0.5 * width)
            axes.set_ylim(-0.5 * height, 0.5 * height)
            self._reach, wide, tall = extent(scene)
            self._scale = min(0.47 * width / wide, 0.46 * height / tall)
            self._floor(axes, LineCollection, font)
            finite = scene.value[np.isfinite(scene.value)]
            low, high = (min(float(finite.min()), 0.0), float(finite.max())) if finite.size else (0.0, 1.0)
            colors = mpl.colormaps["viridis"].with_extremes(bad="#bbbbbb")
            norm = mpl.colors.Normalize(low, high if high > low else low + 1.0)
            if finite.size:
                bar = sheet.add_axes((0.74, 0.88, 0.22, 0.02))
                sheet.colorbar(
                    mpl.cm.ScalarMappable(norm, colors), cax=bar, orientation="horizontal", ticks=[low, high]
                )
                bar.set_xticklabels([f"{low:.3g}", f"{high:.3g}"])
                bar.set_title(scene.value_label, fontsize=font)
            title = scene.title.removesuffix(f" - {label}") if label else scene.title
            sheet.text(0.015, 0.975, title, weight="bold", va="top", fontsize=1.2 * font)
            if label:
                short = label if len(label) <= 90 else label[:87] + "..."
                sheet.text(0.015, 0.025, short, weight="bold", color="#b00020", va="bottom", fontsize=1.1 * font)
            self._body = LineCollection([], colors="#222222", linewidths=1.4, animated=True)
            self._lines = LineCollection([], cmap=colors, norm=norm, linewidths=2.2, capstyle="round", animated=True)
            self._roots = axes.plot([], [], "o", color="#222222", markersize=0.4 * font, animated=True)[0]
            for collection in (self._body, self._lines):
                axes.add_collection(collection, autolim=False)
            self._text = sheet.text(0.015, 0.92, "", va="top", linespacing=1.4, animated=True)
            self._canvas.draw()
        self._axes, self._sheet = axes, sheet
        self._ground = self._canvas.copy_from_bbox(sheet.bbox)

    def _floor(self, axes: Any, collection: Any, font: float) -> None:
        """Rings in the plane z = 0, and axes."""
        around = np.linspace(0.0, 2.0 * np.pi, 73)
        step = ring(self._reach)
        rings = [step * (i + 1) for i in range(math.floor(self._reach * 1.001 / step))]
        circles = [np.stack([r * np.cos(around), r * np.sin(around), 0.0 * around], axis=1) for r in rings]
        axes.add_collection(collection([self._seen(c) for c in circles], colors="#e4e4e4", linewidths=0.8))
        for r in rings:
            x, y = self._seen(np.array([[r, 0.0, 0.0]]))[0]
            axes.text(x + 3, y + 3, f"{r:.3g} m", color="#888888", fontsize=0.85 * font)
        for axis, name in zip(0.25 * self._reach * np.eye(3), "xyz", strict=True):
            ends = self._seen(np.stack([np.zeros(3), axis]))
            axes.plot(*ends.T, color="#aaaaaa", linewidth=0.8)
            axes.text(*(ends[1] + (4, 0)), name, color="#888888", fontsize=0.85 * font)

    def _seen(self, points: np.ndarray) -> np.ndarray:
        """Places (..., 2) on the sheet, pixels from its middle."""
        return self._scale * seen(points, self._reach)

    def draw(self, lines: np.ndarray, value: np.ndarray, body: list[np.ndarray], text: str) -> np.ndarray:
        """One picture."""
        self._canvas.restore_region(self._ground)
        at = self._seen(lines)
        self._lines.set_segments(list(np.stack([at[:, :-1], at[:, 1:]], axis=2).reshape(-1, 2, 2)))
        self._lines.set_array(np.ma.masked_invalid(value.ravel()))
        self._body.set_segments([self._seen(polygon) for polygon in body])
        self._roots.set_data(*at[:, 0].T)
        self._text.set_text(text)
        for artist in (self._body, self._lines, self._roots):
            self._axes.draw_artist(artist)
        self._sheet.draw_artist(self._text)
        return np.array(self._canvas.buffer_rgba())
