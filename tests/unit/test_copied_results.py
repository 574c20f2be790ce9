"""Kept values of copies that are evaluated together are bitwise equal to those of single runs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

import evolvent
from evolvent import System, parts
from evolvent.analysis.copied_results import _bits
from evolvent.analysis.many_runs import ManyRuns
from evolvent.results.kept import Kept, stored_name
from evolvent_base.errors import RunFailed

#: Kept values of the case, and whether they depend on the states alone, so that copies are evaluated together.
KEPT = [
    ("hinge 1.torque.max", True),
    ("hinge 1.torque.mean", True),
    ("hinge 1.latch_torque.max", True),
    ("panel 1.position.x.last", True),
    ("energy.last", True),
    ("energy_defect.last", False),  # relative to the start of each copy
    ("hinge 1.latch_time.last", False),  # the time of an event
    ("hinge 1.latch_torque_peak.last", False),  # needs the latch event
]


def body(**settings: Any) -> System:
    """A body on a spring, for which an explicit method is chosen."""
    system = System(settings={"until": 0.5, "every": 0.05, **settings})
    system.add(parts.RigidBody(mass=2.0, inertia=(0.1, 0.2, 0.3), position=(0.0, 0.0, 0.1)), "hub")
    system.add(parts.Spring(a="hub", b=(0.0, 0.0, 1.0), stiffness=100.0, length=0.5), "spring")
    return system


@pytest.fixture(scope="module")
def array() -> System:
    return evolvent.load("solar-array")


@pytest.mark.parametrize(("name", "together"), KEPT)
def test_kept_values_of_copies_equal_those_of_single_runs(array: System, name: str, together: bool) -> None:
    points = [{"hinge 1.stiffness": 0.2 * share, "panel 1.mass": 4.0 / share} for share in (0.9, 1.0, 1.05, 1.1)]
    runs = ManyRuns(array, [name], array._run_settings({}))
    found = list(runs.kept(points, None))
    assert runs._own()[2]._is_of_states == together
    for point, one in zip(points, found, strict=True):
        assert one is not None
        alone = array.with_values(point).simulate(keep=[name])
        assert np.float64(one[name]).tobytes() == np.float64(alone[name]).tobytes()
        assert one.variables[name].attrs == alone.variables[name].attrs


@pytest.mark.parametrize("name", ["hub.position.z.last", "hub.velocity.z.at(0.33 s)", "spring.force.max", "energy.max"])
def test_kept_values_of_explicit_copies_equal_those_of_single_runs(name: str) -> None:
    system = body()
    values = {"hub.mass": [1.0, 2.0, 2.5, 3.0], "spring.stiffness": [90.0, 100.0, 110.0, 120.0]}
    found = evolvent.simulate_many(system, values, [name], workers=1)
    for k, own in enumerate(found[stored_name(name)].values.tolist()):
        alone = system.with_values({key: of[k] for key, of in values.items()}).simulate(keep=[name])
        assert np.float64(own).tobytes() == np.float64(alone[name]).tobytes()


@pytest.mark.parametrize("method", ["rk4", "dopri5"])
def test_extremes_of_copies_are_those_of_all_their_steps(method: str) -> None:
    """Copies side by side with coarse samples, which miss the peaks."""
    system = body(method=method, until=0.9, every=0.3, **({"step": 0.01} if method == "rk4" else {}))
    stiffness = np.linspace(60.0, 140.0, 20)
    name = "spring.force.min"
    found = evolvent.simulate_many(system, {"spring.stiffness": stiffness}, [name], workers=1)[stored_name(name)].values
    samples = system.simulate()["spring"].force.values
    for value, own in list(zip(stiffness.tolist(), found.tolist(), strict=True))[::5]:
        alone = system.with_values({"spring.stiffness": value}).simulate(keep=[name])[name]
        assert np.float64(own).tobytes() == np.float64(alone).tobytes()
    assert found[np.abs(stiffness - 100.0).argmin()] < samples.min() - 0.01


def test_copies_that_have_failed_at_once_leave_the_others_theirs() -> None:
    """The first copies are never placed where their parts are refused or their balance does not close."""
    system = System(settings={"until": 1.2, "every": 0.3, "fine": False, "method": "rk4", "step": 0.07})
    system.add(parts.RigidBody(motion="spin", inertia=1.0, axis=(0.0, 0.0, 1.0)), "wheel")
    system.add(parts.JointSpring(a="ground", b="wheel", axis=(0.0, 0.0, 1.0)), "hinge")
    system.add(parts.Motor(joint="hinge", torque=[[0.0, 0.0], [1.0, 10.0], [1.0, 0.0], [2.0, 0.0]]), "drive")
    values = {"drive.efficiency": [0.5, 0.6, 1.0, 1.0]}
    found = evolvent.simulate_many(system, values, ["drive.torque.max"], workers=1)
    assert found["drive_torque_max"].values[2:].tolist() == pytest.approx([10.0, 10.0])


def test_extremes_of_which_one_is_not_known_equal_themselves() -> None:
    """As of the least and the largest tension of a net: one of the two is NaN."""

    def kept(largest: float) -> Kept:
        attrs = {"units": "N", "extremes": np.array([np.nan, largest])}
        return Kept(attrs={}, variables={"net.largest_tension": xr.Variable("time", [1.0, 2.0], attrs)})

    assert _bits(kept(3.0)) == _bits(kept(3.0))
    assert _bits(kept(3.0)) != _bits(kept(4.0))


@pytest.mark.parametrize("name", ["net.largest_tension.max", "net.least_tension.min", "net.surface_error.last"])
def test_kept_of_nets_of_copies_is_that_of_single_runs(name: str) -> None:
    """Of a net at which masses pull; of its largest tension the least one is not known."""
    system = System(settings={"until": 0.02, "every": 0.01, "fine": False, "method": "rk4", "step": 1e-4})
    net: dict[str, Any] = {"surface": {"paraboloid": {"focal_length": 7.8, "diameter": 10.0}}, "node_mass": 0.01}
    net |= {"topology": {"rings": {"rings": 2}}, "force_density": 10.0, "stiffness": 2e4}
    system.add(parts.Net(**net, ties={"anchors": {"length": 0.5, "stiffness": 5e3}}), "net")
    system.add(parts.Point(mass=1.0, position=(0.0, 0.0, -1.0), velocity=(0.0, 0.0, -1.0)), "bob")
    system.add(parts.Spring(a="net[0]", b="bob", stiffness=1e3, slack=True), "string")
    points = [{"bob.mass": mass} for mass in (0.5, 1.0, 1.5)]
    runs = ManyRuns(system, [name], system._run_settings({}))
    found = list(runs.kept(points, None))
    assert runs._own()[2]._is_local
    assert runs._own()[2]._is_of_states
    for point, one in zip(points, found, strict=True):
        assert one is not None
        assert one[name] == system.with_values(point).simulate(keep=[name])[name]


def test_a_copy_whose_balance_does_not_close_fails_as_a_single_run_does() -> None:
    """Balances of copies are checked together; a copy whose balance may not close is checked as a single run is."""
    system = body(method="rk4", step=0.01, until=5.0)
    values = {"spring.stiffness": [90.0, 100.0, 20000.0, 110.0]}
    found = evolvent.simulate_many(system, values, ["hub.position.z.last"], workers=1)
    assert found.status.values.tolist() == ["success", "success", "failed", "success"]
    with pytest.raises(RunFailed) as refused:
        system.with_values({"spring.stiffness": 20000.0}).simulate(keep=["hub.position.z.last"])
    assert str(refused.value) == str(found.reason.values[2])


def test_a_view_of_the_states_shows_parameters_set_later() -> None:
    """Resets are delayed until views of the memory exist; later ones are immediate."""
    batch = body().batch(2, workers=1)
    states = batch.states
    batch.run(0.2)
    moved = states.copy()
    batch.expand("spring.stiffness", [100.0, 120.0])
    assert not np.array_equal(states, moved)
    np.testing.assert_array_equal(states[0], body().batch(1).states[0])
    assert batch.time.tolist() == [0.0, 0.0]
    batch.close()
