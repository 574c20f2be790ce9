"""Observations of contacts between rigid bodies."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.kernels import surfaces
from evolvent.results.observe.shapes import capsule, disc
from evolvent.results.observe.variables import Observed
from evolvent.results.observe.view import View
from evolvent.solvers.sampled import TOUCHED


def observe_body_contact(view: View, name: str) -> Observed:
    """Resultant force and moments of a contact between bodies, its impulse and energy, and the forces of its points."""
    index, rows = view.index(name), view.model.body_contacts
    mine = np.flatnonzero(rows["first"] == index)
    touches = view.solution.sampled.touches
    values, found = touches[:, mine], Observed()
    total = values.sum(axis=1)
    on_rods = hasattr(view.part(name), "beams")
    on = "beams" if on_rods else "first body, `a`"
    if on_rods:
        found.vector("force", total[:, 0:3], "N", "resultant of the surface on the beams, inertial axes")
        text = "moment of the surface on the beams about the origin of the surface's body, inertial axes"
        found.vector("moment", -total[:, 6:9], "N m", text)
    else:
        found.vector("force", total[:, 0:3], "N", f"resultant of the contact on its {on}, inertial axes")
        text = "moment of the contact on its {} body, `{}`, about that one's origin, inertial axes"
        found.vector("moment", total[:, 3:6], "N m", text.format("first", "a"))
        found.vector("moment_b", total[:, 6:9], "N m", text.format("second", "b"))
    found.scalar("normal_force", total[:, 15], "N", "sum of the normal forces")
    found.scalar("impulse", total[:, TOUCHED], "N s", "integral of the normal forces since the start; NaN if explicit")
    found.scalar("points", np.sum(values[:, :, 15] > 0.0, axis=1), "1", "contact points that touch")
    text = "elastic energy of the contact and of what sticks by friction"
    found.scalar("energy_elastic", total[:, 17], "J", text)
    text = f"{{}} of each contact point on its {on}, inertial axes: of the sample, or the mean over its step"
    found.along("point_force", "contact_point", values[:, :, 15], "N", "normal force of each contact point")
    found.along("point_resultant", "contact_point", values[:, :, 0:3], "N", text.format("whole force"))
    found.along("point_friction", "contact_point", values[:, :, 9:12], "N", text.format("friction"))
    text = "position of each contact point, on the first body's surface, inertial axes"
    found.along("point_position", "contact_point", values[:, :, 12:15], "m", text)
    found.along("gap", "contact_point", values[:, :, 16], "m", "distance of the surfaces, negative where they overlap")
    found.drawn = [{"forces": {"points": "point_position", "vectors": "point_resultant"}}, *_drawn(view, name)]
    found.plots = ["normal_force", "points"]
    return found


def _drawn(view: View, name: str) -> list[dict[str, Any]]:
    """The shapes of a contact that its bodies are not drawn by."""
    part, found = view.part(name), []
    if hasattr(part, "beams"):
        return [{"surface": {"body": part.body, "solids": [_solid(view, name)]}}]
    rows = view.model.body_contacts
    row = rows[view.index(name)]
    for key in ("a", "b"):
        shape, body = getattr(part, f"shape_{key}", None), int(row[key])
        if shape is None:
            continue
        owner = view.assembly.parts.get(body_name(view, body))
        if shape == getattr(owner, "shape", None):
            continue
        centre, axis = row[f"place_{key}"], row[f"axis_{key}"].tolist()
        if key == "b" and row["surface"] == surfaces.PLANE:
            solid = disc(shape.size, centre.tolist(), axis)
        else:
            if key == "a":
                centre = np.mean(rows["place_a"][rows["first"] == row["first"]], axis=0)
            solid = capsule(shape.radius, getattr(shape, "length", 0.0), centre.tolist(), axis)
        found.append({"surface": {"body": body_name(view, body), "solids": [solid]}})
    return found


def _solid(view: View, name: str) -> dict[str, Any]:
    """The surface that rods touch."""
    row = view.model.body_contacts[view.index(name)]
    centre, axis = row["place_b"].tolist(), row["axis_b"].tolist()
    if row["surface"] == surfaces.PLANE:
        return disc(view.part(name).size, centre, axis)
    radius, half = float(row["radius"]), float(row["half_b"])
    return capsule(radius, 2.0 * half if np.isfinite(half) else _SHOWN * radius, centre, axis)


#: Length of a cylinder without ends as it is drawn, in radii.
_SHOWN = 4.0


def body_name(view: View, index: int) -> str:
    """Name of a body, 'ground' for the ground."""
    return next(name for name, found in view.assembly.names.items() if found == ("bodies", index))
