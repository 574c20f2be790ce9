"""Springs with a user's law under implicit methods, statics and modes, from rest."""

from __future__ import annotations

import math

import numpy as np
import pytest

from evolvent import Stepper, System, law, parts
from evolvent.solvers import solve
from evolvent.solvers.modal.modes import modes
from evolvent.solvers.static.static import solve_static
from evolvent.solvers.time.implicit.plan import solve_implicit

MASS, LINEAR, CUBIC, G, DAMPING = 0.2, 50.0, 200.0, 9.81, 0.05


@law
def hardening(extension, rate, t, p):
    return p[0] * extension + p[1] * extension**3


@law
def damped(extension, rate, t, p):
    return p[0] * extension + p[1] * extension**3 + p[2] * rate


def hanging(*, sideways: bool = False, law=hardening, parameters=(LINEAR, CUBIC)) -> System:
    """A ball that starts at rest at the end of an unstretched spring, below its mount or beside it."""
    system = System(gravity=(0.0, 0.0, -G))
    place = (1.0, 0.0, 0.0) if sideways else (0.0, 0.0, -1.0)
    system.add(parts.Point(mass=MASS, position=place), "ball")
    system.add(parts.Spring(a=(0.0, 0.0, 0.0), b="ball", length=1.0, law=law, parameters=parameters), "spring")
    return system


def deflection() -> float:
    """The root of k e + c e^3 = m g (Cardano)."""
    p, q = LINEAR / CUBIC, -MASS * G / CUBIC
    root = math.sqrt(0.25 * q * q + (p / 3.0) ** 3)
    return float(np.cbrt(-0.5 * q + root) + np.cbrt(-0.5 * q - root))


@pytest.mark.parametrize("step", [None, 1e-3])
@pytest.mark.parametrize("sideways", [False, True])
def test_it_falls_from_rest_as_under_dopri5(step: float | None, sideways: bool) -> None:
    assembly, times = hanging(sideways=sideways).assemble(), np.linspace(0.0, 1.0, 11)
    exact = solve(assembly, samples=times, method="dopri5", rtol=1e-10, atol=1e-12)
    found = solve_implicit(assembly, samples=times, step=step, tolerance=1e-7, spectral_radius=0.9)
    assert found.success, found.message
    np.testing.assert_allclose(found.y[:, :3], exact.y[:, :3], atol=2e-4)


@pytest.mark.parametrize("sideways", [False, True])
def test_its_static_deflection_is_the_root_of_the_cubic(sideways: bool) -> None:
    found = solve_static(hanging(sideways=sideways).assemble())
    assert found.success, found.message
    np.testing.assert_allclose(found.y[-1, :3], [0.0, 0.0, -1.0 - deflection()], atol=1e-9)


def test_its_modes_are_those_of_a_pendulum_and_of_the_slope_of_the_law() -> None:
    e = deflection()
    found = modes(hanging().assemble(), count=3)
    swing, bounce = math.sqrt(G / (1.0 + e)), math.sqrt((LINEAR + 3.0 * CUBIC * e * e) / MASS)
    np.testing.assert_allclose(found.frequency, [swing, swing, bounce], rtol=1e-6)
    np.testing.assert_allclose(found.decay_rate, 0.0, atol=1e-12)


def test_the_decay_rate_of_a_law_that_damps_is_that_of_its_slope() -> None:
    e = deflection()
    found = modes(hanging(law=damped, parameters=(LINEAR, CUBIC, DAMPING)).assemble(), count=3, damped=True)
    rate, square = 0.5 * DAMPING / MASS, (LINEAR + 3.0 * CUBIC * e * e) / MASS
    assert found.decay_rate[2] == pytest.approx(rate, rel=1e-6)
    assert found.frequency[2] == pytest.approx(math.sqrt(square - rate**2), rel=1e-6)


def test_it_is_stepped_from_outside() -> None:
    stepper = Stepper(hanging(), until=1.0, step=1e-3)
    for _ in range(10):
        stepper.step(0.1)
    exact = solve(hanging().assemble(), samples=[0.0, 1.0], method="dopri5", rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(stepper.state[:3], exact.y[-1, :3], atol=2e-4)
