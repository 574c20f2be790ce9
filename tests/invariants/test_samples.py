"""Samples cut no step: neither the steps nor the end of a run depend on them, and between steps states are as exact."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from evolvent import System, parts
from evolvent.assembly.assembled import Assembly
from evolvent.elements import Material, Rectangle
from evolvent.families.beams.observer import observe_beam
from evolvent.results.observe.view import View
from evolvent.solvers import Solution, solve
from evolvent.solvers.time.implicit.energy_momentum import solve_energy
from evolvent.solvers.time.implicit.plan import solve_implicit
from helpers import fitted_order, heliogyro

Array = np.ndarray
END = 1.0
SECTION = Rectangle(thickness=0.01, width=0.02)


def craft() -> Assembly:
    """A body that tumbles freely, with a mass on a spring."""
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=(0.02, 0.03, 0.04), angular_velocity=(0.1, 2.0, 0.3)), "hub")
    system.add(parts.Point(mass=0.2, position=(0.0, 0.5, 0.1), velocity=(0.2, 0.0, 0.0)), "mass")
    system.add(parts.Spring(a=("hub", (0.0, 0.2, 0.0)), b="mass", length=0.2, stiffness=3.0), "spring")
    return system.assemble()


def pendulum(**joint: Any) -> Assembly:
    """A mass on a massless rod, released at 60 degrees from below: its pull is m g (3 cos a - 1)."""
    system = System(gravity=(0.0, -9.81, 0.0))
    place = (math.sin(math.pi / 3.0), -math.cos(math.pi / 3.0), 0.0)
    system.add(parts.Point(mass=2.0, position=place), "bob")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="bob", type="distance", **joint), "rod")
    return system.assemble()


def falling() -> Assembly:
    """A strip that falls on a cylinder, with a load that begins within the run."""
    system = System(gravity=(0.0, -9.81, 0.0))
    section, material = (
        Rectangle(thickness=0.01, width=0.02),
        Material(young_modulus=1e8, poisson_ratio=0.3, density=1e3),
    )
    given: dict[str, Any] = {"section": section, "material": material, "elements": 4, "formulation": "cable"}
    system.add(parts.Beam(length=0.4, position=(-0.13, 0.6, 0.0), mass_damping=0.5, **given), "strip")
    contact = {"stiffness": 1e4, "damping": 0.3, "friction": 0.2, "points": 2}
    system.add(parts.Contact(a="strip", b="ground", shape=parts.Cylinder(radius=0.5), **contact), "drum")
    system.add(parts.Load(at="strip.tip", force=(0.0, 0.0, 0.1), start=0.3337), "push")
    return system.assemble()


def soft() -> Assembly:
    """A strip on a penalty, slow enough for explicit methods, and a hinge with a latch."""
    system = System()
    section, material = (
        Rectangle(thickness=0.01, width=0.02),
        Material(young_modulus=1e5, poisson_ratio=0.0, density=1e3),
    )
    beam = parts.Beam(length=0.4, section=section, material=material, elements=2, formulation="cable")
    system.add(beam, "strip")
    system.add(parts.Joint(a="ground", b="strip.root", type="spherical", stiffness=20.0), "pin")
    system.add(parts.Load(at="strip.tip", force=(0.0, 0.01, 0.0), start=0.3337), "push")
    system.add(parts.RigidBody(motion="spin", inertia=0.5, rate=1.0), "panel")
    hinge = {"stiffness": 2.0, "rest": 1.0, "latch": 0.6, "latch_stiffness": 50.0, "latch_damping": 1.0}
    system.add(parts.JointSpring(a="ground", b="panel", **hinge), "hinge")
    return system.assemble()


threads = functools.partial(heliogyro, segments="springs", nodes=10, out=0.4, stiffness=50.0)
alpha, energy = solve_implicit, solve_energy
RUNS: list[tuple[str, Callable[..., Solution], Callable[[], Assembly], dict[str, Any]]] = [
    ("alpha-craft", alpha, craft, {"step": 0.013}),
    ("alpha-craft-adaptive", alpha, craft, {"tolerance": 1e-5}),
    ("alpha-pendulum", alpha, pendulum, {"step": 0.013}),
    ("alpha-pendulum-adaptive", alpha, pendulum, {"tolerance": 1e-5}),
    ("alpha-contact", alpha, falling, {"step": 0.0007}),
    ("alpha-contact-adaptive", alpha, falling, {"tolerance": 1e-4}),
    ("alpha-latch", alpha, soft, {"step": 0.013}),
    ("alpha-threads", alpha, threads, {"step": 0.0013}),
    ("alpha-threads-adaptive", alpha, threads, {"tolerance": 1e-5}),
    ("energy-craft", energy, craft, {"step": 0.013}),
    ("energy-contact", energy, falling, {"step": 0.0013}),
    ("energy-contact-adaptive", energy, falling, {"tolerance": 1e-4}),
    ("energy-latch", energy, soft, {"step": 0.013}),
    ("rk4-craft", solve, craft, {"method": "rk4", "step": 0.013}),
    ("rk4-latch", solve, soft, {"method": "rk4", "step": 0.0013}),
    ("rk4-threads", solve, threads, {"method": "rk4", "step": 0.0013}),
    ("heun-craft", solve, craft, {"method": "heun", "step": 0.013}),
    ("dopri5-craft", solve, craft, {"method": "dopri5", "rtol": 1e-6}),
    ("dopri5-threads", solve, threads, {"method": "dopri5", "rtol": 1e-5}),
]


@pytest.mark.parametrize(("solver", "make", "options"), [pytest.param(*row[1:], id=row[0]) for row in RUNS])
def test_samples_cut_no_step(solver: Callable[..., Solution], make: Callable[[], Assembly], options: Any) -> None:
    few, many = (solver(make(), samples=np.linspace(0.0, END, count), **options) for count in (2, 2000))
    assert few.success, few.message
    assert many.success, many.message
    assert many.t.size == 2000
    assert few.statistics["steps"] == many.statistics["steps"]
    assert few.statistics["mean_step"] == many.statistics["mean_step"] == pytest.approx(END / few.statistics["steps"])
    assert np.array_equal(few.y[-1], many.y[-1])
    assert np.array_equal(few.s[-1], many.s[-1])
    assert np.array_equal(few.event_times, many.event_times)
    assert np.all(np.isfinite(many.y))
    for family in few.assembly.model.bodies[few.assembly.model.bodies["motion"] == 2]:
        attitudes = many.y[:, family["iq"] + 3 : family["iq"] + 7]
        assert np.linalg.norm(attitudes, axis=1) == pytest.approx(1.0, abs=1e-6)


def exact(make: Callable[[], Assembly], times: Array) -> Array:
    return solve(make(), samples=times, method="dopri5", rtol=1e-12, atol=1e-14).y


@pytest.mark.parametrize(
    ("solver", "options", "order"),
    [
        pytest.param(alpha, {"spectral_radius": 0.8}, 2, id="alpha"),
        pytest.param(energy, {"spectral_radius": 1.0}, 2, id="energy"),
        pytest.param(solve, {"method": "heun"}, 2, id="heun"),
        pytest.param(solve, {"method": "rk4"}, 4, id="rk4"),
    ],
)
def test_states_between_steps_are_as_exact_as_those_at_their_ends(
    solver: Callable[..., Solution], options: Any, order: int
) -> None:
    """Positions, attitude, and velocities of a body that tumbles, at samples anywhere in the steps."""
    within = np.array([0.0, *np.sort(np.random.default_rng(1).uniform(0.1, END, 40)), END])
    ends = np.linspace(0.0, END, 11)
    n = int(craft().model.info.nq + craft().model.info.nv)
    steps, errors = (0.05, 0.025, 0.0125), []
    for h in steps:
        found = [solver(craft(), samples=times, step=h, **options).y[:, :n] for times in (within, ends)]
        off = [np.abs(y - exact(craft, times)[:, :n]).max() for y, times in zip(found, (within, ends), strict=True)]
        assert off[0] < 2.0 * off[1]
        errors.append(off[0])
    assert fitted_order(np.array(steps), np.array(errors)) == pytest.approx(order, abs=0.3)


@pytest.mark.parametrize("formulation", ["cable", "assumed_strain"])
@pytest.mark.parametrize("options", [{"step": 0.005}, {"tolerance": 1e-4}], ids=["fixed", "adaptive"])
@pytest.mark.parametrize("solver", [alpha, energy], ids=["alpha", "energy"])
def test_a_stiff_beam_that_spins_is_not_stretched_between_steps(
    solver: Callable[..., Solution], options: Any, formulation: str
) -> None:
    """The pull at its root is m w^2 L/2; interpolated places alone would show a hundred times as much."""
    rate, length, vectors, count = 1.5, 4.0, 2 if formulation == "cable" else 4, 5
    nodes = np.zeros((count, vectors, 3))
    x, stretch = np.linspace(0.0, length, count), 2700.0 * rate**2 / (2.0 * 7e10)
    nodes[:, 0, 0], nodes[:, 1, 0] = x + stretch * (length**2 * x - x**3 / 3.0), 1.0 + stretch * (length**2 - x**2)
    if vectors == 4:
        nodes[:, 2, 1] = nodes[:, 3, 2] = 1.0
    material, section = (
        Material(young_modulus=7e10, poisson_ratio=0.3, density=2700.0),
        Rectangle(thickness=0.02, width=0.04),
    )
    given: dict[str, Any] = {"section": section, "material": material, "formulation": formulation}
    given |= {"nodes": nodes, "rates": np.cross((0.0, 0.0, rate), nodes), "stiffness_damping": 1e-4}
    system = System()
    system.add(parts.Beam(length=length, elements=count - 1, **given), "boom")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="boom.root", type="revolute"), "root")
    if formulation == "cable":  # a node with a spring, which hardly pulls, is a node like the others
        system.add(parts.Spring(a="boom[1]", b=(0.0, 0.0, 1.0), stiffness=1e-6, length=1.0))
    found = solver(system.assemble(), samples=np.linspace(0.0, 4.0, 777), **options)
    assert found.success, found.message
    pull = 2700.0 * 0.02 * 0.04 * rate**2 * length**2 / 2.0
    force = observe_beam(View.of(found), "boom").variables["axial_force"].values
    later = found.t > 1.0
    assert np.abs(force[later, 0] - pull).max() < 0.03 * pull
    assert np.linalg.norm(found.la[later, :3], axis=1) == pytest.approx(np.full(later.sum(), pull), rel=0.02)


@pytest.mark.parametrize("options", [{"step": 0.01}, {"tolerance": 1e-6}], ids=["fixed", "adaptive"])
@pytest.mark.parametrize("solver", [alpha, energy], ids=["alpha", "energy"])
def test_forces_between_steps_are_those_of_the_motion(solver: Callable[..., Solution], options: Any) -> None:
    """Pull of a pendulum's rod, and the energies that the balance holds."""
    found = solver(pendulum(), samples=np.linspace(0.0, 2.0, 1777), **options)
    assert found.success, found.message
    angle = np.arctan2(found.y[:, 0], -found.y[:, 1])
    pull = 2.0 * 9.81 * (3.0 * np.cos(angle) - 1.0)
    assert np.abs(found.la[:, 0]) == pytest.approx(pull, abs=(0.07 if solver is energy else 0.01) * 2.0 * 9.81)
    kinetic = 0.5 * 2.0 * np.sum(found.y[:, 3:6] ** 2, axis=1)
    assert found.balance.kinetic == pytest.approx(kinetic, abs=2e-3 * kinetic.max())
    assert np.abs(found.energy_defect).max() < 2e-3 * kinetic.max()
    assert np.hypot(found.y[:, 0], found.y[:, 1]) == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("options", [{"step": 0.05}, {"tolerance": 1e-4}], ids=["fixed", "adaptive"])
def test_a_thread_of_stiff_springs_is_not_stretched_between_steps(options: Any) -> None:
    """Tension at the spool against steps that resolve the springs; its ringing aside, by the median."""
    make = functools.partial(heliogyro, segments="springs", spool=3.5)
    fine = solve(make(), samples=np.linspace(0.0, 6.0, 121), method="rk4")
    found = solve_implicit(make(), samples=np.linspace(0.0, 6.0, 577), **options)
    assert found.success, found.message
    later, tension = found.t > 1.0, [np.nanmax(run.observations.tension, axis=1) for run in (found, fine)]
    off = np.abs(tension[0] - np.interp(found.t, fine.t, tension[1]))[later]
    assert np.median(off) < 0.1 * np.median(tension[1])
    assert tension[0][later].max() < 1.5 * tension[1].max()
