"""Acceleration fields."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent.kernels import fields
from evolvent.kernels.blocks import MOVES, POSITION
from evolvent.model.family import Family, Kind, record, where
from evolvent.model.questions import AdjointSupport, Law, Moment, calls_law

Array = np.ndarray
_3, _33 = (3,), (3, 3)


def _at_masses(model: Any, k: int, moment: Moment, everywhere: bool) -> Iterator[tuple[Any, ...]]:
    """At points, free bodies, nodes of beams, and where threads leave their spools; or at the first of these."""
    time, y, _ = moment
    for block in model.blocks[(model.blocks["kind"] == POSITION) & (model.blocks["switch"] == MOVES)]:
        yield y[block["iq"] :][:3].copy(), y[block["iv"] :][:3].copy(), time
        if not everywhere:
            return
    for thread in model.threads:
        yield thread["Q"][:3].copy(), thread["Q"][3:].copy(), time
        if not everywhere:
            return


# accelerations of every mass: of an orbital frame K x - 2 w x v, or by a law; scale: statics' load factor
FIELDS = Family(
    "fields",
    record("kind law first last", "K w scale", "force power work", K=_33, w=_3, force=_3),
    order=100,
    results={
        "force": ("force", "N", "resultant on all masses, inertial axes"),
        "power": ("power", "W", "power of the field"),
        "work": ("work", "J", "work since the first sample, by the trapezoidal rule over the samples"),
    },
    kinds=(
        Kind("an orbital frame", which=where("kind", fields.ORBIT), symmetric=True),
        Kind("an acceleration field", which=where("kind", fields.LAW)),
    ),
    laws=(Law("force", calls_law, _at_masses),),
    of_step=False,
    stiff=False,
    adjoint=AdjointSupport("its force follows from the state and time, with all derivatives"),
)  # fmt: skip

# points by which fields are integrated over a body (`local`) or an element (S, of its nodal vectors); -1 for none
FIELD_POINTS = Family(
    "field_points",
    record("body element", "mass local S", local=_3, S=(8,)),
    order=110,
    of="fields",
)  # fmt: skip
