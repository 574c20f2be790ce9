"""Springs."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from evolvent.families.relaxation.family import set_of
from evolvent.families.springs import springs
from evolvent.kernels import calls, markers
from evolvent.kernels.ends import of_markers
from evolvent.kernels.extremes import note_extremes
from evolvent.model.family import End, Family, Kind, Records, record
from evolvent.model.powers import MARKER_LOADS, SPRINGS as BY_SPRINGS
from evolvent.model.questions import (
    AdjointSupport,
    Bound,
    Energies,
    Explicit,
    Implicit,
    Law,
    Moment,
    Notes,
    Parts,
    Samples,
    Stability,
    Statics,
    Step,
    calls_law,
)
from evolvent.model.shares import DAMPING, SPRING, Rule, Shares

Array = np.ndarray
#: What helps where a spring has no line.
INSTEAD = "set `slack` if it only pulls, stop its ends before (a contact), or use a law without force there"
_3 = (3,)


def _of_spring(row: Any, records: Records) -> Iterator[End]:
    yield from of_markers([row["a"], row["b"]], records)


@calls.force
def force(interval, model):
    """Forces of all springs."""
    lost, given = springs.spring_forces(interval.step.tm, interval.ym, interval.step.h, model)
    interval.powers[BY_SPRINGS] += lost
    interval.powers[MARKER_LOADS] += given


@calls.tangent
def tangent(interval, model, matrix):
    """Derivatives of `force`."""
    step = interval.step
    springs.spring_tangents(step.tm, interval.ym, step.h, step.c_rate, model, matrix)


@calls.measure
def measure(end, t, y, model):
    """Lengths of all springs."""
    springs.measure_springs(end, y, model)


@calls.energy
def energy(interval, model, out):
    """Elastic energy of all springs."""
    out[1] += springs.evaluate_springs(interval.step.t, interval.ym, model)


@calls.force
def evaluate(interval, model):
    """Lengths, forces and energies of all springs."""
    springs.evaluate_springs(interval.step.t, interval.ym, model)


@calls.force
def end_step(interval, model):
    """What relaxation of all springs takes over a step."""
    interval.powers[BY_SPRINGS] += springs.relaxed_springs(interval.step.h, interval.step.share, model)


@calls.note_extremes
def note_springs(s, model):
    """Extremes of the extensions and tensions of all springs."""
    rows = model.springs
    for k in range(rows.size):
        note_extremes(rows[k].extremes, 0, rows[k].extension)
        note_extremes(rows[k].extremes, 1, rows[k].tension)


def _at_ends(model: Any, k: int, moment: Moment, _: bool) -> Iterator[tuple[Any, ...]]:
    length, *_others, rate = springs.spring_ends(moment[1], 0.0, k, model)[2]
    yield length - float(model.springs["length"][k]), rate, moment[0]


def _bound(model: Any, y: Array, felt: Mapping[str, Array]) -> Iterator[Bound]:
    springs.add_spring_bound(y, model, felt["bodies"], felt["points"])
    return iter(())


def _uneven(turn: Any, rows: list[int]) -> Iterator[int]:
    """Those that do not end on the axis, or act across another one."""
    model = turn.model
    for k in rows:
        row = model.springs[k]
        own = [model.markers[row[key]] for key in "ab"]
        held = [m for m in own if m["kind"] == markers.ON_BODY and turn.still[m["index"]]]
        places = [turn.place(m["index"], m["local"]) for m in held]
        lateral = row["lateral_stiffness"] == 0.0 or turn.along(row["axis"])
        if not (lateral and row["lateral_damping"] == 0.0 and all(turn.on_axis(x) for x in places)):
            yield k


def _no_balance(model: Any, t: float, y: Array) -> Iterator[tuple[int, str]]:
    """Springs without a line but with a force."""
    for k, row in enumerate(model.springs):
        length = springs.spring_ends(y, 0.0, k, model)[2][0]
        force = springs.force_without_line(t, k, model) if length <= springs.NO_LINE * float(row["length"]) else 0.0
        if not math.isclose(force, 0.0):
            why = (
                f"has length zero, where its force of {abs(force):.3g} N has no direction: this is no equilibrium; "
                f"move one of its ends at the start, or {INSTEAD}"
            )
            yield k, why


def _passages(model: Any) -> Iterator[tuple[int, float, str]]:
    """Springs that the motion has brought to length zero."""
    for k in np.flatnonzero(np.isfinite(model.springs["passed"])).tolist():
        t = float(model.springs["passed"][k])
        force = abs(springs.force_without_line(t, k, model))
        why = (
            f"comes to length zero at t = {t:.6g} s, where its force of {force:.3g} N has no direction: it jumps to "
            f"the other side if its ends pass through one another, and is missing while they stay together; {INSTEAD}"
        )
        yield k, t, why


def _sets(model: Any, index: int) -> Iterator[tuple[str, float, str]]:
    yield "extension beyond the natural length", float(set_of(model, model.springs[index])[0]), "m"


def _pulling(model: Any) -> Array:
    own = model.springs
    return np.flatnonzero((own["slack"] != 0) & (own["prony_end"] == own["prony"]))


# slack: 1 of one that only pulls, slope: derivative of its tension over its stiffness where it relaxes; of a step:
# lengths at both ends, and direction at its end; line, line0: vector from a to b, of the last state and of the last
# step; passed: see `springs.note_lines`; the others are in `RESULTS`, and lost: W, dissipated
SPRINGS = Family(
    "springs",
    record(
        "a b law first last slack prony prony_end branch",
        "stiffness damping length lateral_stiffness lateral_damping axis",
        "length0 length1 end slope line line0 passed distance extension rate tension lateral stored lost "
        "extremes",
        extremes=(4,), axis=_3, end=_3, line=_3, line0=_3, lateral=_3,
    ),
    order=150,
    results={
        "distance": ("length", "m", "length"),
        "extension": ("extension", "m", "length minus the natural length"),
        "rate": ("extension_rate", "m s-1", "rate of the extension"),
        "tension": ("force", "N", "tension, elastic and damping part, positive where the spring pulls"),
        "lateral": (
            "lateral_force",
            "N",
            "force on end b across the axis of the mount, elastic and damping part, inertial axes",
        ),
        "stored": ("energy_elastic", "J", "elastic energy"),
    },
    kinds=(
        Kind("a spring", symmetric=True),
    ),
    ends=_of_spring,
    isolated=True,
    force=force,
    tangent=tangent,
    energy=energy,
    laws=(Law("spring", calls_law, _at_ends),),
    shares=Shares(
        (
            Rule(SPRING, "", ("stiffness", "law"), rates=False),
            Rule(SPRING, "law_of_rate", ("law",), rates=True),
            Rule(DAMPING, "damping", ("damping", "lateral_damping")),
            Rule(SPRING, "lateral", ("lateral_stiffness",)),
        ),
        place=1, pulling=_pulling,
    ),
    smooth=True,
    of_step=False,
    adjoint=AdjointSupport(
        "its force follows from the state, with all derivatives", timed=calls_law, mirrored=True,
        rates=lambda model: any(np.any(model.springs[name]) for name in ("law", "damping", "lateral_damping")),
        smooth=lambda found: (found["slack"] == 0) & (found["law"] == 0),
    ),
    parts=Parts(changes="stiffness damping length lateral_stiffness lateral_damping", reads_inertia=False),
    explicit=Explicit(note_stage=springs.note_lines),
    stability=Stability(by_rates=False, bound=_bound),
    implicit=Implicit(end_step=end_step),
    step=Step(measure=measure),
    statics=Statics(uneven=_uneven, no_balance=_no_balance, sets=_sets),
    energies=Energies(resists=("extension", "tension")),
    samples=Samples(
        local=True, evaluate=evaluate, extremes=("extension", "tension"), note_extremes=note_springs
    ),
    notes=Notes(passages=_passages),
)  # fmt: skip
