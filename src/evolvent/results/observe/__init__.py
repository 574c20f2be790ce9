"""Observations: the named results of every part of a finished run, one function a family.

`observe` reads them off a solution. A part may add its own by `evolvent.parts.base.Part.observe`.
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
    reduced,
    rods,
    symbols,
    thermal,
    threads,
)
from evolvent.results.observe.variables import Observed, Variable
from evolvent.results.observe.view import View
from evolvent.solvers.solution import Solution

__all__ = ["OBSERVERS", "Observed", "Variable", "View", "has_results", "observe", "observe_part"]

#: Function of each family of named parts.
OBSERVERS: dict[str, Callable[[View, str], Observed]] = {
    "bodies": lumped.observe_body,
    "points": lumped.observe_point,
    "springs": lumped.observe_spring,
    "links": joints.observe_link,
    "guides": joints.observe_guide,
    "joints": joints.observe_joint,
    "coordinates": coordinates.observe_coordinate,
    "motors": coordinates.observe_motor,
    "synchronizations": coordinates.observe_synchronization,
    "resistances": coordinates.observe_resistance,
    "bearings": coordinates.observe_bearing,
    "threads": threads.observe_thread,
    "thread_ends": threads.observe_thread_end,
    "reels": threads.observe_reel,
    "wheels": attitude.observe_wheel,
    "thrusters": attitude.observe_thruster,
    "controllers": attitude.observe_controller,
    "beams": beams.observe_beam,
    "rods": rods.observe_rod,
    "reduced_bodies": reduced.observe_reduced,
    "contact_surfaces": contact.observe_contact,
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
        if name not in view.assembly.parts:  # the ground, or none
            continue
        own = observe_part(view, name)
        if own.variables or view.assembly.names[name][0] in OBSERVERS:
            symbols.add_symbols(view, name, own)
            found[name] = own
    return found


def has_results(solution: Solution, name: str) -> bool:
    """Whether `observe` finds results of a part, without those of its family: of an event there are none."""
    if name not in solution.assembly.parts:  # the ground
        return False
    return solution.assembly.names[name][0] in OBSERVERS or bool(observe_part(View.of(solution), name).variables)


def observe_part(view: View, name: str) -> Observed:
    """Named results of a part, by its family and its own; nothing of an event."""
    function = OBSERVERS.get(view.assembly.names[name][0])
    found = Observed() if function is None else function(view, name)
    view.part(name).observe(view, name, found)
    return found
