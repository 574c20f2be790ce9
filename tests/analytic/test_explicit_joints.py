"""Joints that are constraints under explicit methods: accelerations, drives, releases."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from evolvent import InputError, System, elements, parts
from evolvent.assembly.builder import Assembly
from evolvent.equations import implicit
from evolvent.equations.rhs import rhs
from evolvent.families.joints import joint
from evolvent.kernels import constraint_rows, rigid
from evolvent.model import powers
from evolvent.solvers import solve

Array = np.ndarray
TYPES = ("revolute", "cylindrical", "prismatic", "spherical", "universal", "point-on-line", "in-plane", "clamp")
DOWN = (0.0, 0.0, -9.81)
AXIS = (0.6, 0.0, 0.8)


def linked(kind: str) -> System:
    """A turning wheel, a free body on it by a joint of a type, and a second one on that by a ball; masses on them."""
    found = System(gravity=DOWN)
    found.add(parts.RigidBody(motion="spin", inertia=0.4, axis=AXIS, rate=1.5), "wheel")
    for name, place in (("one", (0.5, 0.1, 0.0)), ("two", (1.4, 0.1, 0.2))):
        w = 1.5 * np.array(AXIS)
        moves = {"velocity": tuple(np.cross(w, place)), "angular_velocity": tuple(w)}
        found.add(parts.RigidBody(mass=2.0, inertia=(0.2, 0.3, 0.25), position=place, **moves), name)
    axes: dict[str, Any] = {} if kind in ("spherical", "clamp") else {"axis": (0.0, 0.8, 0.6)}
    if kind == "universal":
        axes["axis_b"] = (1.0, 0.0, 0.0)
    found.add(parts.Joint(a="wheel", b="one", type=kind, position=(0.5, 0.1, 0.0), **axes), "joint")
    found.add(parts.Joint(a="one", b="two", type="spherical", position=(1.0, 0.1, 0.1)), "ball")
    end = np.array([1.4, 0.1, -0.5])
    found.add(parts.Point(mass=0.3, position=tuple(end), velocity=tuple(np.cross(w, end))), "bob")
    found.add(parts.Joint(a="two", b="bob", type="distance"), "rod")
    return found


def driven() -> System:
    """A wheel that a drive turns carries a body on a pin; a mass is moved along a line."""
    found, rate = System(gravity=DOWN), 2.0
    found.add(parts.RigidBody(motion="spin", inertia=0.3), "wheel")
    found.add(parts.RigidBody(mass=1.0, inertia=(0.1, 0.1, 0.1), position=(1.0, 0.0, 0.0)), "load")
    found.add(parts.Joint(a="wheel", b="load", type="revolute", position=(0.5, 0.0, 0.0), axis=(0.0, 1.0, 0.0)), "pin")
    found.add(
        parts.Joint(a="ground", b="wheel", type="revolute", drive=parts.RampDrive(steps=[(0.0, 0.5, rate)]), until=0.6),
        "turn",
    )
    found.add(parts.Point(mass=0.4, position=(0.0, 0.0, 2.0)), "hand")
    drive = parts.RampDrive(steps=[(0.0, 0.5, 0.3)])
    found.add(parts.Joint(a="ground", b="hand", type="point-on-line", drive=drive, axis=(0.0, 0.6, 0.8)), "path")
    return found


def accelerations(assembly: Assembly, t: float, y: Array) -> tuple[Array, Array]:
    """Rates of the state by `rhs`, and the multipliers of the joints."""
    model, dy = assembly.model, np.zeros_like(y)
    rhs(t, y, assembly.s, model, dy)
    la, rows = np.zeros(model.joints.size), model.rows
    held = rows["kind"] == constraint_rows.CONSTRAINT
    la[rows["index"][held]] = model.la[held]
    return dy, la


def check_accelerations(assembly: Assembly, t: float, y: Array) -> None:
    """M a + F + G^T la = 0 of implicit methods holds, and no gap gets a second derivative."""
    model = assembly.model
    n_q, n_v, n_j = int(model.info.nq), int(model.info.nv), model.joints.size
    dy, la = accelerations(assembly, t, y)
    assert np.all(np.isfinite(dy))
    r, power, a = np.zeros(n_v + n_j), np.zeros(powers.N_POWERS), dy[n_q : n_q + n_v].copy()
    implicit.residual(t, y, a, la, 0.0, 1.0, model, r, power)
    assert np.abs(r[:n_v]).max() < 1e-11 * max(1.0, np.abs(la).max())
    h, rates = 1e-5, []
    for s in (h, -h):
        moved = y + s * dy
        rigid.kinematics(t + s, moved, model)
        for k in range(n_j):
            joint.joint_geometry(t + s, moved, k, model)
        rates.append(model.constraints["rate"].copy())
    assert np.abs(rates[0] - rates[1]).max() / (2.0 * h) < 1e-6 * np.abs(dy).max()


@pytest.mark.parametrize("kind", TYPES)
def test_accelerations_are_those_of_implicit_methods(kind: str) -> None:
    assembly = linked(kind).assemble()
    check_accelerations(assembly, 0.0, assembly.y)


def ribbed(kind: str, formulation: str) -> System:
    """A free body that turns, a beam on it by a joint of a type, a second beam on that one's tip, a mass on a link."""
    found, w = System(gravity=DOWN), np.array([0.3, -0.2, 0.8])
    found.add(parts.RigidBody(mass=2.0, inertia=(0.2, 0.3, 0.25), angular_velocity=tuple(w)), "craft")
    section = elements.Rectangle(thickness=0.02, width=0.03)
    material = elements.Material(young_modulus=2e6, poisson_ratio=0.3, density=1000.0)
    for name, x, length in (("rib", 0.3, 0.6), ("tip", 0.9, 0.4)):
        given: dict[str, Any] = {"section": section, "material": material, "elements": 2, "formulation": formulation}
        beam = parts.Beam(length=length, position=(x, 0.0, 0.0), **given)
        found.add(beam.model_copy(update={"rates": np.cross(w, beam.start_nodes())}), name)
    axes: dict[str, Any] = {"axis": (1.0, 0.0, 0.0)} if kind == "prismatic" else {}
    ends = ("craft", "rib.root") if formulation != "cable" or kind != "prismatic" else ("rib.root", "craft")
    found.add(parts.Joint(a=ends[0], b=ends[1], type=kind, **axes), "joint")
    found.add(parts.Joint(a="rib.tip", b="tip.root", type="spherical" if formulation == "cable" else "clamp"), "knee")
    bob = np.array([1.3, 0.0, -0.5])
    found.add(parts.Point(mass=0.3, position=tuple(bob), velocity=tuple(np.cross(w, bob))), "bob")
    found.add(parts.Joint(a="tip.tip", b="bob", type="distance"), "rod")
    return found


@pytest.mark.parametrize(
    ("kind", "formulation"),
    [("clamp", "cable"), ("spherical", "cable"), ("clamp", "full"), ("revolute", "full"), ("prismatic", "full")],
)
def test_accelerations_of_beams(kind: str, formulation: str) -> None:
    assembly = ribbed(kind, formulation).assemble()
    check_accelerations(assembly, 0.0, assembly.y)
    y = assembly.y.copy()  # rates that bend the beams and turn the joints
    n_q, n_v = int(assembly.model.info.nq), int(assembly.model.info.nv)
    y[n_q : n_q + n_v] += 0.1 * np.sin(np.arange(n_v))
    check_accelerations(assembly, 0.0, y)


@pytest.mark.parametrize("kinds", [("revolute", "revolute"), ("revolute", "prismatic"), ("prismatic", "prismatic")])
def test_accelerations_of_gears(kinds: tuple[str, str]) -> None:
    """A gear between joints on one free body, whatever its bodies do."""
    found = System(gravity=DOWN)
    for name, x in (("frame", 0.0), ("one", 0.5), ("two", -0.5)):
        found.add(parts.RigidBody(mass=2.0, inertia=(0.2, 0.3, 0.25), position=(x, 0.1, 0.2)), name)
    for name, kind in zip(("one", "two"), kinds, strict=True):
        found.add(parts.Joint(a="frame", b=name, type=kind, position=(0.2, 0.3, 0.1), axis=AXIS), f"{name}-joint")
    found.add(parts.Joint(a="one-joint", b="two-joint", type="gear", ratio=0.5), "gear")
    assembly = found.assemble()
    y, n_q, n_v = assembly.y.copy(), int(assembly.model.info.nq), int(assembly.model.info.nv)
    check_accelerations(assembly, 0.0, y)
    y[n_q : n_q + n_v] += np.sin(np.arange(n_v))
    check_accelerations(assembly, 0.0, y)


def test_accelerations_by_drives() -> None:
    assembly = driven().assemble()
    check_accelerations(assembly, 0.0, assembly.y)
    found = solve(assembly, samples=[0.0, 0.2], method="rk4", step=0.02)
    check_accelerations(assembly, 0.2, np.array(found.y[-1]))


@pytest.mark.slow
def test_a_drive_does_its_work() -> None:
    """A wheel that a drive turns carries a body that swings on a pin, until it is released."""
    assembly = driven().assemble()
    solution = solve(assembly, samples=np.linspace(0.0, 1.0, 11), method="dopri5", rtol=1e-9, atol=1e-11)
    assert solution.success, solution.message
    assert solution.y[6, 0] == pytest.approx(2.0 * 0.35, abs=1e-8)
    assert np.all(solution.la[solution.t >= 0.6, assembly.row_parts.index("turn")] == 0.0)
    lifted = 0.4 * 9.81 * 0.8 * 0.3 * 0.4  # weight of the hand along its path, times the way
    assert np.ptp(solution.balance.drives[6:]) == pytest.approx(lifted, rel=1e-6)
    assert np.abs(solution.energy_defect).max() < 1e-6 * np.ptp(solution.balance.kinetic)


@pytest.mark.slow
def test_a_released_pendulum() -> None:
    """Once it is released a mass flies off along a parabola."""
    found, length = System(gravity=DOWN), 1.2
    found.add(parts.Point(mass=0.7, position=(length, 0.0, 0.0)), "mass")
    found.add(parts.Joint(a=(0.0, 0.0, 0.0), b="mass", type="distance", until=0.5), "rod")
    times = np.linspace(0.0, 1.0, 21)
    solution = solve(found.assemble(), samples=times, method="rk4", step=2e-3)
    x, v = solution.y[:, :3], solution.y[:, 3:6]
    assert np.linalg.norm(x[times <= 0.5], axis=1) == pytest.approx(np.full(11, length), abs=1e-9)
    s = (times - 0.5)[times >= 0.5, None]
    assert x[times >= 0.5] == pytest.approx(x[10] + s * v[10] + 0.5 * s**2 * np.array(DOWN), abs=1e-10)
    energy = 0.35 * np.sum(v**2, axis=1) + 0.7 * 9.81 * x[:, 2]
    assert energy == pytest.approx(np.zeros(21), abs=1e-7)


def test_redundant_joints_are_refused_by_name() -> None:
    found = System()
    found.add(parts.RigidBody(mass=2.0, inertia=(0.2, 0.3, 0.25)), "door")
    for name, z in (("low", -0.5), ("high", 0.5)):
        found.add(parts.Joint(a="ground", b="door", type="revolute", position=(0.5, 0.0, z)), name)
    with pytest.raises(InputError, match="is redundant: the other constraints already imply it, which rk4"):
        solve(found.assemble(), samples=[0.0, 1.0], method="rk4", step=1e-3)
