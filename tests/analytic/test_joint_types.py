"""Joints that slide, universal joints and joints of beams, against closed forms; redundant ones; released by events."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from book import Book
from evolvent import InputError, System, elements, parts
from evolvent.solvers import Solution, solve
from evolvent.solvers.modal.modes import modes
from evolvent.solvers.static.static import solve_static
from evolvent.solvers.time.implicit.energy_momentum import solve_energy
from evolvent.solvers.time.implicit.plan import solve_implicit
from helpers import fitted_order, rotation
from implicit.rigs import coordinates

Array = np.ndarray
G, ORIGIN = 9.81, (0.0, 0.0, 0.0)
SOFT = elements.Material(young_modulus=1e9, poisson_ratio=0.0, density=1000.0)
SQUARE = elements.Rectangle(thickness=0.02, width=0.02)
METHODS = ("generalized-alpha", "energy-momentum", "rk4")


def solved(system: System, samples: Any, method: str, step: float) -> Solution:
    """A run that ends well, with the energy that came in."""
    assembly = system.assemble()
    if method == "rk4":
        found = solve(assembly, samples=samples, method="rk4", step=0.1 * step)
    elif method == "generalized-alpha":
        found = solve_implicit(assembly, samples=samples, step=step, spectral_radius=0.9)
    else:
        found = solve_energy(assembly, samples=samples, step=step, spectral_radius=1.0)
    assert found.success, found.message
    return found


def held(method: str, stiffness: float = 1e6) -> dict[str, float]:
    """Constraints; under rk4 penalties, whose constraints `test_explicit_joints` has."""
    return {"stiffness": stiffness} if method == "rk4" else {}


# ------------------------------------------------------------------------------------------------ slides


@pytest.mark.parametrize("method", METHODS)
def test_a_body_slides_down_an_incline(method: str) -> None:
    """s = g sin(a) t^2/2, without turning, whatever its shape; the force is across the line."""
    slope = math.radians(30.0)
    axis = np.array([math.cos(slope), 0.0, -math.sin(slope)])
    system = System(gravity=(0.0, 0.0, -G))
    system.add(parts.RigidBody(mass=2.0, inertia=(0.1, 0.2, 0.3), position=(0.2, 0.3, 0.4)), "box")
    system.add(parts.Joint(a=ORIGIN, b=("box", (0.1, -0.2, 0.1)), type="prismatic", axis=axis, **held(method)), "rail")
    times = np.linspace(0.0, 1.0, 6)
    found = solved(system, times, method, 1e-2 if method != "rk4" else 5e-3)
    x = coordinates(found.assembly, found.y, "box")
    wanted = np.array([0.2, 0.3, 0.4]) + 0.5 * G * math.sin(slope) * times[:, None] ** 2 * axis
    assert x[:, :3] == pytest.approx(wanted, abs=2e-4)
    assert np.abs(x[:, 4:]).max() < 2e-4


@pytest.mark.parametrize("method", METHODS)
def test_a_body_turns_and_slides_on_a_shaft(method: str) -> None:
    """It falls along the shaft and keeps its spin about it, though its mass hangs off the axis of no principal one."""
    system = System(gravity=(0.0, 0.0, -G))
    system.add(
        parts.RigidBody(mass=2.0, inertia=(0.1, 0.2, 0.3), position=(0.5, 0.0, 0.0), velocity=(0.0, 1.0, 0.0),
                        angular_velocity=(0.0, 0.0, 2.0)), "arm",
    )  # fmt: skip
    system.add(parts.Joint(a=ORIGIN, b=("arm", (-0.5, 0.0, 0.0)), type="cylindrical", **held(method)), "shaft")
    times = np.linspace(0.0, 1.0, 6)
    found = solved(system, times, method, 1e-3)
    x = coordinates(found.assembly, found.y, "arm")[:, :3]
    wanted = [0.5 * np.cos(2.0 * times), 0.5 * np.sin(2.0 * times), -0.5 * G * times**2]
    assert x == pytest.approx(np.array(wanted).T, abs=2e-4)


@pytest.mark.parametrize("method", METHODS)
def test_a_bead_on_a_turning_rod(method: str) -> None:
    """r'' = w^2 r: r = r0 cosh(w t); its force across is 2 m w r'."""
    w, r0, mass, times = 2.0, 0.3, 0.5, np.linspace(0.0, 1.0, 6)
    system = System()
    system.add(parts.RigidBody(motion="driven", rate=w), "rod")
    system.add(parts.Point(mass=mass, position=(r0, 0.0, 0.0), velocity=(0.0, r0 * w, 0.0)), "bead")
    given = {**held(method), "damping": 50.0} if method == "rk4" else {}
    system.add(
        parts.Joint(a=("rod", ORIGIN), b="bead", type="point-on-line", axis=(1.0, 0.0, 0.0), **given), "line"
    )  # fmt: skip
    found = solved(system, times, method, 1e-3 if method != "rk4" else 5e-4)
    r = r0 * np.cosh(w * times)
    x = coordinates(found.assembly, found.y, "bead")
    assert x[:, :2] == pytest.approx(np.array([r * np.cos(w * times), r * np.sin(w * times)]).T, abs=1e-4)
    across = np.linalg.norm(found.la[1:], axis=1)
    assert across == pytest.approx(2.0 * mass * w * r0 * w * np.sinh(w * times[1:]), rel=5e-3)


@pytest.mark.parametrize("method", METHODS)
def test_a_point_in_a_tilting_plane(method: str) -> None:
    """In a plane that turns about a line in it: free along the line, r cosh(w t) across."""
    w, r0, times = 1.5, 0.4, np.linspace(0.0, 1.0, 6)
    system = System()
    system.add(parts.RigidBody(motion="driven", rate=w, axis=(1.0, 0.0, 0.0)), "plate")
    system.add(parts.Point(mass=0.5, position=(0.1, r0, 0.0), velocity=(0.7, 0.0, r0 * w)), "puck")
    given = {**held(method), "damping": 50.0} if method == "rk4" else {}
    system.add(parts.Joint(a=("plate", ORIGIN), b="puck", type="in-plane", axis=(0.0, 0.0, 1.0), **given), "plane")
    found = solved(system, times, method, 1e-3 if method != "rk4" else 5e-4)
    r = r0 * np.cosh(w * times)
    wanted = [0.1 + 0.7 * times, r * np.cos(w * times), r * np.sin(w * times)]
    assert coordinates(found.assembly, found.y, "puck") == pytest.approx(np.array(wanted).T, abs=1e-4)


@pytest.mark.parametrize("method", METHODS)
def test_shafts_on_a_universal_joint(method: str, book: Book) -> None:
    """Cardan: tan(driven) = tan(driving)/cos(bend) from where the driving fork lies in the plane of both shafts."""
    bend, rate, times = math.radians(40.0), 2.0, np.linspace(0.0, 3.0, 31)
    along = np.array([math.cos(bend), math.sin(bend), 0.0])
    system = System()
    system.add(parts.RigidBody(motion="driven", rate=rate, axis=(1.0, 0.0, 0.0)), "driving")
    across = np.array([-math.sin(bend), math.cos(bend), 0.0])
    # at the start the driving fork stands across the bend, the driven one in its plane and turns at rate cos(bend)
    start = rate * math.cos(bend)
    given = held(method, 2e4)
    system.add(parts.RigidBody(mass=1.0, inertia=0.01, angular_velocity=tuple(start * along)), "driven")
    system.add(parts.Joint(a=ORIGIN, b=("driven", ORIGIN), type="revolute", axis=along, **given), "bearing")
    ends: dict[str, Any] = {"axis": (0.0, 0.0, 1.0), "axis_b": across}
    system.add(parts.Joint(a=("driving", ORIGIN), b=("driven", ORIGIN), type="universal", **ends, **given), "cross")
    found = solved(system, times, method, 2e-3)
    turn = np.array([rotation(p[3:]) @ across for p in coordinates(found.assembly, found.y, "driven")])
    angle = np.unwrap(np.arctan2(turn @ np.cross(along, across), turn @ across))
    phi = rate * times
    wanted = np.unwrap(np.arctan2(np.sin(phi) * math.cos(bend), np.cos(phi)))
    allowed = 2e-3 if method == "rk4" else 1e-5
    assert angle == pytest.approx(wanted, abs=allowed)
    if method == "energy-momentum":
        book(
            "Rigid bodies", "Cardan joint bent by 40 deg, one turn (energy-momentum, 2 ms)",
            reference="tan(driven) = cos(bend) tan(driving)", source="closed form",
            error=np.abs(angle - wanted).max(), allowed=allowed, unit="rad",
        )  # fmt: skip


# ------------------------------------------------------------------------------------------------ mechanisms

#: Flyball governor: arms of length L with a ball, links of half that length from their middles to the sleeve.
ARM, BALL, SLEEVE, SHAFT, SPRING, DAMPER, REST = 1.0, 2.0, 3.0, 0.2, 400.0, 40.0, 0.9


def governor(rate: float, angle: float) -> System:
    """Shaft about z on a hinge, two arms hinged to its top, the sleeve on a prismatic joint of the shaft."""
    system = System(gravity=(0.0, 0.0, -G))
    turning = {"angular_velocity": (0.0, 0.0, rate)}
    system.add(parts.RigidBody(mass=1.0, inertia=(0.1, 0.1, SHAFT), **turning), "shaft")
    system.add(parts.Joint(a=ORIGIN, b="shaft", type="revolute", axis=(0.0, 0.0, 1.0)), "bearing")
    low = -ARM * math.cos(angle)
    system.add(parts.RigidBody(mass=SLEEVE, inertia=0.05, position=(0.0, 0.0, low), **turning), "sleeve")
    system.add(parts.Joint(a="shaft", b=("sleeve", ORIGIN), type="prismatic", axis=(0.0, 0.0, 1.0)), "slide")
    system.add(
        parts.Spring(a=ORIGIN, b="sleeve", stiffness=SPRING, damping=DAMPER, length=REST), "spring"
    )  # fmt: skip
    for k, side in enumerate((1.0, -1.0)):
        d = np.array([side * math.sin(angle), 0.0, -math.cos(angle)])
        system.add(
            parts.RigidBody(mass=BALL, inertia=1e-3, position=tuple(ARM * d),
                            velocity=tuple(np.cross((0.0, 0.0, rate), ARM * d)), **turning), f"ball{k}",
        )  # fmt: skip
        system.add(
            parts.Joint(a="shaft", b=(f"ball{k}", tuple(-ARM * d)), type="revolute", axis=(0.0, 1.0, 0.0)), f"pin{k}"
        )
        system.add(parts.Joint(a=("sleeve", ORIGIN), b=(f"ball{k}", tuple(-0.5 * ARM * d)), type="distance"), f"rod{k}")
    return system


def governor_exact(times: Array, rate: float, angle: float) -> Array:
    """Height of the sleeve, by Lagrange's equations of the arms' angle a and the turn: H = I(a) w is kept."""
    m, J = BALL, 1e-3  # of a ball about its centre

    def inertia(a: float) -> tuple[float, float]:
        s, c = math.sin(a), math.cos(a)
        return SHAFT + 0.05 + 2.0 * (m * ARM**2 * s**2 + J), 4.0 * m * ARM**2 * s * c

    H = inertia(angle)[0] * rate

    def rates(_: float, y: Array) -> list[float]:
        a, u = y
        s, c = math.sin(a), math.cos(a)
        I, dI = inertia(a)  # noqa: E741
        # T = (2 m L^2 + 2 J + M L^2 s^2) a'^2/2 + H^2/(2 I), V = -(2 m L + M L) g c + k (L c - rest)^2/2
        A, dA = 2.0 * m * ARM**2 + 2.0 * J + SLEEVE * ARM**2 * s * s, 2.0 * SLEEVE * ARM**2 * s * c
        force = 0.5 * dI * (H / I) ** 2 - (2.0 * m + SLEEVE) * G * ARM * s + SPRING * (ARM * c - REST) * ARM * s
        force -= DAMPER * (ARM * s) ** 2 * u
        return [u, (force - 0.5 * dA * u * u) / A]

    return -ARM * np.cos(solve_ivp(rates, (0.0, times[-1]), [angle, 0.0], "DOP853", times, rtol=1e-11, atol=1e-12).y[0])


def test_flyball_governor(book: Book) -> None:
    """As IFToMM A05, whose sleeve is on a prismatic joint: two arms, rods, spring and damper."""
    rate, angle, times = 2.0 * math.pi, math.radians(30.0), np.linspace(0.0, 1.0, 11)
    exact = governor_exact(times, rate, angle)
    assert np.ptp(exact) > 0.05
    errors, steps = [], (4e-3, 2e-3, 1e-3)
    for h in steps:
        found = solved(governor(rate, angle), times, "energy-momentum", h)
        sleeve = coordinates(found.assembly, found.y, "sleeve")[:, 2]
        errors.append(float(np.abs(sleeve - exact).max()))
    order = fitted_order(steps, errors)
    assert order == pytest.approx(2.0, abs=0.2)
    book(
        "Rigid bodies", "Flyball governor as IFToMM A05, sleeve on a prismatic joint (energy-momentum, 1 ms)",
        reference="height of the sleeve for 1 s", source="Lagrange's equation, SciPy DOP853", error=errors[-1],
        allowed=1e-5, unit="m", order=order, wanted="2",
    )  # fmt: skip


def parallelogram(kind: str) -> System:
    """Two upright rods of 1 m and 1 kg on the ground, and a level one on top, in one plane: on hinges rank 17 - 3."""
    system = System(gravity=(0.0, -G, 0.0))
    up = {"velocity": (0.5, 0.0, 0.0), "angular_velocity": (0.0, 0.0, -1.0)}
    thin = (1.0 / 12.0, 1e-3, 1.0 / 12.0)
    for k in (0, 1):
        system.add(parts.RigidBody(mass=1.0, inertia=thin, position=(k, 0.5, 0.0), **up), f"up{k}")
        system.add(parts.Joint(a=(float(k), 0.0, 0.0), b=(f"up{k}", (0.0, -0.5, 0.0)), type="revolute"), f"foot{k}")
    level = parts.RigidBody(
        mass=1.0, inertia=thin[1::-1] + thin[2:], position=(0.5, 1.0, 0.0), velocity=(1.0, 0.0, 0.0)
    )
    system.add(level, "level")
    for k in (0, 1):
        ends = {"a": (f"up{k}", (0.0, 0.5, 0.0)), "b": ("level", (k - 0.5, 0.0, 0.0))}
        system.add(parts.Joint(**ends, type=kind), f"top{k}")
    return system


@pytest.mark.parametrize("method", METHODS[:2])
def test_a_parallelogram_on_hinges_has_redundant_constraints(method: str) -> None:
    """20 constraints of rank 17: it moves by a'' = 2 g sin(a)/(5/3) like one angle, and reactions stay in its plane."""
    times = np.linspace(0.0, 2.0, 11)
    found = solved(parallelogram("revolute"), times, method, 1e-3)
    assert (found.statistics["constraints"], found.statistics["rank"]) == (20, 17)
    assert "17 of 20 constraints are independent, those of 'foot0', 'foot1', 'top0', 'top1'" in found.message
    weight = G * 2.0 / (2.0 / 3.0 + 1.0)
    angle = solve_ivp(
        lambda _, y: [y[1], weight * np.sin(y[0])], (0.0, 2.0), [0.0, 1.0], "DOP853", times, rtol=1e-11, atol=1e-12
    ).y[0]
    x = coordinates(found.assembly, found.y, "up0")
    assert 2.0 * x[:, :2] == pytest.approx(np.array([np.sin(angle), np.cos(angle)]).T, abs=1e-4)
    out_of_plane = found.la.reshape(-1, 4, 5)[:, :, 2:]
    assert np.abs(out_of_plane).max() < 1e-4  # what nothing asks for is zero


def door(*heights: float) -> System:
    """A plate on hinges along the z axis."""
    system = System(gravity=(0.0, 0.0, -G))
    system.add(parts.RigidBody(mass=10.0, inertia=(0.5, 0.5, 0.5), position=(0.4, 0.0, 0.0)), "door")
    system.add(parts.JointSpring(a="ground", b="door", axis=(0.0, 0.0, 1.0), stiffness=2.0), "closer")
    for k, z in enumerate(heights):
        system.add(parts.Joint(a=(0.0, 0.0, z), b=("door", (-0.4, 0.0, z)), type="revolute"), f"hinge{k}")
    return system


@pytest.mark.parametrize("solver", ["static", "generalized-alpha", "energy-momentum"])
def test_multipliers_of_redundant_hinges_are_those_of_least_norm(solver: str) -> None:
    """Two hinges of a door share its weight; of all forces and moments that carry it these are the least."""
    system = door(-1.0, 1.0)
    if solver == "static":
        found = solve_static(system.assemble())
    else:
        found = solved(system, np.linspace(0.0, 0.01, 3), solver, 1e-3)
    assert (found.statistics["constraints"], found.statistics["rank"]) == (10, 5)
    # forces at both hinges and moments about x and y: equilibrium of the door about its centre
    columns = []
    for z in (-1.0, 1.0):
        arm = np.array([-0.4, 0.0, z])
        columns += [np.append(e, np.cross(arm, e)) for e in np.eye(3)]
        columns += [np.append(np.zeros(3), e) for e in np.eye(3)[:2]]
    from evolvent.solvers.common.sizes import sizes

    length = float(sizes(found.assembly)[0].max())
    weight = np.tile([1.0, 1.0, 1.0, 1.0 / length, 1.0 / length], 2)  # moments count by the size of the system
    least = np.linalg.lstsq(np.array(columns).T / weight, np.array([0, 0, 10.0 * G, 0, 0, 0]), rcond=None)[0] / weight
    loads = np.abs(found.la[-1].reshape(2, 5))
    assert loads[:, :3] == pytest.approx(np.abs(least.reshape(2, 5)[:, :3]), rel=1e-3, abs=1e-3)
    assert np.linalg.norm(loads[:, 3:]) == pytest.approx(np.linalg.norm(least.reshape(2, 5)[:, 3:]), rel=1e-3, abs=1e-3)
    assert loads[:, 2] == pytest.approx(5.0 * G, rel=2e-4)


def test_modes_with_redundant_hinges() -> None:
    """The door's frequency is the same on one hinge as on three."""
    one, three = (abs(modes(door(*heights).assemble(), count=1).pole[0]) for heights in ((0.0,), (-1.0, 0.5, 1.0)))
    assert one == pytest.approx(math.sqrt(2.0 / (0.5 + 10.0 * 0.16)), rel=1e-6)
    assert three == pytest.approx(one, rel=1e-6)


@pytest.mark.parametrize("method", METHODS[:2])
def test_what_is_driven_twice_is_refused_by_name(method: str) -> None:
    system = System()
    system.add(parts.RigidBody(motion="spin", inertia=1.0), "wheel")
    for name, rate in (("one", 1.0), ("other", 1.0)):
        drive = parts.RampDrive(rate=0.0, steps=((0.0, 1.0, rate),))
        system.add(parts.Joint(a="ground", b="wheel", type="revolute", drive=drive), name)
    with pytest.raises(InputError, match=r"'(one|other)' is redundant: it drives a motion that other constraints"):
        solved(system, [0.0, 1.0], method, 1e-2)


@pytest.mark.parametrize("method", METHODS[:2])
def test_constraints_that_come_to_contradict_one_another_end_the_run(method: str) -> None:
    """A bob on a hub that turns, and in a plane that fits its position and velocity at the start only."""
    system = System()
    system.add(parts.RigidBody(motion="driven", rate=0.5), "hub")
    system.add(parts.Point(mass=1.0, position=(1.0, 0.0, 0.0), velocity=(0.0, 0.5, 0.0)), "bob")
    system.add(parts.Joint(a=("hub", (1.0, 0.0, 0.0)), b="bob"), "pin")
    system.add(parts.Joint(a=(1.0, 0.0, 0.0), b="bob", type="in-plane", axis=(1.0, 0.0, 0.0)), "wall")
    with pytest.raises(AssertionError, match=r"the constraints of 'pin', 'wall' are inconsistent at t = "):
        solved(system, [0.0, 1.0], method, 1e-2)


def test_an_infinitesimal_mechanism_holds() -> None:
    """A bob on two rods in line, whose gradients are one: it sinks by what the rods yield, not further."""
    system = System(gravity=(0.0, -G, 0.0))
    system.add(parts.Point(mass=1.0, position=(1.0, 0.0, 0.0)), "bob")
    for name, x in (("near", 0.0), ("far", 2.0)):
        system.add(parts.Joint(a=(x, 0.0, 0.0), b="bob", type="distance"), name)
    found = solved(system, [0.0, 0.5], "energy-momentum", 1e-3)
    assert np.abs(coordinates(found.assembly, found.y, "bob")[-1, 1:]).max() < 1e-2


# ------------------------------------------------------------------------------------------------ gears


@pytest.mark.parametrize("method", METHODS[:2])
def test_wheels_that_mesh_turn_many_times(method: str, book: Book) -> None:
    """20 against 35 teeth under a torque: q = T t^2/2 / (J_1 + J_2/ratio^2), over more than 6 turns."""
    ratio, torque, times = 35.0 / 20.0, 4.0, np.linspace(0.0, 4.0, 9)
    system = System()
    system.add(parts.RigidBody(motion="spin", inertia=0.2), "pinion")
    system.add(parts.RigidBody(mass=1.0, inertia=(0.3, 0.3, 0.6), position=(1.0, 0.0, 0.0)), "wheel")
    system.add(parts.Joint(a=(1.0, 0.0, 0.0), b=("wheel", ORIGIN), type="revolute"), "axle")
    system.add(parts.Joint(a="pinion", b="axle", type="gear", ratio=ratio), "gear")
    system.add(parts.Load(at="pinion", torque=(0.0, 0.0, torque)), "motor")
    found = solved(system, times, method, 2e-3)
    wanted = 0.5 * torque / (0.2 + 0.6 / ratio**2) * times**2
    assert wanted[-1] > 12.0 * math.pi
    angle = found.y[:, int(found.assembly.model.bodies["iq"][1])]
    assert angle == pytest.approx(wanted, abs=2e-2)
    p = coordinates(found.assembly, found.y, "wheel")[:, 3:]
    assert np.array([rotation(q)[0, 0] for q in p]) == pytest.approx(np.cos(angle / ratio), abs=1e-6)
    gap = np.abs(angle - wanted).max()
    if method == "generalized-alpha":
        book(
            "Rigid bodies", "Gear of 20 and 35 teeth under a torque for 6 turns (2 ms)", reference="T t^2/2 over the "
            "inertia by the ratio squared", source="closed form", error=gap, allowed=1e-6, unit="rad",
        )  # fmt: skip


@pytest.mark.parametrize("method", METHODS[:2])
def test_a_rack_falls_and_turns_its_pinion(method: str) -> None:
    """A travel and an angle: a = m g/(m + J/r^2)."""
    radius, times = 0.3, np.linspace(0.0, 1.0, 6)
    system = System(gravity=(0.0, 0.0, -G))
    system.add(parts.RigidBody(motion="spin", inertia=0.2, axis=(0.0, 1.0, 0.0)), "pinion")
    system.add(parts.RigidBody(mass=2.0, inertia=0.1, position=(radius, 0.0, 0.0)), "rack")
    system.add(parts.Joint(a=ORIGIN, b="rack", type="prismatic", axis=(0.0, 0.0, 1.0)), "slide")
    system.add(parts.Joint(a="slide", b="pinion", type="gear", ratio=radius), "gear")
    found = solved(system, times, method, 1e-3)
    fallen = 0.5 * 2.0 * G / (2.0 + 0.2 / radius**2) * times**2
    assert coordinates(found.assembly, found.y, "rack")[:, 2] == pytest.approx(-fallen, abs=1e-4)
    assert found.y[:, int(found.assembly.model.bodies["iq"][1])] == pytest.approx(fallen / radius, abs=1e-3)


def test_a_gear_between_free_bodies_keeps_energy_and_momenta() -> None:
    """Two wheels on a base in space, geared, one of them on a spring."""
    system, w = System(), np.array([0.2, 0.1, 0.0])
    system.add(parts.RigidBody(mass=3.0, inertia=(0.3, 0.4, 0.5), angular_velocity=tuple(w)), "base")
    for name, x, rate in (("p", (0.5, 0.0, 0.0), 3.0), ("q", (-0.5, 0.0, 0.0), -1.5)):
        turning = {"velocity": tuple(np.cross(w, x)), "angular_velocity": tuple(w + np.array([0.0, 0.0, rate]))}
        system.add(parts.RigidBody(mass=1.0, inertia=(0.02, 0.02, 0.03), position=x, **turning), name)
        system.add(parts.Joint(a="base", b=(name, ORIGIN), type="revolute"), f"axle {name}")
    system.add(parts.Joint(a="axle p", b="axle q", type="gear", ratio=2.0), "gear")
    system.add(parts.Spring(a=("p", (0.1, 0.0, 0.0)), b=("base", (0.5, 0.3, 0.0)), stiffness=20.0, length=0.1))
    times = np.linspace(0.0, 3.0, 7)
    found = solved(system, times, "energy-momentum", 1e-2)
    assert np.abs(found.energy_defect).max() < 1e-9 * found.energy[0]
    assert np.abs(found.momentum.drift_angular).max() < 1e-8
    assert np.abs(found.momentum.drift_linear).max() < 1e-12
    finer, other = solved(system, times, "energy-momentum", 1e-3), solved(system, times, "generalized-alpha", 1e-3)
    assert np.abs(finer.y[:, :21] - other.y[:, :21]).max() < 2e-4


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"a": "axle", "b": "axle", "ratio": 1.0}, "gear.a and gear.b are both 'axle'"),
        ({"a": "axle", "b": "spinner", "ratio": 0.0}, "gear.ratio is 0"),
        (
            {"a": "axle", "b": "spinner", "ratio": math.pi},
            r"ratio of whole numbers of teeth up to 200, such as \d+/\d+",
        ),
        ({"a": "axle", "b": "pin", "ratio": 1.0}, "gear.b is 'pin', a joint of type 'spherical', which has no single"),
        ({"a": "axle", "b": "hub", "ratio": 1.0}, "gear.b is 'hub'; it must be a body with motion 'spin', or a joint"),
        ({"a": "axle", "b": "root", "ratio": 1.0}, "gear.b is 'root', a joint on a beam or a point"),
    ],
)
def test_what_cannot_be_geared_is_refused(given: dict[str, Any], words: str) -> None:
    system = System()
    system.add(parts.RigidBody(motion="spin", inertia=1.0), "spinner")
    system.add(parts.RigidBody(mass=1.0, inertia=1.0), "hub")
    system.add(parts.Beam(length=1.0, elements=1, section=SQUARE, material=SOFT), "boom")
    system.add(parts.Joint(a=ORIGIN, b=("hub", ORIGIN), type="revolute"), "axle")
    system.add(parts.Joint(a="hub", b="boom.tip"), "pin")
    system.add(parts.Joint(a=ORIGIN, b="boom.root", type="revolute"), "root")
    system.add(parts.Joint(type="gear", **given), "gear")
    with pytest.raises(InputError, match=words):
        system.assemble()


# ------------------------------------------------------------------------------------------------ beams


def frame(bend: float, count: int, load: Array, *, kind: str = "clamp", swapped: bool = False, **fields: Any) -> System:
    """Two booms of 1 m, the second at an angle to the first one's tip, a force at its end."""
    system = System()
    d = (math.cos(bend), math.sin(bend), 0.0)
    common: dict[str, Any] = {"length": 1.0, "elements": count, "section": SQUARE, "material": SOFT}
    system.add(parts.Beam(**common), "one")
    system.add(parts.Beam(**common, position=(1.0, 0.0, 0.0), direction=d, **fields), "other")
    system.add(parts.Joint(a=ORIGIN, b="one.root", type="clamp"), "wall")
    ends = ("other.root", "one.tip") if swapped else ("one.tip", "other.root")
    system.add(parts.Joint(a=ends[0], b=ends[1], type=kind), "corner")
    if np.any(load):
        system.add(parts.Load(at="other.tip", force=tuple(load)), "load")
    return system


def compliance(bend: float, load: Array) -> float:
    """Work of a force of 1 N at the end of the frame, by Castigliano's theorem, m/N."""
    EI, GJ = 1e9 * 0.02**4 / 12.0, 0.5e9 * SQUARE.J if hasattr(SQUARE, "J") else 0.5e9 * 0.140577 * 0.02**4
    d, x = np.array([math.cos(bend), math.sin(bend), 0.0]), np.linspace(0.0, 1.0, 4001)[:, None]
    first = np.cross(np.array([1.0, 0.0, 0.0]) + d - x * np.array([1.0, 0.0, 0.0]), load)
    second = np.cross((1.0 - x) * d, load)
    torque = first[:, 0] ** 2 / GJ + (first[:, 1:] ** 2).sum(axis=1) / EI
    return float(np.trapezoid(torque + (second**2).sum(axis=1) / EI, x[:, 0]))


@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize("bend", [0.0, 30.0, 60.0, 90.0, 120.0])
def test_a_frame_of_two_booms(bend: float, swapped: bool, book: Book) -> None:
    """Clamped to one another at an angle, without a body between: force in the plane and across it."""
    angle, error = math.radians(bend), 0.0
    for load in (np.array([-math.sin(angle), math.cos(angle), 0.0]), np.array([0.0, 0.0, 1.0])):
        system = frame(angle, 8, 1e-3 * load, swapped=swapped)
        assembly = system.assemble()
        found = solve_static(assembly)
        tip = coordinates(assembly, np.array([assembly.y, found.y[-1]]), "other")[:, -1, 0]
        error = max(error, abs(float((tip[1] - tip[0]) @ load) / (1e-3 * compliance(angle, load)) - 1.0))
    if bend == 90.0 and not swapped:
        book(
            "Statics of beams", "Right-angled frame of two booms clamped to one another [2 x 8 elements]",
            reference="tip in the plane and across it", source="beam theory (Castigliano)", error=error, allowed=2e-3,
        )  # fmt: skip
    assert error < 2e-3


def test_a_rolled_boom_is_clamped_as_well() -> None:
    """The second boom's section is turned about its axis; a square one is as stiff in all directions."""
    turn = math.radians(35.0)
    found = []
    for normal in ((0.0, 1.0, 0.0), (0.0, math.cos(turn), math.sin(turn))):
        assembly = frame(0.0, 4, np.array([0.0, 0.0, 1e-3]), normal=normal).assemble()
        found.append(coordinates(assembly, solve_static(assembly).y, "other")[-1, -1, 0])
    assert found[1] == pytest.approx(found[0], abs=1e-7)


@pytest.mark.slow
def test_modes_of_a_right_angled_frame() -> None:
    """As with a light stiff body between the booms."""
    direct = np.abs(modes(frame(0.5 * math.pi, 4, np.zeros(3)).assemble(), count=4).pole)
    system = System()
    common: dict[str, Any] = {"length": 1.0, "elements": 4, "section": SQUARE, "material": SOFT}
    system.add(parts.Beam(**common), "one")
    system.add(parts.Beam(**common, position=(1.0, 0.0, 0.0), direction=(0.0, 1.0, 0.0)), "other")
    system.add(parts.Joint(a=ORIGIN, b="one.root", type="clamp"))
    system.add(parts.RigidBody(mass=1e-6, inertia=1e-9, position=(1.0, 0.0, 0.0)), "helper")
    for end in ("one.tip", "other.root"):
        system.add(parts.Joint(a="helper", b=end, type="clamp"))
    helped = np.abs(modes(system.assemble(), count=4).pole)
    assert direct == pytest.approx(helped, rel=1e-4)


def test_a_frame_of_booms_keeps_energy_and_momenta_after_a_pulse() -> None:
    """Two booms at a right angle, free in space, under a triangular pulse."""
    system = System()
    common: dict[str, Any] = {"length": 1.0, "elements": 3, "section": SQUARE, "material": SOFT}
    system.add(parts.Beam(**common), "one")
    system.add(parts.Beam(**common, position=(1.0, 0.0, 0.0), direction=(0.0, 1.0, 0.0)), "other")
    system.add(parts.Joint(a="one.tip", b="other.root", type="clamp"), "corner")
    pulse = {"table": [(0.0, 0.0), (0.02, 2.0), (0.04, 0.0), (1.0, 0.0)]}
    system.add(parts.Load(at="other.tip", direction=(0.3, 0.1, 1.0), profile=pulse), "pulse")
    times = np.linspace(0.0, 0.2, 11)
    found = solved(system, times, "energy-momentum", 1e-3)
    after = times > 0.05
    energy = found.energy[after]
    assert np.ptp(energy) < 1e-7 * energy.max()
    assert np.ptp(found.momentum.angular[after], axis=0).max() < 1e-9
    assert np.ptp(found.momentum.linear[after], axis=0).max() < 1e-10
    other = solved(system, times, "generalized-alpha", 1e-3)
    tips = [coordinates(run.assembly, run.y, "other")[:, -1, 0] for run in (found, other)]
    assert np.abs(tips[0] - tips[1]).max() < 2e-2 * np.ptp(tips[0], axis=0).max()


def test_booms_on_a_hinge_of_their_own() -> None:
    """The hinge between two booms passes no moment about its axis: the second one hangs down under its weight."""
    system = frame(0.0, 2, np.array([0.0, -1e-3, 0.0]), kind="revolute")
    found = solve_static(system.assemble())
    assert found.success, found.message
    tip = coordinates(found.assembly, found.y, "other")[-1, -1, 0]
    assert tip == pytest.approx([1.0, -1.0, 0.0], abs=2e-3)


# ------------------------------------------------------------------------------------------------ events, refusals


@pytest.mark.parametrize("method", ["rk4", "heun", "dopri5"])
def test_a_penalty_released_by_an_event(method: str) -> None:
    """A stone in a sling that is released where its height passes a level: from there on it flies straight on."""
    system = System()
    system.add(parts.Point(mass=0.5, position=(1.0, 0.0, 0.0), velocity=(0.0, 2.0, 0.0)), "stone")
    system.add(parts.Event(law="height - 0.5", variables={"height": "stone.position.y"}), "high")
    system.add(
        parts.Joint(a=ORIGIN, b="stone", type="distance", stiffness=1e5, damping=200.0, released_by="high"), "sling"
    )  # fmt: skip
    times = np.array([0.0, 0.2, 0.5, 1.0])
    options = {"rtol": 1e-9, "atol": 1e-11} if method == "dopri5" else {"step": 2e-5}
    found = solve(system.assemble(), samples=times, method=method, **options)
    assert found.success
    when = math.asin(0.5) / 2.0
    assert found.event_times == pytest.approx([when], abs=1e-4)
    x = np.array([math.cos(2.0 * when), 0.5]) + 2.0 * (times[2:, None] - when) * np.array([-0.5, math.cos(2.0 * when)])
    assert coordinates(found.assembly, found.y, "stone")[2:, :2] == pytest.approx(x, abs=2e-3)
    assert found.la[1, 0] == pytest.approx(0.5 * 4.0, rel=1e-3)
    assert found.la[2:, 0] == pytest.approx([0.0, 0.0])
    assert np.abs(found.energy_defect).max() < 1e-4 * found.energy[0]


def craft() -> System:
    """Two bodies, a point mass, beams and cables at one point, and an event."""
    system = System()
    for name in ("hub", "box"):
        system.add(parts.RigidBody(mass=1.0, inertia=1.0), name)
    system.add(parts.Point(mass=1.0), "bob")
    for name, formulation in (("boom", "assumed_strain"), ("cord", "cable"), ("wire", "cable")):
        system.add(parts.Beam(length=1.0, elements=1, section=SQUARE, material=SOFT, formulation=formulation), name)
    system.add(parts.Event(law="t - 1"), "later")
    return system


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"a": "bob", "b": ("hub", ORIGIN), "type": "in-plane"}, "'in-plane', but a point mass has no directions"),
        ({"a": "cord.root", "b": "bob", "type": "point-on-line"}, "a node of a cable has no twist"),
        ({"a": "cord.root", "b": "wire.root", "type": "clamp"}, "nodes of two cables have no twist to hold"),
        ({"a": "cord.root", "b": "wire.root", "type": "cylindrical"}, "a node of a cable has no twist"),
        ({"a": "hub", "b": "bob", "type": "prismatic"}, "'prismatic', but a point mass has no directions"),
        ({"a": "boom.tip", "b": "boom.tip"}, "held.a and held.b are both 'boom.tip'; a joint needs two points"),
        ({"a": "hub", "b": "bob", "type": "universal"}, "held.axis_b is missing; a universal joint has two"),
        (
            {"a": "hub", "b": "boom.root", "type": "universal", "axis_b": (1.0, 0.0, 1.0)},
            "held.axis_b is .*, which is not perpendicular to held.axis",
        ),
        ({"a": "hub", "b": "boom.root", "axis_b": (1, 0, 0)}, "held.axis_b is given, but held.type is 'spherical'"),
        ({"a": "hub", "b": "boom.tip", "type": "helical"}, "type is 'helical'"),
        (
            {"a": ("hub", ORIGIN), "b": "boom.tip", "type": "cylindrical"},
            "held: b is 1 m off the line at the start; it must be on it",
        ),
        ({"a": "hub", "b": "boom.root", "stiffness": 1.0, "released_by": "bob"}, "is 'bob', neither an event"),
    ],
)
def test_refusals_name_the_joint_and_the_key(given: dict[str, Any], words: str) -> None:
    system = craft()

    def build() -> None:
        system.add(parts.Joint(**given), "held")
        system.assemble()

    with pytest.raises(InputError, match=words):
        build()


RELEASE = math.asin(0.5) / 2.0


@pytest.mark.slow
@pytest.mark.parametrize("method", ["generalized-alpha", "energy-momentum"])
@pytest.mark.parametrize("control", ["step", "tolerance"])
@pytest.mark.parametrize("stiffness", [0.0, 1e5])
def test_a_joint_released_by_an_event(method: str, control: str, stiffness: float, book: Book) -> None:
    """The sling as a constraint or a penalty: time of release, free flight after it, balances."""
    system = System()
    system.add(parts.Point(mass=0.5, position=(1.0, 0.0, 0.0), velocity=(0.0, 2.0, 0.0)), "stone")
    system.add(parts.Event(law="height - 0.5", variables={"height": "stone.position.y"}), "high")
    damping = 200.0 if stiffness else 0.0
    sling = parts.Joint(
        a=ORIGIN, b="stone", type="distance", stiffness=stiffness, damping=damping, released_by="high"
    )  # fmt: skip
    system.add(sling, "sling")
    options: dict[str, Any] = {"step": 2e-3} if control == "step" else {"tolerance": 1e-7}
    run = system.simulate(until=1.0, every=0.1, method=method, **options)
    t = run.time.values
    after = t > RELEASE
    x = np.array([math.cos(2.0 * RELEASE), 0.5]) + 2.0 * (t[after, None] - RELEASE) * np.array(
        [-0.5, math.cos(2.0 * RELEASE)]
    )
    error = float(np.abs(run["stone"].position.values[after, :2] - x).max())
    if not stiffness:
        book(
            "Rigid bodies", f"Sling released by an event ({method}, {control})", reference="straight flight",
            source="closed form", error=error, allowed=1e-4, unit="m",
        )  # fmt: skip
    assert error < (2e-3 if stiffness else 1e-4)
    force = np.linalg.norm(run["sling"].force.values, axis=-1)
    assert force[after] == pytest.approx(0.0, abs=1e-12)
    assert force[(t > 0.05) & (t < 0.25)] == pytest.approx(2.0, rel=2e-2)
    assert float(np.abs(run.energy_defect).max()) < 1e-3


@pytest.mark.parametrize("method", ["generalized-alpha", "energy-momentum"])
def test_the_time_of_an_event_is_logged(method: str) -> None:
    system = System()
    system.add(parts.Point(mass=0.5, position=(1.0, 0.0, 0.0), velocity=(0.0, 2.0, 0.0)), "stone")
    system.add(parts.Event(law="height - 0.5", variables={"height": "stone.position.y"}), "high")
    system.add(parts.Joint(a=ORIGIN, b="stone", type="distance", released_by="high"), "sling")
    found = solved(system, [0.0, 1.0], method, 1e-3)
    assert found.event_times == pytest.approx([RELEASE], abs=1e-6)
    assert found.event_kinds.tolist() == [0]


@pytest.mark.parametrize("solver", ["generalized-alpha", "energy-momentum"])
def test_an_event_stops_a_run(solver: str) -> None:
    """The state at which it fires is the last sample."""
    system = craft()
    system.add(parts.Event(law="t - 0.735", stops=True), "end")
    found = solved(system, [0.0, 0.5, 1.0, 1.5], solver, 1e-2)
    assert found.status == "stopped by event"
    assert found.message.startswith("an event stopped the run at t = 0.735")
    assert found.t == pytest.approx([0.0, 0.5, 0.735], abs=1e-7)
    assert found.event_times == pytest.approx([0.735], abs=1e-7)
