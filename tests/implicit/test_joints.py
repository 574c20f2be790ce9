"""Joints, driven places, releases and hinges of the implicit engine."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from book import Book
from evolvent import InputError, System, elements, parts
from evolvent.assembly.assembled import Assembly
from evolvent.solvers.time.implicit.plan import rows_of_part, solve_implicit
from implicit.rigs import RUBBER, SQUARE, coordinates, run

Array = np.ndarray
STEEL = elements.Material(young_modulus=2e12, poisson_ratio=0.0, density=1000.0)


def turned(axis: Array, angle: float) -> Array:
    """Quaternion of a turn."""
    axis = axis / np.linalg.norm(axis)
    return np.array([math.cos(0.5 * angle), *(math.sin(0.5 * angle) * axis)])


def matrix(q: Array) -> Array:
    w, x, y, z = q
    u = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + 2.0 * w * u + 2.0 * u @ u


@pytest.mark.parametrize("formulation", ["cable", "assumed_strain"])
@pytest.mark.parametrize("kind", ["spherical", "revolute", "clamp"])
def test_a_beam_on_a_free_body_at_any_place_and_angle(formulation: str, kind: str, rng: np.random.Generator) -> None:
    """What the joint holds at the start it holds for good, as seen from the body."""
    q = rng.standard_normal(4)
    q /= np.linalg.norm(q)
    R, place, x = matrix(q), np.array([0.3, -0.2, 0.1]), np.array([0.5, 0.4, -0.3])
    d = R @ np.array([0.48, 0.6, 0.64])
    n = R @ np.array([0.8, 0.0, -0.6])
    w = np.array([0.7, -0.9, 0.5])  # body axes
    nodes = np.zeros((3, 2 if formulation == "cable" else 4, 3))
    nodes[:, 0] = x + R @ place + np.outer([0.0, 0.5, 1.0], d)
    nodes[:, 1] = d
    if formulation != "cable":
        nodes[:, 2], nodes[:, 3] = n, np.cross(d, n)
    rates = np.cross(R @ w, nodes - np.eye(nodes.shape[1])[0][:, None] * x)
    system = System(gravity=(0.0, 0.0, -9.81))
    system.add(
        parts.RigidBody(mass=3.0, inertia=(0.2, 0.3, 0.4), position=x, orientation=tuple(q), angular_velocity=w), "body"
    )
    beam = parts.Beam(
        length=1.0, section=SQUARE, material=RUBBER, elements=2, formulation=formulation, nodes=nodes, rates=rates
    )
    system.add(beam, "beam")
    axis = R @ np.array([0.8, 0.0, -0.6])
    system.add(parts.Joint(a=("body", tuple(place)), b="beam.root", type=kind, axis=axis), "joint")
    assembly = system.assemble()
    solution = run(assembly, np.linspace(0.0, 0.5, 6), step=1e-3)
    root = coordinates(assembly, solution.y, "beam")[:, 0]
    pose = coordinates(assembly, solution.y, "body")
    for k in range(6):
        Rk = matrix(pose[k, 3:])
        assert np.abs(pose[k, :3] + Rk @ place - root[k, 0]).max() < 1e-10
        seen, before = root[k, 1:] @ Rk, root[0, 1:] @ R
        if kind == "clamp" and formulation == "cable":
            assert np.abs(np.cross(seen[0], before[0])).max() < 1e-9  # direction, whatever its length
        elif kind == "clamp":  # of the section, which does not twist
            assert np.abs(seen[1:] @ before[0]).max() < 1e-9
            assert abs(seen[1] @ np.cross(before[0], before[1])) < 1e-9
        elif kind == "revolute" and formulation == "cable":
            assert abs(seen[0] @ np.array([0.8, 0.0, -0.6]) - before[0] @ np.array([0.8, 0.0, -0.6])) < 1e-9
        elif kind == "revolute":  # about the section's own normal
            assert np.abs(np.cross(seen[1], before[1])).max() < 1e-9
    if kind != "clamp":  # it does move
        assert np.abs(root[-1, 1] @ matrix(pose[-1, 3:]) - root[0, 1] @ R).max() > 5e-3
    # another solution: the same with stiff penalties
    fields: dict[str, Any] = {"a": ("body", tuple(place)), "b": "beam.root", "type": kind, "axis": axis}
    errors = []
    for stiffness in (1e5, 1e6):
        again = System(gravity=(0.0, 0.0, -9.81))
        again.add(system._parts["body"], "body")
        again.add(beam, "beam")
        again.add(parts.Joint(**fields, stiffness=stiffness, damping=30.0), "joint")
        found = run(again.assemble(), np.linspace(0.0, 0.5, 6), step=1e-3)
        errors.append(np.abs(coordinates(assembly, found.y, "beam") - coordinates(assembly, solution.y, "beam")).max())
    assert errors[1] < 2e-4
    assert 5.0 < errors[0] / errors[1] < 20.0


def test_hinge_between_bodies_is_a_pendulum(book: Book) -> None:
    """A body hinged to the ground about a tilted axis; phi'' = -m g r sin(phi) sin(tilt) / I."""
    tilt = 0.7
    axis = np.array([0.0, math.sin(tilt), math.cos(tilt)])
    arm = np.array([0.4, 0.0, 0.0])
    system = System(gravity=(0.0, 0.0, -9.81))
    system.add(parts.RigidBody(mass=2.0, inertia=(0.1, 0.2, 0.15), position=arm), "body")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b=("body", tuple(-arm)), type="revolute", axis=axis))
    assembly = system.assemble()
    inertia = axis @ (np.diag([0.1, 0.2, 0.15]) + 2.0 * (0.16 * np.eye(3) - np.outer(arm, arm))) @ axis

    def rates(t: float, s: Array) -> list[float]:
        R = matrix(turned(axis, s[0]))
        return [s[1], axis @ np.cross(R @ arm, [0.0, 0.0, -2.0 * 9.81]) / inertia]

    times = np.linspace(0.0, 1.0, 6)
    phi = solve_ivp(rates, (0.0, 1.0), [0.0, 0.0], "DOP853", times, rtol=1e-12, atol=1e-12).y[0]
    found = coordinates(assembly, run(assembly, times, step=5e-4, spectral_radius=0.9).y, "body")
    expected = np.array([matrix(turned(axis, p)) @ arm for p in phi])
    assert np.abs(found[:, :3] - expected).max() < 1e-5
    book(
        "Rigid bodies", "Body on a tilted hinge for 1 s (generalized-alpha, 0.5 ms)", reference="equation of one angle",
        source="SciPy DOP853, 1e-12", error=np.abs(found[:, :3] - expected).max(), allowed=1e-5, unit="m",
    )  # fmt: skip


def ring(**fields: Any) -> parts.RampDrive:
    return parts.RampDrive(steps=((0.0, 0.5, 2.0), (0.8, 0.2, 0.0)), **fields)


def closes(assembly: Assembly, *, least: float, steps: tuple[float, ...] = (1e-3, 5e-4), until: float = 1.0) -> Array:
    """The work of drives of a run whose account closes with second order; returns the last sample's state."""
    gained, y = [], None
    for h in steps:
        solution = run(assembly, np.linspace(0.0, until, 6), step=h, spectral_radius=0.9)
        assert np.abs(solution.balance.drives).max() > least
        gained.append(float(np.abs(solution.energy_defect).max()))
        y = solution.y
    assert gained[-1] < 1e-2 * least
    assert gained[0] / gained[1] > 3.2
    return y


def test_a_turned_hub_does_the_work_that_its_rib_gains() -> None:
    system = System()
    system.add(parts.RigidBody(motion="spin", inertia=0.4), "hub")
    system.add(parts.Joint(a="ground", b="hub", type="revolute", drive=ring()), "motor")
    system.add(
        parts.Beam(
            length=1.0, section=SQUARE, material=RUBBER, elements=4, formulation="cable", position=(0.3, 0.0, 0.0)
        ),
        "rib",
    )
    system.add(parts.Joint(a=("hub", (0.3, 0.0, 0.0)), b="rib.root", type="clamp"))
    assembly = system.assemble()
    y = closes(assembly, least=1.0)
    angle = coordinates(assembly, y, "hub")[:, 0]
    assert angle[-1] == pytest.approx(0.5 + 0.6 + 0.2, abs=1e-9)


def test_a_carried_point_follows_its_line_and_its_involute() -> None:
    """A mass on a spring behind a point that is carried; the involute keeps its tail tangent to the circle."""
    for involute in (False, True):
        system = System()
        start = (0.2, 1.0, 0.0) if involute else (0.1, 0.0, 0.0)
        system.add(parts.Point(mass=0.5, position=start), "hand")
        system.add(parts.Point(mass=2.0, position=(0.6, 0.2, 0.3)), "load")
        system.add(parts.Spring(a="hand", b="load", stiffness=30.0))
        if involute:
            carry = parts.Joint(a=(0.0, 0.0, 0.0), b="hand", type="involute", drive=ring(), drum=0.2, length=1.0)
        else:
            carry = parts.Joint(a="ground", b="hand", type="point-on-line", drive=ring(), axis=(1.0, 1.0, 0.0))
        system.add(carry, "carry")
        assembly = system.assemble()
        hand = coordinates(assembly, closes(assembly, least=0.5), "hand")
        phi = 1.3
        if involute:
            n, t = np.array([math.cos(phi), math.sin(phi), 0.0]), np.array([-math.sin(phi), math.cos(phi), 0.0])
            assert np.abs(hand[-1] - (0.2 * n + (1.0 - 0.2 * phi) * t)).max() < 1e-9
        else:
            assert np.abs(hand[-1] - [0.1 + phi / math.sqrt(2.0), phi / math.sqrt(2.0), 0.0]).max() < 1e-9


def test_a_driven_body_does_the_work_that_its_rib_gains() -> None:
    system = System()
    system.add(parts.RigidBody(motion="driven", rate=3.0), "hub")
    nodes = np.zeros((5, 2, 3))
    nodes[:, 0, 0] = 0.3 + np.linspace(0.0, 1.0, 5)
    nodes[:, 1, 0] = 1.0
    rates = np.cross([0.0, 0.0, 3.0], nodes)
    rates[1:] *= 0.5
    rib = parts.Beam(
        length=1.0, section=SQUARE, material=RUBBER, elements=4, formulation="cable", nodes=nodes, rates=rates
    )
    system.add(rib, "rib")
    system.add(parts.Joint(a=("hub", (0.3, 0.0, 0.0)), b="rib.root", type="spherical"))
    closes(system.assemble(), least=0.3, steps=(5e-4, 2.5e-4))


@pytest.mark.parametrize("options", [{"step": 1e-3}, {"tolerance": 1e-5}, {"step": 0.7e-3}])
def test_release_is_on_time(options: dict[str, float], book: Book) -> None:
    """A pendulum that is let go flies off along the parabola of that very instant."""
    system = System(gravity=(0.0, -9.81, 0.0))
    system.add(parts.Point(mass=1.0, position=(1.0, 0.0, 0.0)), "bob")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="bob", type="distance", until=0.4321), "rod")
    assembly = system.assemble()
    solution = run(assembly, [0.0, 0.4321, 0.6, 0.8, 1.0], spectral_radius=0.9, **options)
    x, v = solution.y[1, :3], solution.y[1, 3:6]
    t = (solution.t[2:] - 0.4321)[:, None]
    expected = x + v * t + 0.5 * np.array([0.0, -9.81, 0.0]) * t**2
    assert np.abs(solution.y[2:, :3] - expected).max() < 1e-7
    assert np.linalg.norm(x) == pytest.approx(1.0, abs=1e-8)
    assert np.abs(solution.la[2:]).max() == 0.0
    value = next(iter(options.values()))
    book(
        "Rigid bodies", f"Pendulum released: ballistic flight (generalized-alpha, {', '.join(options)} {value:g})",
        reference="parabola from the instant of release", source="closed form",
        error=np.abs(solution.y[2:, :3] - expected).max(), allowed=1e-7, unit="m",
    )  # fmt: skip


def test_a_load_that_begins_and_ends_has_the_impulse_of_its_time() -> None:
    """Were it felt half a step early or late, the velocity would be off by h/2 times its acceleration."""
    system = System()
    system.add(parts.Beam(length=1.0, section=SQUARE, material=STEEL, elements=2, formulation="cable"), "beam")
    for node in ("beam.root", "beam[1]", "beam.tip"):
        share = 0.25 if node != "beam[1]" else 0.5
        system.add(parts.Load(at=node, force=(share * 0.4, 0.0, 0.0), start=0.123, until=0.456))
    assembly = system.assemble()
    solution = run(assembly, [0.0, 0.2, 0.6], step=0.01, spectral_radius=0.0)
    from implicit.rigs import momenta

    found = momenta(assembly, solution)[:, 0]
    assert np.abs(found - 0.4 * np.array([0.0, 0.2 - 0.123, 0.456 - 0.123])).max() < 1e-8


def oscillator(**hinge: Any) -> Assembly:
    """A stiff short rib hinged to the ground with a spring about z."""
    system = System()
    system.add(
        parts.Beam(
            length=1.0, section=SQUARE, material=STEEL, elements=1, formulation="cable", rates=hinge.pop("rates", None)
        ),
        "rib",
    )
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="rib.root", type="revolute"), "pin")
    system.add(parts.JointSpring(a="ground", b="rib.root", **hinge), "hinge")
    return system.assemble()


INERTIA = 1000.0 * 4e-4 / 3.0  # of the rib about its root


def spun(rate: float) -> Array:
    nodes = np.zeros((2, 2, 3))
    nodes[:, 0, 0] = [0.0, 1.0]
    nodes[:, 1, 0] = 1.0
    return np.cross([0.0, 0.0, rate], nodes)


def angles(assembly: Assembly, y: Array) -> Array:
    tip = coordinates(assembly, y, "rib")[:, -1, 0]
    return np.arctan2(tip[:, 1], tip[:, 0])


def test_a_hinge_with_spring_and_damper_swings_as_it_should(book: Book) -> None:
    """phi = rest + A exp(-d t) cos(w t + b) with d = c/2I, w^2 = k/I - d^2."""
    k, c, rest = 2.0, 0.05, 0.3
    assembly = oscillator(stiffness=k, damping=c, rest=rest)
    times = np.linspace(0.0, 3.0, 31)
    solution = run(assembly, times, step=1e-3, spectral_radius=0.8)
    d = c / (2.0 * INERTIA)
    w = math.sqrt(k / INERTIA - d * d)
    expected = rest - rest * np.exp(-d * times) * (np.cos(w * times) + d / w * np.sin(w * times))
    assert np.abs(angles(assembly, solution.y) - expected).max() < 2e-3 * rest
    lost = solution.balance.by_joints
    assert lost[-1] == pytest.approx(0.5 * k * rest**2 * (1.0 - np.exp(-2.0 * d * 3.0)), rel=0.05)
    book(
        "Dynamics", "Rib on a hinge with spring and damper", reference="damped oscillator", source="closed form",
        error=np.abs(angles(assembly, solution.y) - expected).max() / rest, allowed=2e-3,
    )  # fmt: skip


def test_a_stop_throws_back() -> None:
    """Free until the stop; in it half a swing of pi sqrt(I/(k + ...))."""
    assembly = oscillator(stiffness=0.0, high=0.4, low=-0.4, stop=50.0, rates=spun(1.0))
    solution = run(assembly, [0.0, 0.3, 0.4, 0.4 + math.pi * math.sqrt(INERTIA / 50.0) + 0.2], tolerance=1e-6)
    found = angles(assembly, solution.y)
    assert found[1:] == pytest.approx([0.3, 0.4, 0.2], abs=2e-3)


@pytest.mark.parametrize("options", [{"step": 1e-3, "spectral_radius": 0.9}, {"tolerance": 1e-5}])
def test_a_latch_locks_at_its_angle_and_books_the_energy(options: dict[str, float]) -> None:
    assembly = oscillator(stiffness=0.0, latch=0.5, latch_stiffness=80.0, latch_damping=1.0, rates=spun(1.0))
    solution = run(assembly, [0.0, 0.25, 0.5, 4.0], **options)
    found = angles(assembly, solution.y)
    assert found[1] == pytest.approx(0.25, abs=5e-4)
    assert found[2] == pytest.approx(0.5, abs=5e-4)
    assert found[3] == pytest.approx(0.5, abs=1e-3)
    before = 0.5 * INERTIA
    assert solution.balance.kinetic[0] == pytest.approx(before, rel=1e-9)
    assert solution.balance.by_joints[3] == pytest.approx(before, rel=0.02)
    assert np.abs(solution.energy_defect).max() < 0.02 * before


def test_penalties_tend_to_the_constraint(book: Book) -> None:
    times = np.linspace(0.0, 1.0, 6)

    def pendulum(stiffness: float) -> Array:
        system = System(gravity=(0.0, -9.81, 0.0))
        system.add(parts.Point(mass=1.0, position=(1.0, 0.0, 0.0)), "bob")
        system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="bob", type="distance", stiffness=stiffness, damping=2.0))
        return run(system.assemble(), times, step=1e-3).y[:, :3]

    exact = pendulum(0.0)
    errors = [np.abs(pendulum(k) - exact).max() for k in (1e3, 1e4, 1e5)]
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.2)
    assert errors[1] / errors[2] == pytest.approx(10.0, rel=0.2)
    assert errors[2] < 1e-3
    book(
        "Dynamics", "Penalty in place of a joint, 1e5 N/m", reference="the constraint",
        source="generalized-alpha, index 3", error=errors[2], allowed=1e-3, unit="m",
        order=np.log10(errors[1] / errors[2]), wanted="1, in the stiffness",
    )  # fmt: skip


def test_a_released_penalty_books_its_energy() -> None:
    system = System(gravity=(0.0, -9.81, 0.0))
    system.add(parts.Point(mass=1.0, position=(1.0, 0.0, 0.0)), "bob")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="bob", type="distance", stiffness=200.0, until=0.5))
    solution = run(system.assemble(), [0.0, 0.5, 0.6, 1.0], step=1e-3, spectral_radius=1.0)
    assert solution.balance.coupled[1] > 0.1
    assert solution.balance.by_joints[2] == pytest.approx(solution.balance.coupled[1], rel=1e-6)
    assert np.abs(solution.energy_defect).max() < 1e-3


# ------------------------------------------------------------------------------------------------ refusals


def test_redundant_joints_run_and_are_named() -> None:
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=1.0), "body")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b=("body", (0.0, 0.0, 0.0)), type="clamp"), "first")
    system.add(parts.Joint(a=(1.0, 0.0, 0.0), b=("body", (1.0, 0.0, 0.0))), "second")
    solution = run(system.assemble(), [0.0, 1.0], step=1e-2)
    assert (solution.statistics["constraints"], solution.statistics["rank"]) == (9, 6)
    assert "those of 'first', 'second' are redundant" in solution.message


def test_redundant_joints_of_beams_run_and_are_named() -> None:
    system = System()
    system.add(parts.Beam(length=1.0, section=SQUARE, material=RUBBER, elements=3, formulation="cable"), "beam")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="beam.root", type="clamp"), "wall")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="beam.root", type="revolute"), "pin")
    solution = run(system.assemble(), [0.0, 1.0], step=1e-2)
    assert (solution.statistics["constraints"], solution.statistics["rank"]) == (9, 5)
    assert "those of 'pin', 'wall' are redundant" in solution.message


def test_a_start_that_does_not_fit_is_refused() -> None:
    system = System()
    system.add(parts.Point(mass=1.0, position=(0.3, 0.0, 0.0)), "bob")
    system.add(
        parts.Joint(
            a=(0.0, 0.0, 0.0), b="bob", type="involute", drive=parts.ConstantDrive(rate=0.0), drum=0.2, length=1.0
        ),
        "carry",
    )
    with pytest.raises(InputError, match="'carry' does not fit the start"):
        solve_implicit(system.assemble(), samples=[0.0, 1.0], step=1e-2)


@pytest.mark.parametrize("what", ["joint", "turn", "carry"])
def test_velocities_that_break_a_joint_are_refused(what: str) -> None:
    system = System()
    if what == "joint":
        system.add(parts.Point(mass=1.0, position=(1.0, 0.0, 0.0), velocity=(0.3, 1.0, 0.0)), "bob")
        system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="bob", type="distance"), "held")
    elif what == "turn":
        system.add(parts.RigidBody(motion="spin", inertia=1.0), "hub")
        system.add(parts.Joint(a="ground", b="hub", type="revolute", drive=parts.ConstantDrive(rate=0.3)), "held")
    else:
        system.add(parts.Point(mass=1.0), "bob")
        system.add(
            parts.Joint(
                a="ground", b="bob", type="point-on-line", axis=(1.0, 0.0, 0.0), drive=parts.ConstantDrive(rate=0.3)
            ),
            "held",
        )
    with pytest.raises(InputError, match=r"'held' does not fit the velocities.* -?0\.3"):
        solve_implicit(system.assemble(), samples=[0.0, 1.0], step=1e-2)


@pytest.mark.parametrize("what", ["turn", "carry", "involute"])
def test_drives_whose_rate_jumps_are_refused(what: str) -> None:
    """A step in velocity under a constraint; after the joint has let go it does no harm."""
    drive = parts.RampDrive(rate=0.5, steps=((1.0, 0.2, 2.0), (3.0, 0.0, -1.5)))
    unit = "m/s" if what == "carry" else "rad/s"

    def assemble(until: float | None) -> Assembly:
        system = System()
        if what == "turn":
            system.add(parts.RigidBody(motion="spin", inertia=1.0, rate=0.5), "hub")
            system.add(parts.Joint(a="ground", b="hub", type="revolute", drive=drive, until=until), "drive")
        else:
            system.add(parts.Point(mass=1.0, velocity=(0.5, 0.0, 0.0)), "bob")
            path: Any = {"type": "point-on-line", "axis": (1.0, 0.0, 0.0)}
            if what == "involute":
                path = {"type": "involute", "drum": 0.2, "length": 1.0}
            system.add(parts.Joint(a="ground", b="bob", drive=drive, until=until, **path), "drive")
        return system.assemble()

    with pytest.raises(InputError, match=rf"drive.drive jumps from 2 to -1.5 {unit} at t = 3 s.*RampDrive.*duration"):
        assemble(None)
    assert assemble(2.5).model.joints.size > 0


def test_multipliers_are_found_by_name() -> None:
    """The force in the pin that holds a hanging weight."""
    system = System(gravity=(0.0, -9.81, 0.0))
    system.add(parts.Point(mass=2.0), "bob")
    system.add(parts.Point(mass=1.0, position=(0.0, -1.0, 0.0)), "lower")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="bob"), "pin")
    system.add(parts.Joint(a="bob", b="lower", type="distance"), "rod")
    assembly = system.assemble()
    solution = run(assembly, [0.0, 0.1], step=1e-2)
    pin, rod = (solution.la[:, rows_of_part(assembly, name)] for name in ("pin", "rod"))
    assert np.abs(pin - [0.0, -3.0 * 9.81, 0.0]).max() < 1e-9
    assert np.abs(rod - 9.81).max() < 1e-9
