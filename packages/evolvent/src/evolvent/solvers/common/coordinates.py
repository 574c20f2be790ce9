"""Positions as coordinates under implicit methods and statics, where explicit methods have others."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from evolvent import model as mdl
from evolvent.assembly import needs
from evolvent.assembly.assembled import Assembly
from evolvent.assembly.checks import redundant_part
from evolvent.assembly.constraints import constraint_families, constraints_of
from evolvent.equations.rhs import rhs
from evolvent.model.questions import Positions
from evolvent.model.registry import asked
from evolvent.solvers.common.standing import hold
from evolvent_base.errors import InputError

Array = np.ndarray


def _positions(assembly: Assembly) -> list[tuple[str, Positions]]:
    """What differs in a model with positions as coordinates, by family."""
    found = [(name, own(assembly.model)) for name, own in asked("state.positions").items()]
    return [(name, one) for name, one in found if one is not None]


def with_positions(assembly: Assembly, t: float = 0.0) -> Assembly:
    """The assembly with positions as coordinates; itself where it has no others.

    Parameters
    ----------
    t : float, s, of its state

    Raises
    ------
    InputError
        For constraints among the parts that the others imply: what explicit methods take up has no solution then.
    """
    for family, own in _positions(assembly):
        model, of = assembly.model, {index: name for name, (kind, index) in assembly.names.items() if kind == family}
        if assembly.row_parts and (redundant := redundant_part(assembly, t)):
            why = own.refused.format(name=repr(of[own.owners[0]]))
            raise InputError(f"{redundant!r} is redundant: the other constraints already imply it, which {why}")
        y = assembly.y.copy()
        needs.load(model, own.write)
        own.write(t, y, assembly.s, model)
        families: dict[str, Any] = {name: getattr(model, name) for name in mdl.RECORDS} | dict(own.records)
        added = {
            name: np.concatenate([families[name], one]).view(type(families[name])) for name, one in own.added.items()
        }
        families |= added
        families["constraints"] = constraints = constraints_of(families)
        others = constraints["alone"] == 0
        constraints["outside"][others] = model.constraints["outside"]
        rows = constraint_families(families, model.masses, int(model.info.nq))
        sides, pairs, info, n = rows["row_sides"]["row"], rows["row_pairs"], model.info.copy(), rows["rows"].size
        info.bandwidth = int((sides[pairs["a"]] - sides[pairs["b"]]).max(initial=0))
        found = model._replace(
            **rows,
            **own.records,
            **added,
            constraints=constraints,
            info=info,
            la=np.zeros(n),
            A=np.zeros((n, int(info.bandwidth) + 1)),
        )
        hold(t, y, assembly.s, found)
        parts = np.empty(others.size, dtype=object)
        parts[others], parts[~others] = assembly.row_parts, [of[k] for k in own.owners]
        assembly = dataclasses.replace(assembly, model=found, y=y, row_parts=parts.tolist(), directions=model)
    return assembly


def given_positions(assembly: Assembly, y: Any, time: float) -> tuple[Assembly, Any]:
    """`with_positions` of an assembly and of a state of it at a time (s), or None.

    How many nodes move then follows from the drives.
    """
    found = with_positions(assembly)
    if found is assembly or y is None or np.shape(y) != assembly.y.shape:
        return found, y
    s, state = assembly.s.copy(), np.array(y, dtype=float)
    for _, own in _positions(assembly):
        own.count_nodes(assembly.model, time, s)
        own.write(time, state, s, assembly.model)
    return found, state


def evaluate_multipliers(assembly: Assembly, t: Array, y: Array, s: Array, la: Array) -> None:
    """Write into la : (nt, nj) the multipliers of states (nt, ny) that follow from these, not from steps."""
    if assembly.directions is not None:
        needs.load(assembly.directions, rhs)
        for evaluate in asked("state.multipliers").values():
            evaluate(rhs, assembly, t, y, s, la)
