"""Inertia of a rigid body from how it vibrates on springs, or swings on wires."""

from evolvent.inertia.inverse import (
    candidates,
    fit,
    from_shapes,
    from_six_modes,
    from_three_frequencies,
)
from evolvent.inertia.problem import mac
from evolvent.inertia.stand import (
    Body,
    LinearModel,
    NormalModes,
    Pose,
    Stand,
    energy,
    equilibrium,
    linear_model,
    spring_energies,
    vertical_model,
    wrench,
)
from evolvent.inertia.uncertainty import (
    Budget,
    Candidate,
    Inertia,
    Sample,
    monte_carlo,
    propagate,
    sample,
    with_budget,
)

__all__ = [
    "Body",
    "Budget",
    "Candidate",
    "Inertia",
    "LinearModel",
    "NormalModes",
    "Pose",
    "Sample",
    "Stand",
    "candidates",
    "energy",
    "equilibrium",
    "fit",
    "from_shapes",
    "from_six_modes",
    "from_three_frequencies",
    "linear_model",
    "mac",
    "monte_carlo",
    "propagate",
    "sample",
    "spring_energies",
    "vertical_model",
    "with_budget",
    "wrench",
]
