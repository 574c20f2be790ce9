"""Clearances of shells: facets and thickness against closed forms, and how fast they may come near."""

from __future__ import annotations

from typing import Any

import pytest

from evolvent import System, parts
from shells.plates import material

WALL: Any = {"thickness": 0.01, "material": material(1e9)}
pytest.importorskip("coal")


def beside(*others: Any, **keys: Any) -> Any:
    """Clearances at rest of a square panel of 1 m in z = 0 and others."""
    system = System()
    system.add(parts.Shell(size=(1.0, 1.0), elements=(3, 2), **WALL), "panel")
    for k, other in enumerate(others):
        system.add(other, f"other {k}")
    run = system.simulate(until=1e-3, every=1e-3, step=1e-3, method="energy-momentum", **keys)
    return run.ev.clearance()


@pytest.mark.parametrize(("height", "wanted"), [(0.5, 0.395), (0.12, 0.015), (0.08, -0.025), (0.0, -0.105)])
def test_ball_at_the_middle_of_a_facet(height: float, wanted: float) -> None:
    """Between nodes: height less radius and half the thickness; inside, the shortest way out of one facet."""
    ball = parts.RigidBody(mass=1.0, shape={"sphere": {"radius": 0.1}}, position=(0.5, 0.3, height))
    found = beside(ball).dataset
    assert found.clearance.values[0] == pytest.approx([wanted], abs=1e-5)
    assert (found.exact.values[0] == 1).all()


def test_two_shells() -> None:
    """Parallel ones by their distance less the thickness; joined ones are no pair; a seam joins as a joint does."""
    turned = parts.Shell(size=(1.0, 1.0), elements=(2, 2), position=(0.3, 0.2, 0.25), **WALL)
    found = beside(turned).dataset
    assert float(found.smallest[0]) == pytest.approx(0.24, abs=1e-9)
    system = System()
    system.add(parts.Shell(size=(0.5, 1.0), elements=(1, 2), **WALL), "one")
    system.add(parts.Shell(size=(0.5, 1.0), elements=(1, 2), position=(0.5, 0.0, 0.0), **WALL), "two")
    system.add(parts.RigidBody(mass=1.0, shape={"box": (0.1, 0.1, 0.1)}, position=(0.5, 0.5, 1.0)), "box")
    system.add(parts.Seam(a="one.x1", b="two.x0"), "fold")
    run = system.simulate(until=1e-3, every=1e-3, step=1e-3, method="energy-momentum")
    answer = run.ev.clearance()
    assert list(answer.dataset.pair.values) == ["one - two", "one - box", "two - box"][1:]
    assert "'one' and 'two', held by 'fold'" in " ".join(answer.notes())
    assert answer.dataset.smallest.values == pytest.approx([0.945, 0.945], abs=1e-9)


def test_panel_that_turns_into_a_box() -> None:
    """A panel that spins about x0: its edge reaches a box at a known time, and lies between the samples' bounds."""
    w, system = 2.0, System()
    shell = parts.Shell(size=(1.0, 0.4), elements=(4, 2), angular_velocity=(0.0, -w, 0.0), **WALL)
    system.add(shell, "panel")
    system.add(parts.RigidBody(mass=1.0, shape={"box": (0.2, 0.2, 0.2)}, position=(0.9, 0.2, 0.5)), "box")
    run = system.simulate(until=0.3, every=0.01, step=0.01, method="energy-momentum")
    found = run.ev.clearance().dataset
    d, x = found.clearance.values[:, 0], run["panel"]["position"].values.reshape(-1, 5, 3, 3)
    exact = found.exact.values[:, 0] == 1
    drop = 0.4 - x[:, -1, :, 2].max(axis=1)  # of the edge below the box, while it is the nearest
    first = exact & (d > 0.0) & (x[:, -1, 0, 0] > 0.8)
    assert first.any()
    assert d[first] == pytest.approx(drop[first] - 0.005, abs=0.005)
    assert len(found.start) == 1
    assert float(found.least_between[0]) <= float(found.smallest[0])
