"""Synchronizations."""

from __future__ import annotations

import numpy as np

from evolvent.kernels.ends import OfCoordinates
from evolvent.model.family import Family, Kind, record
from evolvent.model.questions import AdjointSupport, never
from evolvent.model.shares import DAMPING, SPRING, Rule, Shares, Tie

Array = np.ndarray


# cables between two coordinates: they keep ratio_b x_b - ratio_a x_a = offset; account: of what is dissipated
SYNCHRONIZATIONS = Family(
    "synchronizations",
    record(
        "a b account", "ratio_a ratio_b offset stiffness damping", "stretch torque energy lost lost0"
    ),
    order=220,
    results={
        "stretch": ("difference", "rad", "difference of the angles that each loop couples, times their ratios"),
        "torque": ("torque", "N m", "torque of each loop, at a ratio of 1"),
        "energy": ("energy_elastic", "J", "elastic energy of the loops"),
        "lost": ("dissipation", "W", "power dissipated by the loops"),
    },
    kinds=(
        Kind("a synchronization", symmetric=True),
    ),
    ends=OfCoordinates("a", "b"),
    several=True,
    local=True,
    changes="stiffness damping",
    reads_inertia=False,
    smooth=True,
    shares=Shares(
        (Rule(SPRING, "", ("stiffness",)), Rule(DAMPING, "damping", ("damping",))), place=3,
        tie=lambda row: Tie(
            (int(row["b"]), int(row["a"])), (float(row["ratio_b"]), -float(row["ratio_a"])), float(row["offset"])
        ),
    ),
    of_step=False,
    adjoint=AdjointSupport("its torque follows from the state, with all derivatives", timed=False),
    uneven=never,
)  # fmt: skip
