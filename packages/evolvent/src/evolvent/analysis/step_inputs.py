"""What a stepper is made from: a case, and the bodies on which another program acts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeVar

from evolvent import cases, parts
from evolvent.analysis.composition import Composition
from evolvent.assembly.assembled import Assembly
from evolvent.kernels import rigid
from evolvent_base.errors import InputError, nearest

Composed = TypeVar("Composed", bound=Composition)


def listed(inputs: str | Sequence[str]) -> tuple[str, ...]:
    """Names of bodies, given as one name or several."""
    if isinstance(inputs, str):
        return (inputs,)
    try:
        return tuple(inputs)
    except TypeError:
        raise InputError(f"inputs is {inputs!r}; it must be names of bodies, such as ['hub']") from None


def movable(system: Composition) -> dict[str, bool]:
    """Names of a system's bodies, and whether forces move them."""
    assembly = system.assemble()
    rows = {name: row for name, (family, row) in assembly.names.items() if family == "bodies" and name != "ground"}
    return {name: int(assembly.model.bodies["motion"][row]) in (rigid.FREE, rigid.SPIN) for name, row in rows.items()}


def with_inputs(system: Composition, inputs: Sequence[str]) -> Assembly:
    """The assembly of a system with a force and a torque, none so far, on each of some bodies."""
    return composed(system, inputs).assemble()


def composed(system: Composed, inputs: Sequence[str]) -> Composed:
    """A copy of a system with a force and a torque, none so far, on each of some bodies."""
    known = movable(system) if inputs else {}
    copy = system.copy()
    for k, body in enumerate(inputs):
        if not isinstance(body, str) or body not in known:
            raise InputError(f"inputs name {body!r}, which is no body; {nearest(str(body), known)}")
        if body in inputs[:k]:
            raise InputError(f"inputs name {body!r} twice; name it once")
        if not known[body]:
            raise InputError(f"inputs name {body!r}, which no force moves: it is held, or turned at a given rate")
        copy.add(parts.Load(at=body, force=(0.0, 0.0, 0.0)), f"{body}-input-force")
        copy.add(parts.Load(at=body, torque=(0.0, 0.0, 0.0)), f"{body}-input-torque")
    return copy


def load_slices(assembly: Assembly, body: str) -> list[slice]:
    """Where the input force and torque on a body stand among the parameters of a model."""
    rows = [assembly.names[f"{body}-input-{kind}"] for kind in ("force", "torque")]
    firsts = [int(getattr(assembly.model, family)["first"][row]) for family, row in rows]
    return [slice(first, first + 3) for first in firsts]


def of_case(case: Any, until: float | None) -> tuple[Any, dict[str, Any], float]:
    """System of a checked case, how it asks to be stepped, and the end of the time that may be stepped through, s.

    Raises
    ------
    InputError
        If its system cannot be stepped from outside.
    """
    module = cases.system(case.system)
    if not module.steps:
        able = [name for name in cases.systems() if cases.system(name).steps]
        raise InputError(f"system is {case.system!r}, which is not stepped from outside; known: {', '.join(able)}")
    options = module.stepping(case)
    return module.build(case), options, module.plan(case).duration if until is None else until
