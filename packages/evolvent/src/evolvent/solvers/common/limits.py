"""What limits a result: where states leave the range in which a model of a part holds.

`limitations` is asked of every result that has states: runs, equilibria, modes, linear models and what is made of them.
"""

from __future__ import annotations

import numpy as np

from evolvent.assembly.families import owner
from evolvent.model.registry import asked
from evolvent.solvers.common.solution import Solution

#: Share of the largest tension by which what only pulls may push before a run warns: springs ring after every release,
#: and what keeps its length does not.
PUSH_OF_SPRINGS, PUSH_OF_FIXED_LENGTHS = 0.05, 1e-6


def limitations(solution: Solution) -> list[str]:
    """Sentences on what the states of a solution are beyond, each with the part, the time, the value and what helps."""
    if not solution.t.size:
        return []
    found = [text for limits in asked("notes.limits").values() for text in limits(solution)]
    first, last = float(solution.t[0]), float(solution.t[-1])
    return found + [text for time, text in solution.passages if time <= last and (time > first or len(solution.t) > 1)]


def limitation_of(solution: Solution) -> str:
    """`limitations` of the last state as one text; '' for none."""
    return "; ".join(limitations(solution.chosen(slice(-1, None))))


def pushing(solution: Solution, share: float | None = None) -> str:
    """A sentence on threads and cords that push in a run by more than a share of their largest tension; '' for none.

    By default the share is `PUSH_OF_SPRINGS` or, of what keeps its length, `PUSH_OF_FIXED_LENGTHS`.
    """
    found = []
    for family, tensions in asked("notes.tensions").items() if solution.t.size else ():
        for index, tension, largest, springs in tensions(solution):
            allowed = PUSH_OF_SPRINGS if springs else PUSH_OF_FIXED_LENGTHS
            least = -(allowed if share is None else share) * max(largest, 0.0) - 1e-9
            if count := int(np.sum(tension < least)):
                at = int(np.argmin(tension))
                name = owner(solution.assembly, family, index)
                found.append((float(tension[at]), name, count, float(solution.t[at])))
    if not found:
        return ""
    worst, name, count, time = min(found)
    others = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
    return (
        f"{name!r}{others} pushes where a thread would go slack: tension below zero in {count} of {solution.t.size} "
        f"samples, at worst {worst:.3g} N at t = {time:.6g} s"
    )
