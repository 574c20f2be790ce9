"""Observations of gears: torques or forces, and constraint errors."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.kernels import axial
from evolvent.results.observe.variables import Observed
from evolvent.results.observe.view import View

Array = np.ndarray
_UNITS = {axial.ANGLE: ("rad", "N m", "torque"), axial.TRAVEL: ("m", "N", "force")}


def observe_gear(view: View, name: str, row: Any, acts: Array) -> Observed:
    """Torques or forces of a gear on its two coordinates, and its constraint error.

    Parameters
    ----------
    row : of the family joints; acts : (nt,) bool, whether it holds
    """
    found, index = Observed(), view.joint_rows[name][0]
    la, fields = view.solution.la[:, index], view.fields["joints"]
    coordinates = view.model.gear_coordinates[int(row["first"]) : int(row["last"])]
    for key, one in zip("ab", coordinates, strict=True):
        _, unit, what = _UNITS[int(one["kind"])]
        text = f"{what} of the gear on the coordinate of {key}, {getattr(view.part(name), key)}"
        found.scalar(f"{what}_{key}", -la * float(one["factor"]), unit, text)
    unit, _, what = _UNITS[int(coordinates["kind"][0])]
    found.scalar("gap", np.where(acts, fields["gap"][:, index], np.nan), unit, "error of the coordinate of a")
    found.scalar("closed", acts, "1", "1 while the gear holds, 0 once it is released")
    if row["stiffness"] > 0.0:
        stored = np.where(acts, fields["stored"][:, index], 0.0)
        found.scalar("energy_elastic", stored, "J", "elastic energy of the penalty that holds the gear")
    found.plots = [f"{what}_a"]
    return found
