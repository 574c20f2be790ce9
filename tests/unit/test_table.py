"""Rows of a run's table: those of repeated parts in one, no round-off, and a line for every kind of event."""

import numpy as np
import pytest
import xarray as xr

import evolvent
from evolvent import System, cases, parts
from evolvent.results.happened import events_of
from evolvent.results.observe.variables import Observed
from evolvent.view import summary, table
from evolvent.view.table import Row
from evolvent_base.figures import Number, Quantity


@pytest.mark.parametrize(
    ("names", "text"),
    [
        (["rib 1"], "rib 1"),
        (["rib 1", "rib 2"], "rib 1 and 2"),
        (["rib 1", "rib 2", "rib 3", "rib 4"], "rib 1 to 4"),
        (["rib 1", "rib 2", "rib 3", "rib 7"], "rib 1 to 3 and 7"),
        (["rib 1", "rib 2", "rib 4", "rib 5"], "rib 1, 2, 4 and 5"),
        (["rib 1 cord", "rib 2 cord"], "rib 1 and 2 cord"),
        (["hub", "bus"], "hub, bus"),
    ],
)
def test_names_in_one(names, text):
    assert table.listed(names) == text


def row(part, *values, unit="N", sizes=()):
    numbers = tuple(Quantity(value, unit, what) for value, what in zip(values, ("at the end", "largest"), strict=False))
    own = tuple(Quantity(value, unit, "magnitude") for value in sizes)
    return Row(part=part, rest=".force", text=f"{values[0]:.5g} {unit}", numbers=numbers, sizes=own, sizes_text="size")


def test_equal_rows_are_joined_and_others_stay():
    found = table.joined(
        [row("rib 1", 1.0, 2.0), row("hub", 1.0, 2.0), row("rib 2", 1.0 + 1e-9, 2.0), row("rib 3", 1.1, 2.0)]
    )
    assert [one.label for one in found] == ["rib 1 and 2.force", "rib 3.force", "hub.force"]
    assert found[0].quantities[0].value == 1.0


def test_rows_of_one_magnitude_are_joined_by_it():
    found = table.joined([row("rib 1", 1.0, sizes=(2.0,)), row("rib 2", -1.0, sizes=(2.0,))])
    assert [(one.label, one.value) for one in found] == [("rib 1 and 2.force", "size")]


def test_many_different_rows_are_ranges():
    (found,) = table.joined([row(f"rib {k}", 1.0 * k, 10.0 * k) for k in range(1, 7)])
    assert found.label == "rib 1 to 6.force"
    assert found.value == "at the end 1 N to 6 N, largest 10 N to 60 N (rib 6)"
    assert [one.value for one in found.quantities] == [1.0, 6.0, 10.0, 60.0]


def test_a_largest_value_is_taken_over_all_steps_where_known() -> None:
    """A slide whose latch acts for some milliseconds, sampled ten times a second."""
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=1.0, position=(1.0, 0.0, 0.0)), "mass")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="mass", type="prismatic", axis=(1.0, 0.0, 0.0)), "slide")
    latch = {"latch": 0.0, "latch_stiffness": 1e6, "latch_damping": 500.0}
    system.add(parts.JointSpring(joint="slide", stiffness=10.0, start=1.0, rest=-0.2, **latch), "spring")
    run = system.simulate(until=1.0, every=0.1)

    def row() -> Number:
        (found,) = [one for one in table.numbers(run) if one.label == "spring.force"]
        return found

    largest = next(one.value for one in row().quantities if one.what == "largest")
    assert abs(largest) == pytest.approx(float(run["spring"].latch_force_peak[-1]), rel=1e-2)
    assert abs(largest) > 2.0 * float(np.abs(run["spring"].force).max())
    assert " near " not in row().value  # the largest sample, after the latch, is far below
    del run["spring"].force.attrs["extremes"]  # as if they were not known
    assert "largest of the samples" in row().value


def driven(table: list[list[float]]) -> xr.DataTree:
    """A wheel that a motor turns by a torque over time, sampled ten times a second."""
    system = System()
    system.add(parts.RigidBody(motion="spin", inertia=1.0, axis=(0.0, 0.0, 1.0)), "wheel")
    system.add(parts.JointSpring(a="ground", b="wheel", axis=(0.0, 0.0, 1.0)), "joint")
    system.add(parts.Motor(joint="joint", torque=table), "drive")
    return system.simulate(until=1.0, every=0.1, fine=False)


def row_of(run: xr.DataTree, label: str) -> str:
    (found,) = (one.value for one in table.numbers(run) if one.label == label)
    return str(found)


SPIKE = [[0.0, 0.0], [0.12, 0.0], [0.13, -10.0], [0.14, 0.0]]


def test_a_spike_that_no_sample_has_has_a_row_and_no_time() -> None:
    run = driven([*SPIKE, [1.0, 0.0]])
    assert not run["drive"].torque.values.any()
    assert row_of(run, "drive.torque") == "0 N m at the end, largest -10 N m"
    panels = [panel for panel in summary.figures(run)[0].panels if panel.y_label.startswith("torque of motors")]
    assert [line.label for panel in panels for line in panel.lines] == ["drive: 10 N m"]  # without a mark


def test_a_peak_has_not_the_time_of_one_of_the_other_sign() -> None:
    run = driven([*SPIKE, [0.5, 0.0], [0.6, 5.0], [0.7, 0.0], [1.0, 0.0]])
    assert row_of(run, "drive.torque") == "0 N m at the end, largest -10 N m"
    run = driven([[0.0, 0.0], [0.13, -10.0], [0.26, 0.0], [0.5, 0.0], [0.6, 9.0], [0.7, 0.0], [1.0, 0.0]])
    assert row_of(run, "drive.torque") == "0 N m at the end, largest -10 N m near 0.1 s"
    line, mark = next(p for p in summary.figures(run)[0].panels if p.y_label.startswith("torque of motors")).lines
    assert line.label == "drive: 10 N m near 0.1 s"
    assert (float(mark.x[0]), float(mark.y[0])) == (pytest.approx(0.1), pytest.approx(-10.0))


def test_changes_and_one_way_forces_are_events():
    t, found = np.arange(6.0), Observed()
    found.scalar("tension", np.array([0.0, 2.0, 1.0, 1e-9, 0.0, 1.0]), "N", "tension")
    found.acts_one_way(t, "tension", zero="slack", other="taut")
    assert found.happened == [(1.0, "taut"), (3.0, "slack"), (5.0, "taut")]
    assert found.one_sided == {"tension": "slack"}
    found.happens("released", 2.5, t)
    found.happens("released", np.nan, t)
    found.happens("released", 9.0, t)
    assert found.happened[3:] == [(2.5, "released")]


@pytest.fixture(scope="module")
def cord():
    """A mass that a slack cord stops, beside one that stays in place and is released from the ground."""
    system = System()
    system.add(parts.Point(mass=1.0, position=(0.5, 0.0, 0.0), velocity=(1.0, 0.0, 0.0)), "mass")
    system.add(parts.Spring(a=("ground", (0, 0, 0)), b="mass", stiffness=100.0, length=1.0, slack=True), "cord")
    system.add(parts.RigidBody(mass=1.0, inertia=1.0, position=(0.0, 2.0, 0.0)), "bus")
    system.add(parts.Joint(a=("ground", (0, 2, 0)), b="bus", type="clamp", until=0.25), "clamp")
    return system.simulate(until=1.5, every=0.005)


def test_a_cord_is_taut_for_half_a_period(cord, tmp_path):
    """It is taut from 0.5 s, for half a period of the spring, pi / 10 s, and pulls with 10 N at most."""
    evolvent.save(cord, tmp_path / "run.nc")
    for run in (cord, evolvent.open(tmp_path / "run.nc")):
        events = events_of(run)
        happened = list(zip(events.part.values, events.what.values, strict=True))
        assert happened == [("clamp", "released"), ("cord", "taut"), ("cord", "slack")]
        np.testing.assert_allclose(events.time, [0.25, 0.5, 0.5 + np.pi / 10.0], atol=0.006)
        rows = {one.label: one for one in cases.presenter(run).numbers(run)}
        numbers = {one.what: one.value for one in rows["cord.force"].quantities}
        assert numbers["largest"] == pytest.approx(10.0, rel=1e-3)
        assert numbers["mean"] == pytest.approx(2.0 / 1.5, rel=1e-3)  # the impulse turns the mass round
        slack = 100.0 * (1.0 - np.pi / 10.0 / 1.5)
        assert numbers["share of the time in which it is slack"] == pytest.approx(slack, abs=0.8)
        assert "slack in" in rows["cord.force"].value
        assert rows["clamp, released"].value == "at 0.25 s"
        # nothing acts on the bus: its rate and the reactions of its clamp are no rows
        assert not any(label.startswith(("bus.rate", "clamp.force")) for label in rows)
        assert {"bus.rate", "clamp.force", "clamp.moment"} <= set(rows["zero throughout"].value.split(", "))


def test_what_acts_on_a_coordinate_does_not_repeat_its_angle():
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=1.0), "flap")
    system.add(parts.Joint(a="ground", b="flap", type="revolute", axis=(0, 0, 1), position=(0, 0, 0)), "pin")
    system.add(parts.JointSpring(joint="pin", stiffness=1.0, rest=0.5, low=-1.0, high=0.8, stop=1e3), "spring")
    system.add(parts.Motor(joint="spring", torque={"constant": 0.1}), "motor")
    run = system.simulate(until=3.0)
    assert {"motor.angle", "pin.angle"} & summary.same_angles(run) >= {"motor.angle"}
    events = events_of(run)
    assert ("spring", "stop hit") in zip(events.part.values, events.what.values, strict=True)
