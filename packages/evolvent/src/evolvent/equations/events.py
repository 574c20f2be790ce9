"""Events: of families whose records change between steps, a user's events, joint coordinates latch."""

from numba import types, void

from evolvent.compiled.jit import INTEGERS, REAL, VECTOR, indirect, inlined
from evolvent.kernels.calls import apply_change_at, event_values_at, state_at
from evolvent.kernels.watches import STOPS, fire_event
from evolvent.model import MODEL


def USED_FOR(model):  # noqa: N802
    """Events."""
    return model.info.ne


@inlined
def walk_events(t, y, s, model, g):
    """Values of all events; an event fires where its value is not negative.

    Parameters
    ----------
    g : (ne,) float, output: those that change the number of moving nodes, the user's events, the latch of every
        coordinate, the changes of what friction holds
    """
    calls, firsts = model.event_values_calls, model.event_firsts
    for i in range(calls.size):
        event_values_at(model, calls[i])(t, y, s, model, firsts[i], g)
    calls = model.node_events_values_calls
    for k in range(calls.size):
        state_at(model, calls[k])(t, y, s, model, g)


@indirect(void(REAL, VECTOR, INTEGERS, MODEL, VECTOR))
def event_values(t, y, s, model, g):
    """`walk_events`, called by address."""
    walk_events(t, y, s, model, g)


@indirect(types.int64(REAL, VECTOR, INTEGERS, MODEL, types.int64, VECTOR))
def apply_event(t, y, s, model, k, g):
    """Carry out event k on the state; returns 1 if the run is to stop there, -1 if it cannot be carried out.

    Those that happen with it, by g, the values of the events, are carried out as well; their values are infinite then.
    """
    calls = model.node_events_apply_calls
    for i in range(calls.size):
        answer = apply_change_at(model, calls[i])(t, y, s, model, k, g)
        if answer <= 1:
            return answer
    return fire_event(t, k, 0, y, s, model) & STOPS
