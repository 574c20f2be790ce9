"""Tables for a spreadsheet: one header line with units; points and commas, or decimal commas and semicolons."""

from __future__ import annotations

import csv
import itertools
import math
import os
import re
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent import cases
from evolvent.exports.request import DECIMALS, Request, about, motion_of, samples_text, shown_size, size_of
from evolvent.results import happened, unfinished, variables
from evolvent_base.errors import visible
from evolvent_base.figures import Quantity
from evolvent_base.files import make_folder, writing

if TYPE_CHECKING:
    import xarray as xr

    from evolvent.results.motion import Motion
    from evolvent_base.figures import Number

#: Columns of one variable above which it has its own table.
WIDE = 12
#: Moments whose shapes are written unless more are asked for.
MOST_SHAPES = 200
#: Rows that a spreadsheet shows.
SHEET = 1_048_576
#: First characters of formulas, and what is none: a number, and one with a unit.
_FORMULA, _QUANTITY = (
    ("=", "+", "-", "@", "\t", "\n"),
    re.compile(r"[-+]\d[\d.]*(e[-+]?\d+)?( [A-Za-z%][A-Za-z\d/^ ]*)?"),
)
#: Bytes of one number.
_CELL = 19


def write(run: Any, path: str, request: Request) -> str:
    """Write tables of a run into a folder; returns what was written.

    Notes
    -----
    ``series.csv``
        All that has a few values at every sample, one row a sample.
    ``shapes.csv``
        Where every point is, and what is known there: one row a point and moment, inertial axes.
    ``bodies.csv``
        Position and attitude of every body: one row a body and moment, inertial axes.
    ``NAME.csv``
        Other variables with many values at every sample (all that `shapes.csv` does not hold), one row a sample.
    ``events.csv``
        What happened in the run: one row each, in order of time.
    ``results.csv``
        Single values: one row each, a number with its unit and meaning; the sentences of the screen are texts.
    ``columns.csv``, ``about.csv``
        What the columns mean; where the run comes from, how it ended, and its case.

    Raises
    ------
    InputError
        If the folder cannot be written into, or it would hold far too much.
    """
    count = run.sizes["time"]
    rows = request.samples(run)
    moments = request.samples(run, most=MOST_SHAPES)
    motion = motion_of(run).at(moments)
    numbers = cases.presenter(run).numbers(run)
    run = variables.flat(run)
    held = _moving_variables(run, motion)
    narrow, wide = [], []
    for name, variable in run.variables.items():
        if variable.dims[:1] == ("time",) and name != "time" and variable.dtype.kind in "biuf":
            columns = variable.size // variable.sizes["time"]
            if columns <= WIDE:
                narrow.append(str(name))
            elif name not in held:
                wide.append(str(name))
    points = sum(line.points.shape[1] for line in motion.lines)
    points += sum(surface.points.shape[1] for surface in motion.surfaces)
    values = len(_value_names(motion))
    cells = moments.size * points * (6 + values)
    cells += sum(int(run[name].size) * rows.size // count for name in (*narrow, *wide))
    request.allow(_CELL * cells, "these tables")
    make_folder(path)
    label = unfinished(run)
    tables: dict[str, Iterable[Iterable[Any]]] = {"series.csv": _series(run, narrow, rows, label)}
    tables["shapes.csv"] = _shapes(motion)
    tables |= {"bodies.csv": _bodies(motion)} if motion.frames else {}
    tables |= {f"{name}.csv": _series(run, [name], rows, label) for name in wide}
    events = happened.events_of(run)
    if events.sizes["event"]:
        tables["events.csv"] = _events(events)
    tables["results.csv"] = _results(run, numbers)
    tables["columns.csv"] = _columns(run, [*narrow, *wide], motion)
    tables["about.csv"] = [("what", "text"), *about(run), ("case", run.attrs["case"])]
    for name, content in tables.items():
        with (
            writing(os.path.join(path, name)) as temporary,
            # a spreadsheet recognizes UTF-8 by its mark
            open(temporary, "w", encoding="utf-8-sig", newline="") as file,
        ):
            writer = csv.writer(file, delimiter=DECIMALS[request.decimal])
            writer.writerows([_cell(value, request.decimal) for value in row] for row in content)
    summary = f"{', '.join(tables)} in {path}: {samples_text(rows, count)}, shapes at {moments.size}"
    if moments.size * points >= SHEET:
        summary += f" (shapes.csv has {moments.size * points:,} rows; a spreadsheet shows {SHEET:,}, so lower --frames)"
    return f"{summary}, {shown_size(size_of(path))}"


def _moving_variables(run: Any, motion: Motion) -> set[str]:
    """Variables that `shapes.csv` holds."""
    names = {value.partition(" [")[0].replace(" ", "_") for s in motion.lines for value in s.values}
    held = {"position"}
    for full in map(str, run.variables):
        own = full.rpartition(".")[2]
        if own == "line" or own.removeprefix("line_") in names:
            held.add(full)
    return held


def unit_of(variable: xr.Variable | xr.DataArray) -> str:
    """Unit in brackets, '' for a plain number."""
    unit = variable.attrs.get("units", "")
    return "" if unit in ("", "1") else f" [{unit}]"


def _headings(run: Any, name: str) -> list[str]:
    """Headings of a variable's columns: its name, what the column belongs to, its unit."""
    variable = run[name]
    places = []
    for dimension in variable.dims[1:]:
        size = run.sizes[dimension]
        listed = run[dimension].values if dimension in run.coords else np.arange(1, size + 1)
        if dimension == "quaternion" and dimension not in run.coords:
            listed = np.array(list("wxyz"))
        word = "" if listed.dtype.kind in "UO" else f"{dimension} "
        places.append([f"{word}{x:g}" if listed.dtype.kind == "f" else f"{word}{x}" for x in listed])
    return [f"{' '.join((name, *place))}{unit_of(variable)}" for place in itertools.product(*places)]


def _series(run: Any, names: list[str], rows: np.ndarray, label: str) -> Iterator[Iterable[Any]]:
    head = ["time [s]", *(heading for name in names for heading in _headings(run, name))]
    yield [*head, "run status"] if label else head
    blocks = [run[name].values[rows].reshape(rows.size, -1) for name in names]
    for k, time in enumerate(run.time.values[rows]):
        row = [_number(time), *(_number(x) for block in blocks for x in block[k])]
        yield [*row, label] if label else row


def _value_names(motion: Motion) -> list[str]:
    """Labels of what is known at points of lines, and in the elements of surfaces."""
    return motion.labels


def _shapes(motion: Motion) -> Iterator[Iterable[Any]]:
    """Points of lines and surfaces; values of surfaces are means of the elements around a point."""
    names = _value_names(motion)
    yield ["time [s]", "line", "point", "x [m]", "y [m]", "z [m]", *names]
    for k, time in enumerate(motion.time):
        for line in motion.lines:
            values = [line.values[name][k] if name in line.values else None for name in names]
            for i, x in enumerate(line.points[k]):
                data = ("" if v is None else _number(v[i]) for v in values)
                yield [_number(time), line.name, i + 1, *map(_number, x), *data]
        for surface in motion.surfaces:
            means = {name: surface.at_points(values[k]) for name, values in surface.values.items()}
            for i, x in enumerate(surface.points[k]):
                data = (_number(means[name][i]) if name in means else "" for name in names)
                yield [_number(time), surface.name, i + 1, *map(_number, x), *data]


def _bodies(motion: Motion) -> Iterator[Iterable[Any]]:
    yield ["time [s]", "body", "x [m]", "y [m]", "z [m]", *(f"quaternion {c}" for c in "wxyz")]
    for k, time in enumerate(motion.time):
        for frame in motion.frames:
            yield [_number(time), frame.name, *map(_number, frame.origin[k]), *map(_number, frame.attitude[k])]


def _number(x: Any) -> Any:
    """A value that is written as the shortest text that gives the same number; an empty cell for none."""
    if isinstance(x, np.bool_):
        return int(x)
    if isinstance(x, np.integer):
        return int(x)
    return float(x) if np.isfinite(x) else ""


def _cell(value: Any, decimal: str = ".") -> Any:
    """A number as it is; a text that a spreadsheet would take for a formula with an apostrophe before it."""
    if isinstance(value, float) and decimal != ".":
        return repr(value).replace(".", decimal)
    if not isinstance(value, str):
        return value
    text = visible(value)
    return f"'{text}" if text.startswith(_FORMULA) and not _QUANTITY.fullmatch(text) else text


def _results(run: Any, numbers: Iterable[Number]) -> Iterator[Iterable[Any]]:
    yield ["name", "value", "unit", "text", "meaning"]
    for label, value, unit, text in result_rows(numbers):
        yield [label, _number(value), unit, text, "as evolvent info prints it" if text else ""]
    for name, variable in run.data_vars.items():
        if "time" in variable.dims or variable.dtype.kind not in "biuf":
            continue
        attrs = variable.attrs
        unit = attrs.get("units", "")
        headings = _headings(run, str(name)) if not variable.dims else _entries(run, str(name))
        for heading, value in zip(headings, variable.values.ravel(), strict=True):
            yield [heading.removesuffix(unit_of(variable)), _number(value), unit, "", attrs.get("long_name", "")]


def _events(events: xr.Dataset) -> Iterator[Iterable[Any]]:
    yield ["time [s]", "part", "what"]
    for time, part, what in zip(events.time.values, events.part.values, events.what.values, strict=True):
        yield [_number(time), str(part), str(what)]


def result_rows(numbers: Iterable[Number]) -> Iterator[tuple[str, float, str, str]]:
    """Name, value (NaN for none), unit and text of results: the text in the first row, a row for each more number."""
    for number in numbers:
        own = next((one for one in number.quantities if not one.what), Quantity(math.nan, ""))
        yield number.label, own.value, own.unit, number.value
        for one in number.quantities:
            if one.what:
                yield f"{number.label}: {one.what}", one.value, one.unit, ""


def _entries(run: Any, name: str) -> list[str]:
    """Headings of a variable without time."""
    return _headings(run.assign({name: run[name].expand_dims("once")}), name)


def _columns(run: Any, names: list[str], motion: Motion) -> Iterator[Iterable[Any]]:
    yield ["name", "unit", "columns", "meaning"]
    yield ["time", "s", 1, "time"]
    for name in names:
        attrs = run[name].attrs
        columns = run[name].size // run.sizes["time"]
        yield [name, attrs.get("units", ""), columns, attrs.get("long_name", "")]
    for number in _value_names(motion):
        name, _, unit = number.partition(" [")
        yield [f"shapes: {name}", unit.rstrip("]"), 1, "at the point"]
    yield ["shapes: x, y, z", "m", 3, "position of the point, inertial axes"]
    yield ["bodies: x, y, z", "m", 3, "origin of the body, inertial axes"]
    yield ["bodies: quaternion", "", 4, "from body to inertial axes, scalar part first"]
