"""A wheel and a thruster on one body: every method finds the same motion."""

from __future__ import annotations

import numpy as np
import pytest

from evolvent import System, parts


def craft() -> System:
    """A free body that a wheel turns, with a thruster that hardly pushes."""
    found = System()
    found.add(parts.RigidBody(mass=3.0, inertia=(0.4, 0.5, 0.6), angular_velocity=(0.05, 0.3, -0.1)), "body")
    found.add(parts.ReactionWheel(body="body", axis=(1.0, 0.0, 0.0), inertia=0.02, torque=0.05), "wheel")
    found.add(parts.Thruster(at=("body", (0.1, 0.0, 0.0)), direction=(0.0, 0.0, 1.0), thrust=1e-9), "thruster")
    return found


@pytest.mark.slow
@pytest.mark.parametrize("method", ["generalized-alpha", "energy-momentum"])
def test_implicit_methods_agree_with_an_explicit_one(method: str) -> None:
    ends = [craft().simulate(until=1.0, every=0.5, method=name, step=2e-3) for name in ("rk4", method)]
    rates = [run["body"]["rate"].values[-1] for run in ends]
    assert np.abs(rates[1] - rates[0]).max() < 1e-5
    momenta = [run["angular_momentum"].values[-1] for run in ends]
    assert np.abs(momenta[1] - momenta[0]).max() < 1e-6
