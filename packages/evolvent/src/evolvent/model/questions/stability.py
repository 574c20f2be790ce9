"""How long steps of explicit methods may be."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from evolvent.model.questions.base import Array

#: Record, square of a frequency (rad2/s2) and damping rate (1/s) of a mode.
Bound = tuple[int, float, float]


@dataclasses.dataclass(frozen=True)
class Felt:
    """How records answer the stiffness and damping that they feel.

    Attributes
    ----------
    size : int, of the blocks: displacements, then turns, inertial axes
    which : function of the records to a mask of those that move
    answer : function of the model, the index of a record and blocks (2, size, size) of stiffness and damping to these
        times the inverse of its mass matrix
    """

    size: int
    which: Callable[[Array], Array]
    answer: Callable[[Any, int, Array], Array]


@dataclasses.dataclass(frozen=True)
class Stability:
    """How a family's records bound explicit steps, asked by `solvers.time.explicit`.

    Attributes
    ----------
    by_rates : whether explicit methods find its fastest mode from the rates of the whole model
        (`solvers.time.explicit.fastest_modes`), or a function of the model; None stands for those with a force. Those
        whose forces act on coordinates (`Model.F`, `Model.P`), not on bodies and points alone, are always among them
    felt : how its records answer the stiffness and damping that they feel
    bound : function of the model after `kinematics`, the state, and blocks of stiffness and damping that are felt, by
        family (2, n, size, size), to bounds of the fastest modes of its own; it adds to the blocks what its records
        make others feel. Where `Family.stiff` records have none, the fastest mode is found by differences of
        accelerations
    stiffest : makes the records of a model as stiff as they can become, for the fastest mode by rates; what `bound`
        counts, or `solvers.time.explicit.fastest_modes` adds, has no stiffness then
    waves : function of its records, along which waves run far faster than the motion, to the part of the longest stable
        explicit step that is short enough, at most that of the method
    """

    by_rates: bool | Callable[[Any], bool] | None = None
    felt: Felt | None = None
    bound: Callable[[Any, Array, Mapping[str, Array]], Iterator[Bound]] | None = None
    stiffest: Callable[[Any], None] | None = None
    waves: Callable[[Array], float] | None = None
