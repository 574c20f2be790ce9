"""Bodies."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.base.errors import InputError, nearest
from evolvent.kernels import rigid
from evolvent.model.family import Family, Kind, record, where

Array = np.ndarray
_3, _33, _6, _66 = (3,), (3, 3), (6,), (6, 6)


def _place(builder: Any, at: Any) -> Any:
    """The origin of a body, or a point of its own."""
    points = builder.body_points.get(at.name, {})
    if at.on is not None and at.on not in points:
        what = f"node {at.on}" if isinstance(at.on, int) else f"point {at.on!r}"
        known = nearest(str(at.on), points) if points else "its key `points` names none"
        raise InputError(f"{at.key} is {at.where!r}; {at.name!r} has no {what}; {known}")
    return builder.on_body(at.index, points[at.on] if isinstance(at.on, str) else (0.0, 0.0, 0.0), at.on is None)


# path: 1 + kind of the drive (`kernels.drive`) that moves a driven body along `direction`, 0 for none; along: its
# acceleration, m/s2; of thread that moves with the body (`kernels.thread.step`): carried (kg), moment, own
# (inertia), and spin0, spin1, momentum by turning on spools at both ends of a step, body axes; torque: on a free
# body over a step, less that of its wheels, in the axes of the step's start
BODIES = Family(
    "bodies",
    record(
        "motion iq iv path path_first path_last path_law",
        "mass inertia axis R0 x0 rate spin_inertia direction",
        "R x v w M L F J a along carried moment own spin0 spin1 torque linear angular kinetic",
        inertia=_33, axis=_3, R0=_33, x0=_3, direction=_3, R=_33, x=_3, v=_3, w=_3, M=_66, L=_66, F=_6, a=_6,
        moment=_3, own=_33, spin0=_3, spin1=_3, torque=_3, linear=_3, angular=_3,
    ),
    order=10,
    results={
        "linear": ("momentum", "kg m s-1", "linear momentum, inertial axes"),
        "angular": ("angular_momentum", "kg m2 s-1", "angular momentum about {about}, inertial axes"),
        "kinetic": ("energy_kinetic", "J", "kinetic energy"),
    },
    kinds=(
        Kind(
            "a driven body", which=lambda found: (found["motion"] == rigid.DRIVEN) & (found["path"] == 0),
            symmetric=True,
        ),
        Kind(
            "a body driven along a line",
            which=lambda found: (found["motion"] == rigid.DRIVEN) & (found["path"] != 0),
            symmetric=True,
        ),
        Kind("a body that spins about an axis", which=where("motion", rigid.SPIN), symmetric=True),
        Kind("a free body", which=where("motion", rigid.FREE), symmetric=True),
    ),
    isolated=lambda found, _: not np.any(found["motion"] == rigid.SPIN),
    initial={"R": "R0", "x": "x0"},
    place=_place,
)  # fmt: skip
