"""Which method suits a model."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

from evolvent.model.questions.base import Array


@dataclasses.dataclass(frozen=True)
class Advice:
    """Which method suits a family's records, asked where none is chosen (`analysis.methods`).

    Attributes
    ----------
    conserved : str, what a system with its records is called that takes the steps of energy-momentum, which gain no
        energy at any length; '' of one that need not
    implicit : function of its records to those that implicit methods suit better, and why
    explicit : whether explicit methods keep its constraints as well
    adaptive : function of its records to why adaptive explicit steps suit them, '' where they do not; None where it
        does not matter
    short_steps : function of its records to why explicit steps are short with them, '' where they need not be
    """

    conserved: str = ""
    implicit: tuple[Callable[[Array], Array], str] | None = None
    explicit: bool = False
    adaptive: Callable[[Array], str] | None = None
    short_steps: Callable[[Array], str] | None = None
