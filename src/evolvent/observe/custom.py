"""Observations of users' laws between places: the forces on them, and the energy stored."""

from __future__ import annotations

import numpy as np

from evolvent.kernels.sides import ON_BODY
from evolvent.observe.variables import Observed
from evolvent.observe.view import View

Array = np.ndarray


def observe_custom(view: View, name: str) -> Observed:
    """Positions of the places, forces on them, energy and dissipated power of a custom force."""
    row, found = view.model.flexible.custom_forces[view.index(name)], Observed()
    x, v = states_of_places(view, int(row["place"]), int(row["places"]))
    law = view.assembly.laws[int(row["law"])]
    parameters = np.ascontiguousarray(view.model.parameters[int(row["first"]) : int(row["last"])])
    forces, values = np.zeros_like(x), np.zeros((view.t.size, 2))
    for k, t in enumerate(view.t):
        values[k] = law(float(t), x[k].ravel(), v[k].ravel(), parameters, forces[k].reshape(-1))
    found.along("places", "place", x, "m", "places, inertial axes")
    found.along("force", "place", forces, "N", "force on each place, inertial axes")
    found.scalar("energy_elastic", values[:, 0], "J", "energy stored")
    found.scalar("dissipation", values[:, 1], "W", "power dissipated")
    if x.shape[1] > 1:
        found.drawn = [{"line": {"points": "places", "kind": "spring" if x.shape[1] == 2 else "line"}}]
    found.plots = ["energy_elastic"]
    return found


def states_of_places(view: View, first: int, count: int) -> tuple[Array, Array]:
    """Positions and velocities of places, inertial axes: (nt, k, 3), m and m/s."""
    x, v = np.zeros((2, view.t.size, count, 3))
    for i, place in enumerate(view.model.flexible.custom_places[first : first + count]):
        if place["on"] == ON_BODY:
            x[:, i], v[:, i] = view.on_body(int(place["index"]), place["local"])
        else:
            x[:, i], v[:, i] = view.coordinates(int(place["iq"])), view.coordinates(int(place["iv"]))
    return x, v
