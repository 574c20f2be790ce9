"""What to show of a run: numbers, figures, motion."""

from __future__ import annotations

import dataclasses
import itertools
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent import cases, results, show
from evolvent.figures import Figure, Line, Number, Panel, spline
from evolvent.systems.heliogyro.case import Case

if TYPE_CHECKING:
    import xarray as xr

    from evolvent.motion import Motion

_WORK = ("work_loads", "work_drives", "work_spools")
_WINDOWS = (0.05, 0.14, 0.42, 0.7, 1.0)  # of the duration: the paper's 7, 20, 60, 100, 142 s


def case_of(run: xr.DataTree) -> Case:
    """The case that a run was made from."""
    loaded: Case = cases.of_run(run.attrs["case"])
    return loaded


def _blade(run: xr.DataTree, b: int) -> xr.DataTree:
    """Results of a blade, or of the one that stands for all."""
    return run.children.get(f"blade-{b + 1}", run.children["blade-1"])


def _separated(run: xr.DataTree) -> np.ndarray:
    """Whether each blade has left its spool: (nt, blades)."""
    return np.stack([_blade(run, b).separated.values > 0.0 for b in range(run.sizes["blade"])], axis=1)


def motion(run: xr.DataTree) -> Motion | None:
    """Blades from tip to spool, their pull on the body, and the body with its spools."""
    found = show.motion(run)
    if found is None:
        return None
    numbers = {
        "body rate [rad/s]": run.body_rate.values,
        "deployed [m]": run.deployed_length.values[:, 0],
        "tip lag [deg]": np.degrees(run.tip_lag.values[:, 0]),
    }
    return dataclasses.replace(found, title="Deployment of the heliogyro's blades", numbers=numbers)


def numbers(run: xr.DataTree) -> list[Number]:
    """The results that a user wants to see at once."""
    time, rate = run.time.values, run.body_rate.values
    found = [
        Number(label="time reached", value=f"{time[-1]:.6g} s"),
        Number(
            label="deployed length", value=" / ".join(f"{x:.6g}" for x in _distinct(run.deployed_length[-1])) + " m"
        ),
        Number(label="body rate at the end", value=f"{rate[-1]:.6g} rad/s (at the start {rate[0]:.6g})"),
    ]
    for name, label in (("body_rate_paper", "eq. (18)"), ("body_rate_corrected", "corrected formula")):
        if name in run and np.all(rate != 0.0) and np.any(np.isfinite(run[name].values)):
            gap = (run[name].values - rate) / rate
            k = int(np.nanargmax(np.abs(gap)))
            text = f"{100.0 * abs(gap[k]):.3g} % at {time[k]:.6g} s"
            found.append(Number(label=f"largest gap to {label}", value=text))
    lag = _tip_lag(run)
    for low, high in itertools.pairwise(_WINDOWS):
        inside = (time >= low * time[-1]) & (time <= high * time[-1])
        window = lag[inside]
        if np.all(np.any(np.isfinite(window), axis=0)):
            means = [f"{np.nanmean(window[:, k]):.4g}" for k in _unlike(lag)]
            label = f"mean tip lag, {low * time[-1]:.4g} to {high * time[-1]:.4g} s"
            found.append(Number(label=label, value=" / ".join(means) + " deg"))
    if np.any(run.hub_tension.values):
        found += _hub_numbers(run)
    work = [run[name].values for name in ("energy", "energy_dissipated", "energy_released", *_WORK)]
    largest = max(float(np.abs(values).max()) for values in work) or 1.0
    defect = np.abs(run.energy_defect.values).max() / largest
    found.append(Number(label="energy balance", value=f"{defect:.2g} of the largest energy"))
    if "momentum_balance" in run:
        text = f"{run.momentum_balance.values.max():.2g} of the start"
        found.append(Number(label="angular momentum balance", value=text))
    if "position" in show.plots_of(run, "body"):
        drift = np.abs(run.momentum.values - run.momentum.values[0]).max()
        found.append(Number(label="drift of linear momentum", value=f"{drift:.2g} kg m/s"))
    return found + results.closing_numbers(run)


def _tip_lag(run: xr.DataTree) -> np.ndarray:
    """Lag of the tips in the plane of the spin, deg, (nt, blades); negative ahead of the spool, NaN once let go."""
    return np.where(_separated(run), np.nan, np.degrees(run.tip_lag.values))


def _hub_numbers(run: xr.DataTree) -> list[Number]:
    """Tension at the spools: of springs, which ring after every release, a mean beside the largest sample."""
    time, hub = run.time.values, run.hub_tension.values.max(axis=1)
    k = int(np.argmax(hub))
    text = f"{hub[k]:.4g} N at {time[k]:.6g} s"
    if case_of(run).blade.segments != "springs":
        return [Number(label="largest hub tension", value=text)]
    found = Number(label="largest hub tension, one sample", value=f"{text} (the springs ring)")
    count = _window(run)
    if count == 0:
        return [found]
    means = np.array([_running(blade, count)[0] for blade in run.hub_tension.values.T])
    k = int(np.argmax(means.max(axis=0)))
    text = f"{means[:, k].max():.4g} N about {_running(time, count)[0][k]:.4g} s"
    return [Number(label=f"largest hub tension, mean of {time[count - 1]:.2g} s", value=text), found]


def _window(run: xr.DataTree) -> int:
    """Samples that a mean over the ringing of springs is taken of; 0 if there are too few."""
    count = max(20, run.sizes["time"] // 50)
    return count if run.sizes["time"] >= 3 * count else 0


def _running(values: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean, least and largest of every `count` values on end."""
    windows = np.lib.stride_tricks.sliding_window_view(values, count)
    return windows.mean(axis=1), windows.min(axis=1), windows.max(axis=1)


def _distinct(values: Any) -> list[float]:
    """Values without those equal to the first, if all are."""
    listed = [float(v) for v in np.asarray(values)]
    return listed[:1] if np.ptp(listed) <= 1e-9 * max(abs(listed[0]), 1e-300) else listed


def _unlike(values: np.ndarray) -> list[int]:
    """Blades to show: the first alone if all have the same (nt, blades) values."""
    first = values[:, :1]
    alike = np.allclose(values, first, rtol=1e-9, atol=1e-12, equal_nan=True)
    return [0] if alike else list(range(values.shape[1]))


def figures(run: xr.DataTree) -> list[Figure]:
    """What to draw of a run; nothing of one with a single sample."""
    if run.sizes["time"] < 2:
        return []
    found = [_rate_figure(run), _lag_figure(run), _shape_figure(run), _tension_figure(run), _momentum_figure(run)]
    found.append(show.balance_figure(run))
    if "position" in show.plots_of(run, "body"):
        found.append(_body_figure(run))
    return found


def _rate_figure(run: xr.DataTree) -> Figure:
    """Body rate beside both formulas."""
    time, rate = run.time.values, run.body_rate.values
    lines, gaps = [Line(x=time, y=rate, label="computed")], []
    for name, label, color in (
        ("body_rate_paper", "eq. (18)", 2),
        ("body_rate_corrected", "eq. (18) with spool offset", 1),
    ):
        if name in run:
            lines.append(Line(x=time, y=run[name].values, label=label, color=color, style="--"))
        if name in run and np.all(rate != 0.0):
            gaps.append(Line(x=time, y=100.0 * (run[name].values - rate) / rate, label=label, color=color))
    panels = [Panel(x_label="time, s", y_label="body rate, rad/s", lines=lines)]
    if gaps:
        panels.append(Panel(x_label="time, s", y_label="formula less computed, %", lines=gaps))
    size = (8.0, 6.5) if gaps else (8.0, 4.0)
    return Figure(name="body_rate", title="Rate of the body", panels=panels, size=size)


def _lag_figure(run: xr.DataTree) -> Figure:
    """Tip lag, whole and at the start."""
    time, lag = run.time.values, _tip_lag(run)
    shown = _unlike(lag)
    first = min(5.0, float(time[-1]))
    whole: list[Line] = []
    start: list[Line] = []
    for color, b in enumerate(shown):
        label = f"blade {b + 1}" if len(shown) > 1 else ""
        whole.append(Line(x=time, y=lag[:, b], label=label, color=color))
        seen = np.isfinite(lag[:, b]) & (time <= first)
        start.append(Line(x=time[seen], y=lag[seen, b], label=label, color=color, style=" ", marker="."))
        if seen.sum() > 20:
            start.append(_smooth(time[seen], lag[seen, b], color))
    y_label = "lag of the tip, deg"
    panels = [Panel(x_label="time, s", y_label=y_label, lines=whole)]
    if first < 0.5 * time[-1]:
        title = f"first {first:g} s: samples and a smooth curve through them"
        panels.append(Panel(x_label="time, s", y_label=y_label, lines=start, title=title))
    title = "Lag of the tip in the plane of the spin (negative: ahead)"
    return Figure(name="tip_lag", title=title, panels=panels, size=(8.0, 3.3 * len(panels)))


def _smooth(x: np.ndarray, y: np.ndarray, color: int) -> Line:
    """A cubic spline through samples."""
    fine = np.linspace(x[0], x[-1], 1001)
    return Line(x=fine, y=spline(x, y, fine), color=color, width=1.0)


def _moments(run: xr.DataTree, count: int) -> list[int]:
    """Samples evenly spread over a run, or over what of it comes before a blade is let go, without the first."""
    held = np.flatnonzero(~_separated(run).any(axis=1))
    last = int(held[-1]) if held.size else 0
    return sorted({int(k) for k in np.linspace(0, last, count + 1)[1:]})


def _shape_figure(run: xr.DataTree) -> Figure:
    """Shape at several times: from above, by the lag along blade 1 and, where it matters, from the side."""
    case, time, first = case_of(run), run.time.values, _blade(run, 0)
    moments, gone = np.array(_moments(run, 7)), _separated(run)
    seen = show.motion(run).at(moments).in_body()  # type: ignore[union-attr]
    top, side, lag, height, reach = [], [], [], 0.0, 0.0
    for j, k in reversed(list(enumerate(moments))):
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
        panels.append(
            Panel(x_label="distance from the spin axis, m", y_label="z, m", lines=side, title="from the side")
        )
    heights = [2.2 if len(seen.lines) > 2 else 1.0] + [1.0] * (len(panels) - 1)
    size = (8.0, 3.5 * sum(heights))
    return Figure(name="shape", title="Shape of the blades", panels=panels, size=size, heights=heights)


def _tension_figure(run: xr.DataTree) -> Figure:
    """Tension at the hub over time, and along the thread at several times."""
    case, time = case_of(run), run.time.values
    hub = np.where(_separated(run), np.nan, 1e3 * run.hub_tension.values)
    shown = _unlike(hub)
    count = _window(run) if case.blade.segments == "springs" else 0
    lines, title = [], ""
    for c, b in enumerate(shown):
        label = f"blade {b + 1}" if len(shown) > 1 else ""
        if count == 0:
            lines.append(Line(x=time, y=hub[:, b], label=label, color=c, width=1.0))
            continue
        middle = _running(time, count)[0]
        mean, least, largest = _running(hub[:, b], count)
        lines.append(Line(x=middle, y=mean, label=f"mean {label}".strip(), color=c))
        lines.append(Line(x=middle, y=least, label=f"least and largest {label}".strip(), color=c, width=0.6))
        lines.append(Line(x=middle, y=largest, color=c, width=0.6))
        title = f"of the samples in {time[count - 1]:.2g} s; the springs ring after every release"
    along = []
    segment = case.blade.length / case.blade.nodes
    for k in _moments(run, 7):
        tension = _blade(run, 0).tension.values[k]
        count = int(np.sum(_blade(run, 0).released.values[k] > 0.0))
        from_tip = segment * (np.arange(count) + 0.5)
        color = float(time[k] / time[-1])
        along.append(Line(x=from_tip, y=1e3 * tension[:count], label=f"{time[k]:.4g} s", color=color, marker="."))
    beside = "along blade 1" + (", at these instants" if case.blade.segments == "springs" else "")
    panels = [
        Panel(x_label="time, s", y_label="tension at the spool, mN", lines=lines, title=title),
        Panel(x_label="length from the tip, m", y_label="tension, mN", lines=along, title=beside),
    ]
    return Figure(name="tension", title="Tension of the thread", panels=panels, size=(8.0, 7.0))


def _momentum_figure(run: xr.DataTree) -> Figure:
    """Angular momentum about Z, what releases bring in, and what the balance lacks."""
    time, start = run.time.values, run.angular_momentum.values[0, 2]
    total = np.abs(run.angular_momentum.values[:, 2]).max()
    lines = [Line(x=time, y=1e3 * run.angular_momentum.values[:, 2], label="all that the model moves", color=0)]
    for color, label in enumerate(("body", "released", "wound"), start=1):
        values = run[f"angular_momentum_{label}"].values
        if color == 1 or np.abs(values).max() > 1e-4 * total:
            lines.append(Line(x=time, y=1e3 * values, label=f"{label} thread" if color > 1 else label, color=color))
    releases, defects = [], []
    for color, kind, name, before in (
        (1, "energy", "energy_released", run.energy.values[0]),
        (2, "angular momentum", "angular_momentum_jumps", start),
    ):
        if before != 0.0:
            releases.append(Line(x=time, y=100.0 * run[name].values / before, label=kind, color=color))
    if "momentum_balance" in run:
        lacks = run.momentum_balance.values
        defects.append(Line(x=time, y=np.where(lacks > 0.0, lacks, np.nan), color=2, width=1.0))
    panels = [
        Panel(x_label="", y_label="angular momentum,\n1e-3 kg m2/s", lines=lines),
        Panel(x_label="", y_label="% of the start", lines=releases, title="brought in by nodes at their release"),
        Panel(x_label="time, s", y_label="relative defect", lines=defects, title="what the balance lacks", log=True),
    ]
    panels = panels if defects else panels[:2]
    return Figure(name="momentum", title="Angular momentum", panels=panels, size=(8.0, 7.5))


def _body_figure(run: xr.DataTree) -> Figure:
    """Motion of a free body: its centre and the tilt of its axis."""
    time, q, x = run.time.values, run["body"].attitude.values, 1e3 * run["body"].position.values
    tilt = np.degrees(np.arccos(np.clip(1.0 - 2.0 * (q[:, 1] ** 2 + q[:, 2] ** 2), -1.0, 1.0)))
    centre = [Line(x=time, y=x[:, c], label=axis, color=c + 1) for c, axis in enumerate("xyz")]
    panels = [
        Panel(x_label="time, s", y_label="centre of the body, mm", lines=centre, title="inertial axes"),
        Panel(x_label="time, s", y_label="tilt of the body's axis, deg", lines=[Line(x=time, y=tilt)]),
    ]
    return Figure(name="body", title="Motion of the body", panels=panels, size=(8.0, 6.5))
