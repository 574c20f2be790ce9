"""Forces without a direction: of springs that are compressed to length zero, of contacts at a centre."""

from __future__ import annotations

import numpy as np

from evolvent.assembly.assembled import Assembly
from evolvent.assembly.families import owner
from evolvent.families.springs import INSTEAD
from evolvent.kernels import body_gaps, springs, surfaces


def passages(assembly: Assembly) -> tuple[tuple[float, str], ...]:
    """First time (s) and a sentence of each spring that a motion has brought to length zero, after it."""
    found, rows = [], assembly.model.springs
    for k in np.flatnonzero(np.isfinite(rows["passed"])):
        t = float(rows["passed"][k])
        force = springs.force_without_line(t, int(k), assembly.model)
        found.append((
            t,
            f"{owner(assembly, 'springs', int(k))!r} comes to length zero at t = {t:.6g} s, where its force of "
            f"{abs(force):.3g} N has no direction: it jumps to the other side if its ends pass through one another, "
            f"and is missing while they stay together; {INSTEAD}",
        ))  # fmt: skip
    return tuple(found)


def without_normal(assembly: Assembly, when: str) -> str:
    """A sentence on the first contact of a step that has started with two centres at one place; '' for none."""
    for k, row in enumerate(assembly.model.body_contacts):
        if row["surface"] not in (surfaces.PLANE, body_gaps.BOX) and row["gap"] < 0.0 and row["distance0"] == 0.0:
            return (
                f"{owner(assembly, 'body_contacts', k)!r} has the centre or axis of one body on that of the other "
                f"{when}, where its force has no direction; use a greater `stiffness`, or move them apart"
            )
    return ""
