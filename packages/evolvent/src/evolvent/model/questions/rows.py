"""Rows of constraint."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from typing import Any

from evolvent.model.questions.base import Array, Call

#: Kind of rows of constraint that have a multiplier under all methods.
CONSTRAINT = 1


@dataclasses.dataclass(frozen=True)
class Rows:
    """Rows of constraint of a family's records, asked by the walks over all rows (`evolvent.kernels.constraints`).

    Of the kind `CONSTRAINT` each record has one, in `Model.constraints`. It takes over the fields `stiffness`,
    `damping`, `until`, `latest`, `event` and `switch` that the record has; where there are none, the row is a
    constraint at all times.

    Attributes
    ----------
    of : function of the records and of those of a family by its name to the record of each row that explicit methods
        solve for (`kernels.constraint_rows`), and its ends; left out, all that are no penalties and `Family.ends`
    kind : int, of the rows
    turns : mask of the records whose gap is of directions, without a unit
    drives : those that a drive moves
    couples : those whose force turns with another end, so that ends are coupled with one another
    ends : those to which `end` gives the rows of a step
    alone : those that no other constraint can repeat
    measure : compiled: gap of a row, and its rate
    bend : compiled: second derivative of the gap without accelerations
    force : compiled: generalised forces of the multiplier
    tangent : compiled: gradient as row and column of the matrix, and the multiplier times the second derivatives by
        coordinates
    end : compiled: row of the end of a step
    rates : compiled: what a change of place alone changes in the rate of the gap
    note : compiled: results at a sample, by the multiplier
    """

    of: Callable[[Array, Callable[[str], Any]], Iterator[tuple[int, list[tuple[str, int]]]]] | None = None
    kind: int = CONSTRAINT
    turns: Callable[[Array], Array] | None = None
    drives: Callable[[Array], Array] | None = None
    couples: Callable[[Array], Array] | None = None
    ends: Callable[[Array], Array] | None = None
    alone: Callable[[Array], Array] | None = None
    measure: Call = None
    bend: Call = None
    force: Call = None
    tangent: Call = None
    end: Call = None
    rates: Call = None
    note: Call = None
