"""Events."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent.compiled.lookups import event_law_at
from evolvent.kernels import calls, watches
from evolvent.model.family import Family, Kind, record, where
from evolvent.model.layout import Events
from evolvent.model.questions import EVENT, AdjointSupport, Law, Moment, Parts, Statics, calls_law, never
from evolvent.model.shares import Shares

Array = np.ndarray


def _of_state(model: Any, k: int, moment: Moment, _: bool) -> Iterator[tuple[Any, ...]]:
    yield moment[0], moment[1]


@calls.event_values
def values(t, y, s, model, first, g):
    """Values of all laws."""
    for k in range(model.events.size):
        parameters = model.parameters[model.events[k].first : model.events[k].last]
        g[first + k] = event_law_at(model.events[k].law)(t, y, parameters)


@calls.fire
def fire(t, k, ends, y, s, model):
    """Release what waits for it."""
    released = watches.release(t, k, ends, y, s, model)
    return (watches.STOPS if model.events[k].stops != 0 else 0) + (watches.CHANGES if released else 0)


EVENTS = Family(
    "events",
    record("law first last stops"),
    order=340,
    kinds=(
        Kind("an event that stops a run", which=lambda found: found["stops"] != 0, symmetric=True),
        Kind("an event", which=where("stops", 0), symmetric=True),
    ),
    isolated=True,
    events=(
        Events(
            lambda found: found.size, lambda _, k: (k, "event"), 1, values, fire,
            stops=lambda found: found["stops"] != 0,
        ),
    ),
    laws=(Law(EVENT, calls_law, _of_state),),
    shares=Shares(),
    smooth=True,
    stiff=False,
    of_step=False,
    adjoint=AdjointSupport(
        "it is no force; its time is found by neighbours", timed=False, rates=False, mirrored=True, smooth=True
    ),
    parts=Parts(reads_inertia=False),
    statics=Statics(uneven=never),
)  # fmt: skip
