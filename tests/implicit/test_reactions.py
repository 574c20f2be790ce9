"""Reactions at the samples of implicit runs: those of the state, whatever the method damps."""

from __future__ import annotations

import numpy as np
import pytest

from evolvent import System, parts

G = 9.81


@pytest.mark.parametrize("options", [{}, {"step": 5e-3}, {"spectral_radius": 1.0}, {"tolerance": 1e-7}])
def test_tension_of_a_pendulum(options):
    """m (v^2 / l - g . x / l), of the state at every sample."""
    system = System(gravity=(0.0, 0.0, -G))
    system.add(parts.Point(mass=1.5, position=(1.0, 0.0, 0.0)), "bob")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="bob", type="link"), "rod")
    run = system.simulate(until="1 s", method="generalized-alpha", **options)
    x, v = run["bob"].position.values, run["bob"].velocity.values
    tension = 1.5 * (np.sum(v**2, axis=1) - G * x[:, 2])
    assert np.abs(tension).max() > 40.0
    assert run["rod"].tension.values == pytest.approx(tension, abs=0.05 if "step" in options else 1e-4)


def test_moment_of_a_clamp():
    """A rigid arm clamped to a hub that a torque turns: the clamp carries what turns the arm."""
    system = System()
    system.add(parts.RigidBody(motion="spin", inertia=2.0), "hub")
    arm = parts.RigidBody(mass=3.0, inertia=0.4, position=(1.0, 0.0, 0.0))
    system.add(arm, "arm")
    system.add(parts.Joint(a="hub", b=("arm", (-1.0, 0.0, 0.0)), type="clamp"), "root")
    system.add(parts.Load(at="hub", axis=(0.0, 0.0, 1.0), profile=[(0.0, 0.0), (1.0, 1.0), (2.0, 0.0)]), "slew")
    run = system.simulate(until="3 s")
    t, rate = run.time.values, run["hub"].rate.values[:, 2]
    torque = np.interp(t, (0.0, 1.0, 2.0), (0.0, 1.0, 0.0))
    turning = torque / (2.0 + 0.4 + 3.0)  # rad/s2
    assert run["root"].moment.values[:, 2] == pytest.approx((0.4 + 3.0) * turning, abs=1e-5)
    along = np.einsum("ti,ti->t", run["root"].force.values, run["arm"].position.values)
    assert along == pytest.approx(-3.0 * rate**2, abs=1e-5)
