"""Charts of a study: which result varies most, and maps, lines, bars and points of it, with failed cases marked."""

from __future__ import annotations

import html
import re
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import xarray as xr

from evolvent_studio.charts import VIRIDIS, number

#: Where a point of a chart is: (series, index) -> dimension of the cases -> index.
At = Callable[[int, int], dict[str, int]]
#: Values at most that are drawn as categories, and the largest number that is one.
_CATEGORIES, _LARGEST = 8, 12
#: Cells of a map whose values are written in them, at most.
_WRITTEN = 120
#: Lines that are drawn over one another, at most.
LINES = 12
#: Colours of categories without an order.
_COLORS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#8a6d00", "#7a4fd0")
#: Names of results that judge the computation, not the structure.
_CHECKS = re.compile(
    r"(defect|energy_moved|steps?|evaluations|iterations|stability_limit|std)(_first|_last|_min|_max|_mean)?$"
)
_BAD = "#c0261c"


# ------------------------------------------------------------------------------------------------ results


def outputs(study: xr.Dataset, dims: Sequence[str]) -> list[str]:
    """Results of every case that can be drawn; of words those that differ."""
    found = []
    for name, variable in study.data_vars.items():
        if name == "reason" or not set(dims) <= set(map(str, variable.dims)):
            continue
        if variable.dtype.kind in "biuf" or (variable.dtype.kind in "UO" and np.unique(_words(variable)).size > 1):
            found.append(str(name))
    return found


def _words(variable: xr.DataArray) -> np.ndarray:
    return np.asarray(variable.values).astype(str)


def is_category(variable: xr.DataArray) -> bool:
    """Whether values are categories: words, switches, or a few small whole numbers without a unit that recur."""
    if variable.dtype.kind not in "iuf":
        return True
    values = variable.values[np.isfinite(variable.values)]
    if variable.attrs.get("units", "1") not in ("1", "") or not values.size or np.abs(values).max() > _LARGEST:
        return False
    count = np.unique(values).size
    return bool(np.all(values == np.round(values))) and count <= min(_CATEGORIES, values.size // 2)


def categories(variable: xr.DataArray) -> tuple[list[str], np.ndarray]:
    """Names of the categories, and the index of each value among them; -1 for none."""
    if variable.dtype.kind in "iuf":
        values = variable.values.astype(float)
        known = np.unique(values[np.isfinite(values)])
        places = np.where(np.isfinite(values), np.searchsorted(known, values), -1)
        return [f"{value:g}" for value in known], places
    words = _words(variable)
    names = [str(name) for name in np.unique(words) if name]
    return names, np.array([names.index(word) if word in names else -1 for word in words.flat]).reshape(words.shape)


def most_informative(study: xr.Dataset, names: Sequence[str], dims: Sequence[str]) -> str:
    """The result that varies most over the cases, relative to its size, as far as the variation is no scatter."""
    return max(names, key=lambda name: information(study, name, dims))


def information(study: xr.Dataset, name: str, dims: Sequence[str]) -> float:
    """Range of a result over the cases over its largest value, times the share that neighbouring cases have in common.

    Categories count a tenth, results that judge the computation a thousandth.
    """
    variable = study[name]
    if variable.dtype.kind not in "iuf":
        return 0.01
    drawn = most_varying(variable, dims).transpose(*dims)
    values = drawn.values.astype(float)
    finite = values[np.isfinite(values)]
    size = float(np.abs(finite).max()) if finite.size else 0.0
    if finite.size < 2 or float(np.ptp(finite)) <= 1e-9 * size:
        return 0.0
    keys = [study[key].values for key in study.coords if study[key].dims == ("case",) and study[key].dtype.kind in "if"]
    found = min(float(np.ptp(finite)) / size, 1.0) * _in_common(values, keys if dims == ["case"] else [])
    return found * (1e-3 if _CHECKS.search(name) else 0.1 if is_category(drawn) else 1.0)


def most_varying(variable: xr.DataArray, dims: Sequence[str]) -> xr.DataArray:
    """The entry, over dimensions that are not of the cases, that varies most over the cases."""
    return variable.isel(entry(variable, dims))


def entry(variable: xr.DataArray, dims: Sequence[str]) -> dict[str, int]:
    """Indices of that entry; empty where the result is one value a case, or words."""
    rest = [str(d) for d in variable.dims if d not in dims]
    if not rest or variable.dtype.kind not in "iuf":
        return dict.fromkeys(rest, 0)
    ranges = (variable.max(dims) - variable.min(dims)).fillna(-1.0).transpose(*rest).values
    places = np.unravel_index(int(np.argmax(ranges)), ranges.shape)
    return {dim: int(k) for dim, k in zip(rest, places, strict=True)}


def _in_common(values: np.ndarray, keys: Sequence[np.ndarray]) -> float:
    """Share of the variance that a value has in common with its neighbours: 1 for a smooth result, 0 for noise."""
    total = float(np.nanvar(values))
    if keys:  # samples: along the key where they are smoothest
        lines = [values[np.argsort(key, kind="stable")] for key in keys]
        return max(_smooth(line, 0, total) for line in lines)
    axes = [axis for axis, size in enumerate(values.shape) if size > 2]
    return min((_smooth(values, axis, total) for axis in axes), default=1.0)


def _smooth(values: np.ndarray, axis: int, total: float) -> float:
    moved = np.moveaxis(values, axis, 0)
    bend = moved[1:-1] - 0.5 * (moved[:-2] + moved[2:])
    bend = bend[np.isfinite(bend)]
    if not bend.size:
        return 1.0
    return float(np.clip(1.0 - np.mean(bend**2) / (1.5 * total), 0.05, 1.0))


# ------------------------------------------------------------------------------------------------ charts


def text(value: Any) -> str:
    """A value of a key on an axis."""
    return f"{float(value):.4g}" if isinstance(value, (float, np.floating)) else str(value)


def label(variable: xr.DataArray) -> str:
    """Name and unit, for an axis."""
    unit = str(variable.attrs.get("units", "1"))
    return _asked_name(variable) if unit in ("1", "") else f"{_asked_name(variable)} [{unit}]"


def title(variable: xr.DataArray) -> str:
    """Name, unit and what a result is."""
    head, what = _described(variable)
    return f"{label(variable)}: {what or head}" if head not in ("", variable.name) else label(variable)


def _described(variable: xr.DataArray) -> tuple[str, str]:
    """Name in a run of what a result is made of, such as "hinge 1.torque", and what it is; '', '' of none.

    Of a result of a built-in system what it is stands first, and the second text is empty.
    """
    long_name = str(variable.attrs.get("long_name", ""))
    head, _, what = long_name.partition(": ")
    made = what and str(variable.name).startswith(re.sub(r"\W", "_", head))
    return (head, what) if made else (long_name, "")


def _asked_name(variable: xr.DataArray) -> str:
    """Name of a result as it was asked for, such as "hinge 1.torque.abs_max"; a key has its own."""
    name, (head, what) = str(variable.name), _described(variable)
    if not what:
        return name if "." in name else name.replace("_", " ")
    rest = name[len(head) :].removeprefix("_")
    return f"{head}.{rest}" if rest else head


def _failed(points: Sequence[tuple[list[Any], str]]) -> dict[str, Any]:
    """Crosses where cases failed; the tooltip of each is its reason."""
    data = [{"value": at, "tooltip": {"formatter": f"failed: {_wrapped(reason)}"}} for at, reason in points]
    return {
        "type": "scatter", "name": "failed", "data": data, "symbol": "path://M0,0L10,10M10,0L0,10", "symbolSize": 9,
        "itemStyle": {"color": "transparent", "borderColor": _BAD, "borderWidth": 2}, "z": 5,
    }  # fmt: skip


def _wrapped(reason: str) -> str:
    words, lines = reason.split(), [""]
    for word in words:
        if len(lines[-1]) + len(word) > 60:
            lines.append("")
        lines[-1] += f"{word} "
    return "<br>".join(html.escape(line.strip()) for line in lines[:6])


def heatmap(values: xr.DataArray, x: xr.DataArray, y: xr.DataArray, reasons: np.ndarray) -> tuple[dict[str, Any], At]:
    """A map over two keys; categories have a colour each, and a legend.

    Parameters
    ----------
    values : DataArray over (x, y)
    x, y : of the keys
    reasons : array of str over (x, y), '' of cases that did not fail
    """
    keys = [str(x.name), str(y.name)]
    if is_category(values):
        names, places = categories(values)
        every = np.where(places < 0, np.nan, places.astype(float))
        chosen = _stepped(len(names)) if values.dtype.kind in "iuf" else _COLORS
        scale: dict[str, Any] = {
            "type": "piecewise", "right": 6, "top": 40, "align": "left", "seriesIndex": 0,
            "pieces": [{"value": k, "label": name, "color": chosen[k % len(chosen)]} for k, name in enumerate(names)],
        }  # fmt: skip
    else:
        names, every = [], values.values.astype(float)
        finite = every[np.isfinite(every)]
        low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
        scale = {
            "type": "continuous", "min": low, "max": high if high > low else low + 1.0, "calculable": True,
            "right": 6, "top": 40, "itemHeight": 220, "precision": _precision(low, high), "seriesIndex": 0,
            "inRange": {"color": list(VIRIDIS)},
        }  # fmt: skip
    data = [[i, j, number(every[i, j])] for i in range(every.shape[0]) for j in range(every.shape[1])]
    series: list[dict[str, Any]] = [
        {
            "type": "heatmap",
            "data": data,
            "progressive": 0,
            "emphasis": {"itemStyle": {"borderColor": "#000"}},
            "label": {"show": every.size <= _WRITTEN and not is_category(values), "fontSize": 11},
        }
    ]
    broken = [(int(i), int(j)) for i, j in zip(*np.nonzero(reasons != ""), strict=True)]
    if broken:
        series.append(_failed([([i, j], str(reasons[i, j])) for i, j in broken]))

    def at(which: int, index: int) -> dict[str, int]:
        place = broken[index] if which else divmod(index, every.shape[1])
        return dict(zip(keys, place, strict=True))

    options = {
        "legend": {"show": False},
        "xAxis": {"type": "category", "name": label(x), "data": [text(v) for v in x.values]},
        "yAxis": {"type": "category", "name": label(y), "data": [text(v) for v in y.values]},
        "visualMap": scale,
        "categories": names,
        "series": series,
    }
    return options, at


def _stepped(count: int) -> list[str]:
    """Colours of ordered categories."""
    return [VIRIDIS[round(k * (len(VIRIDIS) - 1) / max(count - 1, 1))] for k in range(count)]


def points(values: xr.DataArray, key: xr.DataArray, reasons: np.ndarray, *, grid: bool) -> tuple[dict[str, Any], At]:
    """A result over one key: a line or bars of a grid, points of samples; a category of the result is a row.

    Parameters
    ----------
    values : DataArray over the cases
    key : DataArray of the same length
    reasons : array of str, '' of cases that did not fail
    grid : bool, whether the cases are points of a grid along the key
    """
    words, rows = key.dtype.kind not in "iuf", is_category(values)
    names, places = categories(values) if rows else ([], np.zeros(0, int))
    y = np.where(places < 0, np.nan, places.astype(float)) if rows else values.values.astype(float)
    x = [text(v) for v in key.values] if words else [float(v) for v in key.values]
    across: dict[str, Any] = {"type": "category" if words else "value", "name": label(key), "scale": True}
    if words:
        across["data"] = list(dict.fromkeys(x))
    up: dict[str, Any] = {"type": "category" if rows else "value", "name": label(values), "scale": not words}
    if rows:
        up["data"] = names
    kind = "scatter" if rows or not grid else "bar" if words else "line"
    series: list[dict[str, Any]] = [
        {
            "type": kind, "name": "", "data": [[a, number(b)] for a, b in zip(x, y, strict=True)],
            "symbol": "circle", "symbolSize": 8, "showSymbol": True, "showAllSymbol": True, "barMaxWidth": 60,
            "itemStyle": {"color": "@1"}, "lineStyle": {"color": "@1", "width": 1.4},
        }
    ]  # fmt: skip
    broken = [int(k) for k in np.flatnonzero(reasons != "")]
    if broken:
        finite = y[np.isfinite(y)]
        foot = float(finite.min()) if finite.size and kind != "bar" else 0.0
        series.append(_failed([([x[k], foot], str(reasons[k])) for k in broken]))

    def at(which: int, index: int) -> dict[str, int]:
        return {str(key.name) if grid else "case": broken[index] if which else index}

    return {"legend": {"show": False}, "xAxis": across, "yAxis": up, "series": series}, at


def lines(
    values: xr.DataArray, key: xr.DataArray, along: xr.DataArray, reasons: np.ndarray
) -> tuple[dict[str, Any], At]:
    """A line for each value of a key, along another key or a dimension of the result such as the time.

    Parameters
    ----------
    values : DataArray over (key, along)
    key, along : DataArray
    reasons : array of str over (key, along) of cases, or over (key,); '' of cases that did not fail
    """
    x = along.values.astype(float)
    over_cases = reasons.ndim == 2
    series: list[dict[str, Any]] = []
    for k, value in enumerate(key.values):
        data = [[number(a), number(b)] for a, b in zip(x, values.values[k].astype(float), strict=True)]
        series.append(
            {
                "type": "line", "name": f"{key.name} = {text(value)}", "data": data, "showSymbol": over_cases,
                "symbol": "circle", "symbolSize": 8, "showAllSymbol": True, "triggerLineEvent": not over_cases,
                "itemStyle": {"color": f"@{k}"}, "lineStyle": {"color": f"@{k}", "width": 1.6},
            }
        )  # fmt: skip
    broken: list[tuple[int, int]] = []
    if over_cases and (reasons != "").any():
        broken = [(int(k), int(i)) for k, i in zip(*np.nonzero(reasons != ""), strict=True)]
        finite = values.values[np.isfinite(values.values)]
        foot = float(finite.min()) if finite.size else 0.0
        marked = [([number(x[i]), foot], f"{key.name} = {text(key.values[k])}: {reasons[k, i]}") for k, i in broken]
        series.append(_failed(marked))

    def at(which: int, index: int) -> dict[str, int]:
        if not over_cases:
            return {str(key.name): which}
        k, i = broken[index] if which == key.size else (which, index)
        return {str(key.name): k, str(along.name): i}

    options = {
        "legend": {"show": True},
        "xAxis": {"type": "value", "name": label(along), "scale": True},
        "yAxis": {"type": "value", "name": label(values), "scale": True},
        "series": series,
    }
    return options, at


def _precision(low: float, high: float) -> int:
    """Digits after the point of a scale's ends."""
    span = max(high - low, 1e-12)
    return int(np.clip(2 - np.floor(np.log10(span)), 0, 10))
