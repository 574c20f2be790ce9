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
end_friction = indirect(_FRICTION)
contact_set = indirect(_NUMBER)
apply = indirect(_APPLY)
turning = indirect(_TURNING)
turning_tangent = indirect(_SPIN)
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
end_friction_at = lookups.by_slot(_FRICTION)
contact_set_at = lookups.by_slot(_NUMBER)
apply_at = lookups.by_slot(_APPLY)
turning_at = lookups.by_slot(_TURNING)
turning_tangent_at = lookups.by_slot(_SPIN)
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
