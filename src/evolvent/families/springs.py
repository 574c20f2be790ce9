"""Springs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent.kernels import calls, springs
from evolvent.kernels.ends import of_markers
from evolvent.model.family import End, Family, Kind, Records, record
from evolvent.model.powers import MARKER_LOADS, SPRINGS as BY_SPRINGS

Array = np.ndarray
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


# slack: 1 of one that only pulls; of a step: lengths at both ends, and direction at its end; line, line0: vector
# from a to b, of the last state and of the last step; passed: see `kernels.springs.note_lines`; the others are in
# `RESULTS`, and lost: W, dissipated
SPRINGS = Family(
    "springs",
    record(
        "a b law first last slack",
        "stiffness damping length lateral_stiffness lateral_damping axis",
        "length0 length1 end line line0 passed distance extension rate tension lateral stored lost",
        axis=_3, end=_3, line=_3, line0=_3, lateral=_3,
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
    force=force,
    tangent=tangent,
    measure=measure,
    energy=energy,
    by_rates=False,
    evaluate=evaluate,
)  # fmt: skip
