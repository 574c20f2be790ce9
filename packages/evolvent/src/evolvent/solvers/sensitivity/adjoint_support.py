"""What the adjoint supports, what it takes, and which forces follow from rates."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.assembly.families import owner
from evolvent.compiled import lookups
from evolvent.model.family import every, some
from evolvent.model.questions import AdjointSupport
from evolvent.model.registry import cubic, families, whole
from evolvent.solvers.sensitivity import recorded_energy_steps
from evolvent_base.errors import InputError

Array = np.ndarray
#: Estimated times beside that of a run, of `cost`; and evaluations of the equations in the time of a step of
#: energy-momentum.
BACK, BY_VALUE, BY_KEY, EVALUATIONS = 6.0, 0.5, 0.05, 16.0


def check(plan: Any) -> None:
    """Refuse what has no adjoint, by name.

    Raises
    ------
    InputError
    """
    model, options = plan.assembly.model, plan.options
    supported: list[tuple[AdjointSupport, Array]] = []
    for family in whole():
        found = family.records(model)
        if family.adjoint is not None:
            supported.append((family.adjoint, found))
        elif found.size:
            who, what = owner(plan.assembly, family.name, 0), family.called(found[:1])
            raise InputError(f"{who!r} is {what}, which the adjoint does not support; take mode 'forward'")
    for support, found in supported:
        for what, mask in support.refused.items():
            if np.any(mask(found)):
                raise InputError(f"{what}, which the adjoint does not support; take mode 'forward'")
    if options.midpoint and cubic(model) and model.body_contacts.size:
        raise InputError(
            f"the adjoint does not support {cubic(model)} beside body_contacts under {plan.method}; take mode 'forward'"
        )
    if options.midpoint and options.chi > 0.0:
        filtered = next((support.filtered for support, found in supported if support.filtered and found.size), "")
        if filtered or options.tolerance > 0.0:
            what = f"the filtered {filtered}" if filtered else "adaptive steps"
            raise InputError(
                f"the adjoint does not support {what} of {plan.method}; take `spectral_radius` 1, or mode 'forward'"
            )


def cost(plan: Any, values: int, keys: int) -> float:
    """Estimated time of derivatives by the adjoint, beside that of the run.

    Run and way back take `BACK` runs, `BY_VALUE` more for each further value and `BY_KEY` for the systems in which a
    key is changed; by energy-momentum also a part of a step for each evaluation of the equations, of the colours of
    its differences. All are rounded up from what `benchmarks/gradients.py` has measured.

    Raises
    ------
    InputError
        Where there is no adjoint.
    """
    check(plan)
    found = BACK + BY_VALUE * (values - 1) + BY_KEY * keys
    if plan.options.midpoint:
        colours = recorded_energy_steps.colours_of(plan.assembly)
        every = (int(colours.moving[0]) + colours.starts.size - 1) * int(colours.inexact[0])
        found += every * len(colours.stencil) / EVALUATIONS
    return float(found)


def depends_on_time(model: Any) -> bool:
    """Whether forces or constraints are functions of time, of the families that are supported."""
    return any(some(family.adjoint.timed, family.records(model)) for family in whole() if family.adjoint is not None)


def are_smooth(model: Any) -> bool:
    """Whether the derivatives of all forces are smooth functions of the state between events."""
    own = ((family.adjoint, family.records(model)) for family in whole())
    return all(support is not None and every(support.smooth, found) for support, found in own if found.size)


def by_rates(model: Any) -> tuple[list[int], list[int]]:
    """Slots of the tangents of a model without and with derivatives by rates; masses alone are in neither."""
    steady: dict[int, None] = {}
    rated: dict[int, None] = {}
    for family in families().values():
        support = families()[family.of].adjoint if family.of else family.adjoint
        if not getattr(model, family.name).size:
            continue
        rates = support is None or support.rates
        moves = rates(model) if callable(rates) else rates
        if family.tangent and lookups.slot(family.tangent) in model.tangent_calls:
            (rated if moves else steady)[lookups.slot(family.tangent)] = None
        if moves and family.inertia.tangent and lookups.slot(family.inertia.tangent) in model.inertia_tangent_calls:
            rated[lookups.slot(family.inertia.tangent)] = None
    return [slot for slot in steady if slot not in rated], [*rated]
