"""Figures of a study: lines over one key or over time, maps over two, marks over samples; and those of the system."""

from __future__ import annotations

import io
import json
import os
import pathlib
import re
import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from evolvent import cases
from evolvent.figures import Figure as Described
from evolvent.figures import Line, Panel
from evolvent.plots import PALETTE, sheet
from evolvent.results import make_folder, writing
from evolvent.units import unit_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Most outputs that are drawn, and most values of a key whose lines over time can be distinguished.
_MOST, _LINES = 24, 7
#: Letters that a line of the title holds.
_TITLE = 72


def write(dataset: xr.Dataset, folder: str | os.PathLike[str]) -> list[str]:
    """Write the figures of a study into a folder as PNG; returns their paths.

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
    for name, figure in found.items():
        path = os.path.join(os.fspath(folder), f"{name}.png")
        with writing(path) as temporary:
            pathlib.Path(temporary).write_bytes(picture(figure))
        paths.append(path)
    return paths


def of_system(dataset: xr.Dataset) -> dict[str, Figure]:
    """Figures of variables over time, and those that a study's own system has for it."""
    found = over_time(dataset) | cases.system(dataset.attrs["system"]).study_figures(dataset)
    return {name: sheet(one) if isinstance(one, Described) else one for name, one in found.items()}


def picture(figure: Figure) -> bytes:
    """A figure as the content of a PNG file."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    FigureCanvasAgg(figure)
    content = io.BytesIO()
    figure.savefig(content, format="png", dpi=130)
    return content.getvalue()


def figures(dataset: xr.Dataset) -> dict[str, Figure]:
    """One figure for every output, over the keys that vary; of an output that is no number, the entry that varies most.

    Over one key the components of a vector are lines of one figure.

    Parameters
    ----------
    dataset : of `evolvent.studies.open`
    """
    grid = dataset.attrs["sample"] == "grid"
    keys = [key for key in json.loads(dataset.attrs["keys"]) if dataset[key].size > 1]
    shown = keys[:2] if grid else ["case"]
    dataset = dataset.sortby([key for key in shown if grid and dataset[key].dtype.kind in "iuf"])
    found: dict[str, Figure] = {}
    for name, variable in dataset.data_vars.items():
        if not (keys and set(shown) <= set(variable.dims) and variable.dtype.kind == "f" and len(found) < _MOST):
            continue
        rest = [str(dim) for dim in variable.dims if dim not in shown and variable.sizes[dim] > 1]
        drawn = _most_varying(variable, shown)
        if np.unique(drawn.values[~np.isnan(drawn.values)]).size > 1:
            lines = variable.isel({d: 0 for d in variable.dims if d not in (*shown, *rest)})
            together = grid and len(keys) == 1 and rest == ["axis"]
            found[re.sub(r"\W", "_", str(name))] = _figure(lines if together else drawn, keys, rest, grid)
    return found


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
        found[own] = Described(name=own, title=title, panels=[panel], size=(8.0, 4.6))
    return found


def _figure(drawn: xr.DataArray, keys: list[str], rest: list[str], grid: bool) -> Figure:
    """A line for each component, a map, or a panel of marks for each key; of the dimensions `rest` one entry."""
    from matplotlib.figure import Figure as Sheet

    what = "\n".join(textwrap.wrap(str(drawn.attrs.get("long_name", drawn.name)), _TITLE))
    sheet = Sheet(figsize=(7.0, 5.0) if grid else (7.0, 0.6 + 2.4 * len(keys)), layout="constrained")
    sheet.suptitle(what, x=0.01, ha="left", fontsize=12, fontweight="bold")
    axes = sheet.subplots(1 if grid else len(keys), 1, squeeze=False)[:, 0]
    for axis, key in zip(axes, keys, strict=False):
        (x,) = _along(axis, "x", drawn[key])
        if grid and len(keys) > 1:
            (y,) = _along(axis, "y", drawn[keys[1]])
            values = np.ma.masked_invalid(drawn.transpose(keys[1], key).values)
            axis.set_facecolor("0.85")  # what failed is grey
            mesh = axis.pcolormesh(x, y, values, shading="nearest", cmap="viridis")
            sheet.colorbar(mesh, ax=axis, label=_label(drawn))
        else:
            parted = "axis" in drawn.dims
            for k, one in enumerate(drawn.transpose("axis", key)) if parted else [(0 if grid else 1, drawn)]:
                label = str(one["axis"].item()) if parted and "axis" in one.coords else None
                axis.plot(x, one.values, "o-" if grid else "o", color=PALETTE[k], markersize=3.5, label=label)
            if parted:
                axis.legend(frameon=False)
            axis.set_ylabel(_label(drawn))
            axis.grid(alpha=0.25)
    if rest and "axis" not in drawn.dims:
        chosen = (
            f"{_label(drawn[dim])} = {drawn[dim].item()}" if dim in drawn.coords else f"{dim}: that varies most"
            for dim in rest
        )
        axes[0].set_title(f"at {', '.join(chosen)}", loc="left", fontsize=10)
    return sheet


def _along(axis: Any, side: str, values: xr.DataArray) -> tuple[np.ndarray]:
    """Places of a key's values on an axis, which is labelled; words stand side by side."""
    getattr(axis, f"set_{side}label")(_label(values))
    if values.dtype.kind in "iuf":
        return (values.values,)
    words = list(dict.fromkeys(values.values.tolist()))
    getattr(axis, f"set_{side}ticks")(range(len(words)), words)
    return (np.array([words.index(v) for v in values.values.tolist()], dtype=float),)


def _label(values: xr.DataArray) -> str:
    """Name with unit; keys of a case have theirs as the case writes them."""
    unit = str(values.attrs.get("units", "1"))
    unit = unit if "/" in unit or "^" in unit else unit_text(unit)
    return str(values.name) if unit in ("1", "") else f"{values.name}, {unit}"
