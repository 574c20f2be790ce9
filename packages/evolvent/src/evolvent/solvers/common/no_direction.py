"""Forces without a direction: of springs that are compressed to length zero, of contacts at a centre."""

from __future__ import annotations

import numpy as np

from evolvent.assembly.assembled import Assembly
from evolvent.assembly.families import owner
from evolvent.model.registry import asked


def passages(assembly: Assembly) -> tuple[tuple[float, str], ...]:
    """First time (s) and a sentence of each spring that a motion has brought to length zero, after it."""
    found = []
    for name, passages_of in asked("passages").items():
        found += [(t, f"{owner(assembly, name, k)!r} {why}") for k, t, why in passages_of(assembly.model)]
    return tuple(found)


def without_normal(assembly: Assembly, when: str) -> str:
    """A sentence on the first contact of a step that has started with two centres at one place; '' for none."""
    for name, mask in asked("without_normal").items():
        for k in np.flatnonzero(mask(getattr(assembly.model, name))).tolist():
            return (
                f"{owner(assembly, name, k)!r} has the centre or axis of one body on that of the other {when}, where "
                f"its force has no direction; use a greater `stiffness`, or move them apart"
            )
    return ""
