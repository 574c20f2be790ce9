"""Friction by the reactions in margins: at stations against calculations by hand, and along a run."""

import math

import numpy as np
import pytest

from evolvent import System, parts

pytestmark = pytest.mark.slow

ZERO = ("hysteresis", "harness", "motor losses", "adhesion", "load", "acceleration")
STILL = {"motion": False, "stations": 5, "zero": ZERO}
G, MASS, STATIC, KINETIC = 9.81, 2.0, 0.3, 0.2


def of(table, label):
    """Values of a share."""
    return table.values[[one.label for one in table.shares].index(label)]


def arm(**more):
    """An arm that a spring turns about the vertical from 0 to a latch at 90 degrees, hanging on its bearing."""
    system = System(gravity=(0.0, 0.0, -G))
    system.add(parts.RigidBody(mass=MASS, inertia=(0.1, 0.1, 0.2), position=(0.5, 0.0, 0.0)), "arm")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b=("arm", (-0.5, 0.0, 0.0)), type="revolute"), "pivot")
    spring = {"stiffness": 2.0, "rest": math.pi, "latch": math.pi / 2, "latch_stiffness": 500.0}
    system.add(parts.JointSpring(joint="pivot", **spring), "hinge")
    keys = {"coefficient": KINETIC, "static_coefficient": STATIC, "journal_radius": 0.01, "thrust_radius": 0.02}
    system.add(parts.Bearing(joint="hinge", **(keys | {"span": 0.1, "preload": 4.0} | more)), "bearing")
    return system


def test_an_arm_by_hand():
    table = arm().margin(**STILL)["hinge"]
    weight = MASS * G
    torque = STATIC * (0.01 * 2.0 * weight * 0.5 / 0.1 + 0.02 * (weight + 4.0))
    assert of(table, "bearing") == pytest.approx(np.full(5, -torque), rel=1e-9)
    assert next(one for one in table.shares if one.label == "bearing").category == "friction"
    assert table.required("motorization") == pytest.approx(np.full(5, 6.0 * torque), rel=1e-9)
    assert table.available == pytest.approx(0.8 * 2.0 * (math.pi - table.x), rel=1e-9)
    assert table.coordinate.held == table.coordinate.follow == ()


def test_a_drawer_that_a_spring_pulls_beside_its_guide():
    """Reactions follow the pull and its lever; beyond span/(2 mu) no spring moves it."""
    for e in (0.05, 0.4):
        system = System()
        system.add(parts.RigidBody(mass=3.0, inertia=(1.0, 1.0, 1.0)), "drawer")
        system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="drawer", type="prismatic", axis=(1, 0, 0)), "rail")
        system.add(parts.JointSpring(joint="rail", low=0.0, high=0.4, stop=1e4), "slide")
        system.add(parts.Bearing(joint="rail", coefficient=STATIC, span=0.2), "bearing")
        system.add(parts.Spring(a=(1.0, e, 0.0), b=["drawer", (0.0, e, 0.0)], length=0.1, stiffness=50.0), "pull")
        table = system.margin(**STILL)["slide"]
        pull = 50.0 * (0.9 - table.x)
        assert of(table, "pull") == pytest.approx(pull, rel=1e-9)
        assert of(table, "bearing") == pytest.approx(-STATIC * 2.0 * pull * e / 0.2, rel=1e-9)
        assert (table.values.sum(axis=0) > 0.0).all() == (e < 0.2 / (2.0 * STATIC))


def test_hinges_of_a_linkage_load_one_another():
    """A parallelogram that hangs: the friction of the other hinges is among the loads of each."""
    mu, r, length, torque = 0.4, 0.05, 0.3, 5.0
    system = System(gravity=(0.0, 0.0, -G))
    for k, x in enumerate((0.0, 1.0)):
        system.add(
            parts.RigidBody(mass=1e-6, inertia=(1e-8, 1e-8, 1e-8), position=(x, 0.0, -0.5 * length)), f"crank {k}"
        )
        top = parts.Joint(a=(x, 0.0, 0.0), b=(f"crank {k}", (0.0, 0.0, 0.5 * length)), type="revolute", axis=(0, 1, 0))
        system.add(top, f"top {k}")
    system.add(parts.RigidBody(mass=MASS, inertia=(1.0, 1.0, 1.0), position=(0.5, 0.0, -length)), "rod")
    for k, at in enumerate((-0.5, 0.5)):
        low = parts.Joint(
            a=(f"crank {k}", (0.0, 0.0, -0.5 * length)), b=("rod", (at, 0.0, 0.0)), axis=(0, 1, 0),
            type="revolute" if k == 0 else "spherical",
        )  # fmt: skip
        system.add(low, f"low {k}")
    system.add(parts.JointSpring(joint="top 0", low=-1.0, high=0.8, stop=1.0), "hinge")
    system.add(parts.Motor(joint="hinge", torque={"constant": torque}), "motor")
    system.add(parts.Bearing(joint="low 0", coefficient=mu, journal_radius=r), "bearing")
    table = system.margin(**STILL, lines={"hinge": {"travel": [0.0, 0.8]}})["hinge"]
    # crank 0 turns against the rod; its weight without the other crank's: half each, and T/length across the crank
    rubs = -of(table, "bearing")
    assert np.all(rubs > 0.0)
    # the other crank is light: it carries along itself alone, as the moment about the rod's lower joint 0 gives
    x = table.x
    for n in range(x.size):
        a = np.array([-math.sin(x[n]), 0.0, -math.cos(x[n])])  # along the cranks, right-handed about y

        # moments on the rod about joint 0: weight, tension S of crank 1, friction t: all about y
        def load(t, a=a):
            # (0.5, 0, 0) x (0, 0, -m g) + (1, 0, 0) x (-S a) = -/+ t
            S = (0.5 * MASS * G - t) / -a[2]
            return np.linalg.norm(np.array([0.0, 0.0, MASS * G]) + S * a)

        best = min(abs(rubs[n] - mu * r * load(sign * rubs[n])) for sign in (1.0, -1.0))
        assert best < 1e-5 * rubs[n]


def test_along_a_run_the_reactions_are_those_of_the_motion():
    system = arm(bristle_stiffness=1e4)
    system.settings = {"until": "1 s", "every": "0.02 s", "fine": False}
    table = system.margin(zero=ZERO, stations=3).motion("hinge")
    run = system.simulate()["bearing"]
    n = table.time.size
    slides = run.torque.values[:n] > 0.99 * run.torque_limit.values[:n]
    assert slides.sum() > n - 3
    assert of(table, "bearing")[slides] == pytest.approx(-run.torque.values[:n][slides], rel=1e-4)
    rest = 2.0 * MASS * G * 0.5 / 0.1  # without the force that speeds the arm up
    assert run.radial_force.values[:n].max() > rest * (1.0 + 5e-4)
