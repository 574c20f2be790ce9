"""A measured line of a spring: tension over extension, as a law that the stack machine of expressions evaluates."""

from __future__ import annotations

import itertools
import os
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator

from evolvent.assembly.builder import Builder
from evolvent.kernels import expression as run
from evolvent.parts import table_file
from evolvent.parts.profile import table_rows
from evolvent_base import tables, units
from evolvent_base.errors import InputError
from evolvent_base.file_keys import FileKey


def _rows(value: Any) -> Any:
    rows = table_file.rows_of(os.fspath(value)) if isinstance(value, (str, os.PathLike)) else value
    return table_rows(rows, "[extension, tension]")


ForceTable = Annotated[
    tuple[tuple[units.Coordinate, units.Force], ...],
    BeforeValidator(_rows),
    FileKey(endings=tables.ENDINGS, rows=table_file.rows_of),
]


def write_table(builder: Builder, name: str, rows: ForceTable, damping: float) -> dict[str, int]:
    """Store the line of a spring and its damping (N s/m) as a law; returns the row's fields law, first and last.

    Raises
    ------
    InputError
        Unless extensions rise.
    """
    x, force = (np.array(column, dtype=float) for column in zip(*rows, strict=True))
    down = np.flatnonzero(np.diff(x) <= 0.0)
    if down.size:
        k = int(down[0]) + 1
        raise InputError(f"{name}.table: row {k + 1} is at {x[k]:.9g} m, not above the row before, at {x[k - 1]:.9g} m")
    code = _program(x.tolist(), force.tolist(), damping)
    text = f"the table of {name!r}"
    return builder.expression(run.spring_expression, "spring", code, text, run.scalar_expression_slope)


def _program(x: list[float], force: list[float], damping: float) -> list[float]:
    """A program of x and v: straight lines between rows, each times 0 or 1, the tension of the ends beyond them."""
    extension, rate = (run.VARIABLE, 0.0), (run.VARIABLE, 1.0)

    def compared(at: float, instruction: int) -> tuple[float, ...]:
        return (*extension, run.CONSTANT, at, instruction)

    def times(value: float) -> tuple[float, ...]:
        return (run.CONSTANT, value, run.MULTIPLY)

    found = [*compared(x[0], run.LESS), *times(force[0])]
    for k, (low, high) in enumerate(itertools.pairwise(x)):
        inside = (*compared(low, run.GREATER_EQUAL), *compared(high, run.LESS), run.MULTIPLY)
        slope = (force[k + 1] - force[k]) / (high - low)
        line = (*extension, run.CONSTANT, low, run.SUBTRACT, *times(slope), run.CONSTANT, force[k], run.ADD)
        found += [*inside, *line, run.MULTIPLY, run.ADD]
    found += [*compared(x[-1], run.GREATER_EQUAL), *times(force[-1]), run.ADD]
    found += [*rate, *times(damping), run.ADD]
    return [float(len(found)), *map(float, found)]
