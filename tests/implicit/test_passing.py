"""Nothing passes through what it touches in one step, however fast it is, under any method."""

from __future__ import annotations

import numpy as np
import pytest

from evolvent import RunFailed, System, elements, parts

pytestmark = pytest.mark.slow

SPEED, RADIUS, UNTIL = 20.0, 0.05, 0.2
ADAPTIVE = ("generalized-alpha", "energy-momentum", "dopri5")


def spheres() -> System:
    """A sphere that flies at another one at rest, of the same mass, and meets it after a quarter of the run."""
    system = System()
    shape = parts.Sphere(radius=RADIUS)
    system.add(parts.RigidBody(mass=1.0, shape=shape, position=(-1.0, 0.0, 0.0), velocity=(SPEED, 0.0, 0.0)), "thrown")
    system.add(parts.RigidBody(mass=1.0, shape=shape), "struck")
    system.add(parts.Contact(a="thrown", b="struck", stiffness=1e5), "contact")
    return system


def flying(kind: str, surface: str) -> System:
    """A short stiff beam or rod that flies across its axis at a fixed surface, which it meets with its middle."""
    system = System()
    section = elements.Rectangle(thickness=1e-2, width=1e-2)
    material = elements.Material(young_modulus=1e9, poisson_ratio=0.3, density=1000.0)
    given = {
        "length": 0.2, "section": section, "material": material, "elements": 2, "position": (-0.1, 1.0, 0.0),
        "velocity": (0.0, -SPEED, 0.0), "stiffness_damping": 1e-5,
    }  # fmt: skip
    system.add(parts.Rod(**given) if kind == "rod" else parts.Beam(formulation=kind, **given), "bar")
    keys = {"radius": RADIUS} | ({"length": 0.3} if surface == "capsule" else {})
    system.add(parts.Contact(a="bar", b="ground", shape={surface: keys}, stiffness=1e5), "obstacle")
    return system


@pytest.mark.parametrize("method", ADAPTIVE)
def test_spheres_collide(method: str) -> None:
    """The speed goes over to the struck sphere: an elastic impact of equal masses."""
    run = spheres().simulate(until=UNTIL, every=0.1, method=method, fine=False)
    assert abs(run["thrown"].velocity.values[-1, 0]) < 0.05 * SPEED
    assert run["struck"].velocity.values[-1, 0] == pytest.approx(SPEED, rel=0.02)


@pytest.mark.parametrize("method", ADAPTIVE[:2])
def test_spheres_collide_at_steps_longer_than_they_are(method: str) -> None:
    """A step is divided where they meet; a run that gains energy in the unresolved impact reports it."""
    said, speed = "", 0.0
    try:
        run = spheres().simulate(until=UNTIL, every=0.1, method=method, step=0.02, fine=False)
    except RunFailed as failure:
        said = str(failure)
    else:
        speed = float(run["struck"].velocity.values[-1, 0])
    assert speed > 0.5 * SPEED or "without work" in said


@pytest.mark.parametrize("surface", ["sphere", "capsule", "cylinder"])
@pytest.mark.parametrize("kind", ["cable", "rod"])
@pytest.mark.parametrize("method", ADAPTIVE[:2])
def test_a_bar_bounces_off_a_surface(method: str, kind: str, surface: str) -> None:
    run = flying(kind, surface).simulate(until=UNTIL, every=0.1, method=method, tolerance=1e-4, fine=False)
    heights = run["bar"].position.values[-1][:, 1]
    assert heights.min() > RADIUS
    assert np.all(heights > run["bar"].position.values[-2][:, 1])  # on its way back
