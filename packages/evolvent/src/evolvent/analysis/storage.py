"""Storage before a run: the section `store` of a system, and what it leaves."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Mapping
from typing import Annotated, Any, Self

import numpy as np
from pydantic import AfterValidator, BeforeValidator, ValidationError, model_validator
from pydantic_core import PydanticCustomError

from evolvent.assembly.assembled import Assembly
from evolvent.elements.viscoelastic import rows_of
from evolvent.solvers.static.storage import Stored, store
from evolvent_base import units
from evolvent_base.errors import InputError
from evolvent_base.scales import CELSIUS, shown_time
from evolvent_base.schema import Section, sentence


def _temperatures(value: Any) -> Any:
    """Rows of a table as they are checked; any other value as it is."""
    return rows_of(value, "[time, temperature]") if isinstance(value, (list, tuple)) else value


def _rising(value: Any) -> Any:
    """A temperature, or a table whose times rise."""
    if isinstance(value, tuple):
        for k, (a, b) in enumerate(itertools.pairwise(value)):
            if b[0] <= a[0]:
                raise PydanticCustomError(
                    "store", "its times must rise; row {row} is at {time}, not after the row before",
                    {"row": k + 2, "time": shown_time(b[0])},
                )  # fmt: skip
    return value


class Store(Section):
    """Time in the stowed position before the run: the stowed equilibrium, relaxed, is the start of every analysis.

    Parameters
    ----------
    time : float, s
        How long the system is stored.
    temperature : float, K, or rows [time, temperature], optional
        Over storage: constant, or a table with straight lines between its rows, whose times since the start of storage
        are from 0 to its end. If left out, the temperature of each material while it moves.
    tolerance : float
        Error of the strains in a step of storage, beside their size.
    """

    time: units.Duration
    temperature: Annotated[
        units.MaterialTemperature | tuple[tuple[units.Time, units.MaterialTemperature], ...] | None,
        BeforeValidator(_temperatures),
        AfterValidator(_rising),
    ] = None
    tolerance: units.Tolerance = 1e-6

    @model_validator(mode="after")
    def _check(self) -> Self:
        T = self.temperature
        if isinstance(T, tuple) and (T[0][0] != 0.0 or T[-1][0] < self.time):
            raise PydanticCustomError(
                "sentence",
                "the times of store.temperature run from {first} to {last}; they must begin at 0 and reach "
                "store.time, {time}",
                {"first": shown_time(T[0][0]), "last": shown_time(T[-1][0]), "time": shown_time(self.time)},
            )  # fmt: skip
        return self

    @property
    def shown(self) -> str:
        """How long, and at which temperature, in words."""
        found, T = shown_time(self.time), self.temperature
        if T is None:
            return found
        if isinstance(T, float | int):
            return f"{found} at {T - CELSIUS:.4g} °C"
        times, values = np.array(T).T
        inner = np.append(times[times < self.time], self.time)
        values = np.interp(inner, times, values) - CELSIUS
        return f"{found} at {min(values):.4g} to {max(values):.4g} °C"


def storage_of(sections: Mapping[str, Any]) -> Store | None:
    """The section `store` of a system; None without one.

    Raises
    ------
    InputError
        For keys and values that cannot be used; one sentence.
    """
    found = sections.get("store")
    if found is None:
        return None
    try:
        return Store.model_validate(found)
    except ValidationError as error:
        raise InputError(sentence(error.errors(include_url=False), Store, before="store.")) from None


def stored(assembly: Assembly, section: Store) -> Stored:
    """An assembly after its storage.

    Raises
    ------
    InputError
        As of `evolvent.solvers.static.storage.store`.
    """
    return store(assembly, section.time, section.temperature, tolerance=section.tolerance)


@dataclasses.dataclass(frozen=True)
class Aged:
    """What a storage has left of an assembly, kept for analyses that follow of the same one.

    Attributes
    ----------
    section : Store
    before, after : Assembly, which no analysis may change
    """

    section: Store
    before: Assembly
    after: Assembly

    def is_of(self, section: Store, assembly: Assembly) -> bool:
        """Whether it is what the same storage leaves of an assembly with the same content."""
        before = self.before
        if section != self.section or assembly.names != before.names or assembly.relaxations != before.relaxations:
            return False
        pairs = [(assembly.y, before.y), (assembly.s, before.s)]
        own, other = assembly.model._asdict(), before.model._asdict()
        return all(a.tobytes() == b.tobytes() for a, b in [*pairs, *((own[name], other[name]) for name in own)])

    def again(self, assembly: Assembly) -> Assembly:
        """The assembly after the storage, with a model of its own."""
        after = self.after
        return dataclasses.replace(
            assembly, model=after.model.copy(), y=after.y.copy(), s=after.s.copy(), touched=None
        )  # fmt: skip
