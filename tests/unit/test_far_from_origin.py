"""Structures far from the origin: the motion is that at the origin, or a sentence names the distance as the cause."""

import numpy as np
import pytest

from evolvent import RunFailed, System, parts

pytestmark = pytest.mark.slow


def pendulum(far):
    """Two hinged bodies that fall."""
    system = System(gravity=(0, 0, -9.81))
    for k, name in enumerate(("one", "two")):
        system.add(parts.RigidBody(mass=1, inertia=0.1, position=(far + 0.5 + k, 0, 0)), name)
        a = "ground" if k == 0 else "one"
        system.add(parts.Joint(a=a, b=name, type="revolute", axis=(0, 1, 0), position=(far + k, 0, 0)), f"pin {k}")
    return system


@pytest.mark.parametrize(("method", "off"), [("dopri5", 1e-6), ("energy-momentum", 1e-5)])
def test_seven_thousand_kilometres_away(method, off):
    runs = [pendulum(far).simulate(until=0.5, every=0.05, method=method) for far in (0.0, 7e6)]
    at_origin, away = (run["two"].position.values for run in runs)
    assert np.abs(away - (7e6, 0.0, 0.0) - at_origin).max() < off


def test_what_does_not_work_far_away_says_why():
    with pytest.raises(RunFailed) as caught:
        pendulum(7e6).simulate(until=1.0, every=0.02, method="generalized-alpha")
    said = str(caught.value)
    assert "the system lies 7e+06 m from the origin" in said
    assert "place it near the origin" in said
    assert "tolerance" not in said


@pytest.mark.parametrize("far", [3e3, 2e5])
def test_steps_are_as_short_as_at_the_origin(far):
    """The distance from the origin is not a size of the structure, by which errors of steps are measured."""

    def tip(x):
        system = System(gravity=(0, 0, -9.81))
        section = {"circle": {"radius": 0.005}}
        system.add(
            parts.Rod(
                length=1, section=section, material="steel", elements=3, position=(x, 0, 0), stiffness_damping=1e-3
            ),
            "rod",
        )
        system.add(parts.Joint(a=(x, 0, 0), b="rod.root", type="clamp"), "clamp")
        run = system.simulate(until=0.2, every=0.01)
        return run["rod"].tip_position.values - (x, 0.0, 0.0)

    at_origin, away = tip(0.0), tip(far)
    assert np.abs(away - at_origin).max() < 1e-3 * np.abs(at_origin[:, 2]).max()
