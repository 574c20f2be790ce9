"""Strains, forces and moments along a beam, against statics."""

from __future__ import annotations

import numpy as np
import pytest

from evolvent import InputError, System, parts
from evolvent.elements import Material, Rectangle
from evolvent.solvers.static import solve_static
from static.composing import nodes, solved

THICK = Rectangle(thickness=0.02, width=0.03)
SOFT = Material(young_modulus=1e8, poisson_ratio=0.3, density=1000.0)


def held(
    formulation: str, count: int, load: tuple[float, float, float]
) -> tuple[parts.Beam, dict[str, np.ndarray], float]:
    """A clamped beam of 1 m under a dead load at its tip: its specification, what stands along it, and its energy."""
    system = System()
    spec = parts.Beam(length=1.0, section=THICK, material=SOFT, elements=count, formulation=formulation)
    system.add(spec, "beam")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="beam.root", type="clamp"))
    system.add(parts.Force(at="beam.tip", force=load))
    assembly = system.assemble()
    found = solved(solve_static(assembly))
    return spec, spec.along(nodes(assembly, found)), float(found.balance.elastic[-1])


@pytest.mark.parametrize(("formulation", "count"), [("cable", 8), ("cable_stretch", 8), ("assumed_strain", 32)])
def test_a_small_tip_load(formulation: str, count: int) -> None:
    """Moment F (L - x), tension N, and the energy's integral that of the solver."""
    _, along, stored = held(formulation, count, (0.003, 0.01, 0.0))
    assert along["arc"].shape == along["force"].shape == (2 * count,)
    assert along["force"] == pytest.approx(0.003, rel=0.03)
    assert along["strain"] == pytest.approx(0.003 / (1e8 * 6e-4), rel=0.03)
    wanted = 0.01 * (1.0 - along["arc"])
    assert np.abs(along["bend_y"]) == pytest.approx(wanted, abs=0.03 * 0.01)
    assert float(along["energy"].sum()) / (2 * count) == pytest.approx(stored, rel=2e-3)
    if formulation == "assumed_strain":
        assert np.abs(along["bend_z"]).max() < 1e-9
        assert np.abs(along["torque"]).max() < 1e-9


def test_a_beam_bends_across_its_width_too() -> None:
    _, along, _ = held("assumed_strain", 32, (0.0, 0.0, 0.01))
    assert np.abs(along["bend_z"]) == pytest.approx(0.01 * (1.0 - along["arc"]), abs=0.03 * 0.01)
    assert np.abs(along["bend_y"]).max() < 1e-9


def test_a_twisted_beam() -> None:
    """Nodes that turn evenly about the axis: torque G J a'."""
    spec = parts.Beam(length=1.0, section=THICK, material=SOFT, elements=4, formulation="assumed_strain")
    x, turn = spec.start_nodes(), np.linspace(0.0, 1e-3, 5)
    x[:, 2] = np.stack([0.0 * turn, np.cos(turn), np.sin(turn)], axis=1)
    x[:, 3] = np.stack([0.0 * turn, -np.sin(turn), np.cos(turn)], axis=1)
    G, J = SOFT.shear_modulus, THICK.properties(0.3).J
    assert np.abs(spec.along(x)["torque"]) == pytest.approx(G * J * 1e-3, rel=1e-5)


def test_rest_shapes_bear_nothing_and_series_keep_their_shape() -> None:
    angle = np.linspace(0.0, 1.0, 9)
    arc = np.zeros((9, 4, 3))
    arc[:, 0, 0], arc[:, 0, 1] = np.sin(angle), 1.0 - np.cos(angle)
    arc[:, 1, 0], arc[:, 1, 1] = np.cos(angle), np.sin(angle)
    arc[:, 2, 0], arc[:, 2, 1] = -np.sin(angle), np.cos(angle)
    arc[:, 3, 2] = 1.0
    spec = parts.Beam(
        length=1.0, section=THICK, material=SOFT, elements=8, formulation="assumed_strain", nodes=arc, rest="start"
    )
    along = spec.along(np.stack([arc, arc, arc]))
    assert along["force"].shape == (3, 16)
    assert all(np.abs(along[key]).max() < 1e-9 for key in ("force", "bend_y", "torque", "energy"))
    with pytest.raises(InputError, match="nodes has the shape"):
        spec.along(arc[:-1])
