"""What may act on a structure that turns steadily is the same at every angle about the axis; the rest is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from evolvent import InputError, System, parts
from evolvent.solvers.static.work import spin_of
from evolvent_base.answer import Table

SPIN = (0.0, 0.0, 10.0)
ORIGIN, X, Z = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
EVEN: dict[str, Any] = {
    "a spring from the axis": parts.Spring(a=(0.0, 0.0, -5.0), b=("hub", X), stiffness=200.0),
    "a ball on the axis": parts.Joint(a=ORIGIN, b="hub"),
    "a hinge about the axis": parts.Joint(a=ORIGIN, b="hub", type="revolute", axis=Z),
    "a plane across the axis": parts.Joint(a=ORIGIN, b="hub", type="in-plane", axis=Z),
    "a force along the axis": parts.Load(at=("hub", X), force=Z),
    "a force in axes of the body": parts.Load(at="hub", force=X, frame="body"),
    "a guide along the axis": parts.Joint(a="ground", b="hub", type="guide", axis=Z),
    "a travel along the axis": parts.JointSpring(a="ground", b="hub", axis=Z, motion="translation", stiffness=3.0),
    "a spring on a body that turns": parts.Spring(a=("table", (-5.0, 0.0, 0.0)), b="hub", stiffness=200.0),
}
UNEVEN: dict[str, Any] = {
    "a spring from the side": parts.Spring(a=(-5.0, 0.0, 0.0), b="hub", stiffness=200.0),
    "a spring on a body that turns otherwise": parts.Spring(a=("slow", (-5.0, 0.0, 0.0)), b="hub", stiffness=200.0),
    "a ball off the axis": parts.Joint(a=X, b="hub"),
    "a hinge across the axis": parts.Joint(a=ORIGIN, b="hub", type="revolute", axis=X),
    "a slide along the axis": parts.Joint(a=ORIGIN, b="hub", type="prismatic", axis=Z),
    "a line across the axis": parts.Joint(a=ORIGIN, b="hub", type="point-on-line", axis=X),
    "a plane along the axis": parts.Joint(a=ORIGIN, b="hub", type="in-plane", axis=X),
    "a force across the axis": parts.Load(at="hub", force=X),
    "a torque across the axis": parts.Load(at="hub", torque=X),
    "a force by a law": parts.Load(at="hub", law=["-x", "0", "0"]),
    "a guide across the axis": parts.Joint(a="ground", b="hub", type="guide", axis=X),
    "an angle against the ground": parts.JointSpring(a="ground", b="hub", axis=Z, stiffness=3.0),
    "a travel across the axis": parts.JointSpring(a="ground", b="hub", axis=X, motion="translation", stiffness=3.0),
}


def turning(part: Any) -> System:
    """A free hub beside bodies that are driven at the rate of the turn, and at another one, and the part."""
    found = System()
    found.add(parts.RigidBody(mass=2.0, inertia=(0.2, 0.2, 0.3)), "hub")
    found.add(parts.RigidBody(motion="driven", rate=10.0), "table")
    found.add(parts.RigidBody(motion="driven", rate=5.0), "slow")
    found.add(part, "it")
    return found


@pytest.mark.parametrize("name", EVEN)
def test_what_is_the_same_about_the_axis_may_act(name: str) -> None:
    assert spin_of(turning(EVEN[name]).assemble(), SPIN, None)[2] == 10.0


@pytest.mark.parametrize("name", UNEVEN)
def test_what_is_not_is_refused_by_name(name: str) -> None:
    with pytest.raises(InputError, match=r"^'it' is not the same at every angle about the axis of the steady turn"):
        spin_of(turning(UNEVEN[name]).assemble(), SPIN, None)


@pytest.mark.parametrize("base", ["ground", "table"])
@pytest.mark.parametrize(("joint", "wanted"), [("clamp", []), ("revolute", [0.0]), ("cylindrical", [0.0, 0.0])])
def test_a_hub_with_no_motion_but_along_the_axis(joint: str, wanted: list[float], base: str) -> None:
    """Nothing that oscillates, and nothing at all: poles are real, or there are none."""
    axis = {} if joint == "clamp" else {"axis": Z}
    system = turning(parts.Joint(a=ORIGIN if base == "ground" else (base, ORIGIN), b="hub", type=joint, **axis))
    for damped in (False, True):
        found = system.modes(rotating=SPIN, damped=damped)
        assert_allclose(found.pole, wanted, atol=1e-9)
        assert found.to_dataset().sizes["mode"] == len(found.answer().of_kind(Table)[0].rows) == len(wanted)
    model = system.linearize(["hub.torque.z"], ["hub.rate.z"], rotating=SPIN)
    assert_allclose(model.poles, 2 * wanted, atol=1e-9)


def test_poles_that_are_all_real() -> None:
    """Dampers above the critical: -c/2 -+ sqrt(c^2/4 - k), of a mass of 1 kg between springs of k = 4 and c = 10."""
    system = System()
    system.add(parts.Point(mass=1.0), "mass")
    for axis in 5.0 * np.eye(3):
        system.add(parts.Spring(a=tuple(axis), b="mass", stiffness=4.0, length=5.0, damping=10.0))
    found = system.modes(damped=True)
    assert_allclose(found.pole, np.repeat([-5.0 + np.sqrt(21.0), -5.0 - np.sqrt(21.0)], 3), rtol=1e-9)
