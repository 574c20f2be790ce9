"""Structures that turn as a whole, or in groups, at the start."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import yaml

import evolvent
from evolvent import InputError, System, parts

RATE, DRIFT = 0.5, np.array([1.0, -2.0, 0.5])
AXIS = np.array([1.0, 2.0, 2.0]) / 3.0


def built(**motion: Any) -> System:
    """A hub with a clamped rod, a point mass on a link, and a point mass that is free."""
    system = System(**motion)
    system.add(parts.RigidBody(mass=2.0, shape=parts.Box(size=(1.0, 0.8, 0.6)), position=(0.1, 0.0, 0.0)), "hub")
    rod = parts.Rod(
        length=2.0, elements=4, section=evolvent.Circle(radius=0.01), material=evolvent.CFRP,
        position=(0.6, 0.0, 0.0), direction=(1.0, 0.0, 0.0), stiffness_damping=1e-3,
    )  # fmt: skip
    system.add(rod, "boom")
    system.add(parts.Joint(a="hub", b="boom.root", type="clamp"), "root")
    system.add(parts.Point(mass=0.3, position=(0.1, 2.0, 0.0)), "ball 1")
    system.add(parts.Joint(a=("hub", (0.0, 0.4, 0.0)), b="ball 1", type="link", length=1.6), "link")
    system.add(parts.Point(mass=0.2, position=(0.0, 0.0, 3.0)), "ball 2")
    return system


def test_the_whole_turns_about_its_centre_of_mass_and_drifts() -> None:
    run = built(spin={"axis": AXIS, "rate": RATE}, velocity=DRIFT).simulate(until=1e-4, every=1e-4)
    masses = {"hub": 2.0, "ball 1": 0.3, "ball 2": 0.2}
    length = float(np.pi * 1e-4 * 1600.0 * 2.0)
    mass = sum(masses.values()) + length
    centre = sum(m * run[name].position.values[0] for name, m in masses.items()) / mass
    centre = centre + length / mass * np.array([1.6, 0.0, 0.0])
    for name in (*masses, "boom"):
        x, v = run[name].position.values[0], run[name].velocity.values[0]
        np.testing.assert_allclose(v, DRIFT + RATE * np.cross(AXIS, x - centre), atol=1e-12, err_msg=name)
    np.testing.assert_allclose(run["hub"].rate.values[0], RATE * AXIS, atol=1e-14)
    np.testing.assert_allclose(run.momentum.values, [mass * DRIFT] * 2, rtol=1e-9)


def test_a_free_structure_goes_on_turning() -> None:
    """Two masses on a spring, k (2 r - l) = m w^2 r: they stay on their circle."""
    system = System(spin={"rate": np.sqrt(8.0)})
    for k, side in enumerate((-1.0, 1.0)):
        system.add(parts.Point(mass=1.0, position=(side, 0.0, 0.0)), f"ball {k}")
    system.add(parts.Spring(a="ball 0", b="ball 1", length=1.0, stiffness=8.0), "spring")
    run = system.simulate(until=2.0, every=0.5, tolerance=1e-10)
    turned = np.sqrt(8.0) * run.time.values
    np.testing.assert_allclose(run["ball 1"].position.values[:, 0], np.cos(turned), atol=1e-7)
    np.testing.assert_allclose(run["ball 1"].position.values[:, 1], np.sin(turned), atol=1e-7)


def test_groups_turn_about_points_of_their_own() -> None:
    """ "ball" is both of them; what a part has itself is added."""
    craft = {"rate": RATE, "about": (0.0, 0.0, 0.0), "parts": ["hub", "boom", "ball 1"]}
    system = built(spin=[craft, {"rate": "2 rad/s", "axis": (1, 0, 0), "about": (0, 0, 1), "parts": ["ball 2"]}])
    system.replace("ball 2", parts.Point(mass=0.2, position=(0.0, 0.0, 3.0), velocity=(7.0, 0.0, 0.0)))
    run = system.simulate(until=1e-4, every=1e-4)
    np.testing.assert_allclose(run["boom"].velocity.values[0, -1], [0.0, 2.6 * RATE, 0.0], atol=1e-14)
    np.testing.assert_allclose(run["ball 2"].velocity.values[0], [7.0, -4.0, 0.0], atol=1e-14)
    loose = built(spin={"rate": RATE, "parts": ["ball"]})  # about their centre of mass, (0.06, 1.2, 1.2)
    loose.remove("link")
    about = loose.assemble()
    n = int(about.model.info.nq)
    where = about.model.points["iv"]
    np.testing.assert_allclose(about.y[where[0] : where[0] + 3], RATE * np.array([-0.8, 0.04, 0.0]), atol=1e-14)
    assert not about.y[n : n + 6].any()


def test_a_case_holds_the_spin() -> None:
    system = built(spin={"axis": (0, 1, 0), "rate": "3 deg/s"}, velocity=(0, 0, "2 mm/s"))
    case = yaml.safe_load(system.to_yaml(until=1))
    assert case["spin"]["axis"] == [0.0, 1.0, 0.0]
    wanted = system.assemble().y
    for same in (evolvent.load(case), system.copy(), system.with_values({"spin.rate": "3 deg/s"})):
        np.testing.assert_array_equal(same.assemble().y, wanted)
    half = system.with_values({"spin.rate": "1.5 deg/s", "velocity.2": "1 mm/s"}).assemble()
    n, m = int(half.model.info.nq), int(half.model.info.nv)
    np.testing.assert_allclose(half.y[n : n + m], 0.5 * wanted[n : n + m], atol=1e-16)


def test_sensitivity_to_the_spin() -> None:
    system = System(spin={"rate": 0.5}, velocity=(0.1, 0.0, 0.0))
    system.add(parts.Point(mass=2.0, position=(0.0, 0.0, 0.0)), "hub")
    system.add(parts.Point(mass=0.3, position=(0.0, 2.0, 0.0)), "ball")
    system.add(parts.Spring(a="hub", b="ball", length=1.9, stiffness=10.0), "spring")
    own: dict[str, Any] = {"until": 0.5, "every": 0.5, "method": "generalized-alpha", "step": 2e-3}
    keys, value = ("spin.rate", "velocity.0"), "ball.position.magnitude.last"
    found = {
        mode: system.sensitivity([value], keys, mode=mode, **own).dataset.derivative.values
        for mode in ("forward", "adjoint")
    }
    for k, (key, at) in enumerate(zip(keys, (0.5, 0.1), strict=True)):
        a, b = (system.with_values({key: at + d}).simulate(keep=[value], **own)[value] for d in (1e-4, -1e-4))
        for derivative in found.values():
            assert derivative[0, k] == pytest.approx((a - b) / 2e-4, rel=1e-5)


def test_a_joint_that_the_spin_breaks_is_named() -> None:
    with pytest.raises(InputError, match=r"'root' does not fit the velocities at the start"):
        built(spin={"rate": RATE, "parts": ["boom"]}).simulate(until=0.1)


@pytest.mark.parametrize(
    ("spin", "words"),
    [
        ({"rate": 1.0, "parts": ["bom"]}, "spin.parts holds 'bom', which is no part that moves; did you mean 'boom'"),
        ({"rate": 1.0, "parts": ["link"]}, "spin.parts holds 'link', which is no part that moves"),
        ([{"rate": 1.0}, {"rate": 1.0, "axis": [0, 0, 0]}], r"spin.1.axis is \[0, 0, 0\]"),
        ({"rat": 1.0}, "unknown key 'spin.rat'; did you mean 'spin.rate'"),
        ({"axis": (0, 0, 1)}, "spin.rate is missing"),
        (5, "spin is 5; it must be a mapping"),
    ],
)
def test_what_does_not_turn_is_refused(spin: Any, words: str) -> None:
    with pytest.raises(InputError, match=words):
        _ = built(spin=spin).assemble()
