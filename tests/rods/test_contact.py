"""Rods that touch surfaces: their nodes are contact points of bodies."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from book import Book
from evolvent import System, parts
from evolvent.elements import Circle, Material
from evolvent.errors import InputError

METAL = Material(young_modulus=70e9, poisson_ratio=0.3, density=2700.0)


def boom(elements: int = 10, **keys: Any) -> parts.Rod:
    """A rod of 1 m along x."""
    return parts.Rod(length=1.0, section=Circle(radius=0.01), material=METAL, elements=elements, **keys)


def surface(kind: str, **keys: Any) -> Any:
    """What the rod's axis touches from above at z = 0."""
    if kind == "plane":
        return parts.PlaneContact(
            body="ground", beams=["boom"], normal=(0, 0, 1), clearance=0.01, centre=(0, 0, -0.01), **keys
        )
    at: Any = {"body": "ground", "beams": ["boom"], "radius": 0.1, "centre": (1, 0, -0.1)}
    if kind == "sphere":
        return parts.SphereContact(**at, **keys)
    return parts.CapsuleContact(**at, length=0.5, axis=(0, 1, 0), **keys)


@pytest.mark.parametrize("kind", ["plane", "sphere", "capsule"])
def test_a_propped_cantilever_rests_on_a_surface(kind: str, book: Book) -> None:
    """A load P at the middle presses the tip by 5 P/16."""
    system = System()
    system.add(boom(), "boom")
    system.add(parts.Joint(a=(0, 0, 0), b="boom.root", type="clamp"), "root")
    system.add(parts.Force(at="boom[5]", force=(0.0, 0.0, -20.0)), "load")
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


def test_what_a_rod_cannot_touch_is_refused() -> None:
    system = System()
    system.add(boom(), "boom")
    keys = {"body": "ground", "beams": ["boom"], "radius": 0.1, "centre": (1, 0, -0.1)}
    system.add(parts.CylinderContact(**keys), "drum")  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"drum.beams holds the rod 'boom', .*take a capsule-contact"):
        system.assemble()
