"""Strains, forces and moments along a beam, against statics."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from evolvent import System, parts
from evolvent.elements import Material, Rectangle
from evolvent.families.beams.beam_strains import POINTS
from evolvent.solvers.static.static import solve_static
from static.composing import sections, solved

THICK = Rectangle(thickness=0.02, width=0.03)
SOFT = Material(young_modulus=1e8, poisson_ratio=0.3, density=1000.0)


def held(formulation: str, count: int, load: tuple[float, float, float]) -> tuple[Any, float]:
    """A clamped beam of 1 m under a dead load at its tip: what its elements carry, and its energy."""
    system = System()
    spec = parts.Beam(length=1.0, section=THICK, material=SOFT, elements=count, formulation=formulation)
    system.add(spec, "beam")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="beam.root", type="clamp"))
    system.add(parts.Load(at="beam.tip", force=load))
    assembly = system.assemble()
    found = solved(solve_static(assembly))
    return sections(assembly, found), float(found.balance.elastic[-1])


def places(count: int) -> np.ndarray:
    """Lengths from the root to the two points of each of `count` elements of a beam of 1 m."""
    return (np.arange(count)[:, None] + np.array(POINTS[:2])) / count


def middles(count: int) -> np.ndarray:
    """Lengths from the root to the middles."""
    return (np.arange(count) + 0.5) / count


@pytest.mark.parametrize(("formulation", "count"), [("cable", 8), ("cable_stretch", 8), ("assumed_strain", 32)])
def test_a_small_tip_load(formulation: str, count: int) -> None:
    """Moment F (L - x), tension N, and the energy's integral that of the solver."""
    along, stored = held(formulation, count, (0.003, 0.01, 0.0))
    assert along["axial_force"] == pytest.approx(np.full((count, 2), 0.003), rel=0.03)
    assert along["strain"] == pytest.approx(np.full((count, 2), 0.003 / (1e8 * 6e-4)), rel=0.03)
    assert float(along["energy_density"].sum()) / (2 * count) == pytest.approx(stored, rel=2e-3)
    if formulation == "assumed_strain":
        assert np.abs(along["bending_moment_z"]) == pytest.approx(0.01 * (1.0 - middles(count)), abs=0.03 * 0.01)
        assert np.abs(along["bending_moment_y"]).max() < 1e-9
        assert np.abs(along["torsional_moment"]).max() < 1e-9
    else:
        assert along["bending_moment"] == pytest.approx(0.01 * (1.0 - places(count)), abs=0.03 * 0.01)


def test_a_beam_bends_across_its_width_too() -> None:
    along, _ = held("assumed_strain", 32, (0.0, 0.0, 0.01))
    assert np.abs(along["bending_moment_y"]) == pytest.approx(0.01 * (1.0 - middles(32)), abs=0.03 * 0.01)
    assert np.abs(along["bending_moment_z"]).max() < 1e-9


def test_a_twisted_beam() -> None:
    """Nodes that turn evenly about the axis: torque G J a'."""
    spec = parts.Beam(length=1.0, section=THICK, material=SOFT, elements=4, formulation="assumed_strain")
    x, turn = spec.start_nodes(), np.linspace(0.0, 1e-3, 5)
    x[:, 2] = np.stack([0.0 * turn, np.cos(turn), np.sin(turn)], axis=1)
    x[:, 3] = np.stack([0.0 * turn, -np.sin(turn), np.cos(turn)], axis=1)
    system = System()
    system.add(spec, "beam")
    assembly = system.assemble()
    y = assembly.y.copy()
    y[: x.size] = x.ravel()
    G, J = SOFT.shear_modulus, THICK.properties(0.3).J
    assert np.abs(sections(assembly, y)["torsional_moment"]) == pytest.approx(np.full(4, G * J * 1e-3), rel=1e-5)


@pytest.mark.parametrize("formulation", ["assumed_strain", "cable", "cable_stretch"])
def test_rest_shapes_bear_nothing(formulation: str) -> None:
    """But for the bending moment of a cable, whose curvature is never without stress."""
    angle = np.linspace(0.0, 1.0, 9)
    arc = np.zeros((9, 4, 3))
    arc[:, 0, 0], arc[:, 0, 1] = np.sin(angle), 1.0 - np.cos(angle)
    arc[:, 1, 0], arc[:, 1, 1] = np.cos(angle), np.sin(angle)
    arc[:, 2, 0], arc[:, 2, 1] = -np.sin(angle), np.cos(angle)
    arc[:, 3, 2] = 1.0
    nodes = arc if formulation == "assumed_strain" else arc[:, :2]
    system = System()
    given: dict[str, Any] = {"nodes": nodes, "rest": "start", "formulation": formulation}
    system.add(parts.Beam(length=1.0, section=THICK, material=SOFT, elements=8, **given), "beam")
    assembly = system.assemble()
    along = sections(assembly, assembly.y)
    assert np.abs(along["strain"]).max() < 1e-12
    if formulation == "assumed_strain":
        for key in ("axial_force", "bending_moment_y", "bending_moment_z", "torsional_moment", "energy_density"):
            assert np.abs(along[key]).max() < 1e-9
    else:
        assert along["bending_moment"] == pytest.approx(1e8 * THICK.properties(0.3).Iz, rel=1e-3)
