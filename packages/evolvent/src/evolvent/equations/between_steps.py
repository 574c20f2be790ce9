"""Frictions between the steps of explicit methods, and what they release."""

import math

from numba import void

from evolvent.compiled.jit import INTEGERS, REAL, VECTOR, indirect, inlined
from evolvent.kernels import constraints, contact, rigid, turning
from evolvent.kernels.calls import (
    end_friction_at,
    excess_at,
    note_extremes_at,
    note_stage_at,
    note_state_at,
    power_at,
    take_step_at,
)
from evolvent.model import DISSIPATED, KEPT, MODEL, RELEASE


def _has_penalties(model):
    return model.info.penalties


@indirect(REAL(REAL, VECTOR, VECTOR, INTEGERS, REAL, REAL, MODEL))
def measure_frictions(t, y0, y, s, h, step, model):
    """Frictions and their rates in the state y at t, the end of a step of length h from the state y0.

    Parameters
    ----------
    step : float, s, as of `end_frictions`

    Returns
    -------
    float, part of the step at which the first friction turns back, as of `turning.until_turn`
    """
    rigid.kinematics(t, y, model)
    if contact.any_contact(model):
        contact.add_contacts(y, y, KEPT, step, 1.0, 0.0, 0.0, model, model.F)
    calls = model.explicit_measure_calls
    for k in range(calls.size):
        note_state_at(model, calls[k])(t, y, s, model)
    turning.measure_rates(y, model)
    return turning.until_turn(y0, y, h, model)


@indirect(void(VECTOR, REAL, MODEL))
def end_frictions(y, step, model):
    """Make the state y the start of the next explicit step for frictions: bristles and losses into its accounts.

    After `measure_frictions` of that state.

    Parameters
    ----------
    step : float, s, infinity at the end of a step, below 0 at the start of a run

    Notes
    -----
    Within a step frictions act over the interval from its start, as under implicit methods (`contact_laws.friction`,
    `coordinate.kept_friction`); their losses are those of the mean forces of both ends.
    """
    taken = 0.0
    if contact.any_contact(model):
        slip, _ = contact.end_contacts(y, model)
        contact.keep_bristles(y, model)
        if step > 0.0:
            y[model.info.rubbed] += slip
            taken += slip
    if step > 0.0:
        calls = model.friction_end_calls
        for k in range(calls.size):
            taken += end_friction_at(model, calls[k])(y, model)
    turning.keep_rates(model)
    y[model.info.nq + model.info.nv + DISSIPATED] += taken


@indirect(void(REAL, VECTOR, MODEL), used_for=_has_penalties)
def release_penalties(t, y, model):
    """Take the strain energy of penalties that are released at t out of the energy balance."""
    rows, account = model.constraints, model.info.nq + model.info.nv + RELEASE
    for k in range(rows.size):
        if t == rows[k].until:
            y[account] -= constraints.energy_in_state(t, y, k, model)


@inlined
def longest_turn(model):
    """Longest step that the records of a model allow at their last rates, s."""
    calls, found = model.step_longest_calls, math.inf
    for k in range(calls.size):
        found = min(found, power_at(model, calls[k])(model))
    return found


@inlined
def excess(t, h, y, s, model):
    """Step of length h to the state y at t, beside the longest that the records of a model allow."""
    calls, found = model.explicit_excess_calls, 0.0
    for k in range(calls.size):
        found = max(found, excess_at(model, calls[k])(t, h, y, s, model))
    return found


@inlined
def take_step(s, model):
    """Make the last evaluation the start of the next step: into the switches s, and what records keep."""
    calls = model.explicit_take_step_calls
    for k in range(calls.size):
        take_step_at(model, calls[k])(s, model)


@inlined
def note_state(t, y, s, model):
    """Make a state the start of the next step, as `take_step`, whose forces have not been evaluated."""
    calls = model.explicit_note_state_calls
    for k in range(calls.size):
        note_state_at(model, calls[k])(t, y, s, model)


@inlined
def note_stage(t, starts, model):
    """Note what is to be known of the last evaluation, in a step to t or (starts 1) at the start of a run."""
    calls = model.explicit_note_stage_calls
    for k in range(calls.size):
        note_stage_at(model, calls[k])(t, starts, model)


@inlined
def note_extremes(s, model):
    """Update the extremes over all steps by the last evaluation, which is at the start or the end of a step."""
    calls = model.samples_note_extremes_calls
    for k in range(calls.size):
        note_extremes_at(model, calls[k])(s, model)
