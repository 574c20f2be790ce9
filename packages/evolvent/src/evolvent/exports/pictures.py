"""Pictures of a motion, one after the other, as the HTML animation shows it."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from typing import Any

import lazy_loader as lazy
import numpy as np

from evolvent.exports.faces import Camera, Drawer, Faces, arrows, join
from evolvent.results.motion import Motion, ValueRange, name_and_unit, quantity
from evolvent.view.animation import grid_step
from evolvent_base.files import writing
from evolvent_base.style import text_width

sheets = lazy.load("evolvent_base.sheets", suppress_warning=True)

#: Size of the picture of a shape, pixels.
_SHAPE = (1200, 900)


def pictures(
    motion: Motion,
    time: np.ndarray,
    *,
    size: tuple[int, int],
    inertial: bool,
    label: str = "",
    value: str | None = None,
) -> Iterator[np.ndarray]:
    """Pictures (height, width, 4) uint8 of a motion, one at each `time`.

    Parameters
    ----------
    motion : Motion
    time : (k,) float, s
    size : (2,) int, pixels, width and height
    inertial : bool, whether inertial axes are drawn or those of the main frame
    label : str, written large where it is not empty
    value : str, label of the values that colours show (`Motion.labels`); the first one if left out
    """
    shown = motion.magnified()
    seen = shown.resampled(np.asarray(time, dtype=float)).refined()
    stage = _Stage(shown, seen if inertial else seen.in_body(), size, inertial=inertial, label=label, value=value)
    for k, t in enumerate(time):
        text = f"time  {t:.2f} s"
        for name, values in seen.numbers.items():
            what, unit = name_and_unit(name)
            text += f"\n{what}  {values[k]:.4g} {unit}".rstrip() if np.isfinite(values[k]) else ""
        yield stage.draw(k, text)


def write_shapes(motion: Motion, folder: str, *, label: str = "") -> list[str]:
    """Write a picture of the last shape for each value that surfaces have; returns the files' paths, none without them.

    Parameters
    ----------
    label : str, as of `pictures`
    """
    paths = []
    for value in dict.fromkeys(name for surface in motion.surfaces for name in surface.values):
        (picture,) = pictures(motion, motion.time[-1:], size=_SHAPE, inertial=True, label=label, value=value)
        path = os.path.join(folder, f"shape-{name_and_unit(value)[0].replace(' ', '-')}.png")
        with writing(path) as temporary:
            sheets.Image.fromarray(picture[..., :3]).save(temporary, format="png")
        paths.append(path)
    return paths


class _Stage:
    """A sheet on which what stands still is drawn once.

    Parameters
    ----------
    motion : Motion, all of it, in inertial axes: sizes and scales are taken from it
    seen : Motion, at the moments and in the axes that are drawn
    """

    def __init__(
        self, motion: Motion, seen: Motion, size: tuple[int, int], *, inertial: bool, label: str, value: str | None
    ) -> None:
        width, height = size
        font = max(7.0, height / 60.0)
        self._pixel = height / 600.0
        value = next(iter(motion.labels), None) if value is None else value
        ends = ValueRange(0.0, 1.0) if value is None else motion.value_range(value)
        colors = sheets.mpl.colormaps["viridis"]
        self._camera = Camera.of(motion if inertial else motion.in_body(), size)
        self._scales = {force.unit: motion.arrow_scale(force.unit) for force in motion.forces}
        self._drawer = Drawer(
            seen,
            self._camera,
            scales=self._scales,
            colors=colors(np.linspace(0.0, 1.0, 256))[:, :3],
            label=value,
            ends=ends,
            pixel=self._pixel,
        )
        self._seen, self._step, self._half = seen, grid_step(motion.reach), (0.5 * width, 0.5 * height)
        with sheets.mpl.rc_context({"font.size": font}):
            sheet = sheets.Figure(figsize=(width / 100.0, height / 100.0), dpi=100)
            self._canvas = sheets.FigureCanvasAgg(sheet)
            axes = sheet.add_axes((0.0, 0.0, 1.0, 1.0))
            axes.set_axis_off()
            axes.set_xlim(-0.5 * width, 0.5 * width)
            axes.set_ylim(-0.5 * height, 0.5 * height)
            self._measures(axes, font)
            if value is not None:
                bar = sheet.add_axes((0.70, 0.82 if label else 0.88, 0.22, 0.02))
                tints = sheets.mpl.cm.ScalarMappable(sheets.mpl.colors.Normalize(*ends), colors)
                sheet.colorbar(tints, cax=bar, orientation="horizontal", ticks=list(ends))
                name, unit = name_and_unit(value)
                signs = (sign if beyond else "" for sign, beyond in zip("≤≥", motion.clipped(value), strict=True))
                bar.set_xticklabels(
                    [f"{sign} {quantity(x, unit)}".lstrip() for sign, x in zip(signs, ends, strict=True)]
                )
                bar.set_title(name, fontsize=font)
            title = motion.title.removesuffix(f" - {label}") if label else motion.title
            sheet.text(0.015, 0.975, title, weight="bold", va="top", fontsize=1.2 * font)
            axis = "inertial axes" if inertial or motion.body is None else f"axes of {motion.body.name}"
            sheet.text(0.985, 0.025, axis, color="#6a7480", ha="right", va="bottom", fontsize=0.9 * font)
            if label:
                short = _shortened(label, 1.1 * font, 0.246 * width)
                sheet.text(0.015, 0.93, short, weight="bold", color="#b00020", va="top", fontsize=1.1 * font)
            still = not self._camera.follows
            self._floor = sheets.LineCollection(
                self._lattice(0) if still else [],
                colors="#e6e9ec",
                linewidths=0.7 * self._pixel,
                animated=not still,
                zorder=-1,
            )
            self._faces: Any = sheets.PolyCollection([], animated=True)
            self._faces.set_joinstyle("round")
            for collection in (self._floor, self._faces):
                axes.add_collection(collection, autolim=False)
            top = 0.87 if label else 0.92
            self._text = sheet.text(0.015, top, "", va="top", linespacing=1.4, animated=True)
            self._canvas.draw()
        self._axes, self._sheet = axes, sheet
        self._ground = self._canvas.copy_from_bbox(sheet.bbox)

    def _measures(self, axes: Any, font: float) -> None:
        """Scale bar, scale of the arrows, and directions of the axes."""
        left, row = -self._half[0] + 14.0 * self._pixel, -self._half[1] + 14.0 * self._pixel
        small: dict[str, Any] = {"fontsize": 0.9 * font, "color": "#6a7480", "va": "center"}
        ink = "#6a7480"
        length = _nice(150.0 * self._pixel / self._camera.scale)
        right, up = left + length * self._camera.scale, 4.0 * self._pixel
        axes.plot([left, left, right, right], [row + up, row, row, row + up], color=ink, linewidth=1.2 * self._pixel)
        axes.text(right + 6.0 * self._pixel, row, quantity(length, "m"), **small)
        for unit, scale in self._scales.items():
            if scale == 0.0:
                continue
            row += 20.0 * self._pixel
            size = _nice(110.0 * self._pixel / (scale * self._camera.scale))
            right = left + size * scale * self._camera.scale
            ends = np.array([[left, row]]), np.array([[right, row]])
            arrow: Any = sheets.PolyCollection([])
            _show(arrow, join(arrows(*ends, np.zeros(1), self._pixel, twice=unit == "N m")))
            axes.add_collection(arrow, autolim=False)
            axes.text(right + 6.0 * self._pixel, row, quantity(size, unit), **small)
        x, y = left + 30.0 * self._pixel, row + 34.0 * self._pixel
        for (u, v, _), name, color in zip(self._camera.axes.T, "xyz", ("#c0392b", "#2e8b57", "#2a6fbb"), strict=True):
            reach = 28.0 * self._pixel
            axes.plot([x, x + reach * u], [y, y + reach * v], color=color, linewidth=1.5 * self._pixel)
            axes.text(x + 1.3 * reach * u, y + 1.3 * reach * v, name, color=color, ha="center", va="center")

    def _lattice(self, k: int) -> list[np.ndarray]:
        """Lines of the floor, on the picture."""
        camera = self._camera.at(self._seen, k)
        up = "xyz".index(self._seen.up)
        i, j = [c for c in range(3) if c != up]
        reach = max(self._step, min(1.25 * camera.radius, 12.0 * self._step))
        step, middle = self._step, camera.target
        ends = [
            range(math.ceil((middle[c] - reach) / step), math.floor((middle[c] + reach) / step) + 1) for c in (i, j)
        ]
        found = []
        for a, b, first, second in ((i, j, ends[0], ends[1]), (j, i, ends[1], ends[0])):
            for n in first:
                points = np.zeros((2, 3))
                points[:, a], points[:, b] = n * step, [second[0] * step, second[-1] * step]
                points[:, up] = middle[up] if camera.follows else 0.0
                found.append(camera.screen(camera.view(points))[0])
        return found

    def draw(self, k: int, text: str) -> np.ndarray:
        """The picture at sample k."""
        self._canvas.restore_region(self._ground)
        if self._camera.follows:
            self._floor.set_segments(self._lattice(k))
            self._axes.draw_artist(self._floor)
        _show(self._faces, self._drawer.faces(k))
        self._text.set_text(text)
        self._axes.draw_artist(self._faces)
        if self._camera.follows:  # the floor has been drawn over them
            for artist in (*self._sheet.axes[1:], *self._axes.lines, *self._axes.texts, *self._sheet.texts):
                if artist is not self._text:
                    self._sheet.draw_artist(artist)
        self._sheet.draw_artist(self._text)
        return np.array(self._canvas.buffer_rgba())


def _show(collection: Any, faces: Faces) -> None:
    """Set the polygons of a collection; widths of lines are in points, of which there are 72 where 100 pixels are."""
    collection.set_verts(faces.corners)
    collection.set_facecolor(faces.fill)
    collection.set_edgecolor(faces.line)
    collection.set_linewidth(0.72 * faces.width)


def _shortened(text: str, size: float, width: float) -> str:
    """A text in bold letters of some size (points), cut off where it is wider than `width`, mm."""
    words = text.split()
    while len(words) > 1 and 1.15 * text_width(text, size) > width:
        words.pop()
        text = f"{' '.join(words)} ..."
    return text


def _nice(x: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is not above x."""
    power = 10.0 ** math.floor(math.log10(x))
    return next(f for f in (5.0, 2.0, 1.0) if f * power <= x * (1.0 + 1e-9)) * power
