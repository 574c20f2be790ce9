"""Figures of a study over one key: the tip's speed for each value (Yi et al., figure 7), and when it is largest."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np

from evolvent import cases
from evolvent.errors import InputError
from evolvent.figures import Figure, Line, Panel
from evolvent.systems.wrapped_rib.show import WINDOW, comparable_string, running_mean

if TYPE_CHECKING:
    import xarray as xr

#: Variables that are drawn over time, with what is written beside them.
DRAWN = {
    "tip_speed": "tip speed, m/s",
    "tip_radius": "tip from the axis, m",
    "wrap_angle": "angle wound, rad",
    "contact_points": "contact points in contact",
    "contact_force": "contact force, N",
    "contact_impulse": "impulse of the contact, N s",
}
#: The largest tip speed and its time, as a run finds them between its samples too.
PEAK, PEAK_TIME = "tip_speed_peak", "tip_speed_peak_time"
#: Stands for the run from which a later stage starts.
UNKNOWN = "before.nc"
#: Most values of a key whose lines are told apart.
MOST = 7


def study_figures(dataset: xr.Dataset) -> dict[str, Figure]:
    """Figures of a grid over one key whose runs keep variables over time; none for other studies."""
    every = json.loads(dataset.attrs["keys"])
    keys = [key for key in every if dataset[key].size > 1]
    if dataset.attrs["sample"] != "grid" or len(keys) != 1 or dataset[keys[0]].size > MOST:
        return {}
    stages = json.loads(dataset.attrs.get("stages", "[]")) or [""]
    varied = dict(zip(every, json.loads(dataset.attrs.get("key_stages", "[]")), strict=False))
    first = varied.get(keys[0], "")  # stages before it are all the same
    found: dict[str, Figure] = {}
    for stage in stages[stages.index(first) if first else 0 :]:
        of = f"{stage}_" if stage else ""
        kept = [name for name in DRAWN if of + name in dataset and f"{of}time" in dataset[of + name].dims]
        found |= {of + name: _over_time(dataset, keys[0], name, stage) for name in kept}
        if "tip_speed" in kept and dataset[keys[0]].dtype.kind in "iuf":
            found[f"{of}peak"] = _peaks(dataset, keys[0], stage)
    return found


def _first(study: xr.Dataset, name: str, *dims: str) -> np.ndarray:
    """A variable over some dimensions, of the first rib."""
    values = study[name]
    found: np.ndarray = values.isel({dim: 0 for dim in values.dims if dim not in dims}).transpose(*dims).values
    return found


def _figure(study: xr.Dataset, key: str, title: str, stage: str, panel: Panel) -> Figure:
    """A figure of one panel, whose title names the stage and the key."""
    unit = str(study[key].attrs.get("units", "1"))
    over = key if unit in ("1", "") else f"{key} in {unit}"
    title = f"{title}{f', stage {stage}' if stage else ''}, for values of {over}"
    return Figure(name=title, title=title, panels=[panel], size=(8.0, 4.6))


def _over_time(study: xr.Dataset, key: str, name: str, stage: str) -> Figure:
    """One line for each value of the key; of forces, running means, since single samples depend on the mesh."""
    of = f"{stage}_" if stage else ""
    time, lines, dots = study[f"{of}time"].values, [], []
    for k, values in enumerate(_first(study, of + name, key, f"{of}time")):
        drawn, label = np.isfinite(values), str(study[key].values[k])
        t, y = time[drawn], values[drawn]
        if name == "contact_force" and y.size > 2:
            lines.append(Line(x=t, y=y, color=k, width=0.3))
            y, label = running_mean(t, y, WINDOW * float(time[-1] - time[0])), f"{label}, running mean"
        lines.append(Line(x=t, y=y, label=label, color=k))
        if name == "tip_speed" and of + PEAK in study and of + PEAK_TIME in study:
            at, most = (_first(study, of + peak, key)[k : k + 1] for peak in (PEAK_TIME, PEAK))
            text = "largest, between samples" if k == 0 else ""
            dots.append(Line(x=at, y=most, label=text, color=k, style="", marker="o"))
    panel = Panel(x_label="time, s", y_label=DRAWN[name], lines=lines + dots, y_zero=True)
    return _figure(study, key, DRAWN[name].partition(",")[0].capitalize(), stage, panel)


def _peaks(study: xr.Dataset, key: str, stage: str) -> Figure:
    """When the tip is fastest, beside the light string's time."""
    of, at = f"{stage}_" if stage else "", study[key].values
    if of + PEAK_TIME in study:
        peak = _first(study, of + PEAK_TIME, key)
    else:
        speed = np.nan_to_num(_first(study, f"{of}tip_speed", key, f"{of}time"), nan=-1.0)
        peak = study[f"{of}time"].values[np.argmax(speed, axis=1)]
    lines, string = [Line(x=at, y=peak, label="runs", color=1, style="", marker="o")], _strings(study, key, stage)
    if np.any(np.isfinite(string)):
        label = "light string, 98 % wound"
        lines.append(Line(x=at, y=string, label=label, color=2, style="--", marker="x", width=1.0))
    panel = Panel(x_label=key, y_label="time, s", lines=lines, y_zero=True)
    return _figure(study, key, "Time of the largest tip speed", stage, panel)


def _strings(study: xr.Dataset, key: str, stage: str) -> np.ndarray:
    """Time at which a light string is wound, for each value of the key; NaN where none is comparable."""
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
