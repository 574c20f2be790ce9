"""Reactions at clamped edges and in seams: they balance all loads, about any point."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import evolvent
from evolvent import System, parts
from shells.plates import material

Array = np.ndarray
WALL: Any = {"thickness": 0.004, "material": material(5e9, 0.3)}
PUSH, PRESSURE, WEIGHT = np.array([0.3, 0.1, 0.02]), 3.0, 9.81 * 4.0  # N, Pa, Pa
GRAVITY = (0.0, 0.0, -9.81)


def moment(arms: Any, forces: Any) -> Array:
    """Moment of forces about the origin."""
    return np.asarray(np.cross(arms, forces)).reshape(-1, 3).sum(axis=0)


def test_edges_that_are_clamped(tmp_path: Any) -> None:
    """Two edges with a common corner: force and moment of the weight, of a pressure that follows and of a force."""
    shell = parts.Shell(size=(0.5, 0.3), elements=(4, 3), clamped=("x0", "y0"), **WALL)
    system = System(gravity=GRAVITY)
    system.add(shell, "panel")
    system.add(parts.Load(at="panel[19]", force=tuple(PUSH)), "push")
    system.add(parts.Load(over="panel", force=(0.0, 0.0, PRESSURE), frame="body"), "pressure")
    run = system.equilibrium()
    found, spread = run["panel"], shell.spread("panel", None)
    x, normal = (found[key].values[-1] for key in ("position", "normal"))
    loads = spread.shares[:, None] * (PRESSURE * normal - np.array([0.0, 0.0, WEIGHT]))
    loads[19] += PUSH
    force, torque = (found[f"reaction_{key}"].values[-1] for key in ("force", "moment"))
    assert force.sum(axis=0) == pytest.approx(-loads.sum(axis=0), abs=1e-9)
    middles = [x[shell.edge(edge)].mean(axis=0) for edge in ("x0", "y0")]
    assert torque.sum(axis=0) + moment(middles, force) == pytest.approx(-moment(x, loads), abs=1e-9)
    assert found["reaction_force"].attrs["units"] == "N"
    assert found["reaction_moment"].attrs["units"] == "N m"
    evolvent.save(run, tmp_path / "run.nc")
    kept = evolvent.open(tmp_path / "run.nc")["panel"]
    assert list(kept["clamped_edge"].values) == ["x0", "y0"]
    assert kept["reaction_force"].values == pytest.approx(found["reaction_force"].values)


def test_reactions_in_motion() -> None:
    """The change of the momentum is that by weight and reactions; between the samples Simpson's rule."""
    system = System(gravity=GRAVITY)
    system.add(parts.Shell(size=(0.5, 0.3), elements=(2, 1), clamped=("x0",), **WALL), "panel")
    run = system.simulate(until=0.02, every=0.001, step=0.001, method="generalized-alpha")
    force, p = (run["panel"][key].values for key in ("reaction_force", "momentum"))
    rate = force[:, 0, 2] - WEIGHT * 0.15  # the nodes that are clamped weigh on the edge, too
    change = 0.001 * (0.5 * (rate[1:] + rate[:-1])).sum()
    assert change == pytest.approx(p[-1, 2] - p[0, 2], abs=0.02 * np.abs(p[:, 2]).max())


@pytest.mark.parametrize("ground", [False, True])
def test_seam_as_a_whole(ground: bool) -> None:
    """Force and moment on b, its angle and the torque of its springs, by the balance of the outer panel."""
    system, k = System(), 2.0
    if not ground:
        system.add(parts.Shell(size=(0.5, 0.3), elements=(2, 3), position=(-0.5, 0, 0), clamped=("x0",), **WALL), "one")
    system.add(parts.Shell(size=(0.5, 0.3), elements=(2, 3), **WALL), "two")
    edges: Any = {"a": "two.x0"} if ground else {"a": "one.x1", "b": "two.x0"}
    system.add(parts.Seam(**edges, stiffness=k), "fold")
    system.add(parts.Load(at="two[11]", force=tuple(PUSH)), "push")
    run = system.equilibrium()
    found, sign = run["fold"], 1.0 if ground else -1.0  # on the ground, or on the panel that is pushed
    middle, angle = found["position"].values[-1], float(found["angle"].values[-1])
    assert found["force"].values[-1] == pytest.approx(sign * PUSH, abs=1e-7)
    assert found["node_force"].values[-1].sum(axis=0) == pytest.approx(sign * PUSH, abs=1e-7)
    whole = moment(run["two"]["position"].values[-1, 11] - middle, sign * PUSH)
    torque = float(found["torque"].values[-1])
    assert torque == pytest.approx(0.3 * k * angle, rel=1e-9)
    held = found["moment"].values[-1]
    assert held[[0, 2]] == pytest.approx(whole[[0, 2]], rel=2e-3)
    assert held[1] - torque == pytest.approx(whole[1], rel=2e-3)
    assert 0.0 <= float(found["angle_range"].values[-1]) < 0.1 * abs(angle)
    assert {"fold 0", "fold 3", "fold spring 3"} <= set(run.children)
