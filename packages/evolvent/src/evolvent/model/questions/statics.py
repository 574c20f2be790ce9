"""Equilibria and steady turns."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from evolvent.model.questions.base import Array, Call


def never(turn: Any, rows: list[int]) -> Iterator[int]:
    """No record, as `Statics.uneven`."""
    return iter(())


@dataclasses.dataclass(frozen=True)
class Statics:
    """What a family's records are at rest or in a steady turn, asked by `solvers.static`.

    Attributes
    ----------
    scale : compiled: (factor, parameters, model): loads at a load factor, by their parameters at factor 1
    at_rest : prepares the records of a model for statics, for which neither rates nor steps before count
    settle : notes in a model the state at rest as that at the end of a step
    acts_on : function of the model, the index of a load, parameters of the model and a time to the family and index on
        which it acts then, if it does
    no_balance : function of the model after its last forces, the time and the state to records that are in no
        equilibrium in spite of their forces, and why, as the end of a sentence
    not_at_rest : function of the model after its first forces to records whose rate changes in statics, and why, as the
        end of a sentence
    uneven : function of a steady turn (`solvers.static.steady_turn.Turn`) and of the records with an end on what does
        not turn, of all without `Family.ends`, to those that are not the same at every angle about its axis; None for
        all of them
    unsteady : function of the model, and whether it is in an orbital frame, to records that do not support that, or a
        steady turn, and a sentence on each, in which `{name}` stands for the part
    frame : of forces on all masses, with a field `scale` each: function of a record to the rate of the frame that turns
        with it, (3,) float, rad/s, inertial axes; None of a law
    memory : function of the model to what storage, statics and modes ask of its viscoelastic records
        (`families.relaxation.family.Memory`)
    sets : function of the model and the index of a viscoelastic record to what deformation it keeps just after all
        stress is released at once: words, largest value, unit
    sets_along : of parts with a length, function as `sets`: words, lengths from the root (n,) float, m, values there
        (n,) float, unit
    """

    scale: Call = None
    at_rest: Callable[[Any], None] | None = None
    settle: Callable[[Any, Array], None] | None = None
    acts_on: Callable[[Any, int, Array, float], tuple[str, int] | None] | None = None
    no_balance: Callable[[Any, float, Array], Iterator[tuple[int, str]]] | None = None
    not_at_rest: Callable[[Any], Iterator[tuple[int, str]]] | None = None
    uneven: Callable[[Any, list[int]], Iterable[int]] | None = None
    unsteady: Callable[[Any, bool], Iterator[tuple[int, str]]] | None = None
    frame: Callable[[Any], Array | None] | None = None
    memory: Callable[[Any], Any] | None = None
    sets: Callable[[Any, int], Iterator[tuple[str, float, str]]] | None = None
    sets_along: Callable[[Any, int], Iterator[tuple[str, Array, Array, str]]] | None = None
