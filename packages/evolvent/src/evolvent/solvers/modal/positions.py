"""Points of a structure: how bodies, points and nodes of beams move with the velocities' coordinates."""

from __future__ import annotations

import numpy as np

from evolvent.assembly.assembled import Assembly
from evolvent.kernels.blocks import ANGLE, POSITION, ROTATION, SLOPE, idle
from evolvent.kernels.rotations import rotation_about_axis, rotation_from_quaternion
from evolvent.model.questions import LinearizedPoint
from evolvent.model.registry import families
from evolvent.solvers.static.work import velocity_slice
from evolvent_base.errors import InputError, nearest

Array = np.ndarray


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


def nodal(assembly: Assembly, name: str) -> tuple[int, ...] | None:
    """Shape of a part's velocities by nodes: their number, then of one node's; None of a part without nodes."""
    family, index = assembly.names[name]
    shape = families()[family].state.nodal
    return None if shape is None else shape(families()[family].records(assembly.model)[index])


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
        points = families()[family].state.points
        if points is not None:
            found.update(points(assembly, name, index, where, y))
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
