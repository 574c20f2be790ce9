"""TDMS, the files of LabVIEW and its like."""

from __future__ import annotations

import dataclasses
import functools
import importlib
import io
import logging
from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np

from evolvent_base.signals.recording import Column
from evolvent_base.signals.statements import statement
from evolvent_base.signals.timebase import is_named_time
from evolvent_base.tables import distinct, words

#: Properties that hold a channel's unit, and names that say nothing.
_UNITS = ("unit_string", "NI_UnitDescription", "Unit", "unit", "units")
_UNNAMED = "untitled"


def read(raw: bytes) -> tuple[list[Column], dict[str, str]]:
    """Columns of the channels of numbers and times; and names of the others -> why they are left out."""
    TdmsFile = importlib.import_module("nptdms").TdmsFile

    before = logging.root.manager.disable
    logging.disable(logging.CRITICAL)  # the library logs what is damaged beside raising it
    try:
        file = TdmsFile.read(io.BytesIO(raw))
    finally:
        logging.disable(before)
    status = getattr(file, "file_status", None)
    cut = ("the file ends within a segment, as one of a writer that was stopped; what is whole was read",)
    notes = cut if status is not None and status.incomplete_final_segment else ()
    channels = [c for group in file.groups() for c in group.channels() if len(c)]
    count = Counter(map(_own_name, channels))
    names = distinct(n if count[n := _own_name(c)] == 1 else f"{c.group_name}/{n}" for c in channels)
    begun = [c.properties.get("wf_start_time") for c in channels]
    begun = [one for one in begun if isinstance(one, np.datetime64)]
    found, left = [], {}
    for name, channel in zip(names, channels, strict=True):
        if channel.dtype.kind == "M":
            found.append(_stamps(name, channel, notes))
        elif channel.dtype.kind in "biuf":
            why = _frequency(channel)
            if why:
                left[name] = why
            else:
                above = {**file.properties, **file[channel.group_name].properties}
                found.append(_column(name, channel, min(begun, default=None), above, notes))
        else:
            left[name] = "its channel holds no numbers"
    return [_with_step(one, found) for one in found], left


def _with_step(one: Column, channels: list[Column]) -> Column:
    """A channel without a step, with that of the others of its group and length, where all have the same."""
    others = [o for o in channels if o.rate is not None and o.group == one.group and o.size == one.size]
    if one.rate is not None or len({(o.rate, o.start) for o in others}) != 1 or is_named_time(one.name):
        return one
    note = f"{one.name!r} states no step: that of {others[0].name!r} was taken"
    return dataclasses.replace(one, rate=others[0].rate, start=others[0].start, notes=(*one.notes, note))


def _own_name(channel: Any) -> str:
    """Name of a channel, or of its input where LabVIEW gave none."""
    own = str(channel.properties.get("NI_ChannelName", "")).strip()
    name = str(channel.name).strip()
    return own if own and (not name or name.lower().startswith(_UNNAMED)) else name


def _frequency(channel: Any) -> str:
    """Why a channel is no function of time, '' where nothing says so."""
    unit = _step_unit(channel)
    return f"it is a function in steps of {unit}, not of time" if unit and words.factor(unit) is None else ""


def _step_unit(channel: Any) -> str:
    return str(channel.properties.get("wf_xunit_string", "")).strip()


def _column(name: str, channel: Any, first: Any, above: Mapping[str, Any], notes: tuple[str, ...]) -> Column:
    """A channel of numbers; `first` : the earliest start of all channels, `above` : what its group and file state."""
    properties = channel.properties
    factor = words.factor(_step_unit(channel)) or 1.0
    step = float(properties.get("wf_increment") or 0.0) * factor
    start = float(properties.get("wf_start_offset") or 0.0) * factor
    if step <= 0.0:
        stated = [statement(key, value) for own in (properties, above) for key, value in own.items()]
        step = next((one[1] for one in stated if one is not None and one[0] == "step"), 0.0)
    if isinstance(properties.get("wf_start_time"), np.datetime64):
        start += float((properties["wf_start_time"] - first) / np.timedelta64(1, "s"))
    unit = next((str(properties[key]).strip() for key in _UNITS if str(properties.get(key, "")).strip()), "")
    return Column(
        name,
        len(channel),
        functools.partial(_samples, channel),
        unit,
        rate=1.0 / step if step > 0.0 else None,
        start=start,
        path=f"{channel.group_name}/{channel.name}",
        group=(channel.group_name,),
        notes=notes,
    )


def _samples(channel: Any) -> np.ndarray:
    return np.asarray(channel[:], dtype=float)


def _stamps(name: str, channel: Any, notes: tuple[str, ...]) -> Column:
    """A channel of dates and times, as s from the first one on."""
    values = np.asarray(channel[:])
    since = (values - values[0]) / np.timedelta64(1, "s")
    return Column(name, len(channel), lambda: since, "s", group=(channel.group_name,), notes=notes)
