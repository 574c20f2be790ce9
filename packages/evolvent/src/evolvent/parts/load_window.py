"""When loads act, and in which axes."""

from __future__ import annotations

import math
from typing import Any, Literal

from evolvent.assembly.builder import Builder
from evolvent_base.errors import InputError

FRAMES = {"inertial": 0.0, "body": 1.0}
Frame = Literal["inertial", "body"]


def window(builder: Builder, name: str, load: Any) -> float:
    """Time at which a load with the keys `start`, `until` and `ramp` ends, s; its times become breaks."""
    end = math.inf if load.until is None else float(load.until)
    if not end > load.start:
        raise InputError(f"{name}.until is {end!r}; it must be after start {load.start!r}")
    times = (load.start, load.start + load.ramp if load.ramp else 0.0, end)
    builder.breaks.update(t for t in times if math.isfinite(t) and t > 0.0)
    return end
