"""Points."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from evolvent.kernels import calls, points
from evolvent.kernels.blocks import POSITION
from evolvent.model.family import Family, Kind, Records, record, where
from evolvent.model.questions import (
    AdjointSupport,
    Block,
    Coordinates,
    Felt,
    Inertia,
    LinearizedPoint,
    Parts,
    Samples,
    Stability,
    State,
    Statics,
    never,
)
from evolvent.model.shares import Shares
from evolvent_base.errors import InputError

Array = np.ndarray
_3 = (3,)


@calls.force
def inertia(interval, model):
    """Inertia of all points less their forces."""
    points.add_point_residual(interval.dv, interval.step.over, model.info.nq, model.points, model.F)


@calls.tangent
def inertia_tangent(interval, model, matrix):
    """Masses of all points."""
    points.add_point_tangent(interval.step.c_mass, model.info.nq, model.points, matrix)


@calls.energy
def energy(interval, model, out):
    """Kinetic energy of all points."""
    points.add_point_energy(interval.ym, model.points, out, 0)


@calls.momentum
def momentum(y, model, out):
    """Momenta of all points."""
    points.add_point_momenta(y, model.points, out[:3], out[3:])


def _positions(records: Records, _: Mapping[str, Any]) -> Iterator[Block]:
    for k, point in enumerate(records("points")):
        if point["mass"] > 0.0:  # the others are nodes of beams
            yield Block(POSITION, point["iq"], point["iv"], k, point["mass"])


@calls.force
def evaluate(interval, model):
    """Momenta and energies of all points."""
    points.evaluate_points(interval.ym, model.points)


@calls.turning_tangent
def turning_tangent(factor, spin, y, model, matrix):
    """Derivatives of the forces by a steady turn."""
    for k in range(model.points.size):
        points.add_centrifugal(factor * model.points[k].mass, model.points[k].iv - model.info.nq, spin, matrix)


def _point(assembly: Any, name: str, index: int, where: slice, y: Array) -> Iterator[tuple[str, LinearizedPoint]]:
    first = int(assembly.model.points["iq"][index])
    yield name, LinearizedPoint(np.array(y[first : first + 3]), where, np.eye(3), None)


def _place(builder: Any, at: Any) -> Any:
    if at.on is not None:
        raise InputError(f"{at.key} is {at.where!r}; {at.name!r} is a point mass, which has no {at.on!r}")
    row = builder.rows["points"][at.row]
    return builder.on_coordinates("points", at.row, row["iq"], row["iv"])


@calls.kick
def kick(y, s, model, dy):
    """Velocities of all points jump by the impulses that their f hold."""
    points.kick_points(y, model.points)


# without mass: a node of a beam, whose coordinates it has
POINTS = Family(
    "points",
    record("iq iv", "mass compliance", "f linear kinetic", f=_3, linear=_3),
    order=370,
    results={
        "linear": ("momentum", "kg m s-1", "linear momentum, inertial axes"),
        "kinetic": ("energy_kinetic", "J", "kinetic energy"),
    },
    kinds=(
        Kind("a point mass", which=lambda found: found["mass"] > 0.0, symmetric=True),
        Kind("a beam's node at a spring's end", which=where("mass", 0.0), symmetric=True),
    ),
    isolated=True,
    energy=energy,
    momentum=momentum,
    shares=Shares(),
    smooth=True,
    stiff=False,
    of_step=False,
    adjoint=AdjointSupport("its mass is constant", timed=False, rates=False, mirrored=True, smooth=True),
    parts=Parts(changes="mass compliance", reads_inertia=False, place=_place),
    state=State(
        unknowns=(Coordinates(_positions, 40, lambda found: 3 * int(np.sum(found["mass"] > 0.0))),), points=_point,
    ),
    inertia=Inertia(force=inertia, tangent=inertia_tangent, turning_tangent=turning_tangent, kick=kick),
    stability=Stability(
        felt=Felt(
            3, lambda found: found["mass"] > 0.0, lambda model, k, blocks: points.point_bound(model.points, k, blocks)
        ),
    ),
    statics=Statics(uneven=never),
    samples=Samples(local=True, evaluate=evaluate),
)  # fmt: skip
