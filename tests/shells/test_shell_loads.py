"""Loads on edges and surfaces of shells, weight, and nodes by their positions."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from evolvent import InputError, System, parts
from shells.plates import add_symmetry, loaded, material, placed

E, H = 1e9, 0.01


def strip(**keys: Any) -> parts.Shell:
    """A cantilever of 1 x 0.2 m."""
    keys = {"thickness": H, "material": material(E), "clamped": ("x0",), **keys}
    return parts.Shell(size=(1.0, 0.2), elements=(8, 2), **keys)


def with_load(shell: parts.Shell, **load: Any) -> System:
    """A shell with one load."""
    system = System(gravity=load.pop("gravity", (0.0, 0.0, 0.0)))
    system.add(shell, "shell")
    system.add(parts.RigidBody(motion="driven", position=(0.0, 0.0, 9.0)), "hub")
    if load:
        system.add(parts.Load(**load), "load")
    return system


@pytest.mark.parametrize("edge", ["shell.x1", "shell.edge[1]"])
def test_force_on_an_edge(edge: str) -> None:
    """Forces on its nodes, by their lengths; the result is the sum in the middle of the edge."""
    wanted = placed(loaded(strip(), "x1", force=(0.0, 0.0, 2.0)))
    run = with_load(strip(), along=edge, force=(0.0, 0.0, "2 N/m")).equilibrium()
    assert run["shell"]["position"].values[-1] == pytest.approx(wanted, abs=1e-12)
    assert run["load"]["force"].values[-1] == pytest.approx([0.0, 0.0, 0.4])
    assert run["load"]["position"].values[-1] == pytest.approx(wanted[strip().edge("x1")].mean(axis=0), abs=1e-3)


def test_torque_along_an_edge() -> None:
    """A moment per length bends a strip to a circle, D/m, by a constant torque or one that follows a profile."""
    D, m = E * H**3 / 12.0, 20.0
    for keys in ({"torque": (0.0, f"{-m} N m/m", 0.0)}, {"axis": (0, -1, 0), "profile": {"constant": f"{m} N m/m"}}):
        run = with_load(strip(), along="shell.x1", **keys).equilibrium()
        assert run["load"]["torque"].values[-1] == pytest.approx([0.0, -0.2 * m, 0.0])
        normal = run["shell"]["normal"].values[-1, -1]
        assert np.arctan2(-normal[0], normal[2]) == pytest.approx(m / D, rel=2e-3)


def test_pressure_and_weight() -> None:
    """q L^4/(8 D) of a pressure, by a profile too, and of the weight; 2 % for 8 lumped elements."""
    q = 0.01
    cases: Any = (
        {"over": "shell", "force": (0.0, 0.0, f"{q} Pa"), "frame": "body"},
        {"over": "shell", "direction": (0, 0, 1), "profile": {"constant": f"{q} Pa"}, "frame": "body"},
        {"gravity": (0.0, 0.0, q / (1000.0 * H))},
    )
    wanted = q / (8.0 * E * H**3 / 12.0)
    found = [placed(with_load(strip(), **keys))[strip().edge("x1"), 2].mean() for keys in cases]
    assert found == pytest.approx([found[0]] * 3, rel=1e-5)
    assert found[0] == pytest.approx(wanted, rel=0.02)


def test_ring_under_pressure() -> None:
    """A quarter of a cylinder grows by p R^2/(E h); its hoop force is p R."""
    radius, p = 0.5, 100.0
    shell = parts.Shell(
        size=(0.2, 0.5 * np.pi * radius), radius=radius, elements=(1, 8), thickness=H, material=material(E),
        normal=(0.0, 0.0, 1.0),
    )  # fmt: skip
    system = with_load(shell, over="shell", force=(0.0, 0.0, p), frame="body")
    add_symmetry(system, shell, {"x0": 0, "y0": 1, "y1": 1})
    run = system.equilibrium()
    grown = p * radius**2 / (E * H)
    x, start = run["shell"]["position"].values[-1], shell.mesh().x
    assert x[0, 2] - start[0, 2] == pytest.approx(grown, rel=0.01)
    assert run["shell"]["membrane_force_2"].values[-1] == pytest.approx(p * radius, rel=0.01)


def test_pressure_follows() -> None:
    """Where the strip is bent far the resultant of a pressure is across the chord: p L times the chord over L."""
    p = 1000.0
    run = with_load(strip(), over="shell", force=(0.0, 0.0, p), frame="body").equilibrium(load_steps=[0.3, 0.6, 1.0])
    x = run["shell"]["position"].values[-1].reshape(9, 3, 3)
    chord = x[-1, 1] - x[0, 1]
    assert np.hypot(*chord[[0, 2]]) < 0.95
    wanted = 0.2 * p * np.array([-chord[2], 0.0, chord[0]])
    assert run["load"]["force"].values[-1] == pytest.approx(wanted, abs=0.01 * 0.2 * p)


def test_node_at_a_position() -> None:
    """A node by its position at the start; refused where none is near."""
    system = with_load(strip(), at=("shell", (1.0, 0.1, 0.0)), force=(0.0, 0.0, 1e-3))
    wanted = with_load(strip(), at="shell[25]", force=(0.0, 0.0, 1e-3))
    assert placed(system) == pytest.approx(placed(wanted), abs=1e-15)
    with pytest.raises(
        InputError, match=r"the nearest node of the shell 'shell' is 0.06 m from there, 'shell\[4\]' at"
    ):
        placed(with_load(strip(), at=("shell", (0.125, 0.1, 0.06)), force=(0.0, 0.0, 1e-3)))


def test_refusals() -> None:
    """One sentence each."""
    wrong: Any = (
        ({"along": "shell.x2", "force": (0, 0, 1)}, r"shell has no edge 'x2'; give one of edge\[0\], edge\[1\]"),
        ({"along": "shell.x1", "force": (0, 0, "1 Pa")}, "load.force has the unit Pa; it must be in N/m"),
        ({"over": "shell", "force": (0, 0, "1 N/m")}, "load.force has the unit N/m; it must be in Pa"),
        ({"along": "shell", "force": (0, 0, 1)}, r"a surface; give an edge, such as 'shell.edge\[0\]', or load.over"),
        ({"over": "shell.x1", "force": (0, 0, 1)}, "it must be the name of a surface"),
        ({"along": "shell.x1", "torque": (0, 0, "1 N m")}, r"load.torque has the unit N m; it must be in N"),
        ({"over": "shell", "torque": (0, 0, 1)}, "load.over is 'shell', over which a load is a force; give torques"),
        ({"along": "hub", "force": (0, 0, 1)}, "it must be a beam, a rod, a thread or an edge of a surface"),
        ({"at": "shell.x1", "force": (0, 0, 1)}, "no point of the shell 'shell'; loads act along edges"),
    )
    for keys, message in wrong:
        with pytest.raises(InputError, match=message):
            placed(with_load(strip(), **keys))
    with pytest.raises(InputError, match=r"shell\.clamped: shell has no edge 'root'"):
        placed(with_load(strip(clamped=("root",))))
