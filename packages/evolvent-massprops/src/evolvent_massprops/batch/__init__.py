"""A body on ground springs, many at a time: compiled blocks of fixed steps, checked against the general engine."""

from evolvent_massprops.batch.cases import BatchCase, plan, solve, suspended_of, warning_of
from evolvent_massprops.batch.suspended import (
    METHODS,
    NAME,
    Scheme,
    Suspended,
    accurate_step,
    amplification,
    integrate,
    scheme,
    stability_limit,
    warm_up,
)

__all__ = [
    "METHODS",
    "NAME",
    "BatchCase",
    "Scheme",
    "Suspended",
    "accurate_step",
    "amplification",
    "integrate",
    "plan",
    "scheme",
    "solve",
    "stability_limit",
    "suspended_of",
    "warm_up",
    "warning_of",
]
