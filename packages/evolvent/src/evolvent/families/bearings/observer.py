"""Observations of bearings."""

from __future__ import annotations

from evolvent.families.coordinates.observer import add_fields, since, worded
from evolvent.kernels import axial
from evolvent.model import RESULTS
from evolvent.results.observe.variables import Observed, observer
from evolvent.results.observe.view import View


@observer("bearings")
def observe_bearing(view: View, name: str) -> Observed:
    """Friction of a bearing, its load by parts, and what it has taken."""
    index, found = view.index(name), Observed()
    own = view.model.bearings[index]
    row = view.model.coordinates[int(own["coordinate"])]
    add_fields(view, found, "bearings", index, row, "angle rate rubs limit")
    for field in ("radial_force", "axial_force", "tilting", "stored"):  # which are the same of an angle and a travel
        if field == "axial_force" and row["kind"] == axial.TRAVEL:
            continue
        key, unit, text = RESULTS["bearings"][field]
        found.scalar(key, view.fields["bearings"][field][:, index], unit, text)
    found.scalar("friction_work", since(view, int(own["account"])), "J", "energy that friction has dissipated")
    found.plots = [worded(row, "torque"), "radial_force"]
    return found
