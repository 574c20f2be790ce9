"""What acts on a system from outside: every end of every family counts; only what is isolated keeps its momentum."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import families.plain
from evolvent import System, parts
from evolvent.assembly import needs
from evolvent.assembly.assembled import Assembly
from evolvent.equations import implicit as flow
from evolvent.kernels import blocks, rigid
from evolvent.model.powers import N_POWERS
from evolvent.model.registry import families
from evolvent.solvers import solve
from evolvent.solvers.common.start import acts_from_outside
from families.case import CASES
from families.moving import SYSTEMS, coupled
from families.reduced import two_node_file
from implicit.rigs import RUBBER, SQUARE, run
from implicit.test_tangent import beam

Array = np.ndarray
#: Motions of the body that a system is tied to; those but the first hold it from outside.
FREE, GROUND, DRIVEN, SPIN = "free", "ground", "driven", "spin"
TIES: dict[str, Callable[[System, Any], None]] = {}
A, B = ("a", (0.1, 0.0, 0.05)), ("b", (0.0, -0.1, 0.0))


def tie(name: str) -> Callable[[Callable[[System, Any], None]], Callable[[System, Any], None]]:
    """Enter a function that ties the free bodies a and b to a third one, given by its name, under a name."""

    def enter(add: Callable[[System, Any], None]) -> Callable[[System, Any], None]:
        TIES[name] = add
        return add

    return enter


def at(third: str, x: tuple[float, float, float] = (0.1, 0.2, 0.0)) -> Any:
    """A point of the third body, or of the ground."""
    return x if third == "ground" else (third, x)


def tied(name: str, motion: str, **given: Any) -> System:
    """Two free bodies, and a third one with the motion."""
    found = System(**given)
    inertia = (0.2, 0.3, 0.25)
    found.add(parts.RigidBody(mass=2.0, inertia=inertia, position=(1.0, 0.0, 0.0)), "a")
    found.add(parts.RigidBody(mass=3.0, inertia=inertia, position=(2.0, 0.5, 0.3)), "b")
    third = "c"
    if motion == FREE:
        found.add(parts.RigidBody(mass=4.0, inertia=inertia), "c")
    elif motion == DRIVEN:
        found.add(parts.RigidBody(motion="driven", axis=(0.0, 0.0, 1.0)), "c")
    elif motion == SPIN:
        found.add(parts.RigidBody(motion="spin", inertia=0.4, axis=(0.0, 0.0, 1.0)), "c")
    else:
        third = "ground"
    TIES[name](found, third)
    return found


@tie("a spring")
def spring(system: System, third: str) -> None:
    system.add(parts.Spring(a=A, b=B, stiffness=20.0))
    system.add(parts.Spring(a=B, b=at(third), stiffness=20.0, damping=1.0))


@tie("a custom force")
def custom(system: System, third: str) -> None:
    system.add(parts.CustomForce(points=[A, at(third)], law=coupled, parameters=(30.0, 4.0)))


@tie("the point of a pulley")
def pulley(system: System, third: str) -> None:
    system.add(parts.Joint(a="a", b="b", type="pulley", over=at(third), ratio=1.5))


@tie("the point of a soft pulley")
def soft_pulley(system: System, third: str) -> None:
    system.add(parts.Joint(a="a", b="b", type="pulley", over=at(third), stiffness=100.0, damping=2.0))


@tie("an end of a pulley")
def end_of_pulley(system: System, third: str) -> None:
    system.add(parts.Joint(a="a", b=at(third), type="pulley", over="b"))


@tie("the direction of a slide")
def direction(system: System, third: str) -> None:
    system.add(parts.Joint(a=at(third), b=B, type="point-on-line", axis=(1.9, 0.2, 0.3)))


@tie("a joint")
def joint(system: System, third: str) -> None:
    system.add(parts.Joint(a=third, b="b", type="revolute", axis=(0.3, 0.2, 0.9), position=(2.0, 0.5, 0.0)))
    system.add(parts.Joint(a="a", b="b", type="distance"))


@tie("a soft joint")
def soft_joint(system: System, third: str) -> None:
    system.add(parts.Joint(a=third, b="b", position=(2.0, 0.5, 0.0), stiffness=100.0))
    fields = {"stiffness": 100.0, "damping": 2.0}
    system.add(parts.Joint(a=third, b="b", type="prismatic", axis=(0.3, 0.2, 0.9), position=(2.0, 0.5, 0.0), **fields))


@tie("a screw")
def screw(system: System, third: str) -> None:
    system.add(parts.Joint(a=third, b="b", type="screw", axis=(0.3, 0.2, 0.9), pitch=0.4, position=(2.0, 0.5, 0.0)))


def hinges(system: System, third: str) -> None:
    """Of a on b, and of b on the third body."""
    system.add(parts.Joint(a="b", b="a", type="revolute", axis=(0.0, 0.0, 1.0), position=(1.5, 0.2, 0.0)), "own")
    system.add(parts.Joint(a=third, b="b", type="revolute", axis=(0.0, 0.0, 1.0), position=(2.0, 0.5, 0.0)), "hinge")


@tie("a gear")
def gear(system: System, third: str) -> None:
    hinges(system, third)
    system.add(parts.Joint(a="own", b="hinge", type="gear", ratio=-2.0))


def springs(system: System, third: str) -> None:
    """Coordinates about an axis, of which no joint keeps the body."""
    system.add(parts.JointSpring(a="b", b="a", axis=(0.0, 0.0, 1.0), stiffness=3.0), "own")
    system.add(parts.JointSpring(a=third, b="b", axis=(0.0, 0.0, 1.0), stiffness=3.0, damping=0.1), "turn")


tie("a joint spring on an angle")(springs)


@tie("a joint spring on a travel")
def travel(system: System, third: str) -> None:
    system.add(parts.JointSpring(a=third, b=B, axis=(0.3, 0.2, 0.9), motion="translation", stiffness=3.0))


@tie("a synchronization")
def synchronization(system: System, third: str) -> None:
    springs(system, third)
    system.add(parts.Joint(type="synchronization", joints=["own", "turn"], ratios=(1.0, -2.0), stiffness=20.0))


@tie("a motor")
def motor(system: System, third: str) -> None:
    springs(system, third)
    system.add(parts.Motor(joint="turn", law="2*sin(x) - 0.4*v"))


@tie("a harness")
def harness(system: System, third: str) -> None:
    springs(system, third)
    system.add(parts.Resistance(joint="turn", type="harness", stiffness=5.0, bristles=[[20.0, 0.8]]))


@tie("a contact")
def contact(system: System, third: str) -> None:
    sphere = parts.Sphere(radius=0.99)
    system.add(parts.Contact(a="b", b=at(third), shape_a=sphere, shape=sphere, stiffness=1e3))


@tie("the drum of a cord")
def drum(system: System, third: str) -> None:
    apart, radius = math.hypot(2.0, 0.5), 0.2
    wound = math.atan2(0.5, 2.0) - math.acos(radius / apart) + 0.5 * math.pi
    length = math.sqrt(apart**2 - radius**2) + radius * wound
    a = at(third, (0.0, 0.0, 0.3))
    system.add(parts.Joint(a=a, b="b", type="link", drum=radius, anchor=(0.0, -1.0, 0.0), length=length))


@tie("a rod")
def rod(system: System, third: str) -> None:
    system.add(parts.Rod(length=1.0, section=SQUARE, material=RUBBER, elements=2, position=(2.0, 0.5, 0.3)), "rod")
    system.add(parts.Joint(a="b", b="rod.root", type="clamp"))
    system.add(parts.Joint(a=at(third, (3.0, 0.5, 0.3)), b="rod.tip", type="clamp"))


@tie("a beam")
def cable(system: System, third: str) -> None:
    system.add(beam("cable", position=(2.0, 0.5, 0.3)), "beam")
    system.add(parts.Joint(a="b", b="beam.root", type="spherical"))
    system.add(parts.Spring(a=at(third), b="beam.tip", stiffness=3.0))


@tie("a reduced body")
def reduced(system: System, third: str) -> None:
    system.add(parts.ReducedBody(file=two_node_file(), position=(2.0, 0.5, 0.3)), "it")
    system.add(parts.Joint(a="b", b="it.root", type="clamp"))
    system.add(parts.Joint(a=at(third, (3.0, 0.5, 0.3)), b="it.tip", type="spherical"))


PAIRS = [(name, motion) for name in TIES for motion in (FREE, GROUND, DRIVEN, SPIN)]


def imbalance(assembly: Assembly, rng: np.random.Generator) -> float:
    """Torque on all that moves, at any velocities and multipliers, that loads do not explain, beside the forces.

    Notes
    -----
    The equations along a turn of the whole, less the rate of the angular momentum and the torque of the loads.
    """
    model = assembly.model
    n_q, n_v, t = int(model.info.nq), int(model.info.nv), 0.37
    needs.load(model, flow.residual, flow.momenta, flow.add_rigid_motion)
    model.switches[:] = assembly.s
    y, a, la = assembly.y.copy(), rng.standard_normal(n_v), rng.standard_normal(model.joints.size)
    if not np.any(
        model.constraints["stiffness"] == 0.0
    ):  # whose forces on both sides have one line where the sides meet
        blocks.displace(assembly.y, 0.02 * rng.standard_normal(n_v), False, model, y)
    y[n_q : n_q + n_v] += 0.5 * rng.standard_normal(n_v)
    r, powers = np.zeros(n_v + la.size), np.zeros(N_POWERS)
    soft = model.constraints["stiffness"] > 0.0
    la[soft] = 0.0
    flow.residual(t, y, a, la, 0.0, 1.0, model, r, powers)
    la[soft] = (model.constraints["stiffness"] * r[n_v:])[soft]
    flow.residual(t, y, a, la, 0.0, 1.0, model, r, powers)
    torque = np.array(flow.load_torque(y, model.P, model))
    turned = []
    for axis in np.eye(3):
        out = np.zeros(y.size)
        flow.add_rigid_motion(y, *axis, 0.0, 0.0, 0.0, model, out)
        turned.append(out[n_q : n_q + n_v] @ r[:n_v])
    ends_of_step, d = [], 1e-5
    for side in (1.0, -1.0):
        other, found = y.copy(), np.zeros(6)
        blocks.displace(y, side * d * y[n_q : n_q + n_v] + 0.5 * d * d * a, False, model, other)
        other[n_q : n_q + n_v] += side * d * a
        rigid.kinematics(t, other, model)
        flow.momenta(other, model, found)
        ends_of_step.append(found[3:])
    rate = (ends_of_step[0] - ends_of_step[1]) / (2.0 * d)
    return float(np.abs(np.array(turned) - rate + torque).max() / max(1.0, np.abs(rate).max(), np.abs(r).max()))


def isolated(assembly: Assembly, t: float = 0.0) -> bool:
    return bool(flow.is_isolated(t, assembly.model))


@pytest.mark.slow
@pytest.mark.parametrize(("name", "motion"), PAIRS)
def test_a_third_body_that_is_not_free_is_seen(name: str, motion: str) -> None:
    assembly = tied(name, motion).assemble()
    held = motion != FREE
    assert acts_from_outside(assembly.model) == held
    assembly.model.custom_forces["balanced"], assembly.model.body_contacts["gap1"] = 1.0, -1.0
    assert isolated(assembly) != held


@pytest.mark.slow
@pytest.mark.parametrize("name", TIES)
def test_between_free_bodies_momentum_is_kept(name: str, rng: np.random.Generator) -> None:
    assembly = tied(name, FREE).assemble()
    assert imbalance(assembly, rng) < 1e-8
    if name in (
        "the point of a pulley",
        "a joint spring on an angle",
        "a spring",
    ):  # and the measure finds what is held
        for motion in (GROUND, DRIVEN, SPIN):
            assert imbalance(tied(name, motion).assemble(), rng) > 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("name", [*CASES, *SYSTEMS])
def test_momentum_is_corrected_only_where_it_is_kept(name: str, rng: np.random.Generator) -> None:
    assembly = (SYSTEMS[name] if name in SYSTEMS else CASES[name]().system)().assemble()
    off = imbalance(assembly, rng)  # which also finds what touches
    assert off < 1e-8 or not isolated(assembly)


@pytest.mark.slow
@pytest.mark.parametrize("motion", [FREE, GROUND, SPIN])
@pytest.mark.parametrize("name", ["the point of a pulley", "a gear", "a screw", "a synchronization", "a spring"])
def test_the_motion_is_that_of_an_explicit_method(name: str, motion: str) -> None:
    system, samples = tied(name, motion, gravity=(0.3, -1.0, 0.5)), np.linspace(0.0, 0.5, 3)
    system.add(parts.Spring(a=A, b=("b", (0.3, 0.1, 0.2)), stiffness=20.0, length=0.4), "within")
    other = solve(system.assemble(), samples=samples, method="rk4", step=5e-4)
    found = run(system.assemble(), samples, step=1e-3)
    n = int(system.assemble().model.info.nq)
    size = np.ptp(other.y[:, :n], axis=0).max()
    assert np.abs(found.y[:, :n] - other.y[:, :n]).max() < 1e-4 * size


def test_every_family_is_known_to_act_or_not() -> None:
    for family in families().values():
        if "outside" in family.record.names:
            assert family.ends is not None
        if family.coupling.through:
            assert family.ends is not None
        assert not family.of or family.isolated is None
