"""Beam loads."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent.families.loads import beam_loads, node_load_tangents, node_loads
from evolvent.families.loads.beam_loads import FIELD
from evolvent.kernels import calls
from evolvent.model.family import WORK, Family, Kind, has_parameters, record
from evolvent.model.questions import (
    AdjointSupport,
    Drives,
    Implicit,
    Law,
    Moment,
    Parts,
    Samples,
    Stability,
    Statics,
    calls_law,
)
from evolvent.model.shares import LOAD, Rule, Shares

Array = np.ndarray
_3 = (3,)


def follows(found: Array) -> Array:
    """Whether loads on beams follow their beam or a law: `node_loads.follows`."""
    return np.asarray((found["kind"] == node_loads.MOMENT) | (found["frame"] != 0) | (found["law"] != 0))


def _is_in_no_field(_: Any, found: Array) -> bool:
    return not np.any(found["kind"] == FIELD)


@calls.force
def force(interval, model):
    """All loads on beams."""
    beam_loads.add_beam_loads(interval.step.tm, interval.ym, interval.step.factor, model, model.P)


@calls.tangent
def tangent(interval, model, matrix):
    """Derivatives of loads that follow their beam, a law or a field."""
    node_load_tangents.add_following_tangents(interval.step.tm, interval.ym, interval.step.c_rate, model, matrix)
    beam_loads.add_field_tangents(interval.ym, model, matrix)


@calls.force
def evaluate(interval, model):
    """All loads on beams."""
    step = interval.step
    beam_loads.evaluate_beam_loads(int(step.sample), interval.times, interval.ym, step.factor, model)


def _at_vector(model: Any, k: int, moment: Moment, _: bool) -> Iterator[tuple[Any, ...]]:
    row, (time, y, _s) = model.beam_loads[k], moment
    at = row if row["iq"] >= 0 else model.beams[row["beam"]]
    iq, iv = int(at["iq"]), int(at["iv"])
    yield y[iq : iq + 3].copy(), y[iv : iv + 3].copy(), time


def _uneven(turn: Any, rows: list[int]) -> Iterator[int]:
    """Those that neither turn with their beam nor are along the axis."""
    for k in rows:
        row = turn.model.beam_loads[k]
        if row["kind"] == FIELD:
            even = turn.along(row["axis"]) and turn.on_axis(row["centre"])
        else:
            even = row["law"] == 0 and (row["frame"] != 0 or turn.along(row["axis"]))
        if not even:
            yield k


def _acts_on(model: Any, k: int, _: Array, time: float) -> tuple[str, int] | None:
    row = model.beam_loads[k]
    acts = row["value"] != 0.0 and row["start"] <= time < row["end"]
    return ("beams", int(row["beam"])) if acts else None


def _end_ramps(model: Any) -> None:
    model.beam_loads["ramp"] = 0.0


# loads on beams: a torque about an axis spread over the mass, a force per length, a force at a vector, a moment on
# a node; first, last: indices of a profile, or of a law's parameters; frame: 1 of section axes; now: last value;
# pitch: of the screw motion along which a torque acts, m/rad
BEAM_LOADS = Family(
    "beam_loads",
    record(
        "kind beam iq iv first last law frame", "value centre axis pitch start end ramp",
        "now vector middle power work rate along",
        centre=_3, axis=_3, vector=_3, middle=_3,
    ),
    order=40,
    results={
        "vector": ("force", "N", "force, resultant of a line load, or torque that acts, inertial axes"),
        "middle": ("position", "m", "where it acts, inertial axes"),
        "power": ("power", "W", "power of the load"),
        "work": ("work", "J", WORK),
    },
    kinds=(
        Kind(
            "a load on a beam",
            which=lambda found: ~has_parameters(found, 0) & ~follows(found), symmetric=_is_in_no_field,
        ),
        Kind(
            "a load on a beam by a profile",
            which=lambda found: has_parameters(found, 0) & ~follows(found),
            symmetric=_is_in_no_field,
        ),
        Kind(
            "a moment or follower force on a beam",
            which=lambda found: follows(found) & (found["law"] == 0),
        ),
        Kind("a load on a beam by a law", which=lambda found: found["law"] != 0),
    ),
    isolated=True,
    force=force,
    tangent=tangent,
    laws=(Law("force", calls_law, _at_vector),),
    times=("start", "end"),
    shares=Shares((Rule(LOAD),), place=16, standing=True),
    smooth=True,
    stiff=False,
    of_step=False,
    adjoint=AdjointSupport(
        "its force follows from the state and time, with all derivatives",
        mirrored=lambda found: (found["kind"] != node_loads.MOMENT) & (found["frame"] == 0),
    ),
    parts=Parts(reads_inertia=False),
    stability=Stability(by_rates=False),
    implicit=Implicit(inner=lambda found: int(np.sum(found["kind"] == FIELD))),
    drives=Drives(stops=lambda model, *_: model.beam_loads["start"] + model.beam_loads["ramp"], end_ramps=_end_ramps),
    statics=Statics(uneven=_uneven, acts_on=_acts_on),
    samples=Samples(evaluate=evaluate),
)  # fmt: skip
