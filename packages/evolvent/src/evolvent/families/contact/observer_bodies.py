"""Observations of contacts between rigid bodies."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.kernels import body_gaps
from evolvent.model import RESULTS
from evolvent.model.registry import asked
from evolvent.results.observe.shapes import touched
from evolvent.results.observe.variables import Observed, observer
from evolvent.results.observe.view import View

#: Family of the contacts of beams, whose words those of nodes share.
_OF_BEAMS = "contact_surfaces"


@observer("body_contacts")
def observe_body_contact(view: View, name: str) -> Observed:
    """Resultant force and moments of a contact between bodies, its impulse and energy, and the forces of its points."""
    found, on_nodes = Observed(), _is_of_nodes(view, name)
    mine = np.flatnonzero(view.model.body_contacts["first"] == view.index(name))
    fields = {field: values[:, mine] for field, values in view.fields["body_contacts"].items()}
    rows = view.model.body_contacts
    # of the many pairs of edges of two boxes those alone that touch
    touch = np.any(fields["force"] > 0.0, axis=0) | np.any(fields["impulse"] > 0.0, axis=0)
    kept = touch | (rows["surface"][mine] != body_gaps.EDGES)
    mine, fields = mine[kept], {field: values[:, kept] for field, values in fields.items()}
    other = rows["a"][mine] != rows["a"][view.index(name)]  # points of the second body, such as corners of a box
    if other.any() and not on_nodes:
        fields["on_a"], fields["on_b"] = (
            np.where(other[:, None], fields[y], fields[x]) for x, y in (("on_a", "on_b"), ("on_b", "on_a"))
        )
        fields["rubbing"] = np.where(other[:, None], -fields["rubbing"], fields["rubbing"])
    total = {field: values.sum(axis=1) for field, values in fields.items()}
    if on_nodes:
        found.vector("force", total["on_a"][:, :3], *RESULTS[_OF_BEAMS]["force"][1:])
        found.vector("moment", -total["on_b"][:, 3:], *RESULTS[_OF_BEAMS]["moment"][1:])
    else:
        found.vector(
            "force", total["on_a"][:, :3], "N", "resultant of the contact on its first body, `a`, inertial axes"
        )
        text = "moment of the contact on its {} body, `{}`, about that one's origin, inertial axes"
        found.vector("moment", total["on_a"][:, 3:], "N m", text.format("first", "a"))
        found.vector("moment_b", total["on_b"][:, 3:], "N m", text.format("second", "b"))
    found.scalar("normal_force", total["force"], *RESULTS[_OF_BEAMS]["normal"][1:])
    for field in ("impulse", "energy"):
        key, *described = RESULTS["body_contacts"][field]
        found.scalar(key, total[field], *described)
    found.scalar("points", np.sum(fields["force"] > 0.0, axis=1), *RESULTS[_OF_BEAMS]["touching"][1:])
    for field in ("force", "on_a", "rubbing", "c", "gap1"):
        key, unit, text = RESULTS["body_contacts"][field]
        values = fields[field] if fields[field].ndim == 2 else fields[field][..., :3]
        found.along(key, "contact_point", values, unit, text.format(on="part" if on_nodes else "first body, `a`"))
    found.drawn = [{"forces": {"points": "point_position", "vectors": "point_resultant"}}, *_drawn(view, name)]
    found.acts_one_way(view.t, "normal_force", zero="apart", other="touching")
    found.plots = ["normal_force", "points"]
    return found


def _is_of_nodes(view: View, name: str) -> bool:
    """Whether a contact is one of parts whose nodes are bodies with a surface."""
    return view.assembly.names.get(view.part(name).a[0], ("",))[0] in asked("parts.touches")


def _drawn(view: View, name: str) -> list[dict[str, Any]]:
    """The shapes of a contact that its bodies are not drawn by."""
    part, rows = view.part(name), view.model.body_contacts
    row = rows[view.index(name)]
    found = touched(view, part.shape, int(row["b"]), row["place_b"])
    if _is_of_nodes(view, name):
        return found
    centre = np.mean(rows["place_a"][(rows["first"] == row["first"]) & (rows["a"] == row["a"])], axis=0)
    return [*touched(view, part.shape_a, int(row["a"]), centre), *found]
