"""Steps of energy-momentum, whose forces are means over a step."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import ClassVar

from evolvent.model.questions.base import Array, Call


@dataclasses.dataclass(frozen=True)
class Step:
    """Answers over a step of energy-momentum, asked by `equations.energy_momentum` and `energy_step`.

    Attributes
    ----------
    measure : compiled: what a step needs of its start and its end
    force, tangent : compiled: forces over a step and their derivatives, where these are other functions than
        `Family.force` and `Family.tangent`
    inertia, inertia_tangent : compiled: the same of masses, else `Inertia.force` and `Inertia.tangent`
    note : compiled: of records alone, what the next step needs of the last one
    energy : compiled: at the end of a step, of penalties and of what acts on coordinates, J
    longest : compiled: longest step that its records allow at their last rates, s
    rates : compiled: (y, model, rates): rates of its coordinates that are part of the state y, after its step
    means : function of its records to those that act over a step as means of what is no user's law
        (`kernels.law_means`); None for none
    """

    #: Questions of the family that are asked where there is no answer.
    OTHERWISE: ClassVar[Mapping[str, str]] = {
        "force": "force",
        "tangent": "tangent",
        "inertia": "inertia.force",
        "inertia_tangent": "inertia.tangent",
    }

    measure: Call = None
    force: Call = None
    tangent: Call = None
    inertia: Call = None
    inertia_tangent: Call = None
    note: Call = None
    energy: Call = None
    longest: Call = None
    rates: Call = None
    means: Callable[[Array], Array] | None = None
