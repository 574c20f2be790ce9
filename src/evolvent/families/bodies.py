"""Bodies."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from evolvent.kernels import body_step, calls, rigid
from evolvent.kernels.blocks import ANGLE, POSITION, ROTATION
from evolvent.model.family import Family, Kind, Records, record, where
from evolvent.model.powers import DRIVEN
from evolvent.model.questions import DRIVE, AdjointSupport, Block, Coordinates, Felt, Law, never
from evolvent.model.shares import Shares

Array = np.ndarray
_3, _33, _6, _66 = (3,), (3, 3), (6,), (6, 6)


@calls.force
def inertia(interval, model):
    """Inertia of all bodies in a state less their wrenches; the power of what drives bodies."""
    interval.powers[DRIVEN] += rigid.add_body_residual(interval.dv, model.info.nq, model.bodies, model.F)


@calls.force
def step_inertia(interval, model):
    """Inertia of all bodies over a step less their wrenches; the power of what drives bodies."""
    interval.powers[DRIVEN] += body_step.add_bodies(model, interval)


@calls.tangent
def inertia_tangent(interval, model, matrix):
    """Derivatives of `inertia`."""
    step = interval.step
    rigid.add_body_tangent(interval.ym, step.c_mass, step.c_rate, model.info.nq, model.bodies, model.K12, matrix)


@calls.tangent
def step_inertia_tangent(interval, model, matrix):
    """Derivatives of `step_inertia`."""
    body_step.add_body_tangents(interval.step.c_mass, model, interval, matrix)


@calls.energy
def energy(interval, model, out):
    """Kinetic energy of all bodies."""
    rigid.add_body_energy(interval.ym, model.bodies, out, 0)


@calls.momentum
def momentum(y, model, out):
    """Momenta of all bodies."""
    rigid.add_body_momenta(y, model.bodies, out[:3], out[3:])


def _motions(records: Records, _: Mapping[str, Any]) -> Iterator[Block]:
    for k, body in enumerate(records("bodies")):
        q, v = body["iq"], body["iv"]
        if body["motion"] == rigid.FREE:
            yield Block(POSITION, q, v, k, body["mass"])
            yield Block(ROTATION, q + 3, v + 3, k, np.diag(body["inertia"]))
        elif body["motion"] == rigid.SPIN:
            yield Block(ANGLE, q, v, k, body["spin_inertia"])


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
    order=380,
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
    inertia=inertia,
    step_inertia=step_inertia,
    inertia_tangent=inertia_tangent,
    step_inertia_tangent=step_inertia_tangent,
    energy=energy,
    momentum=momentum,
    consists=lambda row, k: range(k, k + 1),
    local=True,
    changes="mass inertia spin_inertia",
    reads_inertia=False,
    smooth=True,
    shares=Shares(),
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
)  # fmt: skip
