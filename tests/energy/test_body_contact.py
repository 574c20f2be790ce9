"""Spheres, capsules and planes of rigid bodies that touch, against closed forms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import xarray as xr

from book import Book
from evolvent import KAPTON, Circle, InputError, Stepper, System, parts
from evolvent.solvers.modal.modes import modes
from families.contacts import pressed

Array = np.ndarray
CHAPTER, CLOSED = "Contact", "closed form"
ENERGY, ALPHA = "energy-momentum", "generalized-alpha"
RADIUS, MASS, K = 0.1, 1.0, 1e4
#: Of a sphere of 1 kg on a plane, s.
CONTACT_TIME = math.pi * math.sqrt(MASS / K)
FLOOR = parts.Plane(normal=(0.0, 0.0, 1.0))


def ball(system: System, name: str, position: Any, mass: float = MASS, **fields: Any) -> None:
    shape = parts.Sphere(radius=RADIUS)
    system.add(parts.RigidBody(mass=mass, shape=shape, position=position, **fields), name)


def simulated(system: System, until: float, step: float, method: str = ENERGY, **options: Any) -> xr.DataTree:
    """A run, sampled at ends of steps; the energy-momentum method with a spectral radius of 1 balances its energy."""
    if method == ENERGY:
        options = {"spectral_radius": 1.0} | options
    every = max(round(until / 20.0 / step), 1) * step
    run = system.simulate(until=until, method=method, step=step, every=every, **options)
    if method == ENERGY:
        assert np.abs(run.energy_defect.values).max() <= 1e-8 * float(run.energy.max())
    return run


def kept(run: xr.DataTree) -> None:
    """Momenta of bodies that only touch one another stay to round-off."""
    for name in ("momentum", "angular_momentum"):
        values = run[name].values
        assert np.abs(values - values[0]).max() <= 1e-9 * max(np.abs(values).max(), 0.1)


@pytest.mark.parametrize(
    ("e", "exponent", "law", "method"),
    [(0.12, 1.5, "hunt-crossley", ALPHA), (0.5, 1.0, "conservative", ENERGY), (0.9, 1.5, "hunt-crossley", "rk4")],
)
def test_a_coefficient_of_restitution_is_met_at_its_speed(e: float, exponent: float, law: Any, method: str) -> None:
    system = System()
    ball(system, "ball", (0.0, 0.0, RADIUS + 1e-4), velocity=(0.0, 0.0, -2.0))
    own: Any = {"stiffness": 1e6, "exponent": exponent, "law": law, "restitution": {"coefficient": e, "speed": 2.0}}
    system.add(parts.Contact(a="ball", b=(0.0, 0.0, 0.0), shape=FLOOR, **own), "floor")
    run = system.simulate(until=0.02, every=0.01, method=method, step=2e-5)
    assert run["ball"].velocity.values[-1, 2] == pytest.approx(2.0 * e, abs=1e-4)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"restitution": {"coefficient": 0.0, "speed": 1.0}}, "coefficient is 0.*above 0 and up to 1"),
        ({"restitution": {"coefficient": 0.5}}, "speed is missing"),
    ],
)
def test_restitutions_that_are_none_are_refused(given: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        parts.Contact(a="ball", b=(0.0, 0.0, 0.0), shape=FLOOR, **given)


def test_the_law_of_the_paper_takes_no_restitution() -> None:
    system = System()
    beam = parts.Beam(
        length=1.0, section=Circle(radius=1e-3), material=KAPTON, position=(0.0, 0.0, 1.0), elements=2,
        formulation="cable",
    )  # fmt: skip
    system.add(beam, "beam")
    own: Any = {"restitution": {"coefficient": 0.5, "speed": 1.0}}
    system.add(parts.Contact(a="beam", b=(0.0, 0.0, 0.0), shape=FLOOR, law="paper", **own), "floor")
    with pytest.raises(InputError, match=r"floor.restitution is given, but floor.law is 'paper'"):
        system.assemble()
    system.replace("floor", parts.Contact(a="beam", b=(0.0, 0.0, 0.0), shape=FLOOR, damping=1.0, **own))
    with pytest.raises(InputError, match=r"floor.damping is given beside floor.restitution"):
        system.assemble()


@pytest.mark.slow
@pytest.mark.parametrize("part", [0.1, 1.0, 3.0])
def test_a_sphere_bounces(part: float, book: Book) -> None:
    """Law conservative: the speed comes back at any step."""
    system = System()
    ball(system, "ball", (0.0, 0.0, 0.3), velocity=(0.2, 0.0, -1.0))
    system.add(parts.Contact(a="ball", b=(0.0, 0.0, 0.0), shape=FLOOR, law="conservative", stiffness=K), "floor")
    run = simulated(system, 0.6, part * CONTACT_TIME)
    error = float(np.abs(run["ball"].velocity.values[-1] - [0.2, 0.0, 1.0]).max())
    assert run["floor"].impulse.values[-1] == pytest.approx(2.0, rel=1e-8)
    book(
        CHAPTER, f"Sphere bounces on a plane, {part:g} contact times a step", reference="restitution 1",
        source=CLOSED, error=error, allowed=1e-8,
    )  # fmt: skip


@pytest.mark.parametrize("method", [ENERGY, ALPHA])
def test_a_sphere_slides_and_rolls(method: str, book: Book) -> None:
    """A sphere that slides at v rolls after 2 v/(7 mu g), at 5/7 v."""
    mu, g, v = 0.3, 10.0, 1.0
    system = System(gravity=(0.0, 0.0, -g))
    ball(system, "ball", (0.0, 0.0, RADIUS - MASS * g / K), velocity=(v, 0.0, 0.0))
    law = {"stiffness": K, "friction": mu, "bristle_stiffness": 1e5, "bristle_damping": 300.0}
    system.add(parts.Contact(a="ball", b=(0.0, 0.0, 0.0), shape=FLOOR, **law), "floor")
    run = system.simulate(until=0.2, method=method, step=1e-3, every=1e-3)
    t, speed = run.time.values, run["ball"].velocity.values[:, 0]
    spin, found = run["ball"].rate.values[:, 1], run["floor"]
    slides = t < 2.0 * v / (7.0 * mu * g)
    assert np.abs(speed - (v - mu * g * t))[slides].max() < 3e-3
    assert float(np.abs(found.point_friction.values[20:80, 0, 0] + mu * MASS * g).max()) < 1e-3 * mu * MASS * g
    # forces at the samples, and the place where they act
    np.testing.assert_allclose(found.normal_force.values, MASS * g, rtol=1e-6)
    np.testing.assert_allclose(found.point_position.values[:, 0, 2], -MASS * g / K, atol=1e-9)
    np.testing.assert_allclose(found.force.values, found.point_resultant.values[:, 0], atol=1e-12)
    assert float(run.energy_defect.max()) < 1e-5
    rolls = float(t[np.argmax(speed - spin * RADIUS < 5e-3)])
    book(
        CHAPTER, f"Sphere slides, then rolls ({method}): time", reference="2 v/(7 mu g)", source=CLOSED,
        error=abs(rolls / (2.0 * v / (7.0 * mu * g)) - 1.0), allowed=0.02,
    )  # fmt: skip
    book(
        CHAPTER, f"Sphere slides, then rolls ({method}): speed", reference="5/7 v", source=CLOSED,
        error=abs(speed[-1] / (5.0 / 7.0 * v) - 1.0), allowed=2e-3,
    )  # fmt: skip


def slope(shape: Any, angle: float, mu: float, g: float, **fields: Any) -> System:
    """A body of 1 kg on an incline, its depth that of equilibrium; the incline is the plane z = 0 in gravity tilted."""
    system = System(gravity=(g * math.sin(angle), 0.0, -g * math.cos(angle)))
    count = 2 if isinstance(shape, parts.Capsule) else 1
    depth = MASS * g * math.cos(angle) / (count * K)
    system.add(parts.RigidBody(mass=MASS, shape=shape, position=(0.0, 0.0, RADIUS - depth)), "body")
    law = {"stiffness": K, "friction": mu, "bristle_stiffness": 1e5, "bristle_damping": 300.0} | fields
    system.add(parts.Contact(a="body", b=(0.0, 0.0, 0.0), shape=FLOOR, **law), "floor")
    return system


@pytest.mark.parametrize("method", [ENERGY, ALPHA])
@pytest.mark.parametrize(("what", "angle"), [("stands", 15.0), ("slides", 25.0), ("rolls", 25.0)])
def test_on_an_incline(what: str, angle: float, method: str, book: Book) -> None:
    """A capsule that lies along the incline stands below the limit angle, 16.7 degrees, else slides; a ball rolls."""
    mu, g, until, a = 0.3, 10.0, 0.3, math.radians(angle)
    lying: Any = parts.Capsule(radius=RADIUS, length=0.6, axis=(1.0, 0.0, 0.0))
    run = slope(parts.Sphere(radius=RADIUS) if what == "rolls" else lying, a, mu, g).simulate(
        until=until, method=method, step=1e-3, every=0.01
    )
    moved = float(run["body"].position.values[-1, 0])
    slides, rolls = g * (math.sin(a) - mu * math.cos(a)), 5.0 / 7.0 * g * math.sin(a)
    wanted = {"stands": 0.0, "slides": 0.5 * slides * until**2, "rolls": 0.5 * rolls * until**2}[what]
    reference = {"stands": "at rest", "slides": "g (sin - mu cos)", "rolls": "5/7 g sin"}[what]
    book(
        CHAPTER, f"{'Sphere' if what == 'rolls' else 'Capsule'} on an incline of {angle:g} degrees {what} ({method})",
        reference=reference, source=CLOSED, error=abs(moved - wanted), allowed=1.2e-3, unit="m",
    )  # fmt: skip
    assert run["floor"].points.values[-1] == (1 if what == "rolls" else 2)


def test_two_spheres_collide_on_centre(book: Book) -> None:
    """A ball strikes one of twice its mass: -v/3 and 2 v/3."""
    system = System()
    ball(system, "first", (-0.3, 0.0, 0.0), velocity=(1.0, 0.0, 0.0))
    ball(system, "second", (0.0, 0.0, 0.0), mass=2.0)
    system.add(parts.Contact(a="first", b="second", law="conservative", stiffness=K), "touch")
    run = simulated(system, 0.4, 0.02)
    kept(run)
    found = [float(run[name].velocity.values[-1, 0]) for name in ("first", "second")]
    book(
        CHAPTER, "Central collision of two spheres", reference="-v/3 and 2 v/3", source=CLOSED,
        error=max(abs(found[0] + 1.0 / 3.0), abs(found[1] - 2.0 / 3.0)), allowed=1e-8,
    )  # fmt: skip


def test_a_row_of_spheres_passes_the_speed_on() -> None:
    """Newton's cradle of three balls a little apart."""
    system = System()
    for k, x in enumerate((-0.4, 0.0, 0.21)):
        ball(system, f"ball{k}", (x, 0.0, 0.0), velocity=(1.0 if k == 0 else 0.0, 0.0, 0.0))
    for k in range(2):
        law = {"law": "conservative", "stiffness": 1e6}
        system.add(parts.Contact(a=f"ball{k}", b=f"ball{k + 1}", **law), f"touch{k}")
    run = simulated(system, 0.4, 1e-3)
    kept(run)
    for k, speed in enumerate((0.0, 0.0, 1.0)):
        assert run[f"ball{k}"].velocity.values[-1] == pytest.approx([speed, 0.0, 0.0], abs=1e-8)


@pytest.mark.parametrize("method", [ENERGY, ALPHA])
def test_two_spheres_collide_off_centre(method: str, book: Book) -> None:
    """Hard and frictionless: the parts of the velocities along the normal are exchanged, those across stay."""
    off, law = 0.12, "conservative" if method == ENERGY else "hunt-crossley"
    system = System()
    ball(system, "first", (-0.2, off, 0.0), velocity=(1.0, 0.0, 0.0), angular_velocity=(1.0, 2.0, 3.0))
    ball(system, "second", (0.0, 0.0, 0.0))
    system.add(parts.Contact(a="first", b="second", law=law, stiffness=1e8), "touch")
    run = simulated(system, 0.06, 2e-5, method)
    kept(run)
    n = np.array([-math.sqrt(4.0 * RADIUS**2 - off**2), off, 0.0]) / (2.0 * RADIUS)
    wanted = np.array([1.0, 0.0, 0.0]) - n[0] * n
    found = run["first"].velocity.values[-1]
    np.testing.assert_allclose(run["first"].rate.values[-1], [1.0, 2.0, 3.0], atol=1e-9)
    book(
        CHAPTER, f"Oblique collision of two spheres ({method})", reference="impulse along the normal", source=CLOSED,
        error=float(np.abs(found - wanted).max()), allowed=2e-3,
    )  # fmt: skip


@pytest.mark.parametrize("mu", [0.0, 0.3])
@pytest.mark.parametrize("law", ["conservative", "hunt-crossley"])
@pytest.mark.parametrize("step", [1e-3, 1e-2])
def test_capsules_that_cross(mu: float, law: str, step: float) -> None:
    """Two free capsules, far off their centres: energy does not grow, and both momenta stay."""
    system = System()
    for name, mass, axis, fields in (
        ("first", 1.0, (1.0, 0.0, 0.0), {"position": (0.1, 0.0, 0.15), "velocity": (0.0, 0.1, -1.0)}),
        ("second", 2.0, (0.2, 1.0, 0.0), {"position": (0.0, -0.15, 0.0), "angular_velocity": (0.0, 0.0, 1.0)}),
    ):
        shape = parts.Capsule(radius=0.05, length=1.0, axis=axis)
        system.add(parts.RigidBody(mass=mass, shape=shape, **fields), name)
    given = {"law": law, "stiffness": K, "friction": mu, "bristle_stiffness": K}
    system.add(parts.Contact(a="first", b="second", **given), "touch")
    run = simulated(system, 0.3, step).ev.regular()  # at ends of steps
    kept(run)
    assert run["touch"].impulse.values[-1] > 1.0
    if mu == 0.0 and law == "conservative":
        energy = run.energy_kinetic.values
        assert energy[-1] == pytest.approx(energy[0], rel=1e-9)


def test_a_sphere_passes_over_the_end_of_a_capsule() -> None:
    """The distance is one from the axis, then from the end: no energy is gained or lost between."""
    system = System(gravity=(0.0, 0.0, -1.0))
    ball(system, "ball", (0.25, 0.0, 2.0 * RADIUS - 1e-4), velocity=(1.0, 0.01, 0.0))
    log: Any = parts.Capsule(radius=RADIUS, length=0.6, axis=(1.0, 0.0, 0.0))
    given = {"law": "conservative", "stiffness": K, "initial_overlap": 0.1}
    system.add(parts.Contact(a="ball", b=(0.0, 0.0, 0.0), shape=log, **given), "touch")
    run = simulated(system, 0.2, 5e-3)
    assert run["ball"].position.values[-1, 2] < 2.0 * RADIUS - 5e-3
    assert run["touch"].impulse.values[-1] > 0.05


def test_a_capsule_rests_on_two_points() -> None:
    """In equilibrium the ends of a capsule bear what a force off its middle gives them."""
    g, force, x = 10.0, 4.0, 0.2
    lying: Any = parts.Capsule(radius=RADIUS, length=0.6, axis=(1.0, 0.0, 0.0))
    system = slope(lying, 0.0, 0.5, g)
    system.add(parts.Load(at=("body", (x, 0.0, 0.0)), force=(0.0, 0.0, -force)), "push")
    found = system.equilibrium()["floor"]
    shares = np.array([0.5 * (MASS * g + force) + side * force * x / 0.6 for side in (-1.0, 1.0)])
    np.testing.assert_allclose(found.point_force.values[-1], shares, rtol=1e-4)
    np.testing.assert_allclose(found.force.values[-1], [0.0, 0.0, MASS * g + force], atol=1e-6)


def test_modes_of_a_lever_on_crossed_capsules() -> None:
    """A capsule of a lever lies across another one: the frequency is that of the contact's spring."""
    a, b = (parts.Capsule(radius=RADIUS, length=0.5, axis=axis) for axis in ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0)))
    case = pressed(a, b, 2.0 * RADIUS)
    assert modes(case.system().assemble(), count=1).pole == pytest.approx(np.asarray(case.poles), rel=1e-3)


def test_a_stepper_keeps_the_friction_of_the_step_before() -> None:
    """A ball that slides and rolls, stepped from outside: 5/7 of its speed."""
    system = System(gravity=(0.0, 0.0, -10.0))
    ball(system, "ball", (0.0, 0.0, RADIUS - MASS * 10.0 / K), velocity=(1.0, 0.0, 0.0))
    law = {"stiffness": K, "friction": 0.3, "bristle_stiffness": 1e5, "bristle_damping": 300.0}
    system.add(parts.Contact(a="ball", b=(0.0, 0.0, 0.0), shape=FLOOR, **law), "floor")
    stepper = Stepper(system, method=ALPHA, step=1e-3, until=1.0)
    for _ in range(20):
        stepper.step(0.01)
    assert stepper.body("ball")[1][0] == pytest.approx(5.0 / 7.0, rel=2e-3)


def test_explicit_methods_agree() -> None:
    """A bounce off the plane of a free body under rk4 and dopri5, without friction and with it."""

    def system(mu: float) -> System:
        found = System()
        ball(found, "ball", (0.05, 0.0, 0.3), velocity=(0.0, 0.0, -1.0))
        found.add(parts.RigidBody(mass=2.0, inertia=(0.1, 0.1, 0.1)), "plate")
        found.add(parts.Contact(a="ball", b="plate", shape=FLOOR, stiffness=K, friction=mu), "touch")
        return found

    for mu in (0.0, 0.3):
        exact = simulated(system(mu), 0.4, 1e-4, ALPHA)
        for method in ("rk4", "dopri5"):
            run = system(mu).simulate(until=0.4, method=method, every=0.02)
            for name in ("ball", "plate"):
                np.testing.assert_allclose(run[name].velocity.values[-1], exact[name].velocity.values[-1], atol=2e-3)
                np.testing.assert_allclose(run[name].rate.values[-1], exact[name].rate.values[-1], atol=2e-2)
            assert abs(float(run.energy_defect.values[-1])) < 1e-3
