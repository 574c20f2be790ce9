"""Observations of beams: shape, deflection, and what the sections carry."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np

from evolvent.elements.sections import Arc, Circle, Tube
from evolvent.parts.beam import GAUSS
from evolvent.results.observe.thermal import free_strain
from evolvent.results.observe.variables import Observed, cross, norm
from evolvent.results.observe.view import View, root_axes

Array = np.ndarray
#: Free strains of a beam at points of each element (`evolvent.results.observe.thermal.free_strain`).
Free = Callable[[Any], Array | None]
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
    if part.vectors == 4:
        _observe_sections(part, nodes, found, functools.partial(free_strain, view, index))
    else:
        _observe_cable(part, nodes, found, functools.partial(free_strain, view, index))
    length, count = float(part.length), int(part.elements)
    found.along("curvature", "node", curvature(nodes, part.lengths), "m-1", "curvature of the axis at the nodes")
    sums = view.beam_sums(index)
    found.scalar("energy_kinetic", sums.kinetic, "J", "kinetic energy")
    found.scalar("energy_elastic", sums.elastic, "J", "strain energy")
    found.scalar("energy_bending", sums.bending, "J", "strain energy of bending")
    found.vector("momentum", sums.linear, "kg m s-1", "linear momentum, inertial axes")
    found.vector("angular_momentum", sums.angular, "kg m2 s-1", "angular momentum about the inertial origin")
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
    unloaded = part.start_nodes(name)
    if not part.rests_at_start:
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


def element_means(part: Any, nodes: Array, *names: str, free: Free = lambda at: None) -> list[Array]:
    """Means (..., n) over the elements of what `Beam.along` gives, by the three points of their strain."""
    at, weight = np.polynomial.legendre.leggauss(3)
    at = 0.5 * (1.0 + at)
    along = part.along(nodes, at=at, free=free(at))
    return [along[name].reshape(*along[name].shape[:-1], -1, 3) @ (0.5 * weight) for name in names]


def _observe_axis(part: Any, nodes: Array, found: Observed, free: Free) -> dict[str, Array]:
    """Strain, axial force and energy per length at two points of each element.

    Notes
    -----
    Strain and force are moved so that the mean of both points is the element's mean: of a slack beam that is bent, the
    cubic stretches between its points by more than the beam does.
    """
    along: dict[str, Array] = part.along(nodes, free=free(GAUSS))
    for name, mean in zip(("strain", "force"), element_means(part, nodes, "strain", "force", free=free), strict=True):
        pairs = along[name].reshape(*mean.shape, 2)
        along[name] = (pairs + (mean - pairs.mean(axis=-1))[..., None]).reshape(along[name].shape)
    where = "at two points of each element"
    found.along("strain", "section", along["strain"], "1", f"strain of the axis {where}")
    found.along(
        "axial_force", "section", along["force"], "N", f"force along the axis, positive where it pulls, {where}"
    )
    found.along("energy_density", "section", along["energy"], "J m-1", f"strain energy per length {where}")
    found.coordinate("arc", "section", along["arc"], "m", "length from the root to the two points of each element")
    return along


def _observe_sections(part: Any, nodes: Array, found: Observed, free: Free) -> None:
    """Forces at two points of each element; moments in its middle, since the section turns linearly along it."""
    along = _observe_axis(part, nodes, found, free)
    middle = part.along(nodes, at=(0.5,), free=free((0.5,)))
    what = "that the outer part exerts on the section that faces the tip, in the section's axes"
    where = "at two points of each element"
    found.along("shear_force_y", "section", along["shear_y"], "N", f"shear force along y {what}, {where}")
    found.along("shear_force_z", "section", along["shear_z"], "N", f"shear force along z {what}, {where}")
    where = "in the middle of each element"
    found.along("torsional_moment", "element", middle["torque"], "N m", f"moment about x {what}, {where}")
    found.along("bending_moment_y", "element", middle["bend_z"], "N m", f"moment about y {what}, {where}")
    found.along("bending_moment_z", "element", -middle["bend_y"], "N m", f"moment about z {what}, {where}")
    found.coordinate("arc_element", "element", middle["arc"], "m", "length from the root to the elements' middles")


def _observe_cable(part: Any, nodes: Array, found: Observed, free: Free) -> None:
    """Axial force and the size of the bending moment at two points of each element."""
    along = _observe_axis(part, nodes, found, free)
    text = "size of the bending moment at two points of each element"
    found.along("bending_moment", "section", along["bend_y"], "N m", text)


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
