"""The part Shell: sections, meshes, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from evolvent import System, parts
from evolvent.elements import Material
from evolvent_base.errors import InputError
from shells.plates import loaded, material, placed

SIZE: dict[str, Any] = {"size": (1.0, 0.2), "elements": (4, 1)}
WALL: dict[str, Any] = {"thickness": 0.01, "material": material(1e9, 0.3)}
FIBRES = Material(young_modulus=140e9, poisson_ratio=0.3, density=1600.0, shear=5e9)


def ply(angle: float, thickness: float = 1e-3) -> dict[str, Any]:
    return {"thickness": thickness, "material": FIBRES, "across": 10e9, "angle": np.radians(angle)}


def test_wall_of_equal_plies_and_its_matrix_are_the_wall() -> None:
    """Stiffness, mass, and the equilibrium of a cantilever."""
    wall = parts.Shell(**SIZE, **WALL, clamped=("x0",))
    half = {"thickness": 0.005, "material": WALL["material"]}
    plies = parts.Shell(**SIZE, plies=[half, half], clamped=("x0",))
    matrix: Any = wall.section().C
    by_matrix = parts.Shell(**SIZE, matrix=matrix, mass_per_area=10.0, clamped=("x0",))
    assert wall.section().thickness == pytest.approx(0.01)
    ends = []
    for shell in (wall, plies, by_matrix):
        assert shell.section().C == pytest.approx(wall.section().C, rel=1e-12, abs=1e-9)
        assert shell.section().mass == pytest.approx(10.0)
        ends.append(placed(loaded(shell, "x1", force=(0.0, 0.0, 5.0)))[-1])
    assert ends[0][2] > 0.01
    assert ends[1] == pytest.approx(ends[0], rel=1e-9)
    assert ends[2] == pytest.approx(ends[0], rel=1e-9)


def test_laminates_by_closed_forms() -> None:
    """Cross-ply and angle-ply: A, B and D of the plies' stiffnesses; an angle of 90 deg swaps the axes."""
    size = 1.0 - 0.09 * 10.0 / 140.0
    along, across = 140e9 / size, 10e9 / size
    C = parts.Shell(**SIZE, plies=[ply(0.0), ply(90.0)]).section().C
    assert C[0, 0] == pytest.approx(1e-3 * (along + across))
    assert C[1, 1] == pytest.approx(C[0, 0])
    assert C[0, 3] == pytest.approx(0.5e-6 * (across - along))
    assert C[1, 4] == pytest.approx(-C[0, 3])
    assert C[3, 3] == pytest.approx(1e-9 / 3.0 * (along + across))
    C = parts.Shell(**SIZE, plies=[ply(45.0), ply(-45.0), ply(-45.0), ply(45.0)]).section().C
    assert np.abs(C[:3, 3:6]).max() == 0.0
    assert C[2, 2] == pytest.approx(4e-3 * (0.25 * (along + across) - 0.5 * 0.3 * across))
    assert C[3, 5] > 0.0  # bending along axis 1 twists


def test_unsymmetric_laminate_curls_under_tension() -> None:
    """A strip of two plies without Poisson's ratio bends to the curvature -B N/(A D - B^2)."""
    one = {"thickness": 1e-3, "material": material(10e9)}
    two = {"thickness": 1e-3, "material": material(1e9)}
    shell = parts.Shell(**SIZE, plies=[one, two], clamped=("x0",))
    C, force = shell.section().C, 0.01
    curvature = -C[0, 3] * force / (C[0, 0] * C[3, 3] - C[0, 3] ** 2)
    tip = placed(loaded(shell, "x1", force=(force, 0.0, 0.0)))[-1]
    assert abs(tip[2]) == pytest.approx(0.5 * abs(curvature), rel=5e-3)


def test_cylinder_and_given_nodes_have_the_same_axes() -> None:
    tube = parts.Shell(size=(1.0, 1.0), radius=0.5, elements=(4, 16), **WALL)
    x, R = tube.mesh()
    assert np.hypot(x[..., 1], x[..., 2] + 0.5) == pytest.approx(0.5)
    assert R[..., 2] == pytest.approx((x - np.array([0.0, 0.0, -0.5])) / 0.5 * [0.0, 1.0, 1.0])
    nodes: Any = x
    own = parts.Shell(nodes=nodes, elements=(4, 16), **WALL).mesh()[1]
    assert own == pytest.approx(R, abs=2e-3)
    assert tube.edge_shares("y1").sum() == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        (SIZE, "shell has nothing of its section"),
        (SIZE | WALL | {"plies": [ply(0.0)]}, "thickness and material and plies of its section"),
        (SIZE | {"matrix": np.eye(3), "mass_per_area": 1.0}, r"shell.matrix has the shape \(3, 3\)"),
        (SIZE | {"matrix": -np.eye(8), "mass_per_area": 1.0}, "not symmetric and positive definite"),
        (WALL | {"elements": (4, 1)}, "shell.size is missing"),
        (SIZE | WALL | {"normal": (1.0, 0.0, 1.0)}, "perpendicular to shell.direction"),
        (WALL | {"nodes": np.zeros((2, 2, 3)), "elements": (4, 1)}, r"must be \(5, 2, 3\)"),
        (WALL | {"nodes": np.zeros((2, 2, 3)), "elements": (1, 1)}, "elements there must have an area"),
        (
            WALL | {"nodes": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [0.2, 0.2, 0]]], "elements": (1, 1)},
            "element 0 of shell is not convex",
        ),
        (WALL | {"size": (1.0, 3.0), "radius": 0.5, "elements": (1, 2)}, "normals of element 0 are 172 deg apart"),
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
