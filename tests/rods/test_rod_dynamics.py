"""Motions and modes of rods: closed forms, independent solutions, what is conserved."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from book import Book
from evolvent import System, law, parts
from evolvent.elements import Material, Rectangle
from evolvent.equations.implicit import momenta
from evolvent.kernels.rigid import kinematics
from evolvent.solvers import solve
from evolvent.solvers.modal.modes import modes
from evolvent.solvers.time.implicit.energy_momentum import solve_energy
from evolvent.solvers.time.implicit.plan import solve_implicit
from helpers import fitted_order
from implicit.rigs import coordinates
from rods.building import RUBBER, STRIP, cantilever, tip

Array = np.ndarray
CHAPTER = "Dynamics"
SOLVERS: dict[str, Callable[..., Any]] = {"generalized-alpha": solve_implicit, "energy-momentum": solve_energy}
SQUARE = Rectangle(thickness=0.02, width=0.02)
#: Tip of the pendulum at 0.5 s and 1 s, m, by `validation.flexible_pendulum` with Young's moduli of 20 and 2.5 MPa; of
#: the latter with the differences of two extrapolations, which allow for what that is off.
PENDULUM = {
    2e7: ((-0.193659, -0.952471), (-0.92709, 0.10384)),
    2.5e6: ((-0.159864, -1.002505), (-0.914711, -0.149966)),
}


def pendulum(E: float, part: Any) -> System:
    system = System(gravity=(0.0, -9.81, 0.0))
    material = Material(young_modulus=E, poisson_ratio=0.3, density=7200.0)
    system.add(part(length=1.0, section=SQUARE, material=material), "rod")
    return system


@pytest.mark.parametrize("method", SOLVERS)
def test_flexible_pendulum(method: str, book: Book) -> None:
    system = pendulum(2e7, lambda **keys: parts.Rod(elements=20, **keys))
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="rod.root"))
    assembly = system.assemble()
    found = SOLVERS[method](assembly, samples=[0.0, 0.5, 1.0], step=5e-4, spectral_radius=0.9)
    assert found.success, found.message
    for k, wanted in enumerate(PENDULUM[2e7]):
        book(
            CHAPTER, f"Flexible pendulum of 1 m, tip at {0.5 * (k + 1):g} s (rod, 20 elements, {method})",
            reference=f"Reissner's beam, ({wanted[0]:g}, {wanted[1]:g}) m", source="finite volumes, SciPy DOP853",
            error=np.linalg.norm(tip(assembly, found.y[1 + k])[:2] - wanted), allowed=2e-4, unit="m",
        )  # fmt: skip


def test_flexible_pendulum_at_large_strain(book: Book) -> None:
    """So soft that Reissner's and Green's strains lead 7 mm apart after 0.5 s and 41 mm after 1 s."""
    system = pendulum(2.5e6, lambda **keys: parts.Rod(elements=20, **keys))
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="rod.root"))
    assembly = system.assemble()
    found = solve_energy(assembly, samples=[0.0, 0.5, 1.0], step=5e-4, spectral_radius=0.9)
    assert found.success, found.message
    for k, (wanted, allowed) in enumerate(zip(PENDULUM[2.5e6], (5e-4, 3e-3), strict=True)):
        book(
            CHAPTER, f"Flexible pendulum of 2.5 MPa, tip at {0.5 * (k + 1):g} s (rod, 20 elements)",
            reference=f"Reissner's beam, ({wanted[0]:g}, {wanted[1]:g}) m", source="finite volumes, SciPy DOP853",
            error=np.linalg.norm(tip(assembly, found.y[1 + k])[:2] - wanted), allowed=allowed, unit="m",
        )  # fmt: skip


@law
def spin_up(t, parameters):  # type: ignore[no-untyped-def]
    """6 rad/s in 15 s: rate (6/15) [t - 15/(2 pi) sin(2 pi t/15)] (Simo & Vu-Quoc 1986)."""
    rate, end = parameters[0], parameters[1]
    if t >= end:
        return rate * t - 0.5 * rate * end, rate, 0.0
    w = 2.0 * np.pi / end
    angle = rate / end * (0.5 * t * t + (np.cos(w * t) - 1.0) / (w * w))
    return angle, rate / end * (t - np.sin(w * t) / w), rate / end * (1.0 - np.cos(w * t))


@pytest.mark.slow
@pytest.mark.parametrize("method", SOLVERS)
def test_spin_up(method: str, book: Book) -> None:
    thickness = np.sqrt(12.0 * 1.4e4 / 2.8e7)
    material = Material(young_modulus=2.8e7 / thickness, poisson_ratio=0.3, density=1.2 / thickness)
    system = System()
    system.add(parts.RigidBody(motion="spin", inertia=1.0), "hub")
    section = Rectangle(thickness=thickness, width=1.0)
    system.add(parts.Rod(length=10.0, section=section, material=material, elements=8), "rod")
    system.add(parts.Joint(a="hub", b="rod.root", type="clamp"))
    system.add(
        parts.Joint(a="ground", b="hub", type="revolute", drive=parts.LawDrive(law=spin_up, parameters=(6.0, 15.0))),
        "turn",
    )
    assembly = system.assemble()
    times = np.concatenate([[0.0], np.linspace(6.5, 7.0, 51), np.linspace(15.0, 20.0, 251)])
    found = SOLVERS[method](assembly, samples=times, step=1e-2, spectral_radius=0.9)
    assert found.success, found.message
    angle = coordinates(assembly, found.y, "hub")[:, 0]
    ends = np.array([tip(assembly, y) for y in found.y])
    along = ends[:, 0] * np.cos(angle) + ends[:, 1] * np.sin(angle) - 10.0
    across = ends[:, 1] * np.cos(angle) - ends[:, 0] * np.sin(angle)
    case, early, late = f"Spin-up to 6 rad/s in 15 s (rod, 8 elements, {method})", times < 10.0, times >= 15.0
    book(
        CHAPTER, f"{case}: largest lag", reference="-0.57383 m", source="independent computation",
        error=abs(across[early].min() / -0.57383 - 1.0), allowed=2e-3,
    )  # fmt: skip
    book(
        CHAPTER, f"{case}: extension at the end, mean", reference="5.143175e-4 m",
        source="closed form, tan(k L)/k - L", error=abs(along[late].mean() / 5.143175e-4 - 1.0), allowed=1e-2,
    )  # fmt: skip


@pytest.mark.parametrize("radius", [1.0, 1.0 / 3.0])
def test_free_rod_in_large_steps(radius: float, book: Book) -> None:
    """It tumbles by 0.2 rad a step, curved and twisted; all is kept but the energy that a radius below 1 dissipates."""
    system = System()
    system.add(
        parts.Rod(length=1.0, section=STRIP, material=RUBBER, elements=6, curvature=(0.4, 0.0, 0.5),
                  velocity=(0.3, 0.0, 0.0), angular_velocity=(3.0, 5.0, 20.0)), "rod",
    )  # fmt: skip
    assembly = system.assemble()
    found = solve_energy(assembly, samples=np.arange(101) * 0.01, step=0.01, spectral_radius=radius)
    assert found.success, found.message
    assert found.statistics["divided_steps"] == 0
    sums = np.zeros((101, 6))
    for y, row in zip(found.y, sums, strict=True):
        kinematics(0.0, y, assembly.model)
        momenta(y, assembly.model, row)
    balance = found.kept.balance
    energy = balance.kinetic + balance.elastic
    assert balance.elastic.max() > 1e-4 * energy[0]
    linear, angular = (np.abs(sums[:, k : k + 3] - sums[0, k : k + 3]).max() for k in (0, 3))
    name = f"Free rod, 0.2 rad a step (radius {radius:.2g})"
    book(
        CHAPTER, f"{name}: momenta", reference="constant", source="closed form",
        error=max(linear / np.linalg.norm(sums[0, :3]), angular / np.linalg.norm(sums[0, 3:])), allowed=1e-11,
    )  # fmt: skip
    if radius == 1.0:
        book(
            CHAPTER, f"{name}: energy", reference="constant", source="closed form",
            error=np.abs(energy / energy[0] - 1.0).max(), allowed=1e-11,
        )  # fmt: skip
    assert energy.max() < energy[0] * (1.0 + 1e-11)
    assert radius == 1.0 or energy[-1] < energy[0] * (1.0 - 1e-4)


def test_methods_agree() -> None:
    """The load of a bent and twisted rod is removed: Dormand-Prince, generalized-alpha, energy-momentum."""
    system = cantilever(stiffness_damping=1e-3, mass_damping=0.5, elements=2)
    system.add(parts.Load(at="rod.tip", force=(0.0, 0.2, 0.3), ramp=0.02), "push")
    system.add(parts.Load(at="rod.tip", torque=(0.05, 0.0, 0.0), ramp=0.02), "twist")
    found = []
    for method, solver in SOLVERS.items():
        assembly = system.assemble()
        solution = solver(assembly, samples=[0.0, 0.1, 0.2], step=1e-4, spectral_radius=1.0)
        assert solution.success, (method, solution.message)
        found.append([tip(assembly, y) for y in solution.y])
        balance = solution.kept.balance
        lost = balance.by_mass + balance.by_stiffness
        off = balance.kinetic + balance.elastic + lost - balance.loads
        assert np.abs(off).max() < 1e-3 * balance.loads.max()
        assert lost[-1] > 0.01 * balance.loads.max()
    free = System()
    free.add(system.parts["rod"], "rod")
    free.add(
        parts.Joint(a=(0.0, 0.0, 0.0), b="rod.root", type="clamp", stiffness=1e6, rotational_stiffness=1e4), "clamp"
    )
    free.add(system.parts["push"], "push")
    free.add(system.parts["twist"], "twist")
    assembly = free.assemble()
    found.append([tip(assembly, y) for y in solve(assembly, samples=[0.0, 0.1, 0.2], method="dopri5").y])
    size = np.abs(np.array(found[0]) - (1.0, 0.0, 0.0)).max()
    assert np.abs(np.array(found[0]) - found[1]).max() < 1e-3 * size
    assert np.abs(np.array(found[0]) - found[2]).max() < 5e-3 * size


def test_modes_of_a_cantilever(book: Book) -> None:
    """So slender that shear and rotary inertia do not count; the masses lumped at the nodes, of the third order."""
    section, roots = Rectangle(thickness=1e-4, width=1e-3), np.array([1.8751040687, 4.6940911330])
    s, counts = section.properties(0.3), np.array([8, 16, 32])
    exact = roots**2 * np.sqrt(RUBBER.E * s.Iz / (RUBBER.density * s.area))
    errors = []
    for n in counts:
        found = modes(cantilever(section=section, elements=int(n)).assemble(), count=2).frequency
        errors.append(np.abs(found / exact - 1.0))
    order = fitted_order(1.0 / counts, [float(e[0]) for e in errors])
    assert order > 2.85
    book(
        "Modes", "Cantilever, two modes (rod, 16 elements)", reference="3.516015, 22.034492 sqrt(EI/m L^4)",
        source="closed form", error=errors[1].max(), allowed=2e-4, order=order, wanted="3",
    )  # fmt: skip


def test_free_modes(book: Book) -> None:
    """Six rigid-body modes, then those of the free rod, twice each of a square section."""
    thin = Rectangle(thickness=1e-3, width=1e-3)
    system = System()
    system.add(parts.Rod(length=1.0, section=thin, material=RUBBER, elements=16, direction=(1.0, 2.0, -1.0)), "rod")
    found, s = modes(system.assemble(), count=8), thin.properties(0.3)
    assert np.abs(found.frequency[:6]).max() < 1e-3 * found.frequency[6]
    exact = 22.373285 * np.sqrt(RUBBER.E * s.Iz / (RUBBER.density * s.area))
    book(
        "Modes", "Free rod, first bending (rod, 16 elements)", reference="22.373285 sqrt(EI/m L^4)",
        source="closed form", error=np.abs(found.frequency[6:] / exact - 1.0).max(), allowed=5e-4,
    )  # fmt: skip
    assert found.total_mass[:3] == pytest.approx(1e-3 * np.ones(3))
