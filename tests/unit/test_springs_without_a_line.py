"""A spring that is compressed to length zero has a force without a direction: it is refused, or warned of."""

import math
import re

import pytest

from evolvent import EvolventError, InputError, System, parts


def bob(**spring):
    system = System()
    system.add(parts.Point(mass=1.0, position=(1.0, 0.0, 0.0)), "bob")
    system.add(parts.Spring(a=(1.0, 0.0, 0.0), b="bob", **spring), "spring")
    return system


def test_its_ends_coincide_at_the_start():
    with pytest.raises(InputError, match=r"spring\.a and spring\.b are at the same place at the start.* 10 N"):
        bob(stiffness=10.0, length=1.0).assemble()


@pytest.mark.parametrize(
    "spring", [{"stiffness": 10.0}, {"stiffness": 10.0, "length": 0.0}, {"damping": 1.0, "length": 1.0}]
)
def test_without_a_force_there_is_nothing_to_refuse(spring):
    bob(**spring).assemble()


def thrown(y=0.0, **spring):
    """A bob that is thrown at the spring's other end, which it misses by y (m)."""
    system = System()
    system.add(parts.Point(mass=1.0, position=(1.0, y, 0.0), velocity=(-10.0, 0.0, 0.0)), "bob")
    system.add(parts.Spring(a=(0.0, 0.0, 0.0), b="bob", **spring), "spring")
    return system


METHODS = {
    "energy-momentum": {},
    "generalized-alpha": {},
    "dopri5": {},
    "rk4": {"step": 1e-3},
    "heun": {"step": 1e-3},
}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("spring", [{"stiffness": 10.0, "length": 1.0}, {"law": "10*x", "length": 1.0}])
def test_its_ends_pass_through_one_another(method, spring):
    run = thrown(**spring).simulate(until=0.2, every=0.1, method=method, **METHODS[method])
    found = re.search(r"'spring' comes to length zero at t = (\S+) s, where its force of 10 N", run.attrs["warning"])
    w, v = math.sqrt(10.0), 10.0  # x = 1 - v sin(w t)/w
    assert 0.0 <= float(found[1]) - math.asin(w / v) / w < 0.011  # a step later at most


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    "spring",
    [
        {"stiffness": 10.0, "length": 0.0},
        {"stiffness": 10.0, "length": 1.0, "slack": True},
        {"law": "10*max(x, 0)", "length": 1.0},
        {"damping": 1.0, "length": 1.0},
        {"stiffness": 10.0, "length": 1.0, "y": 0.3},
    ],
)
def test_where_no_force_jumps_nothing_is_said(method, spring):
    run = thrown(**spring).simulate(until=0.2, every=0.1, method=method, **METHODS[method])
    assert "length zero" not in run.attrs.get("warning", "")


def test_a_run_that_ends_before_it_is_not_warned_of():
    run = thrown(stiffness=10.0, length=1.0).simulate(until=0.05, every=0.05)
    assert "length zero" not in run.attrs.get("warning", "")


def held(**spring):
    """A bob that other springs hold in the middle, where the spring between has no length."""
    system = System()
    system.add(parts.Point(mass=1.0, position=(0.0, 0.0, 0.0)), "bob")
    for name, place in {"left": (-1.0, 0.0, 0.0), "right": (1.0, 0.0, 0.0), "up": (0.0, 1.0, 0.0)}.items():
        system.add(parts.Spring(a=place, b="bob", stiffness=100.0, length=1.0), name)
    system.add(parts.Spring(a=(0.0, 0.0, 0.0), b="bob", **spring), "spring")
    return system


@pytest.mark.parametrize("solve_it", [System.equilibrium, System.modes])
def test_statics_and_modes_refuse_it(solve_it):
    with pytest.raises(EvolventError, match=r"'spring' has length zero, where its force of 3 N has no direction"):
        solve_it(held(law="3*x", length=1.0))


def test_statics_take_a_spring_that_has_no_force_there():
    assert held(stiffness=3.0).equilibrium().attrs["status"] == "success"
