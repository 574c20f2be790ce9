"""What storage in the stowed position leaves: stresses and shapes, margins and deployment, before and after."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import lazy_loader as lazy
import numpy as np

from evolvent.analysis.margins.results import MarginResults, least_of, shown_margin
from evolvent.analysis.storage import Store
from evolvent.analysis.storage_shapes import Kept, kept_figure, shape_figure
from evolvent.model.registry import asked
from evolvent.results import display, made_with, netcdf
from evolvent.results.happened import LATCHED, events_of, latches_of
from evolvent.results.variables import group_of, parts as parts_of
from evolvent.solvers.static.storage import Stored
from evolvent_base import answer as an
from evolvent_base.figures import Figure, Line, Panel, over_log_time, spline, stacked
from evolvent_base.scales import shown_time
from evolvent_base.showing import Shown
from evolvent_base.units import unit_text

if TYPE_CHECKING:
    import xarray as xr
else:
    xr = lazy.load("xarray")

#: Units of what relaxes, forces and moments; of surfaces both are per length.
_FORCES, _PER_LENGTH = ("N", "N m"), ("N m-1", "N")
#: Part of the largest force of a part below which one of its forces is not shown.
_SMALL = 1e-6
#: Distance beside the range of all below which curves are drawn as one; points of a curve; parts that are named.
_APART, _POINTS, _NAMES = 0.01, 300, 4


@dataclasses.dataclass(frozen=True)
class Relaxed:
    """A force or moment of a part: its name, unit, and largest size before and after storage."""

    part: str
    name: str
    unit: str
    before: float
    after: float


class StorageResults(Shown):
    """A system before and after its storage.

    Attributes
    ----------
    section : Store, what was asked
    run : xarray.DataTree, the equilibria over storage: a group a part, times since its start
    forces : list of Relaxed
    sets : list of (part, words, value, unit), deformation that is kept just after a sudden release of all stress
    along : list of Kept, the same along the parts that have a length
    margins : MarginResults before and after; none where they are not asked for
    runs : xarray.DataTree, of the deployments before and after; none without them
    title, case : str
    """

    named, endings = "results of storage", (".nc", ".json", ".csv")

    def __init__(
        self, section: Store, stored: Stored, run: xr.DataTree, *,
        margins: Sequence[MarginResults] = (), runs: Sequence[xr.DataTree] = (), title: str = "", case: str = "",
    ) -> None:  # fmt: skip
        self.section, self.run, self.margins, self.runs = section, run, margins, runs
        self.title, self.case, self.steps = title, case, stored.times.size - 1
        relaxing = list(dict.fromkeys(name for name, _ in stored.assembly.relaxations.values()))
        self.forces = [one for name in relaxing for one in _forces(run, name)]
        self.sets = [one for name in relaxing for one in _sets(stored, name)]
        self.along = [one for name in relaxing for one in _along(stored, name)]

    def answer(self) -> an.Answer:
        """Facts, tables before and after, figures and files."""
        table = an.Table.of(self.rows(), words=2)
        sections = [an.Section(title="Forces that relax", blocks=[table])] if self.forces else []
        kept = [["part", "deformation", "value"], *([part, words, f"{value:.4g} {unit_text(unit)}".rstrip(" 1")]
                for part, words, value, unit in self.sets)]  # fmt: skip
        if self.sets:
            title = "Deformation just after a sudden release of all stress"
            sections.append(an.Section(title=title, blocks=[an.Table.of(kept, words=2)]))
        if self.margins:
            sections.append(an.Section(title="Margins", blocks=[an.Table.of(self.margin_rows(), words=2)]))
        if self.runs:
            tables = [an.Table.of(rows) for rows in (self.latch_rows(), self.event_rows()) if len(rows) > 1]
            sections.append(an.Section(title="Deployment", blocks=tables))
        drawn = self.margin_figure(), self.figure(), self.shape_figure(), kept_figure(self.along)
        figures = [figure for figure in drawn if figure is not None]
        sections += [an.Section(title=figure.title, blocks=[figure], level=an.PAGE) for figure in figures]
        if self.case:
            sections.append(an.Section(title="Case", blocks=[an.Listing(self.case)], level=an.PAGE))
        warnings = []
        if self.margins and (negative := self.margins[1].negative):
            warnings.append(f"after storage the margin of {', '.join(map(repr, negative))} is below 0")
        return an.Answer(
            title=f"Storage of {self.title or 'a system'}",
            facts=[("stored", self.stored_for), ("steps", str(self.steps))],
            warnings=warnings, sections=sections, notes=list(self.notes()), made=made_with(),
            files={"storage.nc": lambda: netcdf.image(self.run), "storage.json": lambda: an.as_json(self.to_dict()),
                   "storage.csv": lambda: an.as_csv(self.rows())},
        )  # fmt: skip

    @property
    def stored_for(self) -> str:
        """How long, and at which temperature, in words."""
        return self.section.shown

    def rows(self) -> list[list[str]]:
        """Largest forces of each part before and after: a head, then a row a force."""
        found = [["part", "largest", "before", "after", "left"]]
        for one in self.forces:
            unit = unit_text(one.unit)
            left = f"{100.0 * one.after / one.before:.4g} %" if one.before else "-"
            words = one.name.replace("_", " ")
            found.append([one.part, words, f"{one.before:.4g} {unit}", f"{one.after:.4g} {unit}", left])
        return found

    def margin_rows(self) -> list[list[str]]:
        """Least margins before and after: a head, then a row a coordinate."""
        found = [["coordinate", "requirement", "before", "after", "verdict"]]
        before, after = self.margins
        for name in after.names:
            n = after.names.index(name)
            pair = [one.still[n] or one.moving[n] for one in (before, after)]
            if pair[1] is None:
                found.append([name, "-", "-", "-", "-"])
                continue
            shown = ["-" if table is None else shown_margin(least_of(table)[2]) for table in pair]
            verdict = "NEGATIVE" if name in after.negative else "holds"
            found.append([name, least_of(pair[1])[0], *shown, verdict])
        return found

    def latch_rows(self) -> list[list[str]]:
        """Latches of the deployments before and after: a head, then a row a latch."""
        found = [["latch", "time before", "after", "rate before", "after", "peak before", "after", "energy before",
                  "after"]]  # fmt: skip
        before, after = (latches_of(run) for run in self.runs)
        for name in _latching(self.runs[0]):
            cells = [_latch(one, name) for one in (before, after)]
            found.append([name, *(cell for pair in zip(*cells, strict=True) for cell in pair)])
        return found

    def event_rows(self) -> list[list[str]]:
        """First times of the events of the deployments before and after: a head, then a row an event of a part."""
        found, both = [["event", "time before", "after"]], [_first_times(run) for run in self.runs]
        for name in dict.fromkeys([*both[0], *both[1]]):
            found.append([name, *(f"{one[name]:.4g} s" if name in one else "-" for one in both)])
        return found

    def notes(self) -> Iterator[str]:
        """Sentences on what was assumed."""
        yield (
            "linear viscoelasticity: creep that depends on the stress, ageing, damage and moisture are not modelled; "
            "the release and what follows are at the temperature of each material while it moves"
        )
        if self.runs:
            missing = [
                name for name in _latching(self.runs[0])
                if name in latches_of(self.runs[0])["latch"] and name not in latches_of(self.runs[1])["latch"]
            ]  # fmt: skip
            for name in missing:
                yield f"{name!r} latches in the run before storage, and does not after it"
        if not self.forces:
            yield "no viscoelastic part carries a force in the stowed position: nothing relaxes"

    # -------------------------------------------------------------------------------------------------- figures

    def margin_figure(self) -> Figure | None:
        """Actuation before and after storage, and requirement, over each coordinate; the margin after it shaded."""
        if not self.margins:
            return None
        panels = []
        for old, new in zip(self.margins[0].still, self.margins[1].still, strict=True):
            if old is None or new is None:
                continue
            one = new.coordinate
            scale, unit = (np.degrees(1.0), "deg") if one.angle else (1.0, "m")
            name = least_of(new)[0]
            x, up, down = scale * new.x, new.available, new.required(name)
            top, back = np.maximum(up, down), np.concatenate([x, x[::-1]])
            drawn = [
                Line(x=back, y=np.concatenate([top, low[::-1]]), style="", fill=color)
                for low, color in ((down, "#cfe8cf"), (up, "#f3c9c9"))
            ]
            drawn.append(Line(x=scale * old.x, y=old.available, label="actuation before storage", style="--"))
            drawn.append(Line(x=x, y=up, label="actuation after storage"))
            drawn.append(Line(x=x, y=down, label="required", color=1))
            margins = [shown_margin(least_of(table)[2]) for table in (old, new)]
            what = "torque" if one.angle else "force"
            panels.append(
                Panel(
                    x_label=f"{one.name}, {unit}", y_label=f"{what}, {one.units[1]}", lines=drawn,
                    title=f"{one.name}: margin {margins[0]} before, {margins[1]} after {shown_time(self.section.time)}",
                )
            )  # fmt: skip
        if not panels:
            return None
        title = "Margins before and after storage"
        return Figure(name="storage_margins", title=title, panels=panels, height=stacked(len(panels)))

    def figure(self) -> Figure | None:
        """Forces over storage, beside those of its start, over the logarithm of time."""
        times = np.asarray(self.run["time"])[1:]
        if not self.forces or times.size < 2:
            return None
        curves = [_largest(group_of(self.run, one.part)[one.name])[1:] / one.before for one in self.forces]
        fine = np.geomspace(times[0], times[-1], _POINTS) if 4 <= times.size < _POINTS else times
        lines = list[Line]()
        for k, own in enumerate(_alike(curves)):
            y = curves[own[0]] if fine is times else spline(np.log(times), curves[own[0]], np.log(fine))
            lines.append(Line(x=fine, y=y, label=self._words([self.forces[i] for i in own]), color=k))
        axis = over_log_time("time in storage", float(times[0]), float(times[-1]))
        panel = Panel(y_label="part of the force that is left, 1", lines=lines, **axis)
        return Figure(name="storage", title="Relaxation in storage", panels=[panel])

    def shape_figure(self) -> Figure | None:
        """Shapes of beams, rods and threads before and after storage, and at the end of the deployments."""
        return shape_figure(self.run, self.runs)

    def _words(self, forces: Sequence[Relaxed]) -> str:
        """Names of forces of which all are left with the same part: parts with the same forces together."""
        parts: dict[str, list[str]] = {}
        for one in forces:
            parts.setdefault(one.part, []).append(one.name.replace("_", " "))
        together: dict[str, list[str]] = {}
        for part, names in parts.items():
            everything = len(names) > 1 and len(names) == sum(one.part == part for one in self.forces)
            together.setdefault("all forces and moments" if everything else ", ".join(names), []).append(part)
        return "; ".join(
            ", ".join(own[:_NAMES]) + (f" and {len(own) - _NAMES} more" if len(own) > _NAMES else "") + f": {names}"
            for names, own in together.items()
        )

    def to_dict(self) -> dict[str, Any]:
        """All numbers, as the JSON file has them."""
        found: dict[str, Any] = {
            "time": self.section.time, "temperature": self.section.temperature,
            "forces": [dataclasses.asdict(one) for one in self.forces],
            "sets": [dict(zip(("part", "deformation", "value", "unit"), one, strict=True)) for one in self.sets],
            "along": [one._asdict() | {"arc": one.arc.tolist(), "values": one.values.tolist()} for one in self.along],
        }  # fmt: skip
        if self.margins:
            found |= dict(
                zip(("margins_before", "margins_after"), (one.to_dict() for one in self.margins), strict=True)
            )
        return found


def _largest(values: xr.DataArray) -> np.ndarray:
    """Largest size over a part at each time, of vectors their length: (n,)."""
    found = np.linalg.norm(values.values, axis=-1) if values.dims[-1] == "axis" else np.abs(values.values)
    return np.asarray(found.reshape(found.shape[0], -1).max(axis=1))


def _alike(curves: Sequence[np.ndarray]) -> list[list[int]]:
    """Places of curves in groups, within which they lie on each other beside the range of all."""
    span = max(float(one.max()) for one in curves) - min(float(one.min()) for one in curves)
    groups = list[list[int]]()
    for k, one in enumerate(curves):
        for own in groups:
            if np.all(np.abs(one - curves[own[0]]) <= _APART * span):
                own.append(k)
                break
        else:
            groups.append([k])
    return groups


def _extent(group: xr.Dataset) -> float:
    """Length (m) that a part spans at the start, along its longest axis; 0 of one without positions of its own."""
    spans = [
        float(np.ptp(values.values[0].reshape(-1, 3), axis=0).max()) for values in group.data_vars.values()
        if values.dims[:1] == ("time",) and values.dims[-1] == "axis" and values.attrs.get("units") == "m"
    ]  # fmt: skip
    return max(spans, default=0.0)


def _forces(run: xr.DataTree, part: str) -> list[Relaxed]:
    """Forces and moments of a part that are not zero at the start, nor small beside its largest ones.

    Forces are compared with moments by the length that the part spans. A vector whose length is another row is not one.
    """
    if part not in parts_of(run):
        return []
    group = group_of(run, part)
    is_surface = any(values.attrs.get("units") == _PER_LENGTH[0] for values in group.data_vars.values())
    units = _PER_LENGTH if is_surface else _FORCES
    sizes = {
        str(name): (str(values.attrs["units"]), values.dims[-1] == "axis", _largest(values))
        for name, values in group.data_vars.items()
        if values.attrs.get("units") in units and values.dims[:1] == ("time",)
    }
    found = [
        Relaxed(part, name, unit, float(own[0]), float(own[-1])) for name, (unit, vector, own) in sizes.items()
        if not (vector and any(np.allclose(own, other, rtol=1e-9, atol=0.0)
                               for one, of_vector, other in sizes.values() if one == unit and not of_vector))
    ]  # fmt: skip
    length = _extent(group)
    most = {unit: max((max(one.before, one.after) for one in found if one.unit == unit), default=0.0) for unit in units}
    force, moment = (most[unit] for unit in units)
    if length > 0.0:
        most = dict(zip(units, (max(force, moment / length), max(moment, force * length)), strict=True))
    return [one for one in found if one.before > _SMALL * most[one.unit] > 0.0]


def _sets(stored: Stored, part: str) -> Iterator[tuple[str, str, float, str]]:
    """Deformations of a part that are kept."""
    family, index = stored.assembly.names[part]
    kept = asked("statics.sets").get(family)
    found = [] if kept is None else list(kept(stored.assembly.model, index))
    largest = {unit: max(abs(value) for _, value, one in found if one == unit) for _, _, unit in found}
    for words, value, unit in found:
        if abs(value) > 1e-9 and abs(value) > 1e-3 * largest[unit]:
            factor, shown = display.shown_unit(unit)
            yield part, words, factor * value, shown


def _along(stored: Stored, part: str) -> Iterator[Kept]:
    """Deformations that are kept along a part, without those that are small beside the largest one of their unit."""
    family, index = stored.assembly.names[part]
    asked_of = asked("statics.sets_along").get(family)
    found = [] if asked_of is None else [Kept(part, *one) for one in asked_of(stored.assembly.model, index)]
    sizes = [float(np.abs(one.values).max(initial=0.0)) for one in found]
    for one, size in zip(found, sizes, strict=True):
        if size > 1e-9 and size > 1e-3 * max(other for k, other in enumerate(sizes) if found[k].unit == one.unit):
            yield one


def _latching(run: xr.DataTree) -> Sequence[str]:
    """Parts with a latch."""
    return [name for name in parts_of(run) if "latch_rate" in group_of(run, name)]


def _first_times(run: xr.DataTree) -> dict[str, float]:
    """First time of what has happened to each part but for its latches, s."""
    found = dict[str, float]()
    events = events_of(run)
    for time, part, what in zip(*(events[name].values for name in ("time", "part", "what")), strict=True):
        if what != LATCHED:
            found.setdefault(f"{part}: {what}" if what != "event" else str(part), float(time))
    return found


def _latch(latches: xr.Dataset, name: str) -> list[str]:
    """Time, rate, peak and energy of a latch, as texts; "-" where it has not locked."""
    if name not in latches["latch"].values:
        return ["-"] * 4
    one: Mapping[Any, Any] = latches.sel(latch=name)
    factor, unit = (180.0 / math.pi, "deg/s") if str(one["rate_unit"].values) == "rad/s" else (1.0, "m/s")
    return [
        f"{float(one['time']):.4g} s", f"{factor * float(one['rate']):.4g} {unit}",
        f"{float(one['peak']):.4g} {one['peak_unit'].values}", f"{float(one['work']):.4g} J",
    ]  # fmt: skip
