"""What may act on a structure that turns steadily is the same at every angle about the axis; the rest is refused."""

from __future__ import annotations

from typing import Any

import pytest

from evolvent import InputError, System, parts
from evolvent.solvers.static_work import spin_of

SPIN = (0.0, 0.0, 10.0)
ORIGIN, X, Z = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
EVEN: dict[str, Any] = {
    "a spring from the axis": parts.Spring(a=(0.0, 0.0, -5.0), b=("hub", X), stiffness=200.0),
    "a ball on the axis": parts.Joint(a=ORIGIN, b="hub"),
    "a hinge about the axis": parts.Joint(a=ORIGIN, b="hub", type="revolute", axis=Z),
    "a plane across the axis": parts.Joint(a=ORIGIN, b="hub", type="in-plane", axis=Z),
    "a force along the axis": parts.Force(at=("hub", X), force=Z),
    "a force in axes of the body": parts.Force(at="hub", force=X, frame="body"),
    "a guide along the axis": parts.Guide(body="hub", direction=Z),
    "a travel along the axis": parts.TranslationalSpring(a="ground", b="hub", axis=Z, stiffness=3.0),
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
    "a force across the axis": parts.Force(at="hub", force=X),
    "a torque across the axis": parts.Torque(at="hub", torque=X),
    "a force by a law": parts.Force(at="hub", law=["-x", "0", "0"]),
    "a guide across the axis": parts.Guide(body="hub", direction=X),
    "an angle against the ground": parts.RotationalSpring(a="ground", b="hub", axis=Z, stiffness=3.0),
    "a travel across the axis": parts.TranslationalSpring(a="ground", b="hub", axis=X, stiffness=3.0),
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
