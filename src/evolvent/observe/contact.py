"""Observations of contacts of beams with cylinders and with one another."""

from __future__ import annotations

from evolvent.observe.variables import Observed
from evolvent.observe.view import View


def observe_contact(view: View, name: str) -> Observed:
    """Resultant force and moment of a contact, its normal force, impulse and number of points that touch."""
    found, values = Observed(), view.solution.cylinders[:, view.index(name)]
    found.vector("force", values[:, 0:3], "N", "resultant of the contact on the body, inertial axes")
    found.vector("moment", values[:, 3:6], "N m", "moment of the contact on the body about its origin, inertial axes")
    found.scalar("normal_force", values[:, 6], "N", "sum of the normal forces")
    found.scalar("impulse", values[:, 7], "N s", "integral of the normal forces since the start")
    found.scalar("points", values[:, 8], "1", "contact points that touch")
    found.plots = ["normal_force", "points"]
    return found
