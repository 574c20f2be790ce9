"""What a run makes of the limits of its case: the value that each has reached, and whether it is met."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import NamedTuple

import xarray as xr

from evolvent_base.errors import counted
from evolvent_base.figures import Number, Quantity

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
        """In words: "missed, 2.29 N m"."""
        word = "met" if self.is_met else "missed"
        return f"{word}, {self.value:.4g} {self.unit}".strip() if math.isfinite(self.value) else f"{word}, no value"


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
