"""Event that a user defines."""

from __future__ import annotations

from typing import Literal

from evolvent.builder import Builder
from evolvent.parts.base import Part
from evolvent.parts.expression import Constants, EventLaw, Parameters, write_law


class Event(Part):
    """A moment to be found: where the law's value rises through zero.

    Parameters
    ----------
    law : an expression of t (s), or a function under ``@evolvent.event_law``: ``law(t, y, parameters) -> value``, y the
        state vector
    parameters : list of numbers, of a Python law
    constants : mapping of names to numbers, of an expression
    stops : bool, whether the run ends there
    """

    kind: Literal["event"] = "event"
    law: EventLaw
    parameters: Parameters = ()
    constants: Constants | None = None
    stops: bool = False

    def write(self, builder: Builder, name: str) -> None:
        """Write the event into the family `events`."""
        fields = write_law(builder, name, self.law, "event", self.parameters, self.constants)
        builder.names[name] = ("events", builder.add("events", stops=int(self.stops), **fields))
