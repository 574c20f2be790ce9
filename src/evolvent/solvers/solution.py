"""What a solver returns."""

from __future__ import annotations

import dataclasses

import numpy as np


@dataclasses.dataclass
class Solution:
    """What a solver returns; it prints nothing.

    Attributes
    ----------
    t : (nt,) float, s, times of the samples
    y, s : (nt, ny) float and (nt, ns) int, states there
    status : {"success", "stopped by event", "interrupted", "failed"}
    message : str, one sentence; for a failure: what, where, when, what to try
    statistics : dict of steps, rejected, rhs evaluations, events, step (s), stability_limit (s), energy_defect
    event_times, event_kinds : (ne,) float and int
    wall_time, compile_time : float, s
    """

    t: np.ndarray
    y: np.ndarray
    s: np.ndarray
    status: str
    message: str
    statistics: dict[str, float]
    event_times: np.ndarray
    event_kinds: np.ndarray
    wall_time: float
    compile_time: float

    @property
    def success(self) -> bool:
        """Whether the run reached its end, or the event that was to stop it."""
        return self.status in ("success", "stopped by event")
