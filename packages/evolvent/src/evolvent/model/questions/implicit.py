"""Steps of implicit methods."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

from evolvent.model.questions.base import Array, Call


@dataclasses.dataclass(frozen=True)
class Implicit:
    """What steps of implicit methods begin with, iterate on and leave behind, asked by `solvers.time.implicit`.

    Attributes
    ----------
    start : compiled: start of a run, before its first forces
    end_step : compiled: end of a step that has been taken: what the next one needs of it, and into `Interval.powers`
        the work and the losses that the family books itself (J, `evolvent.model.powers`)
    contact_set : compiled: goes on with a number that encodes which records touch or slip, and in which sense
    inner : function of its records to how many inner unknowns they need in the matrix
    taut : function of its records to those so stiff that little lengths are large forces
    forget : function of a model whose records forget the steps before, as at the start of a run
    """

    start: Call = None
    end_step: Call = None
    contact_set: Call = None
    inner: Callable[[Array], int] | None = None
    taut: Callable[[Array], Array] | None = None
    forget: Callable[[Any], None] | None = None
