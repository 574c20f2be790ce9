"""How the start of the drive shapes the lag (shared/models/thread.md, "Beyond the paper")."""

from __future__ import annotations

import numpy as np
import pytest

from evolvent import parts
from helpers import SPOOL, heliogyro, run


@pytest.mark.parametrize(("ramp", "peak"), [(0.0, 20.3), (1.0, 14.3), (2.0, 13.8), (5.0, 13.6)])
@pytest.mark.parametrize("segments", ["springs", "inextensible"])
def test_peak_lag_of_a_ramped_start(segments: str, ramp: float, peak: float) -> None:
    """Start from 5 mm with a quintic ramp of 0 / 1 / 2 / 5 s: peak lag 20.3 / 14.3 / 13.8 / 13.6 deg (thread.md)."""
    if ramp == 0.0:
        drive = parts.ConstantDrive(rate=SPOOL, angle=0.5)
    else:
        drive = parts.RampDrive(rate=0.0, angle=0.5, steps=[(0.0, ramp, SPOOL)])
    t = np.linspace(0.0, 7.0, 701)
    method = "rk4" if segments == "springs" else "dopri5"
    lag = run(heliogyro(drive=drive, segments=segments), t, method).lag()
    assert lag.max() == pytest.approx(peak, abs=0.06)
