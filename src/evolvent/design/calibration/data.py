"""Measured data: values of observed variables, and where in the runs of a case they were measured.

Three kinds of files are read. A **history** has a column of times and one for each observed variable: one run is
compared with it at these times. A **table of runs** has columns named by keys of the case and one for each observed
variable: each row is its own run with these keys. A **log** is in a form that a system reads itself
(`SystemDefinition.measurements`).
"""

from __future__ import annotations

import functools
import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from evolvent import cases
from evolvent.base import schema, units
from evolvent.base.errors import InputError, nearest
from evolvent.massprops import signals
from evolvent.results.measurements import Measurements, Series

Array = np.ndarray
_TIMES = ("time", "t")


def read(path: str, case: Any, observed: Sequence[str]) -> Measurements:
    """The measured values of variables of a case.

    Parameters
    ----------
    path : str, a file, or the name of one of the system's own `data_files`
    case : name, file or content of a case
    observed : names of variables, each "NAME" or "NAME=COLUMN"

    Raises
    ------
    InputError
        For columns and units that do not fit.
    """
    content = cases.content_of(case)
    pairs = [(name.strip(), column.strip() or name.strip()) for name, _, column in (o.partition("=") for o in observed)]
    system = cases.system_of(content)
    if not os.path.exists(path):
        path = system.data_files.get(path, path)
    found = system.measurements(path, content, [name for name, _ in pairs])
    if isinstance(found, Measurements):
        return found
    table = signals.read(path)
    lowered = [name.lower() for name in table.names]
    clock = next((lowered.index(name) for name in _TIMES if name in lowered), None)
    for _, column in pairs:
        if column not in table.names:
            known = [name for k, name in enumerate(table.names) if k != clock]
            raise InputError(
                f"{path!r} has no column {column!r}; {nearest(column, known)}; or write --observe NAME=COLUMN"
            )
    if clock is not None:
        return _history(path, table, clock, pairs)
    return _runs(path, table, content, pairs)


def _history(path: str, table: Any, clock: int, pairs: Sequence[tuple[str, str]]) -> Measurements:
    unit = table.units[clock] or "s"
    try:
        time = table.data[:, clock] * units.parse(f"1 {unit}", "s")
    except units.UnitError:
        raise InputError(
            f"the column {table.names[clock]!r} of {path!r} has the unit {unit!r}; a time is in s"
        ) from None
    series, notes = [], []
    for name, column in pairs:
        values = table.column(column)
        if not table.units[table.index(column)]:
            notes.append(f"The column {column!r} states no unit; its values are taken in that of {name}.")
        good = np.isfinite(values) & np.isfinite(time)
        if good.sum() < 2:
            raise InputError(f"the column {column!r} of {path!r} has {good.sum()} values; it needs two or more")
        if not good.all():
            notes.append(f"{np.count_nonzero(~good)} of {good.size} rows have no value of {column!r} and are left out.")
        at = time[good]
        series.append(
            Series(
                name=name,
                unit=table.units[table.index(column)],
                values=values[good],
                labels=tuple(f"{t:.6g} s" for t in at),
                times=functools.partial(_fixed, at),
            )
        )
    return Measurements(source=path, series=tuple(series), notes=tuple(notes))


def _fixed(times: Array, content: Mapping[str, Any]) -> Array:
    """Times that do not depend on the case."""
    return times


def _runs(path: str, table: Any, content: Mapping[str, Any], pairs: Sequence[tuple[str, str]]) -> Measurements:
    kind = cases.system(content["system"]).Case
    observed = {column for _, column in pairs}
    keys = [name for name in table.names if name not in observed]
    if not keys:
        raise InputError(
            f"{path!r} has neither a column 'time' nor columns named by keys of the case; one of them must say what "
            f"each row belongs to"
        )
    for key in keys:
        schema.locate(kind, key, content)
    rows = []
    for values in table.data:
        given = {}
        for key in keys:
            place = table.index(key)
            number, unit = float(values[place]), table.units[place]
            if not np.isfinite(number):
                raise InputError(f"the column {key!r} of {path!r} lacks a value; every row sets every key")
            given[key] = f"{number!r} {unit}" if unit else number
        rows.append(given)
    labels = tuple(", ".join(f"{key} {value}" for key, value in row.items()) for row in rows)
    series = tuple(
        Series(name=name, unit=table.units[table.index(column)], values=table.column(column), labels=labels)
        for name, column in pairs
    )
    for one, (_, column) in zip(series, pairs, strict=True):
        if not np.all(np.isfinite(one.values)):
            raise InputError(f"the column {column!r} of {path!r} lacks a value; every row has one")
    return Measurements(source=path, series=series, rows=tuple(rows))
