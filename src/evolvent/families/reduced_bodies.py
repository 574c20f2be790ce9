"""Reduced bodies."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.base.errors import InputError, nearest
from evolvent.model.family import Family, Kind, record

Array = np.ndarray
_3 = (3,)


def _place(builder: Any, at: Any) -> Any:
    """An interface node of a reduced body."""
    names = [*builder.body_points[at.name]]
    number = names.index(at.on) if at.on in names else at.on
    if not isinstance(number, int) or number >= len(names):
        found = "names no interface node of it" if at.on is None else f"has no node {at.on!r}"
        raise InputError(f"{at.key} is {at.where!r}, which {found}; {nearest(str(at.on), names)}")
    return builder.on_body(builder.rows["reduced_bodies"][at.index]["first_body"] + 1 + number, (0.0, 0.0, 0.0))


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
    place=_place,
)  # fmt: skip

# of a step: change of the coordinate, and that over the step before
MODAL = Family(
    "modes",
    record("", "stiffness damping", "change before"),
    order=230,
    of="reduced_bodies",
)  # fmt: skip
