"""Calibration by least squares: parameters of a case fitted to measured data, and Prony series to relaxation curves."""

from __future__ import annotations

from typing import TYPE_CHECKING

import lazy_loader as lazy

if TYPE_CHECKING:
    from evolvent.design.calibration.answer import Calibration as Calibration
    from evolvent.design.calibration.fit import calibrate as calibrate
    from evolvent.design.calibration.relaxation import Relaxation as Relaxation, fit_relaxation as fit_relaxation

__getattr__, __dir__, __all__ = lazy.attach(
    __name__,
    submod_attrs={
        "answer": ["Calibration"], "fit": ["calibrate"], "relaxation": ["Relaxation", "fit_relaxation"],
    },
)  # fmt: skip
