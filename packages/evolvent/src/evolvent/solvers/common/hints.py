"""Why a motion may fail: forces without a direction, and what families state of a state (`Notes.hint`)."""

from __future__ import annotations

import numpy as np

from evolvent.assembly.assembled import Assembly
from evolvent.assembly.families import owner
from evolvent.model.registry import asked


def passages(assembly: Assembly) -> tuple[tuple[float, str], ...]:
    """First time (s) and a sentence of each spring that a motion has brought to length zero, after it."""
    found = []
    for name, passages_of in asked("notes.passages").items():
        found += [(t, f"{owner(assembly, name, k)!r} {why}") for k, t, why in passages_of(assembly.model)]
    return tuple(found)


def hints_on(assembly: Assembly, y: np.ndarray) -> str:
    """What may be wrong in a state (ny,), in words that go on a sentence; '' of nothing."""
    own = asked("notes.hint").items()
    found = [(owner(assembly, name, k), what) for name, hint in own for k, what in hint(assembly.model, y)]
    return "".join(f"; {what.format(name=repr(who))}" for who, what in found)


def without_normal(assembly: Assembly, when: str) -> str:
    """A sentence on the first contact of a step that has started with two centres at one place; '' for none."""
    for name, mask in asked("contacts.without_normal").items():
        for k in np.flatnonzero(mask(getattr(assembly.model, name))).tolist():
            return (
                f"{owner(assembly, name, k)!r} has the centre or axis of one body on that of the other {when}, where "
                f"its force has no direction; use a greater `stiffness`, or move them apart"
            )
    return ""
