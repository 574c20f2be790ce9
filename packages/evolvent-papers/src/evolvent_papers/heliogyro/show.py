"""What to show of a run: numbers, figures, motion."""

from __future__ import annotations

import dataclasses
import itertools
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent import cases, results
from evolvent.results import display
from evolvent.view import balance, show
from evolvent_base.figures import Figure, Line, Number, Panel, numbers_of, spline, stacked
from evolvent_base.units import unit_text
from evolvent_papers.heliogyro.case import Case
from evolvent_papers.heliogyro.feedback import feedback_figure
from evolvent_papers.heliogyro.free_figures import nutation_figure

if TYPE_CHECKING:
    from evolvent.results.motion import Motion

Array = np.ndarray
_WINDOWS = (0.05, 0.14, 0.42, 0.7, 1.0)  # of the duration: the paper's 7, 20, 60, 100, 142 s
_FORMULAS = {"body_rate_paper": "eq. (18)", "body_rate_corrected": "corrected formula"}


def case_of(run: Any) -> Case:
    """The case that a run was made from."""
    loaded: Case = cases.of_run(run.attrs["case"])
    return loaded


def _blade(run: Any, b: int) -> Any:
    """Results of a blade, or of the one that stands for all."""
    return run.children.get(f"blade-{b + 1}", run.children["blade-1"])


def _separated(run: Any) -> Array:
    """Whether each blade has left its spool: (nt, blades)."""
    return np.stack([_blade(run, b).separated.values > 0.0 for b in range(run.sizes["blade"])], axis=1)


def _tip_lag(run: Any) -> Array:
    """Lag of the tips in the plane of the spin, deg, (nt, blades); negative ahead of the spool, NaN once separated."""
    return np.where(_separated(run), np.nan, np.degrees(run.tip_lag.values))


def _formulas(run: Any) -> dict[str, Array]:
    """Rates of the body by both formulas, rad/s, by their labels; those that the run has."""
    return {label: run[name].values for name, label in _FORMULAS.items() if name in run}


def _read_rate(run: Any, values: Any) -> tuple[Any, str]:
    """Rates of the body, and their unit: rpm where the case gives its rate so, else rad/s, as the paper does."""
    factor, unit = display.shown_unit("rad s-1", display.written(run["body"]["rate"], "rad"))
    return factor * values, unit_text(unit)


def motion(run: Any) -> Motion | None:
    """Blades from tip to spool, their pull on the body, and the body with its spools."""
    found = show.motion(run)
    if found is None:
        return None
    rate, unit = _read_rate(run, run.body_rate.values)
    numbers = {
        f"body rate [{unit}]": rate,
        "deployed [m]": run.deployed_length.values[:, 0],
        "tip lag [deg]": np.degrees(run.tip_lag.values[:, 0]),
    }
    return dataclasses.replace(found, title="Deployment of the heliogyro's blades", numbers=numbers)


# ------------------------------------------------------------------------------------------------ numbers


def numbers(run: Any) -> list[Number]:
    """The results that a user wants to see at once."""
    time, rate, lag = run.time.values, run.body_rate.values, _tip_lag(run)
    blades = _unlike(run.deployed_length.values)
    out = run.deployed_length.values[-1, blades]
    (before, after), unit = _read_rate(run, rate[[0, -1]])
    rows: list[tuple[Any, ...]] = [
        ("time reached", f"{time[-1]:.6g} s", (time[-1], "s")),
        ("deployed length", " / ".join(f"{x:.6g}" for x in out) + " m", *_of_blades(out, blades, "m")),
        (
            "body rate at the end",
            f"{after:.6g} {unit} (at the start {before:.6g})",
            (after, unit),
            (before, unit, "at the start"),
        ),
    ]
    for label, values in _formulas(run).items():
        if np.all(rate != 0.0) and np.any(np.isfinite(values)):
            gap = np.abs((values - rate) / rate)
            k = int(np.nanargmax(gap))
            text = f"{100.0 * gap[k]:.3g} % at {time[k]:.6g} s"
            rows.append((f"largest gap to {label}", text, (100.0 * gap[k], "%"), (time[k], "s", "time")))
    even = results.regular(run)
    at, even_lag = even.time.values, _tip_lag(even)
    for low, high in itertools.pairwise(_WINDOWS):
        window = even_lag[(at >= low * at[-1]) & (at <= high * at[-1])]
        if np.all(np.any(np.isfinite(window), axis=0)):
            means = np.nanmean(window[:, _unlike(lag)], axis=0)
            text = " / ".join(f"{x:.4g}" for x in means) + " deg"
            label = f"mean tip lag, {low * at[-1]:.4g} to {high * at[-1]:.4g} s"
            rows.append((label, text, *_of_blades(means, _unlike(lag), "deg")))
    rows += _hub_rows(run) if np.any(run.hub_tension.values) else []
    for key, where in (("tip", "of the tip"), ("hub", "at the spool")):
        swing = np.degrees(float(run[f"residual_swing_{key}"]))
        if np.isfinite(swing):
            rows.append((f"largest lag {where} after the spools have stopped", f"{swing:.3g} deg", (swing, "deg")))
    if "momentum_balance" in run:
        largest = float(run.momentum_balance.values.max())
        rows.append(("angular momentum balance", f"{largest:.2g} of the start", (largest, "1")))
    if "position" in show.plots_of(run, "body"):
        drift = np.abs(run.momentum.values - run.momentum.values[0]).max()
        rows.append(("drift of linear momentum", f"{drift:.2g} kg m/s", (drift, "kg m/s")))
    if "nutation" in run:
        angle, offset = np.degrees(run.nutation.values), np.linalg.norm(run.mass_centre.values, axis=1)
        for label, values, factor, own, what in (
            ("largest nutation", angle, 1.0, "deg", "deg"),
            ("largest offset of the mass centre", offset, 1e3, "mm", "m"),
        ):
            k = int(values.argmax())
            text = f"{factor * values[k]:.4g} {own} at {time[k]:.4g} s"
            rows.append((label, text, (values[k], what), (time[k], "s", "time")))
    return numbers_of(rows) + balance.balance_numbers(run) + results.closing_numbers(run)


def _of_blades(values: Array, blades: list[int], unit: str) -> list[tuple[float, str, str]]:
    """Numbers of blades for a result; of one that stands for all, its own."""
    return [(x, unit, f"blade {k + 1}" if len(blades) > 1 else "") for x, k in zip(values, blades, strict=True)]


def _hub_rows(run: Any) -> list[tuple[Any, ...]]:
    """Tension at the spools: of springs, which ring after every release, a mean beside the largest sample."""
    run = results.regular(run)
    time, hub, count = run.time.values, run.hub_tension.values.max(axis=1), _window(run)
    k = int(np.argmax(hub))
    text, quantities = f"{hub[k]:.4g} N at {time[k]:.6g} s", ((hub[k], "N"), (time[k], "s", "time"))
    if not _rings(case_of(run)):
        return [("largest hub tension", text, *quantities)]
    found: list[tuple[Any, ...]] = [("largest hub tension, one sample", f"{text} (the springs ring)", *quantities)]
    if count:
        means = np.array([_running(blade, count)[0] for blade in run.hub_tension.values.T])
        k = int(np.argmax(means.max(axis=0)))
        largest, about = means[:, k].max(), _running(time, count)[0][k]
        text, quantities = f"{largest:.4g} N about {about:.4g} s", ((largest, "N"), (about, "s", "time"))
        found.insert(0, (f"largest hub tension, mean of {time[count - 1]:.2g} s", text, *quantities))
    return found


def _rings(case: Any) -> bool:
    """Whether tensions ring: springs on a mesh whose nodes leave the spool one by one."""
    return bool(case.blade.segments == "springs" and case.blade.mesh == "material")


def _window(run: Any) -> int:
    """Samples that a mean over the ringing of springs is taken of; 0 if there are too few."""
    count = max(20, run.sizes["time"] // 50)
    return count if run.sizes["time"] >= 3 * count else 0


def _running(values: Array, count: int) -> tuple[Array, Array, Array]:
    """Mean, least and largest of every `count` consecutive values."""
    windows = np.lib.stride_tricks.sliding_window_view(values, count)
    return windows.mean(axis=1), windows.min(axis=1), windows.max(axis=1)


def _unlike(values: Array) -> list[int]:
    """Blades to show: the first alone if all have the same (nt, blades) values."""
    alike = np.allclose(values, values[:, :1], rtol=1e-9, atol=1e-12, equal_nan=True)
    return [0] if alike else list(range(values.shape[1]))


# ------------------------------------------------------------------------------------------------ figures


def figures(run: Any) -> list[Figure]:
    """What to draw of a run; nothing of one with a single sample."""
    if run.sizes["time"] < 2:
        return []
    found = [_rate_figure(run), _lag_figure(run), _shape_figure(run), _tension_figure(run), _momentum_figure(run)]
    found.append(balance.balance_figure(run))
    if case_of(run).spool.feedback is not None:
        found.insert(0, feedback_figure(run))
    if "position" in show.plots_of(run, "body"):
        found.append(show.figure(run, ["body.position", "body.tilt"], name="body", title="Motion of the body"))
    if "nutation" in run:
        found.append(nutation_figure(run))
    return found


def _rate_figure(run: Any) -> Figure:
    """Body rate beside both formulas."""
    time = run.time.values
    rate, unit = _read_rate(run, run.body_rate.values)
    lines, gaps = [Line(x=time, y=rate, label="simulated")], []
    for color, (label, found) in enumerate(_formulas(run).items(), start=1):
        values, _ = _read_rate(run, found)
        lines.append(Line(x=time, y=values, label=label, color=color, style="--"))
        if np.all(rate != 0.0):
            gaps.append(Line(x=time, y=100.0 * (values - rate) / rate, label=label, color=color, style="--"))
    panels = [Panel(x_label="time, s", y_label=f"body rate, {unit}", lines=lines)]
    if gaps:
        panels.append(Panel(x_label="time, s", y_label="formula minus simulation, %", lines=gaps, y_span=2.0))
    return Figure(name="body_rate", title="Rate of the body", panels=panels, height=stacked(len(panels)))


def _lag_figure(run: Any) -> Figure:
    """Tip lag, whole and at the start."""
    time, lag = run.time.values, _tip_lag(run)
    shown, first = _unlike(lag), min(5.0, float(time[-1]))
    whole, start = [], []
    for color, b in enumerate(shown):
        label, seen = f"blade {b + 1}" if len(shown) > 1 else "", np.isfinite(lag[:, b]) & (time <= first)
        whole.append(Line(x=time, y=lag[:, b], label=label, color=color))
        start.append(Line(x=time[seen], y=lag[seen, b], label=label, color=color, style=" ", marker="."))
        if seen.sum() > 20:
            fine = np.linspace(time[seen][0], time[seen][-1], 1001)
            start.append(Line(x=fine, y=spline(time[seen], lag[seen, b], fine), color=color, width=1.0))
    panels = [Panel(x_label="time, s", y_label="lag of the tip, deg", lines=whole)]
    if first < 0.5 * time[-1]:
        title = f"first {first:g} s: samples and a smooth curve through them"
        panels.append(Panel(x_label="time, s", y_label="lag of the tip, deg", lines=start, title=title))
    title = "Lag of the tip in the plane of the spin (negative: ahead)"
    return Figure(name="tip_lag", title=title, panels=panels, height=stacked(len(panels)))


def _moments(run: Any, count: int = 5) -> list[int]:
    """Samples evenly spread over a run, or over what of it comes before a blade separates, without the first."""
    held = np.flatnonzero(~_separated(run).any(axis=1))
    last = int(held[-1]) if held.size else 0
    return sorted({int(k) for k in np.linspace(0, last, count + 1)[1:]})


def _shape_figure(run: Any) -> Figure:
    """Shape at several times: from above, by the lag along blade 1 and, where it matters, from the side."""
    case, time, first = case_of(run), run.time.values, _blade(run, 0)
    moments, gone, drawn = np.array(_moments(run)), _separated(run), show.motion(run)
    assert drawn is not None
    seen = drawn.at(moments).in_body()
    top, side, lag, height, reach = [], [], [], 0.0, 0.0
    for j, k in enumerate(moments):
        color, label = float(time[k] / time[-1]), f"{time[k]:.4g} s"
        for b, line in enumerate(seen.lines):
            count = int(np.sum(_blade(run, b).released.values[k] > 0.0))
            x = line.points[j][np.append(np.arange(line.points.shape[1] - 1) < count, not gone[k, b])]
            own, distance = label if b == 0 else "", np.hypot(x[:, 0], x[:, 1])
            thick = 1.0 + 3.0 * (1.0 - color)
            top.append(Line(x=x[:, 0], y=x[:, 1], label=own, color=color, marker=".", width=thick))
            side.append(Line(x=distance, y=x[:, 2], label=own, color=color, marker="."))
            height, reach = max(height, float(np.ptp(x[:, 2]))), max(reach, float(distance.max()))
        out = first.released.values[k] > 0.0
        length = first.deployed_length.values[k] - case.blade.length / case.blade.nodes * np.arange(out.sum())
        lag.append(Line(x=length, y=np.degrees(first.signed_lag.values[k, out]), label=label, color=color, marker="."))
    panels = [
        Panel(x_label="x, m", y_label="y, m", lines=top, title="from above, axes of the body", equal=True),
        Panel(x_label="length from the spool, m", y_label="lag, deg", lines=lag, title="nodes of blade 1"),
    ]
    if height > 0.01 * reach:
        label = "distance from the spin axis, m"
        panels.append(Panel(x_label=label, y_label="z, m", lines=side, title="from the side"))
    heights = [2.2 if len(seen.lines) > 2 else 1.0] + [1.0] * (len(panels) - 1)
    return Figure(name="shape", title="Shape of the blades", panels=panels, height=70.0 * sum(heights), heights=heights)


def _tension_figure(run: Any) -> Figure:
    """Tension at the hub over time, and along the thread at several times."""
    run = results.regular(run)
    case, time, first = case_of(run), run.time.values, _blade(run, 0)
    hub, springs = np.where(_separated(run), np.nan, 1e3 * run.hub_tension.values), _rings(case)
    shown, count = _unlike(hub), _window(run) if springs else 0
    lines, along, segment = [], [], case.blade.length / case.blade.nodes
    for c, b in enumerate(shown):
        label = f"blade {b + 1}" if len(shown) > 1 else ""
        if count == 0:
            lines.append(Line(x=time, y=hub[:, b], label=label, color=c, width=1.0))
            continue
        texts = (f"mean {label}".strip(), f"least and largest {label}".strip(), "")
        for k, (values, text) in enumerate(zip(_running(hub[:, b], count), texts, strict=True)):
            lines.append(Line(x=_running(time, count)[0], y=values, label=text, color=c, width=0.6 if k else 1.5))
    title = f"of the samples in {time[count - 1]:.2g} s; the springs ring after every release" if count else ""
    for k in _moments(run):
        out = int(np.sum(first.released.values[k] > 0.0))
        tension, color = 1e3 * first.tension.values[k, :out], float(time[k] / time[-1])
        if case.blade.mesh == "moving":
            segment = float(first.deployed_length.values[k]) / out
        x = segment * (np.arange(out) + 0.5)
        along.append(Line(x=x, y=tension, label=f"{time[k]:.4g} s", color=color, marker="."))
    beside = "along blade 1" + (", at these instants" if springs else "")
    panels = [
        Panel(x_label="time, s", y_label="tension at the spool, mN", lines=lines, title=title),
        Panel(x_label="length from the tip, m", y_label="tension, mN", lines=along, title=beside),
    ]
    return Figure(name="tension", title="Tension of the thread", panels=panels, height=140.0)


def _momentum_figure(run: Any) -> Figure:
    """Angular momentum about Z, what releases bring in, and the defect of the balance."""
    time, total = run.time.values, run.angular_momentum.values[:, 2]
    lines = [Line(x=time, y=1e3 * total, label="all that the model moves", color=0)]
    for color, (name, label) in enumerate(
        {"body": "body", "released": "released thread", "wound": "wound thread"}.items(), start=1
    ):
        values = run[f"angular_momentum_{name}"].values
        if name == "body" or np.abs(values).max() > 1e-4 * np.abs(total).max():
            lines.append(Line(x=time, y=1e3 * values, label=label, color=color))
    brought = {"energy": (run.energy_released, run.energy.values[0])}
    brought["angular momentum"] = (run.angular_momentum_jumps, total[0])
    releases = [
        Line(x=time, y=100.0 * values.values / start, label=label, color=color)
        for color, (label, (values, start)) in enumerate(brought.items(), start=1)
        if start != 0.0
    ]
    panels = [
        Panel(x_label="", y_label="angular momentum, 1e-3 kg m2/s", lines=lines),
        Panel(
            x_label="time, s",
            y_label="share of the start, %",
            lines=releases,
            title="brought in by nodes at their release",
        ),
    ]
    if "momentum_balance" in run:
        defect = np.where(run.momentum_balance.values > 0.0, run.momentum_balance.values, np.nan)
        line, title = Line(x=time, y=defect, color=2, width=1.0), "defect of the balance, relative to the start"
        panels.append(Panel(x_label="time, s", y_label="relative defect", lines=[line], title=title, log=True))
    return Figure(name="momentum", title="Angular momentum", panels=panels, height=stacked(len(panels)))
