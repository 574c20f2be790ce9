"""Factors of margins: tables of the standards as data, and the requirement that they make of driving and resisting."""

from __future__ import annotations

import functools
import importlib.resources
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Literal, get_args

import numpy as np
from pydantic import Field

from evolvent import cases
from evolvent.model.shares import ELASTIC, SPRING
from evolvent_base import safe_open, units
from evolvent_base.errors import InputError, nearest
from evolvent_base.schema import Section

Array = np.ndarray

Category = Literal[
    "motor", "spring", "elastic parts", "inertia", "friction", "hysteresis", "harness", "motor losses", "adhesion",
    "load", "acceleration", "damping",
]  # fmt: skip
Stated = Literal["friction", "hysteresis", "harness", "motor losses", "adhesion", "load", "acceleration"]
#: Endings of files with an own table.
ENDINGS = (".yaml", ".yml")
#: Categories that have the factor of another one where a table has none of their own.
LIKE = {ELASTIC: SPRING}
#: What drives or resists, in the order of tables.
CATEGORIES: tuple[str, ...] = get_args(Category)
#: Resistances that a case states, or declares to be zero: what it is silent about must not become a margin. The others
#: follow from parts that a mechanism cannot do without.
STATED: tuple[str, ...] = get_args(Stated)

#: The one of them that is none of a case without a specified acceleration: its margins are those at rest.
ACCELERATION = "acceleration"


class Unstated(InputError):
    """A coordinate has resistances that are neither given nor declared to be zero.

    Parameters
    ----------
    sentence : str
    coordinate : str, its name
    missing : sequence of str, the resistances
    """

    def __init__(self, sentence: str, coordinate: str = "", missing: Sequence[str] = ()) -> None:
        super().__init__(sentence)
        self.coordinate, self.missing = coordinate, tuple(missing)


Factor = float | dict[str, float]


class Requirement(Section):
    """What the resistances ask for: times sum(resisting) + sum(added)."""

    times: units.PositiveNumber = Field(1.0, description="factor of all that is listed under resisting")
    resisting: dict[str, Factor] = Field(description="factor of each category")
    added: dict[str, Factor] = Field({}, description="factor of each category that `times` does not multiply")

    def factor(self, category: str, evidence: str) -> float:
        """Factor of a category with the evidence, 0 where the requirement does not have it."""
        for name in (category, LIKE.get(category, category)):
            for table, times in ((self.resisting, self.times), (self.added, 1.0)):
                if name in table:
                    found = table[name]
                    return times * (found[evidence] if isinstance(found, dict) else found)
        return 0.0


class Standard(Section):
    """A table of factors: of one revision of a standard, or a user's own."""

    revision: str = Field(description="revision of the standard")
    source: str = Field("", description="where the factors are from, and what was not at hand")
    evidence: tuple[str, ...] = Field(description="words for how a resistance is known; the first one is the default")
    driving: dict[str, float] = Field(description="factor of each category that drives; others do not count")
    requirements: dict[str, Requirement] = Field(description="requirements by name, each of which has its margin")

    def refusals(self) -> Iterator[str]:
        """Sentences on categories, words and numbers that cannot be."""
        if not self.evidence or not self.requirements:
            yield "evidence and requirements must not be empty"
        tables: list[tuple[str, Mapping[str, Any]]] = [("driving", self.driving)]
        for name, one in self.requirements.items():
            tables += [(f"requirements.{name}.resisting", one.resisting), (f"requirements.{name}.added", one.added)]
            for twice in set(one.resisting) & set(one.added):
                yield f"requirements.{name} has {twice!r} under resisting and under added; leave one of them out"
        for key, table in tables:
            yield from self._refused(key, table)

    def _refused(self, key: str, table: Mapping[str, Any]) -> Iterator[str]:
        """Sentences on one table of factors."""
        for category, found in table.items():
            if category not in CATEGORIES:
                yield f"{key} has {category!r}; {nearest(category, CATEGORIES)}"
            if isinstance(found, dict) and set(found) != set(self.evidence):
                yield f"{key}.{category} is {found!r}; it must have one number for each of {', '.join(self.evidence)}"
            for number in found.values() if isinstance(found, dict) else (found,):
                if not (math.isfinite(number) and number >= 0.0):
                    yield f"{key}.{category} is {number!r}; a factor is a number from 0"

    def available(self, drives: Mapping[str, Any]) -> Any:
        """What counts as actuation of what drives, by category (N m or N)."""
        return sum(self.counts(category) * value for category, value in drives.items())

    def counts(self, category: str) -> float:
        """Factor of a category that drives, 0 where it does not count."""
        return self.driving.get(category, self.driving.get(LIKE.get(category, category), 0.0))

    def required(self, name: str, resists: Mapping[tuple[str, str], Any]) -> Any:
        """What a requirement asks for, of resistances by category and evidence (N m or N)."""
        one = self.requirements[name]
        return sum(one.factor(category, evidence) * value for (category, evidence), value in resists.items())

    def margin(self, name: str, drives: Mapping[str, Any], resists: Mapping[tuple[str, str], Any]) -> Any:
        """Margin by a requirement: available/required - 1.

        Parameters
        ----------
        name : of the requirement
        drives : category -> float or array, N m or N, above 0
        resists : (category, evidence) -> float or array, N m or N, above 0
        """
        return ratio(self.available(drives), self.required(name, resists))


def ratio(available: Any, required: Any) -> Any:
    """available/required - 1: infinite where nothing resists, -1 where nothing drives."""
    up, down = np.broadcast_arrays(np.asarray(available, dtype=float), np.asarray(required, dtype=float))
    found = np.where(up > 0.0, math.inf, -1.0)
    np.divide(up, down, out=found, where=down > 0.0)
    found = np.where(down > 0.0, found - 1.0, found)
    return float(found) if found.ndim == 0 else found


@functools.cache
def built_in() -> Mapping[str, Standard]:
    """Tables that come with the package, by name."""
    text = importlib.resources.files(__package__).joinpath("factors.yaml").read_text(encoding="utf-8")
    return {name: Standard(**one) for name, one in cases.parse_yaml(text, "factors.yaml").items()}


def standard(name: str) -> tuple[str, Standard]:
    """Name and table of a standard, or of a YAML file with one table, or with a mapping of one name to it.

    Raises
    ------
    InputError
    """
    if name in built_in():
        return name, built_in()[name]
    if not name.endswith(ENDINGS):
        raise InputError(
            f"factors is {name!r}; {nearest(name, built_in())}, or a YAML file such as 'factors.yaml' with an own table"
        )
    content = cases.parse_yaml(safe_open.text(name), name)
    if not isinstance(content, dict) or not content:
        raise InputError(f"{name}: a table of factors is a mapping of keys to values; this is not")
    label = os.path.basename(name)
    if len(content) == 1 and isinstance(next(iter(content.values())), dict):
        label, content = next(iter(content.items()))
    try:
        return str(label), Standard(**content)
    except InputError as error:
        raise InputError(f"{name}: {str(error).removeprefix('Standard.')}") from None
