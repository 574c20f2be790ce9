"""Figures of a study over one key: the tip's speed for each value (Yi et al., figure 7), and when it is largest."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent import cases
from evolvent.errors import InputError
from evolvent.systems.wrapped_rib.show import WINDOW, comparable_string, running_mean

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

#: Okabe and Ito's colours, as the other figures have them.
PALETTE = ("#000000", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
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
    """Figures of a grid over one key whose runs keep variables over time; none for other studies.

    Parameters
    ----------
    dataset : as `evolvent.studies.open` returns it
    """
    keys = [key for key in json.loads(dataset.attrs["keys"]) if dataset[key].size > 1]
    if dataset.attrs["sample"] != "grid" or len(keys) != 1 or dataset[keys[0]].size > MOST:
        return {}
    stages = json.loads(dataset.attrs.get("stages", "[]")) or [""]
    varied = dict(
        zip(json.loads(dataset.attrs["keys"]), json.loads(dataset.attrs.get("key_stages", "[]")), strict=False)
    )
    first = varied.get(keys[0], "")  # stages before it are all the same
    found: dict[str, Figure] = {}
    for stage in stages[stages.index(first) if first else 0 :]:
        of = f"{stage}_" if stage else ""
        kept = [name for name in DRAWN if of + name in dataset and f"{of}time" in dataset[of + name].dims]
        found |= {of + name: _over_time(dataset, keys[0], name, of) for name in kept}
        if "tip_speed" in kept and dataset[keys[0]].dtype.kind in "iuf":
            found[f"{of}peak"] = _peaks(dataset, keys[0], stage)
    return found


def _of_first_rib(study: xr.Dataset, key: str, name: str, of: str) -> np.ndarray:
    """(values of the key, nt), of a stage where `of` is its name and _."""
    values, time = study[of + name], f"{of}time"
    values = values.isel({dim: 0 for dim in values.dims if dim not in (key, time)})
    found: np.ndarray = values.transpose(key, time).values
    return found


def _alone(study: xr.Dataset, key: str, name: str) -> np.ndarray:
    """(values of the key,) of what a run has once, of its first rib."""
    values = study[name]
    found: np.ndarray = values.isel({dim: 0 for dim in values.dims if dim != key}).values
    return found


def _sheet(title: str) -> tuple[Figure, Any]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    sheet = Figure(figsize=(8.0, 4.6), layout="constrained")
    FigureCanvasAgg(sheet)
    sheet.suptitle(title, x=0.01, ha="left", fontsize=12, fontweight="bold")
    axis = sheet.subplots()
    axis.grid(alpha=0.25)
    axis.spines[["top", "right"]].set_visible(False)
    return sheet, axis


def _named(study: xr.Dataset, key: str) -> str:
    unit = str(study[key].attrs.get("units", "1"))
    return key if unit in ("1", "") else f"{key}, {unit}"


def _over_time(study: xr.Dataset, key: str, name: str, of: str) -> Figure:
    """One line for each value of the key; of forces, running means, since single samples depend on the mesh."""
    time = study[f"{of}time"].values
    what = DRAWN[name].partition(",")[0].capitalize()
    sheet, axis = _sheet(f"{what}, stage {of[:-1]}" if of else what)
    for k, values in enumerate(_of_first_rib(study, key, name, of)):
        drawn, color = np.isfinite(values), PALETTE[k % len(PALETTE)]
        y = values[drawn]
        label = str(study[key].values[k])
        if name == "contact_force" and y.size > 2:
            axis.plot(time[drawn], y, color=color, lw=0.5, alpha=0.4)
            y = running_mean(time[drawn], y, WINDOW * float(time[-1] - time[0]))
            label += ", running mean"
        axis.plot(time[drawn], y, color=color, lw=1.4, label=label)
        if name == "tip_speed" and of + PEAK in study and of + PEAK_TIME in study:
            at, most = (_alone(study, key, of + peak)[k] for peak in (PEAK_TIME, PEAK))
            axis.plot(at, most, "o", color=color, ms=4.0, label="largest, between samples" if k == 0 else None)
    axis.set_xlabel("time, s")
    axis.set_ylabel(DRAWN[name])
    axis.set_ylim(bottom=min(0.0, axis.get_ylim()[0]) if np.nanmin(study[of + name].values) < 0.0 else 0.0)
    axis.legend(frameon=False, fontsize=9, title=_named(study, key))
    return sheet


def _peaks(study: xr.Dataset, key: str, stage: str) -> Figure:
    """When the tip is fastest, beside the light string's time."""
    of = f"{stage}_" if stage else ""
    sheet, axis = _sheet("Time of the largest tip speed" + (f", stage {stage}" if stage else ""))
    time, at = study[f"{of}time"].values, study[key].values
    if of + PEAK_TIME in study:
        peak = _alone(study, key, of + PEAK_TIME)
    else:
        speed = np.nan_to_num(_of_first_rib(study, key, "tip_speed", of), nan=-1.0)
        peak = time[np.argmax(speed, axis=1)]
    axis.plot(at, peak, "o", color=PALETTE[1], label="runs")
    string = _strings(study, key, stage)
    if np.any(np.isfinite(string)):
        axis.plot(at, string, "x--", color=PALETTE[2], lw=1.0, label="light string, 98 % wound")
    axis.set_xlabel(_named(study, key))
    axis.set_ylabel("time, s")
    axis.set_ylim(bottom=0.0)
    axis.legend(frameon=False, fontsize=9)
    return sheet


def _strings(study: xr.Dataset, key: str, stage: str) -> np.ndarray:
    """Time at which a light string is wound, for each value of the key; NaN where none is comparable."""
    content = cases.parse_yaml(study.attrs["study"], "the study")
    changes = dict(content.get("set") or {})
    for k, one in enumerate(content.get("stages") or []):
        if one["name"] == stage:
            changes |= (one.get("set") or {}) | ({"start": UNKNOWN} if k else {})
    path = key.removeprefix(f"{stage}.") if stage else key
    found = []
    for value in study[key].values:
        try:
            case = cases.load(content["case"], changes | {path: value.item()})
        except InputError:
            found.append(np.nan)
            continue
        string = comparable_string(case)
        found.append(string.end_time if string is not None else np.nan)
    return np.array(found)
