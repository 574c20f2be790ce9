"""Events."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent.model.family import Family, Kind, record, where
from evolvent.model.layout import Events
from evolvent.model.questions import EVENT, AdjointSupport, Law, Moment, calls_law, never
from evolvent.model.shares import Shares

Array = np.ndarray


def _of_state(model: Any, k: int, moment: Moment, _: bool) -> Iterator[tuple[Any, ...]]:
    yield moment[0], moment[1]


# value, middle, now: at the start, middle and end of a step of an implicit method; armed: see `kernels.user_events`
EVENTS = Family(
    "events",
    record("law first last stops", "", "value middle now armed"),
    order=340,
    kinds=(
        Kind("an event that stops a run", which=lambda found: found["stops"] != 0, symmetric=True),
        Kind("an event", which=where("stops", 0), symmetric=True),
    ),
    isolated=True,
    reads_inertia=False,
    smooth=True,
    shares=Shares(),
    laws=(Law(EVENT, calls_law, _of_state),),
    of_step=False,
    stiff=False,
    adjoint=AdjointSupport("it is no force; its time is found by neighbours", timed=False),
    uneven=never,
    events=(Events(lambda found: found.size, lambda _, k: (k, "event"), order=1),),
)  # fmt: skip
