"""The start of a run by implicit steps, and the end of a step: what the next one needs, and what families book."""

from numba import void

from evolvent.compiled.jit import REAL, VECTOR, indirect
from evolvent.kernels.calls import force_at
from evolvent.model import MODEL
from evolvent.model.interval import state_interval
from evolvent.model.powers import N_POWERS


@indirect(void(REAL, REAL, REAL, REAL, VECTOR, VECTOR, MODEL, VECTOR))
def end_step(t, h, share, again, y, dq, model, booked):
    """Make the end of a step the start of the next one; accounts in its state y.

    Parameters
    ----------
    t, h : float, s, end and length of the step; h = 0 where a run begins at a state
    share, again : of `evolvent.model.interval.NUMBERS`
    dq : (nv,) float, increments over the step
    booked : (N_POWERS,) float, output, J, work and losses that families book themselves
    """
    at, calls = model.interval, model.implicit_end_step_calls
    for i in range(N_POWERS):
        booked[i] = 0.0
    at.t, at.tm, at.h, at.share, at.again = t, t, h, share, again
    interval = state_interval(at, y, dq, dq, dq, booked, model.switches, y)
    for k in range(calls.size):
        force_at(model, calls[k])(interval, model)
    at.h = at.again = at.rub = 0.0  # no time has passed since


@indirect(void(REAL, REAL, REAL, VECTOR, MODEL, VECTOR))
def start_run(t, share, again, y, model, booked):
    """Start a run at the state y at t, before its first forces.

    Parameters
    ----------
    share : of `evolvent.model.interval.NUMBERS`; again : 1 where it goes on after forces have changed at once, else 0
    booked : (N_POWERS,) float, scratch
    """
    at, calls = model.interval, model.implicit_start_calls
    at.t, at.tm, at.h, at.share, at.again = t, t, 0.0, share, again
    interval = state_interval(at, y, y, y, y, booked, model.switches, y)
    for k in range(calls.size):
        force_at(model, calls[k])(interval, model)
    at.again = 0.0
