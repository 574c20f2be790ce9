"""Observations: the named results of every part of a finished run, one function a family.

`observe` reads them off a solution. A part of another package may override `evolvent.parts.base.Part.observe`, which
stands in place of its family's function.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from evolvent.results.observe import (
    attitude,
    beams,
    body_contact,
    contact,
    coordinates,
    custom,
    fields,
    joints,
    loads,
    lumped,
    rods,
    symbols,
    thermal,
    threads,
)
from evolvent.results.observe.variables import Observed, Variable
from evolvent.results.observe.view import View
from evolvent.solvers.solution import Solution

__all__ = ["OBSERVERS", "Observed", "Variable", "View", "has_results", "observe", "of_family"]

#: Function of each family of named parts.
OBSERVERS: dict[str, Callable[[View, str], Observed]] = {
    "bodies": lumped.observe_body,
    "points": lumped.observe_point,
    "springs": lumped.observe_spring,
    "links": joints.observe_link,
    "guides": joints.observe_guide,
    "joints": joints.observe_joint,
    "hinges": coordinates.observe_coordinate,
    "motors": coordinates.observe_motor,
    "synchronizations": coordinates.observe_synchronization,
    "threads": threads.observe_thread,
    "thread_ends": threads.observe_thread_end,
    "reels": threads.observe_reel,
    "wheels": attitude.observe_wheel,
    "thrusters": attitude.observe_thruster,
    "controllers": attitude.observe_controller,
    "beams": beams.observe_beam,
    "rods": rods.observe_rod,
    "cylinders": contact.observe_contact,
    "body_contacts": body_contact.observe_body_contact,
    "custom_forces": custom.observe_custom,
    "loads": loads.observe_load,
    "fields": fields.observe_field,
    "beam_loads": loads.observe_beam_load,
    "thermal_loads": thermal.observe_thermal_load,
}


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
        part = view.assembly.parts.get(name)
        if part is None:  # the ground, or none
            continue
        own = part.observe(view, name) or of_family(view, name)
        if own is not None:
            symbols.add_symbols(view, name, own)
            found[name] = own
    return found


def has_results(solution: Solution, name: str) -> bool:
    """Whether `observe` finds results of a part, without those of its family: of an event there are none."""
    part = solution.assembly.parts.get(name)
    if part is None:  # the ground
        return False
    return solution.assembly.names[name][0] in OBSERVERS or part.observe(View.of(solution), name) is not None


def of_family(view: View, name: str) -> Observed | None:
    """Named results of a part by its family; None of an event, which has none."""
    function = OBSERVERS.get(view.assembly.names[name][0])
    return None if function is None else function(view, name)
