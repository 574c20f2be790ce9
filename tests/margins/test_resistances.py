"""Margins of a hinge with a harness, a tape, an adhesion and a motor that loses, against calculations by hand."""

import math

import numpy as np
import pytest

from evolvent import System, parts

pytestmark = pytest.mark.slow

NONE = ("friction", "hysteresis", "harness", "motor losses", "adhesion", "load", "acceleration")


def hinged(**added):
    """An arm that opens from 90 to 0 degrees."""
    system = System(settings={"until": "0.5 s", "every": "0.01 s"})
    system.add(parts.RigidBody(mass=2.0, inertia=(0.1, 0.1, 0.2), position=(0.5, 0.0, 0.0)), "arm")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b=("arm", (-0.5, 0.0, 0.0)), type="revolute"), "pivot")
    spring = parts.JointSpring(
        joint="pivot", start=math.pi / 2, stiffness=0.1, rest=-1.0, latch=0.0, latch_stiffness=500.0
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


@pytest.mark.parametrize("law", ["slip", "dahl"])
def test_a_harness_slips_against_the_motion(law):
    """Its curve helps or resists where the joint is; the bristles resist in full, also where the curve helps more."""
    torque = [[0.0, -0.05], [1.0, 0.0], [2.0, 0.1]]
    it = parts.Resistance(joint="hinge", type="harness", torque=torque, bristles=[[4.0, 0.02], [9.0, 0.01]], law=law)
    table, shares = table_of(hinged(it=it), "harness")
    elastic = np.array([0.1 * (x - 1.0) if x > 1.0 else 0.05 * (x - 1.0) for x in table.x])
    assert elastic[0] > 0.03  # the sum helps there: the margin had been without a limit
    assert shares["it.elastic"] == pytest.approx(elastic, abs=1e-12)
    assert shares["it.hysteresis"] == pytest.approx([-0.03] * 4, abs=1e-12)
    driving = 0.8 * 0.1 * (table.x + 1.0)
    wanted = driving / (2.0 * 3.0 * (0.03 + np.maximum(-elastic, 0.0))) - 1.0
    assert table.margin("motorization") == pytest.approx(wanted)


def test_a_harness_that_helps_keeps_its_hysteresis_in_every_table():
    """By hand with the factors of each table; a table of one's own may count what helps."""
    it = parts.Resistance(joint="hinge", type="harness", stiffness=0.1, rest=-1.0, bristles=[[50.0, 0.04]])
    system = hinged(it=it)
    for factors, name, drives, times in (
        ("ECSS-E-ST-33-01C", "motorization", 0.8, 6.0), ("NASA-STD-5017B", "static", 1.0, 3.0),
        ("AIAA S-114", "static", 1.0, 2.0),
    ):  # fmt: skip
        table, _ = table_of(system, "harness", factors=factors)
        assert table.margin(name) == pytest.approx(drives * 0.1 * (table.x + 1.0) / (times * 0.04) - 1.0)
    helps = {"it.elastic": {"category": "spring"}, "it.hysteresis": {"category": "hysteresis"}}
    table, _ = table_of(system, "hysteresis", parts=helps)
    assert table.margin("motorization") == pytest.approx(0.8 * 0.2 * (table.x + 1.0) / (6.0 * 0.04) - 1.0)


def test_a_harness_along_a_run_and_without_bristles():
    def both(**bristles):
        system = hinged(it=parts.Resistance(joint="hinge", type="harness", stiffness=0.02, rest=-2.0, **bristles))
        found = system.margin(stations=3, zero=[one for one in NONE if one != "harness"])
        table = found.motion("hinge")
        return table, dict(zip([share.label for share in table.shares], table.values, strict=True))

    table, shares = both(bristles=[[1.0, 0.01]])
    assert table.x[-1] < table.x[0] - 0.005
    assert shares["it.elastic"] == pytest.approx(0.02 * (table.x + 2.0))
    assert shares["it.hysteresis"] == pytest.approx(np.full(table.x.size, -0.01))
    assert "it.hysteresis" not in both()[1]


def test_springs_and_what_damps_them_are_two_shares():
    """A spring from the arm's tip to the ground: its force as of its length, and the damping as of its rate."""
    k, c, far = 3.0, 8.0, np.array([0.0, -2.0, 0.0])
    tension = {"stiffness": k, "damping": c}, {"law": f"{k}*x + {c}*v"}
    for keys, rate in zip(tension, ("cord.damping", "cord.law_of_rate"), strict=True):
        system = hinged()
        system.add(parts.Spring(a=tuple(far), b=("arm", (0.5, 0.0, 0.0)), length=0.5, **keys), "cord")
        found = system.margin(stations=3, zero=NONE)
        table = found.motion("hinge")
        shares = dict(zip([share.label for share in table.shares], table.values, strict=True))
        x, turn = table.x, table.x - math.pi / 2.0  # the arm is 1 m long, along x at the start; it turns backwards
        u = np.array([np.cos(turn), np.sin(turn)]).T - far[:2]
        length = np.linalg.norm(u, axis=1)
        lever = (u[:, 0] * np.sin(turn) - u[:, 1] * np.cos(turn)) / length  # d(length)/dx is minus that
        assert shares["cord"] == pytest.approx(-k * (length - 0.5) * lever, rel=1e-6)
        rates = -shares[rate] / c / lever**2  # of the angle
        assert np.all(shares[rate] <= 0.0)
        assert rates[1:] == pytest.approx(-np.gradient(x, table.time)[1:], rel=0.05, abs=0.05)


def test_an_adhesion_counts_until_it_breaks():
    table, shares = table_of(hinged(it=parts.Resistance(joint="hinge", type="adhesion", strength=0.03)), "adhesion")
    assert shares["it"] == pytest.approx([-0.03, 0.0, 0.0, 0.0], abs=1e-12)
    assert table.required("motorization")[0] == pytest.approx(2.0 * 3.0 * 0.03)


def test_a_tape_is_folded_until_it_snaps_back():
    """It drives by the moment of its state along the way from the start."""
    tape = parts.Resistance(
        joint="hinge", type="tape-spring", straight=[[-0.1, -4.0], [0.1, 4.0]], folded=[[0.04, 0.2], [3.0, 0.2]]
    )
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
