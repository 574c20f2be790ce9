"""Events."""

from __future__ import annotations

import numpy as np

from evolvent.model.family import Family, Kind, record, where
from evolvent.model.layout import Events

Array = np.ndarray


# value, middle, now: at the start, middle and end of a step of an implicit method; armed: see `kernels.user_events`
EVENTS = Family(
    "events",
    record("law first last stops", "", "value middle now armed"),
    order=90,
    kinds=(
        Kind("an event that stops a run", which=lambda found: found["stops"] != 0, symmetric=True),
        Kind("an event", which=where("stops", 0), symmetric=True),
    ),
    isolated=True,
    events=(Events(lambda found: found.size, lambda _, k: (k, "event")),),
)  # fmt: skip
