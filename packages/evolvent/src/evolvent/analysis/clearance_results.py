"""Clearances as a table, sentences, a figure and files, and in the colours of an animation."""

from __future__ import annotations

import dataclasses
import json
from typing import Any

import numpy as np
import xarray as xr

from evolvent.results import netcdf
from evolvent.results.motion import Motion, quantity
from evolvent_base import answer as an
from evolvent_base.figures import Figure, Line, Panel

#: Endings of the files that clearances are written as.
ENDINGS = (".nc", ".json")
#: Most pairs in a figure: those with the smallest clearances.
_MOST = 8
#: Most intervals in a row of the table.
_SPANS = 2


def rows(found: xr.Dataset) -> list[list[str]]:
    """A table: its head, then a row a pair, the smallest clearance first."""
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


def notes(found: xr.Dataset) -> list[str]:
    """Sentences: interference, warnings, what was left out."""
    listed = [f"{one}." for one in json.loads(found.attrs["sentences"])]
    listed += [f"Warning: {one}." for one in json.loads(found.attrs["warnings"])]
    for text, key in (("Left out", "left_out"), ("Rigid bodies with a shape alone are checked, not", "not_checked")):
        if names := json.loads(found.attrs[key]):
            listed.append(f"{text}: {'; '.join(names)}.")
    return listed


def figure(found: xr.Dataset) -> Figure:
    """Clearance over time, of the pairs with the smallest ones, where it is exact."""
    lines = []
    for n, k in enumerate(np.argsort(found.smallest.values, kind="stable")[:_MOST]):
        one = found.isel(pair=int(k))
        y = np.where(one.exact.values == 1, one.clearance.values, np.nan)
        lines.append(Line(x=found.time.values, y=y, label=str(one.pair.values), color=n))
    zero = Line(x=found.time.values[[0, -1]], y=np.zeros(2), color="gray", width=0.9)
    panel = Panel(x_label="time, s", y_label="clearance, m", lines=[*lines, zero])
    return Figure(name="clearance", title="Clearance between bodies", panels=[panel])


def to_dict(found: xr.Dataset) -> dict[str, Any]:
    """Numbers and texts, as the JSON file has them; what is not known is None."""
    pairs = []
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


def answer(found: xr.Dataset) -> an.Answer:
    """Smallest clearances, figure, sentences, and files."""
    return an.Answer(
        title=str(found.attrs["title"]),
        sections=[an.Section(title="Clearances", blocks=[an.Table.of(rows(found)), figure(found)])],
        notes=notes(found),
        files={"clearances.nc": lambda: netcdf.image(found), "clearances.json": lambda: an.as_json(to_dict(found))},
    )


def marked(motion: Motion, found: xr.Dataset) -> Motion:
    """The motion with bodies marked at the samples at which they interfere with another one."""
    inside: dict[str, Any] = {}
    for i, k in enumerate(found.between.values):
        span = (found.time.values >= found.start.values[i]) & (found.time.values <= found.end.values[i])
        for name in (str(found.a.values[k]), str(found.b.values[k])):
            inside[name] = inside.get(name, False) | span
    frames = [dataclasses.replace(f, marked=inside[f.name]) if f.name in inside else f for f in motion.frames]
    return dataclasses.replace(motion, frames=frames)
