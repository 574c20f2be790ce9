"""A study that takes a moment: short deployments of blades of few nodes."""

import copy

import pytest

#: A grid of 6 cases.
STUDY = {
    "study": "short",
    "case": "heliogyro",
    "set": {"blade.segments": "inextensible", "solver.method": "dopri5", "solver.duration": "0.5 s"},
    "over": {"spool.rate": {"from": "3 rad/s", "to": "4 rad/s", "points": 3}, "blade.nodes": [3, 5]},
    "keep": ["body_rate.last", "lag_angle.max", "steps"],
}


@pytest.fixture
def study():
    """A copy of the study that may be changed."""
    return copy.deepcopy(STUDY)
