"""Temperatures of geometrically exact rods against closed forms and the heated beam."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import evolvent as ev
from evolvent import parts
from evolvent_base.errors import InputError
from implicit.test_tangent import disturbed, worst

ALUMINIUM = ev.Material(young_modulus=70e9, poisson_ratio=0.3, density=2700.0, thermal_expansion=23e-6)
EXPANSION, LENGTH, RADIUS = 23e-6, 2.0, 0.01
EA, EI = 70e9 * math.pi * RADIUS**2, 70e9 * math.pi * RADIUS**4 / 4.0


def boom(*held: str, elements: int = 4, kind: str = "clamp", **load: Any) -> ev.System:
    """A heated rod along x, held at some of its ends."""
    system = ev.System()
    system.add(
        parts.Rod(length=LENGTH, elements=elements, section=ev.Circle(radius=RADIUS), material=ALUMINIUM), "boom"
    )
    for end in held:
        place = (LENGTH if end == "tip" else 0.0, 0.0, 0.0)
        system.add(parts.Joint(a=place, b=f"boom.{end}", type=kind), f"at_{end}")
    system.add(parts.ThermalLoad(part="boom", **load), "heat")
    return system


def test_a_free_rod_expands_without_stress(book: Any) -> None:
    found = boom("root", temperature={"constant": "100 K"}).equilibrium()
    growth = EXPANSION * 100.0 * LENGTH
    error = abs(float(found["boom"].tip_position[-1, 0]) - LENGTH - growth) / growth
    book("Statics of beams", "free thermal expansion (rod)", reference="alpha dT L", source="closed form", error=error,
         allowed=1e-9)  # fmt: skip
    assert np.abs(found["boom"].axial_force).max() < 1e-9 * EA * EXPANSION * 100.0
    assert np.abs(found["boom"].strain).max() < 1e-12
    assert abs(found["boom"].energy_elastic[-1]) < 1e-9 * EA * (EXPANSION * 100.0) ** 2 * LENGTH
    np.testing.assert_allclose(found["heat"].free_strain[-1], EXPANSION * 100.0, rtol=1e-12)


def test_a_rod_held_at_both_ends_is_compressed(book: Any) -> None:
    found = boom("root", "tip", temperature={"constant": 5.0}).equilibrium()
    wanted = -EA * EXPANSION * 5.0
    error = float(np.abs(found["boom"].axial_force[-1] / wanted - 1.0).max())
    book("Statics of beams", "heated rod between clamps", reference="-E A alpha dT", source="closed form", error=error,
         allowed=1e-9)  # fmt: skip
    energy = 0.5 * EA * (EXPANSION * 5.0) ** 2 * LENGTH
    assert found["boom"].energy_elastic[-1] == pytest.approx(energy, rel=1e-9)
    assert float(found.energy_elastic[-1]) == pytest.approx(float(found["boom"].energy_elastic[-1]), rel=1e-9)


@pytest.mark.parametrize(("key", "axis", "moment"), [("gradient_y", 1, "z"), ("gradient_z", 2, "y")])
def test_a_gradient_bends_a_free_rod_into_an_arc(key: str, axis: int, moment: str, book: Any) -> None:
    found = boom("root", elements=4, **{key: {"constant": "40000 K/m"}}).equilibrium()
    k = EXPANSION * 40000.0
    tip = float(found["boom"].tip_position[-1, axis])
    book("Statics of beams", f"rod with a temperature gradient along {key[-1]}, 105 degrees (4 elements)",
         reference="tip of an arc of curvature alpha dT'", source="closed form",
         error=abs(tip * k / (1.0 - math.cos(k * LENGTH)) + 1.0), allowed=1e-9)  # fmt: skip
    assert tip < 0.0  # the hot side is the outer one
    assert np.abs(found["boom"][f"bending_moment_{moment}"]).max() < 1e-6 * EI * k


def test_a_profile_along_the_rod() -> None:
    """Temperature that falls to nothing at the middle: the rod grows by the mean."""
    found = boom("root", temperature={"constant": 100.0}, along=[[0.0, 1.0], [0.5, 0.0], [1.0, 0.0]]).equilibrium()
    growth = float(found["boom"].tip_position[-1, 0]) - LENGTH
    assert growth == pytest.approx(0.25 * EXPANSION * 100.0 * LENGTH, rel=1e-9)
    np.testing.assert_allclose(found["heat"].temperature_change[-1], [75.0, 25.0, 0.0, 0.0], atol=1e-9)


def test_heat_lowers_the_frequency_of_a_pinned_rod_until_it_buckles() -> None:
    """w^2 = w0^2 (1 - dT/dT_c), dT_c = pi^2 I/(A alpha L^2)."""
    critical = math.pi**2 * EI / (EA * EXPANSION * LENGTH**2)
    w0 = math.pi**2 * math.sqrt(EI / (2700.0 * math.pi * RADIUS**2)) / LENGTH**2
    system = boom("root", "tip", kind="spherical", elements=12, temperature={"constant": 0.9 * critical})
    found = abs(system.modes(count=3).pole)
    w = found[found > 1e-3 * w0].min()  # nothing holds it about its axis
    assert (w / w0) ** 2 == pytest.approx(0.1, abs=3e-3)


#: Steps of the implicit methods, s; the rod's axial modes have periods from 0.4 ms.
STEPS = {"energy-momentum": 1e-4, "generalized-alpha": 1e-5}


@pytest.mark.parametrize("method", [*STEPS, "dopri5"])
def test_the_work_of_a_changing_temperature_closes_the_balance(method: str) -> None:
    system = boom(elements=2, temperature={"ramp": {"final": 50.0, "duration": "10 ms"}},
                  gradient_z={"table": [[0, 0], [0.01, 400], [0.02, -100]]})  # fmt: skip
    options = {"tolerance": 1e-8} if method == "dopri5" else {"step": STEPS[method], "spectral_radius": 1.0}
    found = system.simulate(until=0.02, every=1e-4, method=method, **options)
    energy = float(found.energy.max())
    assert energy > 1e-3
    limit = 1e-3 if method == "generalized-alpha" else 1e-6
    assert np.abs(found.energy_defect).max() < limit * energy
    np.testing.assert_allclose(found.work_loads, found["heat"].work, atol=0.01 * energy)
    assert np.abs(found.momentum).max() < 1e-9


def test_the_tangent_of_a_heated_rod() -> None:
    system = boom(temperature={"constant": 300.0}, gradient_y={"constant": 5e3}, gradient_z={"constant": 2e3})
    found = disturbed(system.assemble(), np.random.default_rng(4), 0.005)
    assert worst(found, np.zeros(0)) < 1e-6


def test_a_rod_takes_one_thermal_load() -> None:
    system = boom("root", temperature={"constant": 1.0})
    system.add(parts.ThermalLoad(part="boom", temperature={"constant": 1.0}), "more")
    with pytest.raises(InputError, match=r"more\.part is 'boom', which has a thermal load already; one rod takes one"):
        system.assemble()
