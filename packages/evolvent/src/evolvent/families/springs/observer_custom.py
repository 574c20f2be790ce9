"""Observations of user-defined laws between points: the forces on them, and the energy stored."""

from __future__ import annotations

import numpy as np

from evolvent.results.observe.variables import Observed, observer
from evolvent.results.observe.view import View


@observer("custom_forces")
def observe_custom(view: View, name: str) -> Observed:
    """Positions of the points, forces on them, energy and dissipated power of a custom force."""
    row, found = view.model.custom_forces[view.index(name)], Observed()
    own = range(int(row["first_marker"]), int(row["first_marker"] + row["points"]))
    x, v = (np.stack(of, axis=1) for of in zip(*(view.marker(marker) for marker in own), strict=True))
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
