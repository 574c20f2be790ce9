"""Users' events that rise within a step of an implicit method and are looked for between its ends (`event_search`)."""

from __future__ import annotations

from numba import void

from evolvent.compiled.jit import REAL, indirect, inlined
from evolvent.kernels.watches import ARMED, FIRED, note_middles, watch
from evolvent.model import MODEL
from evolvent.solvers.time.dense import interpolate
from evolvent.solvers.time.event_search import END, FIRST, MIDDLE, START, begin_search, next_row
from evolvent.solvers.time.implicit.workspace import WORKSPACE

#: Times that a step is shortened at most for what is found between its ends.
MOST_FOUND = 30


@indirect(void(REAL, REAL, MODEL, WORKSPACE), used_for="watches")
def note_middle(t, h, model, work):
    """Values of events in the middle of a step of length h that ends at t."""
    interpolate(0.5, h, work.y0, work.y, model, work.spare)
    note_middles(t - 0.5 * h, work.spare, model)


@indirect(REAL(REAL, REAL, REAL, MODEL, WORKSPACE), used_for="watches")
def rise_in_step(t, h, due, model, work):
    """Length, as a part of h, of the step to try in place of one of length h that ends at t, with events in between.

    Parameters
    ----------
    due : float, the part by the values at the ends; it stays where these show all

    Notes
    -----
    The step that is tried ends where an event has risen, or before it where its value first has to fall below zero: its
    end shows what there is to do next.
    """
    search, events, G = work.search, model.watches, work.search.values
    if work.loop.found >= MOST_FOUND:
        return due
    for k in range(events.size):
        fired = events[k].armed == FIRED
        G[START, k], G[END, k] = (-1.0, -1.0) if fired else (events[k].value, events[k].now)
    begin_search(search)
    row = next_row(search)
    while row >= 0:
        theta = search.place[row]
        interpolate(theta, h, work.y0, work.y, model, work.spare)
        watch(t + (theta - 1.0) * h, work.spare, model)
        for k in range(events.size):
            G[row, k] = model.watched[k] if events[k].armed != FIRED else -1.0
        row = next_row(search)
    low, high = search.state.low, search.state.high
    part = due
    for k in range(events.size if high >= 0 else 0):
        if G[high, k] < 0.0 or G[low, k] >= 0.0:
            continue
        if events[k].armed != ARMED:
            part = min(part, search.place[low] if low != START else due)
        elif not _stays(high, k, search):
            part = min(part, search.place[high])
    if part < due:
        work.loop.found += 1
    return part


@inlined
def _stays(high, k, search):
    """Whether event k, which has risen at a row, is above zero from there to the end of the step."""
    G, place = search.values, search.place
    stays = G[END, k] >= 0.0
    for row in (FIRST, MIDDLE, FIRST + 1):
        stays = stays and (place[row] < place[high] or G[row, k] >= 0.0)
    return stays
