"""Points."""

from __future__ import annotations

import numpy as np

from evolvent.model.family import Family, Kind, record, where
from evolvent.model.questions import AdjointSupport

Array = np.ndarray
_3 = (3,)


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
)  # fmt: skip
