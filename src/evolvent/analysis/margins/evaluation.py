"""The margins of an assembled system, coordinate by coordinate."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent.analysis.margins import factors, lines, shares, tables
from evolvent.analysis.margins.factors import Standard
from evolvent.analysis.margins.keys import Margin
from evolvent.analysis.margins.latches import latch_of
from evolvent.analysis.margins.mechanism import Mechanism
from evolvent.analysis.margins.results import MarginResults
from evolvent.analysis.margins.tables import Table
from evolvent.base.errors import InputError, nearest
from evolvent.solvers.laws import refusing_laws

if TYPE_CHECKING:
    from evolvent.assembly.assembled import Assembly
    from evolvent.solvers.solution import Solution


def margins(
    assembly: Assembly, keys: Margin, *, run: Callable[[], Solution] | None = None, title: str = "", case: str = ""
) -> MarginResults:
    """Margins of every coordinate of an assembled system.

    Parameters
    ----------
    assembly : Assembly
    keys : Margin, as of the key `margin` of a case
    run : returns a run of the same assembly, for the tables along the motion; called once all that can be refused
        before a run is checked; None for no such tables
    title, case : str, of the results

    Raises
    ------
    InputError
        For parts that are not supported, a coordinate without an end of its travel, a resistance that is neither given
        nor declared to be zero, and keys that do not fit.
    """
    shares.refuse_unsupported(assembly)
    label, standard = factors.standard(keys.factors)
    evidence = _evidence("evidence", keys.evidence or standard.evidence[0], standard)
    spin = np.array([*(keys.spin or (0.0, 0.0, 0.0)), *keys.centre])
    with refusing_laws(assembly):
        mechanism = Mechanism(assembly, spin)
        found = shares.shares_of(assembly, keys.parts, evidence, spins=bool(np.any(spin[:3])))
        _check_parts(keys, found, assembly, standard)
        y = assembly.y.copy()
        asked = lines.with_others(mechanism, lines.coordinates_of(mechanism, keys, y), keys.time, y)
        ends = {one.k: one.end for one in asked} if keys.others == "end" else {}
        still = [_along_travel(mechanism, one, found, ends, keys, (standard, evidence)) for one in asked]
    moving: list[Table | None] = [None] * len(asked)
    solution = None if run is None else run()
    if solution is not None:
        with refusing_laws(assembly):
            for n, one in enumerate(asked):
                held = [mechanism.names.index(name) for name in one.held]
                moving[n] = tables.along_motion(mechanism, one, found, held, solution, (standard, evidence))
    for one, table, motion in zip(asked, still, moving, strict=True):
        given = _given(table) | (_given(motion) if motion is not None else set())
        lines.refuse_unstated(one, given, standard)
    return MarginResults(
        label, standard, keys, still, moving, _latches(assembly, asked, still, solution), title=title, case=case
    )


def _evidence(key: str, word: str, standard: Standard) -> str:
    if word not in standard.evidence:
        raise InputError(f"margin.{key} is {word!r}; {nearest(word, standard.evidence)}")
    return word


def _check_parts(keys: Margin, found: list[shares.Share], assembly: Assembly, standard: Standard) -> None:
    """Refuse keys of parts that have no force, and evidence that the table of factors does not know."""
    known = [share.label for share in found] + [share.part for share in found if share.part]
    for name, part in keys.parts.items():
        if name not in known:
            there = " has no force" if name in assembly.names else " is no part"
            raise InputError(f"margin.parts has {name!r}, which{there}; {nearest(name, dict.fromkeys(known))}")
        if part.evidence is not None:
            _evidence(f"parts.{name}.evidence", part.evidence, standard)


def _along_travel(
    mechanism: Mechanism, one: lines.MarginCoordinate, found: list[shares.Share], ends: Mapping[int, float],
    keys: Margin, known: tuple[Standard, str],
) -> Table:  # fmt: skip
    """The table at rest of one coordinate, from the start of the system."""
    y = mechanism.assembly.y.copy()
    mechanism.bare.switches[:] = mechanism.assembly.s
    _, x = mechanism.coordinates(keys.time, y)
    held = {k: float(ends.get(k, x[k])) for k in (mechanism.names.index(name) for name in one.held)}
    if ends:
        y = mechanism.move({**held, one.k: float(x[one.k])}, keys.time, y)
    return tables.along_travel(mechanism, one, found, held, keys.stations, keys.time, y, known)


def _given(table: Table) -> set[str]:
    """Categories that a part gives along a table."""
    active = np.any(table.values != 0.0, axis=1)
    found = {share.category for share, acts in zip(table.shares, active, strict=True) if acts}
    return found | ({factors.ACCELERATION} if table.coordinate.acceleration > 0.0 else set())


def _latches(
    assembly: Assembly, asked: list[lines.MarginCoordinate], still: list[Table], solution: Solution | None
) -> list[dict[str, Any]]:
    """What the run says of the latches and stops of the coordinates; an empty list without a run."""
    if solution is None:
        return []
    return [latch_of(assembly, one, table, solution) for one, table in zip(asked, still, strict=True)]


def with_keys(section: Mapping[str, Any], changes: Mapping[str, Any]) -> Margin:
    """The key `margin` of a case with some keys changed.

    Raises
    ------
    InputError
        For keys and values that cannot be used.
    """
    content = dict(section) | {name: value for name, value in changes.items() if value is not None}
    return Margin(**content)
