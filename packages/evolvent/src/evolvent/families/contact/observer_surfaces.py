"""Observations of contacts of beams with surfaces and with one another."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.kernels import surfaces
from evolvent.model import RESULTS
from evolvent.results.observe.shapes import body_name, touched
from evolvent.results.observe.symbols import Seat, basis, entry, ring, symbol
from evolvent.results.observe.variables import Observed, observer
from evolvent.results.observe.view import View

Array = np.ndarray
#: Share of a run over which the mean force is taken: single samples depend on the mesh and on the contact's stiffness.
WINDOW = 0.04
#: Gap over the distance of contact points below which a point lies on the surface: small vibrations lift points off.
NEAR = 2e-4
#: When forces of points act, in words.
_WHEN = ": of the sample, or the mean over its step"


@observer("contact_surfaces")
def observe_contact(view: View, name: str) -> Observed:
    """Resultant force and moment of a contact, its normal force, impulse and energy, and the forces of its points."""
    index = view.index(name)
    found, fields = Observed(), view.fields["contact_points"]
    row, model = view.model.contact_surfaces[index], view.model
    found.results("contact_surfaces", view.fields["contact_surfaces"], index)
    text = f"mean of the normal force over {100.0 * WINDOW:g} % of the run about each sample, from the impulse"
    found.scalar("mean_force", mean_rate(view.t, found.variables["impulse"].values, WINDOW), "N", text)
    inside = slice(int(row["first"]), int(row["last"]))
    name_of, unit, text = RESULTS["contact_points"]["force"]
    found.along(name_of, "contact_point", fields["force"][:, inside], unit, f"{text}{_WHEN}")
    name_of, *words = RESULTS["contact_points"]["apart"]
    found.along(name_of, "contact_point", fields["apart"][:, inside], *words)
    arc, owner = _along_beams(model, inside)
    found.coordinate("arc", "contact_point", arc, "m", "length along the beam from its root")
    spans = [touching_span(arc[owner == beam], fields["apart"][:, inside][:, owner == beam]) for beam in set(owner)]
    text = "length from the first to the last place at which a beam touches; of several beams the sum"
    found.scalar("touching_length", sum(last - first for first, last in spans), "m", text)
    names = {found_index: key for key, (family, found_index) in view.assembly.names.items() if family == "beams"}
    found.coordinate(
        "beam", "contact_point", np.array([names[int(k)] for k in owner]), "1", "beam of the contact point"
    )
    body, centre = int(row["body"]), row["centre"]
    if int(row["under"]) < 0:
        _add_vectors(found, view, inside)
    if int(row["under"]) >= 0 or int(row["surface"]) == surfaces.CYLINDER:
        pushes = {"size": "point_force", "arc": "arc", "beam": "beam", "body": body_name(view, body)}
        found.drawn = [{"pushes": pushes | {"centre": centre.tolist(), "axis": row["axis"].tolist()}}]
    else:
        found.drawn = [{"forces": {"points": "point_position", "vectors": "point_resultant"}}]
        found.drawn += touched(view, view.part(name).shape, body, centre)
    found.acts_one_way(view.t, "normal_force", zero="apart", other="touching")
    found.plots = ["normal_force", "points"]
    return found


def _along_beams(model: Any, inside: slice) -> tuple[Array, Array]:
    """Lengths along their beams from the root to contact points, m, and the indices of these beams: (n,) each."""
    points, elements = model.contact_points[inside], model.elements
    own, length, S = elements["beam"][points["element"]], elements["length"][points["element"]], points["S"]
    before = np.cumsum(elements["length"]) - elements["length"]  # of all elements of all beams
    root = before[model.beams["first_element"][own]]
    return before[points["element"]] - root + S[:, 2] * length + S[:, 1] + S[:, 3], own


def touching_span(arc: Array, gap: Array) -> tuple[Array, Array]:
    """Lengths along a beam from its root to the first and the last place at which it touches, (nt,), m; 0 if nowhere.

    A point touches where its gap is below `NEAR` of the points' distance.

    Parameters
    ----------
    arc : (n,) float, m, of the beam's contact points from its root, increasing
    gap : (nt, n) float, m, negative where a point overlaps, NaN where it is far away

    Notes
    -----
    Between the last point that touches and the next one, the place is that from which the gap of the next two grows
    with the third power of the distance: a beam leaves a surface with the curvature of the surface. It is between
    these points, whatever the gaps are. Points in between may be off: a polynomial departs from the surface.
    A beam whose first point touches does so from a spacing before on, which is its root where no points are skipped.
    """
    gap, spacing = np.nan_to_num(gap, nan=np.inf), arc[min(1, arc.size - 1)] - arc[0]
    touches = gap < NEAR * spacing
    none = ~touches.any(axis=1)
    first, last = -_end(-arc[::-1], gap[:, ::-1], touches[:, ::-1]), _end(arc, gap, touches)
    first = np.where(touches[:, 0], arc[0] - spacing, first)
    return np.where(none, 0.0, first), np.where(none, 0.0, last)


def _end(arc: Array, gap: Array, touches: Array) -> Array:
    """Place at which the last contact ends, (nt,); of the last point where none touches."""
    each, last = np.arange(len(gap)), arc.size - 1
    k = last - np.argmax(touches[:, ::-1], axis=1)
    near, far = np.minimum(k + 1, last), np.minimum(k + 2, last)
    a, b = (np.cbrt(np.maximum(gap[each, at], 0.0)) for at in (near, far))
    with np.errstate(divide="ignore", invalid="ignore"):
        found = arc[near] - (arc[far] - arc[near]) * a / (b - a)
    return np.clip(np.where(np.isfinite(found), found, arc[k]), arc[k], arc[near])


def _add_vectors(found: Observed, view: View, inside: slice) -> None:
    """Positions of the contact points, and the vectors of their forces."""
    fields = {field: values[:, inside] for field, values in view.fields["contact_points"].items()}
    place, *words = RESULTS["contact_points"]["x"]
    found.along(place, "contact_point", fields["x"], *words)
    name, unit, text = RESULTS["contact_points"]["rubbing"]
    if not fields["rubbing"].size:
        fields["rubbing"] = np.zeros(fields["x"].shape)
    found.along(name, "contact_point", fields["rubbing"], unit, f"{text}{_WHEN}")
    whole, text = fields["force"][..., None] * fields["n1"] + fields["rubbing"], text.replace("friction", "whole force")
    found.along("point_resultant", "contact_point", whole, unit, f"{text}{_WHEN}")


def mean_rate(t: np.ndarray, total: np.ndarray, share: float) -> np.ndarray:
    """Mean rate (nt,) of a quantity `total` over a share of the whole time about every sample, less at both ends."""
    half = 0.5 * share * (t[-1] - t[0])
    low, high = np.maximum(t - half, t[0]), np.minimum(t + half, t[-1])
    gained = np.interp(high, t, total) - np.interp(low, t, total)
    return np.divide(gained, high - low, out=np.zeros(t.size), where=high > low)


@symbol("cylinder")
def _contact(view: View, name: str, found: Observed) -> None:
    """A cylinder that is touched as two circles and four lines; one without ends as long as it is wide."""
    part, family = view.part(name), view.assembly.names[name][0]
    if type(part.shape).__name__ != "Cylinder":
        return
    row = getattr(view.model, family)[view.index(name)]
    body, centre = (row["body"], row["centre"]) if family == "contact_surfaces" else (row["b"], row["place_b"])
    radius = part.shape.radius
    half = radius if part.shape.length is None else 0.5 * part.shape.length
    x, y, z = basis(part.shape.axis)
    lines = [*ring(radius, part.shape.axis, -half), *ring(radius, part.shape.axis, half)]
    for side in (x, y, -x, -y):
        lines.append([(radius * side - half * z).tolist(), (radius * side + half * z).tolist()])
    found.drawn.append(entry(view, found, Seat(int(body), centre, z), outline=lines))
