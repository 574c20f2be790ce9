"""Users' events under implicit methods: when one is due within a step; what events and latches release.

An event fires once, where its value rises through zero. The loop shortens the step by a secant until its end lies
within `SURE` of a step behind the event.
"""

from evolvent.jit import event_law_at, inlined

#: Part of a step by which the end of the last one may lie behind an event.
SURE = 1e-6
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
def until_event(t, h, least, y, model):
    """Part of a step of length h, which ends in the state y at t, after which an event is first due; 1 for none.

    Parameters
    ----------
    least : float, s, length of a step that is not shortened
    """
    part = 1.0
    for k in range(model.events.size):
        model.events[k].now = now = _value(t, y, model, k)
        if model.events[k].armed == ARMED and now >= 0.0 and h > 2.0 * least:
            part = min(part, model.events[k].value / (model.events[k].value - now))
    return 1.0 if part > 1.0 - SURE else max(part, least / h)


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
    """Release joints and switch off motors that wait for a trigger, at t; returns whether any does.

    Parameters
    ----------
    trigger : event k, or -2 - k, the latch of coordinate k
    """
    found = _release_rows(t, trigger, model.flexible.joints, model.flexible.switches)
    return _release_rows(t, trigger, model.flexible.motors, model.flexible.switches) or found


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
