"""Figure of a study that keeps the tip's lag over time: its change from one value of a key to the next."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np

from evolvent_base.figures import Figure, Line, Panel
from evolvent_papers.heliogyro.free_figures import difference_figure

if TYPE_CHECKING:
    import xarray as xr

#: Time from which lags are compared, s: before it the blade has hardly left the spool.
SINCE = 1.0


def study_figures(dataset: xr.Dataset) -> dict[str, Figure]:
    """Nutation over the difference of the rates of blades, or the change of the tip's lag over a grid's last key.

    The latter is the largest change to the next value; it has a line for each value of the other key.
    """
    keys = [key for key in json.loads(dataset.attrs["keys"]) if dataset[key].size > 1]
    if len(keys) == 1 and {"rate_difference", "nutation_max"} <= set(dataset):
        drawn = bool(np.isfinite(dataset.rate_difference.values).any())
        return {"rate_difference": difference_figure(dataset)} if drawn else {}
    if dataset.attrs["sample"] != "grid" or not 1 <= len(keys) <= 2 or "tip_lag" not in dataset:
        return {}
    *others, key = keys
    if "time" not in dataset.tip_lag.dims or dataset[key].dtype.kind not in "iuf":
        return {}
    lag = dataset.tip_lag.isel({dim: 0 for dim in dataset.tip_lag.dims if dim not in (*keys, "time")})
    change = np.degrees(np.abs(lag.where(lag.time >= SINCE).diff(key)).max("time"))
    values = dataset[key].values
    lines = []
    for k, other in enumerate(dataset[others[0]].values if others else [None]):
        y = (change if other is None else change.sel({others[0]: other})).values
        label = "" if other is None else f"{others[0]} = {other:g}"
        lines.append(Line(x=values[:-1], y=np.maximum(y, 1e-12), label=label, color=k, marker="o"))
    unit = str(dataset[key].attrs.get("units", "1"))
    panel = Panel(
        x_label=key if unit in ("1", "") else f"{key}, {unit}",
        y_label="change of the lag, deg",
        lines=lines,
        title=f"largest after {SINCE:g} s, to the next value of the key",
        log=True,
        log_x=bool(values.min() > 0.0 and values.max() > 20.0 * values.min()),
    )
    title = "Change of the lag of the tip from one value to the next"
    return {"lag_change": Figure(name="lag_change", title=title, panels=[panel], height=92.0)}
