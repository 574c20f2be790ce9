"""Checks of an assembled model."""

from __future__ import annotations

import numpy as np

from evolvent.assembly import needs
from evolvent.assembly.assembled import Assembly
from evolvent.assembly.constraints import family_of
from evolvent.assembly.families import owner, row_owner
from evolvent.kernels import constraint_rows
from evolvent.kernels.impulse import prepare
from evolvent.model.questions import CONSTRAINT
from evolvent.model.registry import asked
from evolvent_base.errors import InputError

#: By how much velocities that are written may miss constraints, beside the largest coordinate or rate.
WRITTEN = 1e-6


def check_constraints(assembly: Assembly, rates: float = WRITTEN) -> None:
    """Refuse redundant constraints of parts that are nothing else, and those that the start does not meet, by name.

    Parameters
    ----------
    rates : float, by how much velocities may miss them, beside the largest coordinate or rate of the state
    """
    model, y, s = assembly.model, assembly.y.copy(), assembly.s.copy()
    rows, unmet = model.constraints, asked("parts.unmet")
    kinds = {name: own for name, (own, _) in assembly.names.items()}
    held = [(k, name) for k, name in enumerate(assembly.row_parts) if kinds.get(name) in unmet]
    if not held:
        return
    needs.load(model, prepare)
    prepare(0.0, y, s, model)
    for k, name in sorted(held, key=lambda one: kinds[one[1]]):
        family, index = family_of(model, k)
        gap, rate, value = float(rows["gap"][k]), float(rows["rate"][k]), float(getattr(model, family)["value"][index])
        why = unmet[kinds[name]](name, gap, rate, value, abs(rate) > rates * max(1.0, np.abs(y).max()))
        if why:
            raise InputError(why)
    until, own = rows["until"].copy(), [k for k, _ in held]
    rows["until"] = -np.inf  # others may be released, and implicit methods support what is redundant
    rows["until"][own] = until[own]
    bad = redundant_part(assembly)
    rows["until"] = until
    if bad:
        raise InputError(f"{kinds[bad].removesuffix('s')} {bad!r} is redundant: the other constraints already imply it")


def redundant_part(assembly: Assembly, t: float = 0.0) -> str:
    """Name of a part whose row of constraint other rows imply at the start t, under explicit methods; else nothing."""
    model, y, s = assembly.model, assembly.y.copy(), assembly.s.copy()
    needs.load(model, prepare)
    prepare(t, y, s, model)
    bad = constraint_rows.build_rows(t, y, s, model)
    if bad < 0:
        return ""
    index, kind = int(model.rows["index"][bad]), model.rows["kind"][bad]
    if kind == CONSTRAINT:
        return row_owner(assembly, index)
    rows = asked("rows").items()
    return owner(assembly, next(name for name, own in rows if own.kind == kind), index)
