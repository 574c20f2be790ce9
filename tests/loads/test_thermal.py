"""Temperatures of beams against closed forms: free and held expansion, gradients, buckling, sudden heating."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import evolvent as ev
from evolvent import cases, parts
from evolvent_base.errors import InputError
from implicit.test_tangent import disturbed, worst

ALUMINIUM = ev.Material(young_modulus=70e9, poisson_ratio=0.3, density=2700.0, thermal_expansion=23e-6)
EXPANSION, LENGTH, RADIUS = 23e-6, 2.0, 0.01
EA, EI = 70e9 * math.pi * RADIUS**2, 70e9 * math.pi * RADIUS**4 / 4.0
WARM = {"temperature": {"constant": 1.0}}
FORMULATIONS = ("assumed_strain", "elastic_line", "cable", "cable_stretch")


def boom(*held: str, formulation: str = "assumed_strain", elements: int = 4, kind: str = "clamp", beam: Any = None,
         **load: Any) -> ev.System:  # fmt: skip
    """A heated boom along x, held at some of its ends."""
    system, given = ev.System(), {"section": ev.Circle(radius=RADIUS), "material": ALUMINIUM} | (beam or {})
    system.add(parts.Beam(length=LENGTH, elements=elements, formulation=formulation, **given), "boom")
    for end in held:
        place = (LENGTH if end == "tip" else 0.0, 0.0, 0.0)
        system.add(parts.Joint(a=place, b=f"boom.{end}", type=kind), f"at_{end}")
    system.add(parts.ThermalLoad(part="boom", **load), "heat")
    return system


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_free_beam_expands_without_stress(formulation: str, book: Any) -> None:
    found = boom("root", formulation=formulation, temperature={"constant": "100 K"}).equilibrium()
    growth = EXPANSION * 100.0 * LENGTH
    error = abs(float(found["boom"].tip_position[-1, 0]) - LENGTH - growth) / growth
    book("Statics of beams", f"free thermal expansion ({formulation})", reference="alpha dT L", source="closed form",
         error=error, allowed=1e-9)  # fmt: skip
    assert np.abs(found["boom"].axial_force).max() < 1e-9 * EA * EXPANSION * 100.0
    assert np.abs(found["boom"].strain).max() < 1e-12
    assert abs(found["boom"].energy_elastic[-1]) < 1e-9 * EA * (EXPANSION * 100.0) ** 2 * LENGTH
    free = EXPANSION * 100.0
    wanted = free if formulation == "cable_stretch" else free + 0.5 * free**2
    np.testing.assert_allclose(found["heat"].free_strain[-1], wanted, rtol=1e-12)
    assert found["heat"].temperature[-1] == 100.0


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_beam_held_at_both_ends_is_compressed(formulation: str, book: Any) -> None:
    found = boom("root", "tip", formulation=formulation, temperature={"constant": 5.0}).equilibrium()
    wanted = -EA * EXPANSION * 5.0
    error = float(np.abs(found["boom"].axial_force[-1] / wanted - 1.0).max())
    # the stress that Green's strain has is off by half the free strain
    book("Statics of beams", f"heated beam between clamps ({formulation})", reference="-E A alpha dT",
         source="closed form", error=error, allowed=1e-9 if formulation == "cable_stretch" else 1e-4)  # fmt: skip
    energy = 0.5 * EA * (EXPANSION * 5.0) ** 2 * LENGTH
    assert found["boom"].energy_elastic[-1] == pytest.approx(energy, rel=2e-4)
    assert float(found.energy_elastic[-1]) == pytest.approx(float(found["boom"].energy_elastic[-1]), rel=1e-9)


@pytest.mark.parametrize(("key", "axis", "moment"), [("gradient_y", 1, "z"), ("gradient_z", 2, "y")])
def test_a_gradient_bends_a_free_beam_without_moment(key: str, axis: int, moment: str, book: Any) -> None:
    found = boom("root", elements=16, **{key: {"constant": "500 K/m"}}).equilibrium()
    k = EXPANSION * 500.0
    tip = float(found["boom"].tip_position[-1, axis])
    assert tip == pytest.approx(-0.5 * k * LENGTH**2, rel=1e-3)  # the hot side is the outer one
    book("Statics of beams", f"cantilever with a temperature gradient along {key[-1]} (assumed_strain, 16 elements)",
         reference="tip of an arc of curvature alpha dT'", source="closed form",
         error=abs(tip * k / (1.0 - math.cos(k * LENGTH)) + 1.0), allowed=1e-4)  # fmt: skip
    assert np.abs(found["boom"][f"bending_moment_{moment}"]).max() < 1e-6 * EI * k


def test_a_profile_along_the_beam() -> None:
    """Temperature that falls to nothing at the middle: the beam grows by the mean."""
    along = [[0.0, 1.0], [0.5, 0.0], [1.0, 0.0]]
    found = boom("root", temperature={"constant": 100.0}, along=along).equilibrium()
    growth = float(found["boom"].tip_position[-1, 0]) - LENGTH
    # the squares of the free strain are those of the profile's
    assert growth == pytest.approx(0.25 * EXPANSION * 100.0 * LENGTH, rel=1e-6)
    np.testing.assert_allclose(found["heat"].temperature_change[-1, -4:], 0.0, atol=1e-12)


def test_a_gradient_of_a_beam_between_clamps_gives_a_moment() -> None:
    found = boom("root", "tip", gradient_y={"constant": 300.0}).equilibrium()
    moment = found["boom"].bending_moment_z[-1]
    np.testing.assert_allclose(moment, EI * EXPANSION * 300.0, rtol=1e-4)
    assert np.abs(found["boom"].tip_deflection[-1]).max() < 1e-6


def test_heat_lowers_the_frequency_of_a_pinned_beam_until_it_buckles(book: Any) -> None:
    """w^2 = w0^2 (1 - dT/dT_c), dT_c = pi^2 I/(A alpha L^2)."""
    critical = math.pi**2 * EI / (EA * EXPANSION * LENGTH**2)
    w0 = math.pi**2 * math.sqrt(EI / (2700.0 * math.pi * RADIUS**2)) / LENGTH**2
    worst = 0.0
    for share in (0.5, 0.9):
        system = boom("root", "tip", kind="spherical", formulation="cable", elements=6,
                      temperature={"constant": share * critical})  # fmt: skip
        w = abs(system.modes(count=2).pole).min()
        worst = max(worst, abs((w / w0) ** 2 - (1.0 - share)))
    book("Modes", "heated beam between pins up to 0.9 of thermal buckling (cable, 6 elements)",
         reference="w^2 = w0^2 (1 - dT/dT_c)", source="closed form", error=worst, allowed=2e-3)  # fmt: skip


def snap(t: np.ndarray) -> np.ndarray:
    """Tip of a cantilever on whose section a gradient appears at once, beside its static place: modes 1 to 40."""
    roots = np.array([1.8751040687, 4.6940911330, 7.8547574382, *((n - 0.5) * math.pi for n in range(4, 41))])
    sigma = np.array([0.7340955137, 1.0184673186, 0.9992244965, *[1.0] * 37])
    w = roots**2 * math.sqrt(EI / (2700.0 * math.pi * RADIUS**2)) / LENGTH**2
    shares = 8.0 * sigma / roots**3
    return np.asarray(np.sum(shares * (1.0 - np.cos(np.outer(t, w))), axis=1))


#: Spectral radii: energy-momentum keeps the energy at 1, generalized-alpha needs less to damp the section's own modes.
RADII = {"energy-momentum": 1.0, "generalized-alpha": 0.9}


@pytest.mark.slow
@pytest.mark.parametrize("method", sorted(RADII))
def test_sudden_heating_makes_a_boom_swing_twice_as_far(method: str, book: Any) -> None:
    """Thermal snap (Boley 1956), the heating far faster than the boom; its energy is the work of the free strain."""
    system = boom("root", elements=12, gradient_y={"constant": 100.0})
    found = system.simulate(until=0.3, every=0.005, method=method, step=5e-4, spectral_radius=RADII[method])
    static = -0.5 * EXPANSION * 100.0 * LENGTH**2
    tip, t = found["boom"].tip_position.values[:, 1] / static, found.time.values
    error = float(np.abs(tip - snap(t)).max())
    book("Dynamics", f"boom heated at once on one side ({method}, 12 elements)", reference="sum of 40 modes, "
         "beside the static deflection", source="closed form", error=error, allowed=0.06)  # fmt: skip
    assert tip.max() == pytest.approx(2.0, abs=0.1)
    start = 0.5 * EI * (EXPANSION * 100.0) ** 2 * LENGTH
    assert found["boom"].energy_elastic.values[0] == pytest.approx(start, rel=1e-3)
    limit = 1e-5 if method == "energy-momentum" else 0.05  # which dissipates the highest modes
    assert np.abs(found.energy_defect).max() < limit * start
    np.testing.assert_allclose(found["heat"].work, 0.0, atol=1e-12 * start)  # heated before it moves


@pytest.mark.parametrize("formulation", ["assumed_strain", "cable_stretch"])
def test_the_work_of_a_changing_temperature_closes_the_balance(formulation: str) -> None:
    bends = {} if formulation == "cable_stretch" else {"gradient_z": {"table": [[0, 0], [0.01, 400], [0.02, -100]]}}
    heat = {"ramp": {"final": 50.0, "duration": "10 ms"}}
    system = boom("root", formulation=formulation, elements=2, temperature=heat, **bends)
    found = system.simulate(until=0.02, every=1e-4, method="energy-momentum", step=1e-4, spectral_radius=1.0)
    energy = float(found.energy.max())
    assert energy > 1e-3
    assert np.abs(found.energy_defect).max() < 1e-6 * energy
    np.testing.assert_allclose(found.work_loads, found["heat"].work, atol=0.01 * energy)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_the_tangent_is_the_derivative_of_the_forces(formulation: str, rng: np.random.Generator) -> None:
    bends = {} if "cable" in formulation else {"gradient_y": {"constant": 4e5}, "gradient_z": {"constant": -3e5}}
    system = boom(formulation=formulation, temperature={"constant": 4e3}, along=[[0, 1], [1, 0.2]], **bends)
    assert worst(disturbed(system.assemble(), rng), np.zeros(0)) < 1e-7


@pytest.mark.parametrize("method", ["dopri5", "rk4"])
def test_explicit_methods_balance_the_work_of_a_free_boom(method: str) -> None:
    bends = {"gradient_y": {"ramp": {"final": 300.0, "duration": "2 ms"}}}
    heat = {"ramp": {"final": 50.0, "duration": "2 ms"}}
    found = boom(elements=1, temperature=heat, **bends).simulate(until="3 ms", every="20 us", method=method)
    energy = float(found.energy.max())
    assert energy > 0.01
    assert np.abs(found.energy_defect).max() < 1e-4 * energy
    np.testing.assert_allclose(found.work_loads, found["heat"].work, atol=1e-3 * energy)
    np.testing.assert_allclose(found["boom"].energy_elastic, found.energy_elastic, atol=1e-9 * energy)
    assert np.abs(found.momentum).max() < 1e-9


@pytest.mark.parametrize(
    ("load", "beam", "words"),
    [
        ({}, {}, "heat.temperature is missing; give temperature, gradient_y or gradient_z"),
        (WARM, {"material": ALUMINIUM.model_copy(update={"thermal_expansion": None})},
         "'boom', whose material has no thermal_expansion"),
        ({"gradient_y": {"constant": 1.0}}, {"formulation": "cable"}, "gradient_y is given, but 'boom' is a cable"),
        (WARM, {"formulation": "full", "section": ev.Rectangle(thickness=0.01, width=0.01)},
         "whose formulation is 'full'"),
        (WARM | {"along": [[0.5, 1.0], [0.2, 1.0]]}, {}, "they must increase"),
    ],
)  # fmt: skip
def test_what_cannot_be_heated_is_refused(load: dict[str, Any], beam: dict[str, Any], words: str) -> None:
    own = dict(beam)
    formulation = own.pop("formulation", "assumed_strain")
    with pytest.raises(InputError) as refused:
        boom(formulation=formulation, beam=own, **load).assemble()
    assert words in str(refused.value)


def test_a_second_load_on_a_beam_is_refused() -> None:
    system = boom(temperature={"constant": 1.0})
    system.add(parts.ThermalLoad(part="boom", temperature={"constant": 1.0}), "more")
    with pytest.raises(InputError, match="has a thermal load already"):
        system.assemble()


def test_a_case_file_holds_a_thermal_load() -> None:
    system = boom("root", temperature={"table": [["0 s", "0 K"], ["1 min", "40 K"]]}, gradient_y={"constant": "2 K/cm"},
                  along=[[0, 0.5], [1, 1]])  # fmt: skip
    again = ev.load(cases.parse_yaml(system.to_yaml(), "text"))
    model, other = system.assemble().model, again.assemble().model
    assert np.array_equal(model.parameters, other.parameters)
    assert 60.0 in model.breaks
