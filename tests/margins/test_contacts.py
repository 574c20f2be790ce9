"""Contacts that touch beside a coordinate: normal forces and friction in margins, against closed forms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import families.beams  # noqa: F401  (its cases)
from evolvent import System, parts
from evolvent_base.errors import InputError
from families.case import CASES
from margin_cases import NONE, zero

pytestmark = pytest.mark.slow

STILL = {"motion": False, "stations": 5}
RADIUS, MU, K = 0.1, 0.2, 1e4
BALL = {"shape_a": {"sphere": {"radius": RADIUS}}}


def of(table: Any, label: str) -> Any:
    """Values of a share."""
    return table.values[[one.label for one in table.shares].index(label)]


def arm(*, free: bool = False) -> System:
    """An arm of 1 m that a spring turns about z from 0 to a latch at 90 degrees, on the ground or on a satellite."""
    system, on = System(), "ground"
    if free:
        on = system.add(parts.RigidBody(mass=5.0, inertia=(1.0, 1.0, 2.0), position=(-0.2, 0.0, 0.0)), "satellite")
    system.add(parts.RigidBody(mass=2.0, inertia=(0.1, 0.1, 0.2), position=(0.5, 0.0, 0.0)), "arm")
    root = (on, (0.2, 0.0, 0.0)) if free else (0.0, 0.0, 0.0)
    system.add(parts.Joint(a=root, b=("arm", (-0.5, 0.0, 0.0)), type="revolute"), "pivot")
    spring = {"stiffness": 10.0, "rest": math.pi, "latch": math.pi / 2, "latch_stiffness": 500.0}
    system.add(parts.JointSpring(joint="pivot", **spring), "hinge")
    return system


def plane(normal: list[int]) -> dict[str, Any]:
    return {**BALL, "shape": {"plane": {"normal": normal}}}


@pytest.mark.parametrize("free", [False, True])
@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_a_pad_that_rubs_along_a_plate(exponent: float, free: bool) -> None:
    """The ball at the tip is pressed in by d = 1 mm all the way: it takes mu k d^n r, and its normal force nothing."""
    depth, stiffness = 1e-3, K * 1e-3 ** (1.0 - exponent)
    system = arm(free=free)
    place = (0.2, 0.0, depth - RADIUS) if free else (0.0, 0.0, depth - RADIUS)
    pad = parts.Contact(
        a=("arm", (0.5, 0.0, 0.0)), b=("satellite", place) if free else place, stiffness=stiffness,
        exponent=exponent, friction=MU, damping=5.0, **plane([0, 0, 1]),
    )  # fmt: skip
    system.add(pad, "pad")
    found = system.margin(zero=zero("friction"), **STILL)
    table, torque = found["hinge"], MU * K * depth
    assert of(table, "pad.friction") == pytest.approx(np.full(5, -torque), rel=1e-9)
    assert of(table, "pad.normal") == pytest.approx(np.zeros(5), abs=1e-12)
    categories = {share.label: share.category for share in table.shares}
    assert categories["pad.friction"] == "friction"
    assert categories["pad.normal"] == "spring"
    assert table.required("motorization") == pytest.approx(np.full(5, 6.0 * torque), rel=1e-9)
    assert table.touches == {"pad": 0.0}
    assert any(note.startswith("'pad' touches from 0 deg of 'hinge' on") for note in found.notes())


def against_a_wall(friction: float = MU) -> System:
    """The ball of an arm comes to a wall at y = 0.9 m."""
    system = arm()
    wall = {"stiffness": K, "friction": friction, **plane([0, -1, 0])}
    system.add(parts.Contact(a=("arm", (0.5, 0.0, 0.0)), b=(0.0, 0.9, 0.0), **wall), "wall")
    return system


def test_a_ball_that_is_pressed_into_a_wall() -> None:
    """Depth d = sin x + R - c: the normal force k d resists with cos x, friction with mu k d (sin x + R)."""
    found = against_a_wall().margin(zero=zero("friction"), **STILL)
    table = found["hinge"]
    depth = np.maximum(np.sin(table.x) + RADIUS - 0.9, 0.0)
    assert of(table, "wall.normal") == pytest.approx(-K * depth * np.cos(table.x), rel=1e-9, abs=1e-10)
    assert of(table, "wall.friction") == pytest.approx(-MU * K * depth * (np.sin(table.x) + RADIUS), rel=1e-9, abs=1e-9)
    assert table.touches["wall"] == pytest.approx(math.asin(0.8), abs=1e-3)
    assert found.negative == ["hinge"]


def test_a_contact_beyond_the_travel_has_no_share() -> None:
    before = {"hinge": {"travel": (0.0, math.asin(0.8) - 1e-3)}}
    found = against_a_wall(friction=0.0).margin(zero=NONE, lines=before, **STILL)
    assert "'wall' does not touch on any travel" in found.notes()
    assert found["hinge"].touches == {}
    assert not np.any(of(found["hinge"], "wall.normal"))


def test_a_contact_rubs_along_a_run() -> None:
    """The arm turns with the pad pressed in: friction in full at every sample, until the hinge latches."""
    system = arm()
    pad = {"stiffness": K, "friction": 0.01, **plane([0, 0, 1])}
    system.add(parts.Contact(a=("arm", (0.5, 0.0, 0.0)), b=(0.0, 0.0, 1e-3 - RADIUS), **pad), "pad")
    system.settings.update(until=1.0, every=0.02)
    moving = system.margin(zero=zero("friction"), stations=3).motion("hinge")
    assert moving is not None
    assert moving.x.size > 5
    assert of(moving, "pad.friction") == pytest.approx(np.full(moving.x.size, -0.01 * K * 1e-3), rel=1e-6)


def test_a_contact_with_a_part_that_nothing_holds_is_refused() -> None:
    """A ball in the way would be pushed on: how hard depends on the motion."""
    system = arm()
    system.add(parts.RigidBody(mass=1.0, inertia=(0.1, 0.1, 0.1), position=(0.0, 1.05, 0.0)), "stone")
    other = {"shape": {"sphere": {"radius": 0.1}}}
    system.add(parts.Contact(a=("arm", (0.5, 0.0, 0.0)), b="stone", **BALL, **other), "blow")
    with pytest.raises(InputError) as error:
        system.margin(zero=NONE, **STILL)
    assert str(error.value).startswith(
        "'blow' touches at 1.571 rad of 'hinge', and its force is not determined there: "
    )
    assert "no joint and no held coordinate determines" in str(error.value)


def test_a_strip_that_is_pressed_onto_a_plate() -> None:
    """A cantilever on a slide, its tip on a plane: both springs in series, 3 EI/l^3 and k, take the force."""
    length, width, thickness, young, stiffness, gap = 1.0, 0.02, 1e-3, 70e9, 0.5, 1e-4
    bends = length**3 / (3.0 * young * width * thickness**3 / 12.0)
    system = System()
    system.add(parts.RigidBody(mass=2.0, inertia=(0.1, 0.1, 0.2)), "slider")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="slider", type="prismatic", axis=(0, -1, 0)), "rail")
    system.add(parts.JointSpring(joint="rail", low=0.0, high=3e-4, stop=1e3), "slide")
    strip = parts.Rod(
        length=length, elements=8, normal=(0.0, 1.0, 0.0),
        section={"rectangle": {"width": width, "thickness": thickness}},
        material={"young_modulus": young, "poisson_ratio": 0.3, "density": 2700.0},
    )  # fmt: skip
    system.add(strip, "strip")
    system.add(parts.Joint(a="slider", b="strip.root", type="clamp"), "clamp")
    touch = {"stiffness": stiffness, "clearance": 1e-3, "shape": parts.Plane(normal=(0.0, 1.0, 0.0))}
    system.add(parts.Contact(a="strip", b=(0.0, -1e-3 - gap, 0.0), skip=7, **touch), "plate")
    found = system.margin(zero=NONE, lines={"slide": {"travel": (0.0, 3e-4)}}, motion=False, stations=7)
    table = found["slide"]
    whole = bends + 1.0 / stiffness
    force = np.maximum(np.abs(table.x) - gap, 0.0) / whole
    assert of(table, "plate.normal") == pytest.approx(-force / stiffness / whole, rel=1e-4, abs=1e-10)
    assert of(table, "strip") == pytest.approx(-force * bends / whole, rel=1e-4, abs=1e-10)
    assert table.touches["plate"] == pytest.approx(gap, rel=0.01)
    assert table.snaps == ()


def test_turns_of_a_wound_beam_are_refused() -> None:
    """How hard they press follows from how they were wound."""
    system = CASES["a layer on other turns"]().system()
    system.add(parts.RigidBody(mass=2.0, inertia=(0.1, 0.1, 0.2), position=(5.5, 0.0, 0.0)), "arm")
    system.add(parts.Joint(a=(5.0, 0.0, 0.0), b=("arm", (-0.5, 0.0, 0.0)), type="revolute"), "pivot")
    spring = {"stiffness": 10.0, "rest": math.pi, "latch": math.pi / 2, "latch_stiffness": 500.0}
    system.add(parts.JointSpring(joint="pivot", **spring), "hinge")
    with pytest.raises(InputError) as error:
        system.margin(zero=NONE, **STILL)
    assert "'layer' touches at 0 rad of 'hinge'" in str(error.value)
    assert "as they were wound" in str(error.value)
