"""Clearances with what shows them: a table, sentences, a figure, files, and the colours of an animation."""

from __future__ import annotations

import dataclasses
import json
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent.results import netcdf
from evolvent.results.motion import Motion, quantity
from evolvent_base import answer as an
from evolvent_base.figures import Figure, Line, Panel
from evolvent_base.showing import Shown

if TYPE_CHECKING:
    import xarray as xr

#: Most pairs in a figure: those with the smallest clearances.
_MOST = 8
#: Most intervals in a row of the table.
_SPANS = 2


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Clearances(Shown):
    """Signed distances between the bodies of a run.

    Attributes
    ----------
    dataset : xarray.Dataset
        ``clearance`` (time, pair), m, negative where one body is in another: minus the shortest translation that parts
        them. Where ``exact`` is 0 it is a lower bound, the distance of the spheres about the bodies. ``smallest``
        (pair), m, and ``time_of_smallest`` (pair), s, the first of its samples. ``least_between`` (pair), m: a bound
        from below by the rates of the bodies, between samples too. ``start``, ``end`` (s), ``depth`` (m) and
        ``between`` (index of the pair) of every ``interference``. Attributes, lists in JSON: ``sentences``,
        ``warnings``, ``left_out`` and ``not_checked``.
    """

    dataset: xr.Dataset
    named, endings = "clearances", (".nc", ".json")

    def __repr__(self) -> str:
        """How many pairs, and the smallest clearance."""
        smallest = quantity(float(self.dataset.smallest.min()), "m")
        return f"<Clearances: {self.dataset.sizes['pair']} pairs, smallest {smallest}>"

    @property
    def interfering(self) -> list[str]:
        """Pairs of bodies that interfere, such as "panel 1 - panel 3"."""
        found = self.dataset
        return list(dict.fromkeys(str(found.pair.values[k]) for k in found.between.values))

    def answer(self) -> an.Answer:
        """Smallest clearances, figure, sentences, and files."""
        attrs = self.dataset.attrs
        return an.Answer(
            title=str(attrs["title"]) or "Clearances between bodies",
            sections=[an.Section(title="Clearances", blocks=[an.Table.of(self.rows()), self.figure()])],
            notes=self.notes(), warnings=json.loads(attrs["warnings"]),
            files={"clearances.nc": lambda: netcdf.image(self.dataset),
                   "clearances.json": lambda: an.as_json(self.to_dict())},
        )  # fmt: skip

    def rows(self) -> list[list[str]]:
        """A table: its head, then a row a pair, the smallest clearance first."""
        found = self.dataset
        table = [["pair", "smallest clearance", "at", "between samples above", "interference"]]
        for k in np.argsort(found.smallest.values, kind="stable"):
            times = np.flatnonzero(found.between.values == k)
            spans = ", ".join(f"{found.start.values[i]:.5g} to {found.end.values[i]:.5g} s" for i in times[:_SPANS])
            spans += f" and {times.size - _SPANS} more" if times.size > _SPANS else ""
            one = found.isel(pair=int(k))
            table.append([
                str(one.pair.values), quantity(float(one.smallest), "m"), f"{float(one.time_of_smallest):.5g} s",
                quantity(float(one.least_between), "m"), spans or "none",
            ])  # fmt: skip
        return table

    def notes(self) -> list[str]:
        """Sentences: interference, what was left out."""
        found = self.dataset
        listed = [f"{one}." for one in json.loads(found.attrs["sentences"])]
        heads = {"left_out": "Left out", "not_checked": "Rigid bodies with a shape and shells alone are checked, not"}
        for key, text in heads.items():
            if names := json.loads(found.attrs[key]):
                listed.append(f"{text}: {'; '.join(names)}.")
        return listed

    def figure(self) -> Figure:
        """Clearance over time, of the pairs with the smallest ones, where it is exact; the smallest is marked."""
        found, lines, marks, ends = self.dataset, list[Line](), list[Line](), False
        for n, k in enumerate(np.argsort(found.smallest.values, kind="stable")[:_MOST]):
            one = found.isel(pair=int(k))
            y = np.where(one.exact.values == 1, one.clearance.values, np.nan)
            least, at = float(one.smallest), float(one.time_of_smallest)
            label = f"{one.pair.values}: {quantity(least, 'm')} at {at:.4g} s"
            lines.append(Line(x=found.time.values, y=y, label=label, color=n))
            marks.append(Line(x=np.array([at]), y=np.array([least]), color=n, style="", marker="o"))
            ends |= bool(np.isnan(y).any())
        zero = Line(x=found.time.values[[0, -1]], y=np.zeros(2), color="gray", width=0.9)
        panel = Panel(x_label="time, s", y_label="clearance, m", lines=[*lines, *marks, zero])
        title = "Clearance between bodies" + (
            ", where it is exact: beyond, the bodies are farther apart" if ends else ""
        )
        return Figure(name="clearance", title=title, panels=[panel])

    def to_dict(self) -> dict[str, Any]:
        """Numbers and texts, as the JSON file has them; what is not known is None."""
        found, pairs = self.dataset, []
        for k in range(found.sizes["pair"]):
            one, times = found.isel(pair=k), np.flatnonzero(found.between.values == k)
            spans = [{key: float(found[key].values[i]) for key in ("start", "end", "depth")} for i in times]
            numbers = {key: one[key].values for key in ("smallest", "time_of_smallest", "least_between")}
            series = {"clearance": one.clearance.values, "exact": one.exact.values.astype(bool)}
            pairs.append({"bodies": [str(one.a.values), str(one.b.values)], **numbers, "interference": spans, **series})
        texts = {key: json.loads(found.attrs[key]) for key in ("sentences", "warnings", "left_out", "not_checked")}
        units = {"lengths": "m", "times": "s"}
        content = {"title": found.attrs["title"], "units": units, **texts, "time": found.time.values, "pairs": pairs}
        values: dict[str, Any] = an.plain(content)
        return values

    def marked(self, motion: Motion) -> Motion:
        """The motion with bodies marked at the samples at which they interfere with another one."""
        found, inside = self.dataset, dict[str, Any]()
        for i, k in enumerate(found.between.values):
            span = (found.time.values >= found.start.values[i]) & (found.time.values <= found.end.values[i])
            for name in (str(found.a.values[k]), str(found.b.values[k])):
                inside[name] = inside.get(name, False) | span
        frames = [dataclasses.replace(f, marked=inside[f.name]) if f.name in inside else f for f in motion.frames]
        return dataclasses.replace(motion, frames=frames)
