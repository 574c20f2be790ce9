"""A taut cable round a drum: at rest it stays at rest, and pulls the drum with twice its tension."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from evolvent import System, elements, parts
from evolvent.assembly.assembled import Assembly
from evolvent.solvers import Solution
from evolvent.solvers.static.static import solve_static
from evolvent.solvers.time.implicit.energy_momentum import solve_energy

RADIUS, THICKNESS, WIDTH, STIFF = 0.1, 1e-3, 1e-2, 1e5


def cable(
    law: str = "hunt-crossley",
    *,
    strain: float = 1e-3,
    friction: float = 0.0,
    wrap: float = math.pi,
    count: int = 16,
    E: float = 2e9,
    held: bool = True,
    depth: float = 0.0,
) -> tuple[Assembly, float]:
    """A cable with straight legs of 0.1 m, wound round a drum by the angle `wrap`, and its tension at the start (N).

    Its ends are held, or pulled by the tension.
    """
    radius = RADIUS - depth
    arc = radius * wrap
    nodes = np.zeros((count + 1, 2, 3))
    for i, s in enumerate(np.linspace(-0.1, arc + 0.1, count + 1)):
        angle = 0.5 * (math.pi + wrap) - min(max(s, 0.0), arc) / radius
        along = np.array([math.sin(angle), -math.cos(angle), 0.0])
        leg = s - min(max(s, 0.0), arc)
        nodes[i, 0] = radius * np.array([math.cos(angle), math.sin(angle), 0.0]) + leg * along
        nodes[i, 1] = (1.0 + strain) * along
    system = System()
    material = elements.Material(young_modulus=E, poisson_ratio=0.3, density=1500.0)
    section = elements.Rectangle(thickness=THICKNESS, width=WIDTH)
    length = (arc + 0.2) / (1.0 + strain)
    system.add(
        parts.Beam(length=length, section=section, material=material, elements=count, formulation="cable", nodes=nodes),
        "cable",
    )
    tension = E * THICKNESS * WIDTH * strain * (1.0 + strain)
    for end, k, sign in (("root", 0, -1.0), ("tip", -1, 1.0)):
        if held:
            system.add(parts.Joint(a=tuple(nodes[k, 0]), b=f"cable.{end}", type="spherical"), end)
        else:
            force = sign * tension * nodes[k, 1] / (1.0 + strain)
            system.add(parts.Load(at=f"cable.{end}", force=tuple(force)), end)
    drum = parts.Contact(
        a="cable", b="ground", shape=parts.Cylinder(radius=RADIUS), law=law, stiffness=STIFF, friction=friction,
        initial_overlap=0.05,
    )  # fmt: skip
    system.add(drum, "drum")
    return system.assemble(), tension


def at_rest(assembly: Assembly) -> tuple[Assembly, Solution]:
    """The same from its equilibrium."""
    found = solve_static(assembly)
    assert found.success, found.message
    return dataclasses.replace(assembly, y=found.y[-1].copy()), found


@pytest.mark.parametrize("law", ["hunt-crossley", "conservative"])
@pytest.mark.parametrize(("strain", "step"), [(1e-3, 2e-3), (1e-3, 1e-3), (1e-3, 1e-4), (1e-2, 1e-3), (1e-2, 1e-4)])
def test_a_taut_cable_lies_still_under_any_fixed_step(law: str, strain: float, step: float) -> None:
    """The drum carries 2 T of two parallel legs; nothing moves, from the first step on."""
    assembly, tension = cable(law, strain=strain, held=False)
    assembly, start = at_rest(assembly)
    assert start.forces["contact_surfaces"]["force"][-1, 0, 1] == pytest.approx(2.0 * tension, rel=1e-6)
    run = solve_energy(assembly, samples=step * np.arange(11), step=step)
    assert run.success, run.message
    n_q = int(assembly.model.info.nq)
    np.testing.assert_allclose(run.forces["contact_surfaces"]["force"][:, 0, 1], 2.0 * tension, rtol=1e-5)
    assert np.abs(run.y[:, :n_q] - assembly.y[:n_q]).max() < 1e-6
    assert np.abs(run.wrenches[:, 0, 1] + 2.0 * tension).max() < 1e-5 * tension  # of the start, too


@pytest.mark.parametrize("law", ["hunt-crossley", "conservative"])
def test_the_pressure_of_a_wrapped_cable_is_its_tension_by_its_radius(law: str) -> None:
    """Half a turn: the sum of the normal forces is T times the angle, their resultant 2 T sin(angle / 2)."""
    for wrap in (0.5 * math.pi, math.pi):
        assembly, tension = cable(law, held=False, wrap=wrap, count=32)
        assembly, _ = at_rest(assembly)
        run = solve_energy(assembly, samples=[0.0, 1e-3, 2e-3], step=1e-3)
        assert run.success, run.message
        normal, force = (
            run.forces["contact_surfaces"]["normal"][-1, 0],
            run.forces["contact_surfaces"]["force"][-1, 0, 1],
        )
        assert force == pytest.approx(2.0 * tension * math.sin(0.5 * wrap), rel=1e-5)
        # the legs' bending stiffness lifts the cable off a little where it leaves the drum
        assert normal == pytest.approx(tension * wrap, rel=0.02)


def test_the_reactions_of_a_held_cable_are_those_of_its_equilibrium_from_the_start() -> None:
    """Contact forces count in multipliers and wrenches of the first sample."""
    assembly, start = at_rest(cable("conservative")[0])
    run = solve_energy(assembly, samples=[0.0, 1e-3, 2e-3], step=1e-3)
    assert run.success, run.message
    scale = np.abs(start.la[-1]).max()
    np.testing.assert_allclose(run.la, np.tile(start.la[-1], (3, 1)), atol=1e-4 * scale)


def test_a_conservative_cable_that_rubs_lies_still() -> None:
    for step in (1e-3, 1e-4):
        assembly, tension = cable("conservative", strain=1e-2, friction=0.3, wrap=0.5 * math.pi, count=8)
        assembly, start = at_rest(assembly)
        run = solve_energy(assembly, samples=step * np.arange(11), step=step)
        assert run.success, run.message
        np.testing.assert_allclose(
            run.forces["contact_surfaces"]["normal"][:, 0], start.forces["contact_surfaces"]["normal"][-1, 0], rtol=0.05
        )
        assert tension > 0.0


@pytest.mark.parametrize("law", ["hunt-crossley", "conservative"])
@pytest.mark.parametrize("depth", [0.0, 5e-5])
def test_a_cable_that_begins_to_press_is_carried(law: str, depth: float) -> None:
    """Laid on the drum without the depth that carries it: it sinks in, rings, and the mean force is that of rest."""
    assembly, _ = cable(law, depth=depth)
    rest = at_rest(assembly)[1].forces["contact_surfaces"]["force"][-1, 0, 1]
    run = solve_energy(assembly, samples=np.linspace(0.0, 0.04, 401), step=1e-4)
    assert run.success, run.message
    assert run.forces["contact_surfaces"]["force"][100:, 0, 1].mean() == pytest.approx(rest, rel=0.05)
