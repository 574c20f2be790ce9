"""Drives of records: their values over time, and drives that stand."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.kernels.drive import RAMPS, drive_angles

Array = np.ndarray
#: Share of a length by which a drive may run past its ends.
ROUND_OFF = 1e-9


def angles_of(row: Any, model: Any, times: Array, prefix: str = "") -> Array:
    """Values of the drive of a row, rad or m, or of another one whose fields have a prefix: (nt,)."""
    angles = np.empty(times.size)
    first, last, law = (int(row[prefix + key]) for key in ("first", "last", "law"))
    drive_angles(int(row[prefix + "drive"]), model.parameters[first:last], law, times, angles)
    return angles


def set_ramp(model: Any, row: Array, prefix: str, value: float, rate: float) -> Any:
    """The model in which the drive of a row, a view of one record, has a value at t = 0 and rises by a rate."""
    first = model.parameters.size
    row[prefix + "drive"], row[prefix + "law"] = RAMPS, 0
    row[prefix + "first"], row[prefix + "last"] = first, first + 3
    return model._replace(parameters=np.append(model.parameters, [value, rate, 0.0]))
