"""Boxes that touch planes, spheres, capsules and one another, against closed forms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import xarray as xr

from evolvent import InputError, System, parts

Array = np.ndarray
ENERGY, ALPHA = "energy-momentum", "generalized-alpha"
FLOOR = parts.Plane(normal=(0.0, 0.0, 1.0))
SIZE, MASS, K, G = (0.3, 0.2, 0.1), 1.0, 1e4, 10.0
METHODS = [ENERGY, ALPHA]


def simulated(system: System, until: float, step: float, method: str = ENERGY, **options: Any) -> xr.DataTree:
    """A run, sampled at ends of steps; energy-momentum with a spectral radius of 1 balances its energy."""
    if method == ENERGY:
        options = {"spectral_radius": 1.0} | options
    every = max(round(until / 50.0 / step), 1) * step
    run = system.simulate(until=until, method=method, step=step, every=every, **options)
    if method == ENERGY:
        assert np.abs(run.energy_defect.values).max() <= 1e-8 * max(float(run.energy.max()), 1.0)
    return run


def kept(run: xr.DataTree) -> None:
    """Momenta of bodies that only touch one another stay to round-off."""
    for name in ("momentum", "angular_momentum"):
        found: Any = run[name]
        values = found.values
        assert np.abs(values - values[0]).max() <= 1e-9 * max(np.abs(values).max(), 0.1)


# ------------------------------------------------------------------------------------------------ on a plane


def block(angle: float, mu: float, **law: Any) -> System:
    """A block on an incline, its depth that of equilibrium; the incline is the plane z = 0 in gravity tilted."""
    system = System(gravity=(G * math.sin(angle), 0.0, -G * math.cos(angle)))
    depth = MASS * G * math.cos(angle) / (4.0 * K)
    shape = parts.Box(size=SIZE)
    system.add(parts.RigidBody(mass=MASS, shape=shape, position=(0.0, 0.0, 0.5 * SIZE[2] - depth)), "block")
    law = {"stiffness": K, "friction": mu, "bristle_stiffness": 1e5, "bristle_damping": 100.0} | law
    system.add(parts.Contact(a="block", b=(0.0, 0.0, 0.0), shape=FLOOR, **law), "floor")
    return system


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("degrees", [16.0, 17.5, 30.0])
def test_block_on_an_incline(method: str, degrees: float) -> None:
    """It sticks below the limit angle, 16.7 degrees, and slides above it with g (sin - mu cos)."""
    mu, angle = 0.3, math.radians(degrees)
    run = simulated(block(angle, mu), 0.4, 1e-3, method)
    v = run["block"].velocity.values[:, 0]
    a = G * (math.sin(angle) - mu * math.cos(angle))
    if a < 0.0:
        assert abs(v[-1]) < 1e-3
        assert run["block"].position.values[-1, 0] < 3e-4  # the bristles' stretch and the tilt on the springs
    else:
        found = np.polyfit(run.time.values[10:], v[10:], 1)[0]
        assert found == pytest.approx(a, abs=2e-3 * G)
    np.testing.assert_allclose(run["floor"].normal_force.values[-1], MASS * G * math.cos(angle), rtol=5e-3)


def test_corners_share_the_weight() -> None:
    """A force off the middle: the four corners below bear what balance and equal springs give; the tilt too."""
    force, x, y = 4.0, 0.06, -0.03
    system = block(0.0, 0.5)
    system.add(parts.Load(at=("block", (x, y, 0.0)), force=(0.0, 0.0, -force)), "push")
    found = system.equilibrium()["floor"]
    total = MASS * G + force
    wanted = [
        0.25 * total + 0.25 * force * (x * sx / (0.5 * SIZE[0]) + y * sy / (0.5 * SIZE[1]))
        for sx in (-1, 1) for sy in (-1, 1)
    ]  # fmt: skip
    np.testing.assert_allclose(found.point_force.values[-1].reshape(2, 2, 2)[:, :, 0].ravel(), wanted, rtol=2e-3)
    np.testing.assert_allclose(found.force.values[-1], [0.0, 0.0, total], atol=1e-6)
    np.testing.assert_allclose(found.moment.values[-1], [y * force, -x * force, 0.0], atol=2e-3)


WIDTH, HEIGHT = 0.1, 0.6
RADIUS, SLENDER = 0.5 * math.hypot(WIDTH, HEIGHT), math.atan2(WIDTH, HEIGHT)


def rocking(start: float, stiffness: float, step: float, until: float, **law: Any) -> tuple[Array, Array, Array]:
    """A block released on one edge: times, tilt (rad) and rate (rad/s)."""
    c, s = math.cos(start), math.sin(start)
    x, z = -0.5 * WIDTH, 0.5 * HEIGHT  # of the middle, seen from the corner on which it stands
    system = System(gravity=(0.0, 0.0, -G))
    depth = MASS * G / (2.0 * stiffness)
    system.add(
        parts.RigidBody(
            mass=MASS, shape=parts.Box(size=(WIDTH, 0.3, HEIGHT)),
            position=(c * x + s * z, 0.0, -s * x + c * z - depth),
            orientation=(math.cos(0.5 * start), 0.0, math.sin(0.5 * start), 0.0),
        ),
        "block",
    )  # fmt: skip
    law = {"law": "conservative", "friction": 0.8, "bristle_stiffness": stiffness} | law
    system.add(parts.Contact(a="block", b=(0.0, 0.0, 0.0), shape=FLOOR, stiffness=stiffness, **law), "floor")
    run = simulated(system, until, step)
    q = run["block"].attitude.values
    return run.time.values, 2.0 * np.arctan2(q[:, 2], q[:, 0]), run["block"].rate.values[:, 1]


@pytest.mark.parametrize("share", [0.3, 0.6])
def test_quarter_period_of_a_rocking_block(share: float) -> None:
    """Housner, Bull. Seism. Soc. Am. 53 (1963), eq. 4: T/4 = acosh(1/(1 - start/slenderness))/p, p^2 = 3 g/(4 R).

    Exact but for the slenderness, 1.3e-3 at a third of it: a floor of 1e5 or of 1e8 N/m changes it by 1e-4.
    """
    p = math.sqrt(0.75 * G / RADIUS)
    quarter = math.acosh(1.0 / (1.0 - share)) / p
    time, tilt, _ = rocking(share * SLENDER, 1e6, 2e-4, 1.2 * quarter)
    k = int(np.argmax(tilt < 0.0))
    found = np.interp(0.0, -tilt[k - 1 : k + 1], time[k - 1 : k + 1])
    assert found == pytest.approx(quarter, rel=2e-3)


@pytest.mark.parametrize("damping", [0.0, 100.0])
def test_amplitude_after_the_impact_of_a_rocking_block(damping: float) -> None:
    """With much damping that of a plastic impact (eq. 10 of Housner): its rate falls to r = 1 - 1.5 sin(slenderness)^2.

    From the energy of the slender block, 1 - (1 - a)^2 falls by r^2 from each amplitude a, in slendernesses, to the
    next. A contact that gives all energy back loses some to bouncing alone: the amplitude stays above that.
    """
    start, r = 0.5, 1.0 - 1.5 * math.sin(SLENDER) ** 2
    plastic = 1.0 - math.sqrt(1.0 - r**2 * (1.0 - (1.0 - start) ** 2))
    law = {"law": "hunt-crossley", "damping": damping} if damping else {}
    until = 3.5 * math.acosh(1.0 / (1.0 - start)) / math.sqrt(0.75 * G / RADIUS)
    _, tilt, _ = rocking(start * SLENDER, 1e6, 2e-4, until, **law)
    found = -tilt.min() / SLENDER
    if damping:
        assert found == pytest.approx(plastic, rel=0.01)
    else:
        assert 1.05 * plastic < found < start


def test_sphere_and_box_are_refused_the_other_way_round() -> None:
    system = System()
    for name, shape in (("box", parts.Box(size=SIZE)), ("ball", parts.Sphere(radius=0.1))):
        system.add(parts.RigidBody(mass=1.0, shape=shape, position=(0.0, 0.0, len(name))), name)
    for given, words in (
        ({"a": "box", "b": "ball"}, "give the box as b"),
        ({"a": "ball", "b": "box", "rounding": 0.05}, "below half the smallest side"),
        ({"a": "box", "b": (0.0, 0.0, 2.5), "shape": parts.Box(size=SIZE), "rounding": 0.0}, "above 0 between two"),
        ({"a": "ball", "b": (0.0, 0.0, 0.0), "shape": FLOOR, "rounding": 0.01}, "neither shape is a box"),
        ({"a": "box", "b": (0.0, 0.0, 2.99), "shape": FLOOR}, "inside each other"),
    ):
        other = System()
        for name in ("box", "ball"):
            other.add(system.parts[name], name)
        other.add(parts.Contact(**given), "touch")
        with pytest.raises(InputError, match=words):
            other.assemble()


# ------------------------------------------------------------------------------------------------ spheres, capsules

PLACES: dict[str, tuple[Array, Array]] = {
    "face": (np.array([0.05, 0.03, 0.05]), np.array([0.0, 0.0, 1.0])),
    "edge": (np.array([0.15, 0.03, 0.05]), np.array([0.3, 0.0, 1.0])),
    "corner": (np.array([0.15, 0.1, 0.05]), np.array([0.4, 0.3, 1.0])),
}


def thrown(where: str, rounding: float, free: bool, **law: Any) -> tuple[System, Array, Array]:
    """A sphere on its way to a place of a box, its velocity and the normal there."""
    place, n = PLACES[where]
    n = n / np.linalg.norm(n)
    place = np.where(np.abs(place) == 0.5 * np.array(SIZE), place - rounding, place)
    v = -n + 0.2 * np.cross(n, [0.0, 1.0, 0.3])
    system, ball = System(), parts.Sphere(radius=0.1)
    at = place + (0.1 + rounding) * n - 0.03 * v
    system.add(parts.RigidBody(mass=MASS, shape=ball, position=tuple(at), velocity=tuple(v)), "ball")
    box: dict[str, Any] = {"b": (0.0, 0.0, 0.0), "shape": parts.Box(size=SIZE)}
    if free:
        system.add(parts.RigidBody(mass=2.0, shape=parts.Box(size=SIZE)), "box")
        box = {"b": "box"}
    system.add(parts.Contact(a="ball", **box, rounding=rounding, **law), "touch")
    return system, v, n


@pytest.mark.parametrize("where", PLACES)
@pytest.mark.parametrize("rounding", [0.0, 0.02])
def test_a_sphere_bounces_off_a_box(where: str, rounding: float) -> None:
    """The part of the velocity along the normal is reversed; it is exact at faces, and elsewhere of a hard contact."""
    system, v, n = thrown(where, rounding, False, law="conservative", stiffness=1e8)
    run = simulated(system, 0.06, 2e-5)
    found = run["ball"].velocity.values[-1]
    np.testing.assert_allclose(found, v - 2.0 * (v @ n) * n, atol=1e-9 if where == "face" else 1e-3)
    assert np.linalg.norm(found) == pytest.approx(np.linalg.norm(v), rel=1e-9)


@pytest.mark.parametrize("where", PLACES)
@pytest.mark.parametrize("mu", [0.0, 0.4])
def test_a_sphere_and_a_free_box(where: str, mu: float) -> None:
    """Soft, with long steps: both momenta stay, and so does energy without friction."""
    law = {"law": "conservative", "stiffness": K, "friction": mu, "bristle_stiffness": K}
    system, _, _ = thrown(where, 0.01, True, **law)
    run = simulated(system, 0.2, 2e-3)
    kept(run)
    assert run["touch"].impulse.values[-1] > 0.5
    kinetic = run.energy_kinetic.values
    if mu == 0.0:
        assert kinetic[-1] == pytest.approx(kinetic[0], rel=1e-9)
    else:
        assert kinetic[-1] < kinetic[0]


def test_methods_agree() -> None:
    """Off an edge of a free box, under generalized-alpha, rk4 and dopri5."""

    def system() -> System:
        return thrown("edge", 0.01, True, stiffness=K, friction=0.3, bristle_stiffness=K)[0]

    exact = simulated(system(), 0.15, 2e-5, ALPHA)
    for method in ("rk4", "dopri5"):
        run = system().simulate(until=0.15, method=method, every=0.01)
        for name in ("ball", "box"):
            np.testing.assert_allclose(run[name].velocity.values[-1], exact[name].velocity.values[-1], atol=2e-3)
        assert abs(float(run.energy_defect.values[-1])) < 1e-3


def test_a_capsule_lies_across_a_box() -> None:
    """Longer than the box: two edges bear its weight; shorter: its ends do."""
    for length, points in ((0.6, "edges"), (0.2, "ends")):
        system = System(gravity=(0.0, 0.0, -G))
        rod: Any = parts.Capsule(radius=0.05, length=length, axis=(1.0, 0.0, 0.0))
        depth = MASS * G / (2.0 * K)
        at = (0.0, 0.02, 0.5 * SIZE[2] + 0.05 - depth)
        system.add(parts.RigidBody(mass=MASS, shape=rod, position=at), "rod")
        law = {"stiffness": K, "friction": 0.5, "bristle_stiffness": K}
        system.add(parts.Contact(a="rod", b=(0.0, 0.0, 0.0), shape=parts.Box(size=SIZE), **law), "touch")
        found = system.equilibrium()["touch"]
        force = found.point_force.values[-1]
        assert np.flatnonzero(force).size == 2
        np.testing.assert_allclose(force[force > 0.0], 0.5 * MASS * G, rtol=1e-3)
        x = found.point_position.values[-1][force > 0.0][:, 0]
        np.testing.assert_allclose(np.sort(x), [-0.15, 0.15] if points == "edges" else [-0.1, 0.1], atol=1e-3)


# ------------------------------------------------------------------------------------------------ two boxes


def stacked(method: str, g: float, upper: tuple[float, float]) -> xr.DataTree:
    """Two plates on the ground in a launch's acceleration g."""
    system = System(gravity=(0.0, 0.0, -g))
    law = {"stiffness": 1e5, "damping": 5.0}
    for k, size in enumerate(((0.5, 0.4, 0.02), (*upper, 0.02))):
        system.add(
            parts.RigidBody(mass=1.0, shape=parts.Box(size=size), position=(0.0, 0.0, 0.01 + 0.02 * k)), f"plate{k}"
        )
    system.add(parts.Contact(a="plate0", b=(0.0, 0.0, 0.0), shape=FLOOR, **law), "floor")
    system.add(parts.Contact(a="plate1", b="plate0", **law), "between")
    return system.simulate(until=0.5, method=method, step=1e-3, every=0.01)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("upper", [(0.5, 0.4), (0.3, 0.3)])
def test_stacked_plates_bear_a_launch(method: str, upper: tuple[float, float]) -> None:
    """Each contact carries what is above it, with equal shares of the corners: eight of equal plates, else four."""
    g = 100.0
    run = stacked(method, g, upper)
    np.testing.assert_allclose(run["floor"].normal_force.values[-1], 2.0 * g, rtol=1e-4)
    np.testing.assert_allclose(run["between"].normal_force.values[-1], g, rtol=1e-4)
    force = run["between"].point_force.values[-1]
    count = 8 if upper == (0.5, 0.4) else 4
    assert run["between"].points.values[-1] == count
    np.testing.assert_allclose(force[force > 0.0], g / count, rtol=1e-3)
    np.testing.assert_allclose(run["between"].force.values[-1], [0.0, 0.0, g], atol=0.01)


@pytest.mark.parametrize("mu", [0.0, 0.3])
@pytest.mark.parametrize("law", ["conservative", "hunt-crossley"])
@pytest.mark.parametrize("step", [5e-4, 2e-3])
def test_two_boxes_collide(mu: float, law: str, step: float) -> None:
    """Any way: both momenta stay; energy stays without friction and damping, else does not grow."""
    turned = np.array([0.9, 0.3, 0.25, 0.1])
    system = System()
    small, large = parts.Box(size=(0.2, 0.2, 0.2)), parts.Box(size=(0.6, 0.4, 0.2))
    system.add(
        parts.RigidBody(
            mass=1.0, shape=small, position=(0.05, 0.03, 0.35), orientation=tuple(turned / np.linalg.norm(turned)),
            velocity=(0.1, 0.0, -1.0), angular_velocity=(0.3, -0.2, 0.5),
        ),
        "small",
    )  # fmt: skip
    system.add(parts.RigidBody(mass=2.0, shape=large, angular_velocity=(0.1, 0.2, 0.3)), "large")
    given = {"law": law, "stiffness": K, "friction": mu, "bristle_stiffness": K}
    system.add(parts.Contact(a="small", b="large", **given), "touch")
    run = simulated(system, 0.5, step)
    kept(run)
    assert run["touch"].impulse.values[-1] > 0.3
    kinetic = run.energy_kinetic.values
    if mu == 0.0 and law == "conservative":
        assert kinetic[-1] == pytest.approx(kinetic[0], rel=1e-8)
    else:
        assert kinetic[-1] <= kinetic[0] * (1.0 + 1e-8)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("flat", [False, True])
def test_bars_collide_edge_against_edge(flat: bool, method: str) -> None:
    """Bars that cross, on one edge each or flat: -v/3 and 2 v/3 of masses 1 and 2; one crossing of edges, or four."""
    c, s = math.cos(math.pi / 8.0), math.sin(math.pi / 8.0)
    high = 0.1 if flat else 0.1 * math.sqrt(2.0)
    law = "conservative" if method == ENERGY else "hunt-crossley"
    system = System()
    for name, size, turned, at, v in (
        ("first", (1.0, 0.1, 0.1), (c, s, 0.0, 0.0), high + 0.03, -1.0),
        ("second", (0.1, 1.0, 0.1), (c, 0.0, s, 0.0), 0.0, 0.0),
    ):  # fmt: skip
        own = {
            "orientation": (1.0, 0.0, 0.0, 0.0) if flat else turned,
            "position": (0.0, 0.0, at),
            "velocity": (0.0, 0.0, v),
        }
        system.add(parts.RigidBody(mass=1.0 if name == "first" else 2.0, shape=parts.Box(size=size), **own), name)
    system.add(parts.Contact(a="first", b="second", law=law, stiffness=K), "touch")
    run = simulated(system, 0.3, 1e-3 if method == ENERGY else 1e-4, method)
    for name, speed in (("first", 1.0 / 3.0), ("second", -2.0 / 3.0)):
        np.testing.assert_allclose(
            run[name].velocity.values[-1], [0.0, 0.0, speed], atol=1e-8 if method == ENERGY else 1e-4
        )
    assert run["touch"].points.values.max() == (4 if flat else 1)
    assert run["touch"].impulse.values[-1] == pytest.approx(4.0 / 3.0, abs=1e-4)


def test_fast_bodies_do_not_pass_through_a_plate() -> None:
    """A ball, and a bar edge on edge, that would be on the other side after a step are caught."""
    plate = parts.Box(size=(1.0, 1.0, 0.02))
    for shape in (parts.Sphere(radius=0.005), parts.Box(size=(0.02, 0.02, 0.02))):
        system = System()
        system.add(
            parts.RigidBody(mass=0.1, shape=shape, position=(0.1, 0.05, 0.5), velocity=(0.0, 0.0, -20.0)), "ball"
        )
        system.add(parts.Contact(a="ball", b=(0.0, 0.0, 0.0), shape=plate, law="conservative", stiffness=1e6), "touch")
        run = simulated(system, 0.1, 5e-3)
        assert run["ball"].velocity.values[-1, 2] == pytest.approx(20.0, rel=1e-8)
