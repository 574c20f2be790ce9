"""Calibrations as the studio asks for them, without a page."""

from __future__ import annotations

import json
import time

import pytest

from evolvent import cases
from evolvent_base.errors import InputError
from evolvent_studio import calibratepanel, studydraft
from evolvent_studio.folder import Folder
from evolvent_studio.state import Studio


@pytest.fixture
def studio(tmp_path):
    made = Studio(Folder(tmp_path))
    yield made
    made.jobs.stop()


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


@pytest.mark.slow
def test_a_fit_that_cannot_be_made_ends_with_a_sentence(studio, tmp_path):
    (tmp_path / "log.csv").write_text("time (s),rate (rad/s)\n0,1\n1,2\n2,3\n")
    content = {"case": cases.content_of("boom-slew"), "fit": ["parts.hub.masss"], "observe": ["hub.rate.z=rate"]}
    extra = {"signals": [str(tmp_path / "log.csv")]}
    job = studio.jobs.add("calibrate", "x", case=json.dumps(content), extra=extra)
    for _ in range(600):
        if not job.open:
            break
        time.sleep(0.1)
    assert job.status == "failed"
    assert "unknown key 'parts.hub.masss'; did you mean 'parts.hub.mass'?" in job.message
    assert studio.jobs.report(job.key) is None
