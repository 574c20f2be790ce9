"""Forces without a direction: of springs that are compressed to length zero, of contacts at a centre."""

from __future__ import annotations

import math

import numpy as np

from evolvent.assembly.assembled import Assembly
from evolvent.assembly.families import owner
from evolvent.kernels import body_gaps, springs, surfaces
from evolvent.model import Model

#: What helps where a spring has no line.
_INSTEAD = "set `slack` if it only pulls, stop its ends before (a contact), or use a law without force there"


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
            f"and is missing while they stay together; {_INSTEAD}",
        ))  # fmt: skip
    return tuple(found)


def without_line(assembly: Assembly, model: Model, t: float, y: np.ndarray) -> str:
    """A sentence on the first spring without a line but with a force in a state, after `kinematics`; '' for none."""
    for k, row in enumerate(model.springs):
        length = springs.spring_ends(y, 0.0, k, model)[2][0]
        force = springs.force_without_line(t, k, model) if length <= springs.NO_LINE * float(row["length"]) else 0.0
        if not math.isclose(force, 0.0):
            return (
                f"{owner(assembly, 'springs', k)!r} has length zero, where its force of {abs(force):.3g} N has no "
                f"direction: this is no equilibrium; move one of its ends at the start, or {_INSTEAD}"
            )
    return ""


def without_normal(assembly: Assembly, when: str) -> str:
    """A sentence on the first contact of a step that has started with two centres at one place; '' for none."""
    for k, row in enumerate(assembly.model.body_contacts):
        if row["surface"] not in (surfaces.PLANE, body_gaps.BOX) and row["gap"] < 0.0 and row["distance0"] == 0.0:
            return (
                f"{owner(assembly, 'body_contacts', k)!r} has the centre or axis of one body on that of the other "
                f"{when}, where its force has no direction; use a greater `stiffness`, or move them apart"
            )
    return ""
