"""Folds that run and coils that unwind: the moment of a fold over the mesh, and the built-in cases of tape springs."""

from __future__ import annotations

import functools
import math
import pathlib
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import evolvent as ev
from evolvent import System, parts
from evolvent.elements import TapeSection
from evolvent.elements.materials import STEEL

Array = np.ndarray
TAPE = TapeSection(radius=0.015, angle=math.radians(60.0), thickness=1.5e-4)
#: Radius of the drum of the case, m.
DRUM = 0.03


def energy(k: float) -> float:
    """Energy per length of uniform bending, J/m (Wuest 1954, Mansfield 1973), above 0 in opposite sense."""
    nu, s, k0, t = STEEL.nu, TAPE.radius * TAPE.angle, 1.0 / TAPE.radius, TAPE.thickness
    L = (3.0 * (1.0 - nu**2) * (s * s * k / t) ** 2) ** 0.25
    F = 2.0 / L * (math.cosh(L) - math.cos(L)) / (math.sinh(L) + math.sin(L))
    D = STEEL.E * t**3 / (12.0 * (1.0 - nu**2))
    return 0.5 * s * D * ((1.0 - nu**2) * k * k + (k0 + nu * k) ** 2 * (1.0 - F))


def propagation(sense: float) -> float:
    """Slope of the Maxwell line, N m."""
    found = minimize_scalar(lambda k: energy(sense * k) / k, bounds=(20.0, 200.0), method="bounded")
    return float(found.fun)


def opened(elements: int, sense: float, until: float) -> float:
    """Mean moment, N m, of a fold that a turn of the root opens slowly; nothing but that moment acts on the tip."""
    system = System()
    rod = parts.Rod(
        length=0.08, section=TAPE, material=STEEL, elements=elements, stiffness_damping=1e-4,
        folds=({"at": 0.04, "angle": sense * math.pi},),
    )  # fmt: skip
    tip = tuple(rod.start_nodes()[0][-1])
    system.add(rod, "tape")
    small: dict[str, Any] = {"mass": 0.01, "inertia": (1e-5, 1e-5, 1e-5)}
    system.add(parts.RigidBody(**small), "shaft")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="shaft", type="revolute"), "axle")
    system.add(parts.Joint(a="shaft", b="tape.root", type="clamp"), "root")
    for name in ("slide", "grip"):
        system.add(parts.RigidBody(**small, position=tip), name)
    system.add(parts.Joint(a=tip, b="slide", type="prismatic", axis=(1.0, 0.0, 0.0)), "along")
    system.add(parts.Joint(a="slide", b="grip", type="prismatic", axis=(0.0, 1.0, 0.0), position=tip), "across")
    system.add(parts.Joint(a="grip", b="tape.tip", type="clamp"), "tip")
    motion: dict[str, Any] = {"ramp": {"rate": 0.0, "steps": [[0.0, 0.1, sense]]}}
    motor = parts.Motor(joint="axle", motion=motion, position_gain=20.0, velocity_gain=0.2)
    system.add(motor, "motor")
    found = system.simulate(until=until, every=2e-3, method="energy-momentum").ev.regular()
    moment = np.abs(found["tape"]["bending_moment_z"].values).mean(axis=1)
    return float(moment[found["time"].values > 0.2].mean())


@pytest.mark.slow
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_a_fold_runs_at_the_moment_of_the_maxwell_line(sense: float) -> None:
    """Coarse elements hold a fold back; from 9 times the thickness over the angle it runs."""
    wanted = propagation(sense)
    coarse, fine = (abs(opened(n, sense, until) / wanted - 1.0) for n, until in ((16, 0.8), (64, 0.4)))
    assert 0.08 / 64 < 9.0 * TAPE.thickness / TAPE.angle
    assert fine < 0.02
    assert fine < coarse


def test_the_page_has_the_moments() -> None:
    page = (pathlib.Path(__file__).parents[2] / "docs" / "systems" / "tape-springs.md").read_text(encoding="utf-8")
    for value in (f"{propagation(1.0):.3f} and {propagation(-1.0):.3f} N m", f"{energy(1.0 / DRUM) * DRUM:.4f} N m"):
        assert value in " ".join(page.split())


@functools.cache
def run(name: str) -> Any:
    """A built-in case, run once."""
    return ev.run(name)


@pytest.mark.slow
def test_the_hinge_opens_by_the_moments_of_both_folds() -> None:
    found = run("tape-hinge")
    fold, first = found["tape 1"]["fold_angle"].values, found["tape 2"]["fold_angle"].values
    assert fold == pytest.approx(-first, abs=0.15)
    assert fold[0] == pytest.approx(math.pi)
    straight = int(np.argmax(fold < math.radians(20.0)))
    whole = propagation(1.0) + propagation(-1.0)
    released = found["energy_elastic"].values[10] - found["energy_elastic"].values[straight]
    assert released / (fold[10] - fold[straight]) == pytest.approx(whole, rel=0.12)
    assert found["energy_kinetic"].values[straight] > 0.6 * released
    assert np.abs(found["energy_defect"].values).max() < 5e-3 * found["energy_elastic"].values[0]
    assert fold.min() < -math.radians(30.0)  # beyond in line, where the tapes fold the other way
    assert "straight" in found.attrs["events"]


@pytest.mark.slow
def test_the_coil_turns_its_drum_with_its_energy_times_the_radius() -> None:
    """Beyond the fold's own radius the drum holds the coil, which has the energy of the drum's curvature."""
    found = run("tape-drum")
    time, fold, stored = found["time"].values, found["tape"]["fold_angle"].values, found["energy_elastic"].values
    i, j = np.searchsorted(time, [0.7, 2.3])
    slope = (stored[i] - stored[j]) / (fold[i] - fold[j])
    assert slope == pytest.approx(energy(1.0 / DRUM) * DRUM, rel=0.02)
    assert slope > 1.05 * propagation(1.0)
    defect = found["energy_defect"].values / stored[0]  # numerical damping takes, and gives nothing
    assert -3e-3 < defect.min() < defect.max() < 1e-6
    steady = found.ev.regular()
    braked = steady["motor"]["torque"].values[(steady["time"].values > 0.7) & (steady["time"].values < 2.3)]
    assert -braked.mean() == pytest.approx(0.077, rel=0.04)
    assert np.median(found["tape"]["curvature_z"].values[i, 5:40]) == pytest.approx(1.0 / DRUM, rel=0.01)
