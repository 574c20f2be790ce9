"""Steps on demand: the same as one run, closed forms under wrenches set from outside, and refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest

from evolvent import InputError, RunFailed, Stepper, System, elements, parts
from evolvent.solvers.implicit import solve_implicit


def craft(gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> System:
    """A free hub with a beam clamped to it."""
    system = System(gravity=gravity)
    system.add(parts.RigidBody(mass=20.0, inertia=5.0), "hub")
    section, material = elements.Rectangle(thickness=0.01, width=0.02), elements.Material(E=1e7, nu=0.3, density=1000.0)
    beam = parts.Beam(length=2.0, section=section, material=material, elements=6, position=(0.5, 0.0, 0.0))
    system.add(beam, "rib")
    system.add(parts.Joint(a=("hub", (0.5, 0.0, 0.0)), b=("rib", "root"), kind="clamp"), "root")
    return system


def mass() -> System:
    system = System()
    system.add(parts.RigidBody(mass=2.0, inertia=(0.5, 0.5, 0.8)), "body")
    system.add(parts.Spring(a=(0.0, 0.0, -1.0), b="body", stiffness=0.0, length=1.0, lateral_stiffness=50.0))
    return system


def test_steps_are_those_of_one_run() -> None:
    system = craft()
    stepper = Stepper(system, until=10.0, step=0.01)
    for _ in range(25):
        stepper.step(0.04)
    whole = solve_implicit(system.assemble(), samples=[0.0, 1.0], step=0.01)
    assert stepper.time == pytest.approx(1.0)
    np.testing.assert_allclose(stepper.state[: whole.y.shape[1]], whole.y[-1], atol=1e-9)


def test_a_torque_turns_the_whole_craft() -> None:
    """Angular momentum about the centre of mass follows the torque; the structure pulls back what the hub lacks."""
    stepper = Stepper(craft(), inputs=["hub"], until=10.0)
    momenta = []
    stepper.set_wrench("hub", torque=(0.0, 0.0, 0.2))
    for _ in range(50):
        before = stepper.body("hub").rate[2]
        stepper.step(0.02)
        momenta.append(stepper.wrench("hub")[1][2])
        gained = 5.0 * (stepper.body("hub").rate[2] - before) / 0.02
        if len(momenta) > 10:  # the mean of both ends is the step's to second order
            assert gained == pytest.approx(0.2 + 0.5 * (momenta[-1] + momenta[-2]), abs=2e-3)
    stepper.set_wrench("hub")
    assert stepper.body("hub").rate[2] > 0.0
    kept = stepper.body("hub").velocity
    for _ in range(5):
        stepper.step(0.02)
    assert np.all(np.isfinite(kept))


@pytest.mark.parametrize("method", ["generalized-alpha", "dopri5", "rk4"])
def test_a_force_held_from_outside_moves_an_oscillator(method: str) -> None:
    """x = F/k (1 - cos w t), the spring's force back is -k x; weight is not part of the wrench."""
    stepper = Stepper(mass(), inputs=["body"], method=method, until=10.0, tolerance=1e-8)
    stepper.set_wrench("body", force=(3.0, 0.0, 0.0))
    w = math.sqrt(50.0 / 2.0)
    for _ in range(40):
        stepper.step(0.025)
        x = 3.0 / 50.0 * (1.0 - math.cos(w * stepper.time))
        assert stepper.body("body").position[0] == pytest.approx(x, abs=5e-5)
        assert stepper.wrench("body")[0][0] == pytest.approx(-50.0 * x, abs=3e-3)


def test_weight_is_no_part_of_the_wrench() -> None:
    for method in ("generalized-alpha", "rk4"):
        system = System(gravity=(0.0, 0.0, -9.81))
        system.add(parts.RigidBody(mass=2.0, inertia=1.0), "body")
        stepper = Stepper(system, inputs=["body"], method=method, step=0.01, until=1.0)
        stepper.set_wrench("body", force=(0.0, 0.0, 2.0 * 9.81))
        stepper.step(0.1)
        np.testing.assert_allclose(stepper.wrench("body")[0], 0.0, atol=1e-9)
        np.testing.assert_allclose(stepper.body("body").velocity, 0.0, atol=1e-12)


def test_a_turned_body_has_its_quaternion_and_rate() -> None:
    system = System()
    system.add(parts.RigidBody(mass=2.0, inertia=1.0, angular_velocity=(0.0, 0.0, 0.5)), "body")
    stepper = Stepper(system, until=10.0)
    stepper.step(2.0)
    state = stepper.body("body")
    np.testing.assert_allclose(state.quaternion, [math.cos(0.5), 0.0, 0.0, math.sin(0.5)], atol=1e-7)
    np.testing.assert_allclose(state.rate, [0.0, 0.0, 0.5], atol=1e-12)


def test_refusals() -> None:
    with pytest.raises(InputError, match="inputs name 'bdy', which is no body; did you mean 'body'"):
        Stepper(mass(), inputs=["bdy"])
    with pytest.raises(InputError, match="method is 'rk5'"):
        Stepper(mass(), method="rk5")
    with pytest.raises(InputError, match="until is -1"):
        Stepper(mass(), until=-1.0)
    stepper = Stepper(mass(), until=1.0)
    with pytest.raises(InputError, match="'body' is not among the inputs"):
        stepper.set_wrench("body", force=(1.0, 0.0, 0.0))
    with pytest.raises(InputError, match="dt is 0"):
        stepper.step(0.0)
    with pytest.raises(InputError, match="beyond the stepper's end"):
        stepper.step(2.0)


def test_a_step_that_fails_says_why() -> None:
    system = craft()
    stepper = Stepper(system, inputs=["hub"], step=0.5, until=100.0)
    stepper.set_wrench("hub", torque=(1e9, 1e9, 0.0))
    with pytest.raises(RunFailed, match="the step of"):
        stepper.step(10.0)
