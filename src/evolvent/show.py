"""Tables and figures of any run, from its variables."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from evolvent import results, variables
from evolvent.errors import InputError
from evolvent.figures import Figure, Line, Number, Panel

if TYPE_CHECKING:
    from evolvent.motion import Motion

#: Most lines that a legend names; more are coloured along a scale.
_NAMED = 7
#: Most characters of a panel's label.
_LONGEST_LABEL = 30
#: Most rows of the table that parts take.
_ROWS = 14


def plots_of(run: xr.DataTree, part: str) -> list[str]:
    """Variables that a part's default figures show."""
    found: list[str] = json.loads(run[part].attrs.get("plots", "[]"))
    return found


def label_of(found: xr.DataArray, fallback: str = "") -> str:
    """Axis label of a variable: its long name's first clause, and its unit."""
    unit = found.attrs.get("units", "")
    text = str(found.attrs.get("long_name", fallback)).partition(",")[0]
    return f"{text}, {unit_text(unit)}" if unit and unit != "1" else text


def unit_text(unit: str) -> str:
    """A unit as a figure shows it: 'kg m2 s-1' -> 'kg m²/s'."""
    powers = str.maketrans("234", "²³⁴")
    above: list[str] = []
    below: list[str] = []
    for word in unit.split():
        letters = word.rstrip("-0123456789")
        power = word[len(letters) :]
        (below if power.startswith("-") else above).append(
            letters + power.lstrip("-").replace("1", "").translate(powers)
        )
    top = " ".join(above) or "1"
    if not below:
        return top if above else unit
    return f"{top}/{below[0]}" if len(below) == 1 else f"{top}/({' '.join(below)})"


def lines_of(run: xr.DataTree | xr.Dataset, name: str, *, label: str | None = None, first: int = 0) -> list[Line]:
    """A variable over time as lines, one a component or place."""
    found = variables.get(run, name)
    if "time" not in found.dims:
        raise InputError(f"{name!r} does not change over time; name a variable over time")
    time = variables.root_dataset(run)["time"].values
    columns = variables.values(found)
    count = columns.shape[1]
    tags = _tags(found, count)
    lines = []
    for k in range(count):
        color: int | float = first + k if count <= _NAMED else k / max(count - 1, 1)
        own = name if label is None else label
        named = count <= _NAMED or k in (0, count - 1)
        lines.append(Line(x=time, y=columns[:, k], label=f"{own}{tags[k]}" if named else "", color=color))
    return lines


def _tags(found: xr.DataArray, count: int) -> list[str]:
    """What tells the columns of a variable apart."""
    dims = [d for d in found.dims if d != "time"]
    if not dims:
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


def figure(run: xr.DataTree | xr.Dataset, names: Sequence[str], *, name: str = "variables", title: str = "") -> Figure:
    """A figure of variables over time: those of one unit share a panel.

    Parameters
    ----------
    names : full names, as of `evolvent.variables.get`

    Raises
    ------
    InputError
        If a variable is not there, or does not change over time.
    """
    if not names:
        raise InputError("no variable is named; give names such as 'hub.rate'")
    panels: dict[str, list[tuple[str, xr.DataArray]]] = {}
    for full in names:
        found = variables.get(run, full)
        panels.setdefault(str(found.attrs.get("units", "")), []).append((full, found))
    drawn = []
    for group in panels.values():
        lines: list[Line] = []
        for full, _ in group:
            lines += lines_of(run, full, first=len(lines))
        label = label_of(group[0][1]) if len(group) == 1 else unit_text(str(group[0][1].attrs.get("units", "")))
        drawn.append(Panel(x_label="", y_label=label, lines=lines))
    last = drawn[-1]
    drawn[-1] = Panel(x_label="time, s", y_label=last.y_label, lines=last.lines)
    size = (8.0, 1.2 + 2.4 * len(drawn))
    return Figure(name=name, title=title or ", ".join(names[:4]), panels=drawn, size=size)


def spectrum(lines: Sequence[Line], *, unit: str, marks: Sequence[float] = (), title: str = "Spectra") -> Figure:
    """Amplitude spectra with a Hann window, in which an oscillation's peak is as high as its amplitude.

    Parameters
    ----------
    lines : values over time (s), as of `lines_of`, at equal intervals
    unit : str, of the values
    marks : angular frequencies, rad/s, that are marked as identified

    Raises
    ------
    InputError
        If there are fewer than four samples, or their intervals are not equal.
    """
    time = lines[0].x
    steps = np.diff(time)
    if time.size < 4 or np.ptp(steps) > 1e-6 * steps.max():
        raise InputError(f"the run has {time.size} samples; a spectrum needs four or more at equal intervals")
    window = np.hanning(time.size)
    omega = 2.0 * np.pi * np.fft.rfftfreq(4 * time.size, steps[0])
    drawn = []
    for line in lines:
        transform = np.fft.rfft((line.y - line.y.mean()) * window, 4 * time.size)
        drawn.append(dataclasses.replace(line, x=omega, y=2.0 * np.abs(transform) / window.sum(), width=1.0))
    top = max(float(line.y.max()) for line in drawn)
    low = max(min(float(line.y.min()) for line in drawn), 1e-6 * top)
    for k, w in enumerate(marks):
        label = "identified" if k == 0 else ""
        drawn.append(Line(x=np.array([w, w]), y=np.array([low, 2.0 * top]), color="gray", style=":", label=label))
    panel = Panel(x_label="angular frequency, rad/s", y_label=f"amplitude, {unit}", lines=drawn, log=True)
    return Figure(name="spectrum", title=f"{title} (Hann window)", panels=[panel], size=(8.0, 4.5))


def figures(run: xr.DataTree) -> list[Figure]:
    """Default figures of a run: one a kind of part, and one of the balances; empty of a single sample."""
    if run.sizes.get("time", 1) < 2:
        return []
    kinds: dict[str, list[str]] = {}
    for part in variables.parts(run):
        if plots_of(run, part):
            kinds.setdefault(str(run[part].attrs.get("kind", "part")), []).append(part)
    return [_kind_figure(run, kind, own) for kind, own in kinds.items()] + [balance_figure(run)]


def _kind_figure(run: xr.DataTree, kind: str, parts: list[str]) -> Figure:
    """The default variables of all parts of one kind, a panel each; of vectors of many parts, one a component."""
    order: dict[str, list[str]] = {}
    for part in parts:
        for variable in plots_of(run, part):
            if variable in run[part].data_vars:
                order.setdefault(variable, []).append(part)
    panels = []
    for variable, owners in order.items():
        found = variables.get(run, f"{owners[0]}.{variable}")
        label = _panel_label(found, variable)
        lines = {part: _moving(lines_of(run, f"{part}.{variable}", label=part)) for part in owners}
        if len(owners) < 3 or found.ndim == 1:
            panels.append(
                Panel(x_label="", y_label=label, lines=_coloured([one for own in lines.values() for one in own]))
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
                Panel(x_label="", y_label=f"{tag.lstrip('.')} of {label}" if tag else label, lines=_coloured(same))
            )
    last = panels[-1]
    panels[-1] = dataclasses.replace(last, x_label="time, s")
    title = kind.replace("-", " ").capitalize()
    return Figure(name=kind, title=title, panels=panels, size=(8.0, 1.2 + 2.4 * len(panels)))


def _panel_label(found: xr.DataArray, variable: str) -> str:
    """Axis label of a variable; of one with a long text its name, so that it fits beside a panel."""
    label = label_of(found)
    if len(label) <= _LONGEST_LABEL:
        return label
    unit = unit_text(str(found.attrs.get("units", "")))
    return variable.replace("_", " ") + (f", {unit}" if unit != "1" else "")


def _moving(lines: list[Line]) -> list[Line]:
    """Lines of the components of one variable, without those that stay at zero beside the others."""
    sizes = [float(np.nanmax(np.abs(line.y), initial=0.0)) for line in lines]
    kept = [line for line, size in zip(lines, sizes, strict=True) if size > 1e-9 * max(sizes)]
    return kept or lines[:1]


def _coloured(lines: list[Line]) -> list[Line]:
    """Lines of one panel in colours that tell them apart; of many, along a scale, the first and last one named."""
    if len(lines) <= _NAMED:
        return [dataclasses.replace(line, color=k) for k, line in enumerate(lines)]
    last = len(lines) - 1
    return [
        dataclasses.replace(line, color=k / last, label=line.label if k in (0, last) else "")
        for k, line in enumerate(lines)
    ]


#: Energies, work and losses of the balance, with their labels.
_BALANCE = {
    "energy_kinetic": "kinetic",
    "energy_elastic": "elastic",
    "energy_dissipated": "dissipated",
    "work_loads": "work of loads",
    "work_drives": "work of drives",
    "work_spools": "work of spools",
    "energy_released": "brought in at releases",
}


def balance_figure(run: xr.DataTree, rows: Mapping[str, str] | None = None) -> Figure:
    """Energies, work and losses, and how well they balance.

    Parameters
    ----------
    rows : mapping, variable of the root -> label; those of any run if left out
    """
    rows, root = _BALANCE if rows is None else rows, variables.root_dataset(run)
    time = root["time"].values
    sizes = {name: float(np.nanmax(np.abs(root[name].values), initial=0.0)) for name in rows}
    seen = [name for name in rows if sizes[name] > 1e-6 * max(sizes.values())]
    lines = [Line(x=time, y=root[name].values, label=rows[name], color=k) for k, name in enumerate(seen)]
    defect = Line(x=time, y=root["energy_defect"].values, color=0)
    panels = [
        Panel(x_label="", y_label="energy, J", lines=lines),
        Panel(x_label="time, s", y_label="defect of the balance, J", lines=[defect]),
    ]
    return Figure(name="energy-balance", title="Energy balance", panels=panels, size=(8.0, 6.0), heights=(3.0, 1.5))


def numbers(run: xr.DataTree) -> list[Number]:
    """Rows of the table on the screen: what the parts' default variables reach, balances, and how it was run."""
    found: list[Number] = []
    root, left = variables.root_dataset(run), 0
    for part in variables.parts(run):
        for variable in plots_of(run, part):
            if variable not in run[part].data_vars or len(found) >= _ROWS:
                left += variable in run[part].data_vars
                continue
            found.append(Number(label=f"{part}.{variable}", value=_reached(variables.get(run, f"{part}.{variable}"))))
    if left:
        found.append(Number(label="more variables", value=f"{left}; `evolvent info` lists them all"))
    if run.sizes.get("time", 1) > 1:
        defect = np.abs(root["energy_defect"].values)
        most = max(float(np.nanmax(np.abs(root["energy"].values), initial=0.0)), 1e-300)
        worst = float(np.nanmax(defect, initial=0.0))
        found.append(
            Number(label="energy balance", value=f"closes to {worst:.2g} J, {worst / most:.2g} of the largest energy")
        )
    reason = run.attrs.get("method_reason", "")
    if reason and reason != "as asked for":
        found.append(Number(label="method", value=f"{run.attrs['solver']}: {reason}"))
    return found + results.closing_numbers(root)


def _reached(found: xr.DataArray) -> str:
    """Last and largest value of a variable, with its unit; of a vector, its components at the end."""
    unit = unit_text(str(found.attrs.get("units", "")))
    unit = "" if unit == "1" else f" {unit}"
    columns = variables.values(found)
    finite = columns[np.isfinite(columns)]
    if not finite.size:
        return "none"
    if found.ndim == 1:
        largest = float(finite[np.argmax(np.abs(finite))])
        return (
            f"{columns[-1, 0]:.5g}{unit} at the end, {largest:.5g}{unit} at most"
            if len(columns) > 1
            else f"{columns[-1, 0]:.5g}{unit}"
        )
    if columns.shape[1] > 4:
        return f"from {finite.min():.5g} to {finite.max():.5g}{unit}"
    end = ", ".join(f"{v:.5g}" for v in columns[-1])
    if len(columns) == 1:
        return f"({end}){unit}"
    size = float(np.nanmax(np.linalg.norm(columns, axis=1)))
    return f"({end}){unit} at the end, size {size:.5g}{unit} at most"


def motion(run: xr.DataTree) -> Motion | None:
    """Bodies, lines, forces and marks of a run, by its parts; None where it holds too little."""
    from evolvent.drawing import motion_of

    title, start = str(run.attrs.get("title", "")), "evolvent run of "
    if title.startswith(start):
        title = title.removeprefix(start).replace("-", " ").capitalize()
    return motion_of(run, title=title)


def layout(case: Any) -> dict[str, dict[str, int | None]]:
    """Variables of the root that every run has."""
    time: dict[str, int | None] = {"time": None}
    names = ("energy", "energy_kinetic", "energy_elastic", "energy_dissipated", "energy_defect")
    return {"time": time, **dict.fromkeys(names, time)}
