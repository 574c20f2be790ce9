"""Points."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from evolvent.kernels import points
from evolvent.kernels.blocks import POSITION
from evolvent.model.family import Family, Kind, Records, record, where
from evolvent.model.questions import AdjointSupport, Block, Coordinates, Felt, LinearizedPoint, never

Array = np.ndarray
_3 = (3,)


def _positions(records: Records, _: Mapping[str, Any]) -> Iterator[Block]:
    for k, point in enumerate(records("points")):
        if point["mass"] > 0.0:  # the others are nodes of beams
            yield Block(POSITION, point["iq"], point["iv"], k, point["mass"])


def _point(assembly: Any, name: str, index: int, where: slice, y: Array) -> Iterator[tuple[str, LinearizedPoint]]:
    first = int(assembly.model.points["iq"][index])
    yield name, LinearizedPoint(np.array(y[first : first + 3]), where, np.eye(3), None)


# without mass: a node of a beam, whose coordinates it has
POINTS = Family(
    "points",
    record("iq iv", "mass compliance", "f linear kinetic", f=_3, linear=_3),
    order=20,
    results={
        "linear": ("momentum", "kg m s-1", "linear momentum, inertial axes"),
        "kinetic": ("energy_kinetic", "J", "kinetic energy"),
    },
    kinds=(
        Kind("a point mass", which=lambda found: found["mass"] > 0.0, symmetric=True),
        Kind("a beam's node at a spring's end", which=where("mass", 0.0), symmetric=True),
    ),
    isolated=True,
    of_step=False,
    stiff=False,
    adjoint=AdjointSupport("its mass is constant", timed=False),
    coordinates=(Coordinates(_positions, 40, lambda found: 3 * int(np.sum(found["mass"] > 0.0))),),
    felt=Felt(
        3, lambda found: found["mass"] > 0.0, lambda model, k, blocks: points.point_bound(model.points, k, blocks)
    ),
    uneven=never,
    points=_point,
)  # fmt: skip
