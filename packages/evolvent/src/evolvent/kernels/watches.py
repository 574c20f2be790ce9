"""Events: their values and what they do, and under implicit methods when one that is watched is due within a step.

An event fires once, where its value rises through zero. The loop changes the length of the step, by the parabola
through the values at its start, middle and end, until its end lies within `SURE` of a step behind the event. No step
ends just before an event: the next one would be as short as the rest, and what a step leaves of the constraints' rates
would be large accelerations in it.
"""

import math

from evolvent.compiled.jit import inlined
from evolvent.kernels.calls import event_values_at, fire_at, release_at

#: Part of a step by which the end of the last one may lie behind an event, and that which must be left before one.
SURE, CLOSE = 1e-6, 1e-3
#: Of `events.armed`: the value has not been negative yet, it has, the event has fired.
IDLE, ARMED, FIRED = 0.0, 1.0, 2.0


#: Bits of what an event does: it stops the run, and it changes forces or constraints.
STOPS, CHANGES = 1, 2


@inlined
def watch(t, y, model):
    """Values of the events that are watched, in a state of an implicit method, into `Model.watched`."""
    calls, firsts, n = model.event_values_calls, model.event_firsts, model.watches.size
    for i in range(calls.size):
        if firsts[i] - firsts[0] < n:
            event_values_at(model, calls[i])(t, y, model.switches, model, firsts[i] - firsts[0], model.watched)


@inlined
def fire_event(t, number, ends, y, s, model):
    """Carry out an event, by its number among all; returns bits of `STOPS` and `CHANGES`.

    Parameters
    ----------
    ends : as of `release`
    """
    calls, firsts, group = model.event_fire_calls, model.event_firsts, 0
    for i in range(calls.size):
        group = i if firsts[i] <= number else group
    return fire_at(model, calls[group])(t, number - firsts[group], ends, y, s, model)


@inlined
def release(t, trigger, ends, y, s, model):
    """End all records that wait for a trigger, at t; returns whether there are some.

    Parameters
    ----------
    trigger : event k of a user, or -2 - k, the latch of coordinate k
    ends : 1 under implicit methods, of which records end by their time `until`; 0 under explicit ones, which see
        switches alone, and have their balance among the accounts of y
    """
    calls, found = model.switching_release_calls, False
    for k in range(calls.size):
        found = release_at(model, calls[k])(t, trigger, ends, y, s, model) != 0 or found
    return found


@inlined
def start_events(t, y, model):
    """Values at the start of a run, at which no event fires."""
    watch(t, y, model)
    for k in range(model.watches.size):
        value = model.watched[k]
        model.watches[k].value = model.watches[k].now = value
        model.watches[k].armed = ARMED if value < 0.0 else IDLE


@inlined
def _crossing(a, b, c):
    """Part of a step at which the parabola through the values at its start, middle and end rises through zero.

    a is below zero; where there is no such place that of the straight line, which may lie before the step.
    """
    slope, bend = 4.0 * b - 3.0 * a - c, 2.0 * (a + c - 2.0 * b)
    square = slope * slope - 4.0 * bend * a
    if square >= 0.0 and slope + math.sqrt(square) > 0.0:
        return -2.0 * a / (slope + math.sqrt(square))
    return a / (a - c) if c != a else math.inf


@inlined
def note_middles(t, y, model):
    """Values of events in the middle of a step, in the state y at t."""
    watch(t, y, model)
    for k in range(model.watches.size):
        model.watches[k].middle = model.watched[k]


@inlined
def until_event(t, h, least, event_step, extended, y, model):
    """Length, as a part of h, of the step to try in place of one of length h, which ends in the state y at t; or 1.

    After `note_middles`.

    Parameters
    ----------
    least : float, s, length of a step that is not shortened
    event_step : float, s, limit of the step where its length is being changed, else infinite
    extended : int, not 0 where the step was made longer before
    """
    part, ahead, due = 1.0, 1.0, False
    watch(t, y, model)
    for k in range(model.watches.size):
        before, now = model.watches[k].value, model.watched[k]
        model.watches[k].now = now
        if model.watches[k].armed != ARMED or h <= 2.0 * least:
            continue
        if now >= 0.0:
            due = True
            part = min(part, _crossing(before, model.watches[k].middle, now))
        elif now > before:
            crossing = _crossing(before, model.watches[k].middle, now)
            ahead = min(ahead, crossing - 1.0 if crossing >= 1.0 else 1.0)
    if due:
        return 1.0 if part > 1.0 - SURE else max(part + 0.5 * SURE, least / h)
    if ahead >= CLOSE or extended != 0:
        return 1.0
    return 0.5 if event_step == math.inf else 1.0 + 1.5 * ahead + 0.5 * SURE


@inlined
def _landing(crossing, ahead):
    """Part of a step at whose end the next one is to lie, behind an event at `crossing`, which may lie ahead."""
    return (1.0 + 1.5 * (crossing - 1.0) if ahead else crossing) + 0.5 * SURE


@inlined
def until_event_beside(part, events, model):
    """Part of the step of a neighbour, whose end is noted, at whose end the next one is to lie, as `until_event`; or 1.

    Parameters
    ----------
    part : float, what was taken for the run; `events` : those of the run
    """
    which, first = -1, math.inf
    for k in range(events.size):
        before, now = events[k].value, events[k].now
        if events[k].armed == ARMED and now > before:
            crossing = _crossing(before, events[k].middle, now)
            if (now >= 0.0 or crossing >= 1.0) and crossing < first:
                which, first = k, crossing
    ahead = first > 1.0
    if which < 0 or abs(_landing(first, ahead) - part) > 1e-9:  # by something else, or by a part that is fixed
        return 1.0
    before, middle, now = model.watches[which].value, model.watches[which].middle, model.watches[which].now
    return _landing(_crossing(before, middle, now), ahead)


@inlined
def note_values(t, y, model):
    """Values of events at the end of a step of a neighbour."""
    watch(t, y, model)
    for k in range(model.watches.size):
        model.watches[k].now = model.watched[k]


@inlined
def differs(k, events, model):
    """Whether an event that lies at the end of a step of the run, by chance, lies elsewhere in a neighbour."""
    scale = abs(events[k].now) + abs(model.watches[k].value)
    return abs(model.watches[k].now - events[k].now) > 1e-12 * scale


@inlined
def fire_beside(t, fired, events, model, work):
    """Fire event `fired`, if not below 0, in a neighbour, after the run; returns whether it releases anything."""
    for k in range(events.size):
        model.watches[k].value, model.watches[k].armed = model.watches[k].now, events[k].armed
    if fired < 0:
        return False
    work.log_t[work.loop.latches], work.log_k[work.loop.latches] = t, -1 - fired
    work.loop.latches += 1
    return fire_event(t, fired + model.event_firsts[0], 1, work.y, model.switches, model) & CHANGES != 0


@inlined
def has_released(t, h, model):
    """Whether a constraint is released at t, the end of a step of length h."""
    rows, found = model.constraints, False
    for k in range(rows.size):
        found = found or abs(rows[k].until - t) < 0.5 * h
    return found


@inlined
def is_stopped(model):
    """Whether an event that stops the run is due at the end of an accepted step."""
    events, found = model.watches, False
    for k in range(events.size):
        found = found or (events[k].stops != 0 and events[k].armed == ARMED and events[k].now >= 0.0)
    return found


@inlined
def fire_events(t, model, work):
    """Fire the events that are due at t, the end of an accepted step; returns whether one releases anything."""
    released = False
    for k in range(model.watches.size):
        now = model.watches[k].now
        model.watches[k].value = now
        if model.watches[k].armed == ARMED and now >= 0.0:
            model.watches[k].armed = FIRED
            work.log_t[work.loop.latches], work.log_k[work.loop.latches] = t, -1 - k
            work.loop.latches += 1
            does = fire_event(t, k + model.event_firsts[0], 1, work.y, model.switches, model)
            released = does & CHANGES != 0 or released
        elif model.watches[k].armed == IDLE and now < 0.0:
            model.watches[k].armed = ARMED
    return released
