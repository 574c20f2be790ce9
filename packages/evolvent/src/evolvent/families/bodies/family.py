"""Bodies."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from evolvent.algebra.sparse import add_entry
from evolvent.assembly import needs
from evolvent.kernels import body_step, calls, points, rigid, rotor
from evolvent.kernels.blocks import ANGLE, POSITION, ROTATION
from evolvent.kernels.rotations import cross, rotation_about_axis, rotation_from_quaternion, turn_back
from evolvent.model.family import Family, Kind, Records, record, where
from evolvent.model.powers import DRIVEN
from evolvent.model.questions import (
    CLEARED,
    DRIVE,
    AdjointSupport,
    Block,
    Coordinates,
    Drives,
    Felt,
    Inertia,
    Law,
    LinearizedPoint,
    Parts,
    Samples,
    Stability,
    State,
    Statics,
    Step,
    never,
)
from evolvent.model.shares import Shares
from evolvent_base.errors import InputError, nearest

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


@calls.force
def evaluate(interval, model):
    """Momenta and energies of all bodies."""
    rigid.evaluate_bodies(interval.ym, model.bodies)


@calls.turning_tangent
def turning_tangent(factor, spin, y, model, matrix):
    """Derivatives of the forces by a steady turn."""
    n_q, bodies = model.info.nq, model.bodies
    for b in range(bodies.size):
        if bodies[b].motion != rigid.FREE:
            continue
        at, J = bodies[b].iv - n_q, bodies[b].inertia
        w = turn_back(bodies[b].R, spin[0], spin[1], spin[2])
        p = rotor.wheel_momentum(b, y, model)
        h = (
            J[0, 0] * w[0] + J[0, 1] * w[1] + J[0, 2] * w[2] + p[0],
            J[1, 0] * w[0] + J[1, 1] * w[1] + J[1, 2] * w[2] + p[1],
            J[2, 0] * w[0] + J[2, 1] * w[1] + J[2, 2] * w[2] + p[2],
        )
        points.add_centrifugal(factor * bodies[b].mass, at, spin, matrix)
        for e in range(3):
            # a turn by the unit vector e changes w by w x e, and the torque by (w x e) x h + w x J (w x e)
            u = cross(w[0], w[1], w[2], 1.0 * (e == 0), 1.0 * (e == 1), 1.0 * (e == 2))
            Ju = (
                J[0, 0] * u[0] + J[0, 1] * u[1] + J[0, 2] * u[2],
                J[1, 0] * u[0] + J[1, 1] * u[1] + J[1, 2] * u[2],
                J[2, 0] * u[0] + J[2, 1] * u[1] + J[2, 2] * u[2],
            )
            g = cross(u[0], u[1], u[2], h[0], h[1], h[2])
            k3 = cross(w[0], w[1], w[2], Ju[0], Ju[1], Ju[2])
            for c in range(3):
                add_entry(matrix, at + 3 + c, at + 3 + e, factor * (g[c] + k3[c]))


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
    needs.load(model, rigid.kinematics)
    rigid.kinematics(time, y, model)
    driven = bodies["motion"] == rigid.DRIVEN
    bodies["rate"][driven], bodies["path"][driven] = 0.0, 0
    for scratch in ("v", "w", "F"):
        bodies[scratch] = 0.0


def _place(builder: Any, at: Any) -> Any:
    """The origin of a body, or a point of its own."""
    points = builder.body_points.get(at.name, {})
    if at.on is not None and at.on not in points:
        what = f"node {at.on}" if isinstance(at.on, int) else f"point {at.on!r}"
        known = nearest(str(at.on), points) if points else "its key `points` names none"
        raise InputError(f"{at.key} is {at.where!r}; {at.name!r} has no {what}; {known}")
    return builder.on_body(at.row, points[at.on] if isinstance(at.on, str) else (0.0, 0.0, 0.0), at.on is None)


@calls.turning
def turning(factor, spin, y, model, a):
    """Accelerations of the rotations of all free bodies that turn with the frame.

    They are (J - S n n^T)^-1 (w x (J w + h)), h the momentum of the body's wheels, so that M a is the torque that the
    turn asks for.
    """
    n_q, bodies = model.info.nq, model.bodies
    for b in range(bodies.size):
        if bodies[b].motion != rigid.FREE:
            continue
        J, at = bodies[b].inertia, bodies[b].iv - n_q + 3
        w = turn_back(bodies[b].R, spin[0], spin[1], spin[2])
        h = rotor.wheel_momentum(b, y, model)
        gx, gy, gz = cross(
            w[0], w[1], w[2],
            J[0, 0] * w[0] + J[0, 1] * w[1] + J[0, 2] * w[2] + h[0],
            J[1, 0] * w[0] + J[1, 1] * w[1] + J[1, 2] * w[2] + h[1],
            J[2, 0] * w[0] + J[2, 1] * w[1] + J[2, 2] * w[2] + h[2],
        )  # fmt: skip
        L = model.K12
        rotor.inertia_without_wheels(b, model, L)
        # Cramer's rule
        c0 = L[1, 1] * L[2, 2] - L[1, 2] * L[2, 1], L[1, 2] * L[2, 0] - L[1, 0] * L[2, 2]
        c02 = L[1, 0] * L[2, 1] - L[1, 1] * L[2, 0]
        det = L[0, 0] * c0[0] + L[0, 1] * c0[1] + L[0, 2] * c02
        g = (gx, gy, gz)
        for c in range(3):
            u, v = (c + 1) % 3, (c + 2) % 3
            s = 0.0
            for e in range(3):
                m, n = (e + 1) % 3, (e + 2) % 3
                s += g[e] * (L[m, u] * L[n, v] - L[m, v] * L[n, u])
            a[at + c] = factor * s / det


@calls.kick
def kick(y, s, model, dy):
    """Velocities of all bodies jump by their twists a."""
    bodies = model.bodies
    for b in range(bodies.size):
        rigid.kick(y, bodies, b, bodies[b].a)


# path: 1 + kind of the drive (`kernels.drive`) that moves a driven body along `direction`, 0 for none; along: its
# acceleration, m/s2; has_mass_matrix: 1 where M holds the mass matrix of the body with all attached masses, 0 where
# M is not used; of thread that moves with the body (`kernels.thread.step`): carried (kg), moment, own (inertia), and
# spin0, spin1, momentum by turning on spools at both ends of a step, body axes; torque: on a free body over a step,
# less that of its wheels, in the axes of the step's start
BODIES = Family(
    "bodies",
    record(
        "motion iq iv path path_first path_last path_law has_mass_matrix",
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
    energy=energy,
    momentum=momentum,
    laws=(Law(DRIVE, lambda found: found["path_law"] != 0, field="path_law", before="path_"),),
    shares=Shares(),
    smooth=True,
    stiff=False,
    of_step=False,
    adjoint=AdjointSupport(
        "its inertia follows from the state, and so do the derivatives of it",
        timed=lambda found: (found["path"] != 0) | (found["rate"] != 0.0), mirrored=where("motion", rigid.DRIVEN),
        smooth=lambda found: found["path"] == 0,
    ),
    parts=Parts(
        consists=lambda row, k: range(k, k + 1), changes="mass inertia spin_inertia", reads_inertia=False,
        initial={"R": "R0", "x": "x0"}, place=_place,
    ),
    state=State(
        unknowns=(Coordinates(_motions, 50, lambda found: 6 * int(np.sum(found["motion"] != rigid.DRIVEN))),),
        points=_centre,
    ),
    inertia=Inertia(
        force=inertia, tangent=inertia_tangent, turning_tangent=turning_tangent, turning=turning, kick=kick,
    ),
    stability=Stability(
        felt=Felt(
            6, lambda found: found["motion"] != rigid.DRIVEN,
            lambda model, k, blocks: rigid.body_bound(model.bodies, k, blocks),
        ),
    ),
    step=Step(inertia=step_inertia, inertia_tangent=step_inertia_tangent),
    drives=Drives(stand=_stand),
    statics=Statics(uneven=never),
    samples=Samples(local=True, evaluate=evaluate, kept={"F": CLEARED}),
)  # fmt: skip
