"""Meshes of shells: nodes with axes, elements, edges; on a grid, from a formula or from a file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from evolvent.assembly import expressions
from evolvent.kernels.expression import evaluate
from evolvent.parts.base import unit
from evolvent.parts.expression import VARIABLES
from evolvent_base.errors import InputError

Array = np.ndarray
#: Turn of the boundary at a node from which an edge of a mesh ends there, degrees.
CORNER = 45.0
#: Edges of a grid: begin and end of side 1 and of side 2.
GRID_EDGES = ("x0", "x1", "y0", "y1")
#: Step of the parameters of a formula for its tangents.
_STEP = 1e-3
#: Coefficients of the first derivative by four neighbours.
_SLOPE = ((-2, 1.0 / 12.0), (-1, -2.0 / 3.0), (1, 2.0 / 3.0), (2, -1.0 / 12.0))


class Mesh(NamedTuple):
    """A mesh of elements of four nodes.

    Attributes
    ----------
    x : (n, 3) float, m, nodes; R : (n, 3, 3) float, their axes in columns, the third the normal
    quads : (m, 4) int, nodes of the elements, counterclockwise about the normal
    edges : mapping, name -> (k, 2) int, sides of elements by their nodes, one after the other along an edge; of a node
        alone both are this one
    """

    x: Array
    R: Array
    quads: Array
    edges: Mapping[str, Array]

    def moved(self, name: str, x: Array, normals: Array | None, slopes: Array | Sequence[Array]) -> Array:
        """Axes (n, 3, 3) of the nodes where these are at x (n, 3), m, with normals (n, 3).

        Parameters
        ----------
        name : str, for messages
        normals : those of a smooth surface if left out
        slopes : (8, 4) float of each element, 1/m, derivatives along axes 1 and 2 of each node by the nodes' positions

        Notes
        -----
        About the normals the axes turn as their surroundings, which are sheared symmetrically: drilling strains are 0.
        """
        three = _free_normals(name, x, self.quads) if normals is None else normals
        along = np.zeros((2, *x.shape))
        for own, slope in zip(self.quads, slopes, strict=True):
            U = (slope @ x[own]).reshape(4, 2, 3)
            for a, node in enumerate(own):
                along[:, node] += U[a]
        return axes_along(three, along[0] - np.cross(three, along[1]))


def numbered(k: int) -> str:
    """Name of the edge k."""
    return f"edge[{k}]"


def nodes_of(sides: Array) -> Array:
    """Nodes of an edge, each once, in their order."""
    return np.array(list(dict.fromkeys(sides.ravel().tolist())), dtype=int)


def shares_of(x: Array, sides: Array) -> Array:
    """Lengths of an edge that its nodes stand for, m."""
    nodes, lengths = nodes_of(sides), np.linalg.norm(x[sides[:, 1]] - x[sides[:, 0]], axis=1)
    return np.array([0.5 * float(lengths[(sides == node).any(axis=1)].sum()) for node in nodes])


def tangents_of(x: Array, sides: Array) -> Array:
    """Unit vectors along an edge at its nodes, (k, 3)."""
    along = x[sides[:, 1]] - x[sides[:, 0]]
    return np.array([unit(along[(sides == node).any(axis=1)].sum(axis=0)) for node in nodes_of(sides)])


def areas_of(mesh: Mesh) -> Array:
    """Areas of the surface that its nodes stand for, m2."""
    found = np.zeros(len(mesh.x))
    corners = mesh.x[mesh.quads]
    areas = 0.5 * np.linalg.norm(np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]), axis=1)
    np.add.at(found, mesh.quads.ravel(), np.repeat(0.25 * areas, 4))
    return found


# ------------------------------------------------------------------------------------------------------- grids


def grid_quads(n1: int, n2: int) -> Array:
    """Elements (n1 n2, 4) of a grid; node (i, j) has the number i (n2 + 1) + j."""
    k = np.arange((n1 + 1) * (n2 + 1)).reshape(n1 + 1, n2 + 1)
    return np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], axis=-1).reshape(-1, 4)


def grid_edges(n1: int, n2: int) -> dict[str, Array]:
    """Edges of a grid, by their numbers and by `GRID_EDGES`, each from its begin."""
    k = np.arange((n1 + 1) * (n2 + 1)).reshape(n1 + 1, n2 + 1)
    runs = [np.stack([run[:-1], run[1:]], axis=1) for run in (k[0], k[-1], k[:, 0], k[:, -1])]
    return {numbered(i): run for i, run in enumerate(runs)} | dict(zip(GRID_EDGES, runs, strict=True))


def on_grid(x: Array, R: Array) -> Mesh:
    """The mesh of nodes (n1 + 1, n2 + 1, 3) with axes (n1 + 1, n2 + 1, 3, 3)."""
    n1, n2 = x.shape[0] - 1, x.shape[1] - 1
    return Mesh(x.reshape(-1, 3), R.reshape(-1, 3, 3), grid_quads(n1, n2), grid_edges(n1, n2))


def part_of_cylinder(size: tuple[float, float], radius: float | None, elements: tuple[int, int], place: Array,
                     axes: Array) -> Mesh:  # fmt: skip
    """A rectangle or a part of a cylinder, whose axis is along axis 1.

    Parameters
    ----------
    place : (3,) float, m, corner; axes : (3, 3) float, axes there, in columns
    """
    one, two, three = axes.T
    along, across = (np.linspace(0.0, length, n + 1) for length, n in zip(size, elements, strict=True))
    x, R = np.empty((len(along), len(across), 3)), np.empty((len(along), len(across), 3, 3))
    for j, s in enumerate(across):
        turn = 0.0 if radius is None else s / radius
        sine, cosine = np.sin(turn), np.cos(turn)
        off = s * two if radius is None else radius * (sine * two + (cosine - 1.0) * three)
        x[:, j] = place + along[:, None] * one + off
        R[:, j] = np.array([one, cosine * two - sine * three, cosine * three + sine * two]).T
    return on_grid(x, R)


def of_formula(name: str, texts: Sequence[str], constants: Mapping[str, float] | None, elements: tuple[int, int],
               place: Array, axes: Array) -> Mesh:  # fmt: skip
    """The surface of three expressions, m, of u and v from 0 to 1, in given axes at a given place.

    Parameters
    ----------
    name : str, of the key, for messages

    Raises
    ------
    InputError
        If an expression is not finite, or the surface has no normal somewhere.
    """
    programs = [
        np.array(expressions.compile_expression(text, VARIABLES["surface"], constants, name=name).code)
        for text in texts
    ]
    u, v = (np.linspace(0.0, 1.0, n + 1) for n in elements)

    def at(one: float, two: float) -> Array:
        return np.array([evaluate(program, 0, np.array([one, two])) for program in programs])

    shape = (len(u), len(v), 3)
    x, one, two = np.empty(shape), np.zeros(shape), np.zeros(shape)
    for i, j in np.ndindex(shape[:2]):
        x[i, j] = at(float(u[i]), float(v[j]))
        for steps, weight in _SLOPE:
            one[i, j] += weight * at(float(u[i]) + steps * _STEP, float(v[j]))
            two[i, j] += weight * at(float(u[i]), float(v[j]) + steps * _STEP)
    normals = np.cross(one, two)
    sizes = np.linalg.norm(normals, axis=-1, keepdims=True)
    wrong = ~(np.isfinite(x).all(axis=-1) & (sizes[..., 0] > 1e-12 * np.nanmax(sizes, initial=0.0)))
    if wrong.any():
        i, j = np.argwhere(wrong)[0]
        raise InputError(
            f"{name} has no finite value or no normal at u = {u[i]:g}, v = {v[j]:g}; it must be a smooth "
            f"surface also a little beyond u and v from 0 to 1"
        )
    x, normals, one = place + x @ axes.T, (normals / sizes) @ axes.T, one @ axes.T
    return on_grid(x, axes_along(normals, one))


def of_nodes(name: str, x: Array, normals: Array | None, direction: Array | None) -> Mesh:
    """The mesh of nodes (n1 + 1, n2 + 1, 3).

    Parameters
    ----------
    normals : (n1 + 1, n2 + 1, 3) float; those of `_grid_normals` if left out
    direction : (3,) float, axis 1 at each node is along its part in the surface; along side 1 if left out
    """
    normals = _grid_normals(name, x) if normals is None else normals
    if direction is None:
        return on_grid(x, axes_along(normals, np.gradient(x, axis=0)))
    return on_grid(x, _axes_of(name, normals, direction))


def _axes_of(name: str, normals: Array, direction: Array) -> Array:
    """Axes of nodes with axis 1 along the part of a direction in the surface."""
    along = np.broadcast_to(direction, normals.shape)
    flat = np.linalg.norm(np.cross(along, normals), axis=-1).ravel()
    if flat.min() < 1e-3:
        raise InputError(
            f"{name}.direction is normal to the surface at node {int(flat.argmin())}; it must have a part in the "
            f"surface everywhere"
        )
    return axes_along(normals, along)


def axes_along(three: Array, one: Array) -> Array:
    """Axes (.., 3, 3) with normals `three` and the first axis along the part of `one` in the surface."""
    one = one - np.sum(one * three, axis=-1, keepdims=True) * three
    one = one / np.linalg.norm(one, axis=-1, keepdims=True)
    return np.stack([one, np.cross(three, one), three], axis=-1)


def _grid_normals(name: str, x: Array) -> Array:
    """Normals (n1 + 1, n2 + 1, 3) of a smooth surface through nodes."""
    quads = grid_quads(x.shape[0] - 1, x.shape[1] - 1)
    found = mean_normals(name, x.reshape(-1, 3), quads).reshape(x.shape)
    for _ in range(2):
        for place in np.ndindex(found.shape[:2]):
            first = [max(0, min(k - 1, n - 3)) for k, n in zip(place, x.shape, strict=False)]
            around = x[first[0] : first[0] + 3, first[1] : first[1] + 3]
            long = 1 if around.shape[1] == 3 else 0  # three nodes along this side
            if around.shape[long] == 3:
                side = around.take(2, long)[0] - around.take(0, long)[0]
                both = around.shape[1 - long] == 3
                found[place] = _fitted_normal((around - x[place]).reshape(-1, 3), side, found[place], both=both)
    return found


# --------------------------------------------------------------------------------------------------- free meshes


def free_mesh(name: str, x: Array, quads: Array, direction: Array, sets: Mapping[str, Array]) -> Mesh:
    """A mesh of any nodes and elements.

    Parameters
    ----------
    name : str, for messages
    x : (n, 3) float, m; quads : (m, 4) int
    direction : (3,) float, axis 1 at each node is along its part in the surface
    sets : mapping, name -> (k, 2) int, as of `Mesh.edges`, beside the edges that are found

    Raises
    ------
    InputError
        If elements do not make one surface with two sides, or the direction is normal to it somewhere.
    """
    quads = _oriented(name, quads)
    normals = _free_normals(name, x, quads)
    found = {numbered(k): run for k, run in enumerate(boundary(x, quads, normals))}
    return Mesh(x, _axes_of(name, normals, direction), quads, found | dict(sets))


def _sides(quads: Array) -> dict[tuple[int, int], list[tuple[int, bool]]]:
    """Elements at each side of two nodes, and whether they go round from the first of them to the second."""
    found: dict[tuple[int, int], list[tuple[int, bool]]] = {}
    for k, quad in enumerate(quads.tolist()):
        for a, b in zip(quad, quad[1:] + quad[:1], strict=True):
            found.setdefault((min(a, b), max(a, b)), []).append((k, a < b))
    return found


def _oriented(name: str, quads: Array) -> Array:
    """The elements, all in the same sense as the first one of what they are connected with."""
    at: dict[int, list[tuple[int, bool]]] = {k: [] for k in range(len(quads))}
    for (a, b), own in _sides(quads).items():
        if len(own) > 2:
            raise InputError(
                f"{name} has {len(own)} elements at the side between nodes {a} and {b}; two at most are allowed: join "
                f"shells at their edges"
            )
        if len(own) == 2:
            (k, one), (m, other) = own
            at[k].append((m, one == other))
            at[m].append((k, one == other))
    turned: dict[int, bool] = {}
    for start in range(len(quads)):
        waiting = [] if start in turned else [start]
        turned.setdefault(start, False)
        while waiting:
            k = waiting.pop()
            for m, against in at[k]:
                if m not in turned:
                    turned[m] = turned[k] ^ against
                    waiting.append(m)
                elif turned[m] != turned[k] ^ against:
                    raise InputError(f"{name} has one side alone, as a Moebius strip; a shell must have two")
    return np.array([quad[::-1] if turned[k] else quad for k, quad in enumerate(quads)])


def boundary(x: Array, quads: Array, normals: Array) -> list[Array]:
    """Runs of sides with one element, which end at corners; each (k, 2), one after the other round the surface.

    They go counterclockwise about the normal, from the corner with the lowest number, or where there is none from the
    node with the lowest number.
    """
    after: dict[int, list[int]] = {}
    for (a, b), own in _sides(quads).items():
        if len(own) == 1:
            a, b = (a, b) if own[0][1] else (b, a)
            after.setdefault(a, []).append(b)
    before = {b: a for a, nexts in after.items() for b in nexts}

    def ends_at(k: int) -> bool:
        if len(after[k]) > 1:
            return True
        one, two = (v - (v @ normals[k]) * normals[k] for v in (x[k] - x[before[k]], x[after[k][0]] - x[k]))
        return bool(unit(one) @ unit(two) < np.cos(np.radians(CORNER)))

    corners, runs = {k for k in sorted(after) if ends_at(k)}, []
    for start in [*sorted(corners), *sorted(set(after) - corners)]:
        at = start
        while after.get(at):
            run = [at, after[at].pop(0)]
            while run[-1] not in corners and run[-1] != at:
                run.append(after[run[-1]].pop(0))
            runs.append(np.stack([run[:-1], run[1:]], axis=1))
            at = run[-1]
    return runs


def mean_normals(name: str, x: Array, quads: Array) -> Array:
    """Means of the normals of the elements at each node, (n, 3)."""
    corners, found = x[quads], np.zeros_like(x)
    areas = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    np.add.at(found, quads.ravel(), np.repeat(areas, 4, axis=0))
    sizes = np.linalg.norm(found, axis=-1, keepdims=True)
    if np.any(sizes <= 0.0):
        k = int(sizes.argmin())
        own = np.flatnonzero((quads == k).any(axis=1))
        least = int(own[np.linalg.norm(areas[own], axis=1).argmin()])
        raise InputError(f"{name} has no normal at node {k}; elements there, such as {least}, must have an area")
    return found / sizes


def _free_normals(name: str, x: Array, quads: Array) -> Array:
    """Normals (n, 3) of a smooth surface through nodes: of paraboloids through those around each."""
    near: list[set[int]] = [set() for _ in x]
    for quad in quads.tolist():
        for k in quad:
            near[k] |= set(quad)
    found = mean_normals(name, x, quads)
    around = []  # at a boundary that of the next node within
    for k, own in enumerate(near):
        best = max(sorted(own), key=lambda m: (len(near[m]), -float(np.linalg.norm(x[m] - x[k])), -m))
        around.append(own if len(own) >= len(near[best]) else near[best])
    for _ in range(2):
        for k, own in enumerate(around):
            if len(own) > 5:
                other = next(iter(near[k] - {k}))
                found[k] = _fitted_normal(x[sorted(own)] - x[k], x[other] - x[k], found[k], both=True)
    return found


def _fitted_normal(d: Array, side: Array, normal: Array, *, both: bool) -> Array:
    """Normal at a node of the surface of second order through it that fits the nodes around it best.

    Parameters
    ----------
    d : (k, 3) float, m, nodes as seen from it; side : (3,) float, direction of the first axis; normal : (3,) float, of
        the third; both : whether the surface is curved along both axes
    """
    d = d / np.abs(d).max()
    one = unit(side - (side @ normal) * normal)
    two = np.cross(normal, one)
    u, v, z = d @ one, d @ two, d @ normal
    terms = [u, v, u * u, u * v, v * v] if both else [u, v, u * u, u * v]
    fit = np.linalg.lstsq(np.stack(terms, axis=1), z, rcond=1e-6)[0]
    return unit(normal - fit[0] * one - fit[1] * two)
