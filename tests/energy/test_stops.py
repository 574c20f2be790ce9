"""Energy-momentum at starts, stops, turns and at the ends of a cylinder."""

from __future__ import annotations

import math

import numpy as np
import pytest

from evolvent import System, elements, parts
from evolvent.solvers.time.implicit.energy_momentum import solve_energy


@pytest.mark.parametrize("motion", ["free", "spin"])
def test_a_steady_turn_is_resolved(motion: str) -> None:
    """Mean rates do not change, but a body turns by 2 atan(h w/2) in a step: the tolerance holds for that, too."""
    system, rate, end = System(), 2.0, 10.0
    given = {"angular_velocity": (0.0, 0.0, rate)} if motion == "free" else {"axis": (0.0, 0.0, 1.0), "rate": rate}
    system.add(parts.RigidBody(mass=1.0, inertia=(1.0, 1.0, 1.0), motion=motion, **given), "body")
    found = solve_energy(system.assemble(), samples=[0.0, end], tolerance=1e-8)
    assert found.success
    if motion == "free":
        turned = 2.0 * math.atan2(found.y[-1, 6], found.y[-1, 3])
        assert math.remainder(turned - rate * end, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-4)
    else:
        assert found.y[-1, 0] == pytest.approx(rate * end, abs=1e-4)


def test_a_load_that_begins_after_a_long_rest() -> None:
    """Steps have become long by then: they begin again as short as at the start."""
    system = System()
    system.add(parts.Point(mass=1.0, position=(1.0, 0.0, 0.0)), "mass")
    system.add(parts.Spring(a=(0.0, 0.0, 0.0), b="mass", length=1.0, stiffness=4.0), "spring")
    system.add(parts.Load(at="mass", force=(1.0, 0.0, 0.0), start=10.0), "force")
    found = solve_energy(system.assemble(), samples=np.linspace(0.0, 20.0, 201), tolerance=1e-7, spectral_radius=1.0)
    wanted = np.where(found.t > 10.0, 0.25 * (1.0 - np.cos(2.0 * (found.t - 10.0))), 0.0)
    assert found.y[:, 0] - 1.0 == pytest.approx(wanted, abs=5e-4)


@pytest.mark.parametrize("step", [2e-2, 1e-3])
def test_a_strip_that_slides_in_below_the_surface_brings_no_energy(step: float) -> None:
    """The ends of a cylinder do not push; what comes in over them keeps its depth."""
    system, count = System(), 5
    nodes, rates = np.zeros((2, count, 2, 3))
    nodes[:, 0, 0], nodes[:, 0, 1], nodes[:, 0, 2] = np.linspace(-0.05, 0.05, count), 0.495, -0.2
    nodes[:, 1, 0], rates[:, 0, 2] = 1.0, 0.5
    strip = {"section": elements.Rectangle(thickness=0.01, width=0.02), "elements": count - 1, "formulation": "cable"}
    material = elements.Material(young_modulus=1e8, poisson_ratio=0.0, density=1000.0)
    system.add(parts.Beam(length=0.1, material=material, nodes=nodes, rates=rates, **strip), "strip")
    drum = parts.Contact(a="strip", b="ground", shape=parts.Cylinder(radius=0.5, length=0.2), stiffness=1e4)
    system.add(drum, "drum")
    found = solve_energy(system.assemble(), samples=np.linspace(0.0, 1.0, 101), step=step)
    assert found.success
    assert np.all(found.energy <= found.energy[0] * (1.0 + 1e-9))
    assert np.all(np.diff(found.balance.by_contact) >= -1e-12)
    assert found.y[-1, 2] > 0.1  # through to the other side


def test_a_released_penalty_loses_its_energy_to_the_joints() -> None:
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=(1.0, 1.0, 1.0)), "body")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b=("body", (0.0, 0.0, 0.0)), stiffness=100.0, until=1.0), "joint")
    system.add(parts.Load(at="body", force=(10.0, 0.0, 0.0)), "pull")
    found = solve_energy(system.assemble(), samples=np.linspace(0.0, 2.0, 21), tolerance=1e-6, spectral_radius=1.0)
    assert found.balance.by_joints[-1] > 0.1
    assert np.abs(found.energy_defect).max() < 1e-3 * np.abs(found.balance.loads).max()
