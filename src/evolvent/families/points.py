"""Points."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.base.errors import InputError
from evolvent.model.family import Family, Kind, record, where

Array = np.ndarray
_3 = (3,)


def _place(builder: Any, at: Any) -> Any:
    if at.on is not None:
        raise InputError(f"{at.key} is {at.where!r}; {at.name!r} is a point mass, which has no {at.on!r}")
    row = builder.rows["points"][at.index]
    return builder.on_coordinates("points", at.index, row["iq"], row["iv"])


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
    place=_place,
)  # fmt: skip
