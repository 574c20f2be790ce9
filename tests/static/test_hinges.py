"""Hinges with springs at the root of beams: the angle is that of the section, not of the axis."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from evolvent import System, parts
from evolvent.builder import Assembly
from evolvent.elements import Material, Rectangle
from evolvent.solvers.modes import modes
from evolvent.solvers.static import solve_static
from static.composing import beam, nodes, solved

SQUARE = Rectangle(thickness=0.02, width=0.02)
MATERIAL = Material(E=2e11, nu=0.0, density=7800.0)
EI = 2e11 * 0.02**4 / 12.0


def sprung(count: int, stiffness: float, *, formulation: str = "assumed_strain", moment: float = 0.0) -> Assembly:
    """A bar of 1 m on a hinge about z with a spring, and a couple about z at its tip."""

    def more(system: System) -> None:
        system.add(parts.Hinge(body="ground", beam=("beam", "root"), stiffness=stiffness), "spring")
        if moment:
            system.add(parts.PointLoad(node=("beam", "tip"), on=2, force=(-moment, 0.0, 0.0)), "moment")

    return beam(formulation, count, ("hinge",), section=SQUARE, material=MATERIAL, more=more)


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
        system.add(parts.Joint(a=(0.0, 0.0, 0.0), b=("beam", "root"), kind="hinge", axis=axis), "pin")
        zero = (np.cos(0.3), -np.sin(0.3), 0.0)
        system.add(parts.Hinge(body="ground", beam=("beam", "root"), axis=axis, zero=zero, stiffness=1.0), "spring")
        a = system.assemble()
        r = solved(solve_static(a))  # the spring turns it onto its zero
        tip = nodes(a, r)[-1, 0]
        assert np.abs(tip - np.array(zero)).max() < 1e-6
