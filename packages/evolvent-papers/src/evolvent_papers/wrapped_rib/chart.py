"""Figures of studies: when the tip is fastest (Yi, figure 7), and what touches the hub over its rate or the torque."""

from __future__ import annotations

import itertools
import json
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from evolvent import cases, closed_forms
from evolvent_base.errors import InputError
from evolvent_base.figures import Figure, Line, Panel
from evolvent_papers.wrapped_rib.show import comparable_string

if TYPE_CHECKING:
    import xarray as xr

#: Stands for the run from which a later stage starts.
UNKNOWN = "before.nc"


def study_figures(dataset: xr.Dataset) -> dict[str, Figure]:
    """Figures of a grid: over the drive's torque or rate what touches the hub; over one key when the tip is fastest."""
    return _peak_figures(dataset) | _touching_figures(dataset)


def _peak_figures(dataset: xr.Dataset) -> dict[str, Figure]:
    """Time of the largest tip speed over the key of a grid over one key, for each stage that it is kept of."""
    keys = [key for key in json.loads(dataset.attrs["keys"]) if dataset[key].size > 1]
    if dataset.attrs["sample"] != "grid" or len(keys) != 1 or dataset[keys[0]].dtype.kind not in "iuf":
        return {}
    found = {}
    for stage in json.loads(dataset.attrs.get("stages", "[]")) or [""]:
        name = f"{stage}_tip_speed_peak_time".lstrip("_")
        if name in dataset and keys[0] in dataset[name].dims:
            found[f"{stage}_peak".lstrip("_")] = _peaks(dataset, keys[0], name, stage)
    return found


def _peaks(study: xr.Dataset, key: str, name: str, stage: str) -> Figure:
    """When the tip of the first rib is fastest, and when a string is wound."""
    at, string, unit = study[key].values, _strings(study, key, stage), str(study[key].attrs.get("units", "1"))
    peak = study[name].isel({dim: 0 for dim in study[name].dims if dim != key}).values
    lines = [Line(x=at, y=peak, label="runs", color=1, style="", marker="o")]
    if np.any(np.isfinite(string)):
        lines.append(Line(x=at, y=string, label="string, 98 % wound", color=2, style="--", marker="x", width=1.0))
    title = f"Time of the largest tip speed{f', stage {stage}' if stage else ''}"
    label = key if unit in ("1", "") else f"{key}, {unit}"
    panel = Panel(x_label=label, y_label="time, s", lines=lines, y_zero=True)
    return Figure(name=name, title=title, panels=[panel], height=92.0)


def _strings(study: xr.Dataset, key: str, stage: str) -> np.ndarray:
    """Time at which a string is wound, for each value of the key; NaN where none is comparable."""
    content = cases.parse_yaml(study.attrs["study"], "the study")
    changes = dict(content.get("set") or {})
    for k, one in enumerate(content.get("stages") or []):
        if one["name"] == stage:
            changes |= (one.get("set") or {}) | ({"start": UNKNOWN} if k else {})
    path = key.removeprefix(f"{stage}.") if stage else key

    def end_time(value: object) -> float:
        try:
            string = comparable_string(cases.load(content["case"], changes | {path: value}))
        except InputError:
            return np.nan
        return np.nan if string is None else string.end_time

    return np.array([end_time(value.item()) for value in study[key].values])


class _Row(NamedTuple):
    """Runs that differ in one key alone: label, cases, values of the key, share of the rib up to its last contact."""

    label: str
    cases: list[Any]
    at: np.ndarray
    touching: np.ndarray


def _touching_figures(study: xr.Dataset) -> dict[str, Figure]:
    """What touches the hub at the end, over the drive's torque or rate; none of studies with stages."""
    is_grid = study.attrs["sample"] == "grid" and not json.loads(study.attrs.get("stages", "[]"))
    if not is_grid or "touching_angle" not in study or not {"time", "rib"} <= set(study.touching_angle.dims):
        return {}
    draws = {"drive.torque": _over_torque, "drive.rate": _over_rate}
    over = [key for key in draws if key in study.dims and study[key].size > 1]
    rows = _rows(study, over[0]) if len(over) == 1 else []
    return {"touching": draws[over[0]](rows)} if rows else {}


def _rows(study: xr.Dataset, key: str) -> list[_Row]:
    """Runs of a grid, a row for each choice of the other keys; those of refused cases are left out."""
    content = cases.parse_yaml(study.attrs["study"], "the study")
    fixed, keys = dict(content.get("set") or {}), json.loads(study.attrs["keys"])
    last, others, rows = study.touching_angle.isel(time=-1, rib=0), [one for one in keys if one != key], []
    for choice in itertools.product(*(study[one].values for one in others)):
        given = {one: value.item() for one, value in zip(others, choice, strict=True)}
        made = [_loaded(content["case"], fixed | given | {key: value.item()}) for value in study[key].values]
        there = np.array([case is not None for case in made])
        if not there.any():
            continue
        found = [case for case in made if case is not None]
        lengths = np.array([case.rib.length / case.hub.radius for case in found])
        label = ", ".join(_written(study, one, value) for one, value in given.items()) or "runs"
        rows.append(_Row(label, found, study[key].values[there], last.sel(given).values[there] / lengths))
    return rows


def _loaded(base: Any, changes: dict[str, Any]) -> Any:
    """A case, or None where it is refused."""
    try:
        return cases.load(base, changes)
    except InputError:
        return None


def _written(study: xr.Dataset, key: str, value: Any) -> str:
    """A key of a study with a value, for a legend."""
    text = f"{value:.4g}" if isinstance(value, (int, float)) else str(value)
    return f"{key} {text} {study[key].attrs.get('units', '')}".removesuffix(" 1").strip()


def _over_torque(rows: list[_Row]) -> Figure:
    """Over the torque, of EI/(2 R), with the equilibria of the tail, which depend on length over radius alone."""
    lines: list[Line] = []
    held: dict[float, tuple[int, Any]] = {}
    for k, row in enumerate(rows):
        least = np.array([closed_forms.least_winding_torque(case.strip) for case in row.cases])
        lines.append(Line(x=row.at / least, y=row.touching, label=row.label, color=k, style="", marker="o"))
        first = row.cases[0]
        if first.strip.taper == 1.0 and first.rib.shape is None:
            held.setdefault(round(first.strip.length / first.strip.radius, 9), (k, first.strip))
    top = max((float(line.x.max()) for line in lines), default=0.0)
    for n, (k, strip) in enumerate(held.values()):
        lines += _elastica(strip, 1.3 * top, k if len(held) > 1 else "black", first=n == 0)
    limit = Line(x=np.ones(2), y=np.array([0.0, 1.0]), label="EI/(2R), least torque", color="gray", style=":")
    panel = Panel(
        x_label="torque over EI/(2R)",
        y_label="share of the rib up to its last contact with the hub",
        lines=[*lines, limit],
        log_x=True,
        y_zero=True,
    )
    return Figure(
        name="touching", title="What touches the hub at the end, over the torque", panels=[panel], height=100.0
    )


def _elastica(strip: closed_forms.Strip, top: float, color: int | str, *, first: bool) -> list[Line]:
    """Tails at rest up to a torque of `top` times EI/(2 R); none where they are not found."""
    try:
        held = closed_forms.held_tails(strip)
    except ArithmeticError:
        return []
    x = held.torque / closed_forms.least_winding_torque(strip)
    shown = x <= top
    share = held.touching[shown] * strip.radius / strip.length
    label = "tail at rest, elastica" if first else ""
    return [Line(x=x[shown], y=share, label=label, color=color, style="--", width=1.2)]


def _over_rate(rows: list[_Row]) -> Figure:
    """Over the rate of the hub, with a string at rest in the hub's axes where the hub winds."""
    lines, labelled = [], False
    for k, row in enumerate(rows):
        lines.append(Line(x=row.at, y=row.touching, label=row.label, color=k, style="", marker="o"))
        case, positive = row.cases[0], row.at[row.at > 0.0]
        if case.damping.alpha == 0.0 or case.damped_arcs is not None or case.phase != "wind" or not positive.size:
            continue
        rates = np.linspace(0.5 * positive.min(), positive.max(), 30)
        try:
            angles = np.array([closed_forms.spun_tail(case.strip, rate, case.damping.alpha).touching for rate in rates])
        except ArithmeticError:
            continue
        share = angles * case.strip.radius / case.strip.length
        label = "" if labelled else "string at rest on the turning hub"
        lines.append(Line(x=rates, y=share, label=label, color=k, style="--", width=1.2))
        labelled = True
    panel = Panel(
        x_label="rate of the hub, rad/s",
        y_label="share of the rib up to its last contact with the hub",
        lines=lines,
        y_zero=True,
    )
    return Figure(
        name="touching", title="What touches the hub at the end, over the rate of the hub", panels=[panel], height=100.0
    )
