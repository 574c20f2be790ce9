"""Adaptive steps of thin rods after sudden loads follow bending, not the shear waves of the section."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import evolvent as ev
from evolvent import System, parts

LENGTH, RADIUS, FORCE = 0.5, 5e-4, 1e-3


def tip(t: np.ndarray, E: float, rho: float, modes: int = 12) -> np.ndarray:
    """Deflection of the tip of a cantilever under a tip force from t = 0 on, by the modes of Euler and Bernoulli.

    Each mode has the value 2 at the tip and the mass rho A L: w = sum of 4 F (1 - cos(w_n t))/(rho A L w_n^2).
    """
    A, J = math.pi * RADIUS**2, math.pi * RADIUS**4 / 4.0
    found = np.zeros_like(t)
    for n in range(modes):
        near = (n + 0.5) * math.pi
        b = brentq(lambda x: math.cos(x) + 1.0 / math.cosh(x), near - 0.5, near + 0.5)
        w = (b / LENGTH) ** 2 * math.sqrt(E * J / (rho * A))
        found += 4.0 * FORCE * (1.0 - np.cos(w * t)) / (rho * A * LENGTH * w * w)
    return found


@pytest.mark.slow
def test_steps_after_a_sudden_load() -> None:
    steel = ev.STEEL
    system = System()
    section = ev.Circle(radius=RADIUS)
    system.add(parts.Rod(length=LENGTH, section=section, material="steel", elements=16), "wire")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="wire.root", type="clamp"), "root")
    system.add(parts.Load(at="wire.tip", force=(0.0, FORCE, 0.0)), "load")
    run = system.simulate(until=0.05, every=1e-3, tolerance=1e-6)
    wanted = tip(run.time.values, steel.E, steel.density)
    assert np.abs(run["wire"].tip_position.values[:, 1] - wanted).max() < 3e-3 * wanted.max()
    # the fastest bending of 16 elements has 4 sqrt(EI/(rho A))/l^2 = 5.7e3 1/s, shear waves 1.3e7 1/s: of the latter
    # a twelfth of a period is 4e-8 s
    assert run.ev.statistics["mean_step"] > 1e-5
