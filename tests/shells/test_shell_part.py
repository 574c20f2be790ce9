"""The part Shell: meshes, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from evolvent import System, parts
from evolvent_base.errors import InputError
from helpers import fitted_order
from shells.plates import material

SIZE: dict[str, Any] = {"size": (1.0, 0.2), "elements": (4, 1)}
WALL: dict[str, Any] = {"thickness": 0.01, "material": material(1e9, 0.3)}


def test_cylinder_and_given_nodes_have_the_same_axes() -> None:
    tube = parts.Shell(size=(1.0, 1.0), radius=0.5, elements=(4, 16), **WALL)
    x, R = (one.reshape(5, 17, *one.shape[1:]) for one in tube.mesh()[:2])
    assert np.hypot(x[..., 1], x[..., 2] + 0.5) == pytest.approx(0.5)
    assert R[..., 2] == pytest.approx((x - np.array([0.0, 0.0, -0.5])) / 0.5 * [0.0, 1.0, 1.0])
    nodes: Any = x
    own = parts.Shell(nodes=nodes, elements=(4, 16), **WALL).mesh().R
    assert own.reshape(R.shape) == pytest.approx(R, abs=2e-3)
    assert tube.edge_shares("y1").sum() == pytest.approx(1.0)


def test_estimated_normals_of_a_quarter_of_a_cylinder() -> None:
    """Within the mesh they are exact; at its edges to the third order: 3.4 degrees off with four elements."""
    off = []
    for n in (4, 8, 16):
        turn, y = np.meshgrid(np.linspace(0.0, 0.5 * np.pi, n + 1), np.linspace(0.0, 1.0, n // 2 + 1), indexing="ij")
        nodes: Any = np.stack([np.sin(turn), y, np.cos(turn)], axis=-1)
        found = parts.Shell(nodes=nodes, elements=(n, n // 2), **WALL).mesh().R[:, :, 2].reshape(nodes.shape)
        wrong = np.degrees(np.linalg.norm(np.cross(found, nodes * [1.0, 0.0, 1.0]), axis=-1))
        assert wrong[1:-1].max() < 1e-9
        off.append(wrong.max())
    assert off[0] < 3.5
    assert fitted_order(1.0 / np.array([4.0, 8.0, 16.0]), off) == pytest.approx(3.2, abs=0.2)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        (WALL | {"elements": (4, 1)}, "shell.size is missing"),
        (SIZE | WALL | {"normal": (1.0, 0.0, 1.0)}, "perpendicular to shell.direction"),
        (WALL | {"nodes": np.zeros((2, 2, 3)), "elements": (4, 1)}, r"must be \(5, 2, 3\)"),
        (WALL | {"nodes": np.zeros((2, 2, 3)), "elements": (1, 1)}, "elements there, such as 0, must have an area"),
        (
            WALL | {"nodes": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [0.2, 0.2, 0]]], "elements": (1, 1)},
            "element 0 of shell is not convex",
        ),
        (WALL | {"size": (1.0, 3.0), "radius": 0.5, "elements": (1, 2)}, "arcs of 171.9 deg; at most 90 deg"),
        (WALL | {"size": (1.0, 3.0), "radius": 0.25, "elements": (1, 2)}, "arcs of 343.8 deg; at most 90 deg"),
    ],
)
def test_refusals(keys: dict[str, Any], message: str) -> None:
    system = System()
    system.add(parts.Shell(**keys), "shell")
    with pytest.raises(InputError, match=message):
        system.assemble()


def test_references_to_nodes() -> None:
    system = System()
    system.add(parts.Shell(**SIZE, **WALL), "shell")
    system.add(parts.Load(at="shell[10]", force=(1.0, 0.0, 0.0)), "load")
    with pytest.raises(InputError, match=r"give a node from 'shell\[0\]' to 'shell\[9\]'"):
        system.assemble()
