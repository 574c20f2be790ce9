"""Units in which people read angles and rates."""

import numpy as np
import pytest
import xarray as xr

import evolvent
from evolvent import cases, parts
from evolvent.results import display
from evolvent.view import animation, drawing, show, summary, table
from evolvent_base.errors import InputError


@pytest.mark.parametrize(
    ("unit", "units", "factor", "name"),
    [
        ("rad", "deg", 180.0 / np.pi, "deg"),
        ("rad s-1", "deg", 180.0 / np.pi, "deg s-1"),
        ("rad s-1", "rpm", 30.0 / np.pi, "rpm"),
        ("rad", "rpm", 180.0 / np.pi, "deg"),
        ("rad", "rad", 1.0, "rad"),
        ("N m rad-1", "deg", 1.0, "N m rad-1"),
        ("m", "deg", 1.0, "m"),
    ],
)
def test_units_that_people_read(unit, units, factor, name):
    assert display.shown_unit(unit, units) == (pytest.approx(factor), name)
    found = xr.DataArray([0.5, 1.0], dims="time", attrs={"units": unit, "long_name": "it"})
    seen = display.shown(found, units)
    assert seen.attrs == {"units": name, "long_name": "it"}
    np.testing.assert_allclose(seen.values, factor * found.values)
    assert found.attrs["units"] == unit


def test_other_units_are_refused():
    with pytest.raises(InputError, match="units is 'degree'; did you mean 'deg'"):
        display.shown_unit("rad", "degree")


@pytest.mark.slow
def test_a_run_is_read_in_degrees_and_keeps_radians():
    run = evolvent.run("solar-array", {"simulate.until": 1.0})
    angle, rate = run["hinge 1"]["angle"], run["panel 1"]["rate"]
    assert (angle.attrs["units"], rate.attrs["units"]) == ("rad", "rad s-1")
    rows = {number.label: number.value for number in table.numbers(run)}
    assert rows["hinge 1.angle"].startswith(f"{np.degrees(float(angle[-1])):.5g} deg")
    (panel,) = show.figure(run, ["hinge 1.angle"]).panels
    assert panel.y_label.endswith(", deg")
    np.testing.assert_allclose(panel.lines[0].y, np.degrees(angle))
    (panel,) = show.figure(run, ["panel 1.rate.z"], units="rpm").panels
    assert panel.y_label.endswith(", rpm")
    np.testing.assert_allclose(panel.lines[0].y, rate[:, 2] * 30.0 / np.pi)
    assert run.ev.plot("hinge 1.angle", units="rad").axes[0].get_ylabel().endswith("[rad]")
    motion = drawing.motion_of(run, title="")
    labels = [label for label in motion.numbers if "angle" in label]
    assert labels
    assert all(label.endswith("[deg]") for label in labels)


def spinner(rate, wheel=100.0):
    """A free body with a wheel, and a hub that spins; values with the units that they are given in."""
    system = evolvent.System()
    system.add(parts.RigidBody(mass=5.0, inertia=2.0, angular_velocity=[0, 0, rate]), "bus")
    system.add(
        parts.ReactionWheel(body="bus", axis=(0.0, 0.0, 1.0), inertia=0.05, rate=wheel, torque_limit=0.1), "wheel"
    )
    system.add(parts.RigidBody(motion="spin", inertia=1.0, position=(1.0, 0.0, 0.0), rate="90 deg/s"), "hub")
    return system


@pytest.mark.slow
def test_a_rate_that_is_written_in_rpm_is_read_in_rpm(tmp_path):
    """Of that part in tables, figures, animations and files; the other part stays in deg/s, and data in rad/s."""
    run = spinner("12 rpm", "3000 rpm").simulate(until=0.5)
    evolvent.save(run, tmp_path / "run.nc")
    for found in (run, evolvent.open(tmp_path / "run.nc")):
        assert found["bus"].rate.attrs["units"] == "rad s-1"
        np.testing.assert_allclose(found["bus"].rate[:, 2], 12.0 * np.pi / 30.0)
        rows = {number.label: number.value for number in table.numbers(found)}
        assert rows["bus.rate"].startswith("(0, 0, 12) rpm at the end")
        assert rows["wheel.rate"].startswith("3000 rpm at the end")
        assert rows["hub.rate"].startswith("(0, 0, 90) deg/s at the end")
        labels = [panel.y_label for figure in summary.figures(found) for panel in figure.panels]
        assert sum(label.endswith(", rpm") for label in labels) == 2
        assert sum(label.endswith(", deg/s") for label in labels) == 1
        assert "wheel.rate [rpm]" in drawing.motion_of(found, title="").numbers
        assert [panel.y_label[-5:] for panel in show.figure(found, ["hub.rate", "bus.rate.z"]).panels] == [
            "deg/s", ", rpm",
        ]  # fmt: skip
        (panel,) = show.figure(found, ["wheel.rate"], units="deg").panels
        np.testing.assert_allclose(panel.lines[0].y, 18000.0, rtol=1e-6)
    assert "rpm" in animation.page(drawing.motion_of(run, title=""))[0].decode()


def test_a_unit_that_people_read_stays_with_the_key():
    """Cases hold rates as they were written, and the same floats are read again from them; other units become SI."""
    for rate, text in (("12.5 rpm", "12.5 rpm"), ("90 deg/s", f"{np.pi / 2.0!r} rad/s"), (0.1, "0.1 rad/s")):
        system = spinner(rate)
        content = cases.parse_yaml(system.to_yaml(), "case")
        assert content["parts"]["bus"]["angular_velocity"][-1] == text
        again = evolvent.load(content).parts["bus"]
        assert again.angular_velocity == system.parts["bus"].angular_velocity
        assert again.as_keys() == system.parts["bus"].as_keys()


def test_drives_in_rpm():
    """A drive keeps the unit of its rate, also where the rate may be a speed."""
    drive = parts.Joint(a="ground", b="hub", type="revolute", drive={"constant": {"rate": "6 rpm"}})
    assert drive.as_keys()["drive"] == {"constant": {"rate": "6 rpm"}}
    moved = parts.Joint(a=(0.0, 0.0, 0.0), b="bob", type="involute", drive={"constant": {"rate": "6 rpm"}}, drum=1.0)
    assert moved.as_keys()["drive"] == {"constant": {"rate": "6 rpm"}}


def test_round_off_and_signs_of_zero_are_named_as_zero() -> None:
    """A position of 1e-30 m beside one of 1 m, and one of -0."""
    system = evolvent.System()
    system.add(parts.Point(mass=1.0, position=(1e-30, 0.0, -0.0)), "still")
    system.add(parts.Point(mass=1.0, position=(1.0, 0.0, 0.0), velocity=(1.0, 0.0, 0.0)), "moving")
    run = system.simulate(until=1.0)
    rows = {row.label: row.value for row in cases.presenter(run).numbers(run)}
    assert rows["zero throughout"] == "still.position"
    assert rows["moving.position"].startswith("(2, 0, 0) m")
