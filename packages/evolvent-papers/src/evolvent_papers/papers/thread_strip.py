"""A strip in place of the thread of Tenenbaum (2014): the rate at which it buckles, and its motion beside the thread's.

The strip is the case `film-blade`: the paper's body, tip mass and line density, a film of 20 um and 1400 kg/m3. The
thread has links of fixed length and starts at the length, lag and spin of the strip.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import scipy

import evolvent
from evolvent import cases
from evolvent.closed_forms import payout_buckling, payout_buckling_modes, payout_lag, payout_slack
from evolvent_base.figures import Figure, Line, Panel
from evolvent_papers.papers import Made, Options
from evolvent_papers.papers.thread_runs import RIGID, tree
from evolvent_papers.papers.winding import markdown

Array = np.ndarray
CASE = "film-blade"
#: Rate of the paper, and one below the limit of the whole length, m/s.
PAPER, SLOW = 0.035, 0.012
#: Widths of the figure, m: the second has the paper's line density.
WIDTHS = (0.01, 0.02625, 0.05)
#: Rates of the runs of the figure, m/s: in full, and of the quick form.
RATES, QUICK_RATES = (0.015, 0.025, PAPER, 0.06, 0.1), (0.02, PAPER)
#: Rates whose twist is drawn, m/s, of the paper's line density.
TWISTS = (SLOW, 0.02, PAPER)
#: Length that a run of the figure begins and ends with, of the length at which the closed form has its rate.
BEGINS, ENDS = 0.6, 1.25
#: Lengths of the curves, m, and their number; longest blade, m.
SHORTEST, POINTS, LONGEST = 1.75, 80, 5.5
#: Length from which on lags are compared, m.
SINCE = 0.6
#: Nodes of the thread.
NODES = 160


class _Motion(NamedTuple):
    """Lag (deg), rate of the body (rad/s) and tension near the root (N) over lengths out (m)."""

    out: Array
    lag: Array
    rate: Array
    tension: Array

    def at(self, out: Array) -> _Motion:
        """At other lengths."""
        return _Motion(out, *(np.interp(out, self.out, values) for values in self[1:]))


def strip(rate: float, changes: Mapping[str, Any] | None = None) -> Any:
    """A run of the strip."""
    return evolvent.run(CASE, {"payout.rate": rate} | dict(changes or {}))


def _of_strip(run: Any) -> _Motion:
    return _Motion(
        run.deployed_length.values, np.degrees(run.tip_lag.values), run.body_rate.values,
        run["blade"].axial_force.values[:, 0],
    )  # fmt: skip


def _thread(run: Any, rate: float, nodes: int = NODES) -> _Motion:
    """The thread that begins as the strip of a run."""
    given = {
        "blade.nodes": nodes, "blade.wound_mass": "carried", "body.rate": float(run.body_rate.values[0]),
        "spool.rate": rate / 0.01, "spool.start_length": float(run.deployed_length.values[0]),
        "spool.start_lag": float(run.tip_lag.values[0]), "output.every": 0.5, "output.fine": False,
    }  # fmt: skip
    found = tree(RIGID | given)
    return _Motion(
        found.deployed_length.values[:, 0], np.degrees(found.tip_lag.values[:, 0]), found.body_rate.values,
        found.hub_tension.values[:, 0],
    )  # fmt: skip


def _across(run: Any) -> float:
    """Part of the Coriolis force on the film that acts across its plane, percent, before it buckles."""
    blade, W, out = run["blade"], run.body_rate.values, run.deployed_length.values
    end = int(np.argmax(out >= 0.9 * float(run.buckled_length)))
    x, v = blade.position.values[1:end], blade.velocity.values[1:end]
    q = blade.attitude.values[1:end]
    normal = np.stack(  # y of the sections, from the quaternions (scalar first)
        [
            2.0 * (q[..., 1] * q[..., 2] - q[..., 0] * q[..., 3]),
            1.0 - 2.0 * (q[..., 1] ** 2 + q[..., 3] ** 2),
            2.0 * (q[..., 2] * q[..., 3] + q[..., 0] * q[..., 1]),
        ],
        axis=-1,
    )
    spin = np.zeros_like(x)
    spin[..., 2] = W[1:end, None]
    flow = np.linspace(1.0, 0.0, x.shape[1])[:, None] * PAPER * np.gradient(x, axis=1)
    flow /= np.linalg.norm(np.gradient(x, axis=1), axis=-1, keepdims=True)
    force = -2.0 * np.cross(spin, v + flow - np.cross(spin, x))
    across = np.sum(force * normal, axis=-1)
    return float(100.0 * np.abs(across).sum() / np.linalg.norm(force, axis=-1).sum())


def buckling() -> Mapping[str, float]:
    """Lengths at which the strip buckles at 35 and 15 mm/s, m, and where by Ritz's method; twist at 12 mm/s, deg.

    Limits at 5 m are in mm/s; `across` is the part of the Coriolis force across the blade's plane, percent.
    """
    fast, slow = (strip(rate, {"payout.start": 2.5}) for rate in (PAPER, SLOW))
    middle = strip(0.015, {"payout.start": 4.0})
    case = cases.of_run(fast.attrs["case"])

    def over(out: float) -> float:
        return payout_buckling_modes(case.film, case.rotor, out, case.momentum) - PAPER

    return {
        "across": _across(fast),
        "fast": float(fast.buckled_length),
        "predicted": float(scipy.optimize.brentq(over, 2.0, 5.0)),
        "middle": float(middle.buckled_length),
        "twist": float(np.degrees(slow.twist.values.max())),
        "limit": 1e3 * float(slow.limit_modes),
        "estimate": 1e3 * float(slow.limit_estimate),
        "slack": 1e3 * float(slow.limit_slack),
    }


def beside() -> Mapping[str, float]:
    """Largest differences of strip and thread: lag, deg, of 12 mm/s and of 35 mm/s before and after it buckles.

    `rate` and `tension` are those of both runs, percent; `mesh` is that of threads of 20 and 160 nodes at 35 mm/s, deg.
    """
    found: dict[str, float] = {}
    rates, tensions = [], []
    for name, rate in (("slow", SLOW), ("fast", PAPER)):
        run = strip(rate)
        own = _of_strip(run)
        other = _thread(run, rate).at(own.out)
        late = own.out >= SINCE
        lag = np.abs(own.lag - other.lag)
        after = own.out >= np.nan_to_num(float(run.buckled_length), nan=math.inf)
        found[name] = float(lag[late & ~after].max())
        if after.any():
            found["buckled"], found["lag"] = float(lag[after].max()), float(own.lag[after].mean())
            found["length"] = float(run.buckled_length)
            coarse = _thread(run, rate, 20).at(own.out)
            found["mesh"] = float(np.abs(coarse.lag - other.lag)[late].max())
        rates.append(100.0 * float(np.abs(own.rate / other.rate - 1.0)[late].max()))
        tensions.append(100.0 * float(np.abs(own.tension / other.tension - 1.0)[late].max()))
    return found | {"rate": max(rates), "tension": max(tensions)}


def buckled() -> Mapping[str, float]:
    """Largest difference of the lags of a strip that has buckled at 35 mm/s and of the thread, and the lag, deg."""
    run = strip(PAPER, {"payout.start": 3.0, "payout.length": 4.5})
    own = _of_strip(run)
    after = own.out >= float(run.buckled_length)
    other = _thread(run, PAPER, 40).at(own.out)
    return {"buckled": float(np.abs(own.lag - other.lag)[after].max()), "lag": float(own.lag[after].mean())}


def figure(options: Options) -> Made:
    """Largest rate of strips of three widths over the length, their lag beside the thread's, and twists."""
    case = cases.load(CASE)
    lengths = np.linspace(SHORTEST, LONGEST, POINTS)
    runs, curves, lags, rows = [], [], [], []
    rates = QUICK_RATES if options.quick else RATES
    total, done = len(WIDTHS) * len(rates) + len(TWISTS), 0
    for k, width in enumerate(WIDTHS):
        own = cases.load(CASE, {"blade.width": width})
        limit, slack = (
            np.array([form(own.film, own.rotor, float(out), own.momentum) for out in lengths])
            for form in (payout_buckling, payout_slack)
        )
        at, seen = [], []
        for rate in rates:
            done += 1
            options.report(f"run {done} of {total}: a strip of {1e3 * width:g} mm at {1e3 * rate:g} mm/s")
            end = float(np.interp(-rate, -limit, lengths))
            run = strip(rate, {"blade.width": width, "payout.start": BEGINS * end, "payout.length": ENDS * end})
            own_lag, thread_lag = _means(run, rate, width)
            at.append(float(run.buckled_length))
            seen.append((own_lag, thread_lag))
            row = [f"{1e3 * width:g}", f"{1e3 * rate:g}", _number(at[-1]), f"{end:.2f}"]
            rows.append([*row, _number(own_lag), _number(thread_lag)])
        label = f"strip, {1e3 * width:g} mm"
        dots: dict[str, Any] = {"label": label, "color": k, "style": "", "marker": "o"}
        runs.append(Line(x=np.array(at), y=1e3 * np.array(rates), **dots))
        curves.append(Line(x=lengths, y=1e3 * limit, label="closed form" if k == 0 else "", color=k))
        found = np.array(seen)
        lags.append(Line(x=1e3 * np.array(rates), y=found[:, 0], **dots))
        if width == WIDTHS[1]:
            curves.append(Line(x=lengths, y=1e3 * slack, label="an edge is slack above", color=k, style=":", width=1.0))
            crosses = Line(x=1e3 * np.array(rates), y=found[:, 1], label="thread", color="0.4", style="", marker="x")
    speeds = np.linspace(0.0, 1.1 * max(rates), POINTS)
    closed = np.degrees([payout_lag(case.rotor, float(v), case.momentum) for v in speeds])
    lags += [crosses, Line(x=1e3 * speeds, y=closed, label="thread, closed form", color="0.4", width=1.0)]
    fastest = 0.5e3 * case.momentum * case.rotor.offset / case.rotor.inertia
    ends = np.array([SHORTEST, LONGEST])
    bounds = [
        Line(x=ends, y=np.full(2, fastest), label="thread: no steady lag above", color="0.4", style="--"),
        Line(x=ends, y=np.full(2, 1e3 * PAPER), label="rate of the paper", color="0.4", style=":"),
    ]
    twists = []
    for k, rate in enumerate(TWISTS):
        done += 1
        options.report(f"run {done} of {total}: twist at {1e3 * rate:g} mm/s")
        run = strip(rate, {"payout.start": 1.5})
        y = np.degrees(run.twist.values)
        twists.append(Line(x=run.deployed_length.values, y=y, label=f"{1e3 * rate:g} mm/s", color=k))
    out_label = "length out, m"
    panels = [
        Panel(
            x_label=out_label, y_label="largest pay-out rate, mm/s", lines=[*runs, *curves, *bounds], log=True,
            title="ours: rate at which a strip buckles in its plane",
        ),
        Panel(
            x_label="pay-out rate, mm/s", y_label="mean lag of the tip, deg", lines=lags,
            title="ours: lag until the strip buckles",
        ),
        Panel(
            x_label=out_label, y_label="largest twist, deg", lines=twists, title=f"ours: twist, {1e3 * WIDTHS[1]:g} mm"
        ),
    ]  # fmt: skip
    head = ["width, mm", "rate, mm/s", "buckles at, m", "closed form, m", "mean lag of the strip, deg", "of the thread"]
    note = (
        "Ours: the paper has no strip. Body, tip mass, offset and spin of table IV.1; film of 20 um, 1400 kg/m3 and "
        "1e9 N/m2, chord in the plane of the spin, root free in it, pitch 0.5 deg; 26.25 mm has the paper's line "
        "density. "
        "A strip buckles where its twist passes 5 deg. Lags are means until then; a thread has no limit below "
        f"{fastest:.0f} mm/s.\n"
    )
    title = "A strip in place of the thread: largest pay-out rate and lag (ours)"
    figure = Figure(name="thread-strip-payout", title=title, panels=panels, height=220.0, heights=(2.0, 1.2, 1.0))
    return Made(text=f"{note}\n{markdown(head, rows)}", figure=figure)


def _means(run: Any, rate: float, width: float) -> tuple[float, float]:
    """Mean lag until the strip buckles, deg, of the strip and, of the paper's line density, of the thread beside it."""
    own = _of_strip(run)
    before = own.out < float(run.buckled_length)
    if not before.any():
        return math.nan, math.nan
    other = _thread(run, rate, 40).at(own.out).lag[before].mean() if width == WIDTHS[1] else math.nan
    return float(own.lag[before].mean()), float(other)


def _number(value: float) -> str:
    return f"{value:.2f}" if math.isfinite(value) else "-"
