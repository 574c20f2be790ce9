"""Observations of beams: shape, deflection, and what the sections carry."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.observe.variables import Observed, Variable, dot, norm
from evolvent.observe.view import View

Array = np.ndarray


def observe_beam(view: View, name: str) -> Observed:
    """Positions, velocities and deflections of the nodes; strains, section forces, moments and energy along the beam.

    Notes
    -----
    The deflection is the position less that of the shape without stress, carried by the root node: its axes are the
    beam's own at the root, x along, y and z across (of a cable, which has no twist, those turned by the shortest way).
    """
    index, part, found = view.index(name), view.part(name), Observed()
    nodes, rates = view.nodes(index)
    axes = root_axes(nodes)
    unloaded = part.start(name)
    first = root_axes(unloaded[None])[0]
    shape = (unloaded[:, 0] - unloaded[0, 0]) @ first.T
    if getattr(part, "rest", "straight") == "straight":
        shape = np.linspace(0.0, float(part.length), len(unloaded))[:, None] * np.array([1.0, 0.0, 0.0])
    seen = np.einsum("tij,tnj->tni", axes, nodes[:, :, 0] - nodes[:, :1, 0])
    deflection = seen - shape
    position = nodes[:, :, 0]
    found.along("position", "node", position, "m", "positions of the nodes, inertial axes")
    found.along("velocity", "node", rates[:, :, 0], "m s-1", "velocities of the nodes, inertial axes")
    found.along("slope", "node", nodes[:, :, 1], "1", "derivatives of the positions by the length, inertial axes")
    what = "in the axes of the root (x along the beam, y and z across)"
    found.along(
        "deflection", "node", deflection, "m", f"deflections of the nodes from the shape without stress, {what}"
    )
    found.vector("tip_deflection", deflection[:, -1], "m", f"deflection of the tip, {what}")
    found.vector("tip_position", position[:, -1], "m", "position of the tip, inertial axes")
    found.scalar("tip_speed", norm(rates[:, -1, 0]), "m s-1", "speed of the tip in inertial space")
    along = part.along(nodes)
    where = "at two points of each element"
    found.along("strain", "section", along["strain"], "1", f"strain of the axis, {where}")
    found.along(
        "axial_force", "section", along["force"], "N", f"force along the axis, positive where it pulls, {where}"
    )
    if nodes.shape[2] == 4:
        what = "on the section that faces the tip, in its own axes"
        found.along("shear_force_y", "section", along["shear_y"], "N", f"shear force along y {what}, {where}")
        found.along("shear_force_z", "section", along["shear_z"], "N", f"shear force along z {what}, {where}")
        # the section turns linearly along an element: its moments are those of the middle
        middle = {key: along[key][..., ::2] for key in ("torque", "bend_y", "bend_z")}
        where = "in the middle of each element"
        found.along("torsional_moment", "element", middle["torque"], "N m", f"moment about x {what}, {where}")
        found.along("bending_moment_y", "element", middle["bend_z"], "N m", f"moment about y {what}, {where}")
        found.along("bending_moment_z", "element", -middle["bend_y"], "N m", f"moment about z {what}, {where}")
        centres = (np.arange(part.elements) + 0.5) * float(part.length) / part.elements
        found.variables["arc_element"] = _fixed(
            "element", centres, "m", "length from the root to the elements' middles"
        )
    else:
        found.along("bending_moment", "section", along["bend_y"], "N m", f"size of the bending moment, {where}")
    text = "strain energy per length, at two points of each element"
    found.along("energy_density", "section", along["energy"], "J m-1", text)
    found.along("curvature", "node", curvature(nodes, float(part.length)), "m-1", "curvature of the axis at the nodes")
    half = float(part.length) / (2 * part.elements)
    weights = np.full(along["arc"].size, half)  # of two Gauss points, half an element each
    found.scalar("energy", along["energy"] @ weights, "J", "strain energy, by two Gauss points of each element")
    found.variables["arc"] = _fixed("section", along["arc"], "m", "length from the root to the points of the sections")
    n = len(unloaded)
    found.variables["arc_node"] = _fixed("node", np.linspace(0.0, float(part.length), n), "m", "length from the root")
    line: dict[str, Any] = {
        "points": "position", "slope": "slope", "length": float(part.length), "values": ["curvature"]
    }  # fmt: skip
    line |= _section_drawn(part.section, nodes, axes, found)
    found.drawn = [{"line": line}]
    found.plots = ["tip_deflection"]
    return found


def _section_drawn(section: Any, nodes: Array, axes: Array, found: Observed) -> dict[str, Any]:
    """How wide a beam is drawn: round ones by their diameter, flat ones as strips along their width."""
    section = getattr(section, "start", section)  # of a taper
    if hasattr(section, "radius"):
        return {"kind": "rod", "width": 2.0 * float(section.radius)}
    if not hasattr(section, "width"):
        return {}
    y, z = float(section.thickness), float(section.width)
    which = 2 if z >= y else 1
    if nodes.shape[2] == 4:
        across = nodes[:, :, 1 + which]
    else:  # a cable has no twist: that of its root
        across = np.broadcast_to(axes[:, which][:, None], nodes[:, :, 0].shape)
    found.along("width_direction", "node", across, "1", "direction along which the beam is drawn wide, inertial axes")
    return {"kind": "line", "width": max(y, z), "across": "width_direction"}


def _fixed(dimension: str, values: Array, unit: str, text: str) -> Variable:
    return Variable((dimension,), values, unit, text)


def root_axes(nodes: Array) -> Array:
    """Axes of the root (nt, 3, 3), rows x along, y and z: of nodes (nt, n, vectors, 3)."""
    x = nodes[:, 0, 1]
    if nodes.shape[2] == 4:  # the section: across it stands x
        y, z = nodes[:, 0, 2], nodes[:, 0, 3]
        x = np.cross(y, z)
    else:
        y = _across(nodes[0, 0, 1])[None] * np.ones((len(nodes), 1))
        if len(nodes) > 1:
            y = carried(x, y[0])
    x = x / norm(x)[:, None]
    y = y - dot(y, x)[:, None] * x
    y = y / norm(y)[:, None]
    return np.stack([x, y, np.cross(x, y)], axis=1)


def carried(x: Array, y: Array) -> Array:
    """A direction y (3,) across x[0], turned with the directions x (nt, 3) by the shortest way between samples."""
    e = x / norm(x)[:, None]
    found = np.empty_like(e)
    found[0] = y
    for k in range(1, len(e)):
        v = e[k - 1] + e[k]
        size = float(v @ v)
        one = found[k - 1]
        if size > 1e-12:  # two reflections
            one = one - 2.0 * (one @ e[k - 1]) * e[k - 1]
            one = one - 2.0 * (one @ v) / size * v
        found[k] = one - (one @ e[k]) * e[k]
        found[k] /= np.linalg.norm(found[k])
    return found


def _across(x: Array) -> Array:
    """A unit vector across x, in the plane across z where that is possible."""
    z = np.array([0.0, 0.0, 1.0]) if abs(x[2]) < 0.9 * np.linalg.norm(x) else np.array([0.0, 1.0, 0.0])
    y = np.cross(z, x)
    found: Array = y / np.linalg.norm(y)
    return found


def curvature(nodes: Array, length: float) -> Array:
    """|r' x r''| / |r'|^3 at the nodes (nt, n), of the cubic elements; the mean of both elements that meet there."""
    r, s = nodes[:, :, 0], nodes[:, :, 1]
    h = length / (nodes.shape[1] - 1)
    step = np.diff(r, axis=1)
    at_start = (6.0 * step - h * (4.0 * s[:, :-1] + 2.0 * s[:, 1:])) / h**2
    at_end = (-6.0 * step + h * (2.0 * s[:, :-1] + 4.0 * s[:, 1:])) / h**2
    size = norm(s)
    bent = np.zeros(size.shape)
    count = np.zeros(size.shape[1])
    for second, at in ((at_start, slice(0, -1)), (at_end, slice(1, None))):
        bent[:, at] += norm(np.cross(s[:, at], second)) / size[:, at] ** 3
        count[at] += 1.0
    found: Array = bent / count
    return found
