"""Bodies, point masses and springs, against what follows from the raw state."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import evolvent
from evolvent import System, parts
from evolvent.parts.base import unit
from observe.seeing import EXPLICIT, IMPLICIT, INNER, close, derivative, matrices, run, turned

INERTIA = ((0.5, 0.03, -0.02), (0.03, 0.4, 0.05), (-0.02, 0.05, 0.3))
METHODS = pytest.mark.parametrize("method", [EXPLICIT, IMPLICIT])


@METHODS
def test_a_free_body(method: str) -> None:
    """Tumbling over several turns: attitude without jumps, rate, momenta and energy, which are kept."""
    system = System()
    body = parts.RigidBody(
        mass=3.0, inertia=INERTIA, position=(0.1, -0.2, 0.3), velocity=(0.5, 0.2, -0.1),
        orientation=unit((0.2, -0.5, 0.6, 0.3)), angular_velocity=(1.0, -2.0, 6.0),
    )  # fmt: skip
    system.add(body, "body")
    options = {"step": 2e-4} if method == IMPLICIT else {}
    found = run(system, np.linspace(0.0, 3.0, 601), method, **options)
    v, w = found.state("body", 3, rate=True), found.state("body", 3, at=3, rate=True)
    R, J = found.rotation("body"), np.array(INERTIA)
    spin = turned(R, w @ J)
    close(found.of("body", "position"), found.state("body", 3))
    close(found.of("body", "velocity"), v)
    close(found.of("body", "rate"), w)
    close(matrices(found.of("body", "attitude")), R)
    assert np.abs(np.diff(found.of("body", "attitude"), axis=0)).max() < 0.03
    # R' R^T is the matrix of the angular velocity, inertial axes
    turning = derivative(found.t, R) @ np.swapaxes(R[INNER], 1, 2)
    close(turned(R, found.of("body", "rate"))[INNER], turning[:, [2, 0, 1], [1, 2, 0]], part=1e-4)
    close(found.of("body", "momentum"), 3.0 * v)
    close(found.of("body", "angular_momentum"), spin)
    close(found.of("body", "angular_momentum"), spin[0], part=1e-4)
    energy = 1.5 * np.sum(v**2, axis=1) + 0.5 * np.einsum("ti,ij,tj->t", w, J, w)
    close(found.of("body", "energy_kinetic"), energy)
    assert "angle" not in found.tree["body"]


@METHODS
def test_a_spinning_body(method: str) -> None:
    """About an axis askew, over several turns between two samples."""
    system, axis, rate, start = System(), np.array([2.0, -1.0, 2.0]) / 3.0, 40.0, (0.5, 0.5, 0.1, -0.7)
    body = parts.RigidBody(motion="spin", inertia=INERTIA, axis=tuple(axis), rate=rate, orientation=start)
    system.add(body, "wheel")
    found = run(system, np.linspace(0.0, 2.0, 9), method)
    R0, turn = matrices(np.array(start)), Rotation.from_rotvec(np.outer(rate * found.t, axis)).as_matrix()
    inertia = axis @ np.array(INERTIA) @ axis
    close(found.of("wheel", "angle"), rate * found.t, part=1e-8)
    close(found.of("wheel", "rate"), rate * axis)
    close(matrices(found.of("wheel", "attitude")), R0 @ turn, part=1e-7)
    close(found.of("wheel", "angular_momentum"), inertia * rate * (R0 @ axis))
    close(found.of("wheel", "energy_kinetic"), 0.5 * inertia * rate**2)
    fine = run(system, np.linspace(0.0, 2.0, 2001), method).of("wheel", "attitude")
    assert np.abs(np.diff(fine, axis=0)).max() < 0.05  # a quaternion changes its sign in a turn; it must not jump


def test_a_driven_body() -> None:
    """Its motion is given: no balance counts its momenta."""
    system = System()
    system.add(parts.RigidBody(motion="driven", axis=(0.0, 1.0, 0.0), rate=3.0, position=(1.0, 2.0, 3.0)), "base")
    system.add(parts.Point(mass=1.0), "mass")
    found = run(system, np.linspace(0.0, 4.0, 41))
    turn = Rotation.from_rotvec(np.outer(3.0 * found.t, [0.0, 1.0, 0.0])).as_matrix()
    close(matrices(found.of("base", "attitude")), turn)
    close(found.of("base", "angle"), 3.0 * found.t)
    close(found.of("base", "rate"), np.array([0.0, 3.0, 0.0]))
    close(found.of("base", "position"), np.array([1.0, 2.0, 3.0]))
    assert {"momentum", "angular_momentum", "energy_kinetic"}.isdisjoint(found.tree["base"].data_vars)


@METHODS
def test_a_free_point(method: str) -> None:
    system, g = System(gravity=(0.0, 0.0, -9.81)), np.array([0.0, 0.0, -9.81])
    system.add(parts.Point(mass=2.0, position=(1.0, 0.0, 0.0), velocity=(0.5, 0.0, 3.0)), "ball")
    found = run(system, np.linspace(0.0, 0.5, 26), method)
    t = found.t[:, None]
    v = np.array([0.5, 0.0, 3.0]) + g * t
    close(found.of("ball", "position"), np.array([1.0, 0.0, 0.0]) + t * np.array([0.5, 0.0, 3.0]) + 0.5 * g * t**2)
    close(found.of("ball", "velocity"), v)
    close(found.of("ball", "speed"), np.linalg.norm(v, axis=1))
    close(found.of("ball", "momentum"), 2.0 * v)
    close(found.of("ball", "energy_kinetic"), np.sum(v**2, axis=1))
    assert "force" not in found.tree["ball"]


def test_a_point_fixed_to_a_body() -> None:
    """The force that fixes it is m (a - g)."""
    system, g = System(gravity=(0.0, 0.0, -2.0)), np.array([0.0, 0.0, -2.0])
    hub = parts.RigidBody(mass=5.0, inertia=INERTIA, points={"left": (0.3, 0.1, 0.0)}, angular_velocity=(1.0, 3.0, 2.0))
    system.add(hub, "hub")
    system.add(parts.Point(mass=0.4, at="hub.left"), "ball")
    found = run(system, np.linspace(0.0, 1.0, 401), step=1.25e-3, spectral_radius=0.3)
    close(
        found.of("ball", "position"), found.state("hub", 3) + turned(found.rotation("hub"), (0.3, 0.1, 0.0)), part=1e-7
    )
    wanted = 0.4 * (derivative(found.t, found.state("ball", 3, rate=True)) - g)
    close(found.of("ball", "force")[INNER][4:], wanted[4:], part=2e-3)


@evolvent.law
def hardening(extension, rate, t, p):
    return p[0] * extension + p[1] * extension**3 + p[2] * rate


@METHODS
@pytest.mark.parametrize("law", [None, hardening])
def test_springs(method: str, law: object) -> None:
    """The force on one of two masses is what it accelerates by."""
    system = System()
    system.add(parts.Point(mass=1.0, velocity=(0.0, 0.4, 0.1)), "a")
    system.add(parts.Point(mass=2.0, position=(0.5, 0.1, 0.0)), "b")
    given = {"stiffness": 30.0, "damping": 0.5} if law is None else {"law": law, "parameters": (30.0, 200.0, 0.5)}
    system.add(parts.Spring(a="a", b="b", length=0.4, **given), "spring")
    options = {"step": 1e-3, "spectral_radius": 1.0} if method == IMPLICIT else {"tolerance": 1e-9}
    found = run(system, np.linspace(0.0, 2.0, 401), method, **options)
    apart = found.state("b", 3) - found.state("a", 3)
    length = np.linalg.norm(apart, axis=1)
    rate = np.sum(apart * (found.state("b", 3, rate=True) - found.state("a", 3, rate=True)), axis=1) / length
    off = length - 0.4
    close(found.of("spring", "length"), length)
    close(found.of("spring", "extension"), off)
    close(found.of("spring", "extension_rate"), rate)
    close(found.of("spring", "force"), 30.0 * off + 0.5 * rate + (0.0 if law is None else 200.0 * off**3))
    pulled = derivative(found.t, found.state("a", 3, rate=True))  # of 1 kg
    close((found.of("spring", "force") / length)[INNER, None] * apart[INNER], pulled, part=2e-4)
    close(found.of("spring", "ends"), np.stack([found.state("a", 3), found.state("b", 3)], axis=1))
    if law is None:
        close(found.of("spring", "energy_elastic"), 15.0 * off**2)
    else:
        assert "energy_elastic" not in found.tree["spring"]


@METHODS
def test_lateral_stiffness(method: str) -> None:
    """Springs along and across the mount together are what the mass accelerates by."""
    system, axis = System(), np.array([0.6, 0.0, 0.8])
    system.add(parts.Point(mass=2.0, position=(0.7, 0.05, 0.75), velocity=(0.3, -0.2, 0.1)), "mass")
    mount = parts.Spring(
        a=(0.0, 0.0, 0.0), b="mass", stiffness=50.0, damping=1.0, length=1.0, lateral_stiffness=20.0,
        lateral_damping=2.0, axis=tuple(axis),
    )  # fmt: skip
    system.add(mount, "mount")
    options = {"step": 1e-3, "spectral_radius": 1.0} if method == IMPLICIT else {"tolerance": 1e-9}
    found = run(system, np.linspace(0.0, 2.0, 401), method, **options)
    x, v = found.state("mass", 3), found.state("mass", 3, rate=True)
    across = np.eye(3) - np.outer(axis, axis)
    close(found.of("mount", "lateral_force"), -20.0 * x @ across - 2.0 * v @ across)
    length = np.linalg.norm(x, axis=1)
    force = found.of("mount", "lateral_force") - (found.of("mount", "force") / length)[:, None] * x
    close(force[INNER], 2.0 * derivative(found.t, v), part=2e-4)
    stored = 25.0 * (length - 1.0) ** 2 + 10.0 * np.sum((x @ across) ** 2, axis=1)
    close(found.of("mount", "energy_elastic"), stored)


def test_a_slack_spring_whose_ends_coincide_has_no_force() -> None:
    system = System()
    system.add(parts.Point(mass=1.0), "mass")
    system.add(parts.Spring(a=(0.0, 0.0, 0.0), b="mass", stiffness=10.0, length=0.5, slack=True), "spring")
    found = run(system, [0.0, 0.1])
    assert found.of("spring", "force").tolist() == [0.0, 0.0]
    assert math.isclose(found.of("spring", "extension")[0], -0.5)
