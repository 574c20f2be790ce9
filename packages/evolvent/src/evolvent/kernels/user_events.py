"""Users' events under implicit methods: when one is due within a step; what events and latches release.

An event fires once, where its value rises through zero. The loop changes the length of the step, by the parabola
through the values at its start, middle and end, until its end lies within `SURE` of a step behind the event. No step
ends just before an event: the next one would be as short as the rest, and what a step leaves of the constraints' rates
would be large accelerations in it.
"""

import math

from evolvent.compiled.jit import inlined
from evolvent.compiled.lookups import event_law_at

#: Part of a step by which the end of the last one may lie behind an event, and that which must be left before one.
SURE, CLOSE = 1e-6, 1e-3
#: Of `events.armed`: the value has not been negative yet, it has, the event has fired.
IDLE, ARMED, FIRED = 0.0, 1.0, 2.0


@inlined
def _value(t, y, model, k):
    """Value of event k."""
    parameters = model.parameters[model.events[k].first : model.events[k].last]
    return event_law_at(model.events[k].law)(t, y, parameters)


@inlined
def start_events(t, y, model):
    """Values at the start of a run, at which no event fires."""
    for k in range(model.events.size):
        value = _value(t, y, model, k)
        model.events[k].value = model.events[k].now = value
        model.events[k].armed = ARMED if value < 0.0 else IDLE


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
    for k in range(model.events.size):
        model.events[k].middle = _value(t, y, model, k)


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
    for k in range(model.events.size):
        before, now = model.events[k].value, _value(t, y, model, k)
        model.events[k].now = now
        if model.events[k].armed != ARMED or h <= 2.0 * least:
            continue
        if now >= 0.0:
            due = True
            part = min(part, _crossing(before, model.events[k].middle, now))
        elif now > before:
            crossing = _crossing(before, model.events[k].middle, now)
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
    before, middle, now = model.events[which].value, model.events[which].middle, model.events[which].now
    return _landing(_crossing(before, middle, now), ahead)


@inlined
def note_values(t, y, model):
    """Values of events at the end of a step of a neighbour."""
    for k in range(model.events.size):
        model.events[k].now = _value(t, y, model, k)


@inlined
def differs(k, events, model):
    """Whether an event that lies at the end of a step of the run, by chance, lies elsewhere in a neighbour."""
    scale = abs(events[k].now) + abs(model.events[k].value)
    return abs(model.events[k].now - events[k].now) > 1e-12 * scale


@inlined
def fire_beside(t, fired, events, model, work):
    """Fire event `fired`, if not below 0, in a neighbour, after the run; returns whether it releases anything."""
    for k in range(events.size):
        model.events[k].value, model.events[k].armed = model.events[k].now, events[k].armed
    if fired < 0:
        return False
    work.log_t[work.loop.latches], work.log_k[work.loop.latches] = t, -1 - fired
    work.loop.latches += 1
    return release(t, fired, model)


@inlined
def _release_rows(t, trigger, rows, s):
    """`release` of the rows of one family."""
    found = False
    for k in range(rows.size):
        if rows[k].event == trigger and rows[k].until > t:
            rows[k].until = t
            s[rows[k].switch] = 1
            found = True
    return found


@inlined
def release(t, trigger, model):
    """Release constraints and switch off motors that wait for a trigger, at t; returns whether any does.

    Parameters
    ----------
    trigger : event k, or -2 - k, the latch of coordinate k
    """
    found = _release_rows(t, trigger, model.constraints, model.switches)
    return _release_rows(t, trigger, model.motors, model.switches) or found


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
    events, found = model.events, False
    for k in range(events.size):
        found = found or (events[k].stops != 0 and events[k].armed == ARMED and events[k].now >= 0.0)
    return found


@inlined
def fire_events(t, model, work):
    """Fire the events that are due at t, the end of an accepted step; returns whether one releases anything."""
    released = False
    for k in range(model.events.size):
        now = model.events[k].now
        model.events[k].value = now
        if model.events[k].armed == ARMED and now >= 0.0:
            model.events[k].armed = FIRED
            work.log_t[work.loop.latches], work.log_k[work.loop.latches] = t, -1 - k
            work.loop.latches += 1
            released = release(t, k, model) or released
        elif model.events[k].armed == IDLE and now < 0.0:
            model.events[k].armed = ARMED
    return released
