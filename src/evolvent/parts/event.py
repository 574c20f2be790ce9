"""Event that a user defines."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

from evolvent.builder import Builder


@dataclasses.dataclass(frozen=True, kw_only=True)
class Event:
    """A moment to be found: where the law's value rises through zero.

    Parameters
    ----------
    law : function under ``@evolvent.event_law``: ``law(t, y, parameters) -> value``, y the state vector
    parameters : sequence of float
    stops : bool, whether the run ends there
    """

    law: Any
    parameters: Sequence[float] = ()
    stops: bool = False

    def write(self, builder: Builder, name: str) -> None:
        """Write the event into the family `events`."""
        first, last = builder.parameters(self.parameters)
        index = builder.add("events", law=builder.law(self.law, "event"), first=first, last=last, stops=int(self.stops))
        builder.names[name] = ("events", index)
