"""Beam loads."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.kernels import node_loads
from evolvent.kernels.beam_loads import FIELD
from evolvent.model.family import WORK, Family, Kind, has_parameters, record

Array = np.ndarray
_3 = (3,)


def follows(found: Array) -> Array:
    """Whether loads on beams follow their beam or a law: `node_loads.follows`."""
    return np.asarray((found["kind"] == node_loads.MOMENT) | (found["frame"] != 0) | (found["law"] != 0))


def _is_in_no_field(_: Any, found: Array) -> bool:
    return not np.any(found["kind"] == FIELD)


# loads on beams: a torque about an axis spread over the mass, a force per length, a force at a vector, a moment on
# a node; first, last: indices of a profile, or of a law's parameters; frame: 1 of section axes; now: last value;
# pitch: of the screw motion along which a torque acts, m/rad
BEAM_LOADS = Family(
    "beam_loads",
    record(
        "kind beam iq iv first last law frame", "value centre axis pitch start end ramp",
        "now vector middle power work rate along",
        centre=_3, axis=_3, vector=_3, middle=_3,
    ),
    order=380,
    results={
        "vector": ("force", "N", "force, resultant of a line load, or torque that acts, inertial axes"),
        "middle": ("position", "m", "where it acts, inertial axes"),
        "power": ("power", "W", "power of the load"),
        "work": ("work", "J", WORK),
    },
    kinds=(
        Kind(
            "a load on a beam",
            which=lambda found: ~has_parameters(found, 0) & ~follows(found), symmetric=_is_in_no_field,
        ),
        Kind(
            "a load on a beam by a profile",
            which=lambda found: has_parameters(found, 0) & ~follows(found),
            symmetric=_is_in_no_field,
        ),
        Kind(
            "a moment or follower force on a beam",
            which=lambda found: follows(found) & (found["law"] == 0),
        ),
        Kind("a load on a beam by a law", which=lambda found: found["law"] != 0),
    ),
    isolated=True,
    times=("start", "end"),
)  # fmt: skip
