"""What to show of a run: numbers and figures; and of a study."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent import cases
from evolvent.closed_forms import payout_buckling, payout_slack
from evolvent.view import show, table
from evolvent_base.figures import Figure, Line, Number, Panel, numbers_of
from evolvent_papers.film_blade.case import Case

if TYPE_CHECKING:
    import xarray as xr

#: Lengths at which curves of closed forms are computed.
POINTS = 60


def numbers(run: Any) -> list[Number]:
    """Where the blade buckles, the limits at the end's length, and what a thread does."""
    buckled, twist = float(run.buckled_length), float(np.degrees(run.twist.values.max()))
    where = "it does not" if math.isnan(buckled) else f"{buckled:.4g} m"
    end, slack = float(run.limit_estimate), float(run.limit_slack)
    lag, fastest = float(np.degrees(run.thread_lag)), float(run.thread_limit)
    rows: list[tuple[Any, ...]] = [
        ("length at which it buckles", where, (buckled, "m")),
        ("largest twist", f"{twist:.3g} deg", (twist, "deg")),
        ("spin at the end", f"{run.body_rate.values[-1]:.5g} rad/s", (run.body_rate.values[-1], "rad/s")),
        ("largest rate for the whole length", f"{1e3 * end:.4g} mm/s (closed form)", (1e3 * end, "mm/s")),
        ("the same without a slack edge", f"{1e3 * slack:.4g} mm/s (closed form)", (1e3 * slack, "mm/s")),
        (
            "a thread",
            f"lag {lag:.4g} deg; below {1e3 * fastest:.4g} mm/s",
            (lag, "deg", "lag"),
            (1e3 * fastest, "mm/s", "largest rate"),
        ),
    ]
    return numbers_of(rows) + table.numbers(run)


def figures(run: Any) -> list[Figure]:
    """Spin, lag, twist and edgewise moment over the length that is out."""
    out = run.deployed_length.values
    lags = [
        Line(x=out, y=np.degrees(run.tip_lag.values), label="film", color=0),
        Line(x=out[[0, -1]], y=np.degrees(np.full(2, float(run.thread_lag))), label="thread", color=1, style="--"),
    ]
    label = "length out, m"
    panels = [
        Panel(x_label=label, y_label="spin, rad/s", lines=[Line(x=out, y=run.body_rate.values)], y_zero=True),
        Panel(x_label=label, y_label="lag of the tip, deg", lines=lags),
        Panel(x_label=label, y_label="largest twist, deg", lines=[Line(x=out, y=np.degrees(run.twist.values))]),
        Panel(
            x_label=label, y_label="moment over N w/6", lines=[Line(x=out, y=run.edge_share.values)],
            title="edgewise moment; 1: an edge is slack",
        ),
    ]  # fmt: skip
    own = Figure(name="film-blade", title="Film blade that is paid out", panels=panels, columns=2, height=150.0)
    return [own, *show.figures(run)]


def limits(case: Case, lengths: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Largest rates over lengths by closed forms, m/s: before buckling, and before an edge is slack."""
    found = [
        [form(case.film, case.rotor, float(out), case.momentum, root=case.blade.root) for out in lengths]
        for form in (payout_buckling, payout_slack)
    ]
    return np.array(found[0]), np.array(found[1])


def study_figures(dataset: xr.Dataset) -> dict[str, Figure]:
    """Rate over the length at which a blade buckles, of a grid over the rate and one other key, beside closed forms."""
    keys = [key for key in json.loads(dataset.attrs["keys"]) if dataset[key].size > 1]
    others = [key for key in keys if key != "payout.rate"]
    if (
        dataset.attrs["sample"] != "grid"
        or len(others) > 1
        or not {"payout.rate", "buckled_length"} <= set(dataset.variables)
    ):
        return {}
    content = cases.parse_yaml(dataset.attrs["study"], "the study")
    rate, runs, curves = dataset["payout.rate"].values, [], []
    for k, value in enumerate(dataset[others[0]].values if others else [None]):
        own = {} if value is None else {others[0]: value.item()}
        case = cases.load(content["case"], (content.get("set") or {}) | {"payout.rate": float(rate[0])} | own)
        assert isinstance(case, Case)
        found = dataset.buckled_length if value is None else dataset.buckled_length.sel({others[0]: value})
        out = np.linspace(max(case.payout.start, 0.2 * case.payout.length), case.payout.length, POINTS)
        label = "runs" if value is None else f"runs, {others[0]} = {value:g}"
        unit = "" if value is None else str(dataset[others[0]].attrs.get("units", ""))
        named = ("before it buckles, closed form", "before an edge is slack, closed form") if k == 0 else ("", "")
        buckling, slack = limits(case, out)
        label = label if unit in ("", "1") else f"{label} {unit}"
        runs.append(Line(x=found.values.ravel(), y=1e3 * rate, label=label, color=k, style="", marker="o"))
        curves.append(Line(x=out, y=1e3 * buckling, label=named[0], color=k))
        curves.append(Line(x=out, y=1e3 * slack, label=named[1], color=k, style=":", width=1.0))
    panel = Panel(x_label="length out, m", y_label="largest pay-out rate, mm/s", lines=runs + curves, log=True)
    title = "Largest pay-out rate of a film blade before it buckles"
    return {"limit": Figure(name="limit", title=title, panels=[panel], height=110.0)}
