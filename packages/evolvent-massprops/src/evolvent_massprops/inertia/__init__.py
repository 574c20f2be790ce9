"""Inertia of a rigid body from how it vibrates on springs, or swings on wires."""

from evolvent_massprops.inertia.initial_motion import (
    Load,
    Start,
    best_point,
    coordinates,
    displaced,
    excited,
    least_energy,
    released,
    struck,
)
from evolvent_massprops.inertia.inverse import fit, from_modes, from_shapes, from_six_modes, from_three_frequencies
from evolvent_massprops.inertia.mode_partners import mode_energies, partners
from evolvent_massprops.inertia.pendulums import bifilar, compound, multifilar, torsion, trifilar
from evolvent_massprops.inertia.problem import mac
from evolvent_massprops.inertia.stand import Body, Stand
from evolvent_massprops.inertia.statics import Pose, energy, equilibrium, wrench
from evolvent_massprops.inertia.three_frequencies import candidates
from evolvent_massprops.inertia.uncertainty import (
    Budget,
    Candidate,
    Inertia,
    inertia_variables,
    monte_carlo,
    propagate,
    with_budget,
)
from evolvent_massprops.inertia.vibration import (
    LinearModel,
    NormalModes,
    linear_model,
    partial_frequencies,
    spring_energies,
    vertical_model,
)

__all__ = [
    "Body",
    "Budget",
    "Candidate",
    "Inertia",
    "LinearModel",
    "Load",
    "NormalModes",
    "Pose",
    "Stand",
    "Start",
    "best_point",
    "bifilar",
    "candidates",
    "compound",
    "coordinates",
    "displaced",
    "energy",
    "equilibrium",
    "excited",
    "fit",
    "from_modes",
    "from_shapes",
    "from_six_modes",
    "from_three_frequencies",
    "inertia_variables",
    "least_energy",
    "linear_model",
    "mac",
    "mode_energies",
    "monte_carlo",
    "multifilar",
    "partial_frequencies",
    "partners",
    "propagate",
    "released",
    "spring_energies",
    "struck",
    "torsion",
    "trifilar",
    "vertical_model",
    "with_budget",
    "wrench",
]
