"""Bodies."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from evolvent.kernels import rigid
from evolvent.kernels.blocks import ANGLE, POSITION, ROTATION
from evolvent.kernels.rotations import rotation_about_axis, rotation_from_quaternion
from evolvent.model.family import Family, Kind, Records, record, where
from evolvent.model.questions import (
    DRIVE,
    AdjointSupport,
    Block,
    Coordinates,
    Felt,
    KeptFields,
    Law,
    LinearizedPoint,
    never,
)

Array = np.ndarray
_3, _33, _6, _66 = (3,), (3, 3), (6,), (6, 6)


def _motions(records: Records, _: Mapping[str, Any]) -> Iterator[Block]:
    for k, body in enumerate(records("bodies")):
        q, v = body["iq"], body["iv"]
        if body["motion"] == rigid.FREE:
            yield Block(POSITION, q, v, k, body["mass"])
            yield Block(ROTATION, q + 3, v + 3, k, np.diag(body["inertia"]))
        elif body["motion"] == rigid.SPIN:
            yield Block(ANGLE, q, v, k, body["spin_inertia"])


def body_point(model: Any, index: int, where: slice, y: Array) -> LinearizedPoint:
    """A free body by its centre of mass, or one that turns about a fixed axis."""
    row = model.bodies[index]
    q = int(row["iq"])
    R = np.empty((3, 3))
    if row["motion"] == rigid.FREE:
        rotation_from_quaternion(*y[q + 3 : q + 7], R)
        zero = np.zeros((3, 3))
        return LinearizedPoint(y[q : q + 3].copy(), where, np.hstack([np.eye(3), zero]), np.hstack([zero, R]))
    rotation_about_axis(row["axis"], float(y[q]), row["R0"], R)
    return LinearizedPoint(np.array(row["x0"]), where, None, (R @ row["axis"])[:, None])


def node_point(model: Any, index: int, y: Array) -> LinearizedPoint:
    """A free body that is a node of a part, by its centre of mass."""
    at = int(model.bodies["iv"][index]) - int(model.info.nq)
    return body_point(model, index, slice(at, at + 6), y)


def _centre(assembly: Any, name: str, index: int, where: slice, y: Array) -> Iterator[tuple[str, LinearizedPoint]]:
    yield name, body_point(assembly.model, index, where, y)


def _stand(model: Any, time: float) -> None:
    """Driven bodies stand where they are at the time; velocities and wrenches of all are cleared."""
    y, bodies = np.zeros(int(model.info.ny)), model.bodies
    y[bodies["iq"][bodies["motion"] == rigid.FREE] + 3] = 1.0  # quaternions of no turn
    rigid.kinematics(time, y, model)
    driven = bodies["motion"] == rigid.DRIVEN
    bodies["rate"][driven], bodies["path"][driven] = 0.0, 0
    for scratch in ("v", "w", "F"):
        bodies[scratch] = 0.0


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
    laws=(Law(DRIVE, lambda found: found["path_law"] != 0, field="path_law", before="path_"),),
    of_step=False,
    stiff=False,
    adjoint=AdjointSupport(
        "its inertia follows from the state, and so do the derivatives of it",
        timed=lambda found: (found["path"] != 0) | (found["rate"] != 0.0),
    ),
    coordinates=(Coordinates(_motions, 50, lambda found: 6 * int(np.sum(found["motion"] != rigid.DRIVEN))),),
    felt=Felt(
        6, lambda found: found["motion"] != rigid.DRIVEN,
        lambda model, k, blocks: rigid.body_bound(model.bodies, k, blocks),
    ),
    uneven=never,
    kept=(KeptFields(10, {"F": 6}),),
    points=_centre,
    stand=_stand,
)  # fmt: skip
