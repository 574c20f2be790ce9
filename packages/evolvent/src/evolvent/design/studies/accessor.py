"""The accessor `found.ev` of a sweep's results: what a notebook shows of them in short."""

from __future__ import annotations

import itertools
import json
from collections import Counter

import numpy as np
import xarray as xr

from evolvent.design.studies import draw
from evolvent_base.answer import Answer, Section, Table, failed
from evolvent_base.errors import InputError, counted
from evolvent_base.figures import Figure
from evolvent_base.showing import Answered
from evolvent_base.units import unit_text

#: Letters of the values of a key, at most.
_VALUES = 40


@xr.register_dataset_accessor("ev")
class StudyAccessor(Answered):
    """What can be done with the results of many cases; ``found.ev`` as the last line of a cell shows them in short.

    Parameters
    ----------
    found : xarray.Dataset, of `evolvent.sweep` or `evolvent.simulate_many`
    """

    def __init__(self, found: xr.Dataset) -> None:
        self._found = found

    def answer(self) -> Answer:
        """How the cases ended, what varies, ranges of the results, and a figure of the first one that varies."""
        status = self._status()
        facts = [
            ("cases", _counts(status.values)),
            *((f"key {key}", _values(self._found[key])) for key in self._keys()),
        ]
        table = Table(heads=("result", "smallest", "largest", "cases without a value"), rows=self._ranges())
        return Answer(
            title=str(self._found.attrs.get("title", "Variants")), facts=facts, warnings=failed(self._reasons()),
            sections=[Section(title="Results", blocks=[table, *self._figures()])],
        )  # fmt: skip

    def _status(self) -> xr.DataArray:
        """How every case ended.

        Raises
        ------
        InputError
            If the data set holds no results of many cases.
        """
        if "status" not in self._found or "reason" not in self._found:
            raise InputError("the data set has no 'status' and 'reason' of cases; .ev is of results of a sweep")
        return self._found["status"]

    def _keys(self) -> list[str]:
        """Keys that vary."""
        over = set(self._status().dims)
        listed = json.loads(self._found.attrs.get("keys", "null"))
        names = [str(name) for name, of in self._found.coords.items() if set(of.dims) <= over and of.dims]
        return names if listed is None else [key for key in listed if key in self._found.coords]

    def _ranges(self) -> list[list[str]]:
        """A row a result with one or more numbers a case: its range over all cases and entries."""
        over, rows = self._status().dims, []
        for name, values in self._found.data_vars.items():
            if values.dtype.kind not in "iuf" or not set(over) <= set(values.dims):
                continue
            rest = [dim for dim in values.dims if dim not in over]
            known = xr.apply_ufunc(np.isfinite, values)
            finite, lacking = values.values[known.values], int((~known.any(rest)).sum())
            ends = [f"{end:.6g}" for end in (finite.min(), finite.max())] if finite.size else ["-", "-"]
            rows.append([_named(name, values), *ends, str(lacking)])
        return rows

    def _reasons(self) -> list[str]:
        """Why cases failed."""
        return [str(why) for why in self._found["reason"].values.flat if why]

    def _figures(self) -> list[Figure]:
        """The figure of the first result that varies, of a study."""
        keys = json.loads(self._found.attrs.get("keys", "null"))
        if keys is None or self._keys() != keys:  # of variants, and where a key was taken away
            return []
        return list(itertools.islice(draw.described(self._found), 1))


def _counts(status: np.ndarray) -> str:
    """How many cases ended how."""
    found = Counter(str(one) for one in status.flat)
    return f"{status.size}: " + ", ".join(f"{count} {how}" for how, count in found.most_common())


def _values(key: xr.DataArray) -> str:
    """Values of a key in short: their number and range, or words."""
    if key.dtype.kind in "iuf" and np.isfinite(key.values).any():
        low, high = float(np.nanmin(key.values)), float(np.nanmax(key.values))
        unit = str(key.attrs.get("units", "1"))
        text = f"{low:.6g}" if low == high else f"{low:.6g} to {high:.6g}"
        return f"{counted(np.unique(key.values).size, 'value')}, {text}{'' if unit == '1' else f' {unit}'}"
    text = ", ".join(dict.fromkeys(str(one) or "its own" for one in key.values.flat))
    return text if len(text) <= _VALUES else f"{text[: _VALUES - 3]}..."


def _named(name: object, values: xr.DataArray) -> str:
    unit = unit_text(str(values.attrs.get("units", "1")))
    return f"{name} [{unit}]" if unit not in ("1", "") else str(name)
