"""Draw the figures that a system describes, as PNG, SVG or PDF files in the size in which they are printed."""

from __future__ import annotations

import functools
import io
import os
import re
import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np

from evolvent.base import progress
from evolvent.base.errors import InputError
from evolvent.base.files import make_folder, write_file
from evolvent.results.figures import WIDTH, Figure, Line, Map, Note, Panel, axis_label, with_power, y_limits

#: Okabe and Ito's palette, distinguishable with any kind of colour vision; black leads.
PALETTE = ("#000000", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
#: Dashes of solid lines that share a panel, by the index of their color in the palette: distinguishable in grey.
DASHES: tuple[Any, ...] = (
    "-", (0, (7, 1.5)), (0, (1.5, 1)), (0, (7, 1.5, 1.5, 1.5)), (0, (3, 1.2)), (0, (7, 1.2, 1.2, 1.2, 1.2, 1.2)),
    (0, (12, 2)),
)  # fmt: skip
#: Formats of a figure's file.
FORMATS = ("png", "pdf", "svg")
_NO_BREAK = "\N{NO-BREAK SPACE}"
#: Dots of a PNG file in an inch.
DPI = 200.0
#: Style of every figure: sizes of text, points, on a page of 174 mm; fonts are embedded as TrueType.
STYLE: Any = {
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-4, 5),
    "axes.formatter.use_mathtext": True,
    "axes.grid": True,
    "axes.labelsize": 8,
    "axes.linewidth": 0.6,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": 8,
    "axes.xmargin": 0.02,
    "figure.constrained_layout.h_pad": 0.05,
    "figure.titlesize": 9,
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 8,
    "grid.alpha": 0.25,
    "grid.linewidth": 0.5,
    "legend.borderaxespad": 0.2,
    "legend.borderpad": 0.1,
    "legend.columnspacing": 1.2,
    "legend.fontsize": 7.5,
    "legend.frameon": False,
    "legend.handlelength": 2.4,
    "legend.handletextpad": 0.5,
    "legend.labelspacing": 0.25,
    "mathtext.fontset": "dejavusans",
    "pdf.fonttype": 42,
    "svg.fonttype": "path",
    "svg.hashsalt": "evolvent",
    "xtick.labelsize": 7.5,
    "xtick.major.width": 0.6,
    "ytick.labelsize": 7.5,
    "ytick.major.width": 0.6,
}
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
    return [
        save(one, os.path.join(os.fspath(folder), f"{one.name}.{kind}"), label=label)
        for one in progress.track(figures, "drawing figures")
    ]


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
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as Sheet

    with mpl.rc_context(STYLE):
        height = _schematic_height(figure) or figure.height
        found: Any = Sheet(figsize=(WIDTH / 25.4, height / 25.4), layout="constrained", dpi=dpi)
        FigureCanvasAgg(found)
        if title:
            found.suptitle(_wrapped(figure.title, 9.0, WIDTH - 10.0), x=0.01, ha="left")
        rows = -(-len(figure.panels) // figure.columns)
        axes = found.subplots(rows, figure.columns, squeeze=False, height_ratios=figure.heights).ravel()
        named = [any(line.label for line in panel.lines) for panel in figure.panels]
        shared = figure.columns > 1 and named[0] and not any(named[1:]) and not label
        for axis, panel in zip(axes, figure.panels, strict=False):
            named_by = figure.panels[0] if shared else panel
            size = (WIDTH / figure.columns - 18.0, height / rows - 14.0)
            _panel(axis, panel, size, legend=not shared, dashed=_is_dashed(named_by))
        if shared:
            _legend(found, axes[0], "", WIDTH - 10.0, loc="outside lower center")
        for axis in axes[len(figure.panels) :]:
            axis.remove()
        if label:
            text = _wrapped(label, 9.0, 0.9 * WIDTH)
            found.supxlabel(text, x=0.01, ha="left", color="#b00020", fontsize=9, fontweight="bold")
    found._repr_png_ = functools.partial(_png, found)  # Jupyter draws it even where pyplot was never imported
    return found


def _png(sheet: Any) -> bytes:
    """A figure of matplotlib as a PNG file."""
    content = io.BytesIO()
    sheet.savefig(content, format="png")
    return content.getvalue()


def picture(figure: Figure, kind: str, *, dpi: float = DPI, title: bool = True, label: str = "") -> bytes:
    """A figure as the content of a file of some `kind`; the same figure gives the same bytes."""
    return content(sheet(figure, dpi=dpi, title=title, label=label), kind)


def content(drawn: Any, kind: str) -> bytes:
    """One of matplotlib's figures as the content of a file of some `kind`."""
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    file = io.BytesIO()
    with mpl.rc_context(STYLE):
        if kind == "png":
            FigureCanvasAgg(drawn).print_png(file)  # savefig would draw twice, once for the layout alone
        else:
            undated = {"pdf": {"CreationDate": None}, "svg": {"Date": None}}[kind]
            drawn.savefig(file, format=kind, metadata=undated)
    return file.getvalue()


@functools.lru_cache(maxsize=2048)
def text_width(text: str, size: float) -> float:
    """Width of a text, mm, in letters of some size, points."""
    import matplotlib as mpl
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    if not text.strip():
        return 0.0
    with mpl.rc_context(STYLE):
        letters = FontProperties(family="DejaVu Sans", size=size)
        width, *_ = text_to_path.get_text_width_height_descent(text, letters, ismath=text.count("$") > 1)
    return float(width) * 25.4 / 72.0


def _wrapped(text: str, size: float, width: float) -> str:
    """A text in lines that are no longer than a width, mm; no line ends within a unit in brackets."""
    lines = []
    joined = re.sub(r"\[[^]]*\]", lambda m: m[0].replace(" ", _NO_BREAK), text)
    for paragraph in joined.split("\n"):
        letters = len(paragraph)
        while (
            letters > 8 and max((text_width(one, size) for one in textwrap.wrap(paragraph, letters)), default=0) > width
        ):
            letters -= 1
        lines += textwrap.wrap(paragraph, max(letters, 1)) or [""]
    return "\n".join(lines).replace(_NO_BREAK, " ")


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


def _panel(axis: Any, panel: Panel, size: tuple[float, float], *, legend: bool, dashed: bool) -> None:
    """Draw a panel whose axes are about so wide and high, mm; `dashed` lines follow their color."""
    width, height = size[0] - (16.0 if panel.map is not None else 0.0), size[1]
    if panel.map is not None:
        _map(axis, panel.map)
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
    axis.set_xlabel(_wrapped(axis_label(panel.x_label), 8.0, width))
    axis.set_ylabel(_wrapped(axis_label(panel.y_label), 8.0, height))
    if panel.x_names is not None:
        axis.set_xticks(list(panel.x_names), list(panel.x_names.values()))
        longest = max(text_width(name, 7.5) for name in panel.x_names.values())
        if longest * len(panel.x_names) > 0.9 * width:
            axis.tick_params(axis="x", rotation=90)
    if panel.y_names is not None:
        axis.set_yticks(list(panel.y_names), list(panel.y_names.values()))
    if panel.equal:
        axis.set_aspect("equal", adjustable="datalim")
    if panel.log:
        axis.set_yscale("log")
    if panel.log_x:
        axis.set_xscale("log")
    if not panel.log_x and panel.x_names is None and panel.axes:
        axis.locator_params(axis="x", nbins=int(np.clip(width / _TICK, 3, 10)))
    if (ends := y_limits(panel)) is not None:
        axis.set_ylim(*ends)
    if not panel.axes:
        axis.set_axis_off()
        axis.margins(0.08)
    _plain_ticks(axis, (panel.x_label, panel.y_label), size)
    title = _wrapped(panel.title, 8.0, width + 6.0)
    if legend and any(line.label for line in panel.lines):
        _legend(axis, axis, title, width, loc="lower left", bbox_to_anchor=(0.0, 1.0))
    else:
        axis.set_title(title)


def _plain_ticks(axis: Any, labels: tuple[str, str] = ("", ""), size: tuple[float, float] = (0.0, 0.0)) -> None:
    """Write the numbers of linear axes as plain text, and a power of ten that they share before the unit of the label.

    Without a label the power stays beside the axis.
    """
    from matplotlib.ticker import ScalarFormatter

    for one, label, room in zip((axis.xaxis, axis.yaxis), labels, size, strict=True):
        if type(one.get_major_formatter()) is ScalarFormatter:
            one.set_major_formatter(_plain_numbers(one, label, room))


def _plain_numbers(along: Any, label: str, room: float) -> Any:
    """A formatter of ticks without mathtext, whose parsing took a third of the time of a figure."""
    from matplotlib.ticker import ScalarFormatter

    class PlainNumbers(ScalarFormatter):
        beside = ""  # a factor of all numbers that is not in the label

        def __call__(self, x: float, pos: int | None = None) -> str:
            return str(super().__call__(x, pos)).removeprefix(r"$\mathdefault{").removesuffix("}$")

        def set_locs(self, locs: Any) -> None:
            super().set_locs(locs)
            self.beside = str(super().get_offset())
            power = re.search(r"10\^\{([-\N{MINUS SIGN}]?\d+)\}", self.beside)
            if label:
                text = with_power(label, int(power[1].replace("\N{MINUS SIGN}", "-"))) if power else label
                along.set_label_text(_wrapped(axis_label(text), 8.0, room))
                self.beside = "" if power else self.beside

        def get_offset(self) -> str:
            return self.beside

    return PlainNumbers()


def _legend(parent: Any, axis: Any, title: str, width: float, **place: Any) -> None:
    """A legend off the axes, of a panel below its title, in as many columns as are `width` wide, mm."""
    handles, labels = axis.get_legend_handles_labels()
    rows = 1
    while rows < len(labels) and _legend_width(labels, rows) > width:
        rows += 1
    columns = -(-len(labels) // rows)
    parent.legend(handles, labels, ncols=columns, title=title or None, title_fontsize=8, alignment="left", **place)


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
    bar = axis.figure.colorbar(mesh, ax=axis, label=axis_label(drawn.label))
    bar.outline.set_linewidth(0.5)
    _plain_ticks(bar.ax)
    for level, color in drawn.contours.items():
        if min(values.shape) > 1 and np.any(values < level) and np.any(values > level):
            axis.contour(drawn.x, drawn.y, values.T, levels=[level], colors=[color], linewidths=0.8)


def _color(line: Line) -> Any:
    if isinstance(line.color, float):
        import matplotlib as mpl

        return mpl.colormaps["viridis"](0.92 * float(np.clip(line.color, 0.0, 1.0)))
    return PALETTE[line.color % len(PALETTE)] if isinstance(line.color, int) else line.color
