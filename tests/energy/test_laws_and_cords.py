"""Custom forces and cords on drums by the energy-momentum method."""

from __future__ import annotations

import math

import numpy as np
import pytest

from evolvent import System, law, parts
from evolvent.solvers import solve
from evolvent.solvers.common.solution import Solution
from evolvent.solvers.time.implicit.energy_momentum import solve_energy
from implicit.test_custom_forces import connected, triangle


def ran(system: System, end: float, step: float, rho: float = 1.0) -> Solution:
    found = solve_energy(system.assemble(), samples=np.linspace(0.0, end, 11), step=step, spectral_radius=rho)
    assert found.success, found.message
    return found


@pytest.mark.slow
def test_a_custom_force_is_that_of_springs() -> None:
    """Laws that say what springs say: the same motion and energy to second order."""
    off, defect = [], []
    for step in (0.02, 0.01):
        plain, own = (ran(connected(law), 1.0, step) for law in (False, True))
        n = int(plain.assembly.model.info.nq)
        off.append(np.abs(own.y[:, :n] - plain.y[:, :n]).max())
        defect.append(np.abs(own.energy_defect).max() / own.energy[0])
        assert not own.balance.loads.any()
        assert own.balance.by_springs[-1] == pytest.approx(plain.balance.by_springs[-1], rel=0.01)
    assert off[1] < 0.3 * off[0] < 1e-3
    assert defect[1] < 0.3 * defect[0] < 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("step", [0.05, 0.02])
def test_a_law_between_free_places_keeps_momenta(step: float) -> None:
    found = ran(triangle(), 4.0, step)
    scale = np.abs(found.momentum.angular).max()
    assert np.abs(found.momentum.drift_linear).max() < 1e-11
    assert np.abs(found.momentum.drift_angular).max() < 2e-8 * scale


@pytest.mark.parametrize("step", [0.1, 0.02])
def test_a_law_does_the_work_that_it_states(step: float) -> None:
    """Its force is the mean along the increment, so its work is the change of its energy at any step."""
    found = ran(triangle(), 4.0, step)
    assert np.abs(found.energy_defect).max() < 1e-7 * found.energy[0]
    assert not found.balance.loads.any()
    assert np.abs(found.momentum.drift_angular).max() < 2e-8 * np.abs(found.momentum.angular).max()


@law
def overstated(t, x, v, parameters, f):
    """A spring along x that states twice its energy."""
    f[0] = -parameters[0] * x[0]
    return parameters[0] * x[0] * x[0], 0.0


def test_a_law_that_states_another_energy_than_that_of_its_forces_fails() -> None:
    system = System()
    system.add(parts.Point(mass=1.0, position=(0.0, 0.0, 0.0), velocity=(1.0, 0.0, 0.0)), "ball")
    system.add(parts.CustomForce(points=["ball"], law=overstated, parameters=(4.0,)), "cord")
    found = solve_energy(system.assemble(), samples=np.linspace(0.0, 2.0, 5), step=0.05, spectral_radius=1.0)
    assert found.status == "failed"
    assert "or the energy that 'cord' states is not that of its forces" in found.message


def satellite() -> System:
    """A spinning free body that two masses on cords despin, the second cord on a drum beside the centre."""
    system, radius, free = System(), 0.2, 0.1
    system.add(parts.RigidBody(mass=5.0, inertia=(0.1, 0.1, 0.15), angular_velocity=(0.0, 0.0, 3.0)), "body")
    for k, sign in enumerate((1.0, -1.0)):
        at, place = 0.05 * k, np.array([sign * radius, sign * free, 0.0])
        place[0] += at
        system.add(
            parts.Point(mass=0.3, position=tuple(place), velocity=tuple(np.cross([0.0, 0.0, 3.0], place))), f"mass-{k}"
        )
        cord = parts.Joint(
            a=("body", (at, 0.0, 0.0)),
            b=f"mass-{k}",
            type="link",
            length=free + 2.0 * math.pi * radius,
            drum=radius,
            anchor=(sign, 0.0, 0.0),
            sense=1,
        )
        system.add(cord, f"cord-{k}")
    return system


@pytest.mark.parametrize("step", [0.02, 0.005])
def test_cords_that_unwind_keep_energy_and_momenta(step: float) -> None:
    found = ran(satellite(), 0.6, step)
    energy, momentum = found.energy, found.momentum
    assert np.abs(found.y[-1, :7] - found.y[0, :7]).max() > 0.1
    assert np.abs(energy - energy[0]).max() < 1e-9 * energy[0]
    assert np.abs(momentum.drift_linear).max() < 1e-10
    assert np.abs(momentum.drift_angular).max() < 1e-9 * np.abs(momentum.angular).max()


def test_cords_against_dormand_prince() -> None:
    exact = solve(satellite().assemble(), samples=[0.0, 0.6], method="dopri5", rtol=1e-11, atol=1e-13).y[-1]
    n = int(satellite().assemble().model.info.nq)
    errors = [np.abs(ran(satellite(), 0.6, h).y[-1] - exact)[:n].max() for h in (0.01, 0.005, 0.0025)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(np.abs(orders - 2.0) < 0.2), (orders, errors)


def test_a_cord_round_a_post() -> None:
    """A mass that circles a post on a cord: its speed stays, and the free part follows the involute."""
    radius, free, speed, mass = 0.1, 1.0, 0.7, 0.5
    system = System()
    system.add(parts.Point(mass=mass, position=(radius, free, 0.0), velocity=(speed, 0.0, 0.0)), "bob")
    cord = parts.Joint(
        a=(0.0, 0.0, 0.0),
        b="bob",
        type="link",
        length=free + 2.0 * math.pi * radius,
        drum=radius,
        anchor=(1.0, 0.0, 0.0),
        sense=1,
    )
    system.add(cord, "cord")
    found = ran(system, 2.0, 0.02)
    x = found.y[:, :3]
    assert np.linalg.norm(found.y[:, 3:6], axis=1) == pytest.approx(np.full(found.t.size, speed), rel=1e-9)
    s = np.sqrt(np.sum(x**2, axis=1) - radius**2)
    sign = -1.0 if s[-1] < free else 1.0
    assert s == pytest.approx(np.sqrt(free**2 + sign * 2.0 * radius * speed * found.t), rel=1e-4)
    assert math.isclose(found.energy[-1], 0.5 * mass * speed**2, rel_tol=1e-9)


@pytest.mark.slow
def test_after_a_tangent_that_does_not_serve_convergence_is_judged_anew() -> None:
    """A mass meets a stiff law: the tangent of the steps before corrects by far too much, which says nothing more."""
    system = System()
    system.add(parts.Point(mass=1.0, position=(1.0, 0.0, 0.0), velocity=(1.0, 0.0, 0.0)), "mass")
    law = {"law": "k*max(x - c, 0)**2", "constants": {"k": 1e12, "c": 0.03}}
    system.add(parts.Spring(a=(0.0, 0.0, 0.0), b="mass", length=1.0, **law))
    rough, exact = (
        solve_energy(system.assemble(), samples=np.linspace(0.0, 0.06, 7), step=0.01, newton=newton, largest_gain=1e9)
        for newton in (1e-6, 1e-13)
    )
    assert exact.y[-1, 0] < 1.03  # it has come back
    assert rough.y[:, 0] == pytest.approx(exact.y[:, 0], abs=1e-5)
