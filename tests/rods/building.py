"""Rods for the tests."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent import System, parts
from evolvent.assembly.assembled import Assembly
from evolvent.elements import Material, Rectangle
from evolvent.solvers.modal.positions import linearized_points
from evolvent.solvers.static.static import solve_static

Array = np.ndarray
ORIGIN = (0.0, 0.0, 0.0)
RUBBER = Material(young_modulus=1e8, poisson_ratio=0.3, density=1000.0)
STRIP = Rectangle(thickness=0.02, width=0.04)


def cantilever(load: Any = None, **keys: Any) -> System:
    """A rod clamped at its root to the ground, with a load (a part) on it."""
    system = System()
    system.add(parts.Rod(**({"length": 1.0, "section": STRIP, "material": RUBBER, "elements": 4} | keys)), "rod")
    system.add(parts.Joint(a=keys.get("position", ORIGIN), b="rod.root", type="clamp"), "clamp")
    if load is not None:
        system.add(load, "load")
    return system


def tip(assembly: Assembly, y: Array, where: str = "rod.tip") -> Array:
    """LinearizedPoint of a node, m."""
    return linearized_points(assembly, y)[where].position


def bent(load: Any, **keys: Any) -> Array:
    """Tip of a cantilever in equilibrium, m."""
    assembly = cantilever(load, **keys).assemble()
    found = solve_static(assembly)
    assert found.success, found.message
    return tip(assembly, found.y[-1])
