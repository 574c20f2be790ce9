"""Observations of beams: shape, deflection, and what the sections carry."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.elements.sections import Arc, Circle, Tube
from evolvent.kernels.beam_strains import POINTS
from evolvent.model import RESULTS
from evolvent.results.observe.variables import Observed, cross, norm
from evolvent.results.observe.view import View, root_axes

Array = np.ndarray
#: What forces and moments are of, in words.
_SECTION = "that the outer part exerts on the section that faces the tip, in the section's axes"
#: Angle, rad, by which a beam must bend for its curvature to be its first colour: a taut wire shows its force.
_BENT = 1e-3


def observe_beam(view: View, name: str) -> Observed:
    """Shape, deflection, strains, section forces and moments, energies and momenta of a beam.

    Notes
    -----
    The deflection is the position less that of the shape without stress, carried by the root node: its axes are the
    beam's own at the root, x along, y and z across (of a cable, which has no twist, those turned by the shortest way).
    """
    index, part, found = view.index(name), view.part(name), Observed()
    nodes, rates = view.nodes(index)
    axes = root_axes(nodes)
    _observe_shape(part, name, nodes, rates, axes, found)
    add_sections(view, index, "strain axial_force energy_density", found)
    found.coordinate("arc", "section", section_arc(part), "m", "length from the root to the two points of each element")
    if part.vectors == 4:
        add_sections(view, index, "shear_force_y shear_force_z", found)
        add_sections(view, index, "torsional_moment bending_moment_y bending_moment_z", found)
        middles = part.arc[:-1] + 0.5 * part.lengths
        found.coordinate("arc_element", "element", middles, "m", "length from the root to the elements' middles")
    else:
        add_sections(view, index, "bending_moment", found)
    length, count = float(part.length), int(part.elements)
    found.along("curvature", "node", curvature(nodes, part.lengths), "m-1", "curvature of the axis at the nodes")
    found.results("beams", view.fields["beams"], index)
    found.coordinate("node", "node", np.arange(count + 1), "1", "node, 0 at the root")
    found.coordinate("arc_node", "node", part.arc, "m", "length from the root to the node")
    line: dict[str, Any] = {"points": "position", "slope": "slope", "length": length}
    bends = float(np.nanmax(found.variables["curvature"].values, initial=0.0)) * length > _BENT
    line["values"] = ["curvature", "axial_force"] if bends else ["axial_force", "curvature"]
    found.drawn = [{"line": line | _section_drawn(part.section, nodes, axes, found)}]
    found.plots = ["tip_deflection"]
    moments = ["bending_moment_y", "bending_moment_z", "torsional_moment"] if part.vectors == 4 else ["bending_moment"]
    found.plots_along = ["deflection", "axial_force", *moments]
    return found


def _observe_shape(part: Any, name: str, nodes: Array, rates: Array, axes: Array, found: Observed) -> None:
    """Positions, velocities and deflections of the nodes."""
    unloaded = part.rest_nodes(name)
    if unloaded is None:
        shape = part.arc[:, None] * np.array([1.0, 0.0, 0.0])
    else:
        shape = (unloaded[:, 0] - unloaded[0, 0]) @ root_axes(unloaded[None])[0].T
    position = nodes[:, :, 0]
    deflection = (position - position[:, :1]) @ np.swapaxes(axes, 1, 2) - shape
    found.along("position", "node", position, "m", "positions of the nodes, inertial axes")
    found.along("velocity", "node", rates[:, :, 0], "m s-1", "velocities of the nodes, inertial axes")
    found.along("slope", "node", nodes[:, :, 1], "1", "derivatives of the positions by the length, inertial axes")
    what = "from the shape without stress, in the axes of the root (x along the beam, y and z across)"
    found.along("deflection", "node", deflection, "m", f"deflections of the nodes {what}")
    found.vector("tip_deflection", deflection[:, -1], "m", f"deflection of the tip {what}")
    found.vector("tip_position", position[:, -1], "m", "position of the tip, inertial axes")
    found.scalar("tip_speed", norm(rates[:, -1, 0]), "m s-1", "speed of the tip in inertial space")


def add_sections(view: View, index: int, fields: str, found: Observed) -> None:
    """Add fields of the records of a beam's elements that are results, at two points of each or in its middle."""
    row = view.model.beams[index]
    own = slice(int(row["first_element"]), int(row["first_element"] + row["elements"]))
    for field in fields.split():
        name, unit, text = RESULTS["elements"][field]
        values, dimension, where = view.fields["elements"][field][:, own], "element", "in the middle of each element"
        if values.ndim == 3:
            values, dimension, where = values.reshape(view.t.size, -1), "section", "at two points of each element"
        found.along(name, dimension, values, unit, f"{text.format(section=_SECTION)} {where}")


def section_arc(part: Any) -> Array:
    """Lengths from the root to the two points of each element at which its sections are seen."""
    found: Array = (part.arc[:-1, None] + part.lengths[:, None] * np.array(POINTS[:2])).ravel()
    return found


def _section_drawn(section: Any, nodes: Array, axes: Array, found: Observed) -> dict[str, Any]:
    """How wide a beam is drawn: round ones by their diameter, flat ones as strips along their width."""
    section = getattr(section, "root", section)  # of a taper
    if isinstance(section, Circle | Tube) or (isinstance(section, Arc) and section.angle >= np.pi):
        return {"kind": "rod", "width": 2.0 * float(section.radius)}
    sides = section.sides
    if sides is None:
        return {}
    y, z = sides
    which = 2 if z >= y else 1
    if nodes.shape[2] == 4:
        across = nodes[:, :, 1 + which]
    else:  # a cable has no twist: that of its root
        across = np.broadcast_to(axes[:, which][:, None], nodes[:, :, 0].shape)
    found.along("width_direction", "node", across, "1", "direction along which the beam is drawn wide, inertial axes")
    return {"kind": "line", "width": max(y, z), "across": "width_direction"}


def curvature(nodes: Array, lengths: Array) -> Array:
    """|r' x r''| / |r'|^3 at the nodes (nt, n), of the cubic elements; the mean of both elements that meet there.

    Parameters
    ----------
    nodes : (nt, n, vectors, 3) float; lengths : (n - 1,) float, m, of the elements
    """
    r, s = nodes[:, :, 0], nodes[:, :, 1]
    h = lengths[:, None]
    step = np.diff(r, axis=1)
    at_start = (6.0 * step - h * (4.0 * s[:, :-1] + 2.0 * s[:, 1:])) / h**2
    at_end = (-6.0 * step + h * (2.0 * s[:, :-1] + 4.0 * s[:, 1:])) / h**2
    size = norm(s)
    bent = np.zeros(size.shape)
    count = np.zeros(size.shape[1])
    for second, at in ((at_start, slice(0, -1)), (at_end, slice(1, None))):
        bent[:, at] += norm(cross(s[:, at], second)) / size[:, at] ** 3
        count[at] += 1.0
    found: Array = bent / count
    return found
