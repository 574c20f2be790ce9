"""The first event within a step of an explicit method: looked for between the ends of the step, and refined there."""

from __future__ import annotations

from evolvent.compiled.jit import MATRIX, REAL, VECTOR, indirect, inlined
from evolvent.equations.events import USED_FOR as EVENTS, walk_events
from evolvent.model import MODEL
from evolvent.model.layout import DUE
from evolvent.solvers.time.event_search import END, START, begin_search, next_row
from evolvent.solvers.time.explicit.events import FOUND, NO_EVENT, WORKSPACE, bracket, highest, largest
from evolvent.solvers.time.explicit.stages import find_state, interpolate


@inlined
def interpolate_scalars(P, y, K, h, theta, scalars, out):
    """`interpolate` of the components `scalars` of the state alone."""
    for k in range(scalars.size):
        n = scalars[k]
        out[n] = y[n]
        for i in range(P.shape[0]):
            a = theta * (P[i, 0] + theta * (P[i, 1] + theta * (P[i, 2] + theta * P[i, 3])))
            out[n] += h * a * K[i, n]


@indirect(REAL(MATRIX, VECTOR, VECTOR, MATRIX, MATRIX, REAL, REAL, REAL, REAL, REAL, MODEL, WORKSPACE), used_for=EVENTS)
def event_in_step(A, b, c, P, Q, t, h, target, end, until, model, work):
    """Part of a step at which its first event falls; NO_EVENT where it has none."""
    search, g, g0 = work.search, work.g, work.g0
    walk_events(target, work.y1, work.s, model, g)
    for k in range(g.size):
        search.values[START, k], search.values[END, k] = g0[k], g[k]
    begin_search(search)
    row, by_state = next_row(search), model.event_values_calls.size > 0 or model.info.brakes > 0
    while row >= 0:
        theta = search.place[row]
        if by_state:
            interpolate(Q, work.y, work.K, h, theta, work.w)
        else:
            interpolate_scalars(Q, work.y, work.K, h, theta, work.scalars, work.w)
        walk_events(t + theta * h, work.w, work.s, model, g)
        for k in range(g.size):
            search.values[row, k] = g[k]
        row = next_row(search)
    part, first, last = NO_EVENT, search.state.low, search.state.high
    if last >= 0:
        low, high = search.place[first], search.place[last]
        for k in range(g.size):
            g0[k] = search.values[first, k]
        part = root_in_step(A, b, c, P, t, h, target, until, low, high, model, work)
        if part == NO_EVENT:
            for k in range(g.size):
                g0[k] = search.values[START, k]
    if by_state:  # whose evaluation at the end of the step is the last one
        walk_events(target, work.y1, work.s, model, g)
    else:
        for k in range(g.size):
            g[k] = search.values[END, k]
    if part == NO_EVENT and target == end and largest(model, work) >= DUE:
        return 1.0
    return part


@inlined
def root_in_step(A, b, c, P, t, h, target, until, low, high, model, work):
    """Part of a step at which the first event between the parts low and high falls; NO_EVENT where none does.

    Methods without a continuous extension of their order look for events in a coarser one.
    """
    if low > 0.0:
        find_state(A, b, c, P, t, h, low, until, model, work)
        f_low = highest(model, t + low * h, work.w, work.s, work)
    else:
        f_low = highest(model, t, work.y, work.s, work)
    if high < 1.0:
        find_state(A, b, c, P, t, h, high, until, model, work)
        f_high = highest(model, t + high * h, work.w, work.s, work)
    else:
        f_high = highest(model, target, work.y1, work.s, work)
    if f_high < 0.0:
        return NO_EVENT
    for trial in range(80):
        if f_low >= 0.0 or (high - low) * h <= 2e-16 * max(abs(target), h):
            break
        middle = bracket(low, f_low, high, f_high, trial % 3 == 2)
        if middle <= low or middle >= high:
            middle = 0.5 * (low + high)
        find_state(A, b, c, P, t, h, middle, until, model, work)
        f = highest(model, t + middle * h, work.w, work.s, work)
        if f >= 0.0:
            high, f_high = middle, f
            if f < 1e-13:
                break
        else:
            low, f_low = middle, f
    note_found(t, h, target, high, A, b, c, P, until, model, work)
    return high


@inlined
def note_found(t, h, target, part, A, b, c, P, until, model, work):
    """Note which events have risen at the part of a step that `root_in_step` has found: work.g0 is `FOUND`.

    The state there differs by round-off from the one in which they are carried out, which is brought back onto its
    constraints.
    """
    if part < 1.0:
        find_state(A, b, c, P, t, h, part, until, model, work)
        highest(model, t + part * h, work.w, work.s, work)
    else:
        highest(model, target, work.y1, work.s, work)
    for k in range(model.info.releases, work.g.size - model.info.brakes):
        if work.g0[k] < 0.0 and work.g[k] >= 0.0:
            work.g0[k] = FOUND
