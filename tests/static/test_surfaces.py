"""Beams on planes, spheres and capsules: reactions against beam theory, in equilibrium and in motion."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from book import Book
from evolvent import System, elements, parts
from evolvent.analysis import runs
from evolvent.solvers.modal.modes import modes
from evolvent.solvers.static.static import solve_static
from families.beams import K_TOUCH, SUNK, resting

E, SIDE, LOAD, K = 2e9, 0.02, 1.0, 1e7
EI = E * SIDE**4 / 12.0
LAW: dict[str, Any] = {"stiffness": K, "points": 1, "initial_overlap": 0.1}
PROPS = {
    "plane": parts.Contact(
        a="rod", b=(1.0, -0.01, 0.0), shape=parts.Plane(normal=(0.0, 1.0, 0.0)), clearance=0.01, skip=7, **LAW
    ),
    "sphere": parts.Contact(a="rod", b=(1.0, -0.1, 0.0), shape=parts.Sphere(radius=0.1), **LAW),
    "capsule": parts.Contact(
        a="rod", b=(1.0, -0.1, 0.0), shape=parts.Capsule(radius=0.1, length=0.3, axis=(0.0, 0.0, 1.0)), **LAW
    ),
}


def clamped(**fields: Any) -> System:
    """A beam of 1 m along x, clamped at its root."""
    system = System()
    material = elements.Material(young_modulus=E, poisson_ratio=0.0, density=1000.0)
    section = elements.Rectangle(thickness=SIDE, width=SIDE)
    beam = parts.Beam(length=1.0, section=section, material=material, elements=8, formulation="cable", **fields)
    system.add(beam, "rod")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="rod.root", type="clamp"), "root")
    return system


@pytest.mark.parametrize("prop", PROPS)
def test_a_propped_cantilever(prop: str, book: Book) -> None:
    """Under a uniform load q the prop at the tip takes 3/8 q L, less what its spring of contact gives way."""
    system = clamped()
    system.add(parts.Load(along="rod", force=(0.0, -LOAD, 0.0)), "load")
    system.add(PROPS[prop], "prop")
    found = system.equilibrium()["prop"]
    exact = LOAD / (8.0 * EI) / (1.0 / (3.0 * EI) + 1.0 / K)
    assert float(found.points.values[-1]) == 1.0
    np.testing.assert_allclose(found.force.values[-1], [0.0, exact, 0.0], atol=1e-4 * exact)
    np.testing.assert_allclose(found.point_resultant.values[-1].sum(axis=0), found.force.values[-1], atol=1e-12)
    np.testing.assert_allclose(found.point_position.values[-1, -1], [1.0, -exact / K, 0.0], atol=1e-6)
    book(
        "Contact", f"Cantilever propped at its tip by a {prop}", reference="3/8 q L, of a tip on a spring",
        source="beam theory", error=abs(float(found.normal_force.values[-1]) / exact - 1.0), allowed=1e-5,
    )  # fmt: skip


@pytest.mark.parametrize("method", ["generalized-alpha", "energy-momentum"])
@pytest.mark.parametrize("prop", ["plane", "capsule"])
def test_friction_on_a_sliding_plane(method: str, prop: str) -> None:
    """A beam pressed on something that moves along it is drawn by mu N: point by point, and in all."""
    mu, N, speed = 0.3, 2.0, 0.5
    system = clamped()
    system.add(parts.Load(at="rod.tip", force=(0.0, -N, 0.0)), "push")
    given = {
        "a": "rod",
        "friction": mu,
        "skip": 7,
        "bristle_stiffness": 1e5,
        **(LAW | {"stiffness": 1e5}),
    }
    system.add(
        parts.RigidBody(mass=1e6, inertia=(1e6, 1e6, 1e6), position=(1.0, -0.11, 0.0), velocity=(0.0, 0.0, speed)),
        "table",
    )
    if prop == "plane":
        plane = parts.Plane(normal=(0.0, 1.0, 0.0))
        part: Any = parts.Contact(b=("table", (0.0, 0.1, 0.0)), shape=plane, clearance=0.01, **given)
    else:
        part = parts.Contact(b="table", shape=parts.Capsule(radius=0.11, length=5.0), **given)
    system.add(part, "touch")
    found = system.simulate(until=0.02, method=method, step=2e-4, every=1e-3)["touch"]
    friction, pressed = found.point_friction.values[5:, 0], found.point_force.values[5:, 0]
    assert np.all(pressed > 0.1)
    np.testing.assert_allclose(friction[:, 2], mu * pressed, rtol=1e-3)
    np.testing.assert_allclose(found.force.values[5:], found.point_resultant.values[5:, 0], atol=0.02 * N)


@pytest.mark.parametrize("solver", ["rk4", "generalized-alpha", "energy-momentum", "static", "modes"])
@pytest.mark.parametrize("prop", ["plane", "sphere", "capsule"])
def test_a_rod_that_lies_on_a_surface(prop: str, solver: str) -> None:
    """A rod on a hinge whose tip lies on the spring of the contact: motion, equilibrium and mode in closed form."""
    given: dict[str, Any] = {
        "a": "rod",
        "b": (1.0, SUNK - 0.2, 0.0),
        "stiffness": K_TOUCH,
        "points": 1,
        "initial_overlap": 0.1,
    }
    part: Any = {
        "plane": parts.Contact(shape=parts.Plane(normal=(0.0, 1.0, 0.0)), clearance=0.2, skip=1, **given),
        "sphere": parts.Contact(shape=parts.Sphere(radius=0.2), **given),
        "capsule": parts.Contact(shape=parts.Capsule(radius=0.2, length=0.3), **given),
    }[prop]
    case = resting("touch", lambda found: found.add(part, "touch") and None, 1.0)
    system = case.system()
    assembly = system.assemble()
    if solver == "static":
        found = case.seen(assembly, solve_static(assembly).y[-1])
        assert found == pytest.approx(np.asarray(case.still), abs=1e-5)
    elif solver == "modes":
        assert modes(assembly, count=1).pole == pytest.approx(np.asarray(case.poles), rel=2e-3)
    else:
        step = 5e-5 if solver == "rk4" else 1e-3
        plan, _ = runs.plan(assembly, np.linspace(0.0, 0.6, 7), method=solver, step=step)
        solution = plan.run()
        exact = case.motion(solution.t)
        assert np.abs(case.seen(assembly, solution.y) - exact).max() < 5e-3 * np.ptp(exact)
