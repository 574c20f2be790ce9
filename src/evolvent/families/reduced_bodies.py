"""Reduced bodies."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from evolvent.families.bodies import node_point
from evolvent.kernels import reduced
from evolvent.kernels.blocks import SCALAR
from evolvent.model.family import Family, Kind, Records, record
from evolvent.model.questions import AdjointSupport, Block, Bound, Coordinates, LinearizedPoint, never

Array = np.ndarray
_3 = (3,)


def _modal(records: Records, _: Mapping[str, Any]) -> Iterator[Block]:
    for k, row in enumerate(records("reduced_bodies")):
        for i in range(int(row["modes"])):
            yield Block(SCALAR, row["iq"] + i, row["iv"] + i, k, row["mass"])


def _frame_and_nodes(row: Any) -> range:
    return range(int(row["first_body"]), int(row["first_body"] + row["nodes"]) + 1)


def _bound(model: Any, _: Array, felt: Mapping[str, Array]) -> Iterator[Bound]:
    return ((k, *reduced.mode_bounds(model, k)) for k in range(model.reduced_bodies.size))


def _sizes(model: Any, length: float) -> Iterator[tuple[Any, Any]]:
    for row in model.reduced_bodies:
        yield np.arange(row["iv"], row["iv"] + row["modes"]), length


def _points(assembly: Any, name: str, index: int, where: slice, y: Array) -> Iterator[tuple[str, LinearizedPoint]]:
    """Frame and interface nodes."""
    names = assembly.parts[name].model.names
    for k, b in enumerate(_frame_and_nodes(assembly.model.reduced_bodies[index])):
        point = node_point(assembly.model, b, y)
        for place in (f"{name}.{names[k - 1]}", f"{name}[{k - 1}]") if k > 0 else (name,):
            yield place, point


# reduced flexible bodies: the bodies from first_body on are the frame and the interface nodes; modes, first_mode:
# of the modal coordinates at iq, iv; mass: of each of them
REDUCED_BODIES = Family(
    "reduced_bodies",
    record(
        "first_body nodes first_mode modes iq iv", "mass", "kinetic elastic linear angular", linear=_3, angular=_3
    ),
    order=220,
    results={
        "kinetic": ("energy_kinetic", "J", "kinetic energy"),
        "elastic": ("energy_elastic", "J", "strain energy"),
        "linear": ("momentum", "kg m s-1", "linear momentum, inertial axes"),
        "angular": ("angular_momentum", "kg m2 s-1", "angular momentum about the inertial origin"),
    },
    kinds=(
        Kind("a reduced body", symmetric=True),
    ),
    isolated=True,
    of_step=False,
    stiff=lambda found: found["modes"] > 0,
    adjoint=AdjointSupport(
        "its stiffness is constant in its modes", filtered="strains of reduced bodies", timed=False,
    ),
    coordinates=(Coordinates(_modal, 70, lambda found: 0),),
    consists_of=_frame_and_nodes,
    uneven=never,
    bound=_bound,
    sizes=_sizes,
    points=_points,
)  # fmt: skip

# of a step: change of the coordinate, and that over the step before
MODAL = Family(
    "modes",
    record("", "stiffness damping", "change before"),
    order=230,
    of="reduced_bodies",
)  # fmt: skip
