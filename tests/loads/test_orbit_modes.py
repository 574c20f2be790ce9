"""Modes in an orbital frame and in acceleration fields: Coriolis terms, stability, flexible satellites."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from book import Book
from evolvent import System, elements, parts
from evolvent.solvers.modal.linear import linearize
from evolvent.solvers.static.linear_motion import gyroscopic
from evolvent.solvers.static.work import Work
from evolvent.solvers.time.implicit.energy_momentum import solve_energy

N = 0.7


def in_orbit() -> System:
    system = System()
    system.add(parts.Field(type="orbit", rate=N), "orbit")
    return system


def satellite(*inertia: float) -> System:
    system = in_orbit()
    system.add(parts.RigidBody(mass=2.0, inertia=inertia), "satellite")
    return system


def test_a_free_point(book: Book) -> None:
    """Clohessy and Wiltshire: the steady drift along the orbit, n in the plane, n across it."""
    system = in_orbit()
    system.add(parts.Point(mass=2.0), "p")
    found = system.modes(count=4)
    assert found.pole[0] == 0.0
    assert not np.any(found.unstable)
    error = float(np.abs(found.frequency[1:] / N - 1.0).max())
    assert found.frequency.size == 3
    book(
        "Modes", "free point in a circular orbit: frequencies 0, n, n", reference="closed form",
        source="Clohessy & Wiltshire 1960", error=error, allowed=1e-12,
    )  # fmt: skip


def test_a_dumbbell(book: Book) -> None:
    """Librations with sqrt(3) n in the plane of the orbit and 2 n out of it."""
    system = in_orbit()
    for name, x in (("upper", 3.0), ("lower", -3.0)):
        system.add(parts.Point(mass=1.5, position=(x, 0.0, 0.0)), name)
    system.add(parts.Joint(a="upper", b="lower", type="distance"))
    found = system.modes(count=5)
    exact = np.array([1.0, 1.0, math.sqrt(3.0), 2.0])
    error = float(np.abs(found.frequency[1:] / N / exact - 1.0).max())
    assert found.frequency[0] == 0.0
    assert not np.any(found.unstable)
    book(
        "Modes", "libration of a dumbbell in orbit: sqrt(3) n and 2 n", reference="closed form",
        source="Hughes 1986", error=error, allowed=1e-10,
    )  # fmt: skip


def roll_yaw(Jx: float, Jy: float, Jz: float) -> np.ndarray:
    """Poles of a body with principal axes x radial, y along the flight, z across (Hughes 1986), all of them.

    Pitch: Jz w'' = -3 n^2 (Jy - Jx) w. Roll and yaw: p^4 + (1 + 3 k1 + k1 k3) n^2 p^2 + 4 k1 k3 n^4 = 0 with
    k1 = (Jz - Jx)/Jy of roll (y), k3 = (Jz - Jy)/Jx of yaw (x).
    """
    k1, k3 = (Jz - Jx) / Jy, (Jz - Jy) / Jx
    squares = np.roots([1.0, 1.0 + 3.0 * k1 + k1 * k3, 4.0 * k1 * k3]).astype(complex)
    squares = np.append(squares, -3.0 * (Jy - Jx) / Jz)
    return N * np.concatenate([np.sqrt(squares), -np.sqrt(squares)])


@pytest.mark.parametrize(
    ("inertia", "stable"),
    [((2.0, 4.0, 5.0), True), ((4.0, 2.0, 5.0), False), ((4.5, 5.0, 1.0), False), ((5.0, 5.5, 4.9), True)],
)
def test_stability_of_a_satellite(inertia: tuple[float, float, float], stable: bool) -> None:
    """Gravity-gradient satellite: poles by Hughes; the last one is stable by Coriolis terms only (DeBra & Delp)."""
    found = satellite(*inertia).modes(count=8)
    assert bool(np.any(found.unstable)) != stable
    exact = roll_yaw(*inertia)
    for pole in exact[exact.imag >= 0.0]:
        assert np.abs(found.pole - pole).min() < 1e-8 * N or np.abs(np.conj(found.pole) - pole).min() < 1e-8 * N


def test_a_linear_model_has_the_same_poles() -> None:
    model = satellite(2.0, 4.0, 5.0).assemble()
    found = np.linalg.eigvals(linearize(model, ["satellite.torque.z"], ["satellite.rate.z"]).A)
    for pole in roll_yaw(2.0, 4.0, 5.0):
        assert np.abs(found - pole).min() < 1e-8 * N


def boom() -> System:
    """A satellite with a flexible boom along the radius and a tip mass; its bending is little faster than the orbit."""
    system = in_orbit()
    system.add(parts.RigidBody(mass=20.0, inertia=(3.0, 2.5, 4.0), position=(-1.0, 0.0, 0.0)), "satellite")
    section, material = elements.Rectangle(width=0.03, thickness=0.02), elements.Material(
        young_modulus=4e9, poisson_ratio=0.3, density=500.0
    )  # fmt: skip
    system.add(parts.Rod(length=4.0, elements=3, section=section, material=material), "boom")
    system.add(parts.Joint(a="satellite", b="boom.root", type="clamp"))
    system.add(parts.Point(mass=2.0, at="boom.tip"), "tip")
    return system


def test_coriolis_terms_are_those_of_the_field() -> None:
    """Of bodies, rods and points, against differences of the field's forces."""
    assembly = boom().assemble()
    work = Work(assembly, None, 0.0, np.zeros(6))
    M, whole = work.mass(), work.damping()
    scale = work.model.fields["scale"].copy()
    work.model.fields["scale"] = 0.0
    differences = (whole - work.damping()).toarray()
    work.model.fields["scale"] = scale
    terms = gyroscopic(work, M, work.model.fields["w"][0]).toarray()
    assert np.abs(terms + terms.T).max() < 1e-12 * np.abs(terms).max()
    assert np.abs(terms - differences).max() < 1e-7 * np.abs(terms).max()


def test_a_flexible_satellite_against_its_motion(book: Book) -> None:
    """A small motion in one mode at a time is that of a simulation from the mode's state."""
    found, worst = boom().modes(count=8), 0.0
    rest = found.equilibrium.y[-1]
    assert not np.any(found.unstable)
    for k in np.flatnonzero(found.frequency > 0.0)[[2, 4, 5]]:
        t, y = found.states(int(k), amplitude=1e-4, frames=9)
        moved = dataclasses.replace(found.assembly, y=y[0])
        run = solve_energy(moved, samples=t, step=t[-1] / 400, spectral_radius=1.0)
        n_q = int(found.assembly.model.info.nq)
        off, size = np.abs(run.y[:, :n_q] - y[:, :n_q]).max(), np.abs(y[:, :n_q] - rest[:n_q]).max()
        worst = max(worst, off / size)
    book(
        "Modes", "satellite with a flexible boom (rod) in orbit: states of modes", reference="energy-momentum",
        source="simulation from the mode's state over its period", error=worst, allowed=2e-3,
    )  # fmt: skip
