"""Adaptive steps that would step over a turn or a contact, of which their error estimates show nothing."""

from __future__ import annotations

import numpy as np
import pytest

from evolvent import System, parts


@pytest.mark.slow
def test_a_steady_torque_turns_a_body_on_a_hinge() -> None:
    """Rate 5 t and angle 2.5 t^2, at every sample and over several turns."""
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=(1.0, 1.0, 0.02)), "wheel")
    system.add(parts.Joint(a="ground", b="wheel", type="revolute", position=(0.0, 0.0, 0.0)), "axle")
    system.add(parts.Load(at="wheel", torque=(0.0, 0.0, 0.1)), "torque")
    run = system.simulate(until=2.0, every=0.1, method="generalized-alpha")
    assert run["wheel"].rate.values[:, 2] == pytest.approx(5.0 * run.time.values, abs=5e-3)
    assert run["axle"].angle.values == pytest.approx(2.5 * run.time.values**2, abs=5e-3)


@pytest.mark.parametrize("method", ["energy-momentum", "dopri5"])
def test_round_bodies_do_not_pass_through_each_other(method: str) -> None:
    """A ball that falls on a fixed one from 0.3 m keeps bouncing, without loss."""
    system, ball = System(gravity=(0.0, 0.0, -9.81)), parts.Sphere(radius=0.1)
    system.add(parts.RigidBody(mass=1.0, shape=ball, position=(0.0, 0.0, 0.5)), "ball")
    system.add(parts.Contact(a="ball", b=(0.0, 0.0, 0.0), shape=ball, stiffness=1e5), "contact")
    run = system.simulate(until=2.0, every=0.01, method=method)
    assert run["ball"].position.values[:, 2].min() > 0.18
    assert np.abs(run.energy_defect.values[-1]) < 0.1
