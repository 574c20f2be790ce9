"""Users' laws that records call."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from evolvent.model.questions.base import Array, Moment

#: Kinds of laws that are no forces: of time alone, and values whose zeros are events.
DRIVE, EVENT = "drive", "event"


@dataclasses.dataclass(frozen=True)
class Law:
    """A user's law that some records of a family call.

    Attributes
    ----------
    kind : str, of `compiled.laws.FORMS`; one of time alone is a `DRIVE`
    which : function of the records to a mask of those that call one
    arguments : function of the model, the index of a record and a moment to the arguments of each call, but for the
        parameters, after `kernels.impulse.prepare`; with True as the fourth argument at all places, else at one of
        them; not asked of a drive
    field : str, of the record, with the number of the law
    before : str, of the fields `first` and `last` with the range of the law's parameters
    room : function of a record to how many values the law writes into its last argument, of kind "element"
    stated : str, field of the record that notes whether the law gives an energy or a power, of kind "element"
    as_left : whether it is called where the last evaluation of the forces has put it, not at the state of a moment
    """

    kind: str
    which: Callable[[Array], Array]
    arguments: Callable[[Any, int, Moment, bool], Iterator[tuple[Any, ...]]] | None = None
    field: str = "law"
    before: str = ""
    room: Callable[[Any], int] | None = None
    stated: str = ""
    as_left: bool = False

    @property
    def is_of_time(self) -> bool:
        """Whether it is a function of time alone."""
        return self.kind == DRIVE

    @property
    def is_force(self) -> bool:
        """Whether its values are forces."""
        return self.kind not in (DRIVE, EVENT)


def calls_law(found: Array) -> Array:
    """Which records have a law in the field `law`: (n,) bool."""
    return np.asarray(found["law"] != 0)
