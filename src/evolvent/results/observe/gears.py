"""Observations of gears: torques or forces, and constraint errors."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.kernels import gear as kernels
from evolvent.results.observe.variables import Observed, dot, turned
from evolvent.results.observe.view import View

Array = np.ndarray
_UNITS = {kernels.ANGLE: ("N m", "torque"), kernels.TRAVEL: ("N", "force")}


def observe_gear(view: View, name: str, row: Any, acts: Array) -> Observed:
    """Torques or forces of a gear on its two coordinates, and its constraint error.

    Parameters
    ----------
    row : of the family joints; acts : (nt,) bool, whether it holds
    """
    found, la = Observed(), view.solution.la[:, view.joint_rows[name][0]]
    coordinates = view.model.flexible.gear_coordinates[int(row["first"]) : int(row["last"])]
    gap = np.full(view.t.size, -float(row["value"]))
    for key, one in zip("ab", coordinates, strict=True):
        unit, what = _UNITS[int(one["kind"])]
        text = f"{what} of the gear on the coordinate of {key}, {getattr(view.part(name), key)}"
        found.scalar(f"{what}_{key}", -la * float(one["factor"]), unit, text)
        gap += float(one["factor"]) * _coordinate(view, one)
    if row["radius"] > 0.0:
        gap = gap - row["radius"] * np.round(gap / row["radius"])
    unit = "m" if coordinates["kind"][0] == kernels.TRAVEL else "rad"
    found.scalar("gap", np.where(acts, gap, np.nan), unit, "error of the coordinate of a")
    found.scalar("closed", acts, "1", "1 while the gear holds, 0 once it is released")
    if row["stiffness"] > 0.0:
        energy = np.where(acts, 0.5 * row["stiffness"] * gap**2, 0.0)
        found.scalar("energy_elastic", energy, "J", "elastic energy of the penalty that holds the gear")
    found.plots = [f"{_UNITS[int(coordinates['kind'][0])][1]}_a"]
    return found


def _coordinate(view: View, one: Any) -> Array:
    """An angle within half a turn, or a travel, of a gear's coordinate: (nt,)."""
    body, other = view.pose(int(one["body"])), view.pose(int(one["other"]))
    n, u = turned(body.R, one["axis"]), turned(other.R, one["local"])
    if one["kind"] == kernels.TRAVEL:
        return np.asarray(dot(n, other.x + u - body.x - turned(body.R, one["centre"])))
    zero, across = turned(body.R, one["zero"]), turned(body.R, np.cross(one["axis"], one["zero"]))
    return np.asarray(np.arctan2(dot(u, across), dot(u, zero)))
