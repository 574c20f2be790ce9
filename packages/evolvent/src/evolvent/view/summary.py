"""The figures of a run of parts: first one page that answers what is asked of a deployment, then the kinds of parts."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence

import numpy as np
import xarray as xr

from evolvent.results import display, variables
from evolvent.results.motion import conjugate, product, quantity, rotation_vectors
from evolvent.view import balance, show
from evolvent_base.figures import Figure, Line, Number, Panel
from evolvent_base.units import unit_text

#: Share of the range of a curve within which it no longer changes, and of the run at which the page ends at most.
_STILL, _CUT = 0.01, 0.6
#: How much longer than what happens the page is, and heights of its title and of a panel, mm.
_LONGER, _TITLE, _PANEL = 1.15, 14.0, 40.0
#: Turn of a body from which on it spins, and least one that is drawn, rad.
_TURNS, _LEAST_TURN = 3.0, 1e-9
#: Share of the range of an angle by which that of a joint and that of its spring differ at most.
_SAME = 1e-5


def figures(run: xr.DataTree) -> list[Figure]:
    """The summary, and what it does not show of each kind of part; angles of joints that springs show are left out."""
    if run.sizes.get("time", 1) < 2:
        return show.figures(run)
    first, drawn = summary(run)
    rest = show.figures(run, without=drawn | same_angles(run))
    return rest if first is None else [first, *rest]


def numbers(run: xr.DataTree) -> list[Number]:
    """Rows of the table on the screen, without angles of joints that springs show."""
    return show.numbers(run, without=same_angles(run) if run.sizes.get("time", 1) > 1 else ())


def summary(run: xr.DataTree) -> tuple[Figure | None, set[str]]:
    """One page by question, and the names of the variables that are all on it; None of what has no such answers.

    Angles of what deploys, with marks at latches; torques and forces of latches, with their largest values; rate and
    tilt of the base; loads at roots; energies.
    """
    panels, drawn = [], set()
    for made in (_angles(run), _latches(run), _roots(run)):
        for panel, names in made:
            panels.append(panel)
            drawn |= names
    if not panels:
        return None, set()
    base = list(_base(run))
    for panel, names in base:
        panels.append(panel)
        drawn |= names
    panels.append(balance.balance_figure(run).panels[0])
    time = variables.root_dataset(run)["time"].values
    end = _end(time, panels)
    if end < time[-1]:
        panels = [dataclasses.replace(panel, lines=[_until(line, end) for line in panel.lines]) for panel in panels]
    panels = [dataclasses.replace(panel, x_label="") for panel in panels[:-1]] + [
        dataclasses.replace(panels[-1], x_label="time, s")
    ]
    title = "Summary"
    if end < time[-1]:
        title += (
            f", up to {end:.3g} s: from there to {time[-1]:.6g} s nothing changes by more than {100 * _STILL:.0f} %"
        )
    height = _TITLE + _PANEL * len(panels)
    return Figure(name="summary", title=title, panels=panels, height=height), drawn


def same_angles(run: xr.DataTree) -> set[str]:
    """Angles of joints that are, but for a constant and the sign, those of springs."""
    time, found = variables.root_dataset(run)["time"].values, set()
    own: dict[bool, dict[str, np.ndarray]] = {True: {}, False: {}}
    for part in _with(run, "angle"):
        values = variables.group_of(run, part)["angle"].values
        if values.shape == time.shape:
            own[run[part].attrs.get("kind") == "joint"][part] = values - values[0]
    for joint, angle in own[True].items():
        least = _SAME * float(np.ptp(angle))
        if any(min(np.abs(angle - other).max(), np.abs(angle + other).max()) <= least for other in own[False].values()):
            found.add(f"{joint}.angle")
    return found


def _with(run: xr.DataTree, variable: str, *, also: str = "") -> list[str]:
    """Parts whose default figures show a variable, and that have another one as well."""
    return [
        part
        for part in variables.parts(run)
        if variable in show.plots_of(run, part) and (not also or also in run[part].data_vars)
    ]


_Panels = Iterator[tuple[Panel, set[str]]]


def _angles(run: xr.DataTree) -> _Panels:
    """Angles and travels of what latches, or else of all that springs turn."""
    for variable in ("angle", "travel"):
        parts = _with(run, variable, also="latch_time") or (
            [part for part in _with(run, variable) if run[part].attrs.get("kind") == "joint-spring"]
        )
        if not parts:
            continue
        lines = [line for part in parts for line in show.lines_of(run, f"{part}.{variable}", label=part)]
        lines, marks = show.coloured(lines), []
        for part, line in zip(parts, lines, strict=True):
            at = _last(run, part, "latch_time")
            if np.isfinite(at):
                marks.append(_mark(at, float(np.interp(at, line.x, line.y)), line.color))
        if marks:
            marks[0] = dataclasses.replace(marks[0], label="latched")
        label = show.panel_label(display.shown(variables.get(run, f"{parts[0]}.{variable}")), variable)
        yield Panel(x_label="", y_label=label, lines=[*lines, *marks]), {f"{part}.{variable}" for part in parts}


def _latches(run: xr.DataTree) -> _Panels:
    """Torques and forces of the latches that have locked, each with its largest value, also between samples."""
    for kind in ("torque", "force"):
        name, peak = f"latch_{kind}", f"latch_{kind}_peak"
        parts = [
            part
            for part in variables.parts(run)
            if peak in run[part].data_vars
            and name in run[part].data_vars
            and np.isfinite(_last(run, part, "latch_time"))
        ]
        if not parts:
            continue
        lines = show.coloured([line for part in parts for line in show.lines_of(run, f"{part}.{name}", label=part)])
        marks = []
        for k, (part, line) in enumerate(zip(parts, lines, strict=True)):
            at, value = peak_of(run, part, kind)
            unit = unit_text(str(run[part][peak].attrs["units"]))
            if line.label:
                lines[k] = dataclasses.replace(line, label=f"{part}: {quantity(abs(value), unit)} at {at:.4g} s")
            marks.append(_mark(at, value, line.color))
        label = f"latch {kind}, {unit_text(str(run[parts[0]][name].attrs['units']))}"
        yield Panel(x_label="", y_label=label, lines=[*lines, *marks]), set()


def peak_of(run: xr.DataTree, part: str, kind: str) -> tuple[float, float]:
    """Time (s) and value of the largest torque or force of a latch.

    The value is that of all steps, which may lie between samples; the time is that of the largest sample.
    """
    time, values = variables.root_dataset(run)["time"].values, variables.get(run, f"{part}.latch_{kind}").values
    k = int(np.nanargmax(np.abs(values)))
    return float(time[k]), float(np.copysign(abs(_last(run, part, f"latch_{kind}_peak")), values[k]))


def _base(run: xr.DataTree) -> _Panels:
    """Rate of the first body, and how far it has turned, or of a spinning one its tilt."""
    bodies = _with(run, "rate", also="attitude")
    if not bodies:
        return
    body = bodies[0]
    lines = show.moving(show.lines_of(run, f"{body}.rate", label=""))
    if _size(lines) > 0.0:
        words = [line.label.lstrip(".") for line in lines]
        named = len(lines) > 1
        lines = [
            dataclasses.replace(line, label=word if named else "") for line, word in zip(lines, words, strict=True)
        ]
        unit = unit_text(str(display.shown(variables.get(run, f"{body}.rate")).attrs["units"]))
        label = f"rate of {body}{'' if named else f' about {words[0]}'}, {unit}"
        shown = {f"{body}.rate"} if len(bodies) == 1 else set()
        yield Panel(x_label="", y_label=label, lines=show.coloured(lines)), shown
    time, attitude = variables.root_dataset(run)["time"].values, variables.get(run, f"{body}.attitude").values
    factor, name = display.shown_unit("rad")
    turned = np.linalg.norm(rotation_vectors(product(conjugate(attitude[:1]), attitude)), axis=1)
    lines, what = [Line(x=time, y=factor * turned)], "turn"
    if turned.max() > _TURNS and "tilt" in run[body].data_vars:
        lines, what = show.lines_of(run, f"{body}.tilt", label=""), "tilt"
    if _size(lines) > _LEAST_TURN * factor:
        yield Panel(x_label="", y_label=f"{what} of {body}, {unit_text(name)}", lines=lines), set()


def _size(lines: Sequence[Line]) -> float:
    return max(float(np.nanmax(np.abs(line.y), initial=0.0)) for line in lines)


def _roots(run: xr.DataTree) -> _Panels:
    """Magnitudes of forces and moments of the joints that hold beams and rods, each with its largest value."""
    held = _with(run, "moment", also="force")
    time = variables.root_dataset(run)["time"].values
    for variable in ("force", "moment") if held else ():
        unit, lines = unit_text(str(run[held[0]][variable].attrs["units"])), []
        for part in held:
            size = np.linalg.norm(variables.get(run, f"{part}.{variable}").values, axis=-1)
            k = int(np.nanargmax(size))
            label = f"{part}: {quantity(float(size[k]), unit)} at {time[k]:.4g} s"
            lines.append(Line(x=time, y=size, label=label))
        yield Panel(x_label="", y_label=f"{variable} in joints, {unit}", lines=show.coloured(lines)), set()


def _last(run: xr.DataTree, part: str, variable: str) -> float:
    """Last value of a number; not a number where there is none."""
    group = variables.group_of(run, part)
    return float(group[variable].values.flat[-1]) if variable in group else float("nan")


def _mark(at: float, value: float, color: int | float | str) -> Line:
    return Line(x=np.array([at]), y=np.array([value]), color=color, style="", marker="o")


def _end(time: np.ndarray, panels: Sequence[Panel]) -> float:
    """Time at which the page ends, s: a little after the last change of any curve, or the end of the run."""
    last = 0.0
    for panel in panels:
        lines = [line for line in panel.lines if len(line.x) == len(time)]
        if not lines:
            continue
        values = np.array([np.nan_to_num(line.y) for line in lines])
        size = float(np.abs(values).max())
        if size > 0.0:
            changed = np.flatnonzero((np.abs(values - values[:, -1:]) > _STILL * size).any(axis=0))
            last = max(last, float(time[changed[-1]]) if changed.size else 0.0)
    end = float(_LONGER * last + (1.0 - _LONGER) * time[0])
    return end if 0.0 < end < _CUT * time[-1] else float(time[-1])


def _until(line: Line, end: float) -> Line:
    """A curve up to a time."""
    kept = np.asarray(line.x) <= end
    return dataclasses.replace(line, x=np.asarray(line.x)[kept], y=np.asarray(line.y)[kept])
