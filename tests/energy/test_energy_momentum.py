"""The energy-momentum method: energy and momenta to round-off, or energy that only falls, at any step."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from evolvent import InputError, System, parts
from evolvent.elements import Material, Rectangle
from evolvent.solvers import solve
from evolvent.solvers.common.solution import Solution
from evolvent.solvers.time.implicit.energy_momentum import plan, solve_energy

THIN = Rectangle(thickness=1e-3, width=0.02)
STIFF = Material(young_modulus=1e9, poisson_ratio=0.3, density=1600.0)
FORMULATIONS = ("cable", "cable_stretch", "elastic_line", "assumed_strain")


def ran(system: System, end: float, step: float, *, rho: float = 1.0, every: int = 1) -> Solution:
    """A run at fixed steps, sampled at their ends (but where they are divided)."""
    samples = step * np.arange(0, round(end / step) + 1, every)
    found = solve_energy(system.assemble(), samples=samples, step=step, spectral_radius=rho)
    assert found.success, found.message
    return found


def thrown(formulation: str, elements: int = 6) -> System:
    """A free strip that is thrown so that it crumples."""
    system = System()
    vectors = 2 if formulation.startswith("cable") else 4
    nodes = np.zeros((elements + 1, vectors, 3))
    nodes[:, 0, 0] = x = np.linspace(0.0, 1.0, elements + 1)
    nodes[:, 1, 0] = 1.0
    if vectors == 4:
        nodes[:, 2, 1] = nodes[:, 3, 2] = 1.0
    rates = np.zeros_like(nodes)
    rates[:, 0, 1], rates[:, 1, 1] = 3.0 * (x - 0.5) + 2.0 * np.sin(6.0 * x), 3.0 + 12.0 * np.cos(6.0 * x)
    rates[:, 0, 2] = x * x
    given: dict[str, Any] = {"section": THIN, "material": STIFF, "formulation": formulation}
    system.add(parts.Beam(length=1.0, elements=elements, nodes=nodes, rates=rates, **given), "strip")
    return system


def linked() -> System:
    """Two free bodies on a hinge with a spring and a joint, a mass on a spring, nothing from outside."""
    system = System()
    inertia = (0.02, 0.03, 0.04)
    system.add(parts.RigidBody(mass=1.0, inertia=inertia, angular_velocity=(0.3, 0.2, 1.0)), "hub")
    system.add(
        parts.RigidBody(mass=0.5, inertia=inertia, position=(0.6, 0.0, 0.0), velocity=(0.0, 0.3, -0.06)), "panel"
    )
    system.add(parts.Joint(a=("hub", (0.3, 0.0, 0.0)), b=("panel", (-0.3, 0.0, 0.0)), type="spherical"), "joint")
    system.add(parts.Point(mass=0.2, position=(0.0, 0.5, 0.1), velocity=(0.2, 0.0, 0.0)), "mass")
    system.add(parts.Spring(a=("hub", (0.0, 0.2, 0.0)), b="mass", length=0.2, stiffness=30.0), "spring")
    system.add(parts.JointSpring(a="hub", b="panel", axis=(0.0, 0.0, 1.0), stiffness=0.5, rest=0.4), "hinge")
    return system


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_crumpling_strip_keeps_energy_and_momenta(formulation: str) -> None:
    found = ran(thrown(formulation), 0.05, 1e-3)
    energy, momentum = found.energy, found.momentum
    assert np.abs(energy - energy[0]).max() < 1e-9 * energy[0]
    assert np.abs(momentum.drift_linear).max() < 1e-14
    assert np.abs(momentum.drift_angular[-1]).max() < 1e-9 * np.abs(momentum.angular).max()


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_the_filter_takes_energy_and_keeps_momenta(formulation: str) -> None:
    found = ran(thrown(formulation), 0.1, 2e-3, rho=1.0 / 3.0)
    assert found.energy_defect[-1] < -1e-4 * found.energy[0]
    assert found.energy_defect.max() < 1e-11 * found.energy[0]
    assert np.abs(found.momentum.drift_angular[-1]).max() < 1e-9 * np.abs(found.momentum.angular).max()


@pytest.mark.parametrize("step", [0.2, 0.05, 0.01])
def test_linked_bodies_keep_energy_and_momenta_at_any_step(step: float) -> None:
    found = ran(linked(), 4.0, step)
    scale = found.energy.max()
    assert np.abs(found.energy - found.energy[0]).max() < 1e-8 * scale
    assert np.abs(found.momentum.drift_linear[-1]).max() < 1e-11
    assert np.abs(found.momentum.drift_angular[-1]).max() < 1e-9


def test_second_order_against_dormand_prince() -> None:
    """A free body tumbles, with a mass on a spring: the error of positions and attitude falls as the step squared."""
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=(0.02, 0.03, 0.04), angular_velocity=(0.1, 2.0, 0.3)), "hub")
    system.add(parts.Point(mass=0.2, position=(0.0, 0.5, 0.1), velocity=(0.2, 0.0, 0.0)), "mass")
    system.add(parts.Spring(a=("hub", (0.0, 0.2, 0.0)), b="mass", length=0.2, stiffness=3.0), "spring")
    exact = solve(system.assemble(), samples=[0.0, 2.0], method="dopri5", rtol=1e-11, atol=1e-13).y[-1]
    errors = [np.abs(ran(system, 2.0, h).y[-1] - exact)[:10].max() for h in (0.04, 0.02, 0.01)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(np.abs(orders - 2.0) < 0.1), orders


@pytest.mark.parametrize("rho", [1.0 / 3.0, 0.6, 1.0])
def test_spectral_radius_at_infinite_frequency(rho: float) -> None:
    """An axial vibration that the step does not resolve: the stretch falls by rho a step, or swings about zero."""
    strip = System()
    strip.add(parts.Beam(length=1.0, section=THIN, material=STIFF, elements=1, formulation="cable"), "strip")
    strip.add(parts.Joint(a="ground", b="strip.root", type="clamp"), "root")
    assembly = strip.assemble()
    assembly.y[6] *= 1.0 + 1e-7  # the tip, along the strip
    found = solve_energy(assembly, samples=np.arange(0.0, 21.0), step=1.0, spectral_radius=rho)
    stretch = np.abs(found.y[:, 6] - 1.0)
    if rho == 1.0:
        assert stretch == pytest.approx(np.full(21, 1e-7), rel=1e-2)
    else:
        assert stretch[16] / stretch[15] == pytest.approx(rho, rel=0.08)  # 1/3 is a double root: n rho^n


def bouncing(law: str, height: float = 0.05, friction: float = 0.0, damping: str = "objective") -> System:
    """A stiff short rod, free, falls onto a cylinder."""
    system = System(gravity=(0.0, -9.81, 0.0))
    given: dict[str, Any] = {"section": Rectangle(thickness=0.01, width=0.02), "material": STIFF, "elements": 2}
    given |= {"damping": damping, "stiffness_damping": 0.0 if damping == "objective" else 1e-9}
    system.add(
        parts.Beam(length=0.1, position=(-0.03, 0.5 + height, 0.0), direction=(1, 0, 0), formulation="cable", **given),
        "rod",
    )
    contact: dict[str, Any] = {"law": law, "stiffness": 1e4, "friction": friction, "damping": 0.0}
    system.add(parts.Contact(a="rod", b="ground", shape=parts.Cylinder(radius=0.5, length=2.0), **contact), "drum")
    return system


@pytest.mark.parametrize("step", [5e-3, 1e-3])
def test_an_elastic_bounce_keeps_the_energy(step: float) -> None:
    found = ran(bouncing("conservative"), 0.4, step)
    scale = np.abs(found.balance.loads).max()
    assert found.forces["contact_surfaces"]["touching"][:, 0].max() > 0.0
    assert np.abs(found.energy_defect).max() < 1e-8 * scale


@pytest.mark.parametrize("step", [5e-2, 1e-2, 1e-3])
@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_contact_and_friction_never_add_energy(step: float, friction: float) -> None:
    found = ran(bouncing("hunt-crossley", friction=friction), 0.4, step, rho=1.0 / 3.0)
    scale = np.abs(found.balance.loads).max()
    assert found.energy_defect.max() < 1e-9 * scale
    assert found.balance.by_contact[-1] >= -1e-12 * scale
    if friction > 0.0:
        assert found.balance.by_friction[-1] > 0.0


def test_samples_cut_no_step() -> None:
    few, many = (
        solve_energy(linked().assemble(), samples=np.linspace(0.0, 2.0, count), step=0.05) for count in (2, 401)
    )
    assert few.statistics["steps"] == many.statistics["steps"] == 40
    assert np.array_equal(few.y[-1], many.y[-1])
    between = many.y[np.arange(many.t.size) % 10 != 0]
    assert np.all(np.isfinite(between))
    assert np.linalg.norm(between[:, 3:7], axis=1) == pytest.approx(1.0, abs=1e-12)


def test_a_distance_and_a_motor_do_their_work() -> None:
    """A pendulum on a driven crank: energy less the work of the drive is kept."""
    system = System(gravity=(0.0, -9.81, 0.0))
    system.add(parts.RigidBody(motion="driven", rate=2.0), "crank")
    system.add(parts.Point(mass=1.0, position=(0.2, -1.0, 0.0), velocity=(0.0, 0.4, 0.0)), "bob")
    system.add(parts.Joint(a=("crank", (0.2, 0.0, 0.0)), b="bob", type="distance"), "rod")
    found = ran(system, 5.0, 0.02)
    assert np.abs(found.balance.drives).max() > 0.1
    assert np.abs(found.energy_defect).max() < 1e-9


def test_a_latch_is_an_event() -> None:
    """The time at which a panel on a spring reaches its latch: a quarter of the period of an unlatched one."""
    system = System()
    system.add(parts.RigidBody(motion="spin", inertia=0.5), "panel")
    stiffness, rest = 2.0, 1.0
    system.add(
        parts.JointSpring(
            a="ground", b="panel", stiffness=stiffness, rest=rest, latch=rest, latch_stiffness=100.0, latch_damping=1.0
        ),
        "hinge",
    )
    found = ran(system, 1.5, 0.01)
    assert found.event_times == pytest.approx([0.25 * 2.0 * math.pi * math.sqrt(0.5 / stiffness)], abs=2e-4)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"spectral_radius": 0.2}, "spectral_radius is 0.2; under energy-momentum it must be from 1/3 to 1"),
        ({"step": 0.0}, "step is 0.0; it must be"),
        ({"samples": [0.0]}, "samples is"),
    ],
)
def test_options_out_of_range_are_refused(change: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        plan(linked().assemble(), **({"samples": [0.0, 1.0]} | change))


def test_what_is_not_supported_is_refused_by_name() -> None:
    system = bouncing("hunt-crossley", damping="paper")
    with pytest.raises(InputError, match="'rod' is a beam with the paper's damping, which energy-momentum does not"):
        plan(system.assemble(), samples=[0.0, 1.0])


def test_reactions_from_the_start_on() -> None:
    """Force of a rod that swings: m (g cos(angle) + v^2 / l), at every sample, the first included."""
    system = System(gravity=(0.0, -9.81, 0.0))
    system.add(parts.Point(mass=2.0, position=(0.6, -0.8, 0.0)), "bob")
    system.add(parts.Joint(a="ground", b="bob", type="distance"), "rod")
    run = system.simulate(until=2.0, every=0.1, method="energy-momentum", step=1e-3)
    x, v = run["bob"].position.values, run["bob"].velocity.values
    exact = 2.0 * (-9.81 * x[:, 1] + (v**2).sum(axis=1))
    force = np.linalg.norm(run["rod"].force.values, axis=1)
    assert force == pytest.approx(exact, rel=5e-3)
