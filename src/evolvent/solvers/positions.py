"""Points of a structure: how bodies, points and nodes of beams move with the velocities' coordinates."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from evolvent.assembly.assembled import Assembly
from evolvent.assembly.families import bodies_of, rod_arms
from evolvent.base.errors import InputError, nearest
from evolvent.kernels import rigid
from evolvent.kernels.ancf_beams import BEAM, NODE_VECTORS
from evolvent.kernels.blocks import ANGLE, POSITION, ROTATION, SLOPE, idle
from evolvent.kernels.rotations import rotation_about_axis, rotation_from_quaternion
from evolvent.solvers.static_work import velocity_slice

Array = np.ndarray


class LinearizedPoint(NamedTuple):
    """A point, and the linear maps from the displacements u (nv,) of the velocities' coordinates to its motion.

    Attributes
    ----------
    position : (3,) float, m, in the state that the maps belong to
    where : slice, the coordinates of u that move it
    displacement : (3, n) float, m in inertial axes per unit of u[where]; None of a body on a fixed axis
    rotation : (3, n) float, rad about inertial axes per unit of u[where]; None of a point
    """

    position: Array
    where: slice
    displacement: Array | None
    rotation: Array | None


def moving(assembly: Assembly) -> dict[str, tuple[str, int, slice]]:
    """Parts that move: name -> (family, index, their coordinates)."""
    found = {}
    for name, (family, index) in assembly.names.items():
        where = velocity_slice(assembly.model, family, index)
        if where is not None:
            found[name] = (family, index, where)
    return found


def find_moving(assembly: Assembly, name: str) -> tuple[str, int, slice]:
    """Family, index and coordinates of a part that moves; InputError otherwise."""
    known = moving(assembly)
    if name in known:
        return known[name]
    if isinstance(name, str) and name in assembly.names:
        raise InputError(f"{name!r} is one of the {assembly.names[name][0].replace('_', ' ')} and does not move")
    raise InputError(f"no part is called {name!r}; {nearest(str(name), known)}")


def linearized_points(assembly: Assembly, y: Array) -> dict[str, LinearizedPoint]:
    """Points of all parts that move, by name: "hub", "mass", "boom[0]" to "boom[n]", "boom.root", "boom.tip".

    Of a reduced body its frame, "panel", and interface nodes, "panel.root". Of a thread those nodes that have left its
    spool, but for the one that is fixed to another part: "tether[0]", which is "tether.tip", and so on.

    Parameters
    ----------
    assembly : Assembly
    y : (ny,) float, state about which the maps are linear
    """
    found: dict[str, LinearizedPoint] = {}
    for name, (family, index, where) in moving(assembly).items():
        if family == "beams":
            nodes = _nodes(assembly, index, where, y)
            found.update({f"{name}[{i}]": node for i, node in enumerate(nodes)})
            found[f"{name}.root"], found[f"{name}.tip"] = nodes[0], nodes[-1]
        elif family == "rods":
            nodes = _rod_nodes(assembly, index, y)
            found.update({f"{name}[{i}]": node for i, node in enumerate(nodes)})
            found[f"{name}.root"], found[f"{name}.tip"] = nodes[0], nodes[-1]
        elif family == "reduced_bodies":
            found.update(_interface_nodes(assembly, name, index, y))
        elif family == "threads":
            released = _thread_nodes(assembly, index, where, y)
            found.update({f"{name}[{i}]": node for i, node in released.items()})
            if 0 in released:
                found[f"{name}.tip"] = released[0]
        elif family == "points":
            found[name] = LinearizedPoint(_at(y, assembly.model.points["iq"][index]), where, np.eye(3), None)
        else:
            found[name] = _body(assembly, index, where, y)
    return found


def _at(y: Array, first: int) -> Array:
    return np.array(y[first : first + 3])


def _body(assembly: Assembly, index: int, where: slice, y: Array) -> LinearizedPoint:
    """A free body by its centre of mass, or one that turns about a fixed axis."""
    row = assembly.model.bodies[index]
    q = int(row["iq"])
    R = np.empty((3, 3))
    if row["motion"] == rigid.FREE:
        rotation_from_quaternion(*y[q + 3 : q + 7], R)
        zero = np.zeros((3, 3))
        return LinearizedPoint(_at(y, q), where, np.hstack([np.eye(3), zero]), np.hstack([zero, R]))
    rotation_about_axis(row["axis"], float(y[q]), row["R0"], R)
    return LinearizedPoint(np.array(row["x0"]), where, None, (R @ row["axis"])[:, None])


def _thread_nodes(assembly: Assembly, index: int, where: slice, y: Array) -> dict[int, LinearizedPoint]:
    """Nodes of a thread that move by coordinates of their own, by number."""
    row = assembly.model.threads[index]
    found = {}
    for i in range(int(row["end"] >= 0), int(assembly.s[index])):
        at = where.start + 3 * i
        found[i] = LinearizedPoint(_at(y, int(row["iq"]) + 3 * i), slice(at, at + 3), np.eye(3), None)
    return found


def _nodes(assembly: Assembly, index: int, where: slice, y: Array) -> list[LinearizedPoint]:
    """Nodes of a beam; rotations of its section, of a cable those of its axis, which has no twist."""
    row = assembly.model.beams[index]
    vectors = NODE_VECTORS[row["kind"]]
    size, found = 3 * vectors, []
    for i in range(int(row["nodes"])):
        node = y[row["iq"] + size * i : row["iq"] + size * (i + 1)].reshape(vectors, 3)
        at = where.start + size * i
        displacement = np.zeros((3, size))
        displacement[:, :3] = np.eye(3)
        rotation = np.zeros((3, size))
        if row["kind"] != BEAM:
            rotation[:, 3:] = _skew(node[1]) / (node[1] @ node[1])
        else:
            # least squares of theta x r = dr for both directions across
            across = node[2:]
            A = sum((r @ r) * np.eye(3) - np.outer(r, r) for r in across)
            rotation[:, 6:] = np.linalg.solve(A, np.hstack([_skew(r) for r in across]))
        found.append(LinearizedPoint(node[0].copy(), slice(at, at + size), displacement, rotation))
    return found


def _rod_nodes(assembly: Assembly, index: int, y: Array) -> list[LinearizedPoint]:
    """Nodes of a rod: bodies, whose centres are off the rod's ends."""
    model, found = assembly.model, []
    arms = rod_arms(model, index)
    for arm, b in zip(arms, bodies_of(model, "rods", index), strict=True):
        at = int(model.bodies["iv"][b]) - int(model.info.nq)
        place = _body(assembly, b, slice(at, at + 6), y)
        assert place.rotation is not None
        R = place.rotation[:, 3:]
        displacement = np.hstack([np.eye(3), -_skew(R @ arm) @ R])
        found.append(place._replace(position=place.position + R @ arm, displacement=displacement))
    return found


def _interface_nodes(assembly: Assembly, name: str, index: int, y: Array) -> dict[str, LinearizedPoint]:
    """Frame and interface nodes of a reduced body."""
    names, found = assembly.parts[name].model.names, {}
    own = bodies_of(assembly.model, "reduced_bodies", index)
    for k, b in enumerate(own):
        at = int(assembly.model.bodies["iv"][b]) - int(assembly.model.info.nq)
        for place in (f"{name}.{names[k - 1]}", f"{name}[{k - 1}]") if k > 0 else (name,):
            found[place] = _body(assembly, b, slice(at, at + 6), y)
    return found


def rigid_motions(assembly: Assembly, y: Array, point: Array) -> Array:
    """Displacements of the coordinates as the whole moves like a rigid body: (nv, 6).

    Columns: translation by 1 m along inertial x, y, z, then rotation by 1 rad about axes x, y, z through `point`. A
    body on a fixed axis takes part by its rotation about that axis.
    """
    model = assembly.model
    found, R = np.zeros((int(model.info.nv), 6)), np.empty((3, 3))
    for block in model.blocks[~idle(model, assembly.s)]:
        q, at, size, body = int(block["iq"]), int(block["iv"]) - int(model.info.nq), int(block["count"]), block["owner"]
        own = found[at : at + size]
        if block["kind"] == POSITION:
            own[:, :3], own[:, 3:] = np.eye(3), np.cross(np.eye(3), y[q : q + 3] - point).T
        elif block["kind"] == SLOPE:
            own[:, 3:] = np.cross(np.eye(3), y[q : q + 3]).T
        elif block["kind"] == ROTATION:
            rotation_from_quaternion(*y[q : q + 4], R)
            own[:, 3:] = R.T
        elif block["kind"] == ANGLE:
            rotation_about_axis(model.bodies["axis"][body], float(y[q]), model.bodies["R0"][body], R)
            own[0, 3:] = R @ model.bodies["axis"][body]
    return found


def _skew(a: Array) -> Array:
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])
