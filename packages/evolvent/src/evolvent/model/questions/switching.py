"""Records that go over to another law."""

from __future__ import annotations

import dataclasses

from evolvent.model.questions.base import Call


@dataclasses.dataclass(frozen=True)
class Switching:
    """How a family's records go over to other laws, by a trigger or in a step of implicit methods. All are compiled.

    Attributes
    ----------
    release : ends its records that wait for a trigger: (t, trigger, ends, y, s, model) as of `kernels.watches.release`;
        returns 1 where there are some
    until : part of a step of a length, after one of another (s, 0 for none), whose rates are means over steps or not,
        at which its next event that is not watched falls, by its last evaluation; 1 for none
    reached : number of its first such event, from one on, that the last evaluation has reached; -1 for none
    change : (t, y, s, model): goes over to other laws where the last evaluation has ended some; returns what energy is
        lost, J, not a number where none has ended
    """

    release: Call = None
    until: Call = None
    reached: Call = None
    change: Call = None
