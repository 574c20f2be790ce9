"""Draw the figures that a system describes, as PNG files."""

from __future__ import annotations

import io
import os
import pathlib
import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np

from evolvent import progress
from evolvent.errors import InputError
from evolvent.figures import Figure, Line, Map, Note, Panel
from evolvent.results import make_folder, writing

#: Okabe and Ito's palette, told apart with any kind of colour vision; black leads.
PALETTE = ("#000000", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
_STYLE: Any = {
    "axes.grid": True,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": 10,
    "font.size": 10,
    "grid.alpha": 0.25,
    "legend.edgecolor": "none",
    "legend.framealpha": 0.8,
    "legend.fontsize": 9,
}


def draw(figures: Sequence[Figure], folder: str | os.PathLike[str], *, label: str = "") -> list[str]:
    """Write every figure into `folder`, with `label` written large below it; returns the files' paths.

    Raises
    ------
    InputError
        If the folder cannot be written into.
    """
    make_folder(folder)
    paths = []
    for figure in progress.track(figures, "drawing figures"):
        path = os.path.join(os.fspath(folder), f"{figure.name}.png")
        with writing(path) as temporary:
            pathlib.Path(temporary).write_bytes(picture(figure, "png", label=label))
        paths.append(path)
    return paths


def save(figure: Figure, path: str | os.PathLike[str], *, label: str = "") -> str:
    """Write one figure as the file `path`: PNG, or SVG or PDF by its suffix; returns the path.

    Raises
    ------
    InputError
        If the file cannot be written, or its kind is not known.
    """
    kind = os.path.splitext(os.fspath(path))[1].lstrip(".").lower()
    if kind not in ("png", "svg", "pdf"):
        raise InputError(f"cannot write {os.fspath(path)!r}: a figure's file ends with .png, .svg or .pdf")
    with writing(path) as temporary:
        pathlib.Path(temporary).write_bytes(picture(figure, kind, label=label))
    return os.fspath(path)


def sheet(figure: Figure, *, dpi: float = 130.0, title: bool = True, label: str = "") -> Any:
    """A figure as one of matplotlib's, with a canvas of its own; `label` stands in large letters below it."""
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as Sheet

    with mpl.rc_context(_STYLE):
        found = Sheet(figsize=figure.size, layout="constrained", dpi=dpi)
        FigureCanvasAgg(found)
        if title:
            found.suptitle(figure.title, x=0.01, ha="left", fontsize=12, fontweight="bold")
        rows = -(-len(figure.panels) // figure.columns)
        axes = found.subplots(rows, figure.columns, squeeze=False, height_ratios=figure.heights)
        for axis, panel in zip(axes.ravel(), figure.panels, strict=False):
            _panel(axis, panel)
        if label:
            wide = int(11 * figure.size[0])  # letters that a line holds
            text = "\n".join(textwrap.wrap(label, wide))
            found.supxlabel(text, x=0.01, ha="left", color="#b00020", fontsize=10, fontweight="bold")
    return found


def picture(figure: Figure, kind: str, *, dpi: float = 130.0, title: bool = True, label: str = "") -> bytes:
    """A figure as the content of a file of some `kind` ("png", "svg"); the same figure gives the same bytes."""
    import matplotlib as mpl

    found = sheet(figure, dpi=dpi, title=title, label=label)
    content = io.BytesIO()
    with mpl.rc_context(_STYLE | {"svg.hashsalt": "evolvent"}):
        if kind == "png":
            found.canvas.print_png(content)  # savefig would draw twice, once for the layout alone
        else:
            found.savefig(content, format=kind, dpi=dpi, metadata={"Date": None} if kind == "svg" else None)
    return content.getvalue()


def _panel(axis: Any, panel: Panel) -> None:
    if panel.map is not None:
        _map(axis, panel.map)
    for line in panel.lines:
        axis.plot(
            line.x,
            line.y,
            linestyle=line.style or "none",
            color=_color(line),
            label=line.label or None,
            marker=line.marker or None,
            markersize=3.0,
            linewidth=line.width,
        )
    for note in panel.notes:
        _note(axis, note)
    axis.set_xlabel(panel.x_label)
    axis.set_ylabel(panel.y_label)
    if panel.x_names is not None:
        axis.set_xticks(list(panel.x_names), list(panel.x_names.values()))
    if panel.y_names is not None:
        axis.set_yticks(list(panel.y_names), list(panel.y_names.values()))
    axis.set_title(panel.title)
    if panel.equal:
        axis.set_aspect("equal", adjustable="datalim")
    if panel.log:
        axis.set_yscale("log")
    if panel.log_x:
        axis.set_xscale("log")
    if panel.y_zero and panel.lines:
        values = np.concatenate([np.ravel(line.y) for line in panel.lines])
        values = values[np.isfinite(values)]
        if values.size and values.min() >= 0.0 and values.max() > 0.0:
            axis.set_ylim(0.0, 1.05 * values.max())
    if not panel.axes:
        axis.set_axis_off()
    labelled = sum(bool(line.label) for line in panel.lines)
    if labelled:
        outside = (
            {"loc": "upper left", "bbox_to_anchor": (1.0, 1.0)}
            if labelled > 6 or panel.legend_outside
            else {"loc": "best"}
        )
        axis.legend(**outside)


def _note(axis: Any, note: Note) -> None:
    """Write a note, with its arrow."""
    middle = {"ha": "center", "va": "center"}
    if note.points_to is None:
        axis.text(*note.at, note.text, **middle)
    else:
        arrow = {"arrowstyle": "->", "linewidth": 0.8}
        axis.annotate(note.text, xy=note.points_to, xytext=note.at, arrowprops=arrow, **middle)


def _map(axis: Any, drawn: Map) -> None:
    """Draw a map with its colour bar and contour lines."""
    from matplotlib.colors import LogNorm, Normalize

    low, high = drawn.limits or (None, None)
    values = np.asarray(drawn.values, dtype=float)
    colored = values if drawn.limits is None else np.clip(values, low, high)
    mesh = axis.pcolormesh(
        drawn.x, drawn.y, np.ma.masked_invalid(colored).T, shading="nearest", cmap=drawn.colors,
        norm=(LogNorm if drawn.log else Normalize)(vmin=low, vmax=high),
    )  # fmt: skip
    axis.set_facecolor("0.85")
    axis.grid(visible=False)
    axis.figure.colorbar(mesh, ax=axis, label=drawn.label)
    for level, color in drawn.contours.items():
        if min(values.shape) > 1 and np.any(values < level) and np.any(values > level):
            axis.contour(drawn.x, drawn.y, values.T, levels=[level], colors=[color], linewidths=1.0)


def _color(line: Line) -> Any:
    if isinstance(line.color, float):
        import matplotlib as mpl

        return mpl.colormaps["viridis"](0.92 * float(np.clip(line.color, 0.0, 1.0)))
    return PALETTE[line.color % len(PALETTE)] if isinstance(line.color, int) else line.color
