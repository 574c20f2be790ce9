"""Friction that sticks and slips."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator

from evolvent.model.questions.base import Array, Call


@dataclasses.dataclass(frozen=True)
class Friction:
    """Friction of a family's records.

    Attributes
    ----------
    rubs : function of its records to those with friction that slips under explicit methods; None for none. Statics take
        that of `Contacts` by displacements
    until_turn : compiled: part of a step at which a friction turns back (`kernels.turning`), asked of families some
        records of which rub, or without an answer to that
    measure_rates : compiled: rates of the state at the end of a step, before `until_turn`
    keep_rates : compiled: these are the rates at the start of the next step
    power : compiled: power of all frictions at the last evaluation, W
    end : compiled: under explicit methods, frictions at the end of a step into the accounts; returns what they take, J
    change : compiled: largest change of its frictions by multipliers since the last call, beside their limits
    rubbed : function of its records to indices of the state, what friction has taken in an explicit run
    """

    rubs: Callable[[Array], Array] | None = None
    until_turn: Call = None
    measure_rates: Call = None
    keep_rates: Call = None
    power: Call = None
    end: Call = None
    change: Call = None
    rubbed: Callable[[Array], Iterator[Array]] | None = None
