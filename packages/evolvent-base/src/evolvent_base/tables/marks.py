"""Numbers that stand for missing values."""

from __future__ import annotations

import re

import numpy as np

#: How often farther than all others a value is that marks a missing one, and what such marks look like.
_FAR, _MARK = 50.0, re.compile(r"[-+]?(9{3,}([.,]9*)?0*|32767|32768|65535|1[eE]\+?\d\d+|10{9,})([.,]0*)?")


def mark_of_missing(values: np.ndarray) -> int | None:
    """Index of a value far from all others that is written as a missing one is, such as -9999; None for none.

    Parameters
    ----------
    values : (n,) float; nan are passed over
    """
    values = np.asarray(values, dtype=float)
    if not np.isfinite(values).any():
        return None
    off = np.abs(values - np.nanmedian(values))
    far = int(np.nanargmax(off))
    others = off[np.isfinite(off) & (values != values[far])]
    if not others.size or off[far] <= _FAR * others.max() or not _MARK.fullmatch(f"{values[far]:.12g}"):
        return None
    return far
