"""What limits a result: where states leave the range in which a model of a part holds.

`limitations` is asked of every result that has states: runs, equilibria, modes, linear models and what is made of them.
"""

from __future__ import annotations

from evolvent.model.registry import asked
from evolvent.solvers.common.solution import Solution


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
