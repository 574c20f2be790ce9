"""Systems of many bodies, joints and loops: what they cost, and frames against lumped masses."""

from __future__ import annotations

import numpy as np
import pytest

from evolvent import System, elements, parts
from evolvent.algebra import ordering
from evolvent.solvers.time.implicit.plan import matrix_of, rows_of_part
from implicit.rigs import SQUARE, coordinates, momenta, run

#: Legs sway with about 3 Hz.
PLASTIC = elements.Material(young_modulus=2e8, poisson_ratio=0.3, density=1000.0)


def frame(n: int, *, lumped: str = "bodies", mass: float = 0.05) -> System:
    """Two legs of n elements on the ground, a bar between their tips, and a body or a point jointed to every node."""
    system = System(gravity=(2.0, 1.0, -9.81))
    for leg in range(2):
        system.add(
            parts.Beam(
                length=1.0, section=SQUARE, material=PLASTIC, elements=n, formulation="cable",
                position=(float(leg), 0.0, 0.0), direction=(0.0, 0.0, 1.0), normal=(1.0, 0.0, 0.0),
            ),
            f"leg{leg}",
        )  # fmt: skip
        system.add(parts.Joint(a=(float(leg), 0.0, 0.0), b=f"leg{leg}.root", type="clamp"), f"foot{leg}")
        for k in range(1, n + 1):
            place, name = (float(leg), 0.0, k / n), f"mass{leg}-{k}"
            if lumped == "bodies":
                system.add(parts.RigidBody(mass=mass, inertia=(2e-4, 3e-4, 4e-4), position=place), name)
            else:
                system.add(parts.Point(mass=mass, position=place), name)
            system.add(parts.Joint(a=f"leg{leg}[{k}]", b=name))
    system.add(parts.RigidBody(mass=0.5, inertia=(0.01, 0.05, 0.05), position=(0.5, 0.0, 1.0)), "bar")
    for leg in range(2):
        system.add(parts.Joint(a=f"leg{leg}.tip", b=("bar", (leg - 0.5, 0.0, 0.0))))
    return system


def test_bodies_on_joints_at_their_centres_move_as_points_do() -> None:
    """A body jointed at its centre of mass is a point mass to the frame, whatever its moments of inertia."""
    found = []
    for lumped in ("bodies", "points"):
        assembly = frame(6, lumped=lumped).assemble()
        solution = run(assembly, np.linspace(0.0, 0.2, 5), step=1e-3, spectral_radius=0.9)
        found.append(coordinates(assembly, solution.y, "bar"))
    assert np.abs(found[0][-1, :3] - found[0][0, :3]).max() > 1e-3
    assert found[0] == pytest.approx(found[1], abs=1e-10)


def test_the_bar_follows_the_momentum_of_the_whole() -> None:
    """Momentum of all parts against the impulses of weight and of what holds the feet."""
    step, samples = 5e-4, np.arange(0.0, 0.1 + 1e-9, 5e-4)
    assembly = frame(5).assemble()
    solution = run(assembly, samples, step=step, spectral_radius=1.0)
    P = momenta(assembly, solution)[:, :3]
    weight = (2.0 * 1.0 * SQUARE.thickness * SQUARE.width * 1000.0 + 10 * 0.05 + 0.5) * np.array([2.0, 1.0, -9.81])
    held = sum(solution.la[:, rows_of_part(assembly, f"foot{leg}")][:, :3] for leg in range(2))
    # a joint between the ground (a) and a node (b) puts -la on b
    force = weight - held
    impulse = np.trapezoid(force, samples, axis=0)
    assert P[-1] - P[0] == pytest.approx(impulse, abs=2e-4 * np.abs(weight).max() * 0.1)


def test_cost_is_in_proportion_to_the_number_of_bodies() -> None:
    matrices = [matrix_of(frame(n).assemble().model) for n in (10, 20, 40)]
    for cost in ([ordering.operations(m) for m in matrices], [m.values.size for m in matrices]):
        assert cost[2] - cost[1] == pytest.approx(2 * (cost[1] - cost[0]), rel=0.02)
