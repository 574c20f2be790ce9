"""Tapes."""

from __future__ import annotations

import numpy as np

from evolvent.families.rods import tape
from evolvent.kernels import calls
from evolvent.model.family import Family, record
from evolvent.model.powers import MASS_DAMPING, SPRINGS
from evolvent.model.questions import Explicit, Parts, Stability, State, Step

Array = np.ndarray


@calls.kinematics
def kinematics(t, y, model):
    """Coordinates of all nodes, and their rates."""
    tape.measure_nodes(y, model)


@calls.force
def force(interval, model):
    """Forces and inertia of all sections that flatten."""
    step = interval.step
    interval.powers[MASS_DAMPING] += tape.add_nodes(interval.dv, step.inertia, step.h, model, model.F)


@calls.tangent
def tangent(interval, model, matrix):
    """Derivatives of `force`."""
    tape.add_node_tangents(interval.step.c_mass, interval.step.c_rate, model, matrix)


@calls.measure
def measure(end, t, y, model):
    """Coordinates of all nodes."""
    tape.keep_nodes(end, model)


@calls.energy
def energy(interval, model, out):
    """Kinetic energy of all sections."""
    tape.add_kinetic_energy(interval.ym, model, out, 0)


@calls.force
def explicit_rate(interval, model):
    """Rates of all nodes, by their forces."""
    interval.powers[SPRINGS] += tape.node_rates(interval.ym, model, interval.rates)


@calls.note
def note_step(model):
    """Changes of the nodes' coordinates, and of their products with curvatures."""
    tape.note_flattening(model)


# sections of rods that flatten (`tape`). bending: stiffness of the wall times the width, N m2; transverse:
# its curvature without stress, 1/m; slenderness: u over the square of the curvature, m2; twisting: m2; stretching:
# g over u; closed: 1 of a lenticular section
TAPES = Family(
    "tapes",
    record("first_node nodes closed", "bending poisson transverse slenderness twisting stretching"),
    order=110,
    of="rods",
    force=force,
    tangent=tangent,
    energy=energy,
    parts=Parts(owner=lambda assembly, k: ("rods", int(np.flatnonzero(assembly.model.rods["tape"] == k + 1)[0]))),
    state=State(kinematics=kinematics),
    explicit=Explicit(force=False, rate=explicit_rate),
    stability=Stability(by_rates=False),
    step=Step(measure=measure, note=note_step),
)  # fmt: skip

# the coordinate of a node; alpha: damping by mass, 1/s; value0, value1: at the ends of a step; before: its change
# over the step before
TAPE_NODES = Family(
    "tape_nodes",
    record("iq iv", "mass alpha", "value rate force value0 value1 before"),
    order=120,
    results={
        "value": ("transverse_curvature", "m-1", "curvature of the section at each node, 0 where it is flat"),
    },
    of="rods",
)  # fmt: skip
