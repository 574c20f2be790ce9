"""Margins of a hinge with a harness, a tape, an adhesion and a motor that loses, against calculations by hand."""

import math

import pytest

from evolvent import System, parts

pytestmark = pytest.mark.slow

NONE = ("friction", "hysteresis", "harness", "motor losses", "adhesion", "load", "acceleration")


def hinged(**added):
    """An arm that opens from 90 to 0 degrees."""
    system = System()
    system.add(parts.RigidBody(mass=2.0, inertia=(0.1, 0.1, 0.2), position=(0.5, 0.0, 0.0)), "arm")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b=("arm", (-0.5, 0.0, 0.0)), type="revolute"), "pivot")
    spring = parts.RotationalSpring(
        joint="pivot", angle=math.pi / 2, stiffness=0.1, rest=-1.0, latch=0.0, latch_stiffness=500.0
    )
    system.add(spring, "hinge")
    for name, part in added.items():
        system.add(part, name)
    return system


def table_of(system, *given, **keys):
    """The table of the hinge at rest, and its values by the names of the shares."""
    zero = [one for one in NONE if one not in given]
    table = system.margin(motion=False, stations=4, zero=zero, **keys)["hinge"]
    return table, dict(zip([share.label for share in table.shares], table.values, strict=True))


def test_a_harness_slips_against_the_motion():
    """Its curve counts where the joint is; the bristles resist in full."""
    torque = [[0.0, -0.05], [1.0, 0.0], [2.0, 0.1]]
    it = parts.Harness(joint="hinge", torque=torque, bristles=[[4.0, 0.02], [9.0, 0.01]])
    table, shares = table_of(hinged(it=it), "harness")
    elastic = [0.1 * (x - 1.0) if x > 1.0 else 0.05 * (x - 1.0) for x in table.x]
    assert shares["it"] == pytest.approx([T - 0.03 for T in elastic], abs=1e-12)
    driving = 0.8 * 0.1 * (table.x + 1.0)
    resisting = [max(0.03 - T, 0.0) for T in elastic]
    pairs = zip(driving, resisting, strict=True)
    wanted = [drives / (2.0 * 3.0 * against) - 1.0 for drives, against in pairs if against]
    assert table.margin("motorization")[table.required("motorization") > 0.0] == pytest.approx(wanted)


def test_an_adhesion_counts_until_it_breaks():
    table, shares = table_of(hinged(it=parts.Adhesion(joint="hinge", torque=0.03)), "adhesion")
    assert shares["it"] == pytest.approx([-0.03, 0.0, 0.0, 0.0], abs=1e-12)
    assert table.required("motorization")[0] == pytest.approx(2.0 * 3.0 * 0.03)


def test_a_tape_is_folded_until_it_snaps_back():
    """It drives by the moment of its state along the way from the start."""
    tape = parts.TapeSpringHinge(joint="hinge", straight=[[-0.1, -4.0], [0.1, 4.0]], folded=[[0.04, 0.2], [3.0, 0.2]])
    table, shares = table_of(hinged(it=tape))
    assert shares["it"] == pytest.approx([0.2, 0.2, 0.2, 0.0], abs=1e-12)
    assert table.available == pytest.approx(0.8 * (0.1 * (table.x + 1.0) + shares["it"]))


def test_a_motor_loses_before_the_joint():
    """Its stall torque drives; detent and hysteresis are losses of the motor, the gear is friction."""
    motor = parts.Motor(
        joint="hinge", voltage={"constant": -10.0}, torque_constant=0.02, resistance=5.0, ratio=10.0,
        detent_torque=2e-3, detents=8, hysteresis_torque=3e-3, eddy_damping=1e-5, efficiency=0.7,
    )  # fmt: skip
    table, shares = table_of(hinged(it=motor), "motor losses", "friction")
    stall = 10.0 * 0.02 * 10.0 / 5.0
    assert shares["it"] == pytest.approx([stall] * 4)
    assert shares["it.magnetic"] == pytest.approx([-10.0 * 5e-3] * 4)
    assert shares["it.gear"] == pytest.approx([-0.3 * (stall - 10.0 * 3e-3)] * 4)
    assert shares["it.eddy"] == pytest.approx([0.0] * 4)
    required = 2.0 * (1.5 * 0.05 + 3.0 * 0.3 * (stall - 0.03))
    assert table.required("motorization") == pytest.approx([required] * 4)
