"""Tables of the page: pasted rows and their curve, runs beside one another, studies in the units that were typed."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
import xarray as xr

from evolvent import cases
from evolvent.analysis.margins.factors import Unstated
from evolvent.parts.registry import kinds
from evolvent_base.figures import Figure, Line, Number, Panel, Quantity
from evolvent_studio import calibratepanel, charts, comparison, fieldtypes, studytable, tables, zeroview
from evolvent_studio.job import Job
from evolvent_studio.jobview import status_of

# ------------------------------------------------------------------------------------------------ pasted


@pytest.mark.parametrize(
    ("text", "rows"),
    [
        ("0\t0\n1\t2.5\n", "[[0, 0],\n [1, 2.5]]"),
        ("time (ms)\ttorque [N m]\n0\t0\n10\t0,5", "[[0 ms, 0 N m],\n [10 ms, 0.5 N m]]"),
        ("angle, deg;force\n0;1,5\n90;-2", "[[0 deg, 1.5],\n [90 deg, -2]]"),
        ("0,1\n2,3", "[[0, 1],\n [2, 3]]"),
        ("0 1 2\n3 4 5", "[[0, 1, 2],\n [3, 4, 5]]"),
        ("0 ms\t1 N\n1 ms\t2 N", "[[0 ms, 1 N],\n [1 ms, 2 N]]"),
        ("[[0, 1], [2, 3]]", ""),
        ("table: [[0, 1]]\nsmooth: true", ""),
        ("5 N", ""),
        ("0\t1\n2", ""),
        ("0\tone\n2\t3", ""),
        ("a\nb", ""),
    ],
)
def test_rows_of_a_spreadsheet_are_taken(text, rows):
    assert tables.pasted(text) == rows
    if rows:
        assert len(cases.parse_yaml(rows, "rows")) == 2
        assert tables.pasted(rows) == "", "what was pasted is left as it is"


def test_many_rows_stand_in_one_line():
    rows = tables.pasted("\n".join(f"{k}\t{k * k}" for k in range(40)))
    assert "\n" not in rows
    assert cases.parse_yaml(rows, "rows")[39] == [39, 1521]


def test_rows_are_a_curve_in_the_units_of_the_first_of_them():
    points, units = tables.curve("[[0 s, 0 N m], [500 ms, 200 mN m], [1 s, 0 N m]]")
    assert units == ("s", "N m")
    assert np.array(points) == pytest.approx(np.array([[0, 0], [0.5, 0.2], [1, 0]]))
    loop = [[0, 0], [1, 2], [2, 2], [1, 0], [0, 0]]
    assert tables.curve(str(loop))[0] == [tuple(map(float, row)) for row in loop], "in the order of the measurement"
    for text in ("", "5 N", "[0, 1, 2]", "[[0, a], [1, 2]]", "[[0 m, 1], [1 kg, 2]]", "[[0, 1]]", "profile.csv", "[["):
        assert tables.curve(text)[0] == []


def test_fields_with_rows_know_their_columns():
    fields = {key: fieldtypes.columns_of(kinds()["resistance"].model_fields[key]) for key in ("loop", "torque", "set")}
    assert fields["loop"] == fields["torque"] == ("angle or length (rad or m)", "torque or force (N m or N)")
    assert fields["set"] == ()
    assert fieldtypes.columns_of(kinds()["reaction-wheel"].model_fields["profile"]) == ("time (s)", "torque (N m)")
    assert fieldtypes.columns_of(kinds()["rigid-body"].model_fields["inertia"]) == (), "no table of any length"


# ------------------------------------------------------------------------------------------------ runs


def _number(label, *quantities):
    return Number(label=label, value="in words", quantities=tuple(Quantity(*one) for one in quantities))


def test_results_have_a_row_a_number_with_difference_and_unit():
    first = [
        _number("rate", (1.5, "deg/s", "largest"), (0.0, "deg/s", "x at the end")),
        Number(label="latch", value="4 s"),
    ]
    other = [
        _number("rate", (1.25, "deg/s", "largest"), (0.0, "deg/s", "x at the end")),
        Number(label="latch", value="5 s"),
    ]
    assert comparison.results([first, other]) == [
        ["rate, largest", "1.5", "1.25", "-0.25", "deg/s"],
        ["latch", "4 s", "5 s", "+1 s", ""],
    ]
    small = [
        [_number("force", (0.0021, "N", ""))],
        [_number("force", (0.0033, "N", ""))],
        [_number("force", (0.002, "N", ""))],
    ]
    assert comparison.results(small) == [["force", "2.1", "3.3", "2", "1.3", "mN"]]
    assert comparison.results([[_number("force", (1.0, "N", ""))], []]) == [["force", "in words", "-", "", ""]]
    assert comparison.less(["a", "b"]) == "b less a"


def test_what_differs_between_cases_is_shown_as_it_was_written():
    texts = [cases.dump(cases.content_of("boom-slew", {"simulate.until": text})) for text in ("20 s", "500 ms")]
    assert comparison.differing(texts) == [["simulate.until", "20 s", "500 ms", "-19.5 s", ""]]
    assert comparison.differing(texts[:1] * 2)[0][0] == "nothing"


def test_lines_of_runs_are_told_apart_by_marks_and_have_one_time():
    def figure(end, count):
        x = np.linspace(0.0, end, 50)
        lines = [Line(x=x, y=k + x, label=f"line {k}") for k in range(count)]
        latched = Line(x=x[5:6], y=np.zeros(1), style="", marker="o")
        events = Panel(x_label="", y_label="", lines=[latched], y_names={0.0: "latched"})
        return Figure(name="f", title="f", panels=[events, Panel(x_label="time, s", y_label="angle, deg", lines=lines)])

    few = charts.compared([("a", figure(4.0, 2)), ("b", figure(6.0, 2))])
    assert [(c.options["xAxis"]["min"], c.options["xAxis"]["max"]) for c in few] == [(0.0, 6.0)] * 2
    assert few[0].options["yAxis"]["names"] == {"0": "latched"}
    assert [s["symbol"] for s in few[1].options["series"]] == ["circle", "circle", "triangle", "triangle"], (
        "of each run"
    )
    many = charts.compared([("a", figure(4.0, 5)), ("b", figure(6.0, 5))])[1].options
    assert len({s["symbol"] for s in many["series"][:5]}) == 5, "of each line, since the colour is the run's"
    assert all(len(s["markPoint"]["data"]) > 3 for s in many["series"])
    (alone,) = charts.charts(dataclasses.replace(figure(4.0, 2), panels=figure(4.0, 2).panels[1:]))
    assert not any("markPoint" in s for s in alone.options["series"]), "which have a colour each"


def test_columns_of_a_log_are_found_by_the_names_of_variables():
    columns = ["time (s)", "Hinge angle (deg)", "hub.rate.z", "Rate", "rate [rad/s]"]
    names = ["hinge.angle", "hub.rate.z", "rate", "hub.position"]
    assert calibratepanel.matched(columns, names) == {"hinge.angle": "Hinge angle (deg)", "hub.rate.z": "hub.rate.z"}


def test_a_warning_is_not_green():
    def job(message="", status="success", kind="margin"):
        return Job("0001-a", kind, "a", status=status, message=message)

    assert status_of(job("every margin holds, the least is 0.1")) == ("done", "success")
    assert status_of(job("the margin of 'hinge' is below 0")) == ("done", "interrupted")
    assert status_of(job(status="stopped by event", kind="run")) == ("stopped", "success")
    missed = job(kind="run")
    missed.extra["limits"] = [1, 2]
    assert status_of(missed) == ("done", "interrupted")
    assert status_of(job(status="failed")) == ("failed", "failed")


# ------------------------------------------------------------------------------------------------ zeros of margins


def test_zeros_are_declared_in_every_coordinate_or_in_one():
    content = {"parts": {}, "margin": {"zero": ["load"]}}
    assert zeroview.with_zeros(content, ["friction", "load"])["margin"] == {"zero": ["load", "friction"]}
    found = zeroview.with_zeros({"parts": {}}, ["acceleration"], "hinge 1")
    assert found["margin"] == {"lines": {"hinge 1": {"zero": ["acceleration"]}}}
    assert content["margin"] == {"zero": ["load"]}, "what was there is not changed"
    assert Unstated("a sentence", "hinge", ["friction"]).missing == ("friction",)


# ------------------------------------------------------------------------------------------------ studies


def test_a_study_is_shown_in_the_units_that_were_typed():
    rest = xr.DataArray(np.radians([-20.0, -30.0]), dims="rest", attrs={"units": "rad"})
    angle = xr.DataArray(np.radians([[10.0, 20.0], [30.0, math.nan]]), dims=("rest", "mass"), attrs={"units": "rad"})
    place = xr.DataArray(np.arange(12.0).reshape(2, 2, 3), dims=("rest", "mass", "axis"), attrs={"units": "m"})
    long = xr.DataArray(np.zeros((2, 2, 50)), dims=("rest", "mass", "time"))
    status = xr.DataArray([["success", "success"], ["success", "failed"]], dims=("rest", "mass"))
    study = xr.Dataset(
        {
            "angle": angle,
            "place": place,
            "long": long,
            "status": status,
            "reason": status.where(status == "failed", ""),
        },
        coords={"rest": rest, "mass": ("mass", [1.0, 2.0], {"units": "kg"}), "axis": ["x", "y", "z"]},
    )
    over = {"rest": ["-20 deg", "-30 deg"], "mass": "uniform(1, 2)"}
    units = studytable.Units(over, {"rest": "rad", "mass": "kg"})
    assert units.text("rest", float(rest[0])) == "-20 deg"
    assert units.text("mass", 1.5) == 1.5, "which was typed without one"
    shown = units.shown(study)
    assert shown.rest.values == pytest.approx([-20.0, -30.0])
    assert (shown.rest.attrs["units"], shown.angle.attrs["units"]) == ("deg", "deg")
    head, *rows = studytable.rows(shown, ["rest", "mass"], ["rest", "mass"])
    assert head == [
        "case",
        "status",
        "reason",
        "rest [deg]",
        "mass [kg]",
        "angle [deg]",
        *(f"place.{x} [m]" for x in "xyz"),
    ]
    assert rows[1] == [2, "success", "", -20.0, 2.0, pytest.approx(20.0), 3.0, 4.0, 5.0]
    assert (rows[3][1], math.isnan(rows[3][5])) == ("failed", True)
    hot = studytable.Units({"T": ["20 degC", "30 degC"]}, {"T": "K"})
    assert hot.text("T", 293.15) == 293.15, "degrees Celsius are no multiple of kelvins"
