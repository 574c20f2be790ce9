"""What is kept of every run, as rows of a table that can be joined, and be written as bytes."""

from __future__ import annotations

import dataclasses
import io
import json
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from evolvent import results
from evolvent.base.errors import EvolventError, InputError, nearest
from evolvent.results import variables

#: What may be kept of a variable over time, ``NAME.last`` and so on.
REDUCTIONS: dict[str, Callable[[np.ndarray], Any]] = {
    "first": lambda values: values[0],
    "last": lambda values: values[-1],
    "min": lambda values: np.fmin.reduce(values, axis=0),
    "max": lambda values: np.fmax.reduce(values, axis=0),
    "abs_max": lambda values: np.fmax.reduce(np.abs(values), axis=0),
    "mean": lambda values: values.mean(axis=0, dtype=float),
}
#: Words of each of them.
_HOW = {
    "first": "at the start", "last": "at the end", "min": "least", "max": "largest", "abs_max": "largest magnitude",
    "mean": "mean",
}  # fmt: skip
#: Attributes of a run that differ between two computations of the same case.
_CLOCKS = ("wall_time_s", "compile_time_s")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Outcome:
    """What is kept of one case.

    Attributes
    ----------
    index : int, of the case
    status : str, of the run; "failed" also where there is no run
    reason : str, why it failed; else empty
    variables : mapping, name -> DataArray without a name; empty for a failed case
    missing : tuple of str, wanted names that the run does not have
    known : tuple of str, names that it has, where some are missing
    """

    index: int
    status: str
    reason: str = ""
    variables: Mapping[str, xr.DataArray] = dataclasses.field(default_factory=dict)
    missing: tuple[str, ...] = ()
    known: tuple[str, ...] = ()


def stored_name(wanted: str) -> str:
    """Name in the results of what is kept: "tip mass.position.x.max" -> "tip_mass_position_x_max"."""
    return re.sub(r"\W+", "_", wanted)


def split(wanted: str) -> tuple[str, str]:
    """Name of a variable, and what is kept of it over time; '' for all of it."""
    name, _, last = wanted.rpartition(".")
    return (name, last) if last in REDUCTIONS and name else (wanted, "")


def outcome(index: int, run: xr.Dataset | xr.DataTree | Exception, keep: Sequence[str]) -> Outcome:
    """What is kept of a run, or the reason why there is none."""
    if isinstance(run, Exception):
        is_own = isinstance(run, EvolventError)
        reason = " ".join(str(run).split())
        return Outcome(index=index, status="failed", reason=reason if is_own else f"{type(run).__name__}: {reason}")
    status = str(run.attrs["status"])
    if status == "failed":
        return Outcome(index=index, status=status, reason=" ".join(str(run.attrs["message"]).split()))
    return _outcome(index, status, results.regular(run), keep)  # at times that all cases have


def _outcome(index: int, status: str, run: xr.Dataset | xr.DataTree, keep: Sequence[str]) -> Outcome:
    """What is kept of a run that did not fail."""
    numbers = _numbers(run)
    if not keep:
        root = run.to_dataset() if isinstance(run, xr.DataTree) else run
        timeless = {str(name): values for name, values in root.data_vars.items() if "time" not in values.dims}
        own = {name: _number(name, value) for name, value in numbers.items()}
        return Outcome(index=index, status=status, variables=own | timeless)
    found, missing = {}, []
    for wanted in keep:
        name, reduction = split(wanted)
        values = _number(name, numbers[name]) if name in numbers else _variable(run, name)
        if values is None or (reduction and "time" not in values.dims):
            missing.append(wanted)
        else:
            found[stored_name(wanted)] = _reduced(values, reduction) if reduction else values
    known = (*variables.names(run, over_time=False), *numbers) if missing else ()
    return Outcome(index=index, status=status, variables=found, missing=tuple(missing), known=known)


def _variable(run: xr.Dataset | xr.DataTree, name: str) -> xr.DataArray | None:
    """A variable of a run by its full name, its dimensions safe to stand beside those of other parts; or None."""
    if name in run.data_vars and "." not in name:
        return run.data_vars[name]
    try:
        found = variables.get(run, name)
    except InputError:
        return None
    if found.dims == ("time",) and name == "time":
        return None
    part = variables.owner(name)
    bare_names = {dim: str(dim).removeprefix(f"{part}.") for dim in found.dims if dim not in variables.SHARED}
    found = found.rename({dim: stored_name(f"{part}.{bare}") for dim, bare in bare_names.items()})
    text = found.attrs.get("long_name", "")
    found.attrs = {**found.attrs, "long_name": f"{name}: {text}" if text else name}
    return found


def check_names(keep: Sequence[str], run: xr.Dataset | xr.DataTree) -> None:
    """Refuse names of `keep` that a run will not have.

    Parameters
    ----------
    keep : names; a word alone may be a statistic, of which the run itself decides
    run : the results at the start

    Raises
    ------
    InputError
        The sentence names the nearest variable.
    """
    for wanted in keep:
        name, reduction = split(wanted)
        if wanted == name and not re.search(r"[.\[]", wanted) and wanted not in variables.parts(run):
            continue
        head, _, last = name.rpartition(".")
        if not reduction and head and _variable(run, name) is None and _variable(run, head) is not None:
            raise InputError(f"keep holds {wanted!r}; after the variable, {nearest(last, REDUCTIONS)}")
        try:
            found = variables.get(run, name)
        except InputError as error:
            raise InputError(f"keep holds {wanted!r}; {error}") from None
        if reduction and "time" not in found.dims:
            raise InputError(f"keep holds {wanted!r}, but {name!r} has no time to reduce; write {name!r}")


def _numbers(run: xr.Dataset | xr.DataTree) -> dict[str, float]:
    """Scalar attributes and statistics of a run."""
    statistics = json.loads(run.attrs.get("statistics", "{}"))
    found = {name: value for name, value in run.attrs.items() if name not in (*_CLOCKS, "statistics")} | statistics
    numbers = {}
    for name, value in found.items():
        is_number = isinstance(value, (int, float, np.number)) and not isinstance(value, bool)
        if (is_number or (value is None and name in statistics)) and name not in run.variables:
            numbers[str(name)] = np.nan if value is None else float(value)
    return numbers


def _number(name: str, value: float) -> xr.DataArray:
    return xr.DataArray(value, attrs={"long_name": name.replace("_", " ")})


def _reduced(values: xr.DataArray, reduction: str) -> xr.DataArray:
    """`values` over time in one value."""
    ordered = values.transpose("time", ...)
    reduced = ordered.isel(time=0, drop=True).copy(data=REDUCTIONS[reduction](ordered.values))
    reduced.attrs = {**values.attrs, "long_name": f"{values.attrs.get('long_name', values.name)}, {_HOW[reduction]}"}
    return reduced


def check_kept(outcomes: Sequence[Outcome]) -> None:
    """Refuse names of `keep` that none of the first runs has.

    Raises
    ------
    InputError
        If such a name is found.
    """
    runs = [o for o in outcomes if o.status != "failed"]
    for name in runs[0].missing if runs else ():
        if all(name in o.missing for o in runs):
            variable, reduction = split(name)
            if reduction and variable in runs[0].known:
                raise InputError(f"keep holds {name!r}, but {variable!r} has no time to reduce; write {variable!r}")
            raise InputError(f"keep holds {name!r}, which no run has; {nearest(variable, runs[0].known)}")


# ------------------------------------------------------------------------------------------------ tables


@dataclasses.dataclass(frozen=True, kw_only=True)
class Column:
    """One variable of many cases.

    Attributes
    ----------
    dims : tuple of str, of one case's values
    attrs : mapping, units and name
    values : (n, ...) float, complex or str; what a case lacks, or has less of, is NaN or ''
    first : int, the lowest case that has it
    """

    dims: tuple[str, ...]
    attrs: Mapping[str, str]
    values: np.ndarray
    first: int


@dataclasses.dataclass(frozen=True, kw_only=True)
class Coordinate:
    """Coordinate of a dimension, of the case that has most of it; `common` if that of all others is its beginning."""

    attrs: Mapping[str, str]
    values: np.ndarray
    common: bool


@dataclasses.dataclass(frozen=True, kw_only=True)
class Table:
    """What is kept of many cases, a row each."""

    cases: tuple[int, ...] = ()
    status: tuple[str, ...] = ()
    reason: tuple[str, ...] = ()
    columns: Mapping[str, Column] = dataclasses.field(default_factory=dict)
    coordinates: Mapping[str, Coordinate] = dataclasses.field(default_factory=dict)


def table(outcomes: Sequence[Outcome]) -> Table:
    """A row for each outcome."""
    return join([_row(one) for one in outcomes])


def _row(one: Outcome) -> Table:
    columns, coordinates = {}, {}
    for name, variable in one.variables.items():
        dims = tuple(map(str, variable.dims))
        values = _plain(variable.values)[np.newaxis]
        columns[name] = Column(dims=dims, attrs=_attrs(variable), values=values, first=one.index)
        for dim in dims:
            if dim in variable.coords:
                along = variable.coords[dim]
                at = along.values if along.values.dtype.kind in "biuf" else along.values.astype(str)
                coordinates[dim] = Coordinate(attrs=_attrs(along), values=at, common=True)
    rows = {"cases": (one.index,), "status": (one.status,), "reason": (one.reason,)}
    return Table(**rows, columns=columns, coordinates=coordinates)  # type: ignore[arg-type]


def _attrs(variable: xr.DataArray) -> dict[str, str]:
    return {name: str(variable.attrs[name]) for name in ("units", "long_name") if name in variable.attrs}


def _plain(values: np.ndarray) -> np.ndarray:
    """Numbers as float or complex, everything else as text."""
    if values.dtype.kind == "c":
        return values.astype(complex)
    return values.astype(float) if values.dtype.kind in "biuf" else values.astype(str)


def join(tables: Sequence[Table]) -> Table:
    """Rows of all tables, in the order of the cases; the same whatever the cases were split into."""
    cases = np.array([case for t in tables for case in t.cases], dtype=int)
    order = np.argsort(cases, kind="stable")
    rows = np.split(np.argsort(order), np.cumsum([len(t.cases) for t in tables])[:-1]) if tables else []
    status = [s for t in tables for s in t.status]
    reason = [r for t in tables for r in t.reason]
    return Table(
        cases=tuple(cases[order].tolist()),
        status=tuple(status[k] for k in order),
        reason=tuple(reason[k] for k in order),
        columns={name: _join_columns(name, tables, rows) for name in sorted({n for t in tables for n in t.columns})},
        coordinates={
            dim: _join_coordinates([t.coordinates[dim] for t in tables if dim in t.coordinates])
            for dim in sorted({d for t in tables for d in t.coordinates})
        },
    )


def _join_columns(name: str, tables: Sequence[Table], rows: Sequence[np.ndarray]) -> Column:
    own = [(t.columns[name], at) for t, at in zip(tables, rows, strict=True) if name in t.columns]
    lead = min((column for column, _ in own), key=lambda column: column.first)
    for column, _ in own:
        if column.dims != lead.dims or (column.values.dtype.kind == "U") != (lead.values.dtype.kind == "U"):
            raise EvolventError(
                f"the variable {name!r} has the dimensions {lead.dims} in case {lead.first}, but {column.dims} in case "
                f"{column.first}; leave it out of 'keep', or sweep such cases separately"
            )
    shape = tuple(np.max([column.values.shape[1:] for column, _ in own], axis=0)) if lead.dims else ()
    kind = np.result_type(*(column.values.dtype for column, _ in own))
    empty = "" if kind.kind == "U" else np.nan
    values = np.full((sum(at.size for at in rows), *map(int, shape)), empty, dtype=kind)
    for column, at in own:
        place: Any = (at, *(slice(size) for size in column.values.shape[1:]))
        values[place] = column.values
    return Column(dims=lead.dims, attrs=lead.attrs, values=values, first=lead.first)


def _join_coordinates(own: Sequence[Coordinate]) -> Coordinate:
    longest = max(own, key=lambda one: one.values.size)
    common = all(one.common and np.array_equal(one.values, longest.values[: one.values.size]) for one in own)
    return dataclasses.replace(longest, common=common)


# ------------------------------------------------------------------------------------------------ bytes


def encode(rows: Table) -> bytes:
    """A table as the bytes of an NPZ file without pickles."""
    head = {
        "cases": rows.cases,
        "status": rows.status,
        "reason": rows.reason,
        "columns": [(name, c.dims, dict(c.attrs), c.first) for name, c in rows.columns.items()],
        "coordinates": [(dim, dict(c.attrs), c.common) for dim, c in rows.coordinates.items()],
    }
    arrays = {f"v{k}": column.values for k, column in enumerate(rows.columns.values())}
    arrays |= {f"c{k}": along.values for k, along in enumerate(rows.coordinates.values())}
    arrays["head"] = np.frombuffer(json.dumps(head).encode(), dtype=np.uint8)
    stream = io.BytesIO()
    np.savez(stream, **arrays)  # type: ignore[arg-type]
    return stream.getvalue()


def decode(content: bytes) -> Table:
    """The table that `encode` wrote."""
    with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
        head = json.loads(arrays["head"].tobytes())
        columns = {
            name: Column(dims=tuple(dims), attrs=attrs, values=arrays[f"v{k}"], first=first)
            for k, (name, dims, attrs, first) in enumerate(head["columns"])
        }
        coordinates = {
            dim: Coordinate(attrs=attrs, values=arrays[f"c{k}"], common=common)
            for k, (dim, attrs, common) in enumerate(head["coordinates"])
        }
    rows = {name: tuple(head[name]) for name in ("cases", "status", "reason")}
    return Table(**rows, columns=columns, coordinates=coordinates)
