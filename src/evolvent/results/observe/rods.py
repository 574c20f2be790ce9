"""Observations of geometrically exact rods: shape, strains, and section forces."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from evolvent.assembly.families import bodies_of, rod_arms
from evolvent.elements import rods
from evolvent.results.motion import quaternions
from evolvent.results.observe.beams import _section_drawn
from evolvent.results.observe.variables import Observed, Variable, cross, dot, norm, turned
from evolvent.results.observe.view import View
from evolvent.solvers import heating

Array = np.ndarray
#: Angle, rad, by which a rod must bend for its curvature to be its first colour.
_BENT = 1e-3


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
    elastic, bending = _observe_sections(view, index, part, x, R, found)
    _observe_sums(view, bodies, poses, elastic, bending, found)
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
        shape = np.array([rods.advanced(np.array(part.curvature), s)[0] for s in part.arc])
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


def _observe_sections(view: View, index: int, part: Any, x: Array, R: Array, found: Observed) -> tuple[Array, Array]:
    """Strains, forces and moments in the middles of the elements; returns the energy of all strains and of moments."""
    row = view.model.flexible.rods[index]
    elements = view.model.flexible.rod_elements[int(row["first_element"]) :][: int(row["elements"])]
    lengths = part.lengths
    E = rods.strains(x, R, lengths) - elements["rest"]
    for k in np.flatnonzero(view.model.flexible.thermal_loads["rod"] == index):
        a = heating.amplitudes(view.model, int(k), view.t, view.load_factor)
        E = E - heating.free_rod_strains(view.model, view.model.flexible.thermal_loads[k], a)
    S = np.einsum("nij,tnj->tni", elements["stiffness"], E)
    energy = 0.5 * np.einsum("n,tni,tni->ti", lengths, S, E)
    pieces = [part.section.between(*ends) for ends in itertools.pairwise(part.arc / part.length)]
    compliance = np.array([np.linalg.inv(rods.section_stiffness(piece, part.material)) for piece in pieces])
    local = np.einsum("nij,tnj->tni", compliance, S)
    where, own = "in the middle of each element", "in the section's axes"
    found.along("strain", "element", local[..., 0], "1", f"strain of the axis {where}")
    found.along("shear_strain_y", "element", local[..., 1], "1", f"shear strain along y {where}")
    found.along("shear_strain_z", "element", local[..., 2], "1", f"shear strain along z {where}")
    found.along("twist", "element", local[..., 3], "m-1", f"change of twist per length {where}")
    found.along("curvature_y", "element", local[..., 4], "m-1", f"change of curvature about y {where}")
    found.along("curvature_z", "element", local[..., 5], "m-1", f"change of curvature about z {where}")
    found.along("axial_force", "element", S[..., 0], "N", f"force along x, positive in tension, {where}")
    for i, axis in ((1, "y"), (2, "z")):
        found.along(f"shear_force_{axis}", "element", S[..., i], "N", f"shear force along {axis} {own}, {where}")
    found.along("torsional_moment", "element", S[..., 3], "N m", f"moment about x {own}, {where}")
    for i, axis in ((4, "y"), (5, "z")):
        found.along(f"bending_moment_{axis}", "element", S[..., i], "N m", f"moment about {axis} {own}, {where}")
    found.along(
        "energy_density", "element", 0.5 * np.einsum("tni,tni->tn", S, E), "J m-1", f"strain energy per length {where}"
    )
    total = energy.sum(axis=1)
    return total, energy[:, 3:].sum(axis=1)


def _observe_sums(
    view: View, bodies: list[int], poses: list[Any], elastic: Array, bending: Array, found: Observed
) -> None:
    """Energies and momenta."""
    kinetic, linear, angular = np.zeros(view.t.size), np.zeros((view.t.size, 3)), np.zeros((view.t.size, 3))
    for b, pose in zip(bodies, poses, strict=True):
        row = view.model.bodies[b]
        mass, own = float(row["mass"]), np.einsum("tji,tj->ti", pose.R, pose.w)
        spin = turned(pose.R, own @ row["inertia"])
        kinetic += 0.5 * mass * dot(pose.v, pose.v) + 0.5 * dot(pose.w, spin)
        linear += mass * pose.v
        angular += mass * cross(pose.x, pose.v) + spin
    found.scalar("energy_kinetic", kinetic, "J", "kinetic energy")
    found.scalar("energy_elastic", elastic, "J", "strain energy")
    found.scalar("energy_bending", bending, "J", "strain energy of bending and torsion")
    found.vector("momentum", linear, "kg m s-1", "linear momentum, inertial axes")
    found.vector("angular_momentum", angular, "kg m2 s-1", "angular momentum about the inertial origin")


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
