"""Rods that touch surfaces: their nodes are contact points of bodies."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from book import Book
from evolvent import System, parts
from evolvent.elements import Circle, Material
from evolvent_base.errors import InputError

METAL = Material(young_modulus=70e9, poisson_ratio=0.3, density=2700.0)


def boom(elements: int = 10, **keys: Any) -> parts.Rod:
    """A rod of 1 m along x."""
    return parts.Rod(length=1.0, section=Circle(radius=0.01), material=METAL, elements=elements, **keys)


def surface(kind: str, **keys: Any) -> Any:
    """What the rod's axis touches from above at z = 0."""
    if kind == "plane":
        return parts.Contact(a="boom", b=(0, 0, -0.01), shape=parts.Plane(normal=(0, 0, 1)), clearance=0.01, **keys)
    shapes = {
        "sphere": parts.Sphere(radius=0.1),
        "cylinder": parts.Cylinder(radius=0.1, axis=(0, 1, 0)),
        "capsule": parts.Capsule(radius=0.1, length=0.5, axis=(0, 1, 0)),
    }
    return parts.Contact(a="boom", b=(1, 0, -0.1), shape=shapes[kind], **keys)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["plane", "sphere", "capsule", "cylinder"])
def test_a_propped_cantilever_rests_on_a_surface(kind: str, book: Book) -> None:
    """A load P at the middle presses the tip by 5 P/16."""
    system = System()
    system.add(boom(), "boom")
    system.add(parts.Joint(a=(0, 0, 0), b="boom.root", type="clamp"), "root")
    system.add(parts.Load(at="boom[5]", force=(0.0, 0.0, -20.0)), "load")
    system.add(surface(kind, stiffness=1e7, skip=9), "stop")
    found = system.equilibrium()
    book(
        "Contact", f"Rod on a {kind} at its tip, loaded at the middle (10 elements)", reference="5 P/16",
        source="beam theory", error=abs(float(np.ravel(found["stop"].normal_force.values)[-1]) / 6.25 - 1.0),
        allowed=1e-4,
    )  # fmt: skip
    assert np.ravel(found["stop"].point_force.values).sum() == pytest.approx(6.25, rel=1e-4)


def test_a_rod_that_falls_on_a_plane_keeps_its_energy() -> None:
    """Without damping, and at spectral radius 1, by steps of any length."""
    system = System(gravity=(0.0, 0.0, -9.81))
    system.add(boom(elements=6, position=(0.0, 0.0, 0.05), velocity=(0.0, 0.0, -1.0)), "boom")
    system.add(surface("plane", stiffness=1e5, law="conservative"), "floor")
    run = system.simulate(until=0.2, every=2e-3, method="energy-momentum", step=1e-3, spectral_radius=1.0)
    energy = np.asarray(run.energy_defect.values)
    assert float(run["floor"].normal_force.max()) > 10.0
    assert np.abs(energy).max() < 1e-6 * float(run.energy.max())


@pytest.mark.parametrize("shape", [parts.Plane(normal=(0, 0, 1)), parts.Box(size=(4.0, 1.0, 0.2))])
def test_the_force_on_a_rod_is_its_weight(shape: Any) -> None:
    """Its nodes but the first, which is held at the height of the others, carry it."""
    system = System(gravity=(0.0, 0.0, -9.81))
    system.add(boom(elements=4), "boom")
    system.add(parts.Joint(a=(0, 0, 0), b="boom.root", type="clamp"), "root")
    depth = 0.1 if isinstance(shape, parts.Box) else 0.0
    touch = {"a": "boom", "b": (0.0, 0.0, -0.01 - depth), "shape": shape, "clearance": 0.01, "stiffness": 1e9}
    system.add(parts.Contact(**touch), "floor")
    floor = system.equilibrium()["floor"]
    weight = 2700.0 * np.pi * 1e-4 * 9.81 * 7.0 / 8.0
    np.testing.assert_allclose(floor.force.values[-1], [0.0, 0.0, weight], rtol=1e-3, atol=1e-6)


def test_what_a_rod_cannot_touch_is_refused() -> None:
    system = System()
    system.add(boom(), "boom")
    system.add(parts.Contact(a="boom", b=(1, 0, -0.1), shape=parts.Cylinder(radius=0.1, length=0.4)), "drum")
    with pytest.raises(
        InputError, match=r"drum.shape is a cylinder with a length, .*the rod 'boom', .*or use a capsule"
    ):
        system.assemble()


def test_a_rod_hangs_over_a_drum_by_friction() -> None:
    """A rod pressed about a quarter turn of a drum keeps its energy balance, and its nodes stay outside."""
    system = System(gravity=(0.0, 0.0, -9.81))
    material = Material(young_modulus=2e6, poisson_ratio=0.3, density=1000.0)
    rod = parts.Rod(
        length=1.0, section=Circle(radius=0.01), material=material, elements=24, stiffness_damping=5e-3,
        mass_damping=5.0,
    )  # fmt: skip
    system.add(rod, "boom")
    system.add(parts.Joint(a=(0, 0, 0), b="boom.root", type="clamp"), "root")
    drum = parts.Contact(
        a="boom", b=(0.0, 0.0, -0.2), shape=parts.Cylinder(radius=0.2, axis=(0, 1, 0)), stiffness=1e5, damping=0.3,
        friction=0.3,
    )  # fmt: skip
    system.add(drum, "drum")
    run = system.simulate(until=1.5, every=0.05, method="energy-momentum", tolerance=1e-8)
    x = run["boom"].position.values[-1]
    far = np.hypot(x[:, 0], x[:, 2] + 0.2)
    assert far.min() > 0.2 - 1e-4
    assert np.sum(far < 0.2 + 1e-4) > 5  # it lies on the drum, and the rest hangs down
    assert x[-1, 2] < -0.5
    weight = 1000.0 * np.pi * 1e-4 * 9.81
    assert 0.0 < float(run["drum"].normal_force.values[-1].sum()) < 2.0 * weight
    assert np.abs(run.energy_defect).max() < 1e-6 * float(np.abs(run.work_loads).max())


def test_a_cylinder_of_a_rod_is_drawn_by_its_outline() -> None:
    """It has no ends, which a solid would show."""
    system = System()
    system.add(boom(), "boom")
    system.add(parts.Joint(a=(0, 0, 0), b="boom.root", type="clamp"), "root")
    system.add(surface("cylinder", stiffness=1e4), "stop")
    run = system.simulate(until=1e-3, every=1e-3, method="energy-momentum", step=1e-3)
    drawn = json.loads(run["stop"].attrs["drawn"])
    assert not any("surface" in one for one in drawn)
    assert any("outline" in symbol for symbol in drawn for symbol in symbol.values())
