"""Tables of calls: what compiled code asks all families that a model has, one table of slots a question.

A walk over the families is a loop over a table:

    for k in range(model.force_calls.size):
        force_at(model, model.force_calls[k])(interval, model)

A question is an attribute of `Family` of the type `Call`; its answer is a function made by a decorator of this module,
that of the signature with which the walk calls it. `Model` looks the slots up when it is made, and `assembly.needs`
loads what the tables name.
"""

from __future__ import annotations

from numba import types, void

from evolvent.algebra.sparse import SPARSE
from evolvent.compiled import lookups
from evolvent.compiled.jit import INTEGERS, REAL, VECTOR, indirect
from evolvent.model import MODEL
from evolvent.model.interval import INTERVAL

_FORCE, _TANGENT = void(INTERVAL, MODEL), void(INTERVAL, MODEL, SPARSE)
_MEASURE, _ENERGY = void(types.int64, REAL, VECTOR, MODEL), void(INTERVAL, MODEL, VECTOR)
_MOMENTUM, _STORED, _RECORDS = void(VECTOR, MODEL, VECTOR), REAL(REAL, MODEL), void(MODEL)
_RATES, _TURN, _POWER = void(VECTOR, MODEL), REAL(VECTOR, VECTOR, REAL, MODEL), REAL(MODEL)
_FRICTION, _NUMBER = REAL(VECTOR, MODEL), types.int64(types.int64, MODEL)
_STATE, _EVENT = (
    void(REAL, VECTOR, INTEGERS, MODEL, VECTOR),
    types.int64(REAL, VECTOR, INTEGERS, MODEL, types.int64, VECTOR),
)
_LOCK, _KICK, _PROJECT = (
    void(REAL, VECTOR, INTEGERS, MODEL),
    void(VECTOR, INTEGERS, MODEL, VECTOR),
    void(VECTOR, INTEGERS, MODEL),
)
_LONGEST, _UNTIL = REAL(VECTOR, INTEGERS, MODEL), REAL(REAL, VECTOR, VECTOR, INTEGERS, MODEL)
_DUE, _PART = types.boolean(VECTOR, INTEGERS, MODEL), void(REAL, REAL, REAL, MODEL)
_INTERPOLATE = void(REAL, VECTOR, VECTOR, MODEL, VECTOR)
_BETWEEN = void(REAL, REAL, REAL, VECTOR, VECTOR, MODEL, VECTOR)
_APPLY = types.UniTuple(REAL, 3)(REAL, REAL, types.int64, VECTOR, INTEGERS, MODEL)
_TURNING, _SPIN = void(REAL, VECTOR, VECTOR, MODEL, VECTOR), void(REAL, VECTOR, VECTOR, MODEL, SPARSE)
_I, _ROW_TANGENT = types.int64, void(types.int64, REAL, types.int64, REAL, REAL, MODEL, SPARSE)
_ROW_MEASURE, _ROW_FORCE = void(_I, REAL, VECTOR, _I, MODEL), void(REAL, REAL, VECTOR, _I, REAL, MODEL, VECTOR)
_ROW_BEND, _ROW_RATES = REAL(_I, MODEL), void(VECTOR, _I, _I, REAL, MODEL, SPARSE)
_ROW_NOTE, _ROW_END = void(_I, REAL, MODEL), void(VECTOR, VECTOR, _I, _I, REAL, MODEL, SPARSE)
_EVENT_VALUES = void(REAL, VECTOR, INTEGERS, MODEL, _I, VECTOR)
_FIRE = types.int64(REAL, _I, _I, VECTOR, INTEGERS, MODEL)
_TAKE, _NOTE_STATE, _NOTE_STAGE = void(INTEGERS, MODEL), void(REAL, VECTOR, INTEGERS, MODEL), void(REAL, _I, MODEL)
_EXCESS = REAL(REAL, REAL, VECTOR, INTEGERS, MODEL)
_UNTIL_EVENT, _CHANGE = REAL(REAL, REAL, _I, MODEL), REAL(REAL, VECTOR, INTEGERS, MODEL)
_SCALE, _TIES = void(REAL, VECTOR, MODEL), types.int64(REAL, MODEL)

#: Decorators of the answers to the questions of `Family`.
force = indirect(_FORCE)
tangent = indirect(_TANGENT)
measure = indirect(_MEASURE)
energy = indirect(_ENERGY)
momentum = indirect(_MOMENTUM)
stored = indirect(_STORED)
note = indirect(_RECORDS)
rates = indirect(_RATES)
until_turn = indirect(_TURN)
power = indirect(_POWER)
friction_change = indirect(_POWER)
end_friction = indirect(_FRICTION)
contact_set = indirect(_NUMBER)
apply = indirect(_APPLY)
turning = indirect(_TURNING)
turning_tangent = indirect(_SPIN)
row_measure = indirect(_ROW_MEASURE)
row_bend = indirect(_ROW_BEND)
row_force = indirect(_ROW_FORCE)
row_tangent = indirect(_ROW_TANGENT)
row_rates = indirect(_ROW_RATES)
row_end = indirect(_ROW_END)
row_note = indirect(_ROW_NOTE)
event_values = indirect(_EVENT_VALUES)
fire = indirect(_FIRE)
release = indirect(_FIRE)
reached = indirect(_NUMBER)
take_step = indirect(_TAKE)
note_state = indirect(_NOTE_STATE)
note_stage = indirect(_NOTE_STAGE)
scale = indirect(_SCALE)
kinematics = indirect(_SCALE)
ties = indirect(_TIES)
until_event = indirect(_UNTIL_EVENT)
excess = indirect(_EXCESS)
change = indirect(_CHANGE)
state = indirect(_STATE)
apply_change = indirect(_EVENT)
lock = indirect(_LOCK)
kick = indirect(_KICK)
project = indirect(_PROJECT)
longest_step = indirect(_LONGEST)
until_change = indirect(_UNTIL)
is_due = indirect(_DUE)
note_part = indirect(_PART)
interpolate = indirect(_INTERPOLATE)
between = indirect(_BETWEEN)

#: ``force_at(model, slot)``: the function of a slot, for compiled code.
force_at = lookups.by_slot(_FORCE)
tangent_at = lookups.by_slot(_TANGENT)
measure_at = lookups.by_slot(_MEASURE)
energy_at = lookups.by_slot(_ENERGY)
momentum_at = lookups.by_slot(_MOMENTUM)
stored_at = lookups.by_slot(_STORED)
note_at = lookups.by_slot(_RECORDS)
rates_at = lookups.by_slot(_RATES)
until_turn_at = lookups.by_slot(_TURN)
power_at = lookups.by_slot(_POWER)
friction_change_at = lookups.by_slot(_POWER)
end_friction_at = lookups.by_slot(_FRICTION)
contact_set_at = lookups.by_slot(_NUMBER)
apply_at = lookups.by_slot(_APPLY)
turning_at = lookups.by_slot(_TURNING)
turning_tangent_at = lookups.by_slot(_SPIN)
row_measure_at = lookups.by_slot(_ROW_MEASURE)
row_bend_at = lookups.by_slot(_ROW_BEND)
row_force_at = lookups.by_slot(_ROW_FORCE)
row_tangent_at = lookups.by_slot(_ROW_TANGENT)
row_rates_at = lookups.by_slot(_ROW_RATES)
row_end_at = lookups.by_slot(_ROW_END)
row_note_at = lookups.by_slot(_ROW_NOTE)
event_values_at = lookups.by_slot(_EVENT_VALUES)
fire_at = lookups.by_slot(_FIRE)
release_at = lookups.by_slot(_FIRE)
reached_at = lookups.by_slot(_NUMBER)
take_step_at = lookups.by_slot(_TAKE)
note_state_at = lookups.by_slot(_NOTE_STATE)
note_stage_at = lookups.by_slot(_NOTE_STAGE)
scale_at = lookups.by_slot(_SCALE)
kinematics_at = lookups.by_slot(_SCALE)
ties_at = lookups.by_slot(_TIES)
until_event_at = lookups.by_slot(_UNTIL_EVENT)
excess_at = lookups.by_slot(_EXCESS)
change_at = lookups.by_slot(_CHANGE)
state_at = lookups.by_slot(_STATE)
apply_change_at = lookups.by_slot(_EVENT)
lock_at = lookups.by_slot(_LOCK)
kick_at = lookups.by_slot(_KICK)
project_at = lookups.by_slot(_PROJECT)
longest_step_at = lookups.by_slot(_LONGEST)
until_change_at = lookups.by_slot(_UNTIL)
is_due_at = lookups.by_slot(_DUE)
note_part_at = lookups.by_slot(_PART)
interpolate_at = lookups.by_slot(_INTERPOLATE)
between_at = lookups.by_slot(_BETWEEN)
