"""Mass and inertia of the hub from its density, solid or hollow."""

from __future__ import annotations

import math

import numpy as np
import pytest

from evolvent import cases
from evolvent_base.errors import InputError
from evolvent_papers.wrapped_rib import SYSTEM

RADIUS, HEIGHT, DENSITY = 0.6, 3.0, 10.0
FREE = {"hub.motion": "free"}


def solid(radius: float) -> np.ndarray:
    """Mass, and moments of inertia along the axis and across, of a solid cylinder."""
    mass = DENSITY * math.pi * radius**2 * HEIGHT
    return mass * np.array([1.0, 0.5 * radius**2, 0.25 * radius**2 + HEIGHT**2 / 12.0])


def body(changes):
    """The hub's row in the model."""
    return SYSTEM.build(cases.load("wrapped-rib-deploy", changes)).assemble().model.bodies[1]


@pytest.mark.parametrize("wall", [None, 0.1, 0.6])
def test_a_free_hub_has_the_mass_and_inertia_of_its_density(wall):
    """rho pi R^2 H, m R^2/2 and m (R^2/4 + H^2/12), less those of what is hollow."""
    mass, along, across = solid(RADIUS) - (0.0 if wall is None else solid(RADIUS - wall))
    row = body(FREE | {"hub.density": DENSITY} | ({} if wall is None else {"hub.wall": wall}))
    assert row["mass"] == pytest.approx(mass, rel=1e-12)
    assert np.diag(row["inertia"]) == pytest.approx([across, across, along], rel=1e-12)
    assert np.count_nonzero(row["inertia"]) == 3


def test_a_thin_wall_has_the_inertia_of_a_ring_about_its_axis():
    row = body(FREE | {"hub.mass": 20, "hub.wall": "0.1 mm"})
    assert row["mass"] == 20.0
    assert row["inertia"][2, 2] == pytest.approx(20.0 * RADIUS**2, rel=1e-3)
    assert body(FREE | {"hub.mass": 20})["inertia"][2, 2] == pytest.approx(10.0 * RADIUS**2)


@pytest.mark.parametrize("motion", ["spin", "driven"])
def test_a_turning_hub_has_the_inertia_of_its_density(motion):
    drive = {} if motion == "spin" else {"drive": {"kind": "hub", "rate": -0.1}}
    row = body({"hub.motion": motion, "hub.density": DENSITY} | drive)
    assert row["spin_inertia"] == pytest.approx(solid(RADIUS)[1], rel=1e-12)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"hub.density": 10, "hub.mass": 20}, ["hub.density and hub.mass are both given"]),
        ({"hub.density": 10, "hub.inertia": 5}, ["hub.density and hub.inertia are both given"]),
        ({"hub.density": 10, "hub.wall": 0.7}, ["hub.wall is 0.7 m", "hub.radius 0.6 m"]),
        ({"hub.mass": 10, "hub.inertia": 5, "hub.wall": 0.1}, ["hub.wall and hub.inertia are both given"]),
        ({"hub.wall": 0.1}, ["hub.wall is given without hub.density"]),
        ({"hub.density": 0}, ["hub.density is 0", "above 0"]),
    ],
)
def test_what_contradicts_itself_is_refused(changes, words):
    with pytest.raises(InputError) as caught:
        cases.load("wrapped-rib-deploy", FREE | changes)
    assert all(word in str(caught.value) for word in words), str(caught.value)
    assert "\n" not in str(caught.value)
