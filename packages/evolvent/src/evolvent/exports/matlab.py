"""One .mat file with a struct ``run``, for MATLAB and GNU Octave."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from evolvent import cases, results
from evolvent.exports import table
from evolvent.exports.request import Request, about, motion_of, samples_text, shown_size, size_of
from evolvent.results import happened, variables
from evolvent_base.errors import InputError
from evolvent_base.files import writing

if TYPE_CHECKING:
    import xarray as xr

#: Longest name of a field, and words that are none.
_LONGEST = 63
_WORDS = {
    "break", "case", "catch", "classdef", "continue", "else", "elseif", "end", "for", "function", "global", "if",
    "otherwise", "parfor", "persistent", "return", "spmd", "switch", "try", "while",
}  # fmt: skip
#: Columns of the table of latches.
_LATCH = ("time", "rate", "rate_unit", "peak", "peak_unit", "work")
#: Largest variable that the format can hold, bytes.
_LIMIT = 2_000_000_000


def write(run: Any, path: str, request: Request) -> str:
    """Write a run as MATLAB 5 file; returns what was written.

    Notes
    -----
    ``run.data.NAME`` the values, of parts ``run.data.PART__NAME``; ``run.units.NAME``,
    ``run.meaning.NAME``, ``run.dims.NAME`` (dimensions, in order), ``run.names.NAME`` (the name in evolvent);
    ``run.lines(k)`` a line with ``name``, ``points`` (time, point, xyz; m, inertial axes) and ``values``;
    ``run.surfaces(k)`` a surface with ``name``, ``points`` (as a line), ``faces`` (face, its four points, from 1) and
    ``values`` (time, face);
    ``run.bodies(k)`` a body with ``name``, ``position`` (time, xyz; m), ``quaternion`` (time, wxyz; body to inertial);
    ``run.forces(k)`` with ``name``, ``unit``, ``points`` and ``vectors`` (time, point, xyz);
    ``run.marks(k)`` points with ``name``, ``points`` and ``size`` (m, NaN for none);
    ``run.latches(k)`` a latch that has locked: ``name``, ``time`` (s), ``rate``, ``rate_unit``, ``peak``,
    ``peak_unit``, ``work`` (J); ``run.events(k)`` what happened: ``time`` (s), ``part``, ``what``;
    ``run.results(k)`` a row of the table on the screen: ``name``, ``value``, ``unit``, ``text``;
    ``run.statistics`` the account of the solver; ``run.about`` where it comes from and how it ended; ``run.case`` the
    case as YAML.

    Raises
    ------
    InputError
        If the file cannot be written, or would be far too large.
    """
    count = run.sizes["time"]
    samples = request.samples(run)
    motion = motion_of(run).at(samples)
    some = variables.flat(run).isel(time=samples)
    size = some.nbytes + sum(x.points.nbytes + sum(v.nbytes for v in x.values.values()) for x in motion.lines)
    size += sum(x.points.nbytes + x.faces.nbytes + sum(v.nbytes for v in x.values.values()) for x in motion.surfaces)
    size += sum(2 * force.points.nbytes for force in motion.forces)
    request.allow(size, f"{samples.size} samples")
    if size > _LIMIT:
        raise InputError(
            f"a .mat file holds at most {shown_size(_LIMIT)}, and this is {shown_size(size)}; lower --frames"
        )
    fields = _fields([str(name) for name in some.variables])
    statistics = results.statistics_of(run)
    counts = _fields(statistics)
    content = {
        "data": {field: _values(some[name]) for name, field in fields.items()},
        "units": {field: some[name].attrs.get("units", "") for name, field in fields.items()},
        "meaning": {field: some[name].attrs.get("long_name", "") for name, field in fields.items()},
        "dims": {field: np.array([str(d) for d in some[name].dims], dtype=object) for name, field in fields.items()},
        "names": {field: name for name, field in fields.items()},
        "lines": _rows(("name", "points", "values"), [(x.name, x.points, _by_field(x.values)) for x in motion.lines]),
        "surfaces": _rows(
            ("name", "points", "faces", "values"),
            [(x.name, x.points, x.faces + 1, _by_field(x.values)) for x in motion.surfaces],
        ),
        "bodies": _structs(motion.frames, {"name": "name", "position": "origin", "quaternion": "attitude"}),
        "forces": _structs(motion.forces, {name: name for name in ("name", "unit", "points", "vectors")}),
        "marks": _rows(
            ("name", "points", "size"),
            [(mark.name, mark.points, np.nan if mark.size is None else mark.size) for mark in motion.marks],
        ),
        "latches": _table(happened.latches_of(run), {"name": "latch"} | {name: name for name in _LATCH}),
        "events": _table(happened.events_of(run), {name: name for name in happened.COLUMNS}),
        "results": _rows(("name", "value", "unit", "text"), table.result_rows(cases.presenter(run).numbers(run))),
        "statistics": {field: _count(statistics[name]) for name, field in counts.items()},
        "about": {_field(what): words for what, words in about(run)},
        "case": run.attrs["case"],
    }
    with writing(path) as temporary, open(temporary, "wb") as file:
        scipy.io.savemat(file, {"run": content}, do_compression=True, long_field_names=True, oned_as="column")
    return f"{path}: {samples_text(samples, count)}, {shown_size(size_of(path))}"


def _by_field(values: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Values by the names that a struct can have."""
    own = _fields(values)
    return {own[name]: array for name, array in values.items()}


def _structs(parts: Sequence[Any], fields: dict[str, str]) -> np.ndarray:
    """A struct array with a row a part: fields, and the attributes that they hold."""
    found = np.zeros(len(parts), dtype=[(field, object) for field in fields])
    for k, part in enumerate(parts):
        found[k] = tuple(getattr(part, attribute) for attribute in fields.values())
    return found


def _rows(fields: Sequence[str], rows: Iterable[tuple[Any, ...]]) -> np.ndarray:
    """A struct array with a row each."""
    listed = list(rows)
    found = np.zeros(len(listed), dtype=[(field, object) for field in fields])
    for k, row in enumerate(listed):
        found[k] = row
    return found


def _table(found: xr.Dataset, fields: dict[str, str]) -> np.ndarray:
    """A struct array of a data set's rows: fields, and the columns that they hold."""
    columns = [found[name].values.tolist() for name in fields.values()]
    return _rows(list(fields), zip(*columns, strict=True))


def _fields(names: Iterable[str]) -> dict[str, str]:
    """Names that a struct can have, each once, by the names that they are for."""
    found: dict[str, str] = {}
    taken: set[str] = set()
    for name in names:
        field, k = _field(name), 1
        while field in taken:
            k += 1
            field = f"{_field(name)[: _LONGEST - 4]}_{k}"
        taken.add(field)
        found[name] = field
    return found


def _field(name: str) -> str:
    """A name that a struct can have: 63 characters of ASCII, a letter first; the unit in brackets is part of it."""
    words = name.replace("[", "").replace("]", "").replace("1/m", "per_m")
    field = "_".join(re.sub(r"[^a-zA-Z0-9_\s]", "_", words.replace("/", " per ").replace(".", "__")).split())
    if not re.match(r"[a-zA-Z]", field) or field in _WORDS:
        field = f"x_{field}"
    if len(field) > _LONGEST:  # the end tells most: the variable of a part
        field = f"{field[:20]}_{field[-(_LONGEST - 21) :]}"
    return field


def _count(value: float | None) -> float:
    """A number of the solver's account, NaN for none."""
    return np.nan if value is None else value


def _values(variable: xr.DataArray) -> Any:
    """Numbers as they are, words as a cell array."""
    return variable.values.astype(object) if variable.dtype.kind in "UO" else variable.values
