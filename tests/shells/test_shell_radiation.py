"""Radiation pressure on both sides of shells, against a rigid panel's closed form."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import evolvent as ev
from evolvent import parts
from evolvent_base.errors import InputError
from implicit.test_tangent import disturbed, worst

PRESSURE, SIZE = 1e-3, (0.4, 0.3)
WALL = ev.Material(young_modulus=1e9, poisson_ratio=0.3, density=1000.0)
OPTICS: Any = {"specular": 0.7, "diffuse": 0.1, "specular_bottom": 0.2, "diffuse_bottom": 0.5}


def sail(direction: Any, **light: Any) -> ev.System:
    system = ev.System()
    system.add(parts.Shell(size=SIZE, elements=(3, 2), thickness=1e-3, material=WALL), "sail")
    keys = OPTICS | light
    system.add(parts.Radiation(over="sail", pressure=PRESSURE, direction=direction, **keys), "light")
    return system


@pytest.mark.parametrize(("direction", "specular", "diffuse"), [((0.6, 0, -0.8), 0.7, 0.1), ((0.6, 0, 0.8), 0.2, 0.5)])
def test_the_lit_side_reflects(direction: tuple[float, float, float], specular: float, diffuse: float) -> None:
    """F = p A a [(1 - specular) s + (2 specular a + 2/3 diffuse) m] on a shell that hardly bends, as its momentum."""
    found: Any = sail(direction).simulate(until=0.01, every=0.01, method="energy-momentum", step=0.001, fine=False)
    s, m, a = np.array(direction), np.array([0.0, 0.0, np.sign(direction[2])]), 0.8
    area = SIZE[0] * SIZE[1]
    wanted = PRESSURE * area * a * ((1.0 - specular) * s + (2.0 * specular * a + 2.0 / 3.0 * diffuse) * m)
    np.testing.assert_allclose(found["sail"].momentum.values[-1] / 0.01, wanted, rtol=1e-6, atol=1e-12)


def test_the_tangent_of_light_on_both_sides() -> None:
    system = sail((0.6, 0.0, -0.8))
    assert worst(disturbed(system.assemble(), np.random.default_rng(4), 0.005), np.zeros(0)) < 1e-6


def test_sides_that_a_thread_does_not_have_are_refused() -> None:
    with pytest.raises(InputError, match=r"light\.specular_bottom and light\.diffuse_bottom add up to 1\.2"):
        sail((0, 0, 1), specular_bottom=0.7).assemble()
    system = ev.System()
    system.add(parts.RigidBody(mass=1.0, inertia=(1.0, 1.0, 1.0)), "body")
    system.add(parts.Radiation(over="body", pressure=PRESSURE), "light")
    with pytest.raises(InputError, match=r"light\.over is 'body'; it must be a surface"):
        system.assemble()
