"""Modes of shells about states with stress: compression up to buckling, tension, spin."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from evolvent import System, parts
from shells.plates import material
from shells.test_shell_modes import add_supports

E, NU, H = 1e9, 0.3, 0.01
D = E * H**3 / (12.0 * (1.0 - NU**2))
BUCKLING = 4.0 * np.pi**2 * D  # N/m, of a square of 1 m


def square(force: float, n: int) -> float:
    """Square of the first frequency of a supported plate of 1 m x 1 m under a compression along x, N/m."""
    shell, system = parts.Shell(size=(1.0, 1.0), elements=(n, n), thickness=H, material=material(E, NU)), System()
    system.add(shell, "plate")
    add_supports(system, shell)
    x = shell.mesh().x
    for node, axis in ((0, (1.0, 0.0, 0.0)), (0, (0.0, 1.0, 0.0)), (n, (1.0, 0.0, 0.0))):
        guide = parts.Joint(type="guide", a=tuple(x[node]), b=f"plate[{node}]", axis=axis)
        system.add(guide, f"held {node} {int(axis[1])}")
    system.add(parts.Load(along="plate.x0", force=(force, 0.0, 0.0)), "left")
    system.add(parts.Load(along="plate.x1", force=(-force, 0.0, 0.0)), "right")
    return float(system.modes(count=1).frequency[0] ** 2)


def test_buckling_and_tension() -> None:
    """The square falls as 1 - N/(4 pi^2 D/b^2), by which it vanishes at the buckling load, with order 2 of the mesh."""
    start = square(0.0, 4)
    found = [(1.0 - square(share * BUCKLING, 4) / start) / share for share in (-0.5, 0.5, 0.9)]
    assert found == pytest.approx([found[0]] * 3, rel=1e-3)  # linear
    finer = (1.0 - square(0.5 * BUCKLING, 8) / square(0.0, 8)) / 0.5
    assert finer == pytest.approx(1.0, abs=0.025)
    assert (found[1] - 1.0) / (finer - 1.0) == pytest.approx(4.0, rel=0.2)


def test_spinning_strip() -> None:
    """A strip without much bending stiffness that spins about an axis across it flaps with W sqrt(n (2 n - 1))."""
    spin: Any = (0.0, 0.0, 20.0)
    shell = parts.Shell(
        size=(1.0, 0.1), elements=(12, 1), thickness=1e-4, material=material(1e9), position=(0.0, -0.05, 0.0),
        clamped=("x0",),
    )  # fmt: skip
    system = System()
    system.add(shell, "strip")
    found = system.modes(count=4, rotating=spin).frequency / 20.0
    assert found[[0, 2]] == pytest.approx(np.sqrt([1.0, 6.0]), rel=0.025)
    assert found[1] == pytest.approx(np.sqrt(2.0), rel=0.015)  # of torsion, by the propeller moment
