"""The figure of a fitted Prony series."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from evolvent.design.calibration.relaxation.fitted import YEARS, Fitted
from evolvent_base.figures import Figure, Line, Panel, over_log_time, stacked
from evolvent_base.scales import YEAR, celsius

Array = np.ndarray
#: Points of a curve, and of a line of the series, that are drawn.
_POINTS, _LINE = 300, 200
#: Curves that have a colour of the palette each; more are on the scale of colours.
_PALETTE = 6


def figure(found: Fitted) -> Figure:
    """Data and fit over the logarithm of time, the master curve of several temperatures, and residuals."""
    unit = f", {found.measured.unit}" if found.measured.unit else ""
    several = found.temperatures.size > 1
    at = f" at {celsius(found.reference or 0.0)}" if several else ""
    data, fit, master, off = [], [], [], []
    for k, one in enumerate(found.measured.curves):
        label = one.label.strip("'") if one.temperature is None else celsius(one.temperature)
        count = len(found.measured.curves)
        color: int | float = k + 1 if count <= _PALETTE else k / (count - 1)
        rows = _few(one.times, np.flatnonzero(one.times > 0.0))
        points: Any = {"style": "", "marker": ".", "color": color, "label": label if count > 1 else "measured"}
        fine = np.geomspace(one.times[one.times > 0.0][0], one.times[-1], _LINE)
        data.append(Line(x=one.times[rows], y=one.forces[rows], **points))
        line = "series" if k == 0 else ""
        fit.append(Line(x=fine, y=found.modelled(k, fine), label=line, color="black", width=1.0))
        reduced, whole = found.reduced(k), found.whole(k)
        master.append(Line(x=reduced[rows], y=one.forces[rows] / whole, **points))
        off.append(Line(x=reduced[rows], y=found.residuals[k][rows], **points | {"label": ""}))
    time = np.geomspace(found.shortest, found.longest, _LINE)
    left = np.array([found.share_left(float(t)) for t in time])
    master.append(Line(x=time, y=left[:, 0], label="series", color="black", width=1.0))
    for column, label in ((2, "95 % bounds"), (3, "")):
        master.append(Line(x=time, y=left[:, column], label=label, color="black", style=":", width=0.8))
    years = YEARS * YEAR
    if years > found.longest:
        then = np.geomspace(found.longest, years, 50)
        beyond = np.array([found.share_left(float(t)).value for t in then])
        master.append(Line(x=then, y=beyond, label="beyond the data", color="black", style="--", width=0.8))
    off.append(Line(x=time[[0, -1]], y=np.zeros(2), color="grey", width=0.8))
    panels = [_panel("time", f"force{unit}", [*data, *fit])]
    if several:
        panels.append(_panel(f"time{at}", "share of the instantaneous force", master))
    panels.append(_panel(f"time{at}", f"series minus measured{unit}", off))
    title = "Relaxation, Prony series and residuals"
    return Figure(name="relaxation", title=title, panels=panels, height=stacked(len(panels)))


def _panel(x_label: str, y_label: str, lines: Sequence[Line]) -> Panel:
    """Lines over the logarithm of time."""
    first, last = min(float(one.x[0]) for one in lines), max(float(one.x[-1]) for one in lines)
    return Panel(y_label=y_label, lines=lines, **over_log_time(x_label, first, last))


def _few(times: Array, rows: Array) -> Array:
    """Some of many rows, evenly over the logarithm of time."""
    if rows.size <= _POINTS:
        return rows
    wanted = np.geomspace(times[rows[0]], times[rows[-1]], _POINTS)
    found: Array = np.unique(rows[np.searchsorted(times[rows], wanted).clip(0, rows.size - 1)])
    return found
