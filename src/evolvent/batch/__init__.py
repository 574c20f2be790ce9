"""Many small rigid models integrated at a time, in compiled blocks with fixed steps."""

from evolvent.batch.suspended import (
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
    "Scheme",
    "Suspended",
    "accurate_step",
    "amplification",
    "integrate",
    "scheme",
    "stability_limit",
    "warm_up",
]
