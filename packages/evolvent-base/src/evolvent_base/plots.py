"""Draw the figures that a system describes, as PNG, SVG or PDF files in the size in which they are printed."""

from __future__ import annotations

import functools
import io
import os
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import lazy_loader as lazy
import numpy as np

from evolvent_base import progress
from evolvent_base.errors import InputError
from evolvent_base.figures import WIDTH, Figure, Line, Map, Note, Panel, axis_label, counts, y_limits
from evolvent_base.files import make_folder, write_file
from evolvent_base.layout import EDGE, Place, arrange
from evolvent_base.style import DASHES, PALETTE, POINT, STYLE, block, text_width, wrapped
from evolvent_base.ticks import set_plain_ticks, share_ticks

sheets = lazy.load("evolvent_base.sheets", suppress_warning=True)

#: Formats of a figure's file.
FORMATS = ("png", "pdf", "svg")
#: Dots of a PNG file in an inch.
DPI = 200.0
#: Least distance of the ticks of an x axis, mm.
_TICK = 14.0
#: Width of a line in points of what `Line.width` asks for.
_THIN = 0.75


def draw(figures: Sequence[Figure], folder: str | os.PathLike[str], *, kind: str = "png", label: str = "") -> list[str]:
    """Write every figure into `folder`, with `label` written large below it; returns the files' paths.

    Parameters
    ----------
    kind : str, one of `FORMATS`

    Raises
    ------
    InputError
        If the folder cannot be written into.
    """
    make_folder(folder)
    paths = [os.path.join(os.fspath(folder), f"{one.name}.{kind}") for one in figures]
    if kind != "png":
        return [save(one, path, label=label) for one, path in _tracked(figures, paths)]
    with ThreadPoolExecutor(max_workers=1) as beside:  # compresses one figure while the next is drawn
        left = []
        for one, path in _tracked(figures, paths):
            left.append(beside.submit(_write_points, path, *_points(sheet(one, label=label))))
    for future in left:
        future.result()
    return paths


def _tracked(figures: Sequence[Figure], paths: Sequence[str]) -> Iterable[tuple[Figure, str]]:
    return progress.track(list(zip(figures, paths, strict=True)), "drawing figures")


def save(figure: Figure, path: str | os.PathLike[str], *, label: str = "") -> str:
    """Write one figure as the file `path`: PNG, or SVG or PDF by its suffix; returns the path.

    Raises
    ------
    InputError
        If the file cannot be written, or its kind is not known.
    """
    write_file(path, picture(figure, format_of(path), label=label))
    return os.fspath(path)


def format_of(path: str | os.PathLike[str]) -> str:
    """Format of a figure by the suffix of its file.

    Raises
    ------
    InputError
        If it is none of `FORMATS`.
    """
    kind = os.path.splitext(os.fspath(path))[1].lstrip(".").lower()
    if kind not in FORMATS:
        raise InputError(f"cannot write {os.fspath(path)!r}: a figure's file ends with .png, .svg or .pdf")
    return kind


def sheet(figure: Figure, *, dpi: float = DPI, title: bool = True, label: str = "") -> Any:
    """A figure as one of matplotlib's, with its own canvas; `label` stands in large letters below it."""
    with sheets.mpl.rc_context(STYLE):
        height = _schematic_height(figure) or figure.height
        found: Any = sheets.Figure(figsize=(WIDTH / 25.4, height / 25.4), dpi=dpi)
        sheets.FigureCanvasAgg(found)
        top, bottom = _frame(found, figure.title if title else "", label, height)
        rows = -(-len(figure.panels) // figure.columns)
        named = [any(line.label for line in panel.lines) for panel in figure.panels]
        shared = figure.columns > 1 and named[0] and not any(named[1:]) and not label
        names = [name for panel in figure.panels for name in (panel.y_names or {}).values()]
        beside = max([22.0, *(14.0 + text_width(name, 7.5) for name in names)])  # axes in a column have one left edge
        size = (WIDTH / figure.columns - beside, height / rows - 14.0)
        places: list[Place] = []
        for panel in figure.panels:
            named_by = figure.panels[0] if shared else panel
            kind = "3d" if panel.map is not None and panel.map.surface else None
            axis = found.add_axes((0.2, 0.2, 0.7, 0.7), label=str(len(places)), projection=kind)
            for one in (axis.xaxis, axis.yaxis) if kind is None else ():
                share_ticks(one)
            places.append(_panel(axis, panel, size, legend=not shared, dashed=_is_dashed(named_by)))
        if shared:
            place = {"loc": "lower center", "bbox_to_anchor": (0.5, EDGE / height)}
            bottom += _legend(found, places[0].axis, "", WIDTH - 10.0, **place)
        if figure.columns == 1:
            _share_x([place.axis for place in places], figure.panels)
        arrange(places, columns=figure.columns, height=height, ratios=figure.heights, top=top, bottom=bottom)
    found._repr_png_ = functools.partial(content, found, "png")  # Jupyter draws it even where pyplot was never imported
    return found


def _frame(sheet: Any, title: str, label: str, height: float) -> tuple[float, float]:
    """Write the title and the label of a sheet; returns the heights that they take at its top and bottom, mm."""
    top, bottom = EDGE, EDGE
    if title:
        text = wrapped(title, 9.0, WIDTH - 10.0)
        sheet.suptitle(text, x=0.01, y=1.0 - EDGE / height, ha="left", va="top")
        top += block(text, 9.0) + 1.0
    if label:
        text = wrapped(label, 9.0, 0.85 * WIDTH)
        letters = {"color": "#b00020", "fontsize": 9, "fontweight": "bold"}
        sheet.supxlabel(text, x=0.01, y=EDGE / height, ha="left", va="bottom", **letters)
        bottom += block(text, 9.0) + 1.0
    return top, bottom


def _share_x(axes: Sequence[Any], panels: Sequence[Panel]) -> None:
    """Give panels over one another, of which the lowest names the x axis, one x axis with its numbers below."""
    for k in range(len(axes) - 2, -1, -1):
        if panels[k].x_label or not panels[k].axes or panels[k].x_names or panels[k + 1].log_x != panels[k].log_x:
            continue
        axes[k].sharex(axes[k + 1])
        axes[k].tick_params(axis="x", labelbottom=False)


def picture(figure: Figure, kind: str, *, dpi: float = DPI, title: bool = True, label: str = "") -> bytes:
    """A figure as the content of a file of some `kind`; the same figure gives the same bytes."""
    return content(sheet(figure, dpi=dpi, title=title, label=label), kind)


def content(drawn: Any, kind: str) -> bytes:
    """One of matplotlib's figures as the content of a file of some `kind`."""
    if kind == "png":
        return _png_file(*_points(drawn))
    file = io.BytesIO()
    with sheets.mpl.rc_context(STYLE):
        undated = {"pdf": {"CreationDate": None}, "svg": {"Date": None}}[kind]
        drawn.savefig(file, format=kind, metadata=undated)
    return file.getvalue()


def _points(drawn: Any) -> tuple[np.ndarray, float]:
    """A figure of matplotlib as RGBA pixels (height, width, 4) uint8, and its resolution in pixels per inch."""
    with sheets.mpl.rc_context(STYLE):
        canvas = sheets.FigureCanvasAgg(drawn)
        canvas.draw()
    return np.asarray(canvas.buffer_rgba()), float(drawn.dpi)


def _png_file(points: np.ndarray, dpi: float) -> bytes:
    """RGBA pixels as the content of an opaque PNG file."""
    file = io.BytesIO()
    runs_of_equal_points: Any = {"compress_type": 3, "compress_level": 4}  # half the time, a tenth more bytes
    sheets.Image.fromarray(points).convert("RGB").save(file, format="png", dpi=(dpi, dpi), **runs_of_equal_points)
    return file.getvalue()


def _write_points(path: str, points: np.ndarray, dpi: float) -> None:
    write_file(path, _png_file(points, dpi))


def _schematic_height(figure: Figure) -> float | None:
    """Height of a sheet of schematics, at which they fill its width, mm; None for other figures."""
    if any(panel.axes or not panel.equal for panel in figure.panels):
        return None
    ratios = []
    for panel in figure.panels:
        ends = [np.array(point) for note in panel.notes for point in (note.at, note.points_to) if point is not None]
        points = np.concatenate(
            [*(np.column_stack([line.x, line.y]) for line in panel.lines), np.reshape(ends, (-1, 2))]
        )
        wide, high = np.nanmax(points, axis=0) - np.nanmin(points, axis=0)
        ratios.append(high / wide)
    width, rows = WIDTH / figure.columns - 12.0, -(-len(ratios) // figure.columns)
    per_row = [max(ratios[k * figure.columns : (k + 1) * figure.columns]) for k in range(rows)]
    return float(10.0 + sum(width * ratio + 12.0 for ratio in per_row))


def _panel(axis: Any, panel: Panel, size: tuple[float, float], *, legend: bool, dashed: bool) -> Place:
    """Draw a panel whose axes are about so wide and high, mm; `dashed` lines follow their color."""
    if panel.map is not None and panel.map.surface:
        return _surface(axis, panel, panel.map, size[0])
    width, height = size[0] - (16.0 if panel.map is not None else 0.0), size[1]
    bar = None if panel.map is None else _map(axis, panel.map)
    for line in panel.lines:
        if line.fill:
            axis.fill(line.x, line.y, facecolor=line.fill, linewidth=0.0, zorder=0.5)
        axis.plot(
            line.x,
            line.y,
            linestyle=_style(line, dashed=dashed),
            color=_color(line),
            label=line.label or None,
            marker=line.marker or None,
            markersize=2.0 if line.marker == "." else 3.2,
            linewidth=_THIN * line.width,
            markeredgewidth=0.8,
        )
    for note in panel.notes:
        _note(axis, note)
    named = panel.log_x and panel.x_names is not None
    x_label = panel.x_label.rpartition(", ")[0] if named else panel.x_label
    axis.set_xlabel(wrapped(axis_label(x_label), 8.0, width))
    axis.set_ylabel(wrapped(axis_label(panel.y_label), 8.0, height))
    upright = False
    if panel.log_x:
        axis.set_xscale("log")
    if panel.x_names is not None:
        axis.xaxis.set_minor_locator(sheets.NullLocator())
        axis.set_xticks(list(panel.x_names), list(panel.x_names.values()))
        longest = max(text_width(name, 7.5) for name in panel.x_names.values())
        upright = longest * len(panel.x_names) > 0.9 * width
        axis.tick_params(axis="x", rotation=90.0 if upright else 0.0)
    if panel.y_names is not None:
        axis.set_yticks(list(panel.y_names), list(panel.y_names.values()))
    if panel.equal:
        axis.set_aspect("equal", adjustable="datalim")
    if panel.log:
        axis.set_yscale("log")
    if not panel.log_x and panel.x_names is None and panel.axes:
        nbins = int(np.clip(width / _TICK, 3, 10))
        axis.locator_params(axis="x", nbins=nbins, integer=counts(panel, "x"))
    if not panel.log and panel.y_names is None and counts(panel, "y"):
        axis.locator_params(axis="y", integer=True)
    if (ends := y_limits(panel)) is not None:
        axis.set_ylim(*ends)
    if not panel.axes:
        axis.set_axis_off()
        axis.margins(0.08)
    axis.tick_params(labelsize=STYLE["ytick.labelsize"])  # also where it is drawn in another style
    set_plain_ticks(axis, (panel.x_label, panel.y_label), size)
    title = wrapped(panel.title, 8.0, width + 6.0)
    if legend and any(line.label for line in panel.lines):
        above = _legend(axis, axis, title, width, loc="lower left", bbox_to_anchor=(0.0, 1.0))
    else:
        axis.set_title(title, pad=3.0)
        above = block(title, 8.0) + 3.0 * POINT
    return Place(axis, above, upright, bar)


def _legend(parent: Any, axis: Any, title: str, width: float, **place: Any) -> float:
    """A legend off the axes, of a panel below its title, in as many columns as are `width` wide, mm; its height, mm."""
    handles, labels = axis.get_legend_handles_labels()
    rows = 1
    while rows < len(labels) and _legend_width(labels, rows) > width:
        rows += 1
    columns = -(-len(labels) // rows)
    parent.legend(handles, labels, ncols=columns, title=title or None, title_fontsize=8, alignment="left", **place)
    return block(title, 8.0) + rows * 1.25 * 7.5 * POINT + 5.0 * POINT


def _legend_width(labels: Sequence[str], rows: int) -> float:
    """Width of a legend in so many rows, mm; its labels go down each column."""
    starts = range(0, len(labels), rows)
    return sum(max(text_width(text, 7.5) for text in labels[k : k + rows]) + 11.0 for k in starts)


def _is_dashed(panel: Panel) -> bool:
    """Whether dashes distinguish the lines of a panel: solid ones of two or more colors of the palette."""
    solid = {line.color for line in panel.lines if line.style == "-" and isinstance(line.color, int) and line.label}
    return len(solid) > 1 and all(
        line.style == "-" for line in panel.lines if isinstance(line.color, int) and line.style.strip()
    )


def _style(line: Line, *, dashed: bool) -> Any:
    if dashed and line.style == "-" and isinstance(line.color, int) and not line.marker:
        return DASHES[line.color % len(DASHES)]
    return line.style.strip() or "none"


def _note(axis: Any, note: Note) -> None:
    """Write a note, with its arrow."""
    plate = {"boxstyle": "square,pad=0.1", "facecolor": "white", "edgecolor": "none", "alpha": 0.8}
    middle = {"ha": "center", "va": "center", "bbox": plate}
    if note.points_to is None:
        axis.text(*note.at, note.text, **middle)
    else:
        arrow = {"arrowstyle": "->", "linewidth": 0.6, "shrinkA": 1.0, "shrinkB": 1.0}
        axis.annotate(note.text, xy=note.points_to, xytext=note.at, arrowprops=arrow, **middle)


def _map(axis: Any, drawn: Map) -> Any:
    """Draw a map with its colour bar, whose axes are returned, and contour lines."""
    low, high = drawn.limits or (None, None)
    values = np.asarray(drawn.values, dtype=float)
    colored = values if drawn.limits is None else np.clip(values, low, high)
    mesh = axis.pcolormesh(
        drawn.x, drawn.y, np.ma.masked_invalid(colored).T, shading="nearest", cmap=drawn.colors,
        norm=(sheets.LogNorm if drawn.log else sheets.Normalize)(vmin=low, vmax=high),
    )  # fmt: skip
    axis.set_facecolor("0.85")
    axis.grid(visible=False)
    beside = axis.figure.add_axes((0.9, 0.2, 0.02, 0.7), label=f"bar {axis.get_label()}")
    ends = {(False, False): "neither", (True, False): "min", (False, True): "max", (True, True): "both"}[drawn.clipped]
    bar = axis.figure.colorbar(mesh, cax=beside, label=drawn.bar_label, extend=ends)
    bar.outline.set_linewidth(0.5)
    set_plain_ticks(beside)
    for level, color in drawn.contours.items():
        if min(values.shape) > 1 and np.any(values < level) and np.any(values > level):
            axis.contour(drawn.x, drawn.y, values.T, levels=[level], colors=[color], linewidths=0.8)
    return beside


def _surface(axis: Any, panel: Panel, drawn: Map, width: float) -> Place:
    """Draw a panel's map as a surface in axes of three dimensions, about so wide, mm."""
    x, y = np.meshgrid(drawn.x, drawn.y, indexing="ij")
    look: dict[str, Any] = {"cmap": drawn.colors, "edgecolor": "black", "linewidth": 0.15, "rstride": 1, "cstride": 1}
    axis.plot_surface(x, y, np.asarray(drawn.values, dtype=float), **look)
    axis.view_init(elev=38.0, azim=-120.0)
    axis.set_box_aspect((1.0, 1.0, 0.7), zoom=1.15)
    axis.set_xlabel(axis_label(panel.x_label), labelpad=-2.0)
    axis.set_ylabel(axis_label(panel.y_label), labelpad=-2.0)
    axis.set_zlabel(axis_label(drawn.label), labelpad=-4.0)
    axis.tick_params(labelsize=STYLE["ytick.labelsize"], pad=-2.0)
    title = wrapped(panel.title, 8.0, width)
    axis.set_title(title, pad=10.0)
    return Place(axis, block(title, 8.0) + 10.0 * POINT)


def _color(line: Line) -> Any:
    if isinstance(line.color, float):
        return sheets.mpl.colormaps["viridis"](0.92 * float(np.clip(line.color, 0.0, 1.0)))
    return PALETTE[line.color % len(PALETTE)] if isinstance(line.color, int) else line.color
