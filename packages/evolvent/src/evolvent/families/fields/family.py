"""Acceleration fields."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent.kernels import calls, fields, points, thread
from evolvent.kernels.blocks import MOVES, POSITION
from evolvent.kernels.work import note_power
from evolvent.model.family import Family, Kind, record, where
from evolvent.model.powers import MARKER_LOADS
from evolvent.model.questions import AdjointSupport, Law, Moment, Parts, Samples, Stability, Statics, calls_law
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


def _at_masses(model: Any, k: int, moment: Moment, everywhere: bool) -> Iterator[tuple[Any, ...]]:
    """At points, free bodies, nodes of beams, and where threads leave their spools; or at the first of these."""
    time, y, _ = moment
    for block in model.blocks[(model.blocks["kind"] == POSITION) & (model.blocks["switch"] == MOVES)]:
        yield y[block["iq"] :][:3].copy(), y[block["iv"] :][:3].copy(), time
        if not everywhere:
            return
    for row in model.threads:
        yield row["Q"][:3].copy(), row["Q"][3:].copy(), time
        if not everywhere:
            return


@calls.scale
def scale(factor, parameters, model):
    """The load factor of all fields."""
    for k in range(model.fields.size):
        model.fields[k].scale = factor


@calls.force
def prepare_sample(interval, model):
    """Load factor of all fields."""
    for k in range(model.fields.size):
        model.fields[k].scale = interval.step.factor


@calls.force
def evaluate_last(interval, model):
    """Resultant, power and work of each field on all masses; overwrites `Model.P`, forces on bodies and on points."""
    n_q, on, masses, bodies, P, blocks = model.info.nq, model.fields, model.points, model.bodies, model.P, model.blocks
    t, y, s, factor = interval.step.t, interval.ym, interval.s, interval.step.factor
    for k in range(on.size):
        force = on[k].force
        for i in range(on.size):
            on[i].scale = factor if i == k else 0.0
        points.clear_forces(masses)
        for b in range(bodies.size):
            for c in range(6):
                bodies[b].F[c] = 0.0
        for i in range(P.size):
            P[i] = 0.0
        for c in range(3):
            force[c] = 0.0
        power = fields.add_field_forces(t, y, model)
        fields.add_beam_fields(t, y, model, P)
        if model.threads.size > 0:
            power += thread.wound_fields(t, s, model) + thread.add_node_fields(t, s, model, force)
        for i in range(masses.size):
            for c in range(3):
                force[c] += masses[i].f[c]
        for b in range(bodies.size):
            for c in range(3):
                force[c] += bodies[b].F[c]
        for i in range(P.size):
            power += P[i] * y[n_q + i]
        for i in range(blocks.size):
            if blocks[i].kind == POSITION:
                for c in range(3):
                    force[c] += P[blocks[i].iv - n_q + c]
        note_power(on[k], int(interval.step.sample), interval.times, power)
    for k in range(on.size):
        on[k].scale = factor


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
    laws=(Law("force", calls_law, _at_masses),),
    shares=Shares((Rule(INERTIA),), place=17, prepare=_at_full_scale),
    smooth=True,
    stiff=False,
    of_step=False,
    adjoint=AdjointSupport("its force follows from the state and time, with all derivatives", mirrored=True),
    parts=Parts(reads_inertia=False),
    stability=Stability(by_rates=False),
    statics=Statics(frame=lambda row: row["w"] if row["kind"] == fields.ORBIT else None, scale=scale),
    samples=Samples(prepare=prepare_sample, evaluate=False, last=evaluate_last),
)  # fmt: skip

# points by which fields are integrated over a body (`local`) or an element (S, of its nodal vectors); -1 for none
FIELD_POINTS = Family(
    "field_points",
    record("body element", "mass local S", local=_3, S=(8,)),
    order=180,
    of="fields",
    parts=Parts(reads_inertia=True),
)  # fmt: skip
