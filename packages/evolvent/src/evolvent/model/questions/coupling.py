"""What records tie together."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from evolvent.model.questions.base import Array, Call, End, Records


@dataclasses.dataclass(frozen=True)
class Coupling:
    """How a family's records couple their ends, asked for the graph of the matrix and for what acts from outside.

    Attributes
    ----------
    through : whether its records act through those of others, whose ends theirs are
    within : whether it acts within one body: what holds its axis takes its torque across that, but nothing is tied
    couples : function of a record and `Records` to the groups of ends that are coupled with one another in the matrix
        of an implicit method; None where all ends of a record are
    touches : function of the model to groups of ends that are coupled by what touches at present
    layered : mask of the records by which that changes in a run
    always : whether the matrix follows that under all implicit methods, else under energy-momentum alone
    at_times : whether its records act at times, which `equations.implicit.is_isolated` asks of their field `outside`, 1
        where an end is no free body. Records of other families count as acting at all times
    ties : compiled: whether a record that acts at times now ties the system to what is not part of it, or acts from
        outside
    """

    through: bool = False
    within: bool = False
    couples: Callable[[Any, Records], Iterator[Iterable[End]]] | None = None
    touches: Callable[[Any], Iterator[Iterable[End]]] | None = None
    layered: Callable[[Array], Array] | None = None
    always: bool = False
    at_times: bool = False
    ties: Call = None
