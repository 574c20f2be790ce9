"""What drives and loads move in a run, and where they stand at a time."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

from evolvent.model.questions.base import Array


@dataclasses.dataclass(frozen=True)
class Drives:
    """Drives and loads of a family's records over a run and at one time, asked by `solvers.common.standing` and runs.

    Attributes
    ----------
    check : function of the assembly and of times over a run up to its end, s, which refuses drives that leave what
        its parts have
    stops : function of the model and of the start and the end of a run to times, s, beside those of the model
        (`breaks`), at which forces change or events fall due
    paid_out : function of the model, and of a function of a record to the largest rate of its drive in a run, to the
        kinetic energy of what drives pay out, J
    stand : lets what a drive moves stand where it is at a time
    end_ramps : lets the records of a model act as after their ramps
    freeze : function of the model and a time to the model in which what its drives change the length of has that of the
        time
    place : function of the assembly, a time, the state, the switches and whether the state is given, which sets in
        them for statics what follows from the drives then; nodes of a given state stay where they are
    hold : function of a time, the state, the switches and the model, in which constraints hold as they do then
    """

    check: Callable[[Any, Array], None] | None = None
    stops: Callable[[Any, float, float], Array] | None = None
    paid_out: Callable[[Any, Callable[[Any], float]], float] | None = None
    stand: Callable[[Any, float], None] | None = None
    end_ramps: Callable[[Any], None] | None = None
    freeze: Callable[[Any, float], Any] | None = None
    place: Callable[[Any, float, Array, Array, bool], None] | None = None
    hold: Callable[[float, Array, Array, Any], None] | None = None
