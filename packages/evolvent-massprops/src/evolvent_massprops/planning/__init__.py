"""Measurements on springs, planned: where to pull, how fast and how long, with which sensors, in which mountings."""

from evolvent.massprops.planning.calibration import Calibration, Need
from evolvent.massprops.planning.expected import Option
from evolvent.massprops.planning.mountings import Further, MountingSet
from evolvent.massprops.planning.predictions import Mode
from evolvent.massprops.planning.pulls import Pull
from evolvent.massprops.planning.rules import Rule
from evolvent.massprops.planning.search import Plan, check, curves, plan

__all__ = [
    "Calibration", "Further", "Mode", "MountingSet", "Need", "Option", "Plan", "Pull", "Rule", "check", "curves",
    "plan",
]  # fmt: skip
