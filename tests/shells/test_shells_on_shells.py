"""Contact of shells with shells and with themselves: nodes of each on smooth faces of the other."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from evolvent import InputError, System, parts
from shells.plates import material

METHODS = ("generalized-alpha", "energy-momentum")
G = 9.81
#: N, of `panel`.
WEIGHT = 0.4 * 0.3 * 0.01 * 1000.0 * G


def panel(**keys: Any) -> parts.Shell:
    """A panel of 10 mm."""
    given = {"size": (0.4, 0.3), "elements": (4, 3), "thickness": 0.01, "material": material(1e7, 0.3)}
    return parts.Shell(**(given | keys))


def collide(**law: Any) -> Any:
    """Two free panels that meet aslant, by steps of 1 ms that conserve energy."""
    system = System()
    system.add(panel(), "low")
    flight = {"velocity": (0.3, 0.1, -1.0), "angular_velocity": (0.5, 1.0, 0.3)}
    system.add(panel(position=(0.07, 0.05, 0.02), **flight), "high")
    system.add(parts.Contact(a="high", b="low", stiffness=2e4, law="conservative", **law), "hit")
    run = system.simulate(until=0.05, every=2e-3, method="energy-momentum", step=1e-3, spectral_radius=1.0)
    assert run.attrs["status"] == "success"
    assert float(run["hit"].normal_force.max()) > 10.0
    assert float(run["hit"].normal_force.values[-1]) == 0.0
    for name in ("momentum", "angular_momentum"):
        low, high = (np.asarray(run[own][name]) for own in ("low", "high"))
        whole = low + high
        assert np.abs(whole - whole[0]).max() < 1e-12 * np.linalg.norm(whole[0])
    return run


def test_panels_that_collide_keep_momenta_and_energy() -> None:
    """On faces that pass over to others, with the law conservative."""
    run = collide()
    assert float(np.abs(run.energy_defect).max()) < 1e-12 * float(run.energy.max())
    assert float(np.abs(run.energy - run.energy[0]).max()) < 1e-12 * float(run.energy[0])


def test_friction_takes_energy_and_no_momentum() -> None:
    run = collide(friction=0.3, bristle_stiffness=1e4)
    assert float(np.abs(run["hit"].point_friction).max()) > 0.1
    assert float(np.abs(run.energy_defect).max()) < 1e-12 * float(run.energy.max())
    assert float(run.energy[-1]) < 0.99 * float(run.energy[0])


@pytest.mark.parametrize(
    ("method", "keys"),
    [(METHODS[0], {"tolerance": 1e-4}), (METHODS[1], {"tolerance": 1e-4}), (METHODS[1], {"step": 0.02})],
    ids=["generalized-alpha", "energy-momentum", "steps longer than the gap"],
)
def test_a_fast_panel_does_not_pass(method: str, keys: Any) -> None:
    """Of 2 mm at 5 m/s, on another one that is free: at its end it is slower, on its side."""
    system = System()
    wall = {"size": (0.2, 0.2), "elements": (3, 3), "thickness": 2e-3, "material": material(1e9, 0.3)}
    system.add(panel(stiffness_damping=1e-5, **wall), "wall")
    flight = {"position": (0.01, 0.02, 0.05), "velocity": (0.0, 0.0, -5.0)}
    system.add(panel(stiffness_damping=1e-5, **flight, **wall), "fast")
    system.add(parts.Contact(a="fast", b="wall", stiffness=1e7, damping=0.1), "hit")
    run = system.simulate(until=0.02, every=0.01, method=method, fine=False, **keys)
    fast, struck = (run[name].position.values[-1, :, 2].mean() for name in ("fast", "wall"))
    assert fast > struck + 0.002
    assert run["fast"].momentum.values[-1, 2] > 1.01 * run["wall"].momentum.values[-1, 2]  # both are below 0


@pytest.mark.parametrize("elements", [(4, 3), (5, 4)], ids=["one mesh", "two meshes"])
def test_a_stack_carries_its_weights(elements: tuple[int, int]) -> None:
    """As deep as the weight over the stiffness; of two meshes, whose nodes do not meet, in the mean."""
    system = System(gravity=(0.0, 0.0, -G))
    system.add(panel(position=(0.0, 0.0, 0.0049)), "low")
    system.add(panel(position=(0.0, 0.0, 0.0147), elements=elements), "high")
    floor = {"shape": parts.Plane(normal=(0.0, 0.0, 1.0)), "stiffness": 2e4, "friction": 0.2}
    system.add(parts.Contact(a="low", b=(0, 0, 0), **floor), "floor")
    system.add(parts.Contact(a="high", b="low", stiffness=4e4, friction=0.2), "layers")
    run = system.equilibrium()
    assert run.attrs["status"] == "success"
    np.testing.assert_allclose(run["layers"].force.values[-1], [0.0, 0.0, WEIGHT], atol=1e-6 * WEIGHT)
    assert run["floor"].normal_force.values[-1] == pytest.approx(2.0 * WEIGHT, rel=1e-9)
    depth = run["low"].position.values[-1][:, 2].mean() + 0.01 - run["high"].position.values[-1][:, 2].mean()
    assert depth == pytest.approx(WEIGHT / 4e4, rel=1e-9 if elements == (4, 3) else 0.05)


@pytest.mark.parametrize("method", METHODS)
def test_a_panel_that_slides_on_another_slows_down(method: str) -> None:
    """By mu g; the lower one stands still."""
    system = System(gravity=(0.0, 0.0, -G))
    system.add(panel(size=(0.8, 0.5), elements=(6, 4), clamped=["x0", "x1"], material=material(1e10, 0.3)), "low")
    sag = WEIGHT / 2e4 / 1.125  # 9 nodes of the lower one carry it as well
    start = {"position": (0.1, 0.1, 0.01 - sag), "velocity": (1.0, 0.0, 0.0)}
    system.add(panel(stiffness_damping=1e-3, **start), "high")
    law = {"stiffness": 2e4, "damping": 2.0, "friction": 0.3, "bristle_stiffness": 1e5, "initial_overlap": 1.0}
    system.add(parts.Contact(a="high", b="low", **law), "layers")
    run = system.simulate(until=0.1, every=0.02, method=method, tolerance=1e-5)
    impulse = run["layers"].impulse.values[-1]
    mass = WEIGHT / G
    lost = mass * (1.0 - run["high"].velocity.values[-1, :, 0].mean())
    assert lost == pytest.approx(0.3 * impulse, rel=1e-2)
    assert impulse == pytest.approx(WEIGHT * 0.1, rel=0.02)
    assert float(np.abs(run.energy_defect).max()) < 1e-4 * float(run.energy.values[0])


def spiral(turns: float, pitch: float, radius: float, n: int, width: float) -> tuple[Any, Any, float]:
    """Nodes and normals of a strip wound on itself, and its length."""
    angles = np.linspace(0.0, 2.0 * math.pi * turns, n + 1)
    r = radius + pitch * angles / (2.0 * math.pi)
    line = np.stack([r * np.sin(angles), 0.0 * r, -r * np.cos(angles)], axis=-1)
    slope = np.stack([np.cos(angles), 0.0 * r, np.sin(angles)], axis=-1) * r[:, None]
    slope += pitch / (2.0 * math.pi) * np.stack([np.sin(angles), 0.0 * r, -np.cos(angles)], axis=-1)
    slope /= np.linalg.norm(slope, axis=1, keepdims=True)
    normals = np.cross(slope, [0.0, 1.0, 0.0])
    nodes = np.stack([line + np.array([0.0, y, 0.0]) for y in (0.0, width)], axis=1)
    length = float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())
    return nodes, np.stack([normals] * 2, axis=1), length


def test_turns_of_a_strip_lie_on_one_another() -> None:
    """Wound closer than it is thick, its turns are a thickness apart, but where its ends bend."""
    thick, n = 1e-3, 48
    nodes, normals, _ = spiral(2.25, 0.9 * thick, 0.05, n, 0.02)
    strip = parts.Shell(
        nodes=nodes.tolist(), normals=normals.tolist(), elements=(n, 1), thickness=thick, material=material(1e9),
        clamped=["x0"],
    )  # fmt: skip
    system = System()
    system.add(strip, "strip")
    system.add(parts.Contact(a="strip", b="strip", stiffness=1e5, initial_overlap=0.5, apart=0.05), "coil")
    run = system.equilibrium()
    assert run.attrs["status"] == "success"
    assert int(run["coil"].points.values[-1]) > 10
    line = run["strip"].position.values[-1].reshape(n + 1, 2, 3)[:, 0]
    angle = np.unwrap(np.arctan2(line[:, 0], -line[:, 2]))
    course = CubicSpline(angle, np.hypot(line[:, 0], line[:, 2]))
    inner = angle[angle + 2.0 * math.pi < angle[-1]]
    apart = course(inner + 2.0 * math.pi) - course(inner)
    assert np.abs(apart[6:-6] / thick - 1.0).max() < 0.01
    assert 0.99 < (apart / thick).min() <= (apart / thick).max() < 1.03


def test_a_body_on_a_shell_is_refused() -> None:
    system = System()
    system.add(parts.Shell(size=(1.0, 1.0), elements=(1, 1), thickness=0.01, material="steel"), "panel")
    system.add(parts.RigidBody(mass=1.0, inertia=(1.0, 1.0, 1.0), shape={"sphere": 0.1}), "ball")
    system.add(parts.Contact(a="ball", b="panel", stiffness=1e4), "touch")
    with pytest.raises(InputError, match=r"touch\.b is the shell 'panel', which 'ball' cannot touch; give the"):
        system.assemble()
