"""Observations of shells: shape, stress resultants and energies, and how they are drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from evolvent import elements
from evolvent.assembly.families import bodies_of
from evolvent.families.shells.shell_strains import STRAINS
from evolvent.model import RESULTS
from evolvent.results.observe.variables import Observed, Variable, cross, norm, observer
from evolvent.results.observe.view import View

if TYPE_CHECKING:
    from evolvent.elements.laminates import WallProperties

Array = np.ndarray
#: Fields of an element of which the shell has the sum.
_SUMS = ("stored", "bent", "drilled")
#: Of shells with a thermal load.
_HEAT = ("warmth", "slope")
#: Angle, rad, by which a shell must bend for its moments to be its first colour.
_BENT = 1e-3
#: Membrane forces and moments per length, as the components 11, 22 and 12 of a tensor.
_FORCES = ("membrane_force_1", "membrane_force_2", "membrane_shear")
_MOMENTS = ("moment_1", "moment_2", "twisting_moment")


@observer("shells")
def observe_shell(view: View, name: str) -> Observed:
    """Positions, attitudes and displacements of the nodes, stress resultants, energies and momenta of a shell.

    Notes
    -----
    Resultants are those in the middle of each element, in its axes: `direction_1` is axis 1. The principal values do
    not depend on these axes. Displacements are those from the shape without stress at the place that the part states.
    """
    index, found = view.index(name), Observed()
    row, fields = view.model.shells[index], view.fields["shell_elements"]
    own = slice(int(row["first_element"]), int(row["first_element"] + row["elements"]))
    rows = view.model.shell_elements[own]
    faces = rows["nodes"] - int(row["first_body"])
    _observe_nodes(view, name, found)
    _observe_reactions(view, name, found)
    found.coordinates["element_nodes"] = Variable(("element", "corner"), faces, "1", "nodes around each element")
    found.coordinate(
        "element", "element", np.arange(len(faces)), "1", "element i n2 + j, i along side 1, j along side 2"
    )
    others = _SUMS if np.any(rows["heated"] != 0) else _SUMS + _HEAT
    found.results_along("shell_elements", fields, own, "element", others, "in the middle of each element")
    direction = _directions(view, index)[:, faces].sum(axis=2)
    direction = direction / np.maximum(norm(direction), 1e-300)[..., None]
    found.along("direction_1", "element", direction, "1", "axis 1 of each element, inertial axes")
    for called, of, unit, text in (
        ("principal_membrane_force", _FORCES, "N m-1", "principal membrane force of the larger size, tension positive"),
        ("principal_moment", _MOMENTS, "N", "principal moment per length of the larger size"),
    ):
        values = _principal(*(found.variables[key].values for key in of))
        found.along(called, "element", values, unit, f"{text}, in the middle of each element")
    named = _observe_strength(view, name, *_observe_strains(view, name, found), found)
    found.along("energy_density", "element", fields["stored"][:, own] / rows["area"], "J m-2", "strain energy per area")
    found.results("shells", view.fields["shells"], index)
    for field in _SUMS:
        called, *described = RESULTS["shell_elements"][field]
        found.scalar(called, fields[field][:, own].sum(axis=1), *described)
    found.plots = ["largest_displacement", "energy_elastic", *(["strength_margin"] if named else [])]
    principal = ["principal_moment", "principal_membrane_force"]
    resultants = [described[0] for field, described in RESULTS["shell_elements"].items() if field not in others]
    found.drawn = [
        {
            "quads": {
                "points": "position", "normals": "normal", "faces": "element_nodes",
                "thickness": _thickness(view, index),
                "values": [*(principal if _bends(view, index) else principal[::-1]), "energy_density"],
                "data": [*resultants, "largest_strain", *named], "vectors": ["displacement"],
            }
        }
    ]  # fmt: skip
    return found


def _observe_nodes(view: View, name: str, found: Observed) -> None:
    """Motion of the nodes."""
    bodies = bodies_of(view.model, "shells", view.index(name))
    x, R, v, w = view.poses(bodies)
    start = view.model.bodies["x0"][np.array(bodies)]
    found.along("position", "node", x, "m", "positions of the nodes, inertial axes")
    found.along("displacement", "node", x - start, "m", "displacements of the nodes from the start")
    found.scalar("largest_displacement", norm(x - start).max(axis=1), "m", "largest displacement of a node")
    found.along("normal", "node", R[..., 2], "1", "normals at the nodes, inertial axes")
    text = "attitudes of the nodes, quaternions from their axes to inertial axes, scalar first"
    found.attitudes("attitude", "node", R, text)
    found.along("velocity", "node", v, "m s-1", "velocities of the nodes, inertial axes")
    found.along("rate", "node", w, "rad s-1", "angular velocities of the nodes, inertial axes")
    found.coordinate("node", "node", np.arange(x.shape[1]), "1", "node i (n2 + 1) + j, i along side 1, j along side 2")


def _observe_reactions(view: View, name: str, found: Observed) -> None:
    """Forces and moments of the ground on the edges that are clamped; a node of two edges is counted on the first."""
    part, first, taken = view.part(name), int(view.model.shells[view.index(name)]["first_body"]), set[int]()
    edges = {}
    for edge in part.clamped:
        edges[edge] = [k for k in part.edge(edge, name) if k not in taken]
        taken |= set(edges[edge])
    held = view.reactions(first + np.array([k for own in edges.values() for k in own], dtype=int)) if edges else None
    if held is None:
        return
    x0, at, sums = view.model.bodies["x0"][first:], 0, []
    for edge, own in edges.items():
        wrench = held[:, at : at + len(own)]
        at += len(own)
        arms = x0[own] - x0[part.edge(edge, name)].mean(axis=0)
        sums.append((wrench[..., :3].sum(axis=1), (wrench[..., 3:] + cross(arms, wrench[..., :3])).sum(axis=1)))
    for called, unit, k, text in (
        ("reaction_force", "N", 0, "force of the ground on each edge that is clamped, inertial axes"),
        ("reaction_moment", "N m", 1, "moment of the ground about the middle of each edge's nodes, inertial axes"),
    ):
        found.along(called, "clamped_edge", np.stack([one[k] for one in sums], axis=1), unit, text)
    found.coordinate("clamped_edge", "clamped_edge", np.array([*edges]), "1", "edges that are clamped")


def _observe_strains(view: View, name: str, found: Observed) -> tuple[Array, Array]:
    """Curvatures and the largest strain at the faces, by the resultants.

    Returns
    -------
    strains : (nt, m, 6) float, membrane strains 11, 22 and twice 12, and changes of curvature alike, 1/m
    free : (nt, m, n, 6) float, those of each ply without stress
    """
    wall = view.part(name).wall(name)
    keys = (*_FORCES, *_MOMENTS, "shear_force_1", "shear_force_2")
    resultants = np.stack([found.variables[key].values for key in keys], axis=-1)
    whole, free = _strains(view, name, wall, resultants)
    strains = whole[..., :6]
    where = "in the middle of each element"
    for k, called in enumerate(("curvature_1", "curvature_2", "twist")):
        what = "change of the curvature along axis" if k < 2 else "twice the change of the twist"
        text = f"{what} {k + 1}, {where}" if k < 2 else f"{what}, {where}"
        found.along(called, "element", strains[..., 3 + k], "m-1", text)
    half = 0.5 * wall.thickness
    largest = np.zeros(strains.shape[:2])
    for z in (-half, half):
        one, two, both = np.moveaxis(strains[..., :3] + z * strains[..., 3:], -1, 0)
        largest = np.maximum(largest, np.abs(_principal(one, two, 0.5 * both)))
    at = "at a face" if half > 0.0 else "of the reference surface"
    found.along("largest_strain", "element", largest, "1", f"principal strain of the larger size {at}, {where}")
    return strains, free


def _strains(view: View, name: str, wall: WallProperties, resultants: Array) -> tuple[Array, Array]:
    """Strains (nt, m, 8) in the middle of elements by the resultants, and the free strains (nt, m, n, 6) of plies.

    Notes
    -----
    A law with the part C_m of the stiffness C, the shares g and the strains w of its branches takes from the stress
    C_m (G e - sum of g w), G the sum of g, of the strain e. Thermal expansion is not combined with relaxation.
    """
    shell, plies = view.model.shells[view.index(name)], view.part(name).plies
    own = slice(int(shell["first_element"]), int(shell["first_element"] + shell["elements"]))
    rows, fields = view.model.shell_elements[own], view.fields["shell_elements"]
    free = np.zeros((*resultants.shape[:2], len(plies), 6))
    if wall.expansion is not None and np.any(rows["heated"] != 0):
        warmth, slope = (fields[key][:, own, None] for key in ("warmth", "slope"))
        for k, ply in enumerate(plies):
            expansion = elements.laminates.turned_expansion(ply.material, ply.angle)
            free[:, :, k] = np.concatenate([expansion * warmth, expansion * slope], axis=-1)
        thermal = warmth * wall.expansion[:, 0] + slope * wall.expansion[:, 1]
        return resultants @ shell["compliance"] + thermal, free
    stiffness, forces, laws = wall.stiffness.copy(), resultants.copy(), []
    for p, (law, part) in enumerate(wall.relaxing):
        kept = _branches(view, rows, p) @ shell["compliance"]
        share = sum(share for share, _ in law.prony)
        stiffness -= share * part
        forces -= kept @ part
        laws.append((law, share, kept))
    whole = forces @ np.linalg.inv(stiffness)
    for law, share, kept in laws:
        for k, ply in enumerate(plies):
            if ply.material.viscoelastic == law:
                free[:, :, k] = (share * whole - kept)[..., :6]
    return whole, free


def _branches(view: View, rows: Array, p: int) -> Array:
    """Resultants (nt, m, 8) of the sums of g w of the branches of law p, by the whole stiffness of the wall."""
    terms, branches = view.model.prony_terms, view.model.branch_strains
    found = np.zeros((len(view.t), len(rows), 8))
    for k, row in enumerate(rows):
        law = view.model.shell_relaxations[int(row["relaxation"]) + p]
        own = terms[int(law["prony"]) : int(law["prony_end"])]
        accounts = branches["account"][int(law["branch"]) :][: own.size * STRAINS]
        w = view.y[:, accounts].reshape(len(view.t), own.size, STRAINS)
        found[:, k] = np.einsum("i,tij->tj", own["share"], w) @ row["resultants"].T
    return found


def _observe_strength(view: View, name: str, strains: Array, free: Array, found: Observed) -> list[str]:
    """How near plies with strengths are to failure; returns names of what is drawn, none without strengths."""
    plies = view.part(name).plies
    known = [k for k, ply in enumerate(plies) if ply.material.tensile_strength is not None]
    if not known:
        return []
    stress = elements.strength.ply_stresses(plies, strains, free)
    failure = elements.strength.failure_index
    index = np.stack([failure(plies[k].material, stress[..., k, :, :]).max(axis=-1) for k in known], -1)
    largest, ply = index.max(axis=-1), np.array(known)[index.argmax(axis=-1)]
    text = "square root of the criterion of Tsai and Hill, of the ply and face nearest to failure; 1 at failure"
    found.along("failure_index", "element", largest, "1", text)
    found.along("critical_ply", "element", ply, "1", "ply nearest to failure, 0 at the bottom")
    with np.errstate(divide="ignore"):
        margin = 1.0 / largest.max(axis=1) - 1.0
    found.scalar("strength_margin", margin, "1", "factor by which all stresses may grow until a ply fails, less 1")
    return ["failure_index"]


def _thickness(view: View, index: int) -> float:
    """Thickness of the homogeneous wall that has the inertia of the nodes, m."""
    node = view.model.bodies[bodies_of(view.model, "shells", index)[0]]
    return float(np.sqrt(12.0 * node["inertia"][0, 0] / node["mass"]))


def _bends(view: View, index: int) -> bool:
    """Whether normals turn against the axes of the first node."""
    bodies = bodies_of(view.model, "shells", index)
    start = view.model.bodies["R0"][np.array(bodies)]
    R, before = view.poses(bodies).R, start[0].T @ start[..., 2].T
    turns = np.swapaxes(R[:, 0], -1, -2) @ np.swapaxes(R[..., 2], -1, -2)
    return float(np.abs(turns - before).max(initial=0.0)) > _BENT


def _directions(view: View, index: int) -> Array:
    """First axes (nt, n, 3) of the nodes, inertial axes."""
    found: Array = view.poses(bodies_of(view.model, "shells", index)).R[..., 0]
    return found


def _principal(one: Array, two: Array, both: Array) -> Array:
    """Principal value of the larger size of symmetric tensors with the components 11, 22 and 12."""
    mean, radius = 0.5 * (one + two), np.hypot(0.5 * (one - two), both)
    found: Array = np.where(mean < 0.0, mean - radius, mean + radius)
    return found
