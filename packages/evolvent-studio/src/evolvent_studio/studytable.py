"""A study in the units in which it was written, and its table: a row a case, for a spreadsheet."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from evolvent.results import display
from evolvent_base import units
from evolvent_base.errors import visible

#: A number that is written with its unit, alone or in a distribution or a range.
_WRITTEN = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?\s+([A-Za-z%][\w/^ .*-]*)", re.I)
#: Entries of a result that have a column each, at most.
_ENTRIES = 12


class Units:
    """Units in which the keys of a study were written.

    Parameters
    ----------
    over : mapping, the key `over` of the study: key -> values, a range or a distribution
    si : mapping, key -> SI unit; '' of a plain number
    """

    def __init__(self, over: Any, si: Mapping[str, str]) -> None:
        self._known: dict[str, tuple[float, str]] = {}
        for key, unit in si.items():
            for text in _texts(over.get(key)) if unit and isinstance(over, Mapping) else ():
                if (match := _WRITTEN.search(text)) and (size := _size(match[1].strip(), unit)):
                    self._known[key] = size, match[1].strip()
                    break

    def of(self, key: str, unit: str) -> tuple[float, str]:
        """What SI values of a key are divided by, and their unit then."""
        return self._known.get(key, (1.0, unit))

    def text(self, key: str, value: Any) -> Any:
        """A value as a case holds it, in the unit in which it was written; as it is where there is none."""
        if key not in self._known or isinstance(value, (str, bool)) or not isinstance(value, (int, float)):
            return value
        size, unit = self._known[key]
        return f"{float(value) / size:.12g} {unit}"

    def shown(self, study: xr.Dataset) -> xr.Dataset:
        """A study whose keys are in these units, and whose results are in those in which people read them."""
        coords = {}
        for key, coordinate in study.coords.items():
            size, unit = self.of(str(key), "")
            if unit and coordinate.dtype.kind in "if":
                values = [float(f"{value:.12g}") for value in (coordinate.values / size).ravel()]
                shaped = np.array(values).reshape(coordinate.shape)
                coords[key] = (coordinate.dims, shaped, {**coordinate.attrs, "units": unit})
        read = {name: display.shown(one) for name, one in study.data_vars.items() if one.dtype.kind in "if"}
        return study.assign(read).assign_coords(coords)


def _texts(value: Any) -> Iterator[str]:
    """All texts in what a study says of a key."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, Mapping):
        for one in value.values():
            yield from _texts(one)
    elif isinstance(value, (list, tuple)):
        for one in value:
            yield from _texts(one)


def _size(written: str, unit: str) -> float | None:
    """How many of an SI unit one of another is; None where it is no multiple of it, such as degrees Celsius."""
    try:
        zero, one = (units.parse(f"{count} {written}", unit) for count in (0, 1))
    except units.UnitError:
        return None
    return float(one) if zero == 0.0 and one > 0.0 else None


def rows(study: xr.Dataset, dims: Sequence[str], keys: Sequence[str]) -> list[list[Any]]:
    """The table: a line of heads with units, then a row a case with its status, keys and results.

    Results with entries have a column each; those over time have none.

    Parameters
    ----------
    dims : dimensions of the cases
    keys : keys that vary
    """
    count = study["status"].size
    columns: list[tuple[str, Sequence[Any]]] = [("case", range(1, count + 1))]
    cases = study["status"].transpose(*dims)

    def add(name: str, values: xr.DataArray) -> None:
        wide = values.broadcast_like(cases).transpose(*dims).values.ravel()
        columns.append((name, [visible(str(v)) if wide.dtype.kind in "UO" else v.item() for v in wide]))

    def unit_of(one: xr.DataArray) -> str:
        unit = units.unit_text(str(one.attrs.get("units", "1")))
        return f" [{unit}]" if unit not in ("1", "") else ""

    for word in ("status", "reason"):
        add(word, study[word])
    for key in keys:
        add(f"{key}{unit_of(study[key])}", study[key])
    for name, one in ((str(name), one) for name, one in study.data_vars.items()):
        rest = [str(dim) for dim in one.dims if dim not in dims]
        if name in ("status", "reason") or not set(dims) <= set(map(str, one.dims)):
            continue
        if "time" in rest or int(np.prod([one.sizes[dim] for dim in rest])) > _ENTRIES:
            continue
        for places in np.ndindex(*(one.sizes[dim] for dim in rest)):
            at = dict(zip(rest, places, strict=True))
            labels = [str(study[dim].values[k]) if dim in study.coords else str(k) for dim, k in at.items()]
            add(f"{'.'.join([name, *labels])}{unit_of(one)}", one.isel(at))
    return [[visible(name) for name, _ in columns], *map(list, zip(*(own for _, own in columns), strict=True))]
