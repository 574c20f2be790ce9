"""Figures of a free body with blades that differ: nutation of a run, and of a study over a pay-out rate."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent_base.figures import Figure, Line, Panel

if TYPE_CHECKING:
    import xarray as xr

Array = np.ndarray
#: Nutation that a study's figure marks, deg.
BOUND = 1.0


def nutation_figure(run: Any) -> Figure:
    """Nutation over time, the path of the angular momentum in the body, and the offset of the mass centre."""
    time = run.time.values
    curves = (
        ("nutation", "spin axis of the body", 0, "-"),
        ("rate_nutation", "angular velocity", 1, "-"),
        ("nutation_threads", "spin axis, straight threads", 2, "--"),
        ("nutation_rigid", "spin axis, rigid blades", 3, ":"),
    )
    angles = [
        Line(x=time, y=np.degrees(run[name].values), label=label, color=color, style=style, width=1.2)
        for name, label, color, style in curves
        if name in run
    ]
    x, y, _ = np.degrees(run.momentum_direction.values).T
    path = [
        Line(x=x, y=y, color=0, width=0.8),
        Line(x=x[-1:], y=y[-1:], label="end", color=0, style=" ", marker="o"),
    ]
    offsets = []
    for c, axis in enumerate("xy"):
        offsets.append(Line(x=time, y=1e3 * run.mass_centre.values[:, c], label=axis, color=c, width=1.2))
        if "mass_centre_straight" not in run:
            continue
        straight, label = run.mass_centre_straight.values[:, c], f"{axis}, straight blades"
        offsets.append(Line(x=time, y=1e3 * straight, label=label, color=c, style="--", width=1.2))
    panels = [
        Panel(x_label="time, s", y_label="angle from the angular momentum, deg", lines=angles, y_zero=True),
        Panel(
            x_label="about y, towards x, deg", y_label="about x, towards y, deg", lines=path, equal=True,
            title="angular momentum in the axes of the body",
        ),
        Panel(
            x_label="time, s", y_label="offset, mm", lines=offsets, title="centre of mass of all from that of the body"
        ),
    ]  # fmt: skip
    return Figure(name="nutation", title="Nutation of the body", panels=panels, height=230.0, heights=[1.0, 1.3, 1.0])


def crossing(x: Array, y: Array, bound: float) -> float:
    """First value of x, increasing, at which y reaches a bound on straight lines between its values; NaN for none.

    Values that are NaN are passed over.
    """
    x, y = x[np.isfinite(y)], y[np.isfinite(y)]
    above = np.flatnonzero(y >= bound)
    if not above.size:
        return float("nan")
    k = int(above[0])
    if k == 0:
        return float(x[0])
    return float(x[k - 1] + (bound - y[k - 1]) / (y[k] - y[k - 1]) * (x[k] - x[k - 1]))


def difference_figure(dataset: xr.Dataset) -> Figure:
    """Largest nutation and offset of the mass centre over each run's `rate_difference`."""
    percent = 100.0 * dataset.rate_difference.values
    order = np.argsort(percent)[: np.isfinite(percent).sum()]
    x = percent[order]
    panels = []
    for what, factor, curves, bound in (
        (
            "largest nutation, deg", 180.0 / np.pi,
            {"nutation_max": "run", "nutation_threads_max": "straight threads", "nutation_rigid_max": "rigid blades"},
            BOUND,
        ),
        (
            "largest offset of the mass centre along x, mm", 1e3,
            {"mass_centre_x_abs_max": "run", "mass_centre_straight_x_abs_max": "straight blades"}, None,
        ),
    ):  # fmt: skip
        lines = [
            Line(
                x=x, y=factor * dataset[name].values[order], label=label, color=c, marker="o", style="--" if c else "-"
            )
            for c, (name, label) in enumerate(curves.items())
            if name in dataset
        ]
        title = ""
        if bound is not None and lines:
            limit = crossing(x, lines[0].y, bound)
            title = f"{bound:g} deg is reached at {limit:.2g} %" if np.isfinite(limit) else f"below {bound:g} deg"
            lines.append(Line(x=x[[0, -1]], y=np.full(2, bound), label=f"{bound:g} deg", color="0.5", style=":"))
        if lines:
            panels.append(
                Panel(x_label="difference of the pay-out rates, %", y_label=what, lines=lines, title=title, y_zero=True)
            )
    title = "Blades with different pay-out rates on a free body"
    return Figure(name="rate_difference", title=title, panels=panels, height=85.0 * len(panels))
