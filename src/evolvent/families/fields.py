"""Acceleration fields."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.kernels import calls, fields
from evolvent.model.family import Family, Kind, record, where
from evolvent.model.powers import MARKER_LOADS
from evolvent.model.shares import INERTIA, Rule, Shares

Array = np.ndarray
_3, _33 = (3,), (3, 3)


@calls.force
def force(interval, model):
    """Forces of all fields on bodies, points and beams."""
    interval.powers[MARKER_LOADS] += fields.add_field_forces(interval.step.tm, interval.ym, model)
    fields.add_beam_fields(interval.step.tm, interval.ym, model, model.P)


@calls.tangent
def tangent(interval, model, matrix):
    """Derivatives of `force`."""
    fields.add_field_tangents(interval.step.tm, interval.ym, interval.step.c_rate, model, matrix)
def _at_full_scale(mechanism: Any, share: Any, at: Any, direction: Any, own: Array) -> None:
    own["scale"] = 1.0


# accelerations of every mass: of an orbital frame K x - 2 w x v, or by a law; scale: statics' load factor
FIELDS = Family(
    "fields",
    record("kind law first last", "K w scale", "force power work", K=_33, w=_3, force=_3),
    order=170,
    results={
        "force": ("force", "N", "resultant on all masses, inertial axes"),
        "power": ("power", "W", "power of the field"),
        "work": ("work", "J", "work since the first sample, by the trapezoidal rule over the samples"),
    },
    kinds=(
        Kind("an orbital frame", which=where("kind", fields.ORBIT), symmetric=True),
        Kind("an acceleration field", which=where("kind", fields.LAW)),
    ),
    force=force,
    tangent=tangent,
    by_rates=False,
    reads_inertia=False,
    smooth=True,
    shares=Shares((Rule(INERTIA),), place=17, prepare=_at_full_scale),
)  # fmt: skip

# points by which fields are integrated over a body (`local`) or an element (S, of its nodal vectors); -1 for none
FIELD_POINTS = Family(
    "field_points",
    record("body element", "mass local S", local=_3, S=(8,)),
    order=180,
    of="fields",
    reads_inertia=True,
)  # fmt: skip
