"""Calibrations as the studio asks for them, without a page."""

from __future__ import annotations

import inspect

import pytest

from evolvent import cases
from evolvent.design.calibration.relaxation import fit
from evolvent_base.errors import InputError
from evolvent_studio import calibratepanel, drafts, laws, relaxation, studydraft

LAW = {
    "prony": [[0.1, "1 h"], [0.2, "30 days"]],
    "shift": {"arrhenius": {"energy": "80 kJ/mol", "reference": "20 degC"}},
}


@pytest.mark.slow
def test_variables_over_time_are_offered():
    found = studydraft.over_time(cases.content_of("boom-slew"))
    assert {"hub.rate.z", "boom.tip_deflection.y"} <= set(found)
    with pytest.raises(InputError, match="unknown key"):
        studydraft.over_time(cases.content_of("boom-slew") | {"x": 1})


@pytest.mark.parametrize(
    "content",
    [
        [], {}, {"case": "x"}, {"case": {}, "fit": ["a"]}, {"case": {}, "fit": "a", "observe": ["b"]},
        {"case": {}, "fit": [1], "observe": ["b"]}, {"case": {}, "fit": ["a"], "observe": ["b"], "bounds": {"a": [1]}},
        {"case": {}, "fit": ["a"], "observe": ["b"], "deviations": 3},
    ],
)  # fmt: skip
def test_what_is_no_calibration_is_not_opened(content):
    assert not calibratepanel.is_calibration(content)


def test_the_form_of_a_calibration_takes_what_was_kept_before_it_had_two():
    old = {"file": "log.csv", "observe": [{"variable": "x"}], "fit": []}
    assert drafts.kept_calibration(old) == drafts.CALIBRATED | old
    for wrong in (None, old | {"curves": "a"}, old | {"curves": [3]}, old | {"observe": [{"variable": 3}]}):
        assert drafts.kept_calibration(wrong) is None


# ------------------------------------------------------------------------------------------------ relaxation


def test_options_of_a_relaxation_fit_are_those_of_the_function():
    wanted = set(inspect.signature(fit.fit_curves).parameters) - {"measured", "report"}
    assert set(relaxation.Asked.model_fields) - set(relaxation.OF_FILES) == wanted | {"ramp"}


def test_columns_and_options_of_a_relaxation_fit_are_refused_by_the_names_on_the_page(tmp_path):
    (tmp_path / "a.csv").write_text("time (s),torque (N m)\n" + "".join(f"{t},{1 / t}\n" for t in range(1, 9)))
    asked = relaxation.asked({"data": ["a.csv"], "column": "torqe", "temperatures": ["20 degC", "30 degC"]})
    with pytest.raises(InputError, match=r"^temperature is given 2 times for 1 file; "):
        relaxation.check(asked, [str(tmp_path / "a.csv")])
    with pytest.raises(InputError, match=r"no column 'torqe'; did you mean 'torque'\?; or write column"):
        relaxation.check(asked.replaced(temperatures=()), [str(tmp_path / "a.csv")])
    with pytest.raises(InputError, match=r"^terms is 99; it must be a whole number from 1 to"):
        relaxation.asked({"data": ["a.csv"], "column": "torque", "terms": 99})


def test_a_law_goes_into_springs_and_materials_of_a_case():
    content = cases.content_of("hinge-stored")
    parts = {
        "rope": {"kind": "beam", "length": "1 m", "section": {"circle": "1 mm"}, "material": "kevlar", "elements": 2},
        "tape": {"kind": "rod", "length": "1 m", "section": {"circle": "1 mm"}, "elements": 2},
        "wire": {"kind": "resistance", "joint": "pin", "type": "friction"},
        "strap": {"kind": "resistance", "joint": "pin", "type": "harness", "repeat": {"count": 2}},
    }
    content["parts"] |= parts
    keys = ["hinge", "rope.material", "tape", "strap"]  # nothing of friction relaxes; the tape has no material
    assert laws.places(content) == [f"parts.{key}.viscoelastic" for key in keys]
    assert [laws.held(content, place) for place in laws.places(content)] == [True, False, False, False]
    found = laws.with_law(content, LAW, laws.places(content)[:2])
    assert content["parts"]["rope"]["material"] == "kevlar"
    assert found["parts"]["hinge"]["viscoelastic"] == LAW
    before, after = (cases.load({"parts": {"rope": one["parts"]["rope"]}}).parts["rope"] for one in (content, found))
    assert after.material.viscoelastic.left == pytest.approx(0.7)
    assert after.material.replaced(viscoelastic=None) == before.material


def test_a_case_of_another_system_takes_no_law():
    assert laws.places(cases.content_of("wire-booms")) == []
