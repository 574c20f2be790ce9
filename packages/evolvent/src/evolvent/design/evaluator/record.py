"""What is kept of every run, as rows of a table that can be joined, and be written as bytes."""

from __future__ import annotations

import dataclasses
import io
import json
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from evolvent import results
from evolvent.results import variables
from evolvent.results.kept import Kept, number, of_run, reduced, refusal, split, stored_name
from evolvent_base.errors import EvolventError

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
    variables : mapping, name -> xarray.Variable; empty for a failed case
    coordinates : mapping, dimension -> its coordinate
    missing : tuple of str, wanted names that the run does not have
    known : tuple of str, names that it has, where some are missing
    notes : tuple of str, sentences on what was computed again
    """

    index: int
    status: str
    reason: str = ""
    variables: Mapping[str, xr.Variable] = dataclasses.field(default_factory=dict)
    coordinates: Mapping[str, xr.Variable] = dataclasses.field(default_factory=dict)
    missing: tuple[str, ...] = ()
    known: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def outcome(index: int, run: xr.Dataset | xr.DataTree | Kept | Exception, keep: Sequence[str]) -> Outcome:
    """What is kept of a run, or the reason why there is none."""
    if isinstance(run, Exception):
        is_own = isinstance(run, EvolventError)
        reason = " ".join(str(run).split())
        return Outcome(index=index, status="failed", reason=reason if is_own else f"{type(run).__name__}: {reason}")
    status = str(run.attrs["status"])
    if status == "failed":
        return Outcome(index=index, status=status, reason=" ".join(str(run.attrs["message"]).split()))
    if isinstance(run, Kept):
        found = {stored_name(name): values for name, values in run.variables.items()}
        return Outcome(
            index=index, status=status, variables=found, coordinates=run.coordinates, missing=run.missing,
            known=run.known,
        )  # fmt: skip
    return _outcome(index, status, results.regular(run), keep)  # at times that all cases have


def _outcome(index: int, status: str, run: xr.Dataset | xr.DataTree, keep: Sequence[str]) -> Outcome:
    """What is kept of a run that did not fail."""
    numbers = {name: number(name, value) for name, value in _numbers(run).items()}
    found: dict[str, xr.Variable] = {}
    along: dict[str, xr.Variable] = {}
    missing = []
    if not keep:
        found |= numbers
    root = variables.root_dataset(run)
    for wanted in keep or [str(name) for name, values in root.data_vars.items() if "time" not in values.dims]:
        name, reduction = split(wanted) if keep else (wanted, "")
        own = (numbers[name], {}) if name in numbers else of_run(run, name)
        if own is None or (reduction and "time" not in own[0].dims):
            missing.append(wanted)
            continue
        values = (
            reduced(own[0], reduction, name, root["time"].values) if reduction else variables.without_extremes(own[0])
        )
        found[stored_name(wanted) if keep else wanted] = values
        along |= {dim: one for dim, one in own[1].items() if dim in values.dims}
    known = (*variables.names(run, over_time=False), *numbers) if missing else ()
    return Outcome(
        index=index, status=status, variables=found, coordinates=along, missing=tuple(missing), known=known
    )  # fmt: skip


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
            raise refusal(name, runs[0].known)


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
class CaseTable:
    """What is kept of many cases, a row each."""

    cases: tuple[int, ...] = ()
    status: tuple[str, ...] = ()
    reason: tuple[str, ...] = ()
    columns: Mapping[str, Column] = dataclasses.field(default_factory=dict)
    coordinates: Mapping[str, Coordinate] = dataclasses.field(default_factory=dict)


class CaseRow(NamedTuple):
    """One case of a table."""

    table: CaseTable
    place: int

    @property
    def status(self) -> str:
        """How its run ended."""
        return self.table.status[self.place]

    @property
    def reason(self) -> str:
        """Why it failed; else empty."""
        return self.table.reason[self.place]

    def values(self, name: str) -> np.ndarray | None:
        """Values of a variable; None where no case of the table has it."""
        column = self.table.columns.get(name)
        return None if column is None else np.asarray(column.values[self.place])


def table(outcomes: Sequence[Outcome]) -> CaseTable:
    """A row for each outcome."""
    return join([_row(one) for one in outcomes])


def _row(one: Outcome) -> CaseTable:
    columns, coordinates = {}, {}
    for name, variable in one.variables.items():
        dims = tuple(map(str, variable.dims))
        values = _plain(variable.values)[np.newaxis]
        columns[name] = Column(dims=dims, attrs=_attrs(variable), values=values, first=one.index)
        for dim in dims:
            if dim in one.coordinates:
                along = one.coordinates[dim]
                at = along.values if along.values.dtype.kind in "biuf" else along.values.astype(str)
                coordinates[dim] = Coordinate(attrs=_attrs(along), values=at, common=True)
    rows = {"cases": (one.index,), "status": (one.status,), "reason": (one.reason,)}
    return CaseTable(**rows, columns=columns, coordinates=coordinates)  # type: ignore[arg-type]


def _attrs(variable: xr.Variable) -> dict[str, str]:
    return {name: str(variable.attrs[name]) for name in ("units", "long_name") if name in variable.attrs}


def _plain(values: np.ndarray) -> np.ndarray:
    """Numbers as float or complex, everything else as text."""
    if values.dtype.kind == "c":
        return values.astype(complex)
    return values.astype(float) if values.dtype.kind in "biuf" else values.astype(str)


def join(tables: Sequence[CaseTable]) -> CaseTable:
    """Rows of all tables, in the order of the cases; the same whatever the cases were split into."""
    cases = np.array([case for t in tables for case in t.cases], dtype=int)
    order = np.argsort(cases, kind="stable")
    rows = np.split(np.argsort(order), np.cumsum([len(t.cases) for t in tables])[:-1]) if tables else []
    status = [s for t in tables for s in t.status]
    reason = [r for t in tables for r in t.reason]
    return CaseTable(
        cases=tuple(cases[order].tolist()),
        status=tuple(status[k] for k in order),
        reason=tuple(reason[k] for k in order),
        columns={name: _join_columns(name, tables, rows) for name in sorted({n for t in tables for n in t.columns})},
        coordinates={
            dim: _join_coordinates([t.coordinates[dim] for t in tables if dim in t.coordinates])
            for dim in sorted({d for t in tables for d in t.coordinates})
        },
    )


def _join_columns(name: str, tables: Sequence[CaseTable], rows: Sequence[np.ndarray]) -> Column:
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


def encode(rows: CaseTable) -> bytes:
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


def decode(content: bytes) -> CaseTable:
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
    return CaseTable(**rows, columns=columns, coordinates=coordinates)
