"""Observations of contacts of shells with shells."""

from __future__ import annotations

from evolvent.model import RESULTS
from evolvent.results.observe.variables import Observed, observer
from evolvent.results.observe.view import View


@observer("face_contacts")
def observe_faces(view: View, name: str) -> Observed:
    """Resultant force of a contact, its impulse and energy, and forces of all nodes on the faces on both sides."""
    found, index = Observed(), view.index(name)
    found.results("face_contacts", view.fields["face_contacts"], index)
    row = view.model.face_contacts[index]
    inside = slice(int(row["first"]), int(row["last"]))
    for field, (key, *words) in RESULTS["face_points"].items():
        found.along(key, "contact_point", view.fields["face_points"][field][:, inside], *words)
    found.acts_one_way(view.t, "normal_force", zero="apart", other="touching")
    found.plots = ["normal_force", "points"]
    return found
