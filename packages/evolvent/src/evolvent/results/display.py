"""The units in which people read angles and rates: degrees, or revolutions; data and files keep radians."""

from __future__ import annotations

import math
from collections.abc import Collection

import xarray as xr

from evolvent.results import variables
from evolvent_base.errors import InputError, nearest

_DEG, _RPM = 180.0 / math.pi, 30.0 / math.pi
_OF_DEGREES = {"rad": (_DEG, "deg"), "rad s-1": (_DEG, "deg s-1"), "rad s-2": (_DEG, "deg s-2")}
#: Words for units in figures -> what a unit of the data is multiplied by, and what it becomes.
UNITS: dict[str, dict[str, tuple[float, str]]] = {
    "deg": _OF_DEGREES,
    "rpm": _OF_DEGREES | {"rad s-1": (_RPM, "rpm")},
    "rad": {},
}
#: What people read unless they ask for others.
USUAL = "deg"
#: Attribute of a variable with the key of `UNITS` that people read it in where they ask for none: as its part's rates
#: were written.
WRITTEN = "display_units"


def shown_unit(unit: str, units: str = USUAL) -> tuple[float, str]:
    """What values in a unit of the data are multiplied by where they are shown, and the unit that they are shown in.

    Parameters
    ----------
    unit : str, as variables have it: "rad", "rad s-1"
    units : str, one of `UNITS`: "rpm" shows rates as revolutions per minute and angles in degrees

    Raises
    ------
    InputError
        If `units` is none of them.
    """
    if units not in UNITS:
        raise InputError(f"units is {units!r}; {nearest(str(units), UNITS)}")
    return UNITS[units].get(unit, (1.0, unit))


def attributes(units: str, long_name: str, written: Collection[str] = ()) -> dict[str, str]:
    """Attributes of a variable, of a part whose rates were `written` in some units."""
    own = dict.fromkeys([WRITTEN], "rpm") if "rpm" in written and units == "rad s-1" else {}
    return {"units": units, "long_name": long_name, **own}


def written(found: xr.DataArray, otherwise: str = USUAL) -> str:
    """The key of `UNITS` for a variable as its part's rates were written."""
    units = str(found.attrs.get(WRITTEN, otherwise))
    return units if units in UNITS else otherwise  # a file from elsewhere may hold anything


def shown(found: xr.DataArray, units: str | None = None) -> xr.DataArray:
    """A variable in the unit in which it is shown.

    Parameters
    ----------
    found : xarray.DataArray, with its unit in the attribute `units`
    units : str, one of `UNITS`; left out, rates that were written in revolutions per minute are shown so, and others
        by degrees

    Raises
    ------
    InputError
        If `units` is none of them.
    """
    unit = str(found.attrs.get("units", ""))
    factor, name = shown_unit(unit, written(found) if units is None else units)
    if name == unit:
        return found
    extremes = variables.extremes_of(found)
    own = found.copy(data=factor * found.values).assign_attrs(units=name)
    return variables.without_extremes(own) if extremes is None else variables.with_extremes(own, factor * extremes)
