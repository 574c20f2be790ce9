"""Rates of explicit methods, and the ends of their steps."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import ClassVar

from evolvent.model.questions.base import Call


@dataclasses.dataclass(frozen=True)
class Explicit:
    """Answers for explicit methods alone, asked by `equations.rhs`, `inventory` and `between_steps`. All are compiled.

    Attributes
    ----------
    force : forces in a state, where it is another function than `Family.force`; False for none
    rate : rates of the coordinates of its own that no constraint holds, after all forces
    carried : rates of what bodies carry, by the accelerations of these, and what it does to those that are driven
    end : what needs the accelerations of all
    energy : energy of a state, where forces were not evaluated, where it is another function than `Family.energy`;
        False for none
    sums : energies and momenta of a state into the sums of `equations.inventory`, where `energy` and `momentum` do not
        have them
    measure : (t, y, s, model): what its frictions move by, in a state, after `kinematics`
    excess : (t, h, y, s, model): of a step to t, beside the longest that its records allow
    take_step : (s, model): the last evaluation becomes the start of the next step
    note_state : (t, y, s, model): a state does, whose forces have not been evaluated
    note_stage : (t, starts, model): what is noted of the last evaluation in a step, or at the start of a run
    """

    #: Questions of the family that are asked where there is no answer; the answer False stands for none.
    OTHERWISE: ClassVar[Mapping[str, str]] = {"force": "force", "energy": "energy"}

    force: Call = None
    rate: Call = None
    carried: Call = None
    end: Call = None
    energy: Call = None
    sums: Call = None
    measure: Call = None
    excess: Call = None
    take_step: Call = None
    note_state: Call = None
    note_stage: Call = None
