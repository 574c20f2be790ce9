"""Tables of calls: what compiled code asks all families that a model has, one table of slots a question.

A walk over the families is a loop over a table:

    for k in range(model.force_calls.size):
        force_at(model, model.force_calls[k])(interval, model)

A question is an attribute of the type `Call` of `Family`, or of one of its groups (`evolvent.model.questions`): the
table of `samples.evaluate` is `Model.samples_evaluate_calls`. Its answer is a function made by a decorator of this
module, that of the signature with which the walk calls it. `Model` looks the slots up when it is made, and
`assembly.needs` loads what the tables name.
"""

from __future__ import annotations

from typing import Any

from numba import types, void

from evolvent.algebra.sparse import SPARSE
from evolvent.compiled import lookups
from evolvent.compiled.jit import CUBE, INTEGERS, MATRIX, REAL, VECTOR, indirect
from evolvent.model import MODEL
from evolvent.model.interval import INTERVAL

INT = types.int64


def _question(signature: Any) -> tuple[Any, Any]:
    """Decorator of answers of a signature, and ``at(model, slot)``: the function of a slot, for compiled code."""
    return indirect(signature), lookups.by_slot(signature)


force, force_at = _question(void(INTERVAL, MODEL))
tangent, tangent_at = _question(void(INTERVAL, MODEL, SPARSE))
measure, measure_at = _question(void(INT, REAL, VECTOR, MODEL))
energy, energy_at = _question(void(INTERVAL, MODEL, VECTOR))
momentum, momentum_at = _question(void(VECTOR, MODEL, VECTOR))
stored, stored_at = _question(REAL(REAL, MODEL))
note, note_at = _question(void(MODEL))
rates, rates_at = _question(void(VECTOR, MODEL))
kinematics, kinematics_at = _question(void(REAL, VECTOR, MODEL))
until_turn, until_turn_at = _question(REAL(VECTOR, VECTOR, REAL, MODEL))
power, power_at = _question(REAL(MODEL))
friction_change, friction_change_at = power, power_at
end_friction, end_friction_at = _question(REAL(VECTOR, MODEL))
contact_set, contact_set_at = _question(INT(INT, MODEL))
passing, passing_at = _question(REAL(CUBE, MATRIX, CUBE, MATRIX, MODEL))
apply, apply_at = _question(types.UniTuple(REAL, 3)(REAL, REAL, INT, VECTOR, INTEGERS, MODEL))
turning, turning_at = _question(void(REAL, VECTOR, VECTOR, MODEL, VECTOR))
turning_tangent, turning_tangent_at = _question(void(REAL, VECTOR, VECTOR, MODEL, SPARSE))
row_measure, row_measure_at = _question(void(INT, REAL, VECTOR, INT, MODEL))
row_bend, row_bend_at = _question(REAL(INT, MODEL))
row_force, row_force_at = _question(void(REAL, REAL, VECTOR, INT, REAL, MODEL, VECTOR))
row_tangent, row_tangent_at = _question(void(INT, REAL, INT, REAL, REAL, MODEL, SPARSE))
row_rates, row_rates_at = _question(void(VECTOR, INT, INT, REAL, MODEL, SPARSE))
row_end, row_end_at = _question(void(VECTOR, VECTOR, INT, INT, REAL, MODEL, SPARSE))
row_note, row_note_at = _question(void(INT, REAL, MODEL))
event_values, event_values_at = _question(void(REAL, VECTOR, INTEGERS, MODEL, INT, VECTOR))
fire, fire_at = _question(INT(REAL, INT, INT, VECTOR, INTEGERS, MODEL))
release, release_at = _question(INT(REAL, INT, INT, VECTOR, INTEGERS, MODEL))
reached, reached_at = _question(INT(INT, MODEL))
take_step, take_step_at = _question(void(INTEGERS, MODEL))
note_extremes, note_extremes_at = _question(void(INTEGERS, MODEL))
note_state, note_state_at = _question(void(REAL, VECTOR, INTEGERS, MODEL))
note_stage, note_stage_at = _question(void(REAL, INT, MODEL))
scale, scale_at = _question(void(REAL, VECTOR, MODEL))
ties, ties_at = _question(INT(REAL, MODEL))
until_event, until_event_at = _question(REAL(REAL, REAL, INT, MODEL))
excess, excess_at = _question(REAL(REAL, REAL, VECTOR, INTEGERS, MODEL))
change, change_at = _question(REAL(REAL, VECTOR, INTEGERS, MODEL))
state, state_at = _question(void(REAL, VECTOR, INTEGERS, MODEL, VECTOR))
apply_change, apply_change_at = _question(INT(REAL, VECTOR, INTEGERS, MODEL, INT, VECTOR))
lock, lock_at = _question(void(REAL, VECTOR, INTEGERS, MODEL))
kick, kick_at = _question(void(VECTOR, INTEGERS, MODEL, VECTOR))
project, project_at = _question(void(VECTOR, INTEGERS, MODEL))
longest_step, longest_step_at = _question(REAL(VECTOR, INTEGERS, MODEL))
until_change, until_change_at = _question(REAL(REAL, VECTOR, VECTOR, INTEGERS, MODEL))
is_due, is_due_at = _question(types.boolean(VECTOR, INTEGERS, MODEL))
note_part, note_part_at = _question(void(REAL, REAL, REAL, MODEL))
interpolate, interpolate_at = _question(void(REAL, VECTOR, VECTOR, MODEL, VECTOR))
between, between_at = _question(void(REAL, REAL, REAL, VECTOR, VECTOR, MODEL, VECTOR))
