"""Storage before a run: the section `store` of a system, and what it leaves."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BeforeValidator
from pydantic_core import PydanticCustomError

from evolvent.assembly.assembled import Assembly
from evolvent.elements.viscoelastic import rows_of
from evolvent.solvers.static.storage import Stored, store
from evolvent_base import units
from evolvent_base.schema import Section


def _temperatures(value: Any) -> Any:
    """Rows of a table as they are checked; any other value as it is."""
    if not isinstance(value, (list, tuple)):
        return value
    rows = rows_of(value, "[time, temperature]")
    return rows


class Store(Section):
    """Time in the stowed position before the run: the stowed equilibrium, relaxed, is the start of every analysis.

    Parameters
    ----------
    time : float, s
        How long the system is stored.
    temperature : float, K, or rows [time, temperature], optional
        Over storage: constant, or a table with straight lines between its rows, times since the start of storage. If
        left out, the temperature of each material while it moves.
    tolerance : float
        Error of the strains in a step of storage, beside their size.
    """

    time: units.Duration
    temperature: Annotated[
        units.AbsoluteTemperature | tuple[tuple[units.Time, units.AbsoluteTemperature], ...] | None,
        BeforeValidator(_temperatures),
    ] = None
    tolerance: units.Tolerance = 1e-6

    def checked(self) -> Store:
        """Itself, where the times of its table rise."""
        if isinstance(self.temperature, tuple):
            for a, b in itertools.pairwise(self.temperature):
                if b[0] <= a[0]:
                    raise PydanticCustomError("store", "the times of the rows of `temperature` must rise")
        return self


def storage_of(sections: Mapping[str, Any]) -> Store | None:
    """The section `store` of a system; None without one."""
    found = sections.get("store")
    return None if not found else Store(**found)


def stored(assembly: Assembly, section: Store) -> Stored:
    """An assembly after its storage.

    Raises
    ------
    InputError
        As of `evolvent.solvers.static.storage.store`.
    """
    return store(assembly, section.time, section.temperature, tolerance=section.tolerance)
