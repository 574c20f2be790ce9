"""Observations of beams: shape, deflection, and what the sections carry."""

from __future__ import annotations

import numpy as np

from evolvent.observe.variables import Observed, dot, norm
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
    names = {
        "strain": ("strain", "1", "strain of the axis"),
        "force": ("axial_force", "N", "force along the axis, positive where it pulls"),
        "shear_y": ("shear_force_y", "N", "shear force along y"),
        "shear_z": ("shear_force_z", "N", "shear force along z"),
        "torque": ("torque", "N m", "torsional moment"),
        "bend_y": ("bending_moment_y", "N m", "moment of the bending across y"),
        "bend_z": ("bending_moment_z", "N m", "moment of the bending across z"),
        "energy": ("energy_density", "J m-1", "strain energy per length"),
    }
    for key, (variable, unit, text) in names.items():
        if np.any(along[key]) or key in ("strain", "force", "bend_y", "energy"):
            found.along(variable, "section", along[key], unit, f"{text}, at two points of each element")
    found.along("curvature", "node", curvature(nodes, float(part.length)), "m-1", "curvature of the axis at the nodes")
    weights = np.gradient(along["arc"]) if along["arc"].size > 1 else np.ones(1)
    half = float(part.length) / (2 * part.elements)
    weights = np.full(along["arc"].size, half)  # of two Gauss points, half an element each
    found.scalar("energy", along["energy"] @ weights, "J", "strain energy, by two Gauss points of each element")
    found.variables["arc"] = _fixed("section", along["arc"], "m", "length from the root to the points of the sections")
    n = len(unloaded)
    found.variables["arc_node"] = _fixed("node", np.linspace(0.0, float(part.length), n), "m", "length from the root")
    width = part.drawn_width() if hasattr(part, "drawn_width") else None
    found.drawn = [
        {
            "line": {
                "points": "position",
                "kind": "line",
                "slope": "slope",
                "length": float(part.length),
                "values": ["curvature"],
                **(width or {}),
            }
        }
    ]
    found.plots = ["tip_deflection"]
    return found


def _fixed(dimension: str, values: Array, unit: str, text: str):  # type: ignore[no-untyped-def]
    from evolvent.observe.variables import Variable

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
