"""Users' events under implicit methods: when one is due within a step, and the joints that it releases.

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
def fire_events(t, model, work):
    """Fire the events that are due at t, the end of an accepted step; returns whether a joint is released."""
    joints, released = model.flexible.joints, False
    for k in range(model.events.size):
        now = model.events[k].now
        model.events[k].value = now
        if model.events[k].armed == ARMED and now >= 0.0:
            model.events[k].armed = FIRED
            work.log_t[work.loop.latches], work.log_k[work.loop.latches] = t, -1 - k
            work.loop.latches += 1
            for j in range(joints.size):
                if joints[j].event == k and joints[j].until > t:
                    joints[j].until = t
                    model.flexible.switches[joints[j].switch] = 1
                    released = True
        elif model.events[k].armed == IDLE and now < 0.0:
            model.events[k].armed = ARMED
    return released
