"""Charts from what systems describe: panels of lines, of one run or of several over one another, for ECharts."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np

from evolvent_base import units
from evolvent_base.figures import Figure, Line, Panel, axis_label, plain, y_limits

#: Points of a line, at most; of more, the least and largest of every few are drawn.
MOST = 3000
#: Moments with events that are marked on charts, at most.
MARKED = 12
_DASHES = {"-": "solid", "--": "dashed", ":": "dotted", "-.": "dashed"}
#: Characters of the name of a y axis, beyond which the legend stands above it.
_LONG = 18
#: Styles of the lines of one run beside those of others.
_OF_RUNS = ("-", "--", ":")
#: Markers that distinguish lines where colours do not, so many on a line, and colours of the page's palette.
_MARKS, _ON_A_LINE, _COLORS = ("circle", "triangle", "rect", "diamond", "arrow", "roundRect"), 6, 7
#: Pixels of a letter of the names on a y axis; widest of them.
_LETTER, _WIDEST = 6, 150
VIRIDIS = ("#440154", "#472c7a", "#3b528b", "#2c728e", "#21918c", "#28ae80", "#5ec962", "#addc30", "#fde725")


@dataclasses.dataclass(frozen=True)
class Chart:
    """One pair of axes.

    Attributes
    ----------
    options : dict, of ECharts; colors ``@0``, ``@1``, ... stand for the page's palette, ``A|B`` for A on a light
        and B on a dark page
    timed : bool, whether its x axis is the run's time
    equal : bool, whether both axes have one scale
    time : str, label of the axis of the time, such as "time, s"; '' of other charts
    """

    options: dict[str, Any]
    timed: bool
    equal: bool = False
    time: str = ""


def charts(figure: Figure) -> list[Chart]:
    """The charts of a figure."""
    return compared([("", figure)])


def compared(figures: Sequence[tuple[str, Figure]]) -> list[Chart]:
    """The panels of one figure, of several runs over one another; the first run's words and units are taken.

    Panels of other quantities than the first run's stand beside it as charts of their own.

    Parameters
    ----------
    figures : (name of the run, its figure)
    """
    sheets: list[_Sheet] = []
    for run, (name, figure) in enumerate(figures):
        for panel, x_label in zip(figure.panels, _x_labels(figure), strict=True):
            scales = (1.0, 1.0)
            for sheet in sheets:
                across, up = factor(x_label, sheet.x_label), factor(panel.y_label, sheet.panel.y_label)
                if run not in sheet.runs and across is not None and up is not None:
                    scales = across, up
                    break
            else:
                sheet = _Sheet(panel, x_label)
                sheets.append(sheet)
            sheet.runs.append(run)
            lines = [_times(line, *scales) for line in panel.lines]
            if len(figures) == 1:
                for k, line in enumerate(lines):
                    again = line.color // _COLORS if isinstance(line.color, int) else 0
                    sheet.series.append(_series(line, name, None, panel.log, mark=again - 1, place=k))
                continue
            labels = list(dict.fromkeys(line.label for line in lines if line.style.strip()))
            few = len(labels) <= len(_OF_RUNS)  # the color is the run's then, and the dashes distinguish its lines
            for line in lines:
                k = labels.index(line.label) if line.label in labels else 0
                style = _OF_RUNS[k] if few and line.style.strip() else line.style
                own = dataclasses.replace(line, style=style)
                place = run if few else run + k * len(figures)
                sheet.series.append(_series(own, name, run, panel.log, mark=run if few else k, place=place))
    several = len(figures) > 1
    ends: dict[str, list[float]] = {}  # of the time, by the label of its axis: the same on all charts
    for sheet in sheets:
        if sheet.x_label.startswith("time"):
            known = [s["data"][i][0] for s in sheet.series if s["data"] for i in (0, -1)]
            ends.setdefault(sheet.x_label, []).extend(x for x in known if x is not None)
    return [
        _chart(sheet.panel, sheet.x_label, sheet.series, several=several, ends=ends.get(sheet.x_label, ()))
        for sheet in sheets
    ]


@dataclasses.dataclass
class _Sheet:
    """A chart that comes to be: the panel whose words it takes, and the series of runs that have such a panel."""

    panel: Panel
    x_label: str
    runs: list[int] = dataclasses.field(default_factory=list)
    series: list[dict[str, Any]] = dataclasses.field(default_factory=list)


def _moments(events: Sequence[tuple[float, str]]) -> list[tuple[float, str]]:
    """Events at one time as one moment, with all that happened, the first `MARKED` of them."""
    found: dict[str, tuple[float, list[str]]] = {}
    for time, text in events:
        found.setdefault(f"{time:.4g}", (time, []))[1].append(text)
    moments = [(time, ", ".join(dict.fromkeys(texts))) for time, texts in found.values()]
    return moments[:MARKED]


def events_texts(events: Sequence[tuple[float, str]]) -> list[str]:
    """What the numbers of marks on charts stand for, such as "1: hinge latched at 3.2 s".

    Parameters
    ----------
    events : (time in s, what happened)
    """
    moments = _moments(events)
    texts = [f"{k}: {text} at {time:.4g} s" for k, (time, text) in enumerate(moments, 1)]
    last = moments[-1][0] if moments else 0.0
    more = sum(time > last for time, _ in events)
    return [*texts, f"and {more} more later"] if more and len(moments) == MARKED else texts


def marked(chart: Chart, events: Sequence[tuple[float, str]]) -> Chart:
    """A chart over time with a numbered line at each event; another chart as it is.

    Parameters
    ----------
    events : (time in s, what happened)
    """
    seconds = factor("time, s", chart.time) if chart.time else None
    series = chart.options["series"]
    if not chart.timed or not events or not series or seconds is None:
        return chart
    lines = [{"xAxis": number(seconds * time), "name": str(k)} for k, (time, _) in enumerate(_moments(events), 1)]
    mark = {
        "silent": True, "symbol": "none", "animation": False, "data": lines,
        "lineStyle": {"color": "#8a929d", "type": "dashed", "width": 1},
        "label": {"formatter": "{b}", "position": "end", "distance": 2, "fontSize": 10, "color": "#8a929d"},
    }  # fmt: skip
    return dataclasses.replace(
        chart, options={**chart.options, "series": [{**series[0], "markLine": mark}, *series[1:]]}
    )


def factor(label: str, into: str) -> float | None:
    """What values of one axis are multiplied by to stand on another, None where they are of another quantity.

    Parameters
    ----------
    label, into : str, labels of axes, such as "energy, mJ" and "energy, J"
    """
    label, into = (" ".join(text.split()) for text in (label, into))
    if label == into:
        return 1.0
    (quantity, _, unit), (other, _, wanted) = label.rpartition(", "), into.rpartition(", ")
    if not quantity or quantity != other:
        return None
    try:
        return units.parse(f"1 {unit}", wanted)
    except units.UnitError:
        return None


def _times(line: Line, across: float, up: float) -> Line:
    if across == up == 1.0:
        return line
    return dataclasses.replace(line, x=across * np.asarray(line.x, float), y=up * np.asarray(line.y, float))


def _x_labels(figure: Figure) -> list[str]:
    """Label of each panel's x axis; panels above others may leave it to the lowest of their column."""
    labels = [panel.x_label for panel in figure.panels]
    for k in reversed(range(len(labels))):
        if not labels[k] and k + figure.columns < len(labels):
            labels[k] = labels[k + figure.columns]
    return labels


def _series(line: Line, name: str, run: int | None, log: bool, *, mark: int = -1, place: int = 0) -> dict[str, Any]:
    """A line of a chart.

    Parameters
    ----------
    name, run : of several runs; '' and None of the only one
    mark : int, which of `_MARKS` it has; -1 for none
    place : int, number of the line, by which its marks are moved along it
    """
    x, y = np.asarray(line.x, dtype=float), np.asarray(line.y, dtype=float)
    if log:
        y = np.where(y > 0.0, y, np.nan)
    x, y = _thinned(x, y)
    color = _color(line.color) if run is None else f"@{run}"
    text = plain(line.label)
    label = text if run is None else f"{name}: {text}" if text else name
    drawn = line.style.strip() != ""
    shape = _MARKS[mark % len(_MARKS)] if drawn and mark >= 0 and not line.marker else "none"
    own = {
        "symbol": "circle" if line.marker else shape,
        "showSymbol": bool(line.marker) and (len(x) <= 400 or not drawn),
    }
    if shape != "none" and len(x) > 1:
        own["markPoint"] = {
            "silent": True, "animation": False, "symbol": shape, "symbolSize": 8, "label": {"show": False},
            "data": [{"coord": [number(x[k]), number(y[k])]} for k in _marked_places(y, place)],
        }  # fmt: skip
    return {
        "type": "line",
        "name": label,
        "data": [[number(a), number(b)] for a, b in zip(x, y, strict=True)],
        **own,
        "listed": bool(text) or drawn,
        "symbolSize": 7 if line.marker == "o" else 4,
        "lineStyle": {
            "width": line.width if drawn else 0,
            "type": _DASHES.get(line.style, "solid"),
            "color": color,
            "opacity": 0.85 if run is not None else 1.0,
        },
        "itemStyle": {"color": color},
        "silent": False,
        "connectNulls": False,
    }


def _marked_places(y: np.ndarray, place: int) -> list[int]:
    """Points of a line that have a mark, evenly spread, elsewhere on each of the lines; those that are drawn."""
    shares = (np.arange(_ON_A_LINE) + 0.15 + 0.23 * (place % 4)) / _ON_A_LINE
    return [k for k in np.unique((shares * (y.size - 1)).astype(int)).tolist() if np.isfinite(y[k])]


def number(value: float) -> float | None:
    """A value as a chart takes it: of seven digits, None where it is not finite."""
    return float(f"{value:.7g}") if np.isfinite(value) else None


def _thinned(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A line with fewer points that looks the same: the least and largest of every few."""
    if x.size <= MOST:
        return x, y
    edges = np.linspace(0, x.size, MOST // 2 + 1).astype(int)
    kept = {0, x.size - 1}
    for low, high in itertools.pairwise(edges):
        part = y[low:high]
        if np.any(np.isfinite(part)):
            kept |= {int(low + np.nanargmin(part)), int(low + np.nanargmax(part))}
        else:
            kept.add(int(low))
    at = np.array(sorted(kept))
    return x[at], y[at]


def _color(color: int | float | str) -> str:
    """A color as the page reads it; one of a scale is ``LIGHT|DARK``, each without what its page does not show."""
    if isinstance(color, float):
        place = float(np.clip(color, 0.0, 1.0))
        return f"{_viridis(0.92 * place)}|{_viridis(0.2 + 0.8 * place)}"
    return f"@{color}" if isinstance(color, int) else "@gray" if color == "gray" else color


def _viridis(place: float) -> str:
    place *= len(VIRIDIS) - 1
    k = min(int(place), len(VIRIDIS) - 2)
    ends = [[int(text[i : i + 2], 16) for i in (1, 3, 5)] for text in VIRIDIS[k : k + 2]]
    mixed = [round(a + (place - k) * (b - a)) for a, b in zip(*ends, strict=True)]
    return f"#{mixed[0]:02x}{mixed[1]:02x}{mixed[2]:02x}"


def _chart(
    panel: Panel, x_label: str, series: list[dict[str, Any]], *, several: bool, ends: Sequence[float] = ()
) -> Chart:  # fmt: skip
    listed = [s for s in series if s.pop("listed") and s["name"]]
    # a line without a mark is shown without one in the legend, too
    bare = {s["name"]: s["symbol"] == "none" for s in reversed(listed)}
    names = [{"name": name, **({"itemStyle": {"opacity": 0}} if bare[name] else {})}
             for name in dict.fromkeys(s["name"] for s in listed)]  # fmt: skip
    shown = len(names) > 0
    x_axis: dict[str, Any] = {"type": "value", "name": plain(axis_label(x_label)), "scale": True}
    timed = x_label.startswith("time")
    if timed:
        if ends:
            x_axis |= {"min": min(ends), "max": max(ends)}
    elif panel.x_names is None and not panel.equal and _counts(series):
        x_axis["minInterval"] = 1
    if panel.x_names is not None and not panel.log_x:  # names of things, which are counted
        x_axis |= {"names": {str(int(k)): plain(name) for k, name in panel.x_names.items()}, "interval": 1}
    y_names: dict[str, Any] = {}
    if panel.y_names is not None and not panel.log:
        texts = {str(int(k)): plain(name) for k, name in panel.y_names.items()}
        places = [int(k) for k in texts]
        wide = min(_WIDEST, _LETTER * max(map(len, texts.values())))
        y_names = {"names": texts, "interval": 1, "min": min(places) - 1, "max": max(places) + 1, "wide": wide}
    options: dict[str, Any] = {
        "title": {"text": plain(panel.title)},
        "legend": {"show": shown, "data": names, "wide": (several and len(names) > 2) or len(panel.y_label) > _LONG},
        "xAxis": x_axis,
        "yAxis": {
            **_flat(series, panel),
            "type": "log" if panel.log else "value",
            "name": plain(axis_label(panel.y_label)),
            "scale": not panel.y_zero,
            **y_names,
        },
        "series": series,
    }
    return Chart(options=options, timed=timed, equal=panel.equal, time=x_label if timed else "")


def _counts(series: Sequence[dict[str, Any]]) -> bool:
    """Whether the x axis counts things: whole numbers, and few."""
    x = [point[0] for s in series for point in s["data"] if point[0] is not None]
    return bool(x) and all(value == int(value) for value in x) and max(x) - min(x) <= 64


def _flat(series: Sequence[dict[str, Any]], panel: Panel) -> dict[str, float]:
    """Ends of the y axis: whole decades, or where all values are the same but for round-off, wide enough for it."""
    y = [point[1] for s in series for point in s["data"] if point[1] is not None]
    if not y or panel.equal:
        return {}
    if panel.log:  # whole decades
        low, high = np.floor(np.log10(min(y))), np.ceil(np.log10(max(y)))
        high = max(high, low + 1.0)
        return {"min": float(10.0**low), "max": float(10.0**high), "interval": float(np.ceil((high - low) / 6.0))}
    if max(y) - min(y) < panel.y_span:
        ends = y_limits(dataclasses.replace(panel, lines=[Line(x=np.array(y), y=np.array(y))]))
        return {} if ends is None else {"min": float(f"{ends[0]:.2g}"), "max": float(f"{ends[1]:.2g}")}
    size, middle = max(abs(value) for value in y), 0.5 * (max(y) + min(y))
    if size == 0.0 or max(y) - min(y) > 1e-5 * size:
        return {}
    half = float(f"{0.1 * size:.1g}")
    return {"min": float(f"{middle - half:.2g}"), "max": float(f"{middle + half:.2g}")}
