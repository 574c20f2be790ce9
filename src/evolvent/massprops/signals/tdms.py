"""TDMS, the files of LabVIEW and its like."""

from __future__ import annotations

import functools
import importlib
import io
import logging
from collections import Counter
from typing import Any

import numpy as np

from evolvent.base.tables import distinct, words
from evolvent.massprops.signals.recording import Column

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
    begun = [c.properties["wf_start_time"] for c in channels if "wf_start_time" in c.properties]
    found, left = [], {}
    for name, channel in zip(names, channels, strict=True):
        if channel.dtype.kind == "M":
            found.append(_stamps(name, channel, notes))
        elif channel.dtype.kind in "biuf":
            why = _frequency(channel)
            if why:
                left[name] = why
            else:
                found.append(_column(name, channel, min(begun, default=None), notes))
        else:
            left[name] = "its channel holds no numbers"
    return found, left


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


def _column(name: str, channel: Any, first: Any, notes: tuple[str, ...]) -> Column:
    """A channel of numbers; `first` : the earliest start of all channels."""
    properties = channel.properties
    factor = words.factor(_step_unit(channel)) or 1.0
    step = float(properties.get("wf_increment") or 0.0) * factor
    start = float(properties.get("wf_start_offset") or 0.0) * factor
    if "wf_start_time" in properties:
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
