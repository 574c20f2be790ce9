"""Forces without a direction: of springs that are compressed to length zero, of contacts at a centre."""

from __future__ import annotations

import math

import numpy as np

from evolvent.assembly.assembled import Assembly
from evolvent.assembly.families import owner
from evolvent.kernels import body_gaps, springs, surfaces
from evolvent.model import Model

#: Distance beside the radius below which the normal of a contact that presses jumps.
NEAR = 1e-7
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


def on_edges(assembly: Assembly, model: Model) -> str:
    """A sentence on the first contact that presses in a state where its normal jumps; '' for none.

    Notes
    -----
    At a centre or axis, where a point lies on an edge of the core of a box, which is the box less its rounding, and
    where edges cross in one plane, as of boxes that are flush: round-off alone has a direction there.
    """
    for k, row in enumerate(model.body_contacts):
        small = NEAR * float(row["radius"])
        if row["surface"] == surfaces.PLANE or not row["force"] > 0.0 or abs(row["distance"]) > small:
            continue
        place = np.abs([row["u1"], row["v1"], row["w1"]])
        if row["surface"] != body_gaps.BOX or np.sum(place >= row["sides"] - small) > 1:
            return (
                f"{owner(assembly, 'body_contacts', k)!r} is {-row['gap1']:.3g} m deep, where its force of "
                f"{row['force']:.3g} N has no direction: this is no equilibrium; use a greater `stiffness`, of boxes "
                f"also a greater `rounding`"
            )
    return ""
