"""Observations: the named results of every part of a finished run.

`observe` reads them off a solution. Those of a family are found by the function beside it that is its
`variables.observer`; without one they are the fields that the family calls results (`Family.results`), to which
`Family.observe` may add. A part may add its own by `evolvent.parts.base.Part.observe`.
"""

from __future__ import annotations

from collections.abc import Iterable

from evolvent.model.registry import families
from evolvent.results.observe import symbols
from evolvent.results.observe.variables import Observed, Variable, observers
from evolvent.results.observe.view import View
from evolvent.solvers.common.solution import Solution

__all__ = ["Observed", "Variable", "View", "has_results", "observe", "observe_part", "observers"]


def observe(solution: Solution, parts: Iterable[str] | None = None) -> dict[str, Observed]:
    """Named results of the parts of a run, in the order in which the parts were added.

    Parameters
    ----------
    solution : Solution, of any solver
    parts : names of those that are observed; all if left out, and names of no part are passed over

    Returns
    -------
    dict
        Name of the part -> `Observed`; parts without results of their own (events) are left out.
    """
    view = View.of(solution)
    found = {}
    for name in view.assembly.names if parts is None else dict.fromkeys(parts):
        if name not in view.assembly.parts:  # the ground, or none
            continue
        own = observe_part(view, name)
        if own.variables or _has_observer(view.assembly.names[name][0]):
            symbols.add_symbols(view, name, own)
            found[name] = own
    return found


def has_results(solution: Solution, name: str) -> bool:
    """Whether `observe` finds results of a part, without those of its family: of an event there are none."""
    if name not in solution.assembly.parts:  # the ground
        return False
    return _has_observer(solution.assembly.names[name][0]) or bool(observe_part(View.of(solution), name).variables)


def observe_part(view: View, name: str) -> Observed:
    """Named results of a part, by its family and its own; nothing of an event."""
    own, index = view.assembly.names[name]
    function, family = observers().get(own), families().get(own)
    found = Observed() if function is None else function(view, name)
    if family is not None and function is None and family.results:
        found.results(own, view.fields[own], index)
    if family is not None and family.observe is not None:
        family.observe(view, name, found)
    view.part(name).observe(view, name, found)
    return found


def _has_observer(name: str) -> bool:
    """Whether the parts of a family have results."""
    family = families().get(name)
    return name in observers() or (family is not None and (bool(family.results) or family.observe is not None))
