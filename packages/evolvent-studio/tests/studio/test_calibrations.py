"""Calibrations as the studio asks for them, without a page."""

from __future__ import annotations

import pytest

from evolvent import cases
from evolvent_base.errors import InputError
from evolvent_studio import calibratepanel, studydraft


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
