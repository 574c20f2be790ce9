"""The flexible pendulum against the converged tip of an independent code."""

from __future__ import annotations

import numpy as np
import pytest

from book import Book
from evolvent import System, elements, parts
from evolvent.solvers.time.implicit.plan import solve_implicit

#: Tip (x, y) of Exudyn 1.13.6, ANCFCable, 160 elements, h = 1 ms, spectral radius 0.9; m, at 0.5, 1 and 2 s.
PEER = np.array([[1.330004, -1.203512], [-1.778448, -0.921687], [0.031765, -2.004549]])


@pytest.mark.parametrize(("n", "error"), [(40, 1e-3), (80, 1e-4)])
def test_tip_of_the_flexible_pendulum(n: int, error: float, book: Book) -> None:
    system = System(gravity=(0.0, -9.81, 0.0))
    material = elements.Material(young_modulus=2e6, poisson_ratio=0.3, density=1000.0)
    section = elements.Rectangle(thickness=0.02, width=0.02)
    system.add(
        parts.Beam(length=2.0, section=section, material=material, elements=n, formulation="cable_stretch"), "cable"
    )
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="cable.root"))
    found = solve_implicit(system.assemble(), samples=[0.0, 0.5, 1.0, 2.0], step=1e-3, spectral_radius=0.9)
    assert found.success, found.message
    tip = found.y[1:, 6 * n : 6 * n + 2]
    book(
        "Dynamics", f"Flexible pendulum of 2 m, tip at 0.5, 1 and 2 s (cable_stretch, {n} elements)",
        reference="converged tip", source="Exudyn 1.13.6, ANCFCable, 160 elements",
        error=np.linalg.norm(tip - PEER, axis=1).max(), allowed=error, unit="m",
    )  # fmt: skip
