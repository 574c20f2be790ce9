"""A measurement on springs, planned: which spring to load, how fast and how long to record, with which sensors."""

from evolvent.massprops.planning.expected import Option
from evolvent.massprops.planning.rules import Rule
from evolvent.massprops.planning.search import Plan, check, curves, plan

__all__ = ["Option", "Plan", "Rule", "check", "curves", "plan"]
