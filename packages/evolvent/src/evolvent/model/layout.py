"""What records of a family have in the state: accounts at the end of its numbers, switches, and events."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
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
    states : offsets of those that are states of records with accounts, such as frictions and bristles
    order : float, place among the accounts; left out, before those of frictions of contacts, which are states
    """

    counts: Counts
    field: str = "account"
    start: str = ""
    states: tuple[int, ...] = ()
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
    """Events of a family's records that solvers find: an event fires where its value rises through zero.

    Attributes
    ----------
    count : function of the records to their number
    what : function of the records and the number of an event to its record and what happens
    order : float, place among the events; those that are watched stand together
    values, fire : functions of `evolvent.kernels.calls`: values of all of them in a state, and what one does there
        (`kernels.watches`); None of threads, whose events change what moves (`equations.events`)
    is_watched : whether implicit methods find them as explicit ones do; else the family finds them in a step itself
    stops : mask of those that stop a run; None for none
    switches : function of the records to the switches that the events set; None where there are none
    """

    count: Callable[[Array], int]
    what: Callable[[Array, int], tuple[int, str]]
    order: float = 1.5
    values: Any = None
    fire: Any = None
    is_watched: bool = True
    stops: Callable[[Array], Array] | None = None
    switches: Callable[[Array], Array] | None = None
