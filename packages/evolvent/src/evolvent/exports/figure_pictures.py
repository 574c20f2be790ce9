"""Figures as images inside a page."""

from __future__ import annotations

import os
import pathlib
from collections.abc import Sequence
from typing import TYPE_CHECKING

from evolvent_base import pages, plots

if TYPE_CHECKING:
    from evolvent_base.figures import Figure

#: Largest figure that is kept as lines; a larger one is kept as points, bytes.
_LARGEST_SVG = 250_000


def figure_pictures(figures: Sequence[Figure], written: Sequence[str] = ()) -> list[pages.Picture]:
    """Figures as images in the page, those that were `written` as PNG or SVG files as these files are."""
    kinds = {".png": "png", ".svg": "svg+xml"}
    files = {os.path.basename(path): path for path in written}
    found = []
    for figure in figures:
        for ending, kind in kinds.items():
            if (path := files.get(figure.name + ending)) is not None:
                found.append(pages.picture(pathlib.Path(path).read_bytes(), kind, figure.title, titled=True))
                break
        else:
            found.append(figure_picture(figure))
    return found


def figure_picture(figure: Figure) -> pages.Picture:
    """A figure as an image in the page, whose text is its title."""
    content, kind = plots.picture(figure, "svg", title=False), "svg+xml"
    if len(content) > _LARGEST_SVG:
        points = plots.picture(figure, "png", dpi=150, title=False)
        content, kind = (points, "png") if len(points) < len(content) else (content, kind)
    return pages.picture(content, kind, figure.title)
