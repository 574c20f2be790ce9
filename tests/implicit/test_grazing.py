"""Bodies that graze and meet one another: velocities behind an impact at default tolerances."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from evolvent import System, parts

pytestmark = pytest.mark.slow

Array = np.ndarray
RADIUS, STIFFNESS, G = 0.1, 1e6, 9.81
#: Largest error of a velocity, of the speed of the impact.
BOUND = 2.5e-3


def from_line(x: Array, half: float, radius: float) -> tuple[float, Array]:
    """Gap of the sphere from a capsule along z, and its gradient; of a sphere `half` is 0."""
    d = x - np.array([0.0, 0.0, np.clip(x[2], -half, half)])
    size = float(np.linalg.norm(d))
    return size - radius - RADIUS, d / size


def from_box(x: Array, sides: Array, rounding: float) -> tuple[float, Array]:
    """Gap of the sphere from a box with round edges, outside of it."""
    m = np.sign(x) * np.maximum(np.abs(x) - (sides - rounding), 0.0)
    size = float(np.linalg.norm(m))
    return size - rounding - RADIUS, m / size


def behind(gap: Callable[[Array], tuple[float, Array]], x: Array, v: Array, gravity: float, until: float) -> Array:
    """Velocity of a sphere of 1 kg after an impact on a fixed obstacle, by another integrator."""

    def rates(_: float, y: Array) -> Array:
        depth, normal = gap(y[:3])
        force = STIFFNESS * max(-depth, 0.0) * normal
        return np.concatenate([y[3:], force - [0.0, 0.0, gravity]])

    found = solve_ivp(rates, (0.0, until), np.concatenate([x, v]), rtol=1e-9, atol=1e-12, max_step=2e-4 * until)
    return np.array(found.y[3:, -1])


def thrown(x: Any, v: Any, shape: Any, gravity: float = 0.0, **keys: Any) -> System:
    """A sphere of 1 kg beside a fixed obstacle at the origin."""
    system = System(gravity=(0.0, 0.0, -gravity))
    ball = {"mass": 1.0, "inertia": 0.004, "shape": parts.Sphere(radius=RADIUS)}
    system.add(parts.RigidBody(position=tuple(x), velocity=tuple(v), **ball), "ball")
    contact = {"stiffness": STIFFNESS, "shape": shape} | keys
    system.add(parts.Contact(a="ball", b=(0.0, 0.0, 0.0), **contact), "contact")
    return system


SHAPES: dict[str, tuple[Any, Callable[[Array], tuple[float, Array]], Array, dict[str, Any]]] = {
    "sphere": (parts.Sphere(radius=0.1), lambda x: from_line(x, 0.0, 0.1), np.array([0.0, 0.2, 0.0]), {}),
    "cylinder": (
        parts.Capsule(radius=0.1, length=0.4, axis=(0.0, 0.0, 1.0)), lambda x: from_line(x, 0.2, 0.1),
        np.array([0.0, 0.2, 0.1]), {},
    ),
    "edge": (
        parts.Box(size=(0.2, 0.2, 0.2)), lambda x: from_box(x, np.full(3, 0.1), 0.02), np.array([0.0, 0.2, 0.03]),
        {"rounding": 0.02},
    ),
}  # fmt: skip


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize(("depth", "speed"), [(1e-4, 5.0), (1e-3, 0.5), (1e-3, 2.0), (1e-2, 2.0), (0.1, 2.0)])
def test_a_graze_of_any_depth(shape: str, depth: float, speed: float) -> None:
    """A sphere flies by and overlaps by `depth` on its way, under default energy-momentum."""
    obstacle, gap, beside, keys = SHAPES[shape]
    x, v = beside - [1.0, depth, 0.0], np.array([speed, 0.0, 0.0])
    until = 2.0 / speed
    run = thrown(x, v, obstacle, **keys).simulate(until=until, every=until / 10.0, fine=False)
    assert run.attrs["method"] == "energy-momentum"
    assert run["ball"].velocity.values[-1] == pytest.approx(behind(gap, x, v, 0.0, until), abs=BOUND * speed)


@pytest.mark.parametrize("method", ["generalized-alpha", "dopri5"])
def test_a_graze_under_other_methods(method: str) -> None:
    """1 mm deep, at their default tolerances."""
    obstacle, gap, beside, keys = SHAPES["sphere"]
    x, v = beside - [1.0, 1e-3, 0.0], np.array([2.0, 0.0, 0.0])
    run = thrown(x, v, obstacle, **keys).simulate(until=1.0, every=0.1, method=method, fine=False)
    assert run["ball"].velocity.values[-1] == pytest.approx(behind(gap, x, v, 0.0, 1.0), abs=0.01)


@pytest.mark.parametrize("depth", [1e-4, 1e-3, 1e-2])
def test_a_throw_that_just_reaches_a_ceiling(depth: float) -> None:
    """The top of the flight would lie `depth` beyond the plane, on which steps do not end."""
    height = 1.0 + depth - RADIUS
    v = math.sqrt(2.0 * G * height)
    plane = parts.Plane(normal=(0.0, 0.0, -1.0))

    def gap(x: Array) -> tuple[float, Array]:
        return -float(x[2]) - RADIUS, np.array([0.0, 0.0, -1.0])

    x, speed = np.array([0.0, 0.0, -1.0]), np.array([1.0, 0.0, v])
    run = thrown(x, speed, plane, gravity=G).simulate(until=0.8, every=0.1, fine=False)
    assert run["ball"].velocity.values[-1] == pytest.approx(behind(gap, x, speed, G, 0.8), abs=BOUND * v)


@pytest.mark.parametrize("friction", [0.0, 0.1])
@pytest.mark.parametrize(("along", "down"), [(2.0, 0.2), (2.0, 2.0), (5.0, 1.0)])
def test_an_oblique_impact_on_a_plane(friction: float, along: float, down: float) -> None:
    """The normal velocity is reversed; a sphere that slides all the time loses 2 mu times it along the plane."""
    plane = parts.Plane(normal=(0.0, 0.0, 1.0))
    x, v = np.array([0.0, 0.0, RADIUS + 0.5 * down]), np.array([along, 0.0, -down])
    run = thrown(x, v, plane, friction=friction, **({"bristle_stiffness": STIFFNESS} if friction else {})).simulate(
        until=1.0, every=0.1, fine=False
    )
    speed = float(np.linalg.norm(v))
    slides = along - 2.0 * friction * down
    bound = BOUND if friction == 0.0 else 2.0 * BOUND
    assert run["ball"].velocity.values[-1] == pytest.approx([slides, 0.0, down], abs=bound * speed)


def test_two_free_spheres_graze() -> None:
    """Momentum is kept, and the line of centres at the touch takes the impulse of hard spheres, for a stiff contact."""
    system = System()
    ball = {"mass": 1.0, "inertia": 0.004, "shape": parts.Sphere(radius=RADIUS)}
    system.add(parts.RigidBody(position=(-3.0, 0.19, 0.0), velocity=(2.0, 0.0, 0.0), **ball), "a")
    system.add(parts.RigidBody(**ball), "b")
    system.add(parts.Contact(a="a", b="b", stiffness=1e8), "contact")
    run = system.simulate(until=3.0, every=0.1, fine=False)
    n = np.array([-math.sqrt(0.04 - 0.19**2), 0.19, 0.0]) / 0.2
    expected = np.array([2.0, 0.0, 0.0]) - 2.0 * n[0] * n
    a, b = run["a"].velocity.values[-1], run["b"].velocity.values[-1]
    assert a == pytest.approx(expected, abs=BOUND * 2.0)
    assert a + b == pytest.approx([2.0, 0.0, 0.0], abs=1e-9)


@pytest.mark.parametrize("method", ["dopri5", "generalized-alpha", "energy-momentum"])
@pytest.mark.parametrize(
    "shape", [parts.Plane(normal=(0.0, 0.0, 1.0)), parts.Sphere(radius=0.3)], ids=["plane", "sphere"]
)
def test_a_body_at_rest_that_just_touches_is_no_graze(method: str, shape: Any) -> None:
    """The gap is zero but for round-off at every place of a step on which nothing moves."""
    far = 0.0 if isinstance(shape, parts.Plane) else 0.3
    for x in (3.0, 0.7) if far == 0.0 else (0.1, 0.2, 0.3):
        height = RADIUS if far == 0.0 else math.sqrt((far + RADIUS) ** 2 - x * x)
        run = thrown((x, 0.0, height), (0.0, 0.0, 0.0), shape).simulate(until=1.0, method=method)
        assert run.attrs["status"] == "success"
        assert abs(run["ball"].position.values - [x, 0.0, height]).max() < 1e-9
