"""Calibration: parameters of a case fitted to measured data by least squares, with standard errors and correlations."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from evolvent.design.calibration.answer import Calibration
    from evolvent.design.calibration.fit import calibrate

__all__ = ["Calibration", "calibrate"]


def __getattr__(name: str) -> Any:
    """The names of `calibration.fit`, loaded when they are needed: the command line starts without SciPy."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from evolvent.design.calibration import fit

    return getattr(fit, name)
