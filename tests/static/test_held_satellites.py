"""Stability of equilibria of rods that joints hold."""

from __future__ import annotations

import numpy as np
import pytest

from evolvent import System, parts
from evolvent.elements import Circle, Material
from evolvent.solvers.static.static import solve_static

METAL = Material(young_modulus=70e9, poisson_ratio=0.3, density=2700.0)
SECTION = Circle(radius=0.005)


def boom(elements: int, load: float, *, push: float = 0.0) -> System:
    """A rod of 3 m with a tip mass on a satellite that is clamped to the ground."""
    system = System()
    system.add(parts.RigidBody(mass=50.0, inertia=(10.0, 10.0, 10.0)), "satellite")
    system.add(parts.Joint(a=(0, 0, 0), b="satellite", type="clamp"), "stand")
    system.add(parts.Rod(length=3.0, section=SECTION, material=METAL, elements=elements, position=(0.5, 0, 0)), "boom")
    system.add(parts.Joint(a=("satellite", (0.5, 0, 0)), b="boom.root", type="clamp"), "root")
    system.add(parts.RigidBody(mass=2.0, inertia=(0.01, 0.01, 0.01), position=(3.5, 0, 0)), "tip")
    system.add(parts.Joint(a="tip", b="boom.tip", type="clamp"), "end")
    system.add(parts.Load(at="tip", force=(-push, 0.0, -load)), "load")
    return system


@pytest.mark.parametrize("elements", [8, 30])
@pytest.mark.parametrize("load", [0.0, 1.0, 20.0])
def test_a_boom_with_a_tip_mass_on_a_held_satellite_is_stable(elements: int, load: float) -> None:
    found = solve_static(boom(elements, load).assemble())
    assert found.path.unstable == 0


@pytest.mark.parametrize(("part", "ways"), [(0.99, 0), (1.02, 2)])
def test_it_is_unstable_beyond_the_load_of_euler(part: float, ways: int) -> None:
    """Two ways: the section is round."""
    EI = METAL.E * SECTION.properties(0.3).Iz
    load = part * np.pi**2 * EI / (4.0 * 3.0**2)
    assert solve_static(boom(12, 0.0, push=load).assemble()).path.unstable == ways
