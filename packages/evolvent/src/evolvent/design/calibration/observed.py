"""What runs give for measured values: in their unit, at their times."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy

from evolvent.results import variables
from evolvent.results.kept import reduce, split, unit_of
from evolvent.results.measurements import Series
from evolvent_base import units
from evolvent_base.errors import InputError

Array = np.ndarray
#: Values from which on a mean difference is stated, and how often it is the scatter of the differences.
_FEWEST, _OFFSET = 8, 3.0
#: Part of a step of the data by which rounded times may lie outside of the run.
_ROUNDED = 0.01


def factor(unit: str, one: Series) -> float:
    """From a unit of the results to that of the data; the same if the data state none."""
    if not one.unit:
        return 1.0
    wanted = re.sub(r"([A-Za-z]+)(-?\d)", r"\1^\2", unit) if unit != "1" else ""  # "kg m2 s-1": kg m^2 s^-1
    try:
        return 1.0 / units.factor(one.unit, {"rad s^-1": "rad/s"}.get(wanted, wanted))
    except units.UnitError as error:
        raise InputError(f"the data of {one.name!r} are in {one.unit}, the variable in {unit}; {error}") from None


def values(run: Any, one: Series, content: Any) -> Array:
    """Values of a series in a run, in its unit."""
    if one.times is None:
        name, reduction = split(one.name)
        found = variables.get(run, name)
        over_time = found.transpose("time", ...).values if "time" in found.dims else found.values[None]
        extremes = variables.extremes_of(found)
        number = np.asarray(reduce(over_time, run.time.values, reduction or "last", extremes), dtype=float)
        if number.ndim:
            raise InputError(f"--observe is {one.name!r}, which has {number.size} values a run; name a component of it")
        return np.atleast_1d(number) * factor(unit_of(str(found.attrs.get("units", "1")), reduction), one)
    found = variables.get(run, one.name)
    if found.dims != ("time",):
        raise InputError(f"--observe is {one.name!r}, which has the dimensions {found.dims}; name one value over time")
    time, at = run.time.values, one.times(content)
    slack = max(1e-9 * abs(time[-1]), _ROUNDED * float(np.median(np.abs(np.diff(at))))) if at.size > 1 else 1e-9
    if at.min() < time[0] - slack or at.max() > time[-1] + slack:
        raise InputError(
            f"the data go from {at.min():.9g} s to {at.max():.9g} s, the run from {time[0]:g} s to {time[-1]:g} s; let "
            f"the run cover the data{_why(np.ptp(at), time[-1] - time[0])}"
        )
    inside = np.clip(at, time[0], time[-1])
    return np.asarray(scipy.interpolate.CubicSpline(time, found.values)(inside)) * factor(
        str(found.attrs.get("units", "1")), one
    )


def _why(data: float, run: float) -> str:
    """What a sentence adds on data that last no longer than the run, or a thousand or a million times as long."""
    if data <= run * (1.0 + 1e-9):
        return f"; the data last {data:.6g} s: their time must count from the start of the run"
    for unit, size in (("ms", 1e3), ("us", 1e6)):
        if 0.1 * size < data / run < 3.0 * size:
            return f"; if their time is in {unit}, its head must say so: time ({unit})"
    return ""


def offsets(series: Sequence[Series], modelled: Sequence[Array]) -> list[str]:
    """Sentences on series that lie beside what the fitted model gives, by more than they scatter about it."""
    found = []
    for one, own in zip(series, modelled, strict=True):
        off = one.values - own
        mean, scatter = float(off.mean()), float(off.std())
        if off.size >= _FEWEST and abs(mean) > _OFFSET * scatter:
            found.append(
                f"The data of {one.name} lie {abs(mean):.3g} {one.unit} {'above' if mean > 0.0 else 'below'} the "
                f"fitted model on average, {abs(mean) / scatter if scatter else np.inf:.3g} times their scatter: check "
                "their zero and sign."
            )
    return found
