"""Events by which the number of moving nodes changes, as where a thread leaves its spool."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from evolvent.model.questions.base import Call


class Equations(NamedTuple):
    """Functions of the equations of explicit methods, for what carries out events (`NodeEvents.between_steps`).

    Attributes
    ----------
    event_values, apply_event, rhs : of `evolvent.equations.events` and `evolvent.equations.rhs`
    load : function of a model and of such functions, which loads them
    """

    event_values: Callable[..., None]
    apply_event: Callable[..., int]
    rhs: Callable[..., None]
    load: Callable[..., None]


@dataclasses.dataclass(frozen=True)
class NodeEvents:
    """Events by which what moves in a family's records changes (`Model.info.releases`), which explicit methods find.

    Attributes
    ----------
    values : compiled: values of these events, into those of all, in the order of `Events.order`; one fires where its
        value is not negative
    apply : compiled: carries out an event: 1 where the run is to stop there, 0, -1 where it cannot be carried out, 2
        where it is another family's; the values of those that are carried out with it become infinite
    project : compiled: brings the coordinates of records back onto their constraints
    longest_step : compiled: until records need the end of a step, s
    until : compiled: part of a step of implicit methods, (length, y at its start and its end, s), at which the first of
        the events falls
    is_due : compiled: whether one is due in a state
    between_steps : function of the assembly and `Equations` to what carries out the events between the steps of
        implicit methods; see `families.threads.family_releases.Releases`
    captures : function of a solution to events that bring something to rest: record, time and duration, s, and what
        the record does
    """

    values: Call = None
    apply: Call = None
    project: Call = None
    longest_step: Call = None
    until: Call = None
    is_due: Call = None
    between_steps: Callable[[Any, Equations], Any] | None = None
    captures: Callable[[Any], Iterator[tuple[int, float, float, str]]] | None = None
