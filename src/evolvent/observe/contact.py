"""Observations of contacts of beams with cylinders and with one another."""

from __future__ import annotations

import numpy as np

from evolvent.observe.variables import Observed
from evolvent.observe.view import View

#: Share of a run over which the mean force is taken: single samples depend on the mesh and on the contact's stiffness.
WINDOW = 0.04


def observe_contact(view: View, name: str) -> Observed:
    """Resultant force and moment of a contact, its normal force, impulse and energy, and the forces of its points."""
    index = view.index(name)
    found, values = Observed(), view.solution.cylinders[:, index]
    row, flexible = view.model.flexible.cylinders[index], view.model.flexible
    found.vector("force", values[:, 0:3], "N", "resultant of the contact on the body, inertial axes")
    found.vector("moment", values[:, 3:6], "N m", "moment of the contact on the body about its origin, inertial axes")
    found.scalar("normal_force", values[:, 6], "N", "sum of the normal forces")
    found.scalar("impulse", values[:, 7], "N s", "integral of the normal forces since the start")
    text = f"mean of the normal force over {100.0 * WINDOW:g} % of the run about each sample, from the impulse"
    found.scalar("mean_force", mean_rate(view.t, values[:, 7], WINDOW), "N", text)
    found.scalar("points", values[:, 8], "1", "contact points that touch")
    found.scalar("energy_elastic", values[:, 9], "J", "elastic energy of the contact and of what sticks by friction")
    inside = slice(int(row["first"]), int(row["last"]))
    force, gap = view.contacts
    text = "normal force of each contact point, positive where it pushes: of the sample, or the mean over its step"
    found.along("point_force", "contact_point", force[:, inside], "N", text)
    text = "distance of each contact point, negative where it overlaps, NaN where it is too far away or beside"
    found.along("gap", "contact_point", gap[:, inside], "m", text)
    points, beams, elements = flexible.contact_points[inside], flexible.beams, flexible.elements
    owner = elements["beam"][points["element"]]
    length, S = elements["length"][points["element"]], points["S"]
    before = np.cumsum(elements["length"]) - elements["length"]  # of all elements of all beams
    arc = before[points["element"]] - before[beams["first_element"][owner]] + S[:, 2] * length + S[:, 1] + S[:, 3]
    found.coordinate("arc", "contact_point", arc, "m", "length along the beam from its root")
    names = {found_index: key for key, (family, found_index) in view.assembly.names.items() if family == "beams"}
    found.coordinate(
        "beam", "contact_point", np.array([names[int(k)] for k in owner]), "1", "beam of the contact point"
    )
    part = view.part(name)
    pushes = {"size": "point_force", "arc": "arc", "beam": "beam", "body": part.body}
    found.drawn = [{"pushes": pushes | {"centre": list(part.centre), "axis": list(part.axis)}}]
    found.plots = ["normal_force", "points"]
    return found


def mean_rate(t: np.ndarray, total: np.ndarray, share: float) -> np.ndarray:
    """Mean rate (nt,) of a quantity `total` over a share of the whole time about every sample, less at both ends."""
    half = 0.5 * share * (t[-1] - t[0])
    low, high = np.maximum(t - half, t[0]), np.minimum(t + half, t[-1])
    gained = np.interp(high, t, total) - np.interp(low, t, total)
    return np.divide(gained, high - low, out=np.zeros(t.size), where=high > low)
