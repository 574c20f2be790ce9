"""What the loops of explicit methods carry, and their events: found, carried out and logged."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import types

from evolvent.assembly.blocks import is_of
from evolvent.compiled.jit import REAL, entry, indirect, inlined
from evolvent.compiled.pointer import Struct, array, record, struct
from evolvent.equations.events import apply_event, event_values
from evolvent.kernels.blocks import SCALAR
from evolvent.model import MODEL
from evolvent.model.layout import DUE
from evolvent.model.registry import events
from evolvent.solvers.time.event_search import START, EventSearch

# status codes of a loop
BUDGET, DONE, STOPPED, LOG_FULL, NOT_FINITE, TOO_SMALL, NO_THREAD = 0, 1, 2, 3, -1, -2, -3
#: Part of a step without an event.
NO_EVENT = 2.0
#: Value in work.g0 of events that were found in a step: they are due although they may miss zero by round-off.
FOUND = -math.inf
#: A loop's counters and clock. sample, grid, next_break: numbers of the next sample, step of the grid and break;
#: starts: 1 before the first step; stale: 1 where the first stage is not that of the state; origin: s, of the grid of
#: steps; last_error: of the last step accepted; turn: s, length of the next step, at whose end a friction turns back;
#: rubs0, rubs1: W, powers of frictions at both ends of a step.
LOOP = np.dtype(
    [(name, np.int64) for name in ("steps", "rhs_evaluations", "rejected", "fired", "sample", "grid", "next_break",
                                   "starts", "stale")]
    + [(name, np.float64) for name in ("time", "step", "origin", "last_error", "turn", "rubs0", "rubs1")],
    align=True,
)  # fmt: skip


class ExplicitWorkspace(Struct):
    """What a time loop carries from call to call.

    Attributes
    ----------
    y, s : state, overwritten
    loop : record (see `LOOP`)
    samples : (nt,) float, times to keep the state at
    out_y, out_s : (nt, ny) float, (nt, ns) int, states kept
    log_t, log_k : (nlog,) float and int, time and number of every event; a loop returns where they run short
    jump : (ny,) float, what frictions have added to the end of the step; (0,) without
    K : (stages, ny) float, stages; w, y1 : (ny,) and g, g0 : (ne,) float, scratch
    scalars : (n,) int, indices in the state of what events that are always due depend on (`scalars_of_events`)
    search : EventSearch, of events within a step
    R0, x0, R1, x1 : (nb, 3, 3) and (nb, 3) float, rotations and positions of the bodies at both ends of a step
    """

    y: np.ndarray = array(1)
    s: np.ndarray = array(1, np.int64)
    loop: np.record = record(LOOP)
    samples: np.ndarray = array(1)
    out_y: np.ndarray = array(2)
    out_s: np.ndarray = array(2, np.int64)
    log_t: np.ndarray = array(1)
    log_k: np.ndarray = array(1, np.int64)
    K: np.ndarray = array(2)
    w: np.ndarray = array(1)
    y1: np.ndarray = array(1)
    jump: np.ndarray = array(1)
    g: np.ndarray = array(1)
    g0: np.ndarray = array(1)
    scalars: np.ndarray = array(1, np.int64)
    search: EventSearch = struct(EventSearch)
    R0: np.ndarray = array(3)
    R1: np.ndarray = array(3)
    x0: np.ndarray = array(2)
    x1: np.ndarray = array(2)


def always_due(model: Any) -> np.ndarray:
    """Which events fire from zero on wherever their values come from: the first and the last ones."""
    found = np.zeros(int(model.info.ne), dtype=bool)
    found[: int(model.info.releases)] = True
    found[found.size - int(model.info.brakes) :] = True
    return found


def scalars_of_events(model: Any) -> np.ndarray:
    """Indices in the state of the angles and rates that are coordinates of records with events that are always due."""
    blocks = model.blocks
    own = {family.name for family, one in events() if one.values is None}
    found = blocks[(blocks["kind"] == SCALAR) & np.any([is_of(blocks, name) for name in own], axis=0)]
    return np.concatenate([found["iq"], found["iv"]])


WORKSPACE = ExplicitWorkspace._numba_type_
_I = types.int64


@inlined
def highest(model, t, y, s, work):
    """The largest value of the events that can fire in a state; all values go to work.g."""
    event_values(t, y, s, model, work.g)
    return largest(model, work)


@inlined
def largest(model, work):
    """The largest of the values work.g of events that can fire (some always, a user's only once it was negative)."""
    value = -1.0
    first, brakes = model.info.releases, work.g.size - model.info.brakes
    for k in range(work.g.size):
        if k < first or k >= brakes or work.g0[k] < 0.0:
            value = max(value, work.g[k])
    return value


@entry(types.int64)
@inlined
def rounds(releases):
    """How often `fire` looks for events at one time; each round carries out one, or some that happen together."""
    return releases + 64


@inlined
def log_is_short(model, work):
    """Whether the log may not hold all that `fire` could write into it."""
    n = model.info.releases
    return work.log_t.size - work.loop.fired < rounds(n) * (n // 2 + 1)


@inlined
def note_event(t, k, work):
    """Note event k at time t."""
    n = work.loop.fired
    work.log_t[n], work.log_k[n] = t, k
    work.loop.fired = n + 1


@indirect(_I(MODEL, REAL, WORKSPACE))
def fire(model, t, work):
    """Carry out every event that is due at time t; some of them happen together.

    Returns 1 to stop the run, a negative status where it has failed.

    Notes
    -----
    An event that was found may miss zero by round-off. It would then rise again in the next step, and so without end,
    as no step between is longer than the round-off of the time. So it is carried out, and then stands at zero.
    """
    y, s, g, missed = work.y, work.s, work.g, work.search.values[START]
    first, stop = model.info.releases, 0
    for k in range(g.size):
        missed[k] = 0.0
    for _ in range(rounds(first)):
        event_values(t, y, s, model, g)
        due = -1
        for k in range(g.size):
            always = k < first or k >= g.size - model.info.brakes
            if (always and g[k] >= DUE) or (not always and is_due(work.g0[k], g[k])):
                due = k
                break
        if due < 0:
            break
        if due >= first:
            missed[due] = min(g[due], 0.0) if due < g.size - model.info.brakes else 0.0
            work.g0[due] = max(g[due], 0.0) if missed[due] < 0.0 else g[due]
        note_event(t, due, work)
        answer = apply_event(t, y, s, model, due, g)
        if answer < 0:
            return NO_THREAD
        for k in range(due + 1, first):
            if g[k] == math.inf:
                note_event(t, k, work)
        stop = max(stop, answer)
    event_values(t, y, s, model, g)
    for k in range(g.size):
        work.g0[k] = 0.0 if 2.0 * missed[k] <= g[k] < 0.0 else g[k]
    return stop


@inlined
def is_due(before, value):
    """Whether an event is due that fires where its value rises to zero, from a value before."""
    return before == FOUND or (before < 0.0 and value >= 0.0)


@inlined
def next_break(model, work, t):
    """Time of the next break after t, or infinity."""
    i = work.loop.next_break
    while i < model.breaks.size and model.breaks[i] <= t:
        i += 1
    work.loop.next_break = i
    if i < model.breaks.size:
        return model.breaks[i]
    return math.inf


@inlined
def bracket(low, f_low, high, f_high, bias):
    """A point inside a bracket of a sign change: false position (Illinois), or the middle where that stalls."""
    if bias or f_high == f_low:
        return 0.5 * (low + high)
    return min(max(low - f_low * (high - low) / (f_high - f_low), low), high)
