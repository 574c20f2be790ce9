"""Custom forces."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent.families.springs import custom
from evolvent.kernels import calls, markers
from evolvent.kernels.ends import of_markers
from evolvent.model.family import End, Family, Kind, Records, record
from evolvent.model.powers import MARKER_LOADS, SPRINGS
from evolvent.model.questions import Coupling, Law, Moment, Parts
from evolvent.model.shares import LOAD, Rule, Shares

Array = np.ndarray


def _of_custom(row: Any, records: Records) -> Iterator[End]:
    first = int(row["first_marker"])
    yield from of_markers(slice(first, first + int(row["points"])), records)


def _is_reciprocal(_: Any, found: Array) -> bool:
    return bool(np.all(found["symmetric"] != 0.0))


@calls.ties
def ties(t, model):
    """Whether the last forces had a sum or a torque."""
    found = 0
    for k in range(model.custom_forces.size):
        if model.custom_forces[k].balanced == 0.0:
            found = 1
    return found


@calls.force
def force(interval, model):
    """Forces of all laws between points."""
    lost, given = custom.add_custom_forces(interval.step.tm, interval.ym, model)
    interval.powers[SPRINGS] += lost
    interval.powers[MARKER_LOADS] += given


@calls.tangent
def tangent(interval, model, matrix):
    """Derivatives of `force`."""
    custom.add_custom_tangents(interval.step.tm, interval.ym, interval.step.c_rate, model, matrix)


@calls.energy
def energy(interval, model, out):
    """Energy of all laws that state one."""
    out[1] += custom.custom_energies(interval.step.t, interval.ym, model)


def _at_points(model: Any, k: int, moment: Moment, _: bool) -> Iterator[tuple[Any, ...]]:
    row, (time, y, _s) = model.custom_forces[k], moment
    own = range(int(row["first_marker"]), int(row["first_marker"] + row["points"]))
    states = np.array([markers.marker_kinematics(y, model.markers, model.points, model.bodies, m) for m in own])
    yield time, states[:, :3].ravel(), states[:, 3:6].ravel()


# a user-defined law between points, which are markers, from first_marker on. balanced: 1 where the last forces had
# neither a resultant nor a moment; symmetric: 1 where their last derivatives by position were symmetric;
# stated: 1 once the law has given an energy or a power
CUSTOM_FORCES = Family(
    "custom_forces",
    record("law first last first_marker points", "", "balanced symmetric stated"),
    order=260,
    kinds=(
        Kind("a custom force", symmetric=_is_reciprocal),
    ),
    ends=_of_custom,
    outside=lambda found: found["points"] == 1,
    isolated=True,
    force=force,
    tangent=tangent,
    energy=energy,
    laws=(
        Law(
            "element", lambda found: np.ones(found.size, dtype=bool), _at_points,
            room=lambda row: 3 * int(row["points"]), stated="stated",
        ),
    ),
    shares=Shares((Rule(LOAD, stored=True),), place=2),
    smooth=True,
    of_step=False,
    parts=Parts(
        reads_inertia=False,
        scratch=lambda records, _: {
            "custom": np.zeros(max(map(custom.scratch_size, records("custom_forces")["points"].tolist()), default=0))
        },
    ),
    coupling=Coupling(ties=ties),
)  # fmt: skip
