"""Loads."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent.kernels import calls, loads, markers, rigid
from evolvent.model.family import WORK, Family, Kind, has_parameters, record, where
from evolvent.model.powers import MARKER_LOADS
from evolvent.model.questions import AdjointSupport, Drives, Law, Moment, Parts, Samples, Stability, Statics
from evolvent.model.shares import LOAD, Rule, Shares

Array = np.ndarray
_3 = (3,)


def _at_markers(found: Array) -> Array:
    return np.asarray((found["kind"] >= loads.AT_MARKER) & (found["kind"] != loads.PANEL))


def _keeps_direction(model: Any, found: Array) -> bool:
    """Whether no load on a thread stands in the axes of a body that may turn."""
    for load in found[(found["kind"] == loads.UNIFORM) | (found["kind"] == loads.NODE)]:
        reel = model.threads["body"][load["target"]]
        if model.parameters[load["first"] + loads.FRAME] != 0.0 and model.bodies["motion"][reel] != rigid.DRIVEN:
            return False
    return not np.any(found["kind"] == loads.RADIATION)


def _is_potential(model: Any, found: Array) -> bool:
    """Whether no torque acts on a free body, and no force that turns with it."""
    for load in found:
        marker = model.markers[load["target"]]
        on_free = marker["kind"] == markers.ON_BODY and model.bodies["motion"][marker["index"]] == rigid.FREE
        if on_free and (load["kind"] == loads.TORQUE or model.parameters[load["first"] + loads.FRAME] != 0.0):
            return False
    return True


@calls.force
def force(interval, model):
    """Forces and torques on points and bodies."""
    interval.powers[MARKER_LOADS] += loads.concentrated_loads(interval.step.tm, interval.ym, model)


@calls.tangent
def tangent(interval, model, matrix):
    """Derivatives of `force`."""
    loads.add_load_tangents(interval.step.tm, interval.ym, interval.step.c_rate, model, matrix)


@calls.scale
def scale(factor, parameters, model):
    """Vectors of all loads at a load factor, and the factor of laws."""
    for k in range(model.loads.size):
        first = model.loads[k].first
        for c in range(loads.vector_size(model.loads[k].kind)):
            model.parameters[first + c] = factor * parameters[first + c]
        model.loads[k].scale = factor


@calls.force
def evaluate(interval, model):
    """Loads at markers."""
    step = interval.step
    loads.evaluate_loads(int(step.sample), interval.times, interval.ym, step.factor, model)


def _at_marker(model: Any, row: Any, moment: Moment) -> Iterator[tuple[Any, ...]]:
    marker = model.markers[row["target"]]
    found = markers.marker_kinematics(moment[1], model.markers, model.points, model.bodies, row["target"])
    body = model.bodies[marker["index"]]
    x, v = np.array(found[:3]), np.array(found[3:])
    if row["kind"] == loads.TORQUE:
        v = body["w"].copy()
    if row["attitude"] != 0:
        x = np.concatenate([x, body["R"].ravel()])
    yield x, v, moment[0]


def _on_target(model: Any, k: int, moment: Moment, everywhere: bool) -> Iterator[tuple[Any, ...]]:
    """At the marker; of a thread at the reel, or at every node as well."""
    row = model.loads[k]
    if row["kind"] >= loads.AT_MARKER:
        yield from _at_marker(model, row, moment)
        return
    thread = model.threads[row["target"]]
    if everywhere:
        for node in model.nodes[int(thread["node"]) : int(thread["node"] + thread["n"])]:
            yield node["x"].copy(), node["v"].copy(), moment[0]
    yield thread["Q"][:3].copy(), thread["Q"][3:].copy(), moment[0]


def _uneven(turn: Any, rows: list[int]) -> Iterator[int]:
    """Those that neither turn with what they act on nor are along the axis."""
    for k in rows:
        row = turn.model.loads[k]
        if row["law"] != 0 or row["kind"] == loads.LAW:
            yield k
            continue
        p = turn.model.parameters[row["first"] : row["last"]]
        fixed = row["kind"] in (loads.RADIATION, loads.PANEL) or p[loads.FRAME] == 0.0
        if fixed and not turn.along(p[:3]):
            yield k


def _acts_on(model: Any, k: int, parameters: Array, time: float) -> tuple[str, int] | None:
    """A body or point at whose marker a force or torque acts."""
    row = model.loads[k]
    p, marker = parameters[row["first"] : row["last"]], model.markers[row["target"]]
    if row["kind"] < loads.AT_MARKER or not (np.any(p[:3]) and p[loads.START] <= time < p[loads.END]):
        return None
    return "bodies" if marker["kind"] == markers.ON_BODY else "points", int(marker["index"])


def _end_ramps(model: Any) -> None:
    for load in model.loads[(model.loads["kind"] >= loads.AT_MARKER) | (model.loads["kind"] == loads.NODE)]:
        model.parameters[load["first"] + loads.RAMP] = 0.0


# first, last: own parameters, and those of a profile or of a law of a thread's load; law_first, law_last: of the
# law of a force or torque; node: of a thread; attitude: 1 of a torque whose law is called with it, 2 of one that
# follows it; scale: statics' load factor of a law on a thread; rod: 1 + rod whose length that is out it follows, or
# 0; vector, middle, power, work: see `RESULTS`; rate, along: `kernels.work`
LOADS = Family(
    "loads",
    record(
        "kind target law first last law_first law_last node attitude rod", "scale",
        "vector middle power work rate along",
        vector=_3, middle=_3,
    ),
    order=160,
    results={
        "vector": ("force", "N", "force or torque that acts, inertial axes"),
        "middle": ("position", "m", "where it acts, or the middle of the released thread, inertial axes"),
        "power": ("power", "W", "power of the load"),
        "work": ("work", "J", WORK),
    },
    kinds=(
        Kind(
            "a load on a thread",
            which=lambda found: (found["kind"] < loads.AT_MARKER) & (found["kind"] != loads.NODE),
            symmetric=_keeps_direction,
        ),
        Kind("a force on a node of a thread", which=where("kind", loads.NODE), symmetric=_keeps_direction),
        Kind(
            "a force or torque",
            which=lambda found: _at_markers(found) & ~has_parameters(found, loads.PROFILE) & (found["law"] == 0),
            symmetric=_is_potential,
        ),
        Kind(
            "a force or torque by a profile",
            which=lambda found: _at_markers(found) & has_parameters(found, loads.PROFILE) & (found["law"] == 0),
            symmetric=_is_potential,
        ),
        Kind("radiation pressure on a panel", which=where("kind", loads.PANEL)),
        Kind("a force or torque by a law", which=lambda found: _at_markers(found) & (found["law"] != 0)),
    ),
    force=force,
    tangent=tangent,
    laws=(
        Law("force", lambda found: (found["law"] != 0) & (found["kind"] == loads.LAW), _on_target, as_left=True),
        Law(
            "force", lambda found: (found["law"] != 0) & (found["kind"] != loads.LAW), _on_target, before="law_",
            as_left=True,
        ),
    ),
    shares=Shares((Rule(LOAD),), place=14),
    smooth=True,
    stiff=False,
    of_step=False,
    adjoint=AdjointSupport("its force follows from the state and time, with all derivatives", mirrored=True),
    parts=Parts(several=True, changes="", reads_inertia=False),
    stability=Stability(by_rates=False),
    drives=Drives(end_ramps=_end_ramps),
    statics=Statics(scale=scale, uneven=_uneven, acts_on=_acts_on),
    samples=Samples(evaluate=evaluate),
)  # fmt: skip
