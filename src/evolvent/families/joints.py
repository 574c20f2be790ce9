"""Joints."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from evolvent.kernels import constraint_rows, joint
from evolvent.kernels.ends import of_joint
from evolvent.model.family import End, Family, Kind, Records, record
from evolvent.model.layout import Rows

Array = np.ndarray
_3 = (3,)


def _is_gear(found: Array) -> Array:
    return np.asarray(found["kind"] == joint.GEAR)


def _is_driven(found: Array) -> Array:
    return np.asarray((found["path"] != joint.STILL) | (found["kind"] == joint.ANGLE))


def _is_unbalanced(found: Array) -> Array:
    """Joints whose forces on both sides need not lie on one line: (n,) bool.

    The damper of a soft joint pulls along the rate of a gap between two points, not along the gap.
    """
    return np.asarray((found["kind"] == joint.POINT) & (found["stiffness"] > 0.0) & (found["damping"] > 0.0))


def _is_held(found: Array) -> Array:
    return np.asarray((found["stiffness"] == 0.0) & ~_is_driven(found) & ~_is_gear(found))


def _rows(found: Array, records: Records) -> Iterator[tuple[int, list[End]]]:
    """Rows of the joints that are no penalties, lengths first."""
    held = np.flatnonzero(found["stiffness"] == 0.0).tolist()
    for k in sorted(held, key=lambda k: found["kind"][k] not in (joint.DISTANCE, joint.CORD)):
        yield k, list(dict.fromkeys(of_joint(found[k], records)))


# scalar constraints, one a multiplier, or penalties (stiffness > 0), until a time; of links and guides as well. A
# side is a vector: of coordinates (on 1, at iq, iv), `local` of a body (on 0), or `local` times the slopes of a
# node (on 2, at iq, iv); the third side is the direction of ALONG; nodes: 1 where a side is of a beam; path: how
# a drive moves the row; event, switch: what releases it, event k or the latch of coordinate -2 - k, and its switch,
# 1 once released, or -1; slack: factor of `info.compliance`; latest: `until` as it was given, which an event may
# bring forward; first, last: of a segment of a thread, its thread and node; reduced: 1 + reduced body of which an
# interface node is held, or 0; mode_shape: first parameter of the shape of its modes along the row. measured:
# distance, product, travel or angle, of which the gap is the rest; u0, u1: u at both ends of an interval; force,
# moment: on the second side
JOINTS = Family(
    "joints",
    record(
        "kind on index iq iv path drive law first last event switch nodes reduced mode_shape outside",
        "local along centre axis zero radius value stiffness damping until latest slack",
        "u g u0 u1 measured gap rate driven bends gap0 gap1 stored force moment",
        on=(3,), index=(3,), iq=(3,), iv=(3,), local=(3, 3), along=_3, centre=_3, axis=_3, zero=_3, u=(3, 3), g=(3, 3),
        u0=(3, 3), u1=(3, 3), force=_3, moment=_3,
    ),
    order=240,
    results={
        "force": ("force", "N", "force of the joint on {on}, inertial axes"),
        "moment": ("moment", "N m", "moment of the joint on {on} about the joint's position, inertial axes"),
        "u": ("ends", "m", "ends a and b, inertial axes"),
        "measured": ("length", "m", "distance of the two ends"),
        "gap": ("gap", "rad", "error of the coordinate of a"),
        "stored": ("energy_elastic", "J", "elastic energy of the penalties that hold the joint"),
    },
    kinds=(
        Kind(
            "a joint by a penalty",
            which=lambda found: (found["stiffness"] > 0.0) & ~_is_gear(found), symmetric=True,
        ),
        Kind(
            "a gear by a penalty",
            which=lambda found: (found["stiffness"] > 0.0) & _is_gear(found), symmetric=True,
        ),
        Kind(
            "a gear that is a constraint",
            which=lambda found: (found["stiffness"] == 0.0) & _is_gear(found),
            symmetric=True,
        ),
        Kind(
            "a joint driven along a path",
            which=lambda found: (found["stiffness"] == 0.0) & _is_driven(found) & (found["nodes"] == 0),
            symmetric=True,
        ),
        Kind(
            "a joint driven along a path on a beam's node",
            which=lambda found: (found["stiffness"] == 0.0) & _is_driven(found) & (found["nodes"] == 1),
            symmetric=True,
        ),
        Kind(
            "a joint that is a constraint",
            which=lambda found: _is_held(found) & (found["nodes"] == 0),
            symmetric=True,
        ),
        Kind(
            "a joint that is a constraint on a beam's node",
            which=lambda found: _is_held(found) & (found["nodes"] == 1),
            symmetric=True,
        ),
    ),
    ends=of_joint,
    isolated=lambda found, _: not np.any(_is_unbalanced(found)),
    couples=lambda row, _: iter(()),  # by its multiplier
    times=("until",),
    rows=Rows(constraint_rows.JOINT, _rows),
    totals={"penalties": lambda found: np.sum(found["stiffness"] > 0.0)},
)  # fmt: skip
