"""Hinges with springs at the root of beams: the angle is that of the section, not of the axis."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from evolvent import System, parts
from evolvent.assembly.assembled import Assembly
from evolvent.elements import Material, Rectangle
from evolvent.solvers.modal.modes import modes
from evolvent.solvers.static.static import solve_static
from evolvent.solvers.time.implicit.plan import solve_implicit
from static.composing import beam, nodes, solved

SQUARE = Rectangle(thickness=0.02, width=0.02)
MATERIAL = Material(young_modulus=2e11, poisson_ratio=0.0, density=7800.0)
EI = 2e11 * 0.02**4 / 12.0


def sprung(count: int, stiffness: float, *, formulation: str = "assumed_strain", moment: float = 0.0) -> Assembly:
    """A bar of 1 m on a hinge about z with a spring, and a couple about z at its tip."""

    def more(system: System) -> None:
        system.add(parts.JointSpring(a="ground", b="beam.root", stiffness=stiffness), "spring")
        if moment:
            system.add(parts.Load(at="beam.tip", slope=2, torque=(-moment, 0.0, 0.0)), "moment")

    return beam(formulation, count, ("revolute",), section=SQUARE, material=MATERIAL, more=more)


@pytest.mark.parametrize("formulation", ["assumed_strain", "elastic_line", "nu_split"])
@pytest.mark.parametrize("count", [1, 2])
def test_a_tip_moment_turns_a_beam_by_spring_and_bending_alone(formulation: str, count: int) -> None:
    """M/k at the root, M/k + M L/EI at the tip; with the spring on the axis the root turned by 5 % more."""
    k, M = 100.0 * EI, 1e-4 * EI
    a = sprung(count, k, formulation=formulation, moment=M)
    r = solved(solve_static(a))
    across = nodes(a, r)[:, 2]
    angles = np.arctan2(-across[:, 0], across[:, 1])
    assert angles[0] == pytest.approx(M / k, rel=1e-6)
    assert angles[-1] == pytest.approx(M / k + M / EI, rel=1e-6)


@pytest.mark.parametrize(("stiffness", "tolerance"), [(0.01, 2e-4), (100.0, 5e-3)])
def test_the_frequency_of_a_rib_on_its_spring(stiffness: float, tolerance: float) -> None:
    """k L/EI (1 + cos b cosh b) = b (sin b cosh b - cos b sinh b), of Euler's beam; nearly rigid, w^2 = 3 k/(m L^2)."""

    def off(b: float) -> float:
        held, free = 1.0 + np.cos(b) * np.cosh(b), np.sin(b) * np.cosh(b) - np.cos(b) * np.sinh(b)
        return float(stiffness * held - b * free)

    b = brentq(off, 0.05, 1.9)
    line = 7800.0 * 4e-4
    expected = b**2 * np.sqrt(EI / line)
    if stiffness < 0.1:
        assert expected == pytest.approx(np.sqrt(3.0 * stiffness * EI / line), rel=2e-3)
    a = sprung(8, stiffness * EI)
    frequencies = modes(a, count=4).frequency
    assert np.abs(frequencies / expected - 1.0).min() < tolerance


def test_a_hinge_across_a_turned_section_counts_from_its_zero() -> None:
    """The angle at the start is that from `zero`, whichever slope is read and whichever way it points."""
    for axis, normal in (((0.0, 0.0, 1.0), (0.0, 1.0, 0.0)), ((0.0, 0.0, -1.0), (0.0, 0.0, 1.0))):
        system = System()
        system.add(parts.Beam(length=1.0, section=SQUARE, material=MATERIAL, elements=1, normal=normal,
                              formulation="assumed_strain"), "beam")  # fmt: skip
        system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="beam.root", type="revolute", axis=axis), "pin")
        zero = (np.cos(0.3), -np.sin(0.3), 0.0)
        system.add(parts.JointSpring(a="ground", b="beam.root", axis=axis, zero=zero, stiffness=1.0), "spring")
        a = system.assemble()
        r = solved(solve_static(a))  # the spring turns it onto its zero
        tip = nodes(a, r)[-1, 0]
        assert np.abs(tip - np.array(zero)).max() < 1e-6


@pytest.mark.parametrize("angle", [0.0, 5.0, 20.0, 45.0])
@pytest.mark.parametrize("formulation", ["cable", "assumed_strain"])
def test_a_hinge_turns_about_one_axis_however_it_lies_in_the_section(formulation: str, angle: float) -> None:
    system = System()
    section, material = (
        Rectangle(thickness=0.02, width=0.02),
        Material(young_modulus=1e7, poisson_ratio=0.0, density=1000.0),
    )
    bar = parts.Beam(length=1.0, section=section, material=material, elements=4, formulation=formulation)
    system.add(bar, "bar")
    axis = (0.0, np.cos(np.radians(angle)), np.sin(np.radians(angle)))
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="bar.root", type="revolute", axis=axis))
    found = modes(system.assemble(), count=3).frequency
    assert found[0] == 0.0
    assert found[1:] == pytest.approx([2.04, 9.0], rel=0.03)


def resting(friction: float = 0.0, offset: float = 0.0, law: str = "hunt-crossley") -> Assembly:
    """A bar that rests on a cylinder with its hinged root at its top's height."""
    system = System(gravity=(0.0, -9.81, 0.0))
    material, section = (
        Material(young_modulus=1e7, poisson_ratio=0.0, density=1000.0),
        Rectangle(thickness=0.02, width=0.02),
    )
    bar = parts.Beam(
        length=1.0,
        section=section,
        material=material,
        elements=8,
        formulation="cable",
        position=(-1.0, 1.0, offset),
        mass_damping=10.0,
    )
    system.add(bar, "bar")
    system.add(parts.Joint(a=(-1.0, 1.0, offset), b="bar.root", type="revolute"))
    common = {"law": law, "stiffness": 1e4, "damping": 1.0, "points": 1, "friction": friction}
    system.add(parts.Contact(a="bar", b="ground", shape=parts.Cylinder(radius=1.0), **common))
    return system.assemble()


def test_statics_are_the_same_after_a_run() -> None:
    """Which leaves nothing of its steps in the assembly."""
    assembly = resting()
    before = solved(solve_static(assembly)).forces["contact_surfaces"]["normal"][-1, 0]
    first = solve_implicit(assembly, samples=[0.0, 0.1], step=5e-3, spectral_radius=0.3)
    assert solved(solve_static(assembly)).forces["contact_surfaces"]["normal"][-1, 0] == before
    again = solve_implicit(assembly, samples=[0.0, 0.1], step=5e-3, spectral_radius=0.3)
    assert np.array_equal(first.y, again.y)


def test_friction_in_statics_is_that_of_what_has_moved_from_the_start() -> None:
    """Nothing moves along the cylinder, wherever on it the bar lies."""
    found = [
        solved(solve_static(resting(0.3, z, "hunt-crossley"))).forces["contact_surfaces"]["force"][-1, 0]
        for z in (0.0, 0.3)
    ]
    assert np.abs(found[1][2]) < 1e-9
    assert found[1] == pytest.approx(found[0], abs=1e-9)
