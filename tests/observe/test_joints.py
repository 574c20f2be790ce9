"""Joints of each type: reactions by Newton and Euler, angles over several turns, travels, releases."""

from __future__ import annotations

import math

import numpy as np
import pytest

from evolvent import System, elements, parts
from observe.seeing import INNER, Array, Seen, close, derivative, run, turned

INERTIA = (0.3, 0.4, 0.5)
STIFF = elements.Material(young_modulus=1e10, poisson_ratio=0.3, density=1000.0)
SQUARE = elements.Rectangle(thickness=0.05, width=0.05)


def reaction(found: Seen, name: str, place: Array) -> tuple[Array, Array]:
    """Force and moment about `place` that a body needs for its accelerations, by Newton and Euler."""
    part, n_q = found.assembly.parts[name], int(found.assembly.model.info.nq)
    at = int(found.assembly.model.bodies["iv"][found.assembly.names[name][1]]) - n_q
    a, w, J = found.solution.acceleration[:, at : at + 6], found.state(name, 3, at=3, rate=True), np.array(part.inertia)
    force = part.mass * a[:, :3]
    moment = turned(found.rotation(name), J * a[:, 3:] + np.cross(w, J * w))  # about the centre of mass
    return force, moment - np.cross(place - found.state(name, 3), force)


TYPES = [
    "spherical", "revolute", "clamp", "distance", "universal", "prismatic", "cylindrical", "point-on-line", "in-plane"
]  # fmt: skip
#: Types that hold no directions.
FREE_TO_TURN = ("spherical", "distance", "point-on-line", "in-plane")


@pytest.mark.parametrize("kind", TYPES)
@pytest.mark.parametrize("held", ["constraint", "penalty"])
def test_reactions_are_what_the_held_body_needs(kind: str, held: str) -> None:
    """Two free bodies, one of them driven by a torque, coupled by a joint."""
    system = System()
    system.add(parts.RigidBody(mass=4.0, inertia=INERTIA, angular_velocity=(0.0, 0.0, 1.0)), "a")
    system.add(parts.RigidBody(mass=2.0, inertia=INERTIA, position=(1.0, 0.0, 0.0), velocity=(0.0, 1.0, 0.0),
                               angular_velocity=(0.0, 0.0, 1.0)), "b")  # fmt: skip
    system.add(parts.Load(at="a", torque=(0.2, 0.5, 1.0)), "torque")
    given = {"stiffness": 2e3, "damping": 2.0} if held == "penalty" else {}
    ends = {"a": ("a", (0.4, 0.1, 0.0)), "b": ("b", (-0.6, 0.1, 0.0))}
    if kind == "distance":
        ends["b"] = ("b", (-0.3, 0.2, 0.1))
    if kind == "universal":
        given["axis_b"] = (1.0, 0.0, 0.0)
    system.add(parts.Joint(**ends, type=kind, axis=(0.0, 1.0, 0.0), **given), "joint")
    samples = np.linspace(0.0, 0.5, 501)
    options = {"method": "rk4", "step": 1e-4} if held == "penalty" else {"step": 2.5e-4, "spectral_radius": 0.3}
    found = run(system, samples, **options)
    place = found.state("b", 3) + turned(found.rotation("b"), ends["b"][1])
    close(found.of("joint", "position"), place)
    force, moment = reaction(found, "b", place)
    moved = 2.0 * derivative(found.t, found.state("b", 3, rate=True))
    close(force[INNER][4:], moved[4:], part=5e-3)  # the first steps of generalized-alpha ring
    close(found.of("joint", "force"), force, part=1e-4)
    scale = float(np.abs(moment).max()) + float(np.abs(force).max())
    np.testing.assert_allclose(found.of("joint", "moment"), moment, atol=1e-4 * scale)
    if kind in FREE_TO_TURN:
        np.testing.assert_allclose(found.of("joint", "moment"), 0.0, atol=1e-4 * scale)
    else:
        assert float(np.abs(moment).max()) > 0.02
    axis = turned(found.rotation("a"), (0.0, 1.0, 0.0))
    if kind in ("prismatic", "cylindrical", "point-on-line"):
        np.testing.assert_allclose(np.sum(axis * force, axis=1), 0.0, atol=1e-2 * scale)
    if kind == "in-plane":
        np.testing.assert_allclose(np.cross(axis, force), 0.0, atol=1e-2 * scale)
    if kind in ("revolute", "cylindrical", "universal"):
        np.testing.assert_allclose(np.sum(axis * found.of("joint", "moment"), axis=1), 0.0, atol=1e-2 * scale)
    if kind == "distance":
        apart = place - found.state("a", 3) - turned(found.rotation("a"), ends["a"][1])
        length = np.linalg.norm(apart, axis=1)
        close(found.of("joint", "length"), length)
        pull = -np.sum(found.of("joint", "force") * apart, axis=1) / length
        close(found.of("joint", "tension"), pull)
    assert ("energy_elastic" in found.tree["joint"]) == (held == "penalty")


def test_the_force_is_that_on_b_whichever_end_is_the_body() -> None:
    """A point mass that a turning body drags along, joined both ways round."""
    for turn in (1.0, -1.0):
        system = System()
        system.add(parts.RigidBody(motion="driven", rate=2.0), "hub")
        system.add(parts.Point(mass=0.5, position=(0.7, 0.0, 0.0), velocity=(0.0, 1.4, 0.0)), "mass")
        ends = {"a": ("hub", (0.7, 0.0, 0.0)), "b": "mass"}
        if turn < 0.0:
            ends = {"a": "mass", "b": ("hub", (0.7, 0.0, 0.0))}
        system.add(parts.Joint(**ends, type="spherical"), "joint")
        found = run(system, np.linspace(0.0, 1.0, 11), step=1e-3)
        close(found.of("joint", "force")[1:], -turn * 0.5 * 4.0 * found.state("mass", 3)[1:], part=1e-3)
        assert f"on {'mass' if turn > 0.0 else 'hub'}" in found.tree["joint"]["force"].attrs["long_name"]


@pytest.mark.parametrize("swapped", [False, True])
def test_revolute_angle_of_two_bodies_over_many_turns(swapped: bool) -> None:
    """Each spins about the common axis at its own rate; there are several turns between two samples."""
    axis = np.array([1.0, 2.0, 2.0]) / 3.0
    system = System()
    for name, rate in (("a", -3.0), ("b", 25.0)):
        system.add(parts.RigidBody(mass=1.0, inertia=0.2, angular_velocity=tuple(rate * axis)), name)
    ends = ("b", "a") if swapped else ("a", "b")
    system.add(parts.Joint(a=ends[0], b=ends[1], type="revolute", axis=tuple(axis), position=(0.0, 0.0, 0.0)), "axle")
    found = run(system, np.linspace(0.0, 3.0, 7), step=1e-3)
    sign = -1.0 if swapped else 1.0
    close(found.of("axle", "angle"), sign * 28.0 * found.t, part=1e-4)
    close(found.of("axle", "rate"), np.full(7, sign * 28.0), part=1e-4)


@pytest.mark.parametrize("formulation", ["assumed_strain", "cable"])
@pytest.mark.parametrize("swapped", [False, True])
def test_revolute_angle_of_a_beam_on_a_body(formulation: str, swapped: bool) -> None:
    """A stiff beam turns over several turns on a body that turns the other way."""
    rate, base = 8.0, -2.0
    system = System()
    system.add(parts.RigidBody(motion="driven", rate=base), "hub")
    nodes = parts.Beam(length=0.5, section=SQUARE, material=STIFF, elements=2, formulation=formulation).start_nodes()
    beam = parts.Beam(
        length=0.5, section=SQUARE, material=STIFF, elements=2, formulation=formulation,
        rates=np.cross([0.0, 0.0, rate], nodes),
    )  # fmt: skip
    system.add(beam, "arm")
    ends = {"a": "arm.root", "b": "hub"} if swapped else {"a": "hub", "b": "arm.root"}
    system.add(parts.Joint(**ends, type="revolute"), "axle")
    found = run(system, np.linspace(0.0, 3.0, 16), tolerance=1e-6)
    sign = -1.0 if swapped else 1.0
    close(found.of("axle", "angle"), sign * (rate - base) * found.t, part=2e-3)
    close(found.of("axle", "rate"), sign * (rate - base), part=5e-3)
    # the force on the hub's end holds the arm on its circle: m w^2 L/2 towards the axis
    x = found.nodes("arm")[:, -1, 0]
    pull = -x / np.linalg.norm(x, axis=1)[:, None] * (2.5 * 0.5 * rate**2 * 0.25)
    close(found.of("axle", "force")[2:], sign * pull[2:], part=2e-2)


def test_revolute_angle_of_a_beam_about_its_own_axis() -> None:
    """Its section shows the turn; a cable has none, and no angle."""
    for formulation in ("assumed_strain", "cable"):
        system = System()
        beam = parts.Beam(length=0.5, section=SQUARE, material=STIFF, elements=2, formulation=formulation)
        if formulation == "assumed_strain":
            beam = beam.replaced(rates=np.cross([5.0, 0.0, 0.0], beam.start_nodes()))
        system.add(beam, "shaft")
        system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="shaft.root", type="revolute", axis=(1.0, 0.0, 0.0)), "axle")
        found = run(system, np.linspace(0.0, 2.0, 9), tolerance=1e-6)
        if formulation == "cable":
            assert "angle" not in found.tree["axle"]
        else:
            close(found.of("axle", "angle"), 5.0 * found.t, part=2e-3)


def test_the_angle_counts_from_the_start_in_equilibria_too() -> None:
    """An arm on a hinge hangs down: a quarter of a turn from where it was drawn."""
    from observe.seeing import at_rest

    system = System(gravity=(0.0, -9.81, 0.0))
    system.add(parts.Beam(length=0.5, section=SQUARE, material=STIFF, elements=2), "arm")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="arm.root", type="revolute"), "axle")
    found = at_rest(system)
    close(found.of("axle", "angle"), -0.5 * math.pi, part=1e-6)
    close(found.of("axle", "force"), [[0.0, 9.81 * 1000.0 * 0.05**2 * 0.5, 0.0]], part=1e-6)


def test_prescribed_motion_along_a_line() -> None:
    """A mass that a smooth table of positions moves: travel, and m a along the line."""
    t = np.linspace(0.0, 1.0, 201)
    system, d = System(), np.array([0.6, 0.8, 0.0])
    system.add(parts.Point(mass=2.0, position=(1.0, 1.0, 1.0)), "mass")
    drive = parts.TableDrive(time=t.tolist(), angle=(0.1 * (1.0 - np.cos(3.0 * t))).tolist())
    system.add(parts.Joint(a="ground", b="mass", type="point-on-line", drive=drive, axis=tuple(d)), "drive")
    found = run(system, np.linspace(0.0, 1.0, 101), step=1e-3)
    close(found.of("drive", "travel"), (found.state("mass", 3) - np.ones(3)) @ d)
    close(found.of("drive", "travel"), 0.1 * (1.0 - np.cos(3.0 * found.t)), part=1e-3)
    force = 2.0 * 0.9 * np.cos(3.0 * found.t)[:, None] * d
    close(found.of("drive", "force")[10:-10], force[10:-10], part=2e-2)
    close(found.of("drive", "position"), found.state("mass", 3))


def test_prescribed_motion_round_an_involute() -> None:
    """The end of a taut thread: x = c + r n(phi) + (L - r phi) n'(phi), and the angle is read off the point alone."""
    r, L = 0.2, 1.5
    system = System()
    system.add(parts.Point(mass=0.3, position=(r, L, 0.5), velocity=(-L * 0.8, 0.0, 0.0)), "end")
    drive = parts.RampDrive(rate=0.8)
    given = {"drum": r, "length": L, "a": (0.0, 0.0, 0.5)}
    system.add(parts.Joint(b="end", type="involute", drive=drive, until=1.5, **given), "drive")
    found = run(system, np.linspace(0.0, 2.0, 41), step=1e-3)
    held = found.t <= 1.5
    close(found.of("drive", "angle")[held], 0.8 * found.t[held], part=1e-5)
    assert np.all(np.isnan(found.of("drive", "angle")[~held]))
    assert found.of("drive", "closed").tolist() == held.astype(float).tolist()
    close(found.of("drive", "force")[~held] + 1.0, 1.0)


def test_prescribed_rotation() -> None:
    """Torque: moment of inertia times the drive's acceleration."""
    system = System()
    system.add(parts.RigidBody(motion="spin", inertia=0.4, axis=(0.0, 1.0, 0.0)), "wheel")
    drive = parts.RampDrive(steps=((0.0, 1.0, 3.0),))
    system.add(parts.Joint(a="ground", b="wheel", type="revolute", axis=(0, 1, 0), drive=drive), "drive")
    found = run(system, np.linspace(0.0, 2.0, 201), step=1e-3)
    angle, rate = found.state("wheel", 1)[:, 0], found.state("wheel", 1, rate=True)[:, 0]
    close(found.of("drive", "angle"), angle)
    close(found.of("drive", "rate"), rate)
    inner = slice(5, 95)
    close(found.of("drive", "torque")[INNER][inner], 0.4 * derivative(found.t, rate)[inner], part=1e-2)
    close(found.of("drive", "torque")[120:] + 1.0, 1.0, part=1e-6)
    close(found.of("drive", "moment"), found.of("drive", "torque")[:, None] * np.array([0.0, 1.0, 0.0]))


@pytest.mark.parametrize("method", ["constraint", "rk4"])
def test_a_released_joint(method: str) -> None:
    """A stone in a sling: it is held on its circle, then flies straight on."""
    system = System()
    system.add(parts.Point(mass=0.5, position=(1.0, 0.0, 0.0), velocity=(0.0, 2.0, 0.0)), "stone")
    given = {"stiffness": 1e4, "damping": 100.0} if method == "rk4" else {}
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="stone", type="distance", until=0.5, **given), "sling")
    options = {"method": "rk4", "step": 2e-4} if method == "rk4" else {"step": 2e-3, "spectral_radius": 0.3}
    found = run(system, np.linspace(0.0, 1.0, 101), **options)
    before, after = found.t < 0.5 - 1e-9, found.t > 0.5 + 1e-9
    close(found.of("sling", "tension")[before][10:], 2.0, part=1e-2 if method == "rk4" else 2e-3)
    close(found.of("sling", "tension")[after] + 1.0, 1.0)
    close(found.of("sling", "force")[after] + 1.0, 1.0)
    assert found.of("sling", "closed")[before].min() == 1.0
    assert found.of("sling", "closed")[after].max() == 0.0
    v = found.of("stone", "velocity")[after]
    close(v, v[0])
    if method == "rk4":
        gap = np.linalg.norm(found.state("stone", 3), axis=1) - 1.0
        close(found.of("sling", "energy_elastic"), np.where(found.t < 0.5, 0.5 * 1e4 * gap**2, 0.0))


def test_a_point_fixed_to_a_body() -> None:
    """Implicit methods are chosen for constraints; the force on the point is m w^2 r under explicit ones as well."""
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=1.0, angular_velocity=(0.0, 0.0, 1.0)), "hub")
    system.add(parts.Point(mass=1.0, at=("hub", (1.0, 0.0, 0.0))), "ball")
    assert run(system, [0.0, 0.1]).solution.method == "generalized-alpha"
    found = run(system, [0.0, 0.1], "dopri5")
    close(np.linalg.norm(found.of("ball", "force"), axis=1), 0.5)
