"""The layout of a state beyond coordinates and velocities: accounts and switches, as families state them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from evolvent import model as mdl
from evolvent.model.family import Family
from evolvent.model.layout import Accounts, Switches, counted
from evolvent.model.registry import constraining, events, families

Array = np.ndarray
#: Places, among the accounts, of what friction takes under explicit methods, and, among the switches, of those that
#: events have for what they release.
_FRICTION, _RELEASED = 8.0, 2.0


def number_accounts(found: Mapping[str, Array], first: int) -> tuple[Array, int]:
    """Give records their accounts, after those of the whole model.

    Parameters
    ----------
    found : records by family
    first : int, index in the state of the first account

    Returns
    -------
    accounts : (n,) float, at the start
    rubbed : int, index of that of what friction takes under explicit methods, -1 without friction
    """
    every = families().values()
    at = first + mdl.N_ACCOUNTS
    if has_causes(found):
        at += mdl.IMPULSE
    own: list[tuple[float, Family | None, Accounts | None]] = [
        (accounts.order, family, accounts) for family in every for accounts in family.accounts
    ]
    starts: dict[int, Array] = {}
    rubbed = -1
    for _, family, accounts in sorted([*own, (_FRICTION, None, None)], key=lambda one: one[0]):
        if family is None or accounts is None:
            if any(
                family.friction.rubs is not None and np.any(family.friction.rubs(found[family.name]))
                for family in every
            ):
                rubbed, at = at, at + 1
            continue
        records = found[family.name]
        counts = counted(accounts.counts, records)
        places = at + np.cumsum(counts) - counts
        if accounts.field:
            records[accounts.field] = np.where(counts > 0, places, -1)
        if accounts.start:
            starts |= zip(places.tolist(), records[accounts.start], strict=True)
        at += int(counts.sum())
    values = np.zeros(at - first)
    for place, value in starts.items():
        values[place - first] = value
    return values, rubbed


def has_causes(found: Mapping[str, Array]) -> bool:
    """Whether the accounts of explicit methods tell apart what dissipates energy."""
    return any(family.energies.by_causes and found[family.name].size > 0 for family in families().values())


def number_switches(found: Mapping[str, Array], builder: Any) -> Array:
    """Give records their switches; returns these at the start.

    An event has one for each record that it releases or switches off, 0 until it has; where a latch does that, its own
    switch serves.

    Parameters
    ----------
    found : records by family
    builder : evolvent.assembly.builder.Builder
    """
    values: list[int] = []
    own: list[tuple[float, Family, Switches | None]] = [
        (switches.order, family, switches) for family in families().values() for switches in family.switches
    ]
    own += [
        (_RELEASED, family, None)
        for _, family in sorted(families().items())
        if {"event", "switch"} <= set(family.record.names or ())
    ]
    for _, family, switches in sorted(own, key=lambda one: one[0]):
        records = found[family.name]
        if switches is None:
            latches = np.concatenate([one.switches(found[of.name]) for of, one in events() if one.switches is not None])
            by_event, by_latch = records["event"] >= 0, records["event"] <= -2
            records["switch"][by_event] = len(values) + np.arange(np.sum(by_event))
            records["switch"][by_latch] = latches[-2 - records["event"][by_latch]]
            values += [0] * int(np.sum(by_event))
            continue
        counts = counted(switches.counts, records)
        if switches.field:
            has = counts > 0
            records[switches.field][has] = (len(values) + np.cumsum(counts) - counts)[has]
        start: Any = np.zeros(int(counts.sum())) if switches.start is None else switches.start(records, builder)
        values += [int(value) for value in start]
    return np.array(values, dtype=np.int64)


def stops(found: Mapping[str, Array]) -> set[float]:
    """Times at which records start or cease to act (`Family.times`), and rows of constraint are released, s."""
    every = [(found[family.name], field) for family in families().values() for field in family.times]
    every += [(found[name], "until") for name in constraining() if "until" in (found[name].dtype.names or ())]
    return {t for records, field in every for t in records[field][np.isfinite(records[field])].tolist()}


def totals(found: Mapping[str, Array]) -> dict[str, int]:
    """Numbers of records of the model's `info`, by its fields, of all families together; `ne` is that of all events."""
    sums = dict[str, int]()
    for family in families().values():
        for field, count in family.parts.totals.items():
            sums[field] = sums.get(field, 0) + int(count(found[family.name]))
    return sums | {"ne": sum(int(own.count(found[family.name])) for family, own in events())}
