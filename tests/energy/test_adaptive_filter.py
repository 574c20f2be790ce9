"""The filter of energy-momentum at adaptive steps: errors follow the tolerance, and no step is rejected for it."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from evolvent import System, parts
from evolvent.elements import Material, Rectangle
from evolvent.solvers import solve
from evolvent.solvers.common.balance import defect
from evolvent.solvers.common.solution import Solution
from evolvent.solvers.time.implicit import energy_momentum
from evolvent.solvers.time.implicit.energy_momentum import solve_energy
from evolvent.solvers.time.implicit.run import ImplicitRun

#: The least spectral radius, with the strongest filter.
LEAST = 1.0 / 3.0
SOFT = Material(young_modulus=1e7, poisson_ratio=0.3, density=2700.0)
TORQUE, MASS, INERTIA, REACH = 1.0, 2.0, 0.1, 0.5


def arm(**system: object) -> System:
    """A body on a hinge, its centre of mass away from the axis."""
    found = System(**system)
    found.add(parts.RigidBody(mass=MASS, inertia=(INERTIA, INERTIA, INERTIA), position=(REACH, 0.0, 0.0)), "arm")
    found.add(
        parts.Joint(a="ground", b="arm", type="revolute", axis=(0.0, 0.0, 1.0), position=(0.0, 0.0, 0.0)), "hinge"
    )
    return found


def ran(system: System, end: float, tolerance: float, rho: float) -> Solution:
    """An adaptive run."""
    samples = np.linspace(0.0, end, 31)
    found = solve_energy(system.assemble(), samples=samples, tolerance=tolerance, spectral_radius=rho)
    assert found.success, found.message
    return found


def gained(found: Solution) -> float:
    """Largest increase of the energy balance over its start, beside the energy moved: the filter may return its own."""
    return float(found.energy_defect.max()) / float(found.statistics["energy_moved"])


@pytest.mark.parametrize("rho", [LEAST, 0.9])
def test_the_rate_of_an_arm_under_a_torque_follows_the_tolerance(rho: float) -> None:
    """The rate is torque t/J. The error is of second order in the step, which is the cube root of the tolerance.

    It is that of the energy that the filter stores, chi/4 dv^2 M: 6e-6 at 1e-7 and a spectral radius of 1/3.
    """
    system = arm()
    system.add(parts.Load(at="arm", torque=(0.0, 0.0, TORQUE)), "torque")
    exact, errors = TORQUE * 3.0 / (INERTIA + MASS * REACH**2), []
    for tolerance in (1e-5, 1e-6, 1e-7, 1e-8):
        found, bare = ran(system, 3.0, tolerance, rho), ran(system, 3.0, tolerance, 1.0)
        errors.append(abs(found.y[-1, int(found.model.bodies["iv"][-1]) + 5] - exact) / exact)
        assert errors[-1] < 0.6 * tolerance ** (2.0 / 3.0)
        assert found.statistics["rejected_steps"] <= 10
        assert found.statistics["steps"] < 1.2 * bare.statistics["steps"]
    assert errors[0] / errors[-1] > 50.0  # 100 of the order 2/3


def test_a_drum_under_a_constant_torque_is_exact() -> None:
    """Steps that grow to the longest: a load on a segment of fixed length falls at m g r^2/(J + m r^2)."""
    m, J, r, g = 0.75, 0.01, 0.1, 9.81
    system = System(gravity=(g, 0.0, 0.0))
    system.add(parts.RigidBody(motion="driven"), "hub")
    system.add(parts.Reel(body="hub", radius=r, drive=parts.FreeSpool(inertia=J, angle=5.0)), "reel")
    system.add(
        parts.Thread(
            reel="reel", segments="inextensible", length=5.0, line_density=0.1, tip_mass=0.5, nodes=1
        ),
        "thread",
    )  # fmt: skip
    found = ran(system, 0.5, 1e-7, LEAST)
    angle = found.y[:, int(found.model.threads["spool_q"][0])] - 5.0
    fall = 0.5 * m * g * r / (J + m * r**2) * found.t**2
    assert np.abs(angle - fall).max() < 3e-6 * fall[-1]  # 3e-7; 2e-3 with r = 1 where steps grow


def oscillator() -> System:
    """A mass on a spring."""
    system = System()
    system.add(parts.Point(mass=1.0, position=(1.3, 0.0, 0.0)), "mass")
    system.add(parts.Spring(a=("ground", (0.0, 0.0, 0.0)), b="mass", length=1.0, stiffness=40.0), "spring")
    return system


@pytest.mark.parametrize(("build", "steps"), [(oscillator, 1.3), (lambda: arm(gravity=(0.0, -9.81, 0.0)), 1.2)])
def test_the_filter_costs_few_steps_and_no_accuracy(build, steps: float) -> None:  # type: ignore[no-untyped-def]
    """An oscillator and a pendulum: against a tight run of Dormand and Prince, or one without the filter."""
    system, tolerance = build(), 1e-6
    if system.parts.keys() == {"arm", "hinge"}:
        exact = ran(system, 3.0, 1e-10, 1.0).y
    else:
        exact = solve(system.assemble(), samples=np.linspace(0.0, 3.0, 31), method="dopri5", rtol=1e-11, atol=1e-13).y
    found, bare = ran(system, 3.0, tolerance, LEAST), ran(system, 3.0, tolerance, 1.0)
    n = int(found.model.info.nq)
    errors = [np.abs(one.y[:, :n] - exact[:, :n]).max() for one in (found, bare)]
    assert errors[0] < 1.6 * errors[1]
    assert found.statistics["steps"] < steps * bare.statistics["steps"]
    assert found.statistics["rejected_steps"] < 25  # 532 of 929 steps with r = 1 where steps grow
    assert gained(found) < 1e-11


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [1e-4, 1e-6])
def test_the_filter_of_strains_follows_the_tolerance(tolerance: float) -> None:
    """A soft free rod that turns and bends: as accurate with the filter as without, and the energy only falls."""
    system = System()
    system.add(
        parts.Rod(
            length=1.0, section=Rectangle(thickness=0.01, width=0.02), material=SOFT, elements=6,
            angular_velocity=(0.0, 0.5, 6.0),
        ),
        "boom",
    )  # fmt: skip
    exact = ran(system, 1.0, 1e-9, 1.0)
    found, bare = ran(system, 1.0, tolerance, LEAST), ran(system, 1.0, tolerance, 1.0)
    n = int(found.model.info.nq)
    errors = [np.abs(one.y[:, :n] - exact.y[:, :n]).max() for one in (found, bare)]
    assert errors[0] < 3.0 * errors[1]
    assert gained(found) < 1e-10


def test_a_beam_gains_no_energy_at_changing_steps() -> None:
    """A clamped strip that falls, whose axial vibration no step resolves."""
    system = System(gravity=(0.0, -9.81, 0.0))
    strip = Material(young_modulus=1e9, poisson_ratio=0.3, density=1600.0)
    section = Rectangle(thickness=1e-3, width=0.02)
    system.add(parts.Beam(length=1.0, section=section, material=strip, elements=8, formulation="cable"), "strip")
    system.add(parts.Joint(a="ground", b="strip.root", type="clamp"), "root")
    for tolerance in (1e-3, 1e-5):
        assert gained(ran(system, 0.5, tolerance, LEAST)) < 1e-10


def falling_arm() -> System:
    """A pendulum."""
    return arm(gravity=(0.0, -9.81, 0.0))


@pytest.mark.parametrize("factors", [(2.0, 0.5), (1.9, 1.0, 0.6), ()], ids=["alternating", "in turn", "at random"])
@pytest.mark.parametrize("build", [oscillator, falling_arm])
def test_energy_of_the_system_and_of_the_filter_never_increases(
    build: Callable[[], System], factors: tuple[float, ...], rng: np.random.Generator
) -> None:
    """E less work + chi/4 dv.M dv over steps of changing lengths; the filter falls at longer ones, and comes back."""
    plan = energy_momentum.plan(build().assemble(), samples=[0.0, 1e3], tolerance=1e-4, spectral_radius=LEAST)
    run = ImplicitRun(plan)
    work, masses = run.work, np.array([MASS] * 3 + [INERTIA] * 3 if build is falling_arm else [1.0] * 3)
    assert run.begin() == ""
    energies, filters = [], []
    for k in range(400):
        given = factors[k % len(factors)] if factors else math.exp(rng.uniform(-math.log(2.0), math.log(2.0)))
        work.loop.step = 0.008 * given
        steps = int(work.loop.steps)
        while work.loop.steps == steps:
            run.advance(1)
        step = work.step.step
        filters.append(float(step.chi))
        energies.append(float(defect(work.balance, 0.0)) + 0.25 * filters[-1] * float(masses @ work.step.before**2))
    found, size = np.array(energies), np.ptp(filters)
    assert np.diff(found[1:]).max() < 1e-11
    assert found[1] - found[-1] < 0.1
    assert size > 0.02
    assert max(filters) == pytest.approx(0.125)
