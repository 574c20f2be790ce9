"""Faults of the layout of a printed figure: texts that are cut off or cover one another, legends that cover a curve."""

from __future__ import annotations

import itertools
from typing import Any
from unittest import mock

import numpy as np
from matplotlib.text import Text

from evolvent_base import plots
from evolvent_base.figures import Figure

#: Room around a text that may be shared, pixels, and share of points that a legend may cover.
SLACK, COVERED = 2.0, 0.01


def boxes(sheet: Any) -> list[tuple[str, Any]]:
    """Words and boxes of all texts that are drawn, in pixels."""
    drawn: dict[Any, tuple[str, Any]] = {}  # a text may be drawn at several positions, as that of a tick
    original = Text.draw

    def record(self: Any, renderer: Any, *args: Any, **kwargs: Any) -> Any:
        if self.get_visible() and self.get_text().strip():
            words = self.get_text()
            drawn[self, words, self.get_position()] = words, Text.get_window_extent(self)
        return original(self, renderer, *args, **kwargs)

    with mock.patch.object(Text, "draw", record):
        sheet.draw(sheet.canvas.get_renderer())
    return [*drawn.values()]


def faults(figure: Figure) -> list[str]:
    """What is wrong with the layout of a figure, as sentences."""
    sheet = plots.sheet(figure, dpi=100.0)
    found, texts = [], boxes(sheet)
    width, height = sheet.bbox.width, sheet.bbox.height
    for words, box in texts:
        if box.x0 < -1.0 or box.y0 < -1.0 or box.x1 > width + 1.0 or box.y1 > height + 1.0:
            found.append(f"{figure.name}: {words!r} is cut off")
    for (words, a), (others, b) in itertools.combinations(texts, 2):
        wide, high = min(a.x1, b.x1) - max(a.x0, b.x0), min(a.y1, b.y1) - max(a.y0, b.y0)
        if wide > SLACK and high > SLACK:
            found.append(f"{figure.name}: {words!r} and {others!r} cover one another")
    for axes in sheet.axes:
        legend = axes.get_legend()
        if legend is None:
            continue
        box = legend.get_window_extent()
        points = [axes.transData.transform(line.get_xydata()) for line in axes.lines if len(line.get_xydata())]
        at = np.concatenate(points)
        inside = np.mean((at > [box.x0, box.y0]).all(axis=1) & (at < [box.x1, box.y1]).all(axis=1))
        if inside > COVERED:
            found.append(f"{figure.name}: a legend covers {100.0 * inside:.0f} % of the points")
    return found
