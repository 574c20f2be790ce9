"""Observations of springs between points."""

from __future__ import annotations

import numpy as np

from evolvent.results.observe.variables import Observed, observer
from evolvent.results.observe.view import View


@observer("springs")
def observe_spring(view: View, name: str) -> Observed:
    """What the record of a spring-damper holds, and its ends."""
    index, found = view.index(name), Observed()
    row = view.model.springs[index]
    without = set() if row["law"] == 0 else {"stored"}
    if row["lateral_stiffness"] == 0.0 and row["lateral_damping"] == 0.0:
        without.add("lateral")
    found.results("springs", view.fields["springs"], index, without)
    over = found.variables["extension"].extremes
    if over is not None:
        found.variables["length"] = found.variables["length"]._replace(extremes=over + row["length"])
    (a, _), (b, _) = view.marker(int(row["a"])), view.marker(int(row["b"]))
    found.along("ends", "end", np.stack([a, b], axis=1), "m", "ends a and b, inertial axes")
    found.drawn = [{"line": {"points": "ends", "kind": "spring", "values": ["force"]}}]
    found.plots = ["force"]
    force = found.variables["force"].values
    if row["slack"] or (row["law"] and np.any((force[1:] == 0.0) & (force[:-1] == 0.0))):  # a law may pull alone
        found.acts_one_way(view.t, "force", zero="slack", other="taut")
    return found
