"""Figure of a study over one key: when the tip is fastest, beside a string without bending stiffness (Yi, figure 7)."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np

from evolvent import cases
from evolvent.base.errors import InputError
from evolvent.results.figures import Figure, Line, Panel
from evolvent.systems.wrapped_rib.show import comparable_string

if TYPE_CHECKING:
    import xarray as xr

#: Stands for the run from which a later stage starts.
UNKNOWN = "before.nc"


def study_figures(dataset: xr.Dataset) -> dict[str, Figure]:
    """Time of the largest tip speed over the key of a grid over one key, for each stage that it is kept of."""
    keys = [key for key in json.loads(dataset.attrs["keys"]) if dataset[key].size > 1]
    if dataset.attrs["sample"] != "grid" or len(keys) != 1 or dataset[keys[0]].dtype.kind not in "iuf":
        return {}
    found = {}
    for stage in json.loads(dataset.attrs.get("stages", "[]")) or [""]:
        name = f"{stage}_tip_speed_peak_time".lstrip("_")
        if name in dataset and keys[0] in dataset[name].dims:
            found[f"{stage}_peak".lstrip("_")] = _peaks(dataset, keys[0], name, stage)
    return found


def _peaks(study: xr.Dataset, key: str, name: str, stage: str) -> Figure:
    """When the tip of the first rib is fastest, and when a string is wound."""
    at, string, unit = study[key].values, _strings(study, key, stage), str(study[key].attrs.get("units", "1"))
    peak = study[name].isel({dim: 0 for dim in study[name].dims if dim != key}).values
    lines = [Line(x=at, y=peak, label="runs", color=1, style="", marker="o")]
    if np.any(np.isfinite(string)):
        lines.append(Line(x=at, y=string, label="string, 98 % wound", color=2, style="--", marker="x", width=1.0))
    title = f"Time of the largest tip speed{f', stage {stage}' if stage else ''}"
    label = key if unit in ("1", "") else f"{key}, {unit}"
    panel = Panel(x_label=label, y_label="time, s", lines=lines, y_zero=True)
    return Figure(name=name, title=title, panels=[panel], height=92.0)


def _strings(study: xr.Dataset, key: str, stage: str) -> np.ndarray:
    """Time at which a string is wound, for each value of the key; NaN where none is comparable."""
    content = cases.parse_yaml(study.attrs["study"], "the study")
    changes = dict(content.get("set") or {})
    for k, one in enumerate(content.get("stages") or []):
        if one["name"] == stage:
            changes |= (one.get("set") or {}) | ({"start": UNKNOWN} if k else {})
    path = key.removeprefix(f"{stage}.") if stage else key

    def end_time(value: object) -> float:
        try:
            string = comparable_string(cases.load(content["case"], changes | {path: value}))
        except InputError:
            return np.nan
        return np.nan if string is None else string.end_time

    return np.array([end_time(value.item()) for value in study[key].values])
