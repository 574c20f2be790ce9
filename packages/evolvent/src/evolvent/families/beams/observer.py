"""Observations of beams: shape, deflection, and what the sections carry."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.elements.shapes import Arc, Circle, Tube
from evolvent.families.beams.beam_strains import POINTS
from evolvent.model import RESULTS
from evolvent.results.observe.variables import Observed, norm, observer
from evolvent.results.observe.view import View

Array = np.ndarray
#: What forces and moments are of, in words.
_SECTION = "that the outer part exerts on the section that faces the tip, in the section's axes"
#: Angle, rad, by which a beam must bend for its curvature to be its first colour: a taut wire shows its force.
_BENT = 1e-3


@observer("beams")
def observe_beam(view: View, name: str) -> Observed:
    """Shape, deflection, strains, section forces and moments, energies and momenta of a beam.

    Notes
    -----
    The deflection is the position less that of the shape without stress, carried by the root node: its axes are the
    beam's own at the root, x along, y and z across (of a cable, which has no twist, those turned by the shortest way).
    """
    index, part, found = view.index(name), view.part(name), Observed()
    row = view.model.beams[index]
    words = {"slopes": "derivatives of the positions by the length", "curvature": "curvature of the axis"}
    add_nodes(view, row, part, words, found)
    add_sections(view, index, "strain axial_force energy_density", found)
    found.coordinate("arc", "section", section_arc(part), "m", "length from the root to the two points of each element")
    if part.vectors == 4:
        add_sections(view, index, "shear_force_y shear_force_z", found)
        add_sections(view, index, "torsional_moment bending_moment_y bending_moment_z", found)
        middles = part.arc[:-1] + 0.5 * part.lengths
        found.coordinate("arc_element", "element", middles, "m", "length from the root to the elements' middles")
    else:
        add_sections(view, index, "bending_moment", found)
    found.results("beams", view.fields["beams"], index, {"axes"})
    if part.vectors == 4:
        across = view.nodes(index)[0][:, :, 2:]
    else:  # a cable has no twist: that of its root
        across = np.broadcast_to(
            view.fields["beams"]["axes"][:, index, None, 1:], (view.t.size, part.elements + 1, 2, 3)
        )
    draw_line(part, across, found)
    moments = ["bending_moment_y", "bending_moment_z", "torsional_moment"] if part.vectors == 4 else ["bending_moment"]
    found.plots_along = ["deflection", "axial_force", *moments]
    return found


def add_nodes(view: View, row: Any, part: Any, words: dict[str, str], found: Observed) -> None:
    """Add the results of the nodes of a beam or rod, those of its tip, and the nodes' coordinates."""
    own = slice(int(row["first_node"]), int(row["first_node"] + row["elements"]) + 1)
    fields = {key: view.fields["beam_nodes"][key][:, own] for key in RESULTS["beam_nodes"]}
    for key, (name, unit, text) in RESULTS["beam_nodes"].items():
        found.along(name, "node", fields[key], unit, text.format(**words))
    what = RESULTS["beam_nodes"]["deflection"][2].replace("deflections of the nodes", "deflection of the tip")
    found.vector("tip_deflection", fields["deflection"][:, -1], "m", what)
    found.vector("tip_position", fields["x"][:, -1], "m", "position of the tip, inertial axes")
    found.scalar("tip_speed", norm(fields["v"][:, -1]), "m s-1", "speed of the tip in inertial space")
    found.coordinate("node", "node", np.arange(part.elements + 1), "1", "node, 0 at the root")
    found.coordinate("arc_node", "node", part.arc, "m", "length from the root to the node")
    found.plots = ["tip_deflection"]


def draw_line(part: Any, across: Array, found: Observed) -> None:
    """Add how a beam or rod is drawn; across : (nt, n, 2, 3) float, directions y and z of the sections at the nodes."""
    length = float(part.length)
    bends = float(np.nanmax(found.variables["curvature"].values, initial=0.0)) * length > _BENT
    line: dict[str, Any] = {"points": "position", "slope": "slope", "length": length}
    line["values"] = ["curvature", "axial_force"] if bends else ["axial_force", "curvature"]
    section = getattr(part.section, "root", part.section)  # of a taper
    if isinstance(section, Circle | Tube) or (isinstance(section, Arc) and section.angle >= np.pi):
        line |= {"kind": "rod", "width": 2.0 * float(section.radius)}
    elif section.sides is not None:  # a strip along its width
        y, z = section.sides
        text = "direction along which the beam is drawn wide, inertial axes"
        found.along("width_direction", "node", across[:, :, int(z >= y)], "1", text)
        line |= {"kind": "line", "width": max(y, z), "across": "width_direction"}
    found.drawn = [{"line": line}]


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
