"""Figures of any run, from its variables."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from evolvent.results import display, variables
from evolvent.view import balance
from evolvent.view.curves import NAMED, coloured, distinct, largest_of
from evolvent.view.drawing import motion_of
from evolvent_base.errors import InputError
from evolvent_base.figures import Figure, Line, Panel, stacked
from evolvent_base.units import unit_text

if TYPE_CHECKING:
    from evolvent.results.motion import Motion

#: Most characters of a panel's label.
_LONGEST_LABEL = 30
#: Share of the largest value of a unit, in all parts, below which a variable is round-off; and least angle, rad.
_NOTHING, _LEAST_ANGLE = 1e-10, 1e-9
#: Share of a variable's largest value in any part, below which it is round-off.
_NOISE = 1e-12


def plots_of(run: xr.DataTree, part: str) -> list[str]:
    """Variables that a part's default figures show."""
    found: list[str] = json.loads(run[part].attrs.get("plots", "[]"))
    return found


def round_off(run: xr.DataTree) -> dict[str, float]:
    """Largest value that is round-off, by unit of the data.

    It is a share of the largest value of the unit in all parts; angles, and rates over the length of the run, have
    a least value besides; forces and torques are compared with the energy that has moved, over the largest length, and
    momenta with these over the length of the run.
    """
    largest: dict[str, float] = {}
    for part in variables.parts(run):
        group = variables.group_of(run, part)
        for name in plots_of(run, part):
            if name in group.data_vars:
                unit = str(group[name].attrs.get("units", ""))
                largest[unit] = max(largest.get(unit, 0.0), largest_of(group[name].values))
    found = {unit: _NOTHING * value for unit, value in largest.items()}
    root = variables.root_dataset(run)
    span = float(np.ptp(root["time"].values)) if "time" in root.coords else 0.0
    moved = largest_of(root["energy_moved"].values) if "energy_moved" in root else 0.0
    floors = {"rad": _LEAST_ANGLE, "N m": _NOTHING * moved}
    if span > 0.0:
        floors["rad s-1"] = _LEAST_ANGLE / span
        floors["kg m2 s-1"] = floors["N m"] * span
    if largest.get("m", 0.0) > 0.0:
        floors["N"] = _NOTHING * moved / largest["m"]
        floors["kg m s-1"] = floors["N"] * span
    return {unit: max(found.get(unit, 0.0), floors.get(unit, 0.0)) for unit in {**found, **floors}}


def label_of(found: xr.DataArray, fallback: str = "") -> str:
    """Axis label of a variable: its long name's first clause, and its unit."""
    unit = found.attrs.get("units", "")
    text = str(found.attrs.get("long_name", fallback)).partition(",")[0]
    return f"{text}, {unit_text(unit)}" if unit and unit != "1" else text


def lines_of(
    run: xr.DataTree | xr.Dataset, name: str, *, label: str | None = None, first: int = 0, units: str | None = None
) -> list[Line]:
    """A variable over time as lines, one for each component or entry; in `units` as of `display.shown`."""
    found = display.shown(variables.get(run, name), units)
    if "time" not in found.dims:
        raise InputError(f"{name!r} does not change over time; name a variable over time")
    time = variables.root_dataset(run)["time"].values
    columns = variables.values(found)
    count = columns.shape[1]
    tags = _tags(found, count)
    lines = []
    for k in range(count):
        color: int | float = first + k if count <= NAMED else k / max(count - 1, 1)
        own = name if label is None else label
        named = count <= NAMED or k in (0, count - 1)
        label_k, marker = f"{own}{tags[k]}" if named else "", "" if time.size > 1 else "o"
        lines.append(Line(x=time, y=columns[:, k], label=label_k, color=color, marker=marker))
    return lines


def _tags(found: xr.DataArray, count: int) -> list[str]:
    """Names that distinguish the columns of a variable."""
    dims = [d for d in found.dims if d != "time"]
    if count == 1:
        return [""]
    words: list[list[str]] = []
    for d in dims:
        size = found.sizes[d]
        letters = {"axis": ".x .y .z", "quaternion": ".w .x .y .z"}.get(str(d), "").split()
        words.append(letters if len(letters) == size else [f"[{k}]" for k in range(size)])
    tags = [""]
    for own in words:
        tags = [tag + word for tag in tags for word in own]
    return tags if len(tags) == count else [f"[{k}]" for k in range(count)]


def figure(
    run: xr.DataTree | xr.Dataset, names: Sequence[str], *, name: str = "variables", title: str = "",
    units: str | None = None,
) -> Figure:  # fmt: skip
    """A figure of variables over time: those of one unit share a panel.

    Parameters
    ----------
    names : full names, as of `evolvent.results.variables.get`
    units : str, of angles and rates, as of `evolvent.results.display.shown`

    Raises
    ------
    InputError
        If a variable is not there, or does not change over time, or for other units.
    """
    if not names:
        raise InputError("no variable is named; give names such as 'hub.rate'")
    panels: dict[str, list[tuple[str, xr.DataArray]]] = {}
    for full in names:
        found = display.shown(variables.get(run, full), units)
        panels.setdefault(str(found.attrs.get("units", "")), []).append((full, found))
    drawn = []
    for group in panels.values():
        lines: list[Line] = []
        for full, _ in group:
            own = _short(full, [other for other, _ in group])
            lines += lines_of(run, full, label=own, first=len(lines), units=units)
        drawn.append(Panel(x_label="", y_label=_shared_label(group), lines=lines))
    last = drawn[-1]
    drawn[-1] = Panel(x_label="time, s", y_label=last.y_label, lines=last.lines)
    return Figure(name=name, title=title or ", ".join(names[:4]), panels=drawn, height=stacked(len(drawn)))


def _shared_label(group: Sequence[tuple[str, xr.DataArray]]) -> str:
    """Axis label of variables of one unit: what they are, with the component where one is drawn, and the unit."""
    words: dict[str, list[str]] = {}
    for full, found in group:
        match = variables.matched(full)
        axis = match["axis"] if match is not None else None
        text, comma, unit = panel_label(found, str(found.name).rpartition(".")[2]).partition(", ")
        words.setdefault(text, []).extend([axis] if axis else [])
    both = " / ".join(f"{text} {', '.join(dict.fromkeys(axes))}".rstrip() for text, axes in words.items())
    return f"{both}{comma}{unit}" if len(group) == 1 or len(both) <= _LONGEST_LABEL else unit


def _short(full: str, names: Sequence[str]) -> str:
    """Part of a variable's name that distinguishes it in its panel; empty for a single one."""
    if len(names) == 1:
        return full.partition(".")[0] if "." in full else ""
    part, _, own = full.partition(".")
    if not own:
        return full.replace("_", " ")
    parts, owns = ({name.partition(".")[k] for name in names} for k in (0, 2))
    if len(owns) == 1:
        return part
    return own.replace("_", " ") if len(parts) == 1 else f"{part} {own.replace('_', ' ')}"


def figures(run: xr.DataTree, *, without: Collection[str] = ()) -> list[Figure]:
    """Figures of a run: one a kind of part, and one of the balances; of one state, of all that is long.

    Parameters
    ----------
    without : names of variables that are not drawn
    """
    if run.sizes.get("time", 1) < 2:
        return figures_along(run)
    kinds: dict[str, list[str]] = {}
    for part in variables.parts(run):
        if plots_of(run, part):
            kinds.setdefault(str(run[part].attrs.get("kind", "part")), []).append(part)
    drawn = [_kind_figure(run, kind, own, without) for kind, own in kinds.items()]
    return [figure for figure in drawn if figure.panels] + [balance.balance_figure(run)]


def figures_along(run: xr.DataTree) -> list[Figure]:
    """Figures of the last state along the parts, one a part; without what is nothing beside others of its unit."""
    found = []
    for part in variables.parts(run):
        group = variables.group_of(run, part)
        panels = []
        named = [name for name in json.loads(group.attrs.get("plots_along", "[]")) if name in group.data_vars]
        largest: dict[str, float] = {}
        for name in named:
            unit = group[name].attrs["units"]
            largest[unit] = max(largest.get(unit, 0.0), float(np.nanmax(np.abs(group[name].values[-1]))))
        for name in named:
            variable = group[name]
            if np.nanmax(np.abs(variable.values[-1])) > 1e-9 * largest[variable.attrs["units"]]:
                panels.append(_panel_along(group, name))
        if panels:
            panels[-1] = dataclasses.replace(panels[-1], x_label="length from the root, m")
            name, height = f"along-{part.replace(' ', '-')}", stacked(len(panels))
            found.append(Figure(name=name, title=f"Along {part}", panels=panels, height=height))
    return found


def _panel_along(group: xr.Dataset, name: str) -> Panel:
    """The last values of a variable over the length at which they are, a line a component."""
    variable = display.shown(group[name])
    place = variable.dims[1]
    arc = next(c for c in group.coords.values() if c.dims == (place,) and c.attrs.get("units") == "m")
    columns = variable.values[-1].reshape(arc.size, -1)
    tags = _tags(variable.isel({place: 0}), columns.shape[1])
    lines = [Line(x=arc.values, y=y, label=tag.lstrip(".")) for y, tag in zip(columns.T, tags, strict=True)]
    return Panel(x_label="", y_label=panel_label(variable, name), lines=coloured(moving(lines, 0.0)))


def _kind_figure(run: xr.DataTree, kind: str, parts: list[str], without: Collection[str]) -> Figure:
    """The default variables of all parts of one kind, a panel each; of vectors of many parts, one a component."""
    order: dict[tuple[str, str, tuple[int, ...]], list[str]] = {}
    panels, nothing = [], round_off(run)
    for part in parts:
        group = variables.group_of(run, part)
        for variable in plots_of(run, part):
            if variable in group.data_vars and f"{part}.{variable}" not in without:
                one = group[variable]
                if largest_of(one.values) > nothing.get(str(one.attrs.get("units", "")), 0.0):  # else round-off
                    written = str(one.attrs.get(display.WRITTEN, ""))  # a panel has one unit
                    order.setdefault((variable, written, one.shape), []).append(part)
    for (variable, *_), owners in order.items():
        every = [display.shown(variables.get(run, f"{part}.{variable}")) for part in owners]
        found = every[0]
        same_text = len({label_of(one) for one in every}) == 1  # that of a joint names what it holds
        label = panel_label(found, variable, short=not same_text)
        least = _NOISE * _largest(run, variable)
        lines = {part: moving(lines_of(run, f"{part}.{variable}", label=part), least) for part in owners}
        if not any(lines.values()):
            continue
        if len(owners) < 3 or found.ndim == 1:
            panels.append(
                Panel(x_label="", y_label=label, lines=_grouped([one for own in lines.values() for one in own]))
            )
            continue
        for tag in dict.fromkeys(one.label.removeprefix(part) for part, own in lines.items() for one in own):
            same = [
                dataclasses.replace(one, label=part)
                for part, own in lines.items()
                for one in own
                if one.label == part + tag
            ]
            panels.append(
                Panel(x_label="", y_label=f"{tag.lstrip('.')} of {label}" if tag else label, lines=_grouped(same))
            )
    if panels:
        panels[-1] = dataclasses.replace(panels[-1], x_label="time, s")
    title = kind.replace("-", " ").capitalize()
    return Figure(name=kind, title=title, panels=panels, height=stacked(len(panels)))


def _grouped(lines: list[Line]) -> list[Line]:
    """Lines of one panel, equal ones as one and many of repeated parts as a band, where each has a name of its own."""
    named = {line.label: line for line in lines}
    return [line for _, line in distinct(named)] if len(named) == len(lines) else coloured(lines)


def panel_label(found: xr.DataArray, variable: str, *, short: bool = False) -> str:
    """Axis label of a variable; of one with a long text, or `short`, its name, so that it fits beside a panel."""
    label = label_of(found)
    if len(label) <= _LONGEST_LABEL and not short:
        return label
    unit = unit_text(str(found.attrs.get("units", "")))
    return variable.replace("_", " ") + (f", {unit}" if unit != "1" else "")


def moving(lines: list[Line], least: float = 0.0) -> list[Line]:
    """Lines of the components of one variable, without those that stay at zero beside the others.

    None where all are round-off, below `least` and not 0.
    """
    sizes = [float(np.nanmax(np.abs(line.y), initial=0.0)) for line in lines]
    if 0.0 < max(sizes) < least:
        return []
    kept = [line for line, size in zip(lines, sizes, strict=True) if size > 1e-6 * max(sizes)]
    return kept or lines[:1]


def _largest(run: xr.DataTree, variable: str) -> float:
    """Largest value that any part has of a variable, such as of a position."""
    groups = (variables.group_of(run, part) for part in variables.parts(run))
    held = (display.shown(group[variable]).values for group in groups if variable in group)
    return max((float(np.nanmax(np.abs(values), initial=0.0)) for values in held), default=0.0)


def title_of(run: xr.DataTree | xr.Dataset) -> str:
    """Title of a run; of one without a title of its own the name of its system, as "Wrapped rib"."""
    title, start = str(run.attrs.get("title") or ""), "evolvent run of "
    return title.removeprefix(start).replace("-", " ").capitalize() if title.startswith(start) else title


def motion(run: xr.DataTree) -> Motion | None:
    """Bodies, lines, forces and marks of a run, by its parts; None where it holds too little."""
    return motion_of(run, title=title_of(run))
