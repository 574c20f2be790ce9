"""Figures of a study: lines over one key, maps over two, marks over drawn samples; or what the system draws."""

from __future__ import annotations

import json
import os
import re
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from evolvent import cases
from evolvent.plots import PALETTE
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
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    own = getattr(cases.system(dataset.attrs["system"]), "study_figures", None)
    found = figures(dataset) if own is None else own(dataset)
    make_folder(folder)
    paths = []
    for name, figure in found.items():
        FigureCanvasAgg(figure)
        path = os.path.join(os.fspath(folder), f"{name}.png")
        with writing(path) as temporary:
            figure.savefig(temporary, format="png", dpi=130)
        paths.append(path)
    return paths


def figures(dataset: xr.Dataset) -> dict[str, Figure]:
    """One figure for every output that is one number a case, over the keys that vary.

    Parameters
    ----------
    dataset : of `evolvent.studies.open`
    """
    grid = dataset.attrs["sample"] == "grid"
    dims = dataset["status"].dims
    keys = [key for key in json.loads(dataset.attrs["keys"]) if dataset[key].size > 1]
    first = {name: 0 for name in dims if name not in keys or keys.index(str(name)) > 1}
    found: dict[str, Figure] = {}
    for name, variable in dataset.data_vars.items():
        numeric = variable.dims == dims and variable.dtype.kind == "f"
        varies = numeric and np.unique(variable.values[~np.isnan(variable.values)]).size > 1
        if varies and keys and len(found) < _MOST:
            drawn = variable.isel(first) if grid else variable
            found[re.sub(r"\W", "_", str(name))] = _figure(dataset, drawn, keys, grid)
    return found


def _figure(dataset: xr.Dataset, drawn: xr.DataArray, keys: list[str], grid: bool) -> Figure:
    """Lines, a map, or a panel of marks for each key."""
    from matplotlib.figure import Figure as Sheet

    what = str(drawn.attrs.get("long_name", drawn.name))
    sheet = Sheet(figsize=(7.0, 5.0) if grid else (7.0, 0.6 + 2.4 * len(keys)), layout="constrained")
    sheet.suptitle(what, x=0.01, ha="left", fontsize=12, fontweight="bold")
    if not grid:
        for axis, key in zip(np.atleast_1d(np.asarray(sheet.subplots(len(keys), 1))), keys, strict=True):
            axis.plot(*_along(axis, "x", dataset[key]), drawn.values, "o", color=PALETTE[1], markersize=3.5, alpha=0.7)
            axis.set_ylabel(_label(drawn))
            axis.grid(alpha=0.25)
        return sheet
    axis = sheet.subplots()
    if len(keys) == 1:
        axis.plot(*_along(axis, "x", dataset[keys[0]]), drawn.values, "o-", color=PALETTE[0], markersize=3.0)
        axis.set_ylabel(_label(drawn))
        axis.grid(alpha=0.25)
    else:
        (x,), (y,) = _along(axis, "x", dataset[keys[1]]), _along(axis, "y", dataset[keys[0]])
        values = drawn.transpose(keys[0], keys[1]).values
        axis.set_facecolor("0.85")  # what failed is grey
        mesh = axis.pcolormesh(x, y, np.ma.masked_invalid(values), shading="nearest", cmap="viridis")
        sheet.colorbar(mesh, ax=axis, label=_label(drawn))
    if len(keys) > 2:
        told = ", ".join(f"{_label(dataset[key], key)} = {dataset[key].values[0]}" for key in keys[2:])
        axis.set_title(f"at {told}", loc="left", fontsize=10)
    return sheet


def _along(axis: Any, side: str, values: xr.DataArray) -> tuple[np.ndarray]:
    """Places of a key's values on an axis, which is labelled; words stand side by side."""
    getattr(axis, f"set_{side}label")(_label(values, str(values.name)))
    if values.dtype.kind in "iuf":
        return (values.values,)
    words = list(dict.fromkeys(values.values.tolist()))
    getattr(axis, f"set_{side}ticks")(range(len(words)), words)
    return (np.array([words.index(v) for v in values.values.tolist()], dtype=float),)


def _label(values: xr.DataArray, name: str = "") -> str:
    """Name with unit."""
    unit = str(values.attrs.get("units", "1"))
    shown = name or str(values.attrs.get("long_name", values.name))
    return shown if unit in ("1", "") else f"{shown}, {unit}"
