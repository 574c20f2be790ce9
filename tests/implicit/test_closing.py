"""Starts that are off their constraints by the digits of their numbers: the gap is no motion."""

from __future__ import annotations

import math

import numpy as np
import pytest

from evolvent import System, parts

OFF = 7e-10


def ring(joint: str, off: float) -> System:
    """Six rods around a hexagon, each joined with the next one, of which the last ends too far by a gap, m."""
    made, corner = System(), [np.array([math.cos(a), math.sin(a), 0.0]) for a in math.pi / 3.0 * np.arange(7)]
    for k in range(6):
        along = corner[k + 1] - corner[k]
        made.add(
            parts.Rod(
                length=1.0 + off * (k == 5), elements=1, section={"tube": {"radius": 0.02, "thickness": 1e-3}},
                material="cfrp", position=tuple(corner[k]), direction=tuple(along), normal=(0.0, 0.0, 1.0),
            ), f"bar {k}",
        )  # fmt: skip
    for k in range(6):
        axis = {"axis": (0.0, 0.0, 1.0)} if joint == "revolute" else {}
        made.add(parts.Joint(a=f"bar {k}.tip", b=f"bar {(k + 1) % 6}.root", type=joint, **axis), f"corner {k}")
    return made


@pytest.mark.parametrize("method", ["energy-momentum", "generalized-alpha"])
@pytest.mark.parametrize("joint", ["clamp", "spherical"])
def test_a_gap_is_no_motion(joint: str, method: str) -> None:
    """A loop that is 0.7 nm open starts closed, and does not move when the first steps are 10 ns long."""
    run = ring(joint, OFF).simulate(until=1e-3, method=method)
    moved = np.abs(run["bar 2"].position.values - run["bar 2"].position.values[0]).max()
    assert moved < 3.0 * OFF
    assert float(run["energy_kinetic"].values.max()) < 1e-6
    tip, root = run["bar 5"].position.values[0, -1], run["bar 0"].position.values[0, 0]
    np.testing.assert_allclose(tip, root, atol=1e-12)


def test_redundant_joints_close_too() -> None:
    """Hinges around a plane loop repeat one another, and the start still meets them."""
    run = ring("revolute", OFF).simulate(until=1e-3, method="energy-momentum")
    tip, root = run["bar 5"].position.values[0, -1], run["bar 0"].position.values[0, 0]
    np.testing.assert_allclose(tip, root, atol=1e-11)
    assert float(run["energy_kinetic"].values.max()) < 1e-6


def test_a_start_that_fits_is_left_as_it_is() -> None:
    """A chain that is written in order has no gaps; its start is kept to the last bit."""
    made = System()
    made.add(parts.RigidBody(mass=2.0, inertia=(0.1, 0.1, 0.1), position=(0.1, 0.2, 0.3)), "a")
    made.add(parts.RigidBody(mass=1.0, inertia=(0.1, 0.1, 0.1), position=(0.6, 0.2, 0.3)), "b")
    made.add(parts.Joint(a=("a", (0.5, 0.0, 0.0)), b="b", type="spherical"), "joint")
    run = made.simulate(until=1e-3, method="energy-momentum")
    assert run["b"].position.values[0].tolist() == [0.6, 0.2, 0.3]
