"""One .mat file with a struct ``run``, for MATLAB and GNU Octave."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent.base.errors import InputError
from evolvent.base.files import writing
from evolvent.exports.request import Request, about, motion_of, samples_text, shown_size, size_of
from evolvent.results import variables

if TYPE_CHECKING:
    import xarray as xr

#: Largest variable that the format can hold, bytes.
_LIMIT = 2_000_000_000


def write(run: Any, path: str, request: Request) -> str:
    """Write a run as MATLAB 5 file; returns what was written.

    Notes
    -----
    ``run.data.NAME`` the values, of parts ``run.data.PART__NAME``; ``run.units.NAME``,
    ``run.meaning.NAME``, ``run.dims.NAME`` (dimensions, in order);
    ``run.lines(k)`` a line with ``name``, ``points`` (time, point, xyz; m, inertial axes) and ``values``;
    ``run.bodies(k)`` a body with ``name``, ``position`` (time, xyz; m), ``quaternion`` (time, wxyz; body to inertial);
    ``run.forces(k)`` with ``name``, ``unit``, ``points`` and ``vectors`` (time, point, xyz);
    ``run.about`` where it comes from and how it ended; ``run.case`` the case as YAML.

    Raises
    ------
    InputError
        If the file cannot be written, or would be far too large.
    """
    from scipy.io import savemat

    count = run.sizes["time"]
    samples = request.samples(run)
    motion = motion_of(run).at(samples)
    some = variables.flat(run).isel(time=samples)
    size = some.nbytes + sum(x.points.nbytes + sum(v.nbytes for v in x.values.values()) for x in motion.lines)
    size += sum(2 * force.points.nbytes for force in motion.forces)
    request.allow(size, f"{samples.size} samples")
    if size > _LIMIT:
        raise InputError(
            f"a .mat file holds at most {shown_size(_LIMIT)}, and this is {shown_size(size)}; lower --frames"
        )
    names = [str(name) for name in some.variables]
    lines = np.zeros(len(motion.lines), dtype=[("name", object), ("points", object), ("values", object)])
    for k, line in enumerate(motion.lines):
        values = {_field(name): v for name, v in line.values.items()}
        lines[k] = (line.name, line.points, values)
    content = {
        "data": {_field(name): _values(some[name]) for name in names},
        "units": {_field(name): some[name].attrs.get("units", "") for name in names},
        "meaning": {_field(name): some[name].attrs.get("long_name", "") for name in names},
        "dims": {_field(name): np.array([str(d) for d in some[name].dims], dtype=object) for name in names},
        "lines": lines,
        "bodies": _structs(motion.frames, {"name": "name", "position": "origin", "quaternion": "attitude"}),
        "forces": _structs(motion.forces, {name: name for name in ("name", "unit", "points", "vectors")}),
        "about": {_field(what): words for what, words in about(run)},
        "case": run.attrs["case"],
    }
    with writing(path) as temporary, open(temporary, "wb") as file:
        savemat(file, {"run": content}, do_compression=True, long_field_names=True, oned_as="column")
    return f"{path}: {samples_text(samples, count)}, {shown_size(size_of(path))}"


def _structs(parts: Sequence[Any], fields: dict[str, str]) -> np.ndarray:
    """A struct array with a row a part: fields, and the attributes that they hold."""
    found = np.zeros(len(parts), dtype=[(field, object) for field in fields])
    for k, part in enumerate(parts):
        found[k] = tuple(getattr(part, attribute) for attribute in fields.values())
    return found


def _field(name: str) -> str:
    """A name that a struct can have; the unit in brackets is part of it."""
    words = name.replace("[", "").replace("]", "").replace("1/m", "per_m")
    return "_".join(re.sub(r"[^\w\s]", "_", words.replace("/", " per ").replace(".", "__")).split())


def _values(variable: xr.DataArray) -> Any:
    """Numbers as they are, words as a cell array."""
    return variable.values.astype(object) if variable.dtype.kind in "UO" else variable.values
