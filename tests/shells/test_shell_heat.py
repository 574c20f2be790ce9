"""Temperatures of shells against closed forms: free and held walls, gradients, bimetals, laminates."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import evolvent as ev
from evolvent import cases, parts
from evolvent_base.errors import InputError
from implicit.test_tangent import disturbed, worst
from shells.plates import distorted

Array = np.ndarray
E, NU, EXPANSION, THICKNESS = 70e9, 0.3, 23e-6, 2e-3
ALUMINIUM = ev.Material(young_modulus=E, poisson_ratio=NU, density=2700.0, thermal_expansion=EXPANSION)
SIZE, ELEMENTS = (0.4, 0.3), (4, 3)


def panel(heat: dict[str, Any], *, held: bool = True, **shell: Any) -> ev.System:
    """A heated panel that is held at its first node alone."""
    wall = {} if "section" in shell else {"thickness": THICKNESS, "material": ALUMINIUM}
    shape = {} if "nodes" in shell else {"size": SIZE}
    keys: Any = {"elements": ELEMENTS} | shape | wall | shell
    system = ev.System()
    system.add(parts.Shell(**keys), "panel")
    if held:
        system.add(parts.Joint(a="ground", b="panel[0]", type="clamp"), "held")
    system.add(parts.ThermalLoad(part="panel", **heat), "heat")
    return system


def uneven() -> dict[str, Any]:
    """Nodes of a flat panel whose mesh is distorted."""
    x = distorted(SIZE, ELEMENTS, 0.3)
    return {"nodes": np.concatenate([x, 0.0 * x[..., :1]], axis=-1).tolist()}


def laminate(*plies: tuple[Any, float, float]) -> dict[str, Any]:
    """Section of plies: material, thickness, angle in degrees."""
    return {"laminate": [{"material": of, "thickness": h, "angle": math.radians(turn)} for of, h, turn in plies]}


def sphere(found: Any) -> float:
    """Radius of the sphere through the nodes, m."""
    x = np.asarray(found["panel"]["position"].values[-1])
    solved = np.linalg.lstsq(np.c_[2.0 * x, np.ones(len(x))], np.sum(x * x, axis=1), rcond=None)[0]
    return float(np.sqrt(solved[3] + solved[:3] @ solved[:3]))


def largest(found: Any, *names: str) -> float:
    return max(float(np.abs(found["panel"][name]).max()) for name in names)


FORCES, MOMENTS = ("membrane_force_1", "membrane_force_2", "membrane_shear"), ("moment_1", "moment_2")


def test_a_free_plate_expands_without_stress(book: Any) -> None:
    """On a distorted mesh too."""
    found: Any = panel({"temperature": {"constant": "100 K"}}, **uneven()).equilibrium()
    x, growth = found["panel"]["position"].values[-1], EXPANSION * 100.0
    error = float(np.abs((x[-1] - x[0])[:2] / SIZE - 1.0 - growth).max()) / growth
    book("Statics of shells", "free thermal expansion of a plate, mesh distorted by 30 %", reference="alpha dT L",
         source="closed form", error=error, allowed=1e-9)  # fmt: skip
    assert largest(found, *FORCES) < 1e-9 * E * THICKNESS * growth
    assert abs(found["panel"].energy_elastic[-1]) < 1e-12 * E * THICKNESS * growth**2
    assert float(found["heat"].temperature_top[-1, 0]) == 100.0


def test_a_free_cylinder_expands_without_stress() -> None:
    """Its radius grows, too."""
    found: Any = panel({"temperature": {"constant": 100.0}}, radius=0.2).equilibrium()
    growth = EXPANSION * 100.0
    assert largest(found, *FORCES) < 1e-9 * E * THICKNESS * growth
    assert largest(found, *MOMENTS) < 1e-9 * E * THICKNESS**2 * growth


@pytest.mark.parametrize("shape", [{}, uneven()])
def test_a_gradient_bends_a_free_plate_into_a_sphere(shape: dict[str, Any], book: Any) -> None:
    """The radius of a shallow one is h/(alpha dT); a deeper one stretches the plate, by the square of the gradient."""
    gradient = 40.0
    found: Any = panel({"gradient_z": {"constant": f"{gradient} K/m"}}, **shape).equilibrium()
    curvature = EXPANSION * gradient
    book("Statics of shells", f"plate with a temperature gradient, sphere ({'distorted' if shape else 'regular'} mesh)",
         reference="radius h/(alpha dT)", source="closed form", error=abs(sphere(found) * curvature - 1.0),
         allowed=5e-5)  # fmt: skip
    assert found["panel"]["position"].values[-1, -1, 2] < 0.0  # the hot side is the outer one
    held = E * THICKNESS**3 / (12.0 * (1.0 - NU)) * curvature
    assert largest(found, *MOMENTS) < 1e-4 * held
    top, bottom = (float(found["heat"][f"temperature_{key}"][-1, 0]) for key in ("top", "bottom"))
    assert top - bottom == pytest.approx(gradient * THICKNESS, rel=1e-12)


def test_a_plate_between_clamps_has_the_stress_of_its_heat(book: Any) -> None:
    """N = -E h alpha T/(1 - nu), M = -E h^3 alpha G/12 (1 - nu); Green's strain adds a square of the free one."""
    heat = {"temperature": {"constant": 5.0}, "gradient_z": {"constant": 100.0}}
    found: Any = panel(heat, held=False, clamped=("x0", "x1", "y0", "y1"), **uneven()).equilibrium()
    error = 0.0
    for names, wanted in (
        (FORCES[:2], -E * THICKNESS * EXPANSION * 5.0 / (1.0 - NU)),
        (MOMENTS, -E * THICKNESS**3 * EXPANSION * 100.0 / (12.0 * (1.0 - NU))),
    ):
        error = max(error, *(float(np.abs(found["panel"][name][-1] / wanted - 1.0).max()) for name in names))
    book("Statics of shells", "heated plate between clamps, mesh distorted by 30 %", reference="-E h alpha dT/(1 - nu)",
         source="closed form", error=error, allowed=2e-4)  # fmt: skip
    assert float(found.energy_elastic[-1]) == pytest.approx(float(found["panel"].energy_elastic[-1]), rel=1e-9)


def test_a_bimetal_strip(book: Any) -> None:
    """Timoshenko 1925, eq. 4: curvature of two strips with the ratios m of thickness and n of modulus."""
    change, h1, h2, e1, e2, a1, a2 = 5.0, 1e-3, 5e-4, 100e9, 200e9, 18e-6, 1e-6
    one, two = (
        ev.Material(young_modulus=of, poisson_ratio=0.0, density=8000.0, thermal_expansion=a)
        for of, a in ((e1, a1), (e2, a2))
    )
    wall = laminate((one, h1, 0.0), (two, h2, 0.0))
    heat = {"temperature": {"constant": change}}
    found: Any = panel(heat, section=wall, size=(0.2, 0.01), elements=(10, 1)).equilibrium()
    m, n, h = h1 / h2, e1 / e2, h1 + h2
    wanted = (
        6.0 * (a1 - a2) * change * (1.0 + m) ** 2 / (h * (3.0 * (1.0 + m) ** 2 + (1.0 + m * n) * (m * m + 1 / m / n)))
    )
    assert found["panel"]["position"].values[-1, -1, 2] > 0.0  # the lower strip is the longer one
    book("Statics of shells", "bimetal strip", reference="curvature, Timoshenko 1925", source="closed form",
         error=abs(sphere(found) * wanted - 1.0), allowed=1e-4)  # fmt: skip


def test_an_unsymmetric_laminate_bends_as_it_cools() -> None:
    """[0/90] of two plies: by the theory of laminates written out for a cross-ply, as a saddle."""
    E1, E2, nu, a1, a2, h, change = 181e9, 10.3e9, 0.28, 0.02e-6, 22.5e-6, 0.15e-3, -0.1
    wall = laminate(("cfrp-ud", h, 0.0), ("cfrp-ud", h, 90.0))
    found: Any = panel(
        {"temperature": {"constant": change}}, section=wall, size=(0.1, 0.1), elements=(4, 4)
    ).equilibrium()
    s = 1.0 - nu * nu * E2 / E1
    Q = np.array([[E1, nu * E2], [nu * E2, E2]]) / s
    plies = [(Q, np.array([a1, a2]), -h, 0.0), (Q[::-1, ::-1], np.array([a2, a1]), 0.0, h)]
    A, B, D = (sum(q * (z1**k - z0**k) / k for q, _, z0, z1 in plies) for k in (1, 2, 3))
    N, M = (sum(q @ a * (z1**k - z0**k) / k for q, a, z0, z1 in plies) * change for k in (1, 2))
    free = np.linalg.solve(np.block([[A, B], [B, D]]), np.concatenate([N, M]))
    heat = found["heat"]
    np.testing.assert_allclose([heat.free_strain_1[-1, 0], heat.free_strain_2[-1, 0]], free[:2], rtol=1e-12)
    np.testing.assert_allclose([heat.free_curvature_1[-1, 0], heat.free_curvature_2[-1, 0]], free[2:], rtol=1e-12)
    x = found["panel"]["position"].values[-1] - found["panel"]["position"].values[-1][12]
    np.testing.assert_allclose(x[22, 2] + x[2, 2], -free[2] * 0.05**2, rtol=2e-3)  # along 1, of the middle of edges
    np.testing.assert_allclose(x[10, 2] + x[14, 2], -free[3] * 0.05**2, rtol=2e-3)


def test_turned_plies_shear_as_they_are_heated() -> None:
    wall = parts.Shell(size=SIZE, elements=ELEMENTS, section=laminate(("cfrp-ud", 1e-3, 30.0))).wall()
    a1, a2 = 0.02e-6, 22.5e-6
    assert wall.expansion is not None
    wanted = [0.75 * a1 + 0.25 * a2, 0.25 * a1 + 0.75 * a2, 2.0 * math.sqrt(0.1875) * (a1 - a2)]
    np.testing.assert_allclose(wall.expansion[:3, 0], wanted, rtol=1e-9)
    np.testing.assert_allclose(wall.expansion[3:6, 1], wanted, rtol=1e-9)
    np.testing.assert_allclose(wall.expansion[3:6, 0], 0.0, atol=1e-18)


def test_heat_lowers_the_frequency_of_a_held_strip_until_it_buckles() -> None:
    """w^2 = w0^2 (1 - T/T_c) of a strip between clamps, whose mode hardly differs from its buckle; nu = 0."""
    length, material = 0.4, ALUMINIUM.model_copy(update={"poisson_ratio": 0.0})
    critical = 4.0 * math.pi**2 * THICKNESS**2 / (12.0 * EXPANSION * length**2)
    found = []
    for share in (0.0, 0.5):
        heat = {"temperature": {"constant": share * critical}}
        system = panel(heat, held=False, material=material, size=(length, 0.01), elements=(16, 1), clamped=("x0", "x1"))
        found.append(float(np.abs(system.modes(count=1).pole)[0]))
    assert (found[1] / found[0]) ** 2 == pytest.approx(0.5, abs=0.02)


#: Steps, s, and defects of the energy beside the largest one.
METHODS = {"energy-momentum": (2e-5, 1e-9), "generalized-alpha": (5e-6, 0.02), "dopri5": (0.0, 1e-6)}


@pytest.mark.parametrize("method", METHODS)
def test_the_work_of_a_changing_temperature_closes_the_balance(method: str) -> None:
    step, limit = METHODS[method]
    heat = {
        "temperature": {"ramp": {"final": 50.0, "duration": "1 ms"}}, "along": [[0, 1], [1, 0.5]],
        "gradient_z": {"table": [[0, 0], [0.001, 400], [0.002, -100]]},
    }  # fmt: skip
    options: Any = {"step": step, "spectral_radius": 1.0} if step else {"tolerance": 1e-8}
    system = panel(heat, held=False, size=(0.2, 0.15), elements=(2, 2))
    found = system.simulate(until=0.002, every=2e-5, method=method, **options)
    energy = float(found.energy.max())
    assert energy > 1e-3
    assert np.abs(found.energy_defect).max() < limit * energy
    np.testing.assert_allclose(found.work_loads, found["heat"].work, atol=0.02 * energy)
    assert np.abs(found.momentum).max() < 1e-12
    np.testing.assert_allclose(found["panel"].energy_elastic, found.energy_elastic, atol=1e-9 * energy)


def test_the_tangent_of_a_heated_shell() -> None:
    heat = {"temperature": {"constant": 300.0}, "gradient_z": {"constant": 2e3}}
    found = disturbed(panel(heat, held=False, elements=(2, 2)).assemble(), np.random.default_rng(4), 0.005)
    assert worst(found, np.zeros(0)) < 1e-6


MATRIX = {"stiffness": {"matrix": np.diag([1e6, 1e6, 4e5, 1.0, 1.0, 0.4, 3e5, 3e5]).tolist(), "mass_per_area": 1.0}}
WARM = {"temperature": {"constant": 1.0}}


@pytest.mark.parametrize(
    ("heat", "shell", "words"),
    [
        ({"gradient_y": {"constant": 1.0}}, {}, "heat.gradient_y is given, but 'panel' is a shell"),
        (WARM, {"section": MATRIX}, "'panel', a shell whose thermal expansion is not known"),
        (WARM, {"material": ev.Material(young_modulus=E, density=1.0)}, "panel.material must have thermal_expansion"),
        ({}, {}, "heat.temperature is missing"),
    ],
)
def test_what_cannot_be_heated_is_refused(heat: dict[str, Any], shell: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError) as refused:
        panel(heat, **shell).assemble()
    assert words in str(refused.value)


def test_what_takes_no_heat_is_refused() -> None:
    system = panel(WARM)
    system.add(parts.ThermalLoad(part="held", **WARM), "other")
    with pytest.raises(InputError, match="'held', which takes no thermal load: it must be a beam, a rod or a shell"):
        system.assemble()


def test_the_adjoint_refuses_heat_by_the_name_of_the_load() -> None:
    with pytest.raises(InputError, match="'heat' is a thermal load on a shell, which the adjoint does not support"):
        panel(WARM).sensitivity("panel.largest_displacement.last", "parts.panel.thickness", until=1.0, mode="adjoint")


def test_a_case_file_holds_a_heated_shell() -> None:
    system = panel(
        {"temperature": {"table": [["0 s", "0 K"], ["1 min", "40 K"]]}, "gradient_z": {"constant": "2 K/cm"}}
    )
    again = ev.load(cases.parse_yaml(system.to_yaml(), "text"))
    assert np.array_equal(system.assemble().model.parameters, again.assemble().model.parameters)
