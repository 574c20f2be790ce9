"""The figures of a run of parts: first one page that answers what is asked of a deployment, then the kinds of parts."""

from __future__ import annotations

import dataclasses
import json
import types
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import xarray as xr

from evolvent.results import display, happened, variables
from evolvent.results.motion import quantity
from evolvent.results.rotations import conjugate, product, rotation_vectors
from evolvent.view import balance, show, table
from evolvent.view.curves import Peak, distinct, largest_of, listed, peak_over_time, stem_of
from evolvent_base.figures import Figure, Line, Number, Panel
from evolvent_base.units import unit_text

#: Share of the range of a curve within which it no longer changes, and of the run at which the page ends at most.
_STILL, _CUT = 0.01, 0.6
#: How much longer than what happens the page is, and heights of its title and of a panel, mm.
_LONGER, _TITLE, _PANEL = 1.15, 14.0, 40.0
#: Share of the largest value of a panel below which a curve is not seen, and most lines of the panel of events.
_UNSEEN, _KINDS = 1e-4, 10
#: Height of the panel of events, and of each of its lines more, of that of another one.
_STRIP, _ROW = 0.2, 0.1
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
    return table.numbers(run, without=same_angles(run) if run.sizes.get("time", 1) > 1 else ())


def summary(run: xr.DataTree) -> tuple[Figure | None, set[str]]:
    """One page by question, and the names of the variables that are all on it; None of what has no such answers.

    What happened and when; angles of what deploys, with marks at latches; torques and forces of latches, of what acts
    on coordinates, and of cords, with their largest values; loads at roots; rate and tilt of the base; energies. Equal
    curves are one, and round-off is not drawn.
    """
    panels, drawn = [], set()
    for made in (_angles(run), _latches(run), _acting(run), _one_sided(run), _roots(run)):
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
    strip = _events(run)
    panels = [strip, *panels] if strip is not None else panels
    time = variables.root_dataset(run)["time"].values
    panels = [dataclasses.replace(panel, x_label="") for panel in panels[:-1]] + [
        dataclasses.replace(panels[-1], x_label="time, s")
    ]
    heights = [1.0] * len(panels)
    if strip is not None:
        heights[0] = _STRIP + _ROW * len(strip.lines)
    height = _TITLE + _PANEL * sum(heights)
    whole = Figure(name="summary", title="Summary", panels=panels, height=height, heights=heights)
    end = max(_end(time, panels), _end_of_loads(run, time))
    if end >= time[-1]:
        return whole, drawn
    cut = [dataclasses.replace(panel, lines=[_until(line, end) for line in panel.lines]) for panel in panels]
    title = (
        f"Summary, up to {end:.3g} s: from there to {time[-1]:.6g} s no curve changes by more than {100 * _STILL:.0f} %"
    )
    return dataclasses.replace(whole, title=title, panels=cut, whole=whole), drawn


def same_angles(run: xr.DataTree) -> set[str]:
    """Angles and travels that another part shows.

    Those of joints that are, but for a constant and the sign, those of springs, and those of what acts on a coordinate,
    such as a motor, that are those of another part.
    """
    time, found = variables.root_dataset(run)["time"].values, set()
    for variable in ("angle", "travel"):
        known: dict[bytes, str] = {}
        for part in _with(run, variable):
            values = variables.group_of(run, part)[variable].values
            if known.setdefault(values.tobytes(), part) != part:
                found.add(f"{part}.{variable}")
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
        curves = {part: show.lines_of(run, f"{part}.{variable}", label=part)[0] for part in parts}
        lines, marks = [], []
        for own, line in distinct(curves):
            lines.append(line)
            for at, part in {_last(run, part, "latch_time"): part for part in reversed(own)}.items():
                if np.isfinite(at):
                    marks.append(_mark(at, float(np.interp(at, curves[part].x, curves[part].y)), line.color))
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
        curves = {part: show.lines_of(run, f"{part}.{name}", label=part)[0] for part in parts}
        lines, marks = [], []
        for own, line in distinct(curves):
            top, whose = max(((peak_of(run, part, kind), part) for part in own), key=lambda one: abs(one[0].value))
            unit = unit_text(str(run[parts[0]][peak].attrs["units"]))
            at = float(curves[whose].x[top.k])
            lines.append(_labelled(line, at, top, unit, whose))
            marks.append(_mark(at, top.value, line.color))
        label = f"latch {kind}, {unit_text(str(run[parts[0]][name].attrs['units']))}"
        yield Panel(x_label="", y_label=label, lines=[*lines, *marks]), set()


def _labelled(line: Line, at: float, peak: Peak, unit: str, whose: str = "") -> Line:
    """A curve whose label states its largest magnitude, and when and in which part it has that."""
    if not line.label:
        return line
    whose = f" ({whose})" if whose and line.fill else ""
    when = f" {peak.when} {at:.4g} s" if peak.near else ""
    return dataclasses.replace(line, label=f"{line.label}: {quantity(abs(peak.value), unit)}{when}{whose}")


def _with_peaks(
    curves: Mapping[str, Line], unit: str, over: Mapping[str, np.ndarray] = types.MappingProxyType({})
) -> list[Line]:
    """Distinct curves, with a label of the largest value of each, and a mark if its time is known.

    Parameters
    ----------
    over : (2,) float, least and largest values over all steps, by part, where they are known
    """
    lines, marks = [], []
    peaks = {part: peak_over_time(np.nan_to_num(line.y), over.get(part)) for part, line in curves.items()}
    for own, line in distinct(curves):
        whose = max(own, key=lambda part: abs(peaks[part].value))
        at = float(curves[whose].x[peaks[whose].k])
        lines.append(_labelled(line, at, peaks[whose], unit, whose))
        marks += [_mark(at, peaks[whose].value, line.color)] if peaks[whose].near else []
    return [*lines, *marks]


def _peaks(run: xr.DataTree, found: Mapping[tuple[str, str], list[str]]) -> _Panels:
    """A panel for each variable of so many parts, by the variable and what it is called; none of round-off."""
    nothing = show.round_off(run)
    for (variable, called), parts in found.items():
        values = [variables.group_of(run, part)[variable] for part in parts]
        sizes = [table.size_of(one) for one in values]
        least = [max(nothing.get(str(one.attrs["units"]), 0.0), _UNSEEN * max(sizes)) for one in values]
        parts = [part for part, size, none in zip(parts, sizes, least, strict=True) if size > none]
        if not parts:
            continue
        shown = {part: display.shown(variables.get(run, f"{part}.{variable}")) for part in parts}
        noted = ((part, variables.extremes_of(one)) for part, one in shown.items())
        over = {part: extremes for part, extremes in noted if extremes is not None}
        unit = unit_text(str(shown[parts[0]].attrs["units"]))
        curves = {part: show.lines_of(run, f"{part}.{variable}", label=part)[0] for part in parts}
        label = f"{variable.replace('_', ' ')} of {called}, {unit}"
        lines = _with_peaks(curves, unit, over)
        yield Panel(x_label="", y_label=label, lines=lines), {f"{part}.{variable}" for part in parts}


def _acting(run: xr.DataTree) -> _Panels:
    """Torques, forces and tensions of what acts on coordinates, as motors, tape springs and cords, by kind of part.

    Those of parts that have latched are those of the latch.
    """
    found: dict[tuple[str, str], list[str]] = {}
    for coordinate, force in (("angle", "torque"), ("travel", "force"), ("length", "tension")):
        for part in _with(run, force, also=coordinate):
            if not np.isfinite(_last(run, part, "latch_time")) and variables.group_of(run, part)[force].ndim == 1:
                found.setdefault((force, _kind(run, part)), []).append(part)
    yield from _peaks(run, found)


def _one_sided(run: xr.DataTree) -> _Panels:
    """Forces of cords, and of others that act one way, by kind of part."""
    found: dict[tuple[str, str], list[str]] = {}
    for part in variables.parts(run):
        words = json.loads(run[part].attrs.get("one_sided", "{}"))
        for variable in show.plots_of(run, part):
            if variable in words:
                found.setdefault((variable, _kind(run, part)), []).append(part)
    yield from _peaks(run, found)


def _kind(run: xr.DataTree, part: str) -> str:
    return f"{str(run[part].attrs.get('kind', 'part')).replace('-', ' ')}s"


def _events(run: xr.DataTree) -> Panel | None:
    """A line for each thing that happened, of equal parts in one, with marks at its times; None without any."""
    events, kinds = happened.events_of(run), dict[tuple[str, str], dict[str, list[float]]]()
    for time, part, what in zip(events.time.values, events.part.values, events.what.values, strict=True):
        kinds.setdefault((stem_of(str(part)), str(what)), {}).setdefault(str(part), []).append(float(time))
    if not kinds:
        return None
    lines, names = [], {}
    for k, ((_, what), parts) in enumerate(list(kinds.items())[:_KINDS]):
        times = np.unique(np.concatenate([np.array(own) for own in parts.values()]))
        names[-float(k)] = f"{listed(list(parts))} {what}".removesuffix(" event").strip() or what
        lines.append(Line(x=times, y=np.full(times.size, -float(k)), style="", marker="o", color=0))
    return Panel(x_label="", y_label="", lines=lines, y_names=names)


def peak_of(run: xr.DataTree, part: str, kind: str) -> Peak:
    """The largest torque or force of a latch, of all steps.

    A latch swings most as it has locked, so that its largest sample is always near.
    """
    found = variables.get(run, f"{part}.latch_{kind}")
    peak = peak_over_time(np.nan_to_num(found.values), variables.extremes_of(found))
    return peak._replace(value=float(np.copysign(_last(run, part, f"latch_{kind}_peak"), peak.value)), near=True)


def _base(run: xr.DataTree) -> _Panels:
    """Rate of the first body, and how far it has turned, or of a spinning one its tilt."""
    bodies = _with(run, "rate", also="attitude")
    if not bodies:
        return
    body = bodies[0]
    lines = show.moving(show.lines_of(run, f"{body}.rate", label=""))
    nothing = show.round_off(run)["rad s-1"]
    if largest_of(variables.get(run, f"{body}.rate").values) > nothing:
        words = [line.label.lstrip(".") for line in lines]
        named = len(lines) > 1
        lines = [
            dataclasses.replace(line, label=word if named else "") for line, word in zip(lines, words, strict=True)
        ]
        unit = unit_text(str(display.shown(variables.get(run, f"{body}.rate")).attrs["units"]))
        label = f"rate of {body}{'' if named else f' about {words[0]}'}, {unit}"
        shown = {f"{body}.rate"} if len(bodies) == 1 else set()
        curves = {line.label or "largest": line for line in lines}
        yield Panel(x_label="", y_label=label, lines=_with_peaks(curves, unit)), shown
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
    held, nothing = _with(run, "moment", also="force"), show.round_off(run)
    time = variables.root_dataset(run)["time"].values
    for variable in ("force", "moment") if held else ():
        units = str(run[held[0]][variable].attrs["units"])
        sizes = {part: np.linalg.norm(variables.get(run, f"{part}.{variable}").values, axis=-1) for part in held}
        curves = {
            part: Line(x=time, y=size, label=part)
            for part, size in sizes.items()
            if largest_of(size) > nothing.get(units, 0.0)
        }
        if curves:
            unit = unit_text(units)
            yield Panel(x_label="", y_label=f"{variable} in joints, {unit}", lines=_with_peaks(curves, unit)), set()


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
        curves = [curve for line in panel.lines for curve in _curves_of(line, time.size)]
        if not curves:
            continue
        values = np.nan_to_num(np.array(curves))
        size = float(np.abs(values).max())
        if size > 0.0:
            changed = np.flatnonzero((np.abs(values - values[:, -1:]) > _STILL * size).any(axis=0))
            last = max(last, float(time[changed[-1]]) if changed.size else 0.0)
    end = float(_LONGER * last + (1.0 - _LONGER) * time[0])
    return end if 0.0 < end < _CUT * time[-1] else float(time[-1])


def _curves_of(line: Line, count: int) -> list[np.ndarray]:
    """Values over all times of a curve, and of both sides of a band; none of marks."""
    y = np.asarray(line.y)
    if line.fill and y.size == 2 * count:
        return [y[:count], y[count:][::-1]]
    return [y] if y.size == count else []


def _end_of_loads(run: xr.DataTree, time: np.ndarray) -> float:
    """Time at which the last of what the case gives over time has changed, s: the page shows what follows from it."""
    end = float(time[0])
    for part in variables.parts(run):
        for name in json.loads(run[part].attrs.get("given", "[]")):
            values = variables.values(variables.group_of(run, part)[name])
            changed = np.flatnonzero((np.abs(values - values[-1:]) > _STILL * largest_of(values)).any(axis=1))
            if changed.size:
                end = float(time[-1]) if _LONGER * time[changed[-1]] > _CUT * time[-1] else max(
                    end, _LONGER * float(time[changed[-1]])
                )  # fmt: skip
    return end


def _until(line: Line, end: float) -> Line:
    """A curve up to a time."""
    kept = np.asarray(line.x) <= end
    return dataclasses.replace(line, x=np.asarray(line.x)[kept], y=np.asarray(line.y)[kept])
