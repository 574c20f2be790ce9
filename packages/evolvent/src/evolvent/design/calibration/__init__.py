"""Calibration: parameters of a case fitted to measured data by least squares, with standard errors and correlations."""

from __future__ import annotations

from typing import TYPE_CHECKING

import lazy_loader as lazy

if TYPE_CHECKING:
    from evolvent.design.calibration.answer import Calibration as Calibration
    from evolvent.design.calibration.fit import calibrate as calibrate

__getattr__, __dir__, __all__ = lazy.attach(__name__, submod_attrs={"answer": ["Calibration"], "fit": ["calibrate"]})
