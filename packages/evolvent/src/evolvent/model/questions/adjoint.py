"""Support by the adjoint."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

from evolvent.model.questions.base import Array


@dataclasses.dataclass(frozen=True)
class AdjointSupport:
    """Why a family is supported by the adjoint: its tangent is exact, and nothing in its records goes on from a step.

    Attributes
    ----------
    reason : str, why that is so
    timed : whether its forces or constraints are functions of time: for all of its records, or a mask of them
    filtered : str, what energy-momentum filters over two steps, which has no adjoint; "" for nothing
    rates : whether its forces follow from rates: for all of its records, or a function of the model that says so; where
        they do not, the adjoint assembles its tangent once a step
    refused : half sentences on records that are not supported, to a function of the records to a mask of these
    mirrored : whether, where no coordinate turns, the tangent of its forces over a step of energy-momentum is exact,
        and they do not change where the ends of the step are exchanged: for all of its records, or a mask of them
    cubic : whether its forces are cubic in its coordinates, so that wide differences of the fourth order are exact,
        beside which nothing may happen at once
    smooth : whether its forces have no kinks between events, so that tangents of many steps can be interpolated
        between those of a few: for all of its records, or a mask of them
    """

    reason: str
    timed: bool | Callable[[Array], Array] = True
    filtered: str = ""
    refused: Mapping[str, Callable[[Array], Array]] = dataclasses.field(default_factory=dict)
    cubic: bool = False
    rates: bool | Callable[[Any], bool] = True
    mirrored: bool | Callable[[Array], Array] = False
    smooth: bool | Callable[[Array], Array] = False
