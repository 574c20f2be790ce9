"""Calibration: parameters of a case fitted to measured data by least squares, with standard errors and correlations."""

from evolvent.calibration.fit import Calibration, calibrate

__all__ = ["Calibration", "calibrate"]
