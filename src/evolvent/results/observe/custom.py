"""Observations of user-defined laws between points: the forces on them, and the energy stored."""

from __future__ import annotations

import numpy as np

from evolvent.kernels.sides import ON_BODY
from evolvent.results.observe.variables import Observed
from evolvent.results.observe.view import View

Array = np.ndarray


def observe_custom(view: View, name: str) -> Observed:
    """Positions of the points, forces on them, energy and dissipated power of a custom force."""
    row, found = view.model.flexible.custom_forces[view.index(name)], Observed()
    x, v = states_of_points(view, int(row["first_point"]), int(row["points"]))
    law = view.assembly.laws[int(row["law"])]
    parameters = np.ascontiguousarray(view.model.parameters[int(row["first"]) : int(row["last"])])
    forces, values = np.zeros_like(x), np.zeros((view.t.size, 2))
    for k, t in enumerate(view.t):
        values[k] = law(float(t), x[k].ravel(), v[k].ravel(), parameters, forces[k].reshape(-1))
    found.along("position", "point", x, "m", "positions of the points, inertial axes")
    found.along("force", "point", forces, "N", "force on each point, inertial axes")
    found.scalar("energy_elastic", values[:, 0], "J", "energy stored")
    found.scalar("dissipation", values[:, 1], "W", "power dissipated")
    if x.shape[1] > 1:
        found.drawn = [{"line": {"points": "position", "kind": "spring" if x.shape[1] == 2 else "line"}}]
    found.plots = ["energy_elastic"]
    return found


def states_of_points(view: View, first: int, count: int) -> tuple[Array, Array]:
    """Positions and velocities of points, inertial axes: (nt, k, 3), m and m/s."""
    x, v = np.zeros((2, view.t.size, count, 3))
    for i, point in enumerate(view.model.flexible.custom_points[first : first + count]):
        if point["on"] == ON_BODY:
            x[:, i], v[:, i] = view.on_body(int(point["index"]), point["local"])
        else:
            x[:, i], v[:, i] = view.coordinates(int(point["iq"])), view.coordinates(int(point["iv"]))
    return x, v
