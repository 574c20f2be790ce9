"""Measurements on springs, planned: where to pull, how fast and how long, with which sensors, in which mountings."""

from evolvent_massprops.planning.answer import Curves, MeasurementPlan
from evolvent_massprops.planning.calibration import Calibration, Need
from evolvent_massprops.planning.expected import Option
from evolvent_massprops.planning.mountings import Further, MountingSet
from evolvent_massprops.planning.predictions import Mode
from evolvent_massprops.planning.pulls import Pull
from evolvent_massprops.planning.rules import Rule
from evolvent_massprops.planning.search import check, plan

__all__ = [
    "Calibration", "Curves", "Further", "MeasurementPlan", "Mode", "MountingSet", "Need", "Option", "Pull", "Rule",
    "check", "plan",
]  # fmt: skip
