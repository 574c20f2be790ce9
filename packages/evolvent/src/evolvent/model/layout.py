"""What records of a family have in the state: accounts at the end of its numbers, switches, and events."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

Array = np.ndarray
#: An event that is always due (`Events.due`) fires from this value on: of a node on its spool, the part of a segment.
DUE = -1e-10
#: What happens where a latch locks.
LATCHED = "latched"
#: Count of each record: one for all, or a function of the records to (n,) int.
Counts = int | Callable[[Array], Array]


def counted(counts: Counts, found: Array) -> Array:
    """Count of each record: (n,) int."""
    return np.full(found.size, counts) if isinstance(counts, int) else np.asarray(counts(found), dtype=np.int64)


@dataclasses.dataclass(frozen=True)
class Accounts:
    """Numbers of records at the end of the state vector, record by record.

    Attributes
    ----------
    counts : Counts
    field : str, of the record, that gets the index of its first one in the state, -1 without any; '' for none
    start : str, field of the record with the value at the start, of one account each; '' for 0
    order : float, place among the accounts; left out, before those of frictions of contacts, which are states
    """

    counts: Counts
    field: str = "account"
    start: str = ""
    order: float = 7.5


@dataclasses.dataclass(frozen=True)
class Switches:
    """Switches of records.

    Attributes
    ----------
    counts : Counts
    start : function of the records and the builder to what they are at the start, in the order of the switches; 0 if
        left out
    field : str, of the record, that gets the index of its first one, if it has any; '' for none
    order : float, place among the switches
    """

    counts: Counts
    start: Callable[[Array, Any], Any] | None = None
    field: str = "switch"
    order: float = 4.0


@dataclasses.dataclass(frozen=True)
class Events:
    """Events of a family's records that solvers find.

    Attributes
    ----------
    count : function of the records to their number
    what : function of the records and the number of an event to its record and what happens
    order : float, place among the events
    """

    count: Callable[[Array], int]
    what: Callable[[Array, int], tuple[int, str]]
    order: float = 3.0


@dataclasses.dataclass(frozen=True)
class Rows:
    """Rows of constraint of a family's records under explicit methods (`kernels.constraint_rows`).

    Attributes
    ----------
    kind : int, of the rows
    of : function of the records and of those of a family by its name to the record of each row, and its ends
    """

    kind: int
    of: Callable[[Array, Callable[[str], Any]], Iterator[tuple[int, list[tuple[str, int]]]]]
