"""The works of `benchmarks/shell_peers.py`: shells as numbers that every program takes, and the ways of solving them.

A mesh is a grid of nodes (n1 + 1, n2 + 1, 3) with normals. Edges are "x0", "x1" (across axis 1) and "y0", "y1".
Edges of symmetry lie in planes across an axis of space. Forces are N, moments N m, of directions that do not change.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

Array = np.ndarray
KRATOS = {"thick": "ShellThickElementCorotational3D4N", "thin": "ShellThinElementCorotational3D4N"}


def edge(n: tuple[int, int], name: str) -> list[int]:
    """Nodes of an edge; node (i, j) has the number i (n2 + 1) + j."""
    numbers = np.arange((n[0] + 1) * (n[1] + 1)).reshape(n[0] + 1, n[1] + 1)
    return {"x0": numbers[0], "x1": numbers[-1], "y0": numbers[:, 0], "y1": numbers[:, -1]}[name].tolist()


def quads(n: tuple[int, int]) -> list[list[int]]:
    """Nodes of each element, about the normal."""
    across = n[1] + 1
    first = [i * across + j for i in range(n[0]) for j in range(n[1])]
    return [[k, k + across, k + across + 1, k + 1] for k in first]


def spread(x: Array, nodes: list[int], total: tuple[float, float, float]) -> list[list[Any]]:
    """A force or moment along an edge of (n, 3) nodes, by their shares of its length."""
    lengths = np.linalg.norm(np.diff(x[nodes], axis=0), axis=1)
    shares = 0.5 * (np.append(lengths, 0.0) + np.insert(lengths, 0, 0.0)) / lengths.sum()
    return [[node, (share * np.array(total)).tolist()] for node, share in zip(nodes, shares, strict=True)]


def shell(x: Array, normals: Array, thickness: float, E: float, nu: float, **more: Any) -> dict[str, Any]:
    """What all works have; x (n1 + 1, n2 + 1, 3), m."""
    n = (x.shape[0] - 1, x.shape[1] - 1)
    spec: dict[str, Any] = {"force": [], "torque": [], "clamped": [], "symmetric": {}, "pinned": [], **more}
    return {
        "n": n, "nodes": x.tolist(), "normals": normals.tolist(), "quads": quads(n), "thickness": thickness, "E": E,
        "nu": nu, **spec, "held": held(n, spec),
    }  # fmt: skip


def held(n: tuple[int, int], spec: dict[str, Any]) -> list[list[Any]]:
    """Which of the three displacements and three rotations of a node are 0."""
    found = np.zeros(((n[0] + 1) * (n[1] + 1), 6), bool)
    for name in spec["clamped"]:
        found[edge(n, name)] = True
    for name, axis in spec["symmetric"].items():
        found[edge(n, name)] |= [i == axis if i < 3 else i - 3 != axis for i in range(6)]
    found[spec["pinned"], :3] = True
    return [[int(node), found[node].tolist()] for node in np.flatnonzero(found.any(axis=1))]


def flat(size: tuple[float, float], n: tuple[int, int]) -> tuple[Array, Array]:
    """Nodes and normals of a rectangle."""
    grid = np.meshgrid(*(np.linspace(0.0, length, k + 1) for length, k in zip(size, n, strict=True)), indexing="ij")
    x = np.stack([*grid, np.zeros_like(grid[0])], axis=-1)
    return x, np.broadcast_to([0.0, 0.0, 1.0], x.shape)


def cantilever(n: tuple[int, int]) -> dict[str, Any]:
    x, normals = flat((10.0, 1.0), n)
    load = spread(x.reshape(-1, 3), edge(n, "x1"), (0.0, 0.0, 4.0))
    watched = [[edge(n, "x1")[0], 0], [edge(n, "x1")[0], 2]]
    return shell(x, normals, 0.1, 1.2e6, 0.0, clamped=["x0"], force=load, watched=watched)


def roll_up(n: tuple[int, int]) -> dict[str, Any]:
    x, normals = flat((12.0, 1.0), n)
    load = spread(x.reshape(-1, 3), edge(n, "x1"), (0.0, -50.0 * np.pi / 3.0, 0.0))
    watched = [[edge(n, "x1")[0], 0], [edge(n, "x1")[0], 2]]
    return shell(x, normals, 0.1, 1.2e6, 0.0, clamped=["x0"], torque=load, watched=watched)


def annular_plate(n: tuple[int, int]) -> dict[str, Any]:
    r, turn = np.linspace(6.0, 10.0, n[0] + 1)[:, None], np.linspace(0.0, 2.0 * np.pi, n[1] + 1)
    x = np.stack([r * np.cos(turn), r * np.sin(turn), 0.0 * r * turn], axis=-1)
    ends = edge(n, "y1")
    load = spread(x.reshape(-1, 3), ends, (0.0, 0.0, 0.8 * 4.0))
    normals = np.broadcast_to([0.0, 0.0, 1.0], x.shape)
    watched = [[ends[0], 2], [ends[-1], 2]]
    return shell(x, normals, 0.03, 21e6, 0.0, clamped=["y0"], force=load, watched=watched)


def cylinder(n: tuple[int, int]) -> dict[str, Any]:
    """An eighth of it; the point that is pulled is node 0, on top."""
    along, turn = np.linspace(0.0, 5.175, n[0] + 1)[:, None], np.linspace(0.0, 0.5 * np.pi, n[1] + 1)
    normals = np.stack([0.0 * along * turn, np.sin(turn) + 0.0 * along, np.cos(turn) + 0.0 * along], axis=-1)
    x = 4.953 * normals + np.stack([along + 0.0 * turn, 0.0 * along * turn, 0.0 * along * turn], axis=-1)
    planes = {"x0": 0, "y0": 1, "y1": 2}
    return shell(
        x, normals, 0.094, 10.5e6, 0.3125, symmetric=planes, force=[[0, [0.0, 0.0, 10000.0]]], watched=[[0, 2]]
    )


def plate(n: int) -> dict[str, Any]:
    """A plate of 1 m x 1 m that falls from the horizontal, held at node 0, whose rotation is free."""
    x, normals = flat((1.0, 1.0), (n, n))
    return shell(x, normals, 0.01, 2e7, 0.3, density=1000.0, gravity=9.81, area=1.0, pinned=[0], tip=(n + 1) ** 2 - 1)


#: Of each static work: its function, meshes from coarse to fine, reference of what is watched, source, its length where
#: errors are of it, and the load steps of evolvent and of Kratos.
STATIC: dict[str, dict[str, Any]] = {
    "cantilever, end force of 4": {
        "build": cantilever, "meshes": [(16, 1), (64, 1)], "wanted": [-3.2893, 6.6999], "source": "elastica",
        "evolvent": 4, "kratos": 2,
    },
    "roll-up to a circle": {
        "build": roll_up, "meshes": [(16, 1), (64, 1)], "wanted": [-12.0, 0.0], "length": 12.0,
        "source": "closed form", "evolvent": [0.25, 0.5, 0.75, 1.0], "kratos": 5,
    },
    "slit annular plate, 0.8 per length": {
        "build": annular_plate, "meshes": [(6, 30), (10, 80)], "wanted": [13.891, 17.528],
        "source": "Sze, Liu, Lo 2004", "evolvent": 10, "kratos": 20,
    },
    "open cylinder pulled by 40000": {
        "build": cylinder, "meshes": [(16, 24), (32, 48)], "wanted": [2.768], "source": "Sze, Liu, Lo 2004",
        "evolvent": [0.025, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0], "kratos": 5,
    },
}  # fmt: skip
BUILD: dict[str, Callable[..., dict[str, Any]]] = {name: work["build"] for name, work in STATIC.items()}
#: Of the swinging plate: samples, s.
SAMPLES = [0.0, 0.05, 0.1, 0.15, 0.2]
