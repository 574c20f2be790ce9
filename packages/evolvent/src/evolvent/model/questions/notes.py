"""Sentences on runs: where records leave the range in which they hold, and why a run may fail."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from typing import Any

from evolvent.model.questions.base import Array


@dataclasses.dataclass(frozen=True)
class Notes:
    """What is said of a family's records in a run, asked by warnings, limits and messages.

    Attributes
    ----------
    limits : function of a solution to sentences on where its states leave the range in which its records hold
    tensions : function of a solution to its records that can only pull: index, tension of each sample (N, the least of
        several) and its largest, and whether it is that of a spring, which rings
    passages : function of the model to records whose force has lost its direction in a run: time, s, and what happened
    hint : function of the model and a state to records that may be why a run fails, and a half sentence on each, in
        which `{name}` stands for the part
    """

    limits: Callable[[Any], Iterator[str]] | None = None
    tensions: Callable[[Any], Iterator[tuple[int, Array, float, bool]]] | None = None
    passages: Callable[[Any], Iterator[tuple[int, float, str]]] | None = None
    hint: Callable[[Any, Array], Iterator[tuple[int, str]]] | None = None
