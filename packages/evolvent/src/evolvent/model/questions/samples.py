"""Results at samples, and what a run keeps of them."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping

from evolvent.model.questions.base import Call, Records

#: How fields are kept at samples, in the order in which they stand there (`Samples.kept`).
CLEARED, BETWEEN, NEARER, SUMMED = range(4)


@dataclasses.dataclass(frozen=True)
class Samples:
    """What a family's records are at samples, asked by `equations.sampling`, `solvers.time` and `results`.

    Attributes
    ----------
    evaluate : compiled: fields that are results, at a sample; by `Family.force` where a family with results has no
        answer, False for none
    prepare : compiled: before that of all families
    rates : compiled: after `prepare`, what follows from the rates of explicit methods, which are evaluated for it
    last : compiled: after `evaluate` of all families
    local : whether results of its records at a sample follow from the states at it and at the first one, without
        reactions
    kept : fields that a run keeps at its samples, and how: `BETWEEN` (values at both ends of a step lie on a straight
        line), `CLEARED` (the same, of what `kinematics` clears), `NEARER` (of the nearer end), or `SUMMED` (since the
        start)
    keeps : function of `Records` to whether they are kept
    keep : compiled: what fills them after forces
    note_part : compiled: of a sample between the ends of a step, (part, start, length), before its state is
        interpolated
    interpolate : compiled: moves in a state between those of the ends of a step, (part, y0, y1), what lies on lines of
        its own
    between : compiled: the same of a sample, (part, start, length, y0, y1), where it needs the time as well
    extremes : names of m results whose extremes over all steps are stored in the field `extremes`, (2 m,) float, of
        each record: the least and the largest value of each in turn
    note_extremes : compiled: (s, model): updates this field by the last evaluation, which is at the start or the end of
        a step (under energy-momentum: by the means over the step)
    """

    evaluate: Call = None
    prepare: Call = None
    rates: Call = None
    last: Call = None
    local: bool = False
    kept: Mapping[str, int] = dataclasses.field(default_factory=dict)
    keeps: Callable[[Records], bool] | None = None
    keep: Call = None
    note_part: Call = None
    interpolate: Call = None
    between: Call = None
    extremes: tuple[str, ...] = ()
    note_extremes: Call = None
