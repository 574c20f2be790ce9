"""What several systems do alike: times of samples, refusing laws."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from evolvent.errors import InputError

#: Largest number of values of the state that a run may keep.
MOST_VALUES = 200_000_000


def sample_times(every: float, end: float, *, values: int) -> np.ndarray:
    """Multiples of `every` from 0, and `end`, s.

    Parameters
    ----------
    every, end : float, s
    values : int, that are kept of each sample

    Raises
    ------
    InputError
        If a run would keep more than `MOST_VALUES`.
    """
    count = end / every
    if count * values > MOST_VALUES:
        raise InputError(f"output.every is {every:g} s; that makes {count:.3g} samples over {end:g} s, too many")
    samples = every * np.arange(int(count + 1e-9) + 1)
    if samples.size == 1 or end - samples[-1] > 1e-6 * every:
        return np.append(samples, end)
    samples[-1] = end
    return samples


def refuse_laws(laws: Mapping[str, Any] | None, system: str) -> None:
    """Refuse laws of the user's, of which a system places none.

    Raises
    ------
    InputError
        If there is one.
    """
    if laws:
        raise InputError(f"laws are given ({', '.join(laws)}), but {system} places no law of the user's")
