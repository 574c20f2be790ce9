"""Figures of a study: lines over one key or over time, maps over two, marks over samples; and those of the system."""

from __future__ import annotations

import dataclasses
import json
import os
import re
import textwrap
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from evolvent import cases
from evolvent_base import progress
from evolvent_base.figures import Figure as Described, Line, Map, Note, Panel, stacked
from evolvent_base.files import make_folder, write_file
from evolvent_base.plots import content, sheet
from evolvent_base.units import unit_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Most values of a key at which a map has ticks, and values in its cells.
_TICKS = 9
#: Most outputs that are drawn, and most values of a key whose lines over time can be distinguished.
_MOST, _LINES = 24, 7
#: Letters that a line of the title holds.
_TITLE = 72


def write(dataset: xr.Dataset, folder: str | os.PathLike[str], *, kind: str = "png") -> list[str]:
    """Write the figures of a study into a folder; returns their paths.

    Parameters
    ----------
    dataset : of `evolvent.design.studies.open`
    folder : str
    kind : str, one of `evolvent_base.plots.FORMATS`

    Raises
    ------
    InputError
        If the folder cannot be written into.
    """
    found = of_system(dataset)
    if not cases.system(dataset.attrs["system"]).study_figures(dataset):
        found = figures(dataset) | found
    make_folder(folder)
    paths = []
    for name, figure in progress.track(list(found.items()), "drawing figures"):
        path = os.path.join(os.fspath(folder), f"{name}.{kind}")
        write_file(path, content(figure, kind))
        paths.append(path)
    return paths


def of_system(dataset: xr.Dataset) -> dict[str, Figure]:
    """Figures of variables over time, and those that a study's own system has for it."""
    found = over_time(dataset) | cases.system(dataset.attrs["system"]).study_figures(dataset)
    return {name: sheet(one) if isinstance(one, Described) else one for name, one in found.items()}


def figures(dataset: xr.Dataset) -> dict[str, Figure]:
    """The figures of `described`, drawn, by the names of their outputs."""
    return {figure.name: sheet(figure) for figure in described(dataset)}


def described(dataset: xr.Dataset) -> Iterator[Described]:
    """One figure for every output, over the keys that vary; of an output that is no number, the entry that varies most.

    Over one key the components of a vector are lines of one figure.

    Parameters
    ----------
    dataset : of `evolvent.design.studies.open`
    """
    grid = dataset.attrs["sample"] == "grid"
    keys = [key for key in json.loads(dataset.attrs["keys"]) if dataset[key].size > 1]
    shown = keys[:2] if grid else ["case"]
    dataset = dataset.sortby([key for key in shown if grid and dataset[key].dtype.kind in "iuf"])
    count = 0
    for name, variable in dataset.data_vars.items():
        if not (keys and set(shown) <= set(variable.dims) and variable.dtype.kind == "f" and count < _MOST):
            continue
        rest = [str(dim) for dim in variable.dims if dim not in shown and variable.sizes[dim] > 1]
        drawn = _most_varying(variable, shown)
        if np.unique(drawn.values[~np.isnan(drawn.values)]).size > 1:
            lines = variable.isel({d: 0 for d in variable.dims if d not in (*shown, *rest)})
            together = grid and len(keys) == 1 and rest == ["axis"]
            count += 1
            figure = _figure(lines if together else drawn, keys, rest, grid)
            yield dataclasses.replace(figure, name=re.sub(r"\W", "_", str(name)))


def _most_varying(variable: xr.DataArray, shown: list[str]) -> xr.DataArray:
    """The entry, over the dimensions that are not shown, with the largest range over those that are."""
    rest = [d for d in variable.dims if d not in shown]
    if not rest:
        return variable
    ranges = (variable.max(shown) - variable.min(shown)).fillna(-1.0)
    at = np.unravel_index(int(np.argmax(ranges.transpose(*rest).values)), [variable.sizes[d] for d in rest])
    return variable.isel({dim: int(k) for dim, k in zip(rest, at, strict=True)})


def over_time(dataset: xr.Dataset) -> dict[str, Described]:
    """Variables that a grid over one key keeps over time, a line for each value; of several entries, the first."""
    keys = [key for key in json.loads(dataset.attrs["keys"]) if dataset[key].size > 1]
    if dataset.attrs["sample"] != "grid" or len(keys) != 1 or dataset[keys[0]].size > _LINES:
        return {}
    key, found = keys[0], {}
    for name, variable in dataset.data_vars.items():
        times = [dim for dim in map(str, variable.dims) if re.fullmatch(r"(.*_)?time", dim)]
        if key not in variable.dims or len(times) != 1 or variable.dtype.kind != "f":
            continue
        drawn = variable.isel({dim: 0 for dim in variable.dims if dim not in (key, times[0])}).transpose(key, times[0])
        if np.array_equal(drawn.values, np.broadcast_to(drawn.values[:1], drawn.shape), equal_nan=True):
            continue
        lines = []
        for k, (value, y) in enumerate(zip(dataset[key].values, drawn.values, strict=True)):
            seen = np.isfinite(y)
            lines.append(Line(x=dataset[times[0]].values[seen], y=y[seen], label=str(value), color=k))
        own = re.sub(r"\W", "_", str(name))
        title = f"{own}, for values of {_label(dataset[key])}"
        panel = Panel(x_label="time, s", y_label=_label(variable), lines=lines, y_zero=True)
        found[own] = Described(name=own, title=title, panels=[panel], height=92.0)
    return found


def _figure(drawn: xr.DataArray, keys: list[str], rest: list[str], grid: bool) -> Described:
    """A line for each component, a map, or a panel of marks for each key; of the dimensions `rest` one entry."""
    panels, parted = [], "axis" in drawn.dims
    for key in keys[:1] if grid else keys:
        x, x_names = _along(drawn[key])
        axes: dict[str, Any] = {"x_label": _label(drawn[key]), "x_names": x_names}
        if grid and len(keys) > 1:
            y, axes["y_names"] = _along(drawn[keys[1]])
            values = drawn.transpose(key, keys[1]).values
            axes["map"] = Map(x=x, y=y, values=values, label=_label(drawn))
            axes["x_names"], axes["y_names"] = axes["x_names"] or _ticks(x), axes["y_names"] or _ticks(y)
            panels.append(Panel(y_label=_label(drawn[keys[1]]), lines=[], notes=_in_cells(x, y, values), **axes))
            continue
        lines = []
        for k, one in enumerate(drawn.transpose("axis", key)) if parted else [(0 if grid else 1, drawn)]:
            label = str(one["axis"].item()) if parted and "axis" in one.coords else ""
            lines.append(Line(x=x, y=one.values, marker="o", style="-" if grid else "", color=k, label=label))
        panels.append(Panel(y_label=_label(drawn), lines=lines, **axes))
    if rest and not parted:
        at = (
            f"{_label(drawn[dim])} = {drawn[dim].item()}" if dim in drawn.coords else f"{dim}: that varies most"
            for dim in rest
        )
        panels[0] = dataclasses.replace(panels[0], title=f"at {', '.join(at)}")
    height = 100.0 if grid else stacked(len(keys))
    title = "\n".join(textwrap.wrap(str(drawn.attrs.get("long_name", drawn.name)), _TITLE))
    return Described(name=str(drawn.name), title=title, panels=panels, height=height)


def _ticks(values: np.ndarray) -> dict[float, str] | None:
    """Ticks of a map at the values that were run; those of the axis where they are many."""
    return {float(value): f"{value:.4g}" for value in values} if values.size <= _TICKS else None


def _in_cells(x: np.ndarray, y: np.ndarray, values: np.ndarray) -> list[Note]:
    """The value of each cell of a map as text in it; none where the cells are many."""
    if max(values.shape) > _TICKS:
        return []
    return [
        Note(at=(float(x[i]), float(y[k])), text=f"{values[i, k]:.3g}")
        for i, k in np.ndindex(values.shape)
        if np.isfinite(values[i, k])
    ]


def _along(values: xr.DataArray) -> tuple[np.ndarray, dict[float, str] | None]:
    """Positions of a key's values on an axis, and the names of words, which stand side by side."""
    if values.dtype.kind in "iuf":
        return values.values, None
    words = list(dict.fromkeys(values.values.tolist()))
    places = np.array([words.index(v) for v in values.values.tolist()], dtype=float)
    return places, {float(k): str(word) for k, word in enumerate(words)}


def _label(values: xr.DataArray) -> str:
    """Name with unit; keys of a case have theirs as the case writes them, results that of their variable."""
    name, colon, _ = str(values.attrs.get("long_name", "")).partition(": ")
    name = name if colon else str(values.name)
    unit = str(values.attrs.get("units", "1"))
    unit = unit if "/" in unit or "^" in unit else unit_text(unit)
    return name if unit in ("1", "") else f"{name}, {unit}"
