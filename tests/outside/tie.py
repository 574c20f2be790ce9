"""A family from outside the package with a row of constraint and an event: a point mass keeps its distance from others.

The gap (|d|^2 - l^2)/(2 l) of the vector d between both, or from a fixed place, is a square, so that the gradient of
the mean state does the work of its change.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from evolvent.algebra.sparse import add_entry
from evolvent.families.joints.part_release import ReleaseName, release_fields
from evolvent.kernels import calls, constraints
from evolvent.kernels.watches import CHANGES
from evolvent.model.family import Family, Kind, record
from evolvent.model.layout import Events, Switches
from evolvent.model.questions import AdjointSupport, Rows
from evolvent.model.shares import Shares
from evolvent.parts.base import Part, PointReference
from evolvent_base import units


@calls.row_measure
def measure(end, t, y, k, model):
    """Gap and rate of the row, and the vector between both ends."""
    row, own = model.constraints[k], model.ties[model.constraints[k].record]
    square = along = speed = 0.0
    for c in range(3):
        x, v = (own.place[c], 0.0) if own.iqa < 0 else (y[own.iqa + c], y[own.iva + c])
        own.d[c], rate = y[own.iq + c] - x, y[own.iv + c] - v
        square, along, speed = square + own.d[c] * own.d[c], along + own.d[c] * rate, speed + rate * rate
    row.gap, row.rate = (square - own.length * own.length) / (2.0 * own.length), along / own.length
    own.bends = speed / own.length


@calls.row_bend
def bend(k, model):
    """Second derivative of the gap by the rates alone."""
    return model.ties[model.constraints[k].record].bends


@calls.row_force
def add_force(t, h, y, k, la, model, F):
    """Forces along the vector, over an interval along that of the mean state."""
    own, n_q = model.ties[model.constraints[k].record], model.info.nq
    if h > 0.0:
        constraints.measure(constraints.STATE, t, y, k, model)
    for c in range(3):
        F[own.iv - n_q + c] += la * own.d[c] / own.length
        if own.iqa >= 0:
            F[own.iva - n_q + c] -= la * own.d[c] / own.length


@calls.row_tangent
def add_tangent(k, la, row, scale, damped, model, matrix):
    """Gradient as row and column, and la times the second derivative, 1/l."""
    own, n_q = model.ties[model.constraints[k].record], model.info.nq
    for c in range(3):
        b, a, g = own.iv - n_q + c, own.iva - n_q + c, scale * own.d[c] / own.length
        add_entry(matrix, row, b, damped * g)
        add_entry(matrix, b, row, g)
        add_entry(matrix, b, b, la / own.length)
        if own.iqa >= 0:
            add_entry(matrix, row, a, -damped * g)
            add_entry(matrix, a, row, -g)
            add_entry(matrix, a, a, la / own.length)
            add_entry(matrix, a, b, -la / own.length)
            add_entry(matrix, b, a, -la / own.length)


@calls.row_note
def note(k, la, model):
    """The tension."""
    own = model.ties[model.constraints[k].record]
    own.tension = la * np.sqrt(own.d[0] ** 2 + own.d[1] ** 2 + own.d[2] ** 2) / own.length


@calls.event_values
def heights(t, y, s, model, first, g):
    """How far the points are above the heights at which their ties are cut."""
    for k in range(model.ties.size):
        own = model.ties[k]
        g[first + k] = y[own.iq + 2] - own.cut if own.cut < np.inf else -1.0


@calls.fire
def cut(t, k, ends, y, s, model):
    """Tie k no longer holds."""
    for row in range(model.constraints.size):
        if model.constraints[row].switch == model.ties[k].switch:
            constraints.release_row(t, row, ends, y, s, model)
    return CHANGES


def ends(row, _):
    """Both points, or the one."""
    return (("vectors", int(row[field])) for field in ("iv", "iva") if row[field] >= 0)


TIES = Family(
    "ties",
    record("iq iv iqa iva event switch", "length place until latest cut", "d bends tension", place=(3,), d=(3,)),
    order=510,
    offsets=("iv", "iva"),
    results={"tension": ("tension", "N", "tension of the tie")},
    kinds=(Kind("a tie", symmetric=True),),
    ends=ends, times=("until",), shares=Shares(), smooth=True, stiff=False, isolated=True,
    outside=lambda found: found["iqa"] < 0,
    switches=(Switches(lambda found: np.isfinite(found["cut"])),),
    events=(Events(lambda found: found.size, lambda _, k: (k, "cut"), values=heights, fire=cut),),
    adjoint=AdjointSupport("its gap follows from the state, with all derivatives", timed=False),
    **constraints.answers(Rows(measure=measure, bend=bend, force=add_force, tangent=add_tangent, note=note)),
)  # fmt: skip


class Tie(Part):
    """A massless tie that keeps the distance of the point mass `b` from another, or from a fixed place.

    It is cut where `b` rises through the height `cut`.
    """

    kind: Literal["tie"] = "tie"
    a: PointReference
    b: PointReference
    cut: units.Coordinate | None = None
    until: units.Duration | None = None
    released_by: ReleaseName | None = None

    def write(self, builder: Any, name: str) -> None:
        """Write the row."""
        a, b = (builder.location(getattr(self, key), f"{name}.{key}") for key in "ab")
        length = float(np.linalg.norm(b.x - a.x))
        own = {"iqa": a.iq, "iva": a.iv, "iq": b.iq, "iv": b.iv, "place": a.x, "length": length}
        own["cut"] = np.inf if self.cut is None else self.cut
        builder.names[name] = ("ties", builder.add("ties", **own, **release_fields(builder, name, self)))
