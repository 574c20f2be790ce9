"""What a run makes of the limits of its case: the value that each has reached, and whether it is met."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Sequence
from typing import NamedTuple

import xarray as xr

from evolvent_base import units
from evolvent_base.errors import counted
from evolvent_base.figures import Number, Quantity

#: The unit of the bound in the text of a limit.
_BOUND = re.compile(r".*[<>]=\s*[-+]?[\d.]+(?:[eE][-+]?\d+)?\s*([^\d\s].*)")
#: Attribute of a run with what it makes of the limits of its case, JSON; and the key of a case.
LIMITS = "limits"


class Checked(NamedTuple):
    """What a run makes of a limit: the value that it has reached, in SI units, NaN where it has none."""

    text: str
    value: float
    unit: str
    is_met: bool

    @property
    def shown(self) -> str:
        """In words: "missed, 0.005236 m, 5.236 mm", in SI units and in those of the limit, where it has others."""
        word = "met" if self.is_met else "missed"
        if not math.isfinite(self.value):
            return f"{word}, no value"
        found, own = f"{word}, {self.value:.4g} {self.unit}".strip(), self._own_unit()
        return f"{found}, {self.value / units.parse(f'1 {own}', self.unit):.4g} {own}" if own else found

    def _own_unit(self) -> str:
        """Unit of the bound in the text; '' where it has none, that of the value, or one with a zero of its own."""
        own = _BOUND.fullmatch(self.text)
        if own is None or not self.unit or own[1] == self.unit:
            return ""
        try:
            one, two = (units.parse(f"{k} {own[1]}", self.unit) for k in (1, 2))
        except units.UnitError:
            return ""
        return own[1] if abs(two - 2.0 * one) <= 1e-12 * abs(two) else ""


def of_run(run: xr.Dataset | xr.DataTree) -> list[Checked]:
    """What a run makes of the limits of its case, in their order; empty without any."""
    rows = json.loads(run.attrs.get(LIMITS, "[]"))
    return [Checked(text, math.nan if value is None else value, unit, met) for text, value, unit, met in rows]


def verdict(found: Sequence[Checked]) -> str:
    """In words, how many limits are missed; '' where none is."""
    missed = [one.text for one in found if not one.is_met]
    if not missed:
        return ""
    return f"{len(missed)} of {counted(len(found), 'limit')} {'is' if len(missed) == 1 else 'are'} missed"


def met(found: Sequence[Checked]) -> str:
    """In words, how many limits are met: "2 of 3 limits met"; '' without any."""
    return f"{sum(one.is_met for one in found)} of {counted(len(found), 'limit')} met" if found else ""


def numbers(run: xr.Dataset | xr.DataTree) -> list[Number]:
    """Rows of the table: each limit, and what the run has reached."""
    return [
        Number(
            label=f"limit {one.text}", value=one.shown,
            quantities=(Quantity(one.value, one.unit or "1"),) if math.isfinite(one.value) else (),
        )
        for one in of_run(run)
    ]  # fmt: skip
