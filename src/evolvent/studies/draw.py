"""Figures of a study: lines over one key, maps over two, marks over drawn samples; or what the system draws."""

from __future__ import annotations

import dataclasses
import io
import json
import os
import pathlib
import re
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from evolvent import cases
from evolvent.figures import Figure as Described
from evolvent.figures import Line, Map, Panel
from evolvent.plots import sheet
from evolvent.results import make_folder, writing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Most outputs that are drawn.
_MOST = 24


def write(dataset: xr.Dataset, folder: str | os.PathLike[str]) -> list[str]:
    """Write the figures of a study into a folder as PNG; returns their paths.

    Raises
    ------
    InputError
        If the folder cannot be written into.
    """
    found = of_system(dataset) or figures(dataset)
    make_folder(folder)
    paths = []
    for name, figure in found.items():
        path = os.path.join(os.fspath(folder), f"{name}.png")
        with writing(path) as temporary:
            pathlib.Path(temporary).write_bytes(picture(figure))
        paths.append(path)
    return paths


def of_system(dataset: xr.Dataset) -> dict[str, Figure]:
    """The figures that a study's own system has for it; none where it has none for such a study."""
    found = cases.system(dataset.attrs["system"]).study_figures(dataset)
    return {name: sheet(one) if isinstance(one, Described) else one for name, one in found.items()}


def picture(figure: Figure) -> bytes:
    """A figure as the content of a PNG file."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    FigureCanvasAgg(figure)
    content = io.BytesIO()
    figure.savefig(content, format="png", dpi=130)
    return content.getvalue()


def figures(dataset: xr.Dataset) -> dict[str, Figure]:
    """One figure for every output, over the keys that vary; of an output that is no number, its first entry.

    Parameters
    ----------
    dataset : of `evolvent.studies.open`
    """
    grid = dataset.attrs["sample"] == "grid"
    keys = [key for key in json.loads(dataset.attrs["keys"]) if dataset[key].size > 1]
    shown = keys[:2] if grid else ["case"]
    found: dict[str, Figure] = {}
    for name, variable in dataset.data_vars.items():
        drawn = variable.isel({dim: 0 for dim in variable.dims if dim not in shown})
        numeric = set(shown) <= set(variable.dims) and variable.dtype.kind == "f"
        varies = numeric and np.unique(drawn.values[~np.isnan(drawn.values)]).size > 1
        if varies and keys and len(found) < _MOST:
            rest = [str(dim) for dim in variable.dims if dim not in shown and variable.sizes[dim] > 1]
            found[re.sub(r"\W", "_", str(name))] = sheet(_figure(drawn, keys, rest, grid))
    return found


def _figure(drawn: xr.DataArray, keys: list[str], rest: list[str], grid: bool) -> Described:
    """A line, a map, or a panel of marks for each key; `rest` are dimensions at whose beginning it is drawn."""
    panels = []
    for key in keys[:1] if grid else keys:
        x, x_names = _along(drawn[key])
        axes: dict[str, Any] = {"x_label": _label(drawn[key]), "x_names": x_names}
        if grid and len(keys) > 1:
            y, axes["y_names"] = _along(drawn[keys[1]])
            axes["map"] = Map(x=x, y=y, values=drawn.transpose(key, keys[1]).values, label=_label(drawn))
            panels.append(Panel(y_label=_label(drawn[keys[1]]), lines=[], **axes))
            continue
        line = Line(x=x, y=drawn.values, marker="o", style="-" if grid else "", color=0 if grid else 1)
        panels.append(Panel(y_label=_label(drawn), lines=[line], **axes))
    if rest:
        at = (f"{_label(drawn[dim])} = {drawn[dim].item()}" if dim in drawn.coords else f"{dim}: first" for dim in rest)
        panels[0] = dataclasses.replace(panels[0], title=f"at {', '.join(at)}")
    size = (7.0, 5.0) if grid else (7.0, 0.6 + 2.4 * len(keys))
    title = str(drawn.attrs.get("long_name", drawn.name))
    return Described(name=str(drawn.name), title=title, panels=panels, size=size)


def _along(values: xr.DataArray) -> tuple[np.ndarray, dict[float, str] | None]:
    """Places of a key's values on an axis, and the names of words, which stand side by side."""
    if values.dtype.kind in "iuf":
        return values.values, None
    words = list(dict.fromkeys(values.values.tolist()))
    places = np.array([words.index(v) for v in values.values.tolist()], dtype=float)
    return places, {float(k): str(word) for k, word in enumerate(words)}


def _label(values: xr.DataArray) -> str:
    """Name with unit."""
    unit = str(values.attrs.get("units", "1"))
    return str(values.name) if unit in ("1", "") else f"{values.name}, {unit}"
