"""Points."""

from __future__ import annotations

import numpy as np

from evolvent.kernels import calls, points
from evolvent.model.family import Family, Kind, record, where
from evolvent.model.shares import Shares

Array = np.ndarray
_3 = (3,)


@calls.force
def inertia(interval, model):
    """Inertia of all points less their forces."""
    points.add_point_residual(interval.dv, interval.step.over, model.info.nq, model.points, model.F)


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
    inertia_tangent=inertia_tangent,
    energy=energy,
    momentum=momentum,
    local=True,
    changes="mass compliance",
    reads_inertia=False,
    smooth=True,
    shares=Shares(),
)  # fmt: skip
