"""Figures as images inside a page."""

from __future__ import annotations

from typing import TYPE_CHECKING

from evolvent.view import pages, plots

if TYPE_CHECKING:
    from evolvent.results.figures import Figure

#: Largest figure that is kept as lines; a larger one is kept as points, bytes.
_LARGEST_SVG = 250_000


def figure_picture(figure: Figure) -> pages.Picture:
    """A figure as an image in the page, whose text is its title."""
    content, kind = plots.picture(figure, "svg", title=False), "svg+xml"
    if len(content) > _LARGEST_SVG:
        points = plots.picture(figure, "png", dpi=150, title=False)
        content, kind = (points, "png") if len(points) < len(content) else (content, kind)
    return pages.picture(content, kind, figure.title)
