"""Observations of geometrically exact rods: shape, strains, and section forces."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.assembly.families import bodies_of, rod_arms
from evolvent.model import RESULTS
from evolvent.parts.curve import stress_free
from evolvent.results.motion import quaternions
from evolvent.results.observe.beams import _section_drawn
from evolvent.results.observe.variables import Observed, Variable, cross, norm, turned
from evolvent.results.observe.view import View

Array = np.ndarray
#: Angle, rad, by which a rod must bend for its curvature to be its first colour.
_BENT = 1e-3
#: Results of an element of which the rod has the sum.
_SUMS = ("stored", "bent")


def observe_rod(view: View, name: str) -> Observed:
    """Shape, deflection, strains, section forces and moments, energies and momenta of a rod.

    Notes
    -----
    The deflection is the position less that of the shape without stress, carried by the root node. Strains, forces and
    moments are those of the elements' middles, in the axes of the section; a force or moment is what the outer part
    exerts on the section that faces the tip.
    """
    index, part, found = view.index(name), view.part(name), Observed()
    bodies = list(bodies_of(view.model, "rods", index))
    poses, arms = [view.pose(b) for b in bodies], rod_arms(view.model, index)
    x = np.stack([pose.x + turned(pose.R, arm) for pose, arm in zip(poses, arms, strict=True)], axis=1)
    R = np.stack([pose.R for pose in poses], axis=1)
    rate = np.stack([pose.w for pose in poses], axis=1)
    velocity = np.stack(
        [pose.v + cross(pose.w, turned(pose.R, arm)) for pose, arm in zip(poses, arms, strict=True)], axis=1
    )
    _observe_shape(part, name, x, R, found)
    found.along("velocity", "node", velocity, "m s-1", "velocities of the nodes, inertial axes")
    found.along("rate", "node", rate, "rad s-1", "angular velocities of the nodes' sections, inertial axes")
    found.scalar("tip_speed", norm(velocity[:, -1]), "m s-1", "speed of the tip in inertial space")
    row, fields = view.model.rods[index], view.fields["rod_elements"]
    own = slice(int(row["first_element"]), int(row["first_element"] + row["elements"]))
    found.results_along("rod_elements", fields, own, "element", (*_SUMS, "free"), "in the middle of each element")
    found.results("rods", view.fields["rods"], index)
    for field in _SUMS:
        name, *described = RESULTS["rod_elements"][field]
        found.scalar(name, fields[field][:, own].sum(axis=1), *described)
    found.coordinate("node", "node", np.arange(part.elements + 1), "1", "node, 0 at the root")
    found.coordinate("arc_node", "node", part.arc, "m", "length from the root to the node")
    middles = 0.5 * (part.arc[1:] + part.arc[:-1])
    found.coordinate("arc", "element", middles, "m", "length from the root to the elements' middles")
    _draw(part, x, R, found)
    found.plots = ["tip_deflection"]
    moments = ["bending_moment_y", "bending_moment_z", "torsional_moment"]
    found.plots_along = ["deflection", "axial_force", *moments]
    return found


def _observe_shape(part: Any, name: str, x: Array, R: Array, found: Observed) -> None:
    """Positions, axes and deflections of the nodes."""
    if part.rest == "start" and part.nodes is not None:
        start, axes = part.start_nodes(name)
        shape = (start - start[0]) @ axes[0]
    else:
        shape = stress_free(part)[0]
    deflection = np.einsum("tji,tnj->tni", R[:, 0], x - x[:, :1]) - shape
    found.along("position", "node", x, "m", "positions of the nodes, inertial axes")
    q = quaternions(R.reshape(-1, 3, 3)).reshape(*R.shape[:2], 4)
    sign = np.cumprod(np.where(np.einsum("tni,tni->tn", q[1:], q[:-1]) < 0.0, -1.0, 1.0), axis=0)
    q[1:] *= sign[..., None]
    text = "attitudes of the nodes' sections, quaternions from their axes to inertial axes, scalar first"
    found.variables["attitude"] = Variable(("time", "node", "quaternion"), q, "1", text)
    found.along("slope", "node", R[..., 0], "1", "directions of the sections' x axes at the nodes, inertial axes")
    what = "from the stress-free shape, in the axes of the root (x along the rod, y and z across)"
    found.along("deflection", "node", deflection, "m", f"deflections of the nodes {what}")
    found.vector("tip_deflection", deflection[:, -1], "m", f"deflection of the tip {what}")
    found.vector("tip_position", x[:, -1], "m", "position of the tip, inertial axes")


def _draw(part: Any, x: Array, R: Array, found: Observed) -> None:
    """How a rod is drawn: as a beam is."""
    T = np.swapaxes(R[:, :-1], -1, -2) @ R[:, 1:]
    turn = np.arccos(np.clip(0.5 * (np.trace(T, axis1=-2, axis2=-1) - 1.0), -1.0, 1.0))
    lengths = part.lengths
    mean = (turn[:, 1:] + turn[:, :-1]) / (lengths[1:] + lengths[:-1])
    mean = np.concatenate([turn[:, :1] / lengths[0], mean, turn[:, -1:] / lengths[-1]], axis=1)
    found.along("curvature", "node", mean, "m-1", "rotation of the sections per length at the nodes")
    line: dict[str, Any] = {"points": "position", "slope": "slope", "length": float(part.length)}
    bends = float(np.nanmax(mean, initial=0.0)) * float(part.length) > _BENT
    line["values"] = ["curvature", "axial_force"] if bends else ["axial_force", "curvature"]
    nodes = np.stack([x, R[..., 0], R[..., 1], R[..., 2]], axis=2)
    found.drawn = [{"line": line | _section_drawn(part.section, nodes, np.swapaxes(R[:, 0], 1, 2), found)}]
