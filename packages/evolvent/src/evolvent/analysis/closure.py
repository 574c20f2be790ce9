"""What a run says about its energy balance, its threads and its reduced bodies: refusals and warnings."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Any

from evolvent.assembly.assembled import Assembly
from evolvent.assembly.references import split_reference
from evolvent.parts.base import kind_of
from evolvent.solvers.common import balance
from evolvent.solvers.common.laws import states_energy
from evolvent.solvers.common.limits import limitations, pushing
from evolvent.solvers.time.implicit.captures import STEPS, captures_of

if TYPE_CHECKING:
    from evolvent.solvers.common.solution import Solution


def check_energy_gain(solution: Solution) -> Solution:
    """The solution, failed where its energy balance gains too much by the rule of `evolvent.solvers.common.balance`.

    Implicit methods count a gain while they run; this is the balance of the whole run. Explicit methods judge it
    themselves.
    """
    if solution.kept is None or not solution.success or not solution.t.size or not solution.closure.fails:
        return solution
    found = solution.closure
    message = (
        f"the run has gained {found.gained:.3g} J without work, {percent(found.gained, found)} J that were moved"
        f"{states_energy(solution.assembly)}; use a smaller `tolerance` or `step`"
    )
    return dataclasses.replace(solution, status="failed", message=message)


def percent(defect: float, found: balance.Closure) -> str:
    """A defect (J) beside the energy moved (J), in words: '4.2 % of the 0.31'."""
    return f"{100.0 * defect / max(found.moved, 1e-300):.2g} % of the {found.moved:.3g}"


def unresolved(solution: Solution) -> str:
    """A sentence on a run that moved no energy but round-off, and a defect beside it; '' of others."""
    if solution.kept is None or solution.path is not None or not solution.t.size:
        return ""
    found = solution.closure
    if not (0.0 < found.moved < found.round_off and found.defect > balance.WARNED * found.moved):
        return ""
    return (
        f"the energy moved in the run, {found.moved:.2g} J, is round-off compared with the energies of its "
        f"elements and weights; the energy balance is not checked"
    )


def unclosed(solution: Solution) -> str:
    """A sentence where the energy balance is off by a part of the energy moved that is to be reported; '' of others."""
    if solution.path is not None or not solution.t.size or not solution.closure.warns:
        return ""
    found, hint = solution.closure, states_energy(solution.assembly)
    if found.damps and not hint and found.lost > found.gained:
        return (
            f"numerical damping has removed {found.lost:.3g} J, {percent(found.lost, found)} J that were moved; "
            f"use a smaller `tolerance` or `step`, or a higher `spectral_radius`"
        )
    what = "gained" if found.gained > found.lost else "lost"
    return (
        f"the energy balance has {what} {found.defect:.3g} J, {percent(found.defect, found)} J that were moved: the "
        f"steps do not resolve the motion{hint}; use a smaller `tolerance` or `step`"
    )


def warning_of(solution: Solution) -> str:
    """Sentences on energy that the method has taken, captures, threads that push, unloaded tips, limits; or ''."""
    found = (
        unresolved(solution) or unclosed(solution),
        unresolved_captures(solution),
        pushing(solution),
        unloaded_tips(solution.assembly),
        *limitations(solution),
    )
    return "; ".join(text for text in found if text)


def unresolved_captures(solution: Solution) -> str:
    """A sentence on latches, or spools that take up a node, whose captures take less than a fixed step; or ''."""
    step = float(solution.statistics.get("step", math.nan))
    if solution.kept is None or solution.path is not None or not step > 0.0 or not solution.t.size:
        return ""
    short = [one for one in captures_of(solution) if one.duration < step]
    if not short:
        return ""
    worst = min(short, key=lambda one: one.duration)
    names = {place: name for name, place in solution.assembly.names.items()}
    others = f" (and {len(short) - 1} more captures)" if len(short) > 1 else ""
    return (
        f"{names[worst.family, worst.row]!r} {worst.what} at t = {worst.time:.6g} s{others} in about "
        f"{worst.duration:.2g} s, less than the step of {step:.3g} s: its load and the vibration that it excites are "
        f"not resolved; use a `step` of at most {worst.duration / STEPS:.1g} s, or a `tolerance`"
    )


def _of_kind(assembly: Assembly, kind: str) -> list[tuple[str, Any]]:
    """Names and parts of a kind or derived from it, found without loading the class of that kind."""
    return [(name, part) for name, part in assembly.parts.items() if kind in map(kind_of, type(part).__mro__)]


def unloaded_tips(assembly: Assembly) -> str:
    """A sentence on threads with a tip mass whose only load by a law is per length; '' where there is none."""
    threads = {name: part for name, part in _of_kind(assembly, "thread") if part.tip_mass > 0.0}
    if any(part.type == "acceleration" for _, part in _of_kind(assembly, "field")):
        return ""
    loads = dict(_of_kind(assembly, "load"))
    places = [part.at for part in loads.values() if isinstance(part.at, str)]
    at_tips = {thread for thread, node in map(split_reference, places) if node in ("tip", 0)}
    for name, part in loads.items():
        if part.law is not None and part.along in threads and part.along not in at_tips:
            return (
                f"{name!r} acts per length of {part.along!r}, not on its tip mass of "
                f"{threads[part.along].tip_mass:g} kg; for a load on the tip mass add a Load "
                f"at '{part.along}.tip', or a Field of type 'acceleration'"
            )
    return ""
