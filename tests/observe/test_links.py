"""Links, cords and guides, against Newton's law."""

from __future__ import annotations

import math

import numpy as np
import pytest

from evolvent import System, parts
from observe.seeing import EXPLICIT, IMPLICIT, close, run, turned

METHODS = pytest.mark.parametrize("method", [EXPLICIT, IMPLICIT])
G = 9.81


def options(method: str) -> dict[str, float]:
    return {"step": 2e-3, "spectral_radius": 0.3} if method == IMPLICIT else {"tolerance": 1e-9}


@METHODS
def test_a_pendulum(method: str) -> None:
    """Tension m (g cos(phi) + v^2/L)."""
    system = System(gravity=(0.0, 0.0, -G))
    system.add(parts.Point(mass=1.5, position=(0.8, 0.0, 0.0)), "bob")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="bob", type="link"), "rod")
    found = run(system, np.linspace(0.0, 1.0, 101), method, **options(method))
    x, v = found.state("bob", 3), found.state("bob", 3, rate=True)
    wanted = 1.5 * (-G * x[:, 2] / 0.8 + np.sum(v**2, axis=1) / 0.8)
    close(found.of("rod", "tension"), wanted, part=1e-3)
    close(found.of("rod", "length"), 0.8, part=1e-6)
    close(found.of("rod", "ends")[:, 1], x)
    close(found.of("rod", "force"), -wanted[:, None] * x / 0.8, part=1e-3)


@METHODS
def test_a_link_between_bodies_pushes(method: str) -> None:
    """Two bodies held apart by a link against a spring: its force is the spring's, with the sign of a push."""
    system = System()
    for name, x in (("a", 0.0), ("b", 1.0)):
        system.add(parts.RigidBody(mass=1.0, inertia=0.1, position=(x, 0.0, 0.0)), name)
    system.add(parts.Joint(a=("a", (0.1, 0.0, 0.0)), b=("b", (-0.1, 0.0, 0.0)), type="link"), "strut")
    system.add(parts.Spring(a="a", b="b", stiffness=20.0, length=0.7), "spring")
    found = run(system, np.linspace(0.0, 0.2, 5), method)
    close(found.of("strut", "tension"), -6.0, part=1e-6)
    close(found.of("strut", "force")[:, 0], 6.0, part=1e-6)
    close(found.of("spring", "force"), 6.0, part=1e-6)


@METHODS
def test_a_cord_on_a_drum(method: str) -> None:
    """A mass that circles a post at speed v on a cord of free length s: tension m v^2/s, s + R wound the whole."""
    R, s, v, m = 0.1, 1.0, 0.7, 0.5
    system = System()
    system.add(parts.Point(mass=m, position=(R, s, 0.0), velocity=(v, 0.0, 0.0)), "bob")
    cord = parts.Joint(
        a=(0.0, 0.0, 0.0), b="bob", type="link", length=s + 2.0 * math.pi * R, drum=R, anchor=(1.0, 0.0, 0.0), sense=1
    )
    system.add(cord, "cord")
    found = run(system, np.linspace(0.0, 1.0, 21), method, **options(method))
    # the involute: s s' = +-R v
    sign = -1.0 if found.of("cord", "length")[-1] < s else 1.0
    free = np.sqrt(s**2 + sign * 2.0 * R * v * found.t)
    close(found.of("cord", "length"), free, part=1e-4)
    close(found.of("cord", "wound_length"), s + 2.0 * math.pi * R - free, part=5e-3)
    close(found.of("cord", "tension"), m * v**2 / free, part=1e-3)
    rate = np.gradient(found.state("bob", 3, rate=True), found.t, axis=0, edge_order=2)
    close(found.of("cord", "force"), m * rate, part=2e-2)
    ends = found.of("cord", "ends")
    close(np.linalg.norm(ends[:, 0], axis=1), R)
    close(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1), free, part=1e-4)
    close(np.sum(ends[:, 0] * (ends[:, 1] - ends[:, 0]), axis=1) + 1.0, 1.0)  # tangent to the drum


@METHODS
def test_guides(method: str) -> None:
    """One bears the weight, the other a torque across its axis."""
    system = System(gravity=(0.0, 0.0, -G))
    system.add(parts.RigidBody(mass=2.0, inertia=(0.2, 0.3, 0.4), velocity=(0.3, 0.0, 0.0)), "body")
    system.add(parts.Joint(a="ground", b="body", type="guide", axis=(0.0, 0.0, 1.0)), "level")
    system.add(parts.Joint(a="ground", b="body", type="guide", axis=(0.0, 0.0, 1.0), axis_b=(1.0, 0.0, 0.0)), "upright")
    system.add(parts.Load(at="body", torque=(0.0, 0.7, 0.0)), "torque")
    found = run(system, np.linspace(0.0, 0.5, 6), method)
    close(found.of("level", "force"), np.array([0.0, 0.0, 2.0 * G]), part=1e-6)
    close(found.of("level", "reaction"), 2.0 * G, part=1e-6)
    close(found.of("upright", "moment"), np.array([0.0, -0.7, 0.0]), part=1e-6)
    close(found.of("upright", "reaction"), 0.7, part=1e-6)  # about axis x direction, which is -y
    close(found.of("level", "position"), found.state("body", 3))


@METHODS
def test_a_guide_of_a_turned_body(method: str) -> None:
    """A spinning body under a torque across: the guide's moment and that torque leave only what turns about z."""
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=(0.2, 0.2, 0.4), angular_velocity=(0.0, 0.0, 2.0)), "body")
    for k, axis in enumerate(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))):
        system.add(parts.Joint(a="ground", b="body", type="guide", axis=(0.0, 0.0, 1.0), axis_b=axis), f"axis {k}")
    system.add(parts.Load(at="body", torque=(0.3, -0.2, 0.1)), "torque")
    found = run(system, np.linspace(0.0, 1.0, 11), method, **options(method))
    moment = found.of("axis 0", "moment") + found.of("axis 1", "moment")
    close(moment, np.array([-0.3, 0.2, 0.0]), part=1e-4)
    w = turned(found.rotation("body"), found.state("body", 3, at=3, rate=True))
    close(w[:, 2], 2.0 + 0.1 / 0.4 * found.t, part=3e-3)
    assert math.isclose(found.of("axis 0", "reaction")[0], -0.2, rel_tol=1e-4)
