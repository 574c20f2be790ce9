"""Synchronizations."""

from __future__ import annotations

import numpy as np

from evolvent.kernels.ends import of_coordinates
from evolvent.model.family import Family, Kind, record
from evolvent.model.layout import Accounts

Array = np.ndarray


# cables between two coordinates: they keep ratio_b x_b - ratio_a x_a = offset; account: of what is dissipated
SYNCHRONIZATIONS = Family(
    "synchronizations",
    record(
        "a b account", "ratio_a ratio_b offset stiffness damping", "stretch torque energy lost lost0"
    ),
    order=280,
    results={
        "stretch": ("difference", "rad", "difference of the angles that each loop couples, times their ratios"),
        "torque": ("torque", "N m", "torque of each loop, at a ratio of 1"),
        "energy": ("energy_elastic", "J", "elastic energy of the loops"),
        "lost": ("dissipation", "W", "power dissipated by the loops"),
    },
    kinds=(
        Kind("a synchronization", symmetric=True),
    ),
    ends=of_coordinates("a", "b"),
    accounts=(Accounts(1),),
)  # fmt: skip
