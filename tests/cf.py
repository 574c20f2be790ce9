"""The rules of the CF conventions, 1.11, that files of evolvent must keep: what `faults` finds against them."""

from __future__ import annotations

import re

import numpy as np
import xarray as xr
from xarray import open_datatree

#: Units of UDUNITS-2 that files may hold, and one of them with its power.
_UNITS = ("kg", "m", "s", "A", "K", "N", "J", "W", "V", "Pa", "Hz", "rad", "radian", "degree", "percent", "%")
_FACTOR = re.compile(rf"({'|'.join(_UNITS)})(\^?-?\d+)?")


def is_unit(text: str) -> bool:
    """Whether UDUNITS reads a unit: factors with powers, with blanks or dots between them, or one fraction."""
    above, slash, below = text.partition("/")
    parts = [*re.split(r"[ .]", above), *([below] if slash else [])]
    return text == "1" or all(_FACTOR.fullmatch(one) or one == "1" for one in parts)


def faults(path, needs=("title", "source")) -> list[str]:
    """What a NetCDF file has against the conventions, with the places."""
    found = []
    with open_datatree(path, engine="h5netcdf", decode_cf=False) as tree:
        if tree.attrs.get("Conventions") != "CF-1.11":
            found.append(f"/: Conventions is {tree.attrs.get('Conventions')!r}")
        for name in needs:
            if not isinstance(tree.attrs.get(name), str):
                found.append(f"/: {name} is {tree.attrs.get(name)!r}")
        for node in tree.subtree:
            held = node.to_dataset(inherit=False)
            scope = set(node.to_dataset().variables)
            for name, values in held.variables.items():
                found += [f"{node.path} {name}: {one}" for one in _of_variable(str(name), values, scope)]
    return found


def _of_variable(name: str, values: xr.Variable, scope: set) -> list[str]:
    found = []
    if values.ndim > 1 and name in values.dims:
        found.append("it has several dimensions, and the name of one of them")
    number = values.dtype.kind in "iuf"
    if (name,) == values.dims:
        found += [f"{key} of a coordinate" for key in ("_FillValue", "missing_value") if key in values.attrs]
        if number:
            steps = np.diff(values.values.astype(float))
            if not (np.all(steps > 0.0) or np.all(steps < 0.0)):
                found.append("a coordinate that is not monotonic")
    units = values.attrs.get("units")
    if number and units is not None and not is_unit(str(units)):
        found.append(f"units {units!r}")
    fill = values.attrs.get("_FillValue")
    if fill is not None and np.asarray(fill).dtype != values.dtype:
        found.append(f"_FillValue is of {np.asarray(fill).dtype}, and the values of {values.dtype}")
    listed = str(values.attrs.get("coordinates", "")).split()
    found += [f"coordinates name {one!r}, which is not there" for one in listed if one not in scope]
    return found
