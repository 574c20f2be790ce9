"""Units in which people read angles and rates."""

import numpy as np
import pytest
import xarray as xr

import evolvent
from evolvent.base.errors import InputError
from evolvent.results import display
from evolvent.view import drawing, show


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
    rows = {number.label: number.value for number in show.numbers(run)}
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
