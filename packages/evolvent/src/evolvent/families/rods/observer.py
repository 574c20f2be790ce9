"""Observations of geometrically exact rods: shape, strains, and section forces."""

from __future__ import annotations

import numpy as np

from evolvent.assembly.families import bodies_of
from evolvent.families.beams.observer import add_nodes, draw_line
from evolvent.model import RESULTS
from evolvent.results.observe.variables import Observed, observer
from evolvent.results.observe.view import View
from evolvent.results.rotations import quaternions

Array = np.ndarray
#: Results of an element of which the rod has the sum.
_SUMS = ("stored", "bent")
#: Results of a rod that pays out alone.
_PAYOUT = ("out", "rate")


@observer("rods")
def observe_rod(view: View, name: str) -> Observed:
    """Shape, deflection, strains, section forces and moments, energies and momenta of a rod.

    Notes
    -----
    The deflection is the position less that of the shape without stress, carried by the root node. Strains, forces and
    moments are those of the elements' middles, in the axes of the section; a force or moment is what the outer part
    exerts on the section that faces the tip. Nodes of a rod that pays out are those of its mesh, as are their
    velocities; `arc` and `arc_node` are those of the whole length.
    """
    index, part, found = view.index(name), view.part(name), Observed()
    poses = view.poses(bodies_of(view.model, "rods", index))
    R = poses.R
    row, fields = view.model.rods[index], view.fields["rod_elements"]
    words = {"slopes": "directions of the sections' x axes at the nodes"}
    add_nodes(view, row, part, words | {"curvature": "rotation of the sections per length"}, found)
    text = "attitudes of the nodes' sections, quaternions from their axes to inertial axes, scalar first"
    found.attitudes("attitude", "node", R, text)
    text = "turns of the nodes' sections about the root's axis x, against the root's section"
    found.along("twist_angle", "node", _twist_angles(R), "rad", text)
    found.along("rate", "node", poses.w, "rad s-1", "angular velocities of the nodes' sections, inertial axes")
    own = slice(int(row["first_element"]), int(row["first_element"] + row["elements"]))
    found.results_along("rod_elements", fields, own, "element", (*_SUMS, "free"), "in the middle of each element")
    flat: list[str] = []
    if row["tape"] > 0:
        flat = [_observe_flattening(view, int(row["tape"]) - 1, found)]
        turn = fields["curvature_z"][:, own] @ part.lengths
        found.scalar("fold_angle", turn, "rad", "turn of the tip about z against the root, of all folds together")
    pays = bool(row["payout"])
    found.results("rods", view.fields["rods"], index, () if pays else _PAYOUT)
    if pays:
        text = "force of the drive on the material at the exit along the rod, positive pays out"
        found.scalar("drive_force", view.fields["rods"]["drive_force"][:, index], "N", text)
        found.plots = ["deployed_length", "drive_force", *found.plots]
    for field in _SUMS:
        name, *described = RESULTS["rod_elements"][field]
        found.scalar(name, fields[field][:, own].sum(axis=1), *described)
    middles = 0.5 * (part.arc[1:] + part.arc[:-1])
    found.coordinate("arc", "element", middles, "m", "length from the root to the elements' middles")
    draw_line(part, np.swapaxes(R, -1, -2)[:, :, 1:], found)
    moments = ["bending_moment_y", "bending_moment_z", "torsional_moment"]
    found.plots_along = ["deflection", "axial_force", *moments, *flat]
    found.plots += ["fold_angle", *flat] if flat else []
    return found


def _observe_flattening(view: View, tape: int, found: Observed) -> str:
    """Curvatures across of the sections at the nodes of a tape; returns their name."""
    row = view.model.tapes[tape]
    nodes = slice(int(row["first_node"]), int(row["first_node"] + row["nodes"]))
    called, unit, about = RESULTS["tape_nodes"]["value"]
    found.along(called, "node", view.fields["tape_nodes"]["value"][:, nodes], unit, about)
    return called


def _twist_angles(R: Array) -> Array:
    """Turns (nt, n), rad, about x of the first of the attitudes R (nt, n, 3, 3), without jumps along the nodes.

    Notes
    -----
    That of the rotation about x which is left of a node's rotation by the shortest rotation that turns the axis x.
    """
    q = quaternions((np.swapaxes(R[:, :1], -1, -2) @ R).reshape(-1, 3, 3)).reshape(*R.shape[:2], 4)
    return np.unwrap(2.0 * np.arctan2(q[..., 1], q[..., 0]), axis=1)
