"""Loads by profiles: impulses, a driven oscillator, energy balances, explicit and implicit methods, statics."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

from evolvent import System, elements, parts
from evolvent.solvers import solve
from evolvent.solvers.static.static import solve_static
from evolvent.solvers.time.implicit.plan import solve_implicit

ROWS = [(0.0, 0.0), (0.31, 0.2), (0.77, -0.1), (1.3, 0.0)]
PROFILES: dict[str, Any] = {
    "table": ROWS,
    "smooth": {"table": ROWS, "smooth": True},
    "jump": [(0.0, 0.3), (0.41, 0.3), (0.41, -0.1), (1.0, 0.0)],
    "ramp": {"ramp": {"final": 0.2, "start": 0.1, "duration": 0.73}},
    "sine": {"sine": {"amplitude": 0.2, "frequency": 1.3, "phase": 0.4, "offset": 0.1, "start": 0.2, "until": 1.1}},
    "pulse": {"pulse": {"value": 0.2, "start": 0.13, "duration": 0.71}},
    "smooth pulse": {"pulse": {"value": 0.2, "start": 0.13, "duration": 0.71, "rise": 0.2}},
    "constant": {"constant": 0.2},
    "expression": {"expression": "where(t < 0.37, a*t, a*cos(3*t))", "constants": {"a": 0.2}},
}
#: Integrals of profiles that RK4 takes to round-off: of polynomials of degree 3 between breaks.
IMPULSES = {
    "table": 0.5 * 0.31 * 0.2 + 0.5 * 0.46 * 0.1 - 0.5 * 0.53 * 0.1,
    "jump": 0.3 * 0.41 - 0.5 * 0.1 * 0.59,
    "pulse": 0.2 * 0.71,
    "constant": 0.2 * 1.7,
}
END = 1.7
RIBBON = elements.Rectangle(thickness=0.02, width=0.02)
SOFT = elements.Material(young_modulus=2e7, poisson_ratio=0.0, density=1000.0)


def hub(given: Any, **fields: Any) -> System:
    system = System()
    system.add(parts.RigidBody(mass=3.0, inertia=(1.2, 1.2, 2.0), motion="free"), "hub")
    system.add(parts.Load(at="hub", axis=(0.0, 0.0, 3.0), profile=given, **fields), "slew")
    return system


def boom(load: Any, **fields: Any) -> System:
    system = System()
    beam = parts.Beam(length=1.0, section=RIBBON, material=SOFT, elements=3, formulation="cable", **fields)
    system.add(beam, "boom")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="boom.root", type="clamp", stiffness=1e4), "root")
    system.add(load, "load")
    return system


@pytest.mark.parametrize("kind", IMPULSES)
@pytest.mark.parametrize("step", [0.1, 0.23])
def test_impulse_of_a_torque(kind: str, step: float) -> None:
    """A free body that spins up about a principal axis: J w is the integral of the torque."""
    solution = solve(hub(PROFILES[kind]).assemble(), samples=[0.0, END], method="rk4", step=step)
    rate = solution.y[-1, 7 + 5]
    assert 2.0 * rate == pytest.approx(IMPULSES[kind], rel=1e-13)


@pytest.mark.slow
@pytest.mark.parametrize("kind", PROFILES)
def test_impulse_by_quadrature(kind: str) -> None:
    """The integral over time of the values that the kernel returns, by another rule."""
    from unit.test_profiles import values

    assembly = hub(PROFILES[kind]).assemble()
    breaks = [0.0, *(b for b in assembly.model.breaks if b < END), END]
    exact = sum(
        quad(lambda t: values(PROFILES[kind], np.array([t]))[0], a, np.nextafter(b, 0.0), epsabs=1e-13)[0]
        for a, b in itertools.pairwise(breaks)
    )
    solution = solve(assembly, samples=[0.0, END], method="dopri5", rtol=1e-12, atol=1e-13)
    assert 2.0 * solution.y[-1, 7 + 5] == pytest.approx(exact, rel=1e-9)


def test_torque_in_body_axes() -> None:
    """About a body's own x axis, while it stands turned by a quarter about z: it spins about the inertial y axis."""
    half = math.sqrt(0.5)
    system = System()
    body = parts.RigidBody(mass=3.0, inertia=(1.2, 1.2, 2.0), motion="free", orientation=(half, 0.0, 0.0, half))
    system.add(body, "hub")
    system.add(parts.Load(at="hub", axis=(1.0, 0.0, 0.0), frame="body", profile=ROWS), "slew")
    solution = solve(system.assemble(), samples=[0.0, END], method="rk4", step=0.1)
    assert 1.2 * solution.y[-1, 7 + 3 : 7 + 6] == pytest.approx([IMPULSES["table"], 0.0, 0.0], abs=1e-14)
    assert solution.momentum.angular[-1] == pytest.approx([0.0, IMPULSES["table"], 0.0], abs=1e-13)


@pytest.mark.parametrize("method", ["dopri5", "generalized-alpha"])
def test_driven_oscillator(method: str) -> None:
    """m x'' + k x = F sin(f t) from rest: x = F/(m (w^2 - f^2)) (sin f t - f/w sin w t)."""
    k, m, F, f = 8.0, 2.0, 3.0, 3.3
    w = math.sqrt(k / m)
    system = System()
    system.add(parts.Point(mass=m), "mass")
    system.add(parts.Spring(a=(0.0, 0.0, 0.0), b="mass", stiffness=k, length=0.0))
    sine = {"amplitude": F, "frequency": f / (2.0 * math.pi)}
    system.add(parts.Load(at="mass", direction=(0.0, 1.0, 0.0), profile={"sine": sine}), "push")
    t = np.linspace(0.0, 5.0, 26)
    if method == "dopri5":
        solution, allowed = solve(system.assemble(), samples=t, method="dopri5"), 1e-7
    else:
        solution, allowed = solve_implicit(system.assemble(), samples=t, step=1e-3, spectral_radius=0.9), 1e-5
    exact = F / (m * (w**2 - f**2)) * (np.sin(f * t) - f / w * np.sin(w * t))
    assert solution.y[:, 1] == pytest.approx(exact, abs=allowed)
    assert np.abs(solution.energy_defect).max() < 1e-4


@pytest.mark.parametrize("kind", PROFILES)
def test_window_and_ramp_scale_a_profile(kind: str) -> None:
    """A load acts from its start to its end only, and grows over its ramp as s^2 (3 - 2 s)."""
    system = hub(PROFILES[kind], start=0.2, until=0.9, ramp=0.3)
    from unit.test_profiles import values

    def product(t: float) -> float:
        s = min((t - 0.2) / 0.3, 1.0)
        return float(values(PROFILES[kind], np.array([t]))[0]) * s * s * (3.0 - 2.0 * s)

    assembly = system.assemble()
    inner = [float(b) for b in assembly.model.breaks if 0.2 < b < 0.9]
    edges = [0.2, *inner, np.nextafter(0.9, 0.0)]
    exact = sum(quad(product, a, np.nextafter(b, 0.0), epsabs=1e-13)[0] for a, b in itertools.pairwise(edges))
    solution = solve(assembly, samples=[0.0, END], method="dopri5", rtol=1e-12, atol=1e-13)
    assert 2.0 * solution.y[-1, 7 + 5] == pytest.approx(exact, rel=1e-8)


LOADS = {
    "force": lambda given: parts.Load(at="boom.tip", direction=(0.0, 1.0, 0.5), profile=given),
    "force at a node": lambda given: parts.Load(at="boom[2]", direction=(0.0, 1.0, 0.0), profile=given),
    "line": lambda given: parts.Load(along="boom", direction=(0.0, 1.0, 0.0), profile=given),
    "torque": lambda given: parts.Load(along="boom", axis=(0.0, 0.0, 1.0), profile=given),
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", PROFILES)
def test_beam_by_both_methods(kind: str) -> None:
    """Explicit and implicit methods agree on a beam under a profile, and account for all energy."""
    for name, load in LOADS.items():
        if kind not in ("table", "expression") and name != "force":
            continue
        t = np.linspace(0.0, 1.0, 5)
        explicit = solve(boom(load(PROFILES[kind])).assemble(), samples=t, method="rk4", step=1e-4)
        implicit = solve_implicit(boom(load(PROFILES[kind])).assemble(), samples=t, step=2e-4, spectral_radius=0.9)
        assert explicit.success, explicit.message
        assert implicit.success, implicit.message
        places = slice(0, explicit.assembly.model.info.nq)
        size = np.abs(explicit.y[:, places] - explicit.y[0, places]).max()
        assert size > 1e-3
        assert np.abs(explicit.y[:, places] - implicit.y[:, places]).max() < 4e-3 * size, name
        work = max(np.abs(explicit.energy).max(), 1e-6)
        assert np.abs(explicit.energy_defect).max() < 1e-5 * work, name
        assert np.abs(implicit.energy_defect).max() < 1e-2 * work, name


@pytest.mark.digits
@pytest.mark.parametrize("direction", [(1.0, 0.0, 0.0), (0.3, -0.5, 0.7)])
def test_beam_at_rest_until_a_load_begins(direction: tuple[float, float, float]) -> None:
    """Before the load begins there is no energy but round-off, which is no defect of the balance.

    The energy is a difference of terms of E A L/8 (`elements.Form`).
    """
    load = parts.Load(at="boom.tip", force=(0.0, 0.2, 0.0), start=0.1)
    assembly = boom(load, direction=direction).assemble()
    solution = solve(assembly, samples=np.linspace(0.0, 0.3, 5), method="rk4", step=1e-4)
    assert solution.success, solution.message
    assert abs(solution.energy[1]) < np.finfo(float).eps * 2e7 * 0.02**2 * 1.0  # 1.8e-12 J
    assert solution.energy[-1] > 1e-3


def test_statics_at_a_time() -> None:
    """A cantilever under the value that a profile has at a time; the ramp of a load is over."""
    EI = 2e9 * 0.02**4 / 12.0
    for time, value in [(0.31, 0.2), (0.54, 0.05), (5.0, 0.0)]:
        load = parts.Load(at="boom.tip", direction=(0.0, 1.0, 0.0), profile=ROWS, ramp=0.9)
        system = System()
        stiff = elements.Material(young_modulus=2e9, poisson_ratio=0.0, density=1000.0)
        beam = parts.Beam(length=1.0, section=RIBBON, material=stiff, elements=3, formulation="cable")
        system.add(beam, "boom")
        system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="boom.root", type="clamp"), "root")
        system.add(load, "load")
        solution = solve_static(system.assemble(), time=time)
        assert solution.success, solution.message
        tip = solution.y[-1, solution.assembly.model.info.nq - 6 :][1]
        assert tip == pytest.approx(value / (3.0 * EI), rel=5e-3, abs=1e-12)


def test_force_on_a_body_by_its_statics() -> None:
    """A force by a profile on a point that a spring holds, with a ramp that statics leaves out."""
    system = System()
    system.add(parts.Point(mass=2.0), "mass")
    system.add(parts.Spring(a=(0.0, 0.0, 0.0), b="mass", stiffness=8.0, length=0.0))
    system.add(parts.Load(at="mass", direction=(1.0, 0.0, 0.0), profile=ROWS, ramp=0.9), "push")
    solution = solve_static(system.assemble(), time=0.31)
    assert solution.y[-1, 0] == pytest.approx(0.2 / 8.0, rel=1e-9)
