"""The method of a simulation, chosen from the parts of a system."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.analysis import feedback
from evolvent.assembly import families
from evolvent.assembly.assembled import Assembly
from evolvent.assembly.constraints import ends_of_row
from evolvent.kernels import rigid
from evolvent.model import family, registry as family_registry
from evolvent.model.registry import asked
from evolvent.solvers.time.explicit import plan as explicit_plan
from evolvent.solvers.time.implicit import energy_momentum, plan as implicit
from evolvent_base.errors import InputError, nearest

#: Methods that `simulate` takes by name.
METHODS = (*explicit_plan.METHODS, *implicit.METHODS)


def choose_method(assembly: Assembly, method: str = "auto") -> tuple[str, str]:
    """The method of a simulation, and why it is taken.

    Parameters
    ----------
    assembly : Assembly
    method : "auto", or one of `METHODS`

    Raises
    ------
    InputError
        If no such method is known, or it does not support a part: the sentence names one that does.
    """
    if assembly.shared is None:
        return _method_of(assembly, method)
    known = assembly.shared.setdefault("methods", {})
    if method not in known:
        known[method] = _method_of(assembly, method)
    found: tuple[str, str] = known[method]
    return found


def _method_of(assembly: Assembly, method: str) -> tuple[str, str]:
    """See `choose_method`."""
    if families.reacts(assembly.model):
        return feedback.method_of(assembly, method)
    if method != "auto":
        if method not in METHODS:
            raise InputError(f"method is {method!r}; {nearest(str(method), [*METHODS, 'auto'])}")
        if method in implicit.METHODS:
            families.check(assembly, implicit.METHODS[method].solver, method)
        else:
            families.check(assembly, family.EXPLICIT)
        return method, "as asked for"
    refused = {}
    for solver in (family.EXPLICIT, family.IMPLICIT, family.ENERGY):
        try:
            families.check(assembly, solver)
        except InputError as error:
            refused[solver] = str(error)
    model = assembly.model
    if len(refused) == 3:
        raise InputError(f"no method supports this system: {refused[family.EXPLICIT]}; {refused[family.IMPLICIT]}")
    own = [one for one in family_registry.families().values() if one.records(model).size]
    conserved = [one.advice.conserved for one in own if one.advice.conserved]
    if conserved and family.ENERGY not in refused:
        return energy_momentum.NAME, f"{' and '.join(conserved)}: steps of any length gain no energy"
    adaptive = families.suit_adaptive_steps(model)
    if adaptive and all(adaptive) and family.EXPLICIT not in refused:
        return "dopri5", adaptive[0]
    stiff = _better_implicit(assembly)
    if stiff and family.EXPLICIT not in refused and len(refused) < 2:
        refused[family.EXPLICIT] = f"{stiff}; "
    if family.EXPLICIT in refused and family.ENERGY not in refused and has_loops(model):
        return energy_momentum.NAME, "loops of joints, which may pass positions where they depend on one another"
    if family.EXPLICIT in refused and family.IMPLICIT not in refused:
        return implicit.NAME, refused[family.EXPLICIT].partition("; ")[0]
    if family.EXPLICIT in refused:
        return energy_momentum.NAME, refused[family.IMPLICIT].partition("; ")[0]
    if family.IMPLICIT in refused:
        return "dopri5" if all(adaptive) else "rk4", refused[family.IMPLICIT].partition("; ")[0]
    short = ((one.advice.short_steps, one.records(model)) for one in own)
    stiff = next(filter(None, (why(found) for why, found in short if why is not None)), "")
    if stiff or model.info.penalties:
        return implicit.NAME, stiff or "penalties are stiff"
    return "dopri5", "bodies, points and springs: adaptive steps of fifth order"


def _better_implicit(assembly: Any) -> str:
    """Why implicit methods suit a constraint (but for links and guides) or friction better; nothing without one."""
    known = family_registry.families()
    for one in known.values():
        mask, why = one.advice.implicit or (None, "")
        for k in np.flatnonzero(mask(one.records(assembly.model))) if mask is not None else ():
            name = families.owner(assembly, one.name, int(k))
            of = known.get(assembly.names.get(name, ("",))[0])
            if of is None or not of.advice.explicit:
                return f"{name!r} {why}"
    return ""


def has_loops(model: Any) -> bool:
    """Whether joints close a loop of three parts or more, what does not move being one part."""
    edges = set()
    for k in np.flatnonzero(model.constraints["turns"] == 0):
        ends = set()
        for what, index in ends_of_row(model, int(k)):
            moves = what == "bodies" and model.bodies["motion"][index] != rigid.DRIVEN
            if moves or what not in asked("parts.consists"):
                ends.add(f"{what} {index}")
        edges.add(tuple(sorted(ends)) if len(ends) == 2 else ("", *ends))
    group: dict[str, str] = {}

    def root(name: str) -> str:
        while group.setdefault(name, name) != name:
            name = group[name]
        return name

    for a, b in (edge for edge in sorted(edges) if len(edge) == 2):
        first, second = root(a), root(b)
        if first == second:
            return True
        group[first] = second
    return False
