"""Cases of reduced flexible bodies."""

from __future__ import annotations

import functools
import pathlib
import tempfile

import numpy as np

from evolvent import System, parts
from evolvent.assembly.assembled import Assembly
from evolvent.elements.reduced_files import write_model
from evolvent.elements.reduced_models import ReducedModel
from families.beams import ORIGIN
from families.case import Array, Case, columns, of

STIFFNESS, OTHERS, FALL = 100.0, 400.0, 0.5


def two_nodes(stiffness: Array, masses: Array, length: float = 1.0) -> ReducedModel:
    """Two nodes with masses, the second held by springs in its place on the first, at a distance along x."""
    B = np.hstack([-np.eye(6), np.eye(6)])
    B[:3, 3:6] = -np.cross(np.eye(3), [length, 0.0, 0.0]).T  # the turn of the first one moves that place
    return ReducedModel(
        B.T @ np.diag(stiffness) @ B, np.diag(np.tile(masses, 2)), np.array([[0.0, 0.0, 0.0], [length, 0.0, 0.0]]),
        ("root", "tip"), B[:1] * stiffness[0], ("pull",), ("N",),
    )  # fmt: skip


@functools.cache
def two_node_file() -> str:
    """A file of two nodes of unit mass and inertia, softest along the line between them."""
    folder = tempfile.mkdtemp(prefix="evolvent-")
    path = str(pathlib.Path(folder) / "two-nodes.npz")
    write_model(path, two_nodes(np.array([STIFFNESS, *5 * (OTHERS,)]), np.ones(6)))
    return path


def node_place(assembly: Assembly, y: Array, name: str, node: int) -> Array:
    """Positions (..., 3) of an interface node, m."""
    row = assembly.model.reduced_bodies[assembly.names[name][1]]
    q = int(assembly.model.bodies["iq"][int(row["first_body"]) + 1 + node])
    return np.asarray(y[..., q : q + 3])


@of("a reduced body")
def reduced_body() -> Case:
    """The second node, on a spring along the line, falls: g m/k (1 - cos(w t))."""

    def system() -> System:
        found = System(gravity=(FALL, 0.0, 0.0))
        found.add(parts.ReducedBody(file=two_node_file()), "arm")
        found.add(parts.Joint(a=ORIGIN, b="arm.root", type="clamp"), "root")
        return found

    w = np.sqrt(STIFFNESS)
    return Case(
        part="arm", system=system, seen=lambda assembly, y: node_place(assembly, y, "arm", 1)[..., :1], end=2.0,
        step=1e-3, motion=lambda t: columns(1.0 + FALL / w**2 * (1.0 - np.cos(w * t))), still=(1.0 + FALL / w**2,),
        poles=(1j * w,),
    )  # fmt: skip
