"""What happened in a run, as tables: its events in order of time, and its latches."""

from __future__ import annotations

import functools
import itertools
import json
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import xarray as xr

from evolvent.model.layout import LATCHED as LATCHED
from evolvent.model.registry import event_of
from evolvent.results import variables
from evolvent.solvers.common.solution import Solution
from evolvent_base.units import unit_text

#: Attribute of a run with its events: columns of a table in JSON.
EVENTS = "events"
#: What a part that is an event alone calls it.
EVENT = "event"
#: Its columns.
COLUMNS = ("time", "part", "what")
#: Events that are kept, at most: the first ones.
MOST = 1000


def in_order(solution: Solution) -> Iterator[tuple[float, tuple[str, int], str]]:
    """Time (s), family and row, and what happened, of every event of a solution in order of time."""
    return ordered(solution.assembly.model, solution.event_times, solution.event_kinds)


def ordered(model: Any, times: np.ndarray, kinds: np.ndarray) -> Iterator[tuple[float, tuple[str, int], str]]:
    """Time (s), family and row, and what happened, of events by their times (ne,) and kinds (ne,), in order of time."""
    known = functools.cache(functools.partial(event_of, lambda name: getattr(model, name)))
    for time, kind in sorted(zip(times.tolist(), kinds.tolist(), strict=True)):
        family, index, what = known(kind)
        yield time, (family.name, index), what


def written_events(solution: Solution) -> str:
    """The events of a run as its attribute `EVENTS` holds them; '' where there was none."""
    names = {place: name for name, place in reversed(solution.assembly.names.items())}
    rows = [(time, names.get(place, ""), what) for time, place, what in itertools.islice(in_order(solution), MOST)]
    return _columns(rows)


def events_text(events: Iterable[tuple[float, str]], part: str) -> str:
    """Events that the results of a part state, as its attribute `EVENTS` holds them; '' where there are none."""
    return _columns([(time, part, what) for time, what in itertools.islice(sorted(events), MOST)])


def _columns(rows: list[tuple[float, str, str]]) -> str:
    return json.dumps(dict(zip(COLUMNS, zip(*rows, strict=True), strict=True))) if rows else ""


def events_of(run: xr.DataTree | xr.Dataset) -> xr.Dataset:
    """The events of a run, in order of time.

    Returns
    -------
    xarray.Dataset
        Over the dimension ``event``: ``time``, s; ``part``, its name; ``what`` happened: "latched", "released" or
        "taken up" (a node of a thread, or the whole of it), "sticks or slips" (its spool), or "event" (of
        `evolvent.parts.Event`). Parts add what their states tell: a joint "released", a tape spring "snapped", a cord
        "taut" or "slack", a stop "hit", "separated". These are known to a sample, where no time is stated.
    """
    of = [run, *(run.children.values() if isinstance(run, xr.DataTree) else ())]
    columns = [json.loads(text) for one in of if (text := one.attrs.get(EVENTS))]
    rows = sorted((row for own in columns for row in zip(*(own[name] for name in COLUMNS), strict=True)), key=_time)
    held: dict[str, list[Any]] = {name: [row[k] for row in rows] for k, name in enumerate(COLUMNS)}
    found = xr.Dataset(
        {
            "time": ("event", np.array(held["time"], dtype=float), {"units": "s", "long_name": "time of the event"}),
            "part": ("event", np.array(held["part"], dtype=str), {"long_name": "part"}),
            "what": ("event", np.array(held["what"], dtype=str), {"long_name": "what happened"}),
        }
    )
    return found.assign_coords(event=np.arange(found.sizes["event"]))


def _time(row: tuple[Any, ...]) -> float:
    return float(row[0])


def latches_of(run: xr.DataTree | xr.Dataset) -> xr.Dataset:
    """The latches that have locked, in order of time.

    Returns
    -------
    xarray.Dataset
        Over the dimension ``latch``, names of joints or springs: ``time``, s; ``rate``, with which the coordinate
        arrived, ``peak``, the largest torque or force of the latch, and their units ``rate_unit`` and ``peak_unit``;
        ``work``, J, which the latch has dissipated.
    """
    rows: list[tuple[Any, ...]] = []
    for part in variables.parts(run):
        group = variables.group_of(run, part)
        if "latch_rate" not in group:
            continue
        time, rate = group["latch_time"], group["latch_rate"]
        if not np.isfinite(time.values.flat[-1]):
            continue
        peak = next(group[name] for name in ("latch_torque_peak", "latch_force_peak") if name in group)
        numbers = [float(one.values.flat[-1]) for one in (time, rate, peak, group["latch_work"])]
        rows.append((*numbers, part, *(unit_text(str(one.attrs["units"])) for one in (rate, peak))))
    rows.sort()
    times, rates, peaks, works, names, rate_units, peak_units = zip(*rows, strict=True) if rows else [()] * 7

    def numbers_of(values: Any, text: str, unit: str = "") -> xr.Variable:
        attrs = {"units": unit, "long_name": text} if unit else {"long_name": text}
        return xr.Variable("latch", np.array(values, dtype=float), attrs)

    return xr.Dataset(
        {
            "time": numbers_of(times, "time at which the latch has locked", "s"),
            "rate": numbers_of(rates, "rate at the time of latching"),
            "rate_unit": ("latch", np.array(rate_units, dtype=str)),
            "peak": numbers_of(peaks, "largest torque or force in the latch"),
            "peak_unit": ("latch", np.array(peak_units, dtype=str)),
            "work": numbers_of(works, "energy that the latch has dissipated", "J"),
        },
        {"latch": np.array(names, dtype=str)},
    )
