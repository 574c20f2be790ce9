"""Curves of viscoelastic resistances: where their energy is least, and the strain of their start."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from evolvent_base.errors import InputError

Array = np.ndarray
#: Difference of the slopes on both sides of the place of least energy, beside the larger one, up to which they are one.
_SAME = 1e-6
#: Distance of a place without torque from a row, beside the length of the curve, up to which it is that row.
_AT_ROW = 1e-9


def energies(x: Array, torque: Array) -> Array:
    """Energy at each row of a curve with straight lines between them, 0 at the first one: (n,), J."""
    found: Array = np.concatenate([[0.0], np.cumsum(0.5 * (torque[1:] + torque[:-1]) * np.diff(x))])
    return found


def _with_places(x: Array, torque: Array, low: bool, high: bool) -> tuple[Array, Array]:
    """Rows with one at each place where the torque rises through 0."""
    slope, last, own = np.diff(torque) / np.diff(x), x.size - 2, dict(zip(x.tolist(), torque.tolist(), strict=True))
    for i in np.flatnonzero(slope > 0.0).tolist():
        zero = float(x[i] - torque[i] / slope[i])
        near = x[np.abs(x - zero) <= _AT_ROW * (x[-1] - x[0])]
        zero = float(near[0]) if near.size else zero
        if (x[i] <= zero or (i == 0 and low)) and (zero <= x[i + 1] or (i == last and high)):
            own[zero] = 0.0
    rows = np.array(sorted(own.items()))
    return rows[:, 0], rows[:, 1]


def least(
    key: str, x: Array, torque: Array, *, low: bool = True, high: bool = True
) -> tuple[Array, Array, Array, float]:
    """Rows of a curve with one where its energy is least, their energies, 0 there, and the place.

    Parameters
    ----------
    key : str, of the curve, for messages
    low, high : bool, whether it goes on below and above its rows

    Raises
    ------
    InputError
        Where there is no such place, or the slopes on both sides of it differ.
    """
    _check_ends(key, x, torque, low, high)
    x, torque = _with_places(x, torque, low, high)
    energy = energies(x, torque)
    k = int(np.argmin(energy))
    slopes = (np.diff(torque) / np.diff(x))[max(k - 1, 0) : k + 1]
    if torque[k] != 0.0 or slopes.min() <= 0.0:
        raise InputError(
            f"{key} has its least energy at {x[k]:.9g}, but no torque that rises through zero there; a viscoelastic "
            f"one needs it"
        )
    if np.ptp(slopes) > _SAME * slopes.max():
        raise InputError(
            f"{key} has no torque at {x[k]:.9g}, where its slope goes from {slopes[0]:.6g} to {slopes[1]:.6g}; a "
            f"viscoelastic one must be straight there: leave that row out"
        )
    return x, torque, energy - energy[k], float(x[k])


def _check_ends(key: str, x: Array, torque: Array, low: bool, high: bool) -> None:
    """Refuse a curve whose energy falls without end."""
    slope = np.diff(torque) / np.diff(x)
    for goes_on, i, side, sense in ((low, 0, "below", -1.0), (high, -1, "above", 1.0)):
        if goes_on and (slope[i] < 0.0 or (slope[i] == 0.0 and sense * torque[i] < 0.0)):
            level = ": end it level, with a row of the same torque" if sense * torque[i] > 0.0 else ""
            raise InputError(
                f"{key} goes on straight {side} its rows, where its torque drives on without end; a viscoelastic one "
                f"must hold back there{level}"
            )


def check_folded(key: str, x: Array, torque: Array, energy: Array, upwards: bool) -> None:
    """Refuse a curve of a folded tape whose energy is not above that of the straight tape, or falls without end."""
    _check_ends(key, x, torque, not upwards, upwards)
    more, own = _with_places(x, torque, not upwards, upwards)
    all_ = energies(more, own)
    lowest = float((all_ - all_[more == x[0]]).min() + energy[0])
    if lowest <= 0.0:
        raise InputError(
            f"{key} has less energy somewhere than the straight tape has at its rest, by {-lowest:.6g} J; a "
            f"viscoelastic one must have more"
        )


def strain_at(builder: Any, curve: int, at: float) -> float:
    """Strain of a curve of the builder at a place: sqrt(2 U), negative below the place where U is 0."""
    row = builder.rows["curves"][curve]
    n, first = row["count"], row["first"]
    x, torque, energy = np.array(builder.values[first : first + 3 * n]).reshape(3, n)
    i = int(np.clip(np.searchsorted(x, at, side="right") - 1, 0, n - 2))
    slope = (torque[i + 1] - torque[i]) / (x[i + 1] - x[i])
    i += int(energy[i + 1] < energy[i])
    d = at - x[i]
    found = math.sqrt(2.0 * max(energy[i] + d * (torque[i] + 0.5 * slope * d), 0.0))
    return -found if at < row["zero"] else found
