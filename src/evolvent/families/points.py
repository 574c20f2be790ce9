"""Points."""

from __future__ import annotations

import numpy as np

from evolvent.kernels import calls, points
from evolvent.model.family import Family, Kind, record, where

Array = np.ndarray
_3 = (3,)


@calls.force
def inertia(interval, model):
    """Inertia of all points in a state less their forces."""
    points.add_point_residual(interval.dv, model.info.nq, model.points, model.F)


@calls.force
def step_inertia(interval, model):
    """Inertia of all points over a step less their forces."""
    n_q, F, own = model.info.nq, model.F, model.points
    for i in range(own.size):
        at = own[i].iv - n_q
        for c in range(3):
            F[at + c] += own[i].mass * interval.dv[at + c] / interval.step.h - own[i].f[c]


@calls.tangent
def inertia_tangent(interval, model, matrix):
    """Masses of all points."""
    points.add_point_tangent(interval.step.c_mass, model.info.nq, model.points, matrix)


@calls.energy
def energy(interval, model, out):
    """Kinetic energy of all points."""
    points.add_point_energy(interval.ym, model.points, out, 0)


@calls.momentum
def momentum(y, model, out):
    """Momenta of all points."""
    points.add_point_momenta(y, model.points, out[:3], out[3:])


@calls.force
def evaluate(interval, model):
    """Momenta and energies of all points."""
    points.evaluate_points(interval.ym, model.points)


@calls.turning_tangent
def turning_tangent(factor, spin, y, model, matrix):
    """Derivatives of the forces by a steady turn."""
    for k in range(model.points.size):
        points.add_centrifugal(factor * model.points[k].mass, model.points[k].iv - model.info.nq, spin, matrix)


# without mass: a node of a beam, whose coordinates it has
POINTS = Family(
    "points",
    record("iq iv", "mass compliance", "f linear kinetic", f=_3, linear=_3),
    order=370,
    results={
        "linear": ("momentum", "kg m s-1", "linear momentum, inertial axes"),
        "kinetic": ("energy_kinetic", "J", "kinetic energy"),
    },
    kinds=(
        Kind("a point mass", which=lambda found: found["mass"] > 0.0, symmetric=True),
        Kind("a beam's node at a spring's end", which=where("mass", 0.0), symmetric=True),
    ),
    isolated=True,
    inertia=inertia,
    step_inertia=step_inertia,
    inertia_tangent=inertia_tangent,
    energy=energy,
    momentum=momentum,
    evaluate=evaluate,
    turning_tangent=turning_tangent,
)  # fmt: skip
