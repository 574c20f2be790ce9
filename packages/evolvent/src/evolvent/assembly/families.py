"""Which solver supports which records of a model, and which part wrote a record.

A solver asks by `check`: it runs a model only where every record of it is of a kind that supports the solver, so that
a record of no kind is refused, never left out in silence.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent.assembly.constraints import row_of
from evolvent.model import Model
from evolvent.model.family import ENERGY, EXPLICIT, IMPLICIT, SOLVERS, STATIC, Kind
from evolvent.model.registry import asked, constraining, families
from evolvent_base.errors import InputError

Array = np.ndarray

#: Most parts that a refusal names.
MOST_NAMED = 5


def records(model: Model, name: str) -> Array:
    """Records of a family."""
    found: Array = getattr(model, name)
    return found


def has_symmetric_stiffness(model: Model) -> bool:
    """Whether every family that the model has is one whose stiffness is symmetric."""
    own = ((kind, family.records(model)) for family in families().values() for kind in family.kinds)
    return all(kind.is_symmetric(model, found) for kind, found in own)


def without_potential(assembly: Any) -> list[str]:
    """Names of the parts whose stiffness need not be symmetric: their forces may have no potential."""
    found: dict[str, None] = {}
    for name, family in families().items():
        rows = records(assembly.model, name)
        for kind in family.kinds if rows.size else ():
            for k in np.flatnonzero(kind.mask(rows)):
                if not kind.is_symmetric(assembly.model, rows[k : k + 1]):
                    found[owner(assembly, name, int(k))] = None
    return list(found)


def reacts(model: Model) -> bool:
    """Whether a part of a model reacts to what is measured, by a loop that is not closed."""
    own = ((kind, family.records(model)) for family in families().values() for kind in family.kinds if kind.reacts)
    return any(bool(np.any(kind.mask(found))) for kind, found in own)


def suit_adaptive_steps(model: Model) -> list[str]:
    """Why adaptive explicit steps suit the families of a model to which it matters, '' of those that they do not."""
    own = [(family.advice.adaptive, family.records(model)) for family in families().values()]
    return [adaptive(found) for adaptive, found in own if adaptive is not None and found.size]


def check(assembly: Any, solver: str, called: str = "") -> None:
    """Refuse parts that a solver does not support, by name.

    Parameters
    ----------
    assembly : evolvent.assembly.assembled.Assembly
    solver : one of `SOLVERS`
    called : str, what messages call it; left out, as `SOLVERS` does

    Raises
    ------
    InputError
        Naming the parts that are not supported, what to use instead, and a solver that supports them all.
    """
    supported = set() if assembly.shared is None else assembly.shared.setdefault("supported", set())
    if solver in supported:
        return
    added = {name: k for k, name in enumerate(assembly.names)}
    found = sorted(_unsupported(assembly, solver), key=lambda one: added.get(one[0], -1))
    if not found:
        supported.add(solver)
        return
    called = called or SOLVERS[solver]
    what = "does" if solver in (IMPLICIT, ENERGY, STATIC) else "do"
    refused = f"which {called} {what} not support"
    named: dict[str, list[str]] = {}
    for who, name, _ in found:
        named.setdefault(who, []).append(name)
    if len(found) == 1:
        who, name, advice = found[0]
        raise InputError(f"{who!r} is {name}, {refused}{advice}")
    alike: dict[str, list[str]] = {}
    for who, names in list(named.items())[:MOST_NAMED]:
        alike.setdefault(" and ".join(names), []).append(repr(who))
    several = ", ".join(f"{', '.join(parts)} ({kind})" for kind, parts in alike.items())
    more = f" and {len(named) - MOST_NAMED} more" if len(named) > MOST_NAMED else ""
    others = (EXPLICIT, ENERGY, IMPLICIT) if solver in (EXPLICIT, ENERGY, IMPLICIT) else ()
    whole = [SOLVERS[other] for other in others if other != solver and not any(_unsupported(assembly, other))]
    own = dict.fromkeys(one for _, _, one in found)
    if len(own) == 1 and found[0][2] and len(whole) != 1:
        advice = found[0][2]
    elif whole:
        able = " and ".join(whole)
        advice = f"; {able} {'support' if ' and ' in able else 'supports'} all of them"
    else:
        advice = "".join(dict.fromkeys(one for _, _, one in found[:MOST_NAMED] if one))
        advice = f"; no method supports all of them{advice}" if others else advice
    raise InputError(f"{called} {what} not support {several}{more}{advice}")


def _unsupported(assembly: Any, solver: str) -> Iterator[tuple[str, str, str]]:
    """Parts that a solver does not support: name, family and advice of each, once."""
    model = assembly.model
    seen: set[tuple[str, str]] = set()
    for family in families().values():
        found = family.records(model)
        if family.of or not found.size:
            continue
        left = np.ones(found.size, dtype=bool)
        for kind in family.kinds:
            mask = kind.mask(found)
            left &= ~mask
            for index in np.flatnonzero(mask) if solver not in kind.solvers else ():
                refused = _refusal(assembly, family.name, int(index), kind)
                if refused[:2] not in seen:
                    seen.add(refused[:2])
                    yield refused
        for index in np.flatnonzero(left):
            yield _refusal(assembly, family.name, int(index), None)


def owner(assembly: Any, family: str, index: int) -> str:
    """Name of the part that wrote a record."""
    if family in constraining():
        return row_owner(assembly, row_of(assembly.model, family, index))
    own = families()[family].parts.owner
    if own is not None:
        found = own(assembly, index)
        if isinstance(found, str):
            return found
        family, index = found
    if families()[family].parts.several:
        index = max((at for of, at in assembly.names.values() if of == family and at <= index), default=index)
    if family == "bodies":
        for name in asked("parts.consists"):
            for k in range(records(assembly.model, name).size if name != family else 0):
                if index in bodies_of(assembly.model, name, k):
                    return owner(assembly, name, k)
    for name, contains in asked("parts.contains").items():
        for k, row in enumerate(records(assembly.model, name)):
            if index in contains(row).get(family, ()):
                return owner(assembly, name, k)
    return next((name for name, one in assembly.names.items() if one == (family, index)), family)


def row_owner(assembly: Any, k: int) -> str:
    """Name of the part that wrote row k of the constraints."""
    name: str = assembly.row_parts[k]
    return name


def bodies_of(model: Model, family: str, index: int) -> range:
    """Bodies of a part: itself, the nodes of a rod, or frame and interface nodes of a reduced body; none of others."""
    consists = asked("parts.consists").get(family)
    return range(0) if consists is None else consists(records(model, family)[index], index)


def _refusal(assembly: Any, name: str, index: int, kind: Kind | None) -> tuple[str, str, str]:
    """Name of a part, what it is, and what to use instead."""
    what = kind.name if kind is not None else f"one of the {name}"
    who = owner(assembly, name, index)
    advice = f"; {kind.advice}" if kind is not None and kind.advice else ""
    return who, what, advice
