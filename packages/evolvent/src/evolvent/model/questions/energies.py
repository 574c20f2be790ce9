"""Energies beside which others are round-off, and those that balances tell apart."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

from evolvent.model.questions.base import Array


@dataclasses.dataclass(frozen=True)
class Energies:
    """Energies of a family's records, asked by sizes, balances and the resolution of modes.

    Attributes
    ----------
    by_causes : whether the accounts of explicit methods tell apart what dissipates energy in a model with its records
    strained : function of the model to energies of which its strain energy is the difference, J
    round_off : function of the model to the energy whose round-off steps do not resolve, J
    coupled : function of a time, the state of an explicit run, its switches, the model and (nv,) scratch to energies of
        its records that differ from those between which `Family.energy` interpolates, J
    bending : function of the model after its last forces and of the state to the strain energy of bending, J
    rebalance : function of the model, times, states, load factors and energy balances to these as they are with what
        solvers leave out of energies
    resists : fields with the length or angle of a record, and with its forces; None of what does not resist by these
    """

    by_causes: bool = False
    strained: Callable[[Any], float] | None = None
    round_off: Callable[[Any], float] | None = None
    bending: Callable[[Any, Array], float] | None = None
    coupled: Callable[[float, Array, Array, Any, Array], float] | None = None
    rebalance: Callable[[Any, Array, Array, Any, Any], Any] | None = None
    resists: tuple[str, ...] | None = None
