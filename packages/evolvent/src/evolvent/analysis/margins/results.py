"""Margins with what shows them: tables, a figure, a tree of named variables, files."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import lazy_loader as lazy
import numpy as np

from evolvent.analysis.margins.factors import CATEGORIES, Standard
from evolvent.analysis.margins.keys import Margin
from evolvent.analysis.margins.tables import MarginTable
from evolvent.model.shares import DAMPING
from evolvent.results import display, made_with, netcdf
from evolvent_base import __version__, answer as an
from evolvent_base.errors import InputError, nearest
from evolvent_base.figures import Figure, Line, Panel, stacked
from evolvent_base.showing import Shown
from evolvent_base.units import unit_text

if TYPE_CHECKING:
    import xarray as xr
else:
    xr = lazy.load("xarray")

#: Colours of the area between what is available and what is required, where that is above 0 and where it is below.
_ENOUGH, _LACKING = "#cfe8cf", "#f3c9c9"
#: Share of the larger load at a root below which the other one is round-off.
_ROUND_OFF = 1e-9
#: Where the other coordinates stand, by the key `others`.
_STAND = {"start": "at their start", "end": "at their end", "together": "at the same share of their travel"}


class MarginResults(Shown):
    """Margins of all coordinates.

    Attributes
    ----------
    label : str, name of the table of factors; standard : Standard
    keys : Margin, what was asked
    names : list of str, of the coordinates
    still : list of Table or None, along the travel at rest, one a coordinate; reels have none
    moving : list of Table or None, along the run
    latches : list of dict, of `latches.latch_of`; empty without a run
    remarks : list of str, sentences on parts that have no share, and on what the run is beyond
    warnings : list of str, sentences on what makes the margins wrong
    title, case : str
    without_run : str, why there are no margins along a run; '' where that needs no reason
    """

    named, endings = "margins", (".nc", ".json", ".csv")

    def __init__(
        self, label: str, standard: Standard, keys: Margin, names: Sequence[str], still: Sequence[MarginTable | None],
        moving: Sequence[MarginTable | None], latches: Sequence[dict[str, Any]], remarks: Sequence[str] = (), *,
        warnings: Sequence[str] = (), title: str = "", case: str = "",
    ) -> None:  # fmt: skip
        self.warnings = list(warnings)
        self.label, self.standard, self.keys = label, standard, keys
        self.names, self.still, self.moving, self.latches = list(names), list(still), list(moving), list(latches)
        self.remarks, self.title, self.case, self.without_run = list(remarks), title, case, ""

    def __repr__(self) -> str:
        """Name of the standard and the least margin."""
        return f"<MarginResults: {len(self.names)} coordinates by {self.label}, least margin {self.least:.4g}>"

    def answer(self) -> an.Answer:
        """Verdict, tables, figure, what was assumed, and files."""
        sections = [
            an.Section(title=f"Margins by {self.label}", blocks=[an.Table.of(self.rows(), words=2)]),
            an.Section(title="What brings each margin to 0", blocks=[an.Table.of(self.balance_rows())]),
            *(an.Section(title=f"{name}: what counts where its margin is least", level=an.DETAIL,
                         blocks=[an.Table.of(self.contributions(name), words=3)])
              for name in (one.coordinate.name for one in self.tables)),
        ]  # fmt: skip
        if self.latches:
            title = "Latches and stops in the run"
            sections.append(an.Section(title=title, blocks=[an.Table.of(self.latch_rows())]))
        if self.tables:
            sections.append(an.Section(title="Over the travel", blocks=[self.figure()], level=an.PAGE))
        if self.case:
            sections.append(an.Section(title="Case", blocks=[an.Listing(self.case)], level=an.PAGE))
        why = self.without_run and f"no margins along the run: {self.without_run}"
        low = f"the margin of {', '.join(map(repr, self.negative))} is below 0"
        warnings = [*([low] if self.negative else []), *self.warnings]
        return an.Answer(
            title=f"Margins of {self.title or 'a mechanism'}",
            facts=[("least margin", shown_margin(self.least)), ("factors", f"{self.label}, {self.standard.revision}")],
            warnings=warnings, heads=[] if warnings else ["every margin holds"],
            sections=sections, notes=[*self.notes(), *filter(None, [self.standard.source, why])], made=made_with(),
            files={"margins.nc": lambda: netcdf.image(self.to_tree()),
                   "margins.json": lambda: an.as_json(self.to_dict()),
                   "margins.csv": lambda: an.as_csv(self.stations())},
        )  # fmt: skip

    def __getitem__(self, name: str) -> MarginTable:
        """The table at rest of a coordinate; of a reel that along the run."""
        table = self.still[self._index(name)] or self.moving[self._index(name)]
        if table is None:
            raise InputError(f"{name!r} is a reel, whose margin is that along a run in which it turns")
        return table

    def at_rest(self, name: str) -> MarginTable:
        """The table at rest of a coordinate.

        Raises
        ------
        InputError
            For a reel.
        """
        table = self.still[self._index(name)]
        if table is None:
            raise InputError(f"{name!r} is a reel, whose margin is that along a run: {name}.margin_in_run")
        return table

    def motion(self, name: str) -> MarginTable | None:
        """The table along the motion of a coordinate, None without a run."""
        return self.moving[self._index(name)]

    def _index(self, name: str) -> int:
        if name not in self.names:
            raise InputError(f"no margin is that of {name!r}; {nearest(name, self.names)}")
        return self.names.index(name)

    @property
    def tables(self) -> list[MarginTable]:
        """The table at rest of every coordinate, of reels that along the run; without reels that have none."""
        both = (still or moving for still, moving in zip(self.still, self.moving, strict=True))
        return [one for one in both if one is not None]

    @property
    def least(self) -> float:
        """Least margin of all coordinates, requirements and tables."""
        return min((least_of(table)[2] for table in (*self.still, *self.moving) if table is not None), default=math.nan)

    @property
    def negative(self) -> list[str]:
        """Names of the coordinates whose margin is below 0 in one of the tables."""
        both = zip(self.names, self.still, self.moving, strict=True)
        return [
            name
            for name, still, moving in both
            if any(least_of(table)[2] < 0.0 for table in (still, moving) if table is not None)
        ]

    # -------------------------------------------------------------------------------------------------- tables

    def rows(self) -> list[list[str]]:
        """A table for the screen: its head, then a row a coordinate; of the run where there is one."""
        found = [["coordinate", "requirement", "margin", "governed at", "margin in the run", "verdict"]]
        runs = any(moving is not None for moving in self.moving) or None in self.still
        for coordinate, still, moving in zip(self.names, self.still, self.moving, strict=True):
            table = still or moving
            if table is None:
                found.append([coordinate, "-", "-", "-", "-", "needs a run in which it turns"])
                continue
            name, n, _ = least_of(table)
            at_rest, run = ("-" if one is None else shown_margin(least_of(one)[2]) for one in (still, moving))
            verdict = "NEGATIVE" if coordinate in self.negative else "holds"
            found.append([coordinate, name, at_rest, _place(table, n), run, verdict])
        return found if runs else [[*row[:4], row[5]] for row in found]

    def balance_rows(self) -> list[list[str]]:
        """What counts and what is asked for where a margin is least, and changes over the travel that bring it to 0.

        A row for each margin, at rest and in the run. A change names the station that decides it where that is another
        one: it is the largest difference, while the least margin is the smallest ratio.
        """
        found = [["coordinate", "margin", "governed at", "counts", "required", "spring", "friction"]]
        for still, moving in zip(self.still, self.moving, strict=True):
            for when, table in ((_at_rest(still), still), ("in the run", moving)):
                if table is None:
                    continue
                name, n, margin = least_of(table)
                unit = table.coordinate.units[1]
                found.append([
                    table.coordinate.name, f"{shown_margin(margin)} {when}", _place(table, n),
                    f"{table.available[n]:.4g} {unit}", f"{table.required(name)[n]:.4g} {unit}",
                    _change(table, table.spring_change(), "add", "spare"),
                    _change(table, table.friction_change(), "lose", "spare"),
                ])  # fmt: skip
        return found

    def contributions(self, name: str) -> list[list[str]]:
        """What drives and resists a coordinate at its governing station: its head, then a row a share."""
        table = self[name]
        requirement, n, _ = least_of(table)
        unit = table.coordinate.units[1]
        found = [["share", "category", "evidence", f"value, {unit}", "factor", f"counts, {unit}"]]
        for share, value in zip(table.shares, table.values[:, n], strict=True):
            if not np.any(table.values[table.shares.index(share)] != 0.0):
                continue
            drives = value >= 0.0
            factor = self.standard.counts(share.category) if drives else -self.standard.requirements[
                requirement
            ].factor(share.category, share.evidence)  # fmt: skip
            found.append([
                share.label, share.category, share.evidence, f"{value:.4g}", f"{abs(factor):.4g}",
                f"{abs(factor) * value:.4g}",
            ])  # fmt: skip
        if table.coordinate.acceleration > 0.0:
            factor = self.standard.requirements[requirement].factor("acceleration", table.evidence)
            value = -table.inertia[n] * table.coordinate.acceleration
            found.append(["specified acceleration", "acceleration", table.evidence, f"{value:.4g}", f"{factor:.4g}",
                          f"{factor * value:.4g}"])  # fmt: skip
        return found

    def notes(self) -> list[str]:
        """Sentences on what was assumed, and on dead points that only speed passes."""
        found = [
            f"stations: the other coordinates stand {_STAND[self.keys.others]}; kinetic energy does not count",
            *self.remarks,
        ]
        dampers = any(share.category == DAMPING for table in self.tables for share in table.shares)
        if dampers and DAMPING not in self._counted():
            found.append(
                "dampers are in no requirement of this table: what they take vanishes as the motion slows down"
            )
        for still, moving in zip(self.still, self.moving, strict=True):
            if still is None:
                if moving is not None:
                    found.append(f"{moving.coordinate.name!r} is a reel: its margin is that along the run")
                continue
            one = still.coordinate
            if one.follow:
                found.append(f"{one.name!r} moves {', '.join(map(repr, one.follow))} along, by constraints or cables")
            if one.zero:
                zero = [category for category in CATEGORIES if category in one.zero]
                found.append(f"{one.name!r}: declared to be zero: {', '.join(zero)}")
            found += [
                f"{name!r} touches from {_at(still, x)} of {one.name!r} on: at a station its normal force is that of "
                f"the depth there, and friction acts in full"
                for name, x in still.touches.items()
            ]
            for n in still.snaps:
                found.append(
                    f"elastic parts snap between {_place(still, n - 1)} and {_place(still, n)} of {one.name!r}: their "
                    f"energy falls by more than the stations show; see by more stations, or by a run"
                )
            stuck = np.flatnonzero(still.values.sum(axis=0) < 0.0)
            if stuck.size and moving is not None and self._arrives(one.name):
                found.append(
                    f"{one.name!r} passes {_place(still, int(stuck[0]))} in the run by its speed alone: at rest the "
                    f"resistances are larger than what drives there"
                )
        return [*found, *self._ends_of_slack()]

    def _ends_of_slack(self) -> list[str]:
        """Sentences on where cords that only pull begin to pull, by the place."""
        places: dict[str, list[str]] = {}
        for table in self.tables:
            for n in table.slack:
                places.setdefault(_place(table, n), []).append(repr(table.coordinate.name))
        return [
            f"cords that only pull are all slack at {place} of {', '.join(names)}, where some begin to pull: they have "
            f"no share where they are slack, and stations are added where they pull"
            for place, names in places.items()
        ]

    def _counted(self) -> set[str]:
        """Categories that the requirements have."""
        return {category for one in self.standard.requirements.values() for category in (*one.resisting, *one.added)}

    def _arrives(self, name: str) -> bool:
        """Whether a coordinate reaches its end in the run."""
        index = self.names.index(name)
        return bool(self.latches) and math.isfinite(self.latches[index]["time"])

    def latch_rows(self) -> list[list[str]]:
        """A table of the latches and stops: its head, then a row a coordinate; the head alone without a run."""
        found = [["coordinate", "time", "rate", "energy", "peak load", "at the root"]]
        for table, latch in zip(self.still, self.latches, strict=False):
            if table is None:
                continue
            x, unit = table.coordinate.units
            factor, rate = display.shown_unit(f"{x} s-1")
            loads = {"N": latch["root_force"], "N m": latch["root_moment"]}
            least = _ROUND_OFF * max((value for value in loads.values() if math.isfinite(value)), default=0.0)
            root = ", ".join(_shown(value, name) for name, value in loads.items() if value > least)
            found.append([
                table.coordinate.name, _shown(latch["time"], "s"),
                _shown(factor * latch["rate"], unit_text(rate)), _shown(latch["energy"], "J"),
                _shown(latch["peak_load"], unit), f"{latch['joint']}: {root}" if latch["joint"] and root else "-",
            ])  # fmt: skip
        return found

    # --------------------------------------------------------------------------------------------------- figure

    def figure(self) -> Figure:
        """Actuation and requirement over the coordinate, the margin between them shaded; a panel a coordinate."""
        panels = []
        for at_rest, moving in zip(self.still, self.moving, strict=True):
            still = at_rest or moving
            if still is None:
                continue
            one = still.coordinate
            scale, unit = (np.degrees(1.0), "deg") if one.angle else (1.0, "m")
            name, _, margin = least_of(still)
            x, up, down = scale * still.x, still.available, still.required(name)
            top, back = np.maximum(up, down), np.concatenate([x, x[::-1]])
            drawn = [
                Line(x=back, y=np.concatenate([top, low[::-1]]), style="", fill=color)
                for low, color in ((down, _ENOUGH), (up, _LACKING))
            ]
            drawn.append(Line(x=x, y=up, label="actuation that counts"))
            drawn.append(Line(x=x, y=down, label="required", color=1))
            drawn.append(Line(x=x, y=still.values.sum(axis=0), label="sum, without factors", color="gray", width=0.9))
            if moving is not None and at_rest is not None:
                drawn.append(Line(x=scale * moving.x, y=moving.available, label="in the run", style="--", width=1.0))
                drawn.append(Line(x=scale * moving.x, y=moving.required(name), style="--", color=1, width=1.0))
            what = "torque" if one.angle else "force"
            label = f"{one.name}: margin {shown_margin(margin)} ({name})"
            panels.append(
                Panel(x_label=f"{one.name}, {unit}", y_label=f"{what}, {one.units[1]}", lines=drawn, title=label)
            )
        title = f"Margins by {self.label}"
        return Figure(name="margins", title=title, panels=panels, height=stacked(len(panels)))

    # ---------------------------------------------------------------------------------------------------- files

    def to_tree(self) -> xr.DataTree:
        """All tables as an `xarray.DataTree`: a group a coordinate, and one within it for the motion.

        A group inherits dimensions, so those of the motion have names of their own.
        """
        root = xr.Dataset(attrs={
            "title": self.title or "margins by evolvent", "source": f"evolvent {__version__}",
            "factors": self.label, "revision": self.standard.revision,
            "others": self.keys.others, "case": self.case, "least_margin": self.least,
        })  # fmt: skip
        tree = {"/": root}
        for n, (still, moving) in enumerate(zip(self.still, self.moving, strict=True)):
            name = self.names[n].replace("/", "-")
            found = xr.Dataset() if still is None else dataset_of(still)
            if n < len(self.latches):
                for key, value in self.latches[n].items():
                    found.attrs[f"latch_{key}"] = value
            tree[f"/{name}"] = found
            if moving is not None:
                own = {"station": "motion_station", "part": "motion_part"}
                tree[f"/{name}/motion"] = dataset_of(moving).rename(own)
        return xr.DataTree.from_dict(tree)

    def to_dict(self) -> dict[str, Any]:
        """All tables as numbers and texts, as the JSON file has them; what is infinite or not known is None."""
        found: dict[str, Any] = {
            "factors": self.label, "revision": self.standard.revision, "others": self.keys.others,
            "least_margin": self.least, "negative": self.negative, "warnings": self.warnings, "notes": self.notes(),
            "coordinates": {},
        }  # fmt: skip
        for n, (still, moving) in enumerate(zip(self.still, self.moving, strict=True)):
            one = {} if still is None else _as_dict(still)
            one["motion"] = None if moving is None else _as_dict(moving)
            known = n < len(self.latches)
            one["latch"] = self.latches[n] if known else None
            found["coordinates"][self.names[n]] = one
        values: dict[str, Any] = an.plain(found)
        return values

    def stations(self) -> list[list[str]]:
        """One row a station of every coordinate, in both tables, below a row of heads."""
        names = list(self.standard.requirements)
        head = ["coordinate", "table", "time [s]", "position [rad or m]", *(f"{c} [N m or N]" for c in CATEGORIES)]
        head += ["available", *(f"required ({name})" for name in names), *(f"margin ({name})" for name in names)]
        found = [head]
        for still, moving in zip(self.still, self.moving, strict=True):
            for kind, table in ((_at_rest(still), still), ("in the run", moving)):
                if table is None:
                    continue
                of = table.by_category()
                columns = [np.zeros(table.x.size) + of.get(c, 0.0) for c in CATEGORIES] + [table.available]
                columns += [table.required(name) for name in names] + [table.margin(name) for name in names]
                for n, x in enumerate(table.x):
                    time = f"{table.time[n]:.9g}" if table.time.size else ""
                    values = [f"{float(column[n]):.9g}" for column in columns]
                    found.append([table.coordinate.name, kind, time, f"{x:.9g}", *values])
        return found


def least_of(table: MarginTable) -> tuple[str, int, float]:
    """Requirement, station and value of the least margin of a table."""
    name, n = table.governing()
    return name, n, float(table.margin(name)[n])


def _at_rest(table: MarginTable | None) -> str:
    """What the table at rest of a coordinate is called, with the pace of viscoelastic parts."""
    return f"at rest, {table.pace}" if table is not None and table.pace else "at rest"


def dataset_of(table: MarginTable) -> xr.Dataset:
    """One table as a data set: dimension `station`, shares by name."""
    one = table.coordinate
    x, unit = one.units
    shares = [share.label for share in table.shares]
    what = "angle" if one.angle else "travel"
    inertia = {"units": "kg m2" if one.angle else "kg", "long_name": "reflected inertia"}
    data: dict[str, Any] = {
        "position": ("station", table.x, {"units": x, "long_name": what}),
        "share": (("part", "station"), table.values, {"units": unit, "long_name": "what drives (+) or resists (-)"}),
        "category": ("part", [share.category for share in table.shares]),
        "evidence": ("part", [share.evidence for share in table.shares]),
        "source": ("part", [share.source for share in table.shares]),
        "inertia": ("station", table.inertia, inertia),
        "available": ("station", table.available, {"units": unit, "long_name": "actuation that counts"}),
    }  # fmt: skip
    if table.time.size:
        data["time"] = ("station", table.time, {"units": "s", "long_name": "time"})
    for name in table.standard.requirements:
        data[f"required_{name}"] = ("station", table.required(name), {"units": unit, "long_name": f"T_min, {name}"})
        data[f"margin_{name}"] = ("station", table.margin(name), {"units": "1", "long_name": f"margin, {name}"})
    found = xr.Dataset(data, {"part": shares, "station": np.arange(table.x.size)})
    name, n, margin = least_of(table)
    found.attrs = {
        "acceleration": one.acceleration, "held": json.dumps(one.held), "follow": json.dumps(one.follow),
        "zero": json.dumps(sorted(one.zero)), "requirement": name, "governing": n, "least_margin": margin,
        "spring_to_add": table.spring_to_add(), "friction_to_lose": table.friction_to_lose(),
    } | ({"pace": table.pace} if table.pace else {})  # fmt: skip
    return found


def _as_dict(table: MarginTable) -> dict[str, Any]:
    """One table as numbers and texts."""
    one = table.coordinate
    name, n, margin = least_of(table)
    numbers = {"position": table.x, "inertia": table.inertia, "available": table.available}
    numbers |= {"time": table.time} if table.time.size else {}
    for requirement in table.standard.requirements:
        numbers[f"required_{requirement}"] = table.required(requirement)
        numbers[f"margin_{requirement}"] = table.margin(requirement)
    return {
        "units": list(one.units), "held": list(one.held), "follow": list(one.follow), "zero": sorted(one.zero),
        "acceleration": one.acceleration, "pace": table.pace or None, "requirement": name, "governing_station": n,
        "least_margin": margin,
        "spring_to_add": table.spring_to_add(), "friction_to_lose": table.friction_to_lose(), **numbers,
        "shares": [
            {"name": share.label, "category": share.category, "evidence": share.evidence, "source": share.source,
             "values": values}
            for share, values in zip(table.shares, table.values, strict=True)
        ],
    }  # fmt: skip


def _place(table: MarginTable, n: int) -> str:
    """Position of a station, for tables."""
    return _at(table, float(table.x[n]))


def _at(table: MarginTable, x: float) -> str:
    """A value of a table's coordinate."""
    return f"{math.degrees(x):.4g} deg" if table.coordinate.angle else f"{x:.4g} m"


def shown_margin(margin: float) -> str:
    """A margin with its sign."""
    return "unlimited" if margin == math.inf else f"{margin:+.4f}"


def _change(table: MarginTable, change: tuple[float, int], lacks: str, spares: str) -> str:
    """What is lacking or to spare, and where where that is not the least margin; '-' where it does not help."""
    value, n = change
    if not math.isfinite(value):
        return "-"
    where = "" if n == least_of(table)[1] else f" ({_place(table, n)})"
    return f"{lacks if value > 0.0 else spares} {abs(value):.4g} {table.coordinate.units[1]}{where}"


def _shown(value: float, unit: str) -> str:
    """A value with its unit, '-' where there is none."""
    return f"{value:.4g} {unit}" if math.isfinite(value) else "-"
